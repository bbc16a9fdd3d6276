"""`kedfem sweep`: keys, values, rows of points, continuing, files, refusals."""

import json
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from rich.console import Console

from kedfem.accuracy import reduction
from kedfem.accuracy.prepared import alike
from kedfem.analysis import analyse
from kedfem.errors import SceneError
from kedfem.scene import scene_from
from kedfem.sweep import BaseScene, SweepOptions, SweepResult, axes_of, sweep
from kedfem.sweep.points import GROWTH, Job, Row, SharedChoices, extremes, finished
from kedfem.tables.several import sweep_tables
from tests import scenes
from tests.scenes import bar, constant_speed, material

G = 9.81
RHO, L, W = 7850.0, 0.5, 0.02  # an arm of steel, square
MASS = RHO * L * W**2
QUICK = SweepOptions(quick=True)


def arm(**analysis: Any) -> dict[str, Any]:
    return scenes.arm(
        bar("=L", W, W, model="beam", mesh={"elements": 2}),
        constant_speed("200 rpm"),
        parameters={"L": L},
        materials={"steel": material(RHO, 2.1e11)},
        damping={"ratio": 0.02, "frequencies": [50, 500]},
        analysis={"revolutions": 2, "steps_per_revolution": 120, "rho_inf": 0.6, "initial": "quasi-static", **analysis},
        gravity=[0, -G, 0],
        output={"plots": False, "picture": False, "animation": False},
    )


class Inline(Executor):
    """Runs points in this process, and counts them; ends like Ctrl-C after some."""

    def __init__(self, most: int = 1000) -> None:
        self.most, self.runs = most, 0

    def submit(self, fn: Any, /, *args: Any, **_: Any) -> Future[Any]:
        if self.runs == self.most:
            raise KeyboardInterrupt
        self.runs += 1
        future: Future[Any] = Future()
        future.set_result(fn(*args))
        return future


def swept(
    tmp_path: Path, *over: str, asked: SweepOptions = QUICK, most: int = 1000, **analysis: Any
) -> tuple[SweepResult, int]:
    raw, runs = arm(**analysis), Inline(most)
    done = sweep(BaseScene(raw, tmp_path, "arm"), axes_of(over, raw), asked, tmp_path / "out", executor=runs)
    return done, runs.runs


def test_a_range_a_list_and_their_grid() -> None:
    speeds, lengths = axes_of(["drive.speed=100rpm:300:3", "L=400,500 mm"], arm())
    assert speeds.key == "drive.motion.speed"
    assert speeds.values == ("100 rpm", "100 rpm", "200 rpm", "200 rpm", "300 rpm", "300 rpm")
    assert_array_equal(speeds.numbers, [100, 100, 200, 200, 300, 300])
    assert (lengths.key, lengths.unit) == ("parameters.L", "mm")
    assert lengths.values == ("400 mm", "500 mm") * 3  # numbers without a unit take that of the others
    assert_array_equal(lengths.numbers, [400, 500] * 3)
    (mixed,) = axes_of(["L=0.4 m,500mm,0.6"], arm())
    assert mixed.values == ("0.4 m", "500mm", "0.6 m")
    assert_allclose(mixed.numbers, [0.4, 0.5, 0.6], rtol=1e-15)
    (plain,) = axes_of(["damping.ratio=0.01,1"], arm())
    assert plain.values == (0.01, 1)
    (steps,) = axes_of(["analysis.steps_per_revolution=60:120:3"], arm())
    assert steps.values == (60, 90, 120)
    assert all(isinstance(value, int) for value in steps.values)
    (words,) = axes_of(["analysis.initial=rest,quasi-static"], arm())
    assert words.numbers is None


