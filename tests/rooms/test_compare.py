"""Runs beside each other: curves of known difference on other grids and at other speeds, and what a user sees."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image
from typer.testing import CliRunner

from kedfem.analysis import analyse
from kedfem.cli import app
from kedfem.compare import compare
from kedfem.errors import OutputError
from kedfem.results import Results
from kedfem.results.channels import TRAVEL, Channel
from kedfem.results.differences import common_abscissa, differences, differing_keys
from kedfem.scene import scene_from
from tests.reliability.mutations import short
from tests.scenes import example

FORCE = Channel("joints/A/force", ("x", "y", "z"), "N", "world", "force of joint A")
TORQUE = Channel("drive/torque", ("torque",), "N m", "", "torque of the drive")
STRESS = Channel("probes/p/stress", ("xx", "yy", "von_mises"), "Pa", "link", "stress at p")


def run(n: int, speed: float = 1.0, turn: float = 2 * np.pi, **columns: Any) -> Results:
    """n rows of one turn at a speed; each channel a function of the drive's angle."""
    angle = np.linspace(0.0, turn, n)
    known = {"force": FORCE, "torque": TORQUE, "stress": STRESS}
    channels = {
        known[name].name: (known[name], np.stack(np.broadcast_arrays(*made(angle)), axis=1))
        for name, made in columns.items()
    }
    return Results(angle / speed, angle, channels, "complete", "{}")


def found(runs: list[Results], over: Any = None) -> Any:
    return differences(runs, *common_abscissa(runs, over))


def test_runs_of_other_speeds_are_compared_at_the_same_place_of_the_drive() -> None:
    """T = sin φ and 1.1 sin φ: a tenth of the peak at the most, 0.1/√2 rms, whatever speeds and grids are."""
    for n, speed in ((4001, 2.0), (3001, 2.0), (2501, 0.7)):
        runs = [run(4001, torque=lambda x: [np.sin(x)]), run(n, speed, torque=lambda x: [1.1 * np.sin(x)])]
        assert common_abscissa(runs, None)[0] == "drive"
        (each,) = found(runs)
        assert_allclose(each.largest, [0.0, 0.1], atol=1e-9)
        assert_allclose(each.rms[1], 0.1 / np.sqrt(2), rtol=2e-4)
        assert_allclose(np.sin(each.at[1]) ** 2, 1.0, atol=1e-6)
        assert_allclose(each.peaks, [1.0, 1.1], rtol=1e-6)


def test_values_between_rows_are_of_fourth_order() -> None:
    """Of one sine on grids that share no inner row: cubic splines."""
    off = []
    for n in (81, 161, 321):
        runs = [run(998, torque=lambda x: [np.sin(x)]), run(n, torque=lambda x: [np.sin(x)])]
        off.append(found(runs)[0].largest[1])
    orders = np.log2(np.array(off[:-1]) / off[1:])
    assert ((orders > 3.7) & (orders < 4.4)).all(), orders
    assert off[0] < 1e-6


def test_the_same_motion_is_compared_over_time_and_a_drive_that_swings_too() -> None:
    same = [run(101, torque=lambda x: [1 + x]), run(51, torque=lambda x: [1 + x])]
    assert common_abscissa(same, None)[0] == "time"
    swings = [Results(x.time, np.sin(x.angle), x.channels, "complete", "{}") for x in same]
    assert common_abscissa(swings, None)[0] == "time"
    with pytest.raises(ValueError, match="keeps on in one direction"):
        common_abscissa(swings, "drive")
    slides = Results(same[1].time, same[1].angle, same[1].channels, "complete", "{}", drive=TRAVEL)
    with pytest.raises(ValueError, match="the same in all runs"):
        common_abscissa([same[0], slides], "drive")
    backwards = [Results(x.time, -x.angle, x.channels, "complete", "{}") for x in same]
    over, along = common_abscissa(backwards, "drive")
    assert over == "drive"
    assert_allclose((along[0], along[-1]), (-2 * np.pi, 0.0), atol=1e-12)
    assert found(backwards, "drive")[0].largest[1] < 1e-9


def test_only_what_all_runs_reach_is_compared() -> None:
    runs = [run(401, torque=lambda x: [x]), run(201, turn=np.pi, torque=lambda x: [x + (x > 3.2)])]
    (each,) = found(runs, "time")
    assert len(each.values[0]) == 201
    assert each.largest[1] < 1e-12
    apart = Results(runs[1].time + 100, runs[1].angle + 100, runs[1].channels, "complete", "{}")
    with pytest.raises(ValueError, match="share a stretch of time"):
        common_abscissa([runs[0], apart], "time")


@pytest.mark.parametrize("along", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.0, 0.8)])
def test_a_vector_that_points_elsewhere_differs(along: tuple[float, float, float]) -> None:
    """Of equal length at right angles: √2 of the peak."""
    across = np.cross(along, np.roll(along, 1) + 0.1)
    across /= np.linalg.norm(across)
    runs = [run(50, force=lambda _, d=d: 3.0 * np.asarray(d)[:, None] * np.ones(50)) for d in (along, across)]
    (each,) = found(runs)
    assert_allclose(each.largest[1], np.sqrt(2), rtol=1e-9)
    assert_allclose(each.peaks, 3.0)


def test_stress_is_judged_by_von_mises_and_rounding_left_out() -> None:
    runs = [
        run(50, stress=lambda x, k=k: [1e6 + 0 * x, -5e5 + 0 * x, k * (2e6 + x)], torque=lambda x: [1e-30 + 0 * x])
        for k in (1.0, 1.01)
    ]  # fmt: skip
    each = found(runs)[0]
    assert each.channel == STRESS
    assert_allclose(each.largest[1], 0.01, rtol=1e-9)