def test_the_table_has_prefixes_and_no_rounding(tmp_path: Path) -> None:
    """As that of a run; zeros stood beside the point at which they were largest."""
    raw = arm(kind="static", revolutions=1, steps_per_revolution=4)
    raw["links"]["tip"] = {"model": "rigid", "mass": 1e-6, "centre": ["=L", 0], "inertia": [1e-9, 1e-9, 1e-9]}
    raw["joints"]["B"] = {"kind": "weld", "links": ["arm", "tip"], "at": ["=L", 0]}
    raw["gravity"] = [0, -G, 0]
    done = sweep(BaseScene(raw, tmp_path, "arm"), axes_of(["L=0.4,0.5"], raw), QUICK, tmp_path / "out", executor=Inline())
    (table,), _ = sweep_tables(done)
    said = StringIO()
    Console(file=said, width=200).print(table)
    lines = [[cell.strip() for cell in line.split("│")[1:-1]] for line in said.getvalue().splitlines()]
    rows = {line[0]: line[1:] for line in lines if line}
    # under its weight, level: m g L/2 of the longer arm, 1.57 kg; at its end no moment
    assert rows["drive/torque/torque"] == [f"{MASS * G * L / 2:.4g} N m", "parameters.L = 0.5"]
    assert rows["joints/B/moment/magnitude"] == ["≈ 0", ""]


@pytest.mark.parametrize(
    ("over", "unit"),
    [
        ("drive.speed=10,20", "rad/s"),
        ("drives.S.motion.speed=1:3:3", "m/s"),
        ("drives.C.motion.speed=1:3:3", "rad/s"),
        ("drives.T.motion.speed=1:3:3", "m/s"),
        ("analysis.initial_speeds.S=1,2", "m/s"),
        ("analysis.initial_speeds.A=1,2", "rad/s"),
        ("motors.m.torque=1,2", "N*m"),
        ("gravity[1]=-9.81,0", "m/s^2"),
        ("damping.frequencies[0]=5,10", "Hz"),
        ("links.arm.shape.width=0.01:0.02:2", "m"),
        ("damping.ratio=0.01,0.02", ""),
        ("links.arm.mesh.elements=2,3", ""),
        ("analysis.initial=rest,quasi-static", ""),
        ("L=0.4,0.5", ""),
    ],
)
def test_numbers_without_a_unit_have_that_of_the_scene(over: str, unit: str) -> None:
    raw = arm() | {"gravity": [0, 0, 0], "motors": {"m": {"joint": "A", "torque": 1.0}}}
    raw["joints"]["S"] = {"kind": "prismatic", "links": ["arm", "ground"], "at": [0, 0], "axis": "x"}
    raw["joints"]["C"] = {**raw["joints"]["S"], "kind": "cylindrical"}
    motion = {"kind": "constant_speed", "speed": 1.0}
    travel = {"joint": "C", "coordinate": "travel", "motion": motion}
    raw["drives"] = {"S": {"joint": "S", "motion": motion}, "C": {"joint": "C", "motion": motion}, "T": travel}
    raw["analysis"]["initial_speeds"] = {"A": 1.0, "S": 1.0}
    (axis,) = axes_of([over], raw)
    assert axis.unit == unit
    if axis.numbers is not None:
        assert_array_equal(axis.values, axis.numbers)  # as they were given
    if ":" not in over and unit:
        (other,) = axes_of([over.replace(",", ":")], raw, samples=2)
        assert other.unit == unit


def test_a_latin_hypercube_has_one_point_in_each_slice_and_is_the_same_again() -> None:
    over = ["drive.speed=100rpm:300rpm", "L=0.4:0.6"]
    axes = axes_of(over, arm(), samples=10)
    for axis, first, last in zip(axes, (100, 0.4), (300, 0.6), strict=True):
        assert axis.numbers is not None
        slices = np.floor((axis.numbers - first) / (last - first) * 10).astype(int)
        assert_array_equal(np.sort(slices), np.arange(10))
    for axis, again in zip(axes, axes_of(over, arm(), samples=10), strict=True):
        assert axis.values == again.values


@pytest.mark.parametrize(
    ("over", "samples", "said"),
    [
        (["drive.sped=1:2:3"], None, r"--over drive\.sped: must name a key .*did you mean 'drive\.motion\.speed'"),
        (["analysis.revolution=1,2"], None, "did you mean 'analysis.revolutions'"),
        (["joints.links=1,2"], None, "must name a key"),
        (["drive.speed"], None, "--over: must be KEY=a list a,b,c or a range from:to:count, got 'drive.speed'"),
        (["drive.speed=1rpm:2rpm"], None, "must be a list a,b,c or a range"),
        (["drive.speed=1rpm:2rpm:1"], None, "must be a list a,b,c or a range"),
        (["drive.speed=1rpm:fast:3"], None, "must have two ends"),
        (["drive.speed=1rpm:2mm:3"], None, "must be in one unit, got mm and rpm"),
        (["drive.speed=60rpm:2 Hz:2"], None, "must be in one unit, got Hz and rpm: speeds and frequencies are not"),
        (["L=1,2", "parameters.L=1,2"], None, "must name each key once"),
        (["L=1:2:3"], 4, "must have two ends"),
        (["L=1:2"], 0, "--samples: must be from 1"),
        (["L=0:1:1000", "drive.speed=1:2:1000"], None, "at most 100,000 points, got 1,000,000"),
    ],
)
def test_what_cannot_be_swept_is_refused(over: list[str], samples: int | None, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        axes_of(over, arm(), samples)


def test_the_joint_of_a_turning_arm_holds_its_centripetal_force_and_its_weight(tmp_path: Path) -> None:
    done, runs = swept(tmp_path, "drive.speed=100rpm,300rpm", "L=0.4,0.5")
    assert (runs, done.before) == (4, 0)
    n, length = (axis.numbers for axis in done.axes)
    mass = MASS / L * length
    force = mass * length / 2 * (2 * np.pi * n / 60) ** 2  # m ω² L/2
    for k, row in enumerate(done.rows):
        unit, (most, least, rms, when) = row.extremes["joints/A/force/magnitude"]
        assert (unit, row.status, row.settled) == ("N", "complete", "yes")
        # slowly bent by its weight: (ω/ω1)² of the weight, 6e-3 at the most
        assert_allclose(most, force[k] + mass[k] * G, rtol=6e-3)
        assert_allclose(least, abs(force[k] - mass[k] * G), rtol=6e-3)
        assert_allclose(rms, np.hypot(force[k], mass[k] * G), rtol=6e-3)
        assert 60 / n[k] < when <= 120 / n[k] * (1 + 1e-9)
    assert {"sweep.h5", "sweep.csv"} <= {x.name for x in (tmp_path / "out").iterdir()}
    assert not (tmp_path / "out" / "sweep.png").exists()  # of two keys


def test_vectors_in_a_plane_have_a_magnitude_too(tmp_path: Path) -> None:
    """The displacement of a planar beam has x and y alone."""
    raw = arm(kind="static", revolutions=1, steps_per_revolution=4)
    raw["output"]["probes"] = {"tip": {"link": "arm", "at": [L, 0], "quantity": "displacement", "frame": "world"}}
    found = analyse(scene_from(raw, tmp_path))
    tip = found.results.channels["probes/tip/displacement"][1]
    assert tip.shape[1] == 2
    unit, (most, _, rms, when) = extremes(found.results, -1.0)["probes/tip/displacement/magnitude"]
    size = np.linalg.norm(tip, axis=1)
    assert unit == "m"
    over = np.trapezoid(size**2, found.results.time) / found.results.time[-1]
    assert_allclose([most, rms], [size.max(), np.sqrt(over)], rtol=1e-12)
    assert when == found.results.time[size.argmax()]


@pytest.mark.parametrize("steps", [4, pytest.param(7, marks=pytest.mark.long)])
def test_means_of_squares_are_over_time(steps: int, tmp_path: Path) -> None:
    """Of a period, both of whose ends have rows, that of a sine is half its square: m g L/2 cos φ of a slow arm."""
    done, _ = swept(tmp_path, "L=0.4,0.5", kind="static", revolutions=1, steps_per_revolution=steps)
    for row, length in zip(done.rows, (0.4, 0.5), strict=True):
        rms = row.extremes["drive/torque/torque"][1][2]
        assert_allclose(rms, RHO * W**2 * length**2 * G / 2 / np.sqrt(2), rtol=1e-9)
    late, _ = swept(tmp_path, "L=0.4,0.5")
    _, (_, _, rms, _) = late.rows[1].extremes["joints/A/rigid_force/x"]
    force = MASS * L / 2 * (2 * np.pi * 200 / 60) ** 2  # m ω² L/2 cos φ: to rounding of equal steps in a whole turn
    assert_allclose(rms, force / np.sqrt(2), rtol=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("over", ["analysis.accuracy=0.1,0.002", "links.arm.model=auto,beam"])
def test_points_with_accuracies_or_models_of_their_own_have_plans_of_their_own(over: str, tmp_path: Path) -> None:
    """All ran by the plan of the first: by its accuracy, and beams as the solids that it took for `auto`."""
    raw = arm(accuracy=0.1)
    del raw["analysis"]["steps_per_revolution"], raw["links"]["arm"]["mesh"]
    base, axes = BaseScene(raw, tmp_path, "arm"), axes_of([over], raw)
    done = sweep(base, axes, SweepOptions(), tmp_path / "out", executor=Inline())
    alone = [finished(Job(base, done_at(axes, k), SharedChoices(), 1.0)) for k in range(2)]
    peaks = [[row.extremes["stress/arm/peak"][1][0] for row in rows] for rows in (done.rows, alone)]
    assert done.planned is None
    assert peaks[0] == peaks[1]
    assert peaks[0][0] != peaks[0][1]


def test_kept_points_have_the_rows_of_all_steps(tmp_path: Path) -> None:
    done, _ = swept(tmp_path, "output.every=1,2", asked=SweepOptions(quick=True, keep=True))
    assert [row.status for row in done.rows] == ["complete", "failed"]
    assert "output.every: must be 1 for files that stay (--keep)" in done.rows[1].message


def test_what_counts_is_the_last_turns(tmp_path: Path) -> None:
    scene = scene_from(arm(initial="rest", accuracy="quick"), tmp_path)
    every, last = analyse(scene), analyse(scene, stresses_since=0.301)  # one turn of 200 rpm
    whole, late = every.peaks["arm"], last.peaks["arm"]
    told = "highest stresses, here and in all files, are those of the revolutions that the sweep counts, after 0.301 s"
    assert told in last.results.warnings
    assert not any("that the sweep counts" in text for text in every.results.warnings)
    assert whole.time < 0.3 <= late.time
    assert late.stress < whole.stress
    done, _ = swept(tmp_path, "drive.speed=200rpm,201rpm", initial="rest")
    most, _, _, when = done.rows[0].extremes["stress/arm/peak"][1]
    assert_allclose([most, when], [late.stress, late.time], rtol=1e-12)
    assert done.rows[0].settled == "no"
    assert (tmp_path / "out" / "sweep.png").exists()


def test_a_sweep_that_was_stopped_goes_on_without_a_lost_or_doubled_point(tmp_path: Path) -> None:
    over = "drive.speed=100rpm:300rpm:3"
    with pytest.raises(KeyboardInterrupt):
        swept(tmp_path, over, most=2)
    with h5py.File(tmp_path / "out" / "sweep.h5") as file:
        assert_array_equal(file["drive.motion.speed"], [100, 200])
    stopped, runs = swept(tmp_path, over)
    assert (stopped.before, runs, len(stopped.rows)) == (2, 1, 3)
    done, runs = swept(tmp_path, over)
    assert (done.before, runs) == (3, 0)
    assert [row.text() for row in done.rows] == [row.text() for row in stopped.rows]
    finer, runs = swept(tmp_path, "drive.speed=100rpm:300rpm:5", most=2)
    assert (finer.before, runs) == (3, 2)
    with pytest.raises(KeyboardInterrupt):
        swept(tmp_path, over, most=0, rho_inf=0.9)  # another scene: all is run again


def test_a_point_that_fails_is_a_row_with_its_message(tmp_path: Path) -> None:
    done, _ = swept(tmp_path, "L=-0.5,0.5,0.6")
    assert [row.status for row in done.rows] == ["complete", "complete", "complete"]
    done, _ = swept(tmp_path, "links.arm.shape.width=-0.02,0.02", "analysis.revolutions=0.5,2")
    assert [row.status for row in done.rows] == ["failed", "failed", "failed", "complete"]
    assert "links.arm.shape.width: must be" in done.rows[0].message
    assert "--last: must be at most the 0.5 revolutions" in done.rows[2].message
    lines = (tmp_path / "out" / "sweep.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 5
    assert "links.arm.shape.width: must be" in lines[1]


def test_the_file_has_dimensions_that_readers_of_netcdf_know(tmp_path: Path) -> None:
    done, _ = swept(tmp_path, "drive.speed=100rpm:200rpm:2")
    with h5py.File(tmp_path / "out" / "sweep.h5") as file:
        assert [file["max"].dims[k][0].name for k in range(2)] == ["/point", "/column"]
        names = list(file["column"].asstr()[()])
        where = names.index("joints/A/force/x")
        expected = [row.extremes["joints/A/force/x"][1][2] for row in done.rows]
        assert_array_equal(file["rms"][:, where], expected)
        assert_array_equal(file["drive.motion.speed"], [100, 200])
        assert file["drive.motion.speed"].attrs["units"] == "rpm"


@pytest.mark.long
def test_all_points_run_by_one_plan(tmp_path: Path) -> None:
    raw = arm()
    del raw["analysis"]["steps_per_revolution"]
    axes = axes_of(["drive.speed=100rpm,200rpm"], raw)
    asked = SweepOptions(keep=True)
    done = sweep(BaseScene(raw, tmp_path, "arm"), axes, asked, tmp_path / "out", executor=Inline())
    assert done.planned == 1  # the faster one
    steps = []
    for k in range(2):
        with h5py.File(tmp_path / "out" / "runs" / f"{k:05d}" / "results.h5") as file:
            steps.append(float(file["time"][1]))
    for a, b in pairwise(steps):
        assert_allclose(a, b, rtol=0.05)  # one step, shortened to a whole number in each run


@pytest.mark.long
def test_a_pool_of_processes_finds_the_same_rows(tmp_path: Path) -> None:
    raw = arm()
    axes = axes_of(["drive.speed=100rpm:300rpm:3"], raw)
    pooled = sweep(BaseScene(raw, tmp_path, "arm"), axes, SweepOptions(workers=2, quick=True), tmp_path / "pool")
    here, _ = swept(tmp_path, "drive.speed=100rpm:300rpm:3")
    for one, other in zip(pooled.rows, here.rows, strict=True):
        for name, (_, four) in other.extremes.items():
            assert_allclose(one.extremes[name][1], four, rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_point_whose_worker_is_lost_is_a_failed_row(tmp_path: Path) -> None:
    """As executors of clusters report it; the other points are kept, and it is tried again."""

    class Losing(Inline):
        def submit(self, fn: Any, /, *args: Any, **_: Any) -> Future[Any]:
            if self.runs == 1:
                self.runs += 1
                lost: Future[Any] = Future()
                lost.set_exception(RuntimeError("no worker left"))
                return lost
            return super().submit(fn, *args)

    raw = arm()

    def run(executor: Executor) -> SweepResult:
        axes = axes_of(["drive.speed=100rpm:300rpm:3"], raw)
        return sweep(BaseScene(raw, tmp_path, "arm"), axes, QUICK, tmp_path / "out", executor=executor)

    done = run(Losing())
    assert [row.status for row in done.rows] == ["complete", "failed", "complete"]
    assert done.rows[1].message == "its worker was lost: RuntimeError: no worker left"
    again = run(Inline())
    assert again.before == 2
    assert [row.status for row in again.rows] == ["complete"] * 3


def inline(value: Any) -> str:
    """A value in TOML."""
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {inline(each)}' for key, each in value.items())} }}"
    return f"[{', '.join(map(inline, value))}]" if isinstance(value, (list, tuple)) else json.dumps(value)


def finished_rows(folder: Path) -> list[Path]:
    """Files of rows that are whole; one that is being written is renamed in the end."""
    return [path for path in folder.glob("rows/*.json") if ".part." not in path.name]


@pytest.mark.long
def test_a_sweep_that_was_killed_goes_on_without_a_lost_or_doubled_point(tmp_path: Path) -> None:
    """SIGKILL after some rows, workers being at work: these rows stay, the table is that of a whole sweep."""
    raw, over = arm(), "drive.speed=100rpm:400rpm:10"
    scene = tmp_path / "arm.toml"
    scene.write_text("\n".join(f"{key} = {inline(value)}" for key, value in raw.items()), encoding="utf-8")
    command = [sys.executable, "-m", "kedfem", "sweep", str(scene), "--over", over, "--quick", "--workers", "2"]
    killed = subprocess.Popen([*command, "--folder", str(tmp_path / "killed")], stderr=subprocess.DEVNULL)
    end = time.monotonic() + 120
    while len(finished_rows(tmp_path / "killed")) < 2 and killed.poll() is None:
        assert time.monotonic() < end, "no point was finished"
        time.sleep(0.01)
    killed.kill()
    assert killed.wait() == -signal.SIGKILL
    before = {path.name: path.read_bytes() for path in finished_rows(tmp_path / "killed")}
    (tmp_path / "killed" / "rows" / "row.0123abcd.part.json").touch()  # as one leaves that is killed in the middle
    subprocess.run([*command, "--folder", str(tmp_path / "killed")], check=True, capture_output=True)
    for name, content in before.items():
        assert (tmp_path / "killed" / "rows" / name).read_bytes() == content
    assert len(list((tmp_path / "killed").glob("rows/*"))) == 10
    sweep(BaseScene(raw, tmp_path, "arm"), axes_of([over], raw), QUICK, tmp_path / "whole", executor=Inline())
    tables = [(tmp_path / folder / "sweep.csv").read_text() for folder in ("killed", "whole")]
    assert tables[0] == tables[1]
    assert tables[0].count("complete") == 10


def test_a_row_with_a_status_of_an_earlier_kedfem_is_run_again() -> None:
    text = Row("complete").text()
    assert Row.read(text).status == "complete"
    with pytest.raises(ValueError, match="doubtful"):
        Row.read(text.replace("complete", "doubtful"))


def reduced_four_bar() -> dict[str, Any]:
    """Of plane links that are reduced, with a load that does not grow with the speed."""
    link = bar(model="plane", reduction="modal", mesh={"elements": [8, 1]})
    return {
        **scenes.four_bar((0.1, 0.3, 0.25, 0.3), link, constant_speed("300 rpm")),
        "damping": {"beta": 1e-5},
        "loads": {"push": {"kind": "force", "link": "coupler", "at": "B", "vector": [0, -500]}},
        "analysis": {
            "kind": "steady", "steps_per_revolution": 120, "rho_inf": 0.9, "reduction_tolerance": 1e-2,
        },
        "output": {"plots": False, "picture": False, "animation": False},
    }  # fmt: skip


def test_a_drive_that_runs_backwards_has_modes_of_its_own(tmp_path: Path) -> None:
    """Its path is another: a pin goes to the other side of its slot."""
    digests = []
    for speed in (100, 200, -100):
        raw = reduced_four_bar()
        raw["drive"]["motion"]["speed"] = speed
        digests.append(alike(scene_from(raw, tmp_path)))
    assert digests[0] == digests[1] != digests[2]


def test_points_at_other_speeds_and_dampings_share_their_modes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same peaks as with modes of their own, within the tolerance; found once."""
    monkeypatch.setenv("KEDFEM_CACHE", "off")
    raw, made = reduced_four_bar(), list[int]()

    def counted(*given: Any) -> Any:
        made.append(1)
        return found(*given)

    found = reduction.reduced
    monkeypatch.setattr(reduction, "reduced", counted)
    axes = axes_of(["drive.speed=100rpm,200rpm,400rpm", "damping.beta=1e-5,4e-5"], raw)
    base = BaseScene(raw, tmp_path, "four")
    done = sweep(base, axes, QUICK, tmp_path / "out", executor=Inline())
    assert len(made) == 1
    assert [row.status for row in done.rows] == ["complete"] * 6
    for k in (0, 3, 4):
        alone = finished(Job(base_of(base), done_at(axes, k), SharedChoices(), 1.0))
        for name in ("stress/coupler/peak", "joints/C/force/magnitude"):
            assert_allclose(done.rows[k].extremes[name][1][0], alone.extremes[name][1][0], rtol=1e-2)
        assert_allclose(done.rows[k].extremes[GROWTH][1][0], alone.extremes[GROWTH][1][0], rtol=2e-2)
    assert len(made) == 4


def base_of(base: BaseScene) -> BaseScene:
    """As a sweep with plain defaults takes it."""
    return BaseScene({**base.raw, "analysis": {**base.raw["analysis"], "accuracy": "quick"}}, base.folder, base.stem)


def done_at(axes: Any, k: int) -> dict[Any, Any]:
    """Values of a point."""
    return {axis.where: axis.values[k] for axis in axes}