MOVES = (("position", "displacement"), ("total_velocity", "velocity"), ("total_acceleration", "acceleration"))


def recorded(factor: float, channels: dict[str, tuple[str, float]]) -> Results:
    """Rows of one revolution with channels of a unit and a size, multiplied by a factor."""
    angle = np.linspace(0.0, 2 * np.pi, 50)
    made = {
        name: (Channel(name, ("x",), unit, "", ""), factor * size * np.cos(angle)[:, None])
        for name, (unit, size) in channels.items()
    }
    return Results(angle, angle, made, "complete", "{}")


def test_what_is_zero_by_symmetry_differs_by_what_is_little_beside_others() -> None:
    """A force that is 1e-7 of another one in one run, and 3e-7 in the other one: 200 % of itself, nothing of it."""
    names = {"joints/A/force": ("N", 1e3), "joints/S/force": ("N", 1e-4), "joints/S/moment": ("N m", 2e-5),
             "joints/A/moment": ("N m", 5.0), "drive/torque": ("N m", 1e-3),
             "energy/kinetic": ("J", 9.0), "energy/strain": ("J", 1e-3)}  # fmt: skip
    by = {each.channel.name: each for each in found([recorded(1.0, names), recorded(3.0, names)])}
    wanted = {"joints/A/force": 2.0, "joints/S/force": 2e-7, "joints/S/moment": 8e-6, "joints/A/moment": 2.0,
              "drive/torque": 2.0, "energy/kinetic": 2.0, "energy/strain": 2.0}  # fmt: skip
    assert {name: each.largest[1] for name, each in by.items()} == pytest.approx(wanted)
    assert {name for name, each in by.items() if each.zero} == {"joints/S/force", "joints/S/moment"}


@pytest.mark.parametrize(("whole", "elastic"), MOVES)
def test_what_bends_is_compared_with_itself(whole: str, elastic: str) -> None:
    names = {f"probes/p/{whole}": ("SI", 1.0), f"probes/p/{elastic}": ("SI", 1e-4)}
    assert [each.largest[1] for each in found([recorded(1.0, names), recorded(1.1, names)])] == pytest.approx([0.1, 0.1])


def test_what_only_the_second_run_has_is_compared_too() -> None:
    """It was left out; and of a kind of which the first run has nothing, the difference is all of it."""
    first, second = (
        {"joints/A/force": ("N", 10.0), "joints/B/force": ("N", x), "energy/strain": ("J", x)} for x in (0.0, 2.0)
    )
    by = {each.channel.name: each.largest[1] for each in found([recorded(1.0, first), recorded(1.0, second)])}
    assert by == pytest.approx({"joints/A/force": 0.0, "joints/B/force": 0.2, "energy/strain": 1.0})


def test_keys_that_differ_are_listed_with_their_values() -> None:
    scenes = [{"drive": {"speed": 1.0, "joint": "A"}, "x": [1]}, {"drive": {"speed": 2.0, "joint": "A"}, "y": {}}]
    runs = [Results(np.zeros(1), np.zeros(1), {}, "complete", json.dumps(each)) for each in scenes]
    assert differing_keys(runs) == {"drive.speed": (1.0, 2.0), "x": ([1], None), "y": (None, {})}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The worked example, thinner and without its probes."""
    made = []
    for name in ("first", "thin"):
        folder = tmp_path_factory.mktemp(name)
        raw = short(example("four_bar_beams"))
        if name == "thin":
            raw["links"]["rocker"]["shape"]["width"] = 0.02
            raw["output"].pop("probes", None)
        made.append(analyse(scene_from(raw, folder)).folder)
    return made


def test_a_user_compares_two_runs(folders: list[Path], tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["compare", *map(str, folders), "--folder", str(tmp_path / "here")])
    assert done.exit_code == 0, done.output
    assert "links.rocker.shape.width" in done.output.replace("\n", "").replace(" ", "") or "0.02" in done.output
    with (tmp_path / "here" / "differences.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    by = {(row["channel"], row["run"]): row for row in rows}
    channels = {name for name, _ in by}
    assert {"drive/torque", "joints/A/force"} <= channels
    assert all(float(row["largest difference [%]"]) == 0.0 for row in rows[::2])
    assert all(float(row["largest difference [%]"]) > 1e-3 for row in rows[1::2] if row["channel"] == "drive/torque")
    assert all(float(row["% of"]) >= float(by[row["channel"], rows[0]["run"]]["peak"]) for row in rows)
    for name in channels:
        with Image.open(tmp_path / "here" / f"{name.replace('/', '-')}.png") as image:
            assert image.size == (1320, 744)


def test_what_only_one_run_records_is_told(folders: list[Path], tmp_path: Path) -> None:
    told = compare(folders, folder=tmp_path, pictures=False)
    assert any("not recorded, or otherwise, in another run" in each for each in told.warnings)
    assert not list(tmp_path.iterdir())
    assert set(told.peaks) == {"crank", "coupler", "rocker"}


def test_a_run_with_itself_differs_in_nothing(folders: list[Path], tmp_path: Path) -> None:
    told = compare([folders[0], folders[0] / "results.h5"], folder=tmp_path, pictures=False)
    assert told.keys == {}
    assert all(each.largest[1] == 0.0 for each in told.found)
    assert len(set(told.names)) == 2


def test_what_cannot_be_compared_is_refused_in_words(folders: list[Path], tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="must have two results or more, got 1"):
        compare(folders[:1])
    with pytest.raises(OutputError, match="nowhere"):
        compare([folders[0], tmp_path / "nowhere"])
    done = CliRunner().invoke(app, ["compare", *map(str, folders), "--over", "space"])
    assert isinstance(done.exception, OutputError)
    assert str(done.exception) == "--over: must be time or drive, got space"
