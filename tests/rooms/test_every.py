"""`output.every`: rows are those of each n-th step, bit by bit; what is summed up or highest is of all steps."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from kedfem.accuracy import plan as planning
from kedfem.analysis import Run, analyse
from kedfem.compare import compare
from kedfem.dynamics import rigid_body
from kedfem.dynamics.stepping import solvers
from kedfem.errors import OutputError, SceneError
from kedfem.load_cases import load_cases
from kedfem.loads import loads
from kedfem.results import Channel, ResultsWriter, read_results
from kedfem.results.thinning import Thinning
from kedfem.scene import scene_from
from kedfem.sweep import BaseScene, SweepOptions, axes_of, sweep
from kedfem.sweep.points import Job, SharedChoices, finished
from kedfem.tables import run_tables
from tests.scenes import arm, bar, constant_speed, cycloidal, four_bar, material

STEPS = 96
QUIET = {"plots": False, "picture": False, "animation": False}
TIMES = {"seconds", "steps between rows"}


def scene_of(folder: Path, every: int, steps: int = STEPS, **analysis: Any) -> Any:
    """A four-bar of beams in steps so long that their balance of energy is off, with a probe and a load table."""
    beam = {
        "material": "soft", "model": "beam", "mesh": {"elements": 1},
        "shape": {"kind": "bar", "width": 0.02, "thickness": 0.01},
    }  # fmt: skip
    raw = four_bar((0.1, 0.3, 0.25, 0.3), beam, constant_speed("600 rpm"))
    raw |= {"materials": {"soft": material(2700, 7e10)}}
    raw["loads"] = {
        "w": {"kind": "force", "link": "rocker", "at": "joints.C", "vector": [5, 0],
              "factor": {"time": [0, 1e-4, 2e-4, 0.1], "value": [0, 1, 0, 0], "period": 0.1}},
    }  # fmt: skip
    raw["analysis"] = {"end_time": 0.2, "step": 0.2 / steps, "accuracy": "quick", **analysis}
    raw["output"] = QUIET | {"every": every, "probes": {
        "p": {"link": "rocker", "at": "joints.C", "quantity": "displacement"},
        "s": {"link": "coupler", "at": {"between": ["joints.B", "joints.C"], "fraction": 0.5}, "quantity": "stress"},
    }}  # fmt: skip
    return scene_from(raw, folder)


def kept(steps: int, every: int) -> list[int]:
    return sorted({*range(0, steps + 1, every), steps})


def assert_thinned(thin: Run, whole: Run, every: int, within: float = 0.0) -> None:
    """The rows are some of the whole run's, everything else is the same; estimates of another run within an error."""
    ours, every_row = thin.results, whole.results
    which = kept(len(every_row.time) - 1, every)
    assert_array_equal(ours.time, every_row.time[which])
    assert_array_equal(ours.angle, every_row.angle[which])
    assert list(ours.channels) == list(every_row.channels)
    for name, (_, values) in every_row.channels.items():
        assert_array_equal(ours.channels[name][1], values[which], err_msg=name)
        time, _, rows = ours.largest_rows(name)
        assert_array_equal(np.abs(rows).max(axis=0), np.abs(values).max(axis=0), err_msg=name)
        size = np.linalg.norm(values, axis=1)
        assert time[np.linalg.norm(rows, axis=1).argmax()] == every_row.time[size.argmax()], name
    notes = {name: x for name, x in ours.notes.items() if name not in TIMES}
    expected = {name: x for name, x in every_row.notes.items() if name not in TIMES}
    assert notes == (pytest.approx(expected, rel=within) if within else expected)
    assert ours.peaks == every_row.peaks
    assert (ours.status, ours.reason, thin.warnings) == (every_row.status, every_row.reason, whole.warnings)
    assert thin.balance == whole.balance
    assert within or thin.budget == whole.budget
    assert ours.every == every


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return analyse(scene_of(tmp_path_factory.mktemp("whole"), 1))


@pytest.fixture(scope="module")
def thin(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return analyse(scene_of(tmp_path_factory.mktemp("thin"), 7))


def test_rows_are_those_of_the_whole_run_and_all_else_is_of_all_steps(whole: Run, thin: Run) -> None:
    assert any("residual of the balance" in text for text in whole.warnings)
    assert any("table" in text for text in whole.warnings)
    assert_thinned(thin, whole, 7)
    assert thin.results.every == 7
    assert_array_equal(thin.results.instants, whole.results.time)


@pytest.mark.long
@pytest.mark.parametrize(
    ("every", "analysis"),
    [
        (2, {"extrapolation_levels": 2}), (95, {"frames": "co-rotational"}),
        (12, {"kind": "quasi-static", "step": 0.2 / 12}), (7, {"kind": "steady", "end_time": 0.1, "step": 0.1 / STEPS}),
    ],
    ids=str,
)  # fmt: skip
def test_whatever_the_analysis(every: int, analysis: dict[str, Any], tmp_path: Path) -> None:
    runs = [analyse(scene_of(tmp_path / str(n), n, **analysis)) for n in (1, every)]
    searched = analysis.get("kind") == "steady"  # which trial runs find to 1e-6, each from another start
    assert_thinned(runs[1], runs[0], every, 1e-4 * searched)


def test_tables_show_the_largest_values_of_all_steps(whole: Run, thin: Run) -> None:
    tables = [
        [[list(column.cells) for column in table.columns] for table in run_tables(scene_of(run.folder, 1), run)[:-1]]
        for run in (whole, thin)
    ]
    assert tables[0][0]
    assert tables[0] == tables[1]


def test_files_are_as_small_as_asked(tmp_path: Path) -> None:
    """Besides the rows, here 4,801 of 42 numbers, 1.6 MB, a file has a constant part."""
    channels = [Channel(f"a/{k}", ("x", "y", "z", "w"), "N", "", "") for k in range(10)]
    t = np.arange(4801.0)
    size = {}
    for every in (1, 10, 4800):
        path = tmp_path / f"{every}.h5"
        with ResultsWriter(path, channels, "{}", None, {"step [s]": 1.0}).thinned(every, 4801) as writer:
            for first in range(0, 4801, 500):
                now = t[first : first + 500]
                writer.append(now, now, {channel.name: np.tile(now[:, None], 4) for channel in channels})
        assert read_results(path).time.tolist() == t[kept(4800, every)].tolist()
        size[every] = path.stat().st_size
    assert size[10] - size[4800] < 0.12 * (size[1] - size[4800])
    assert size[4800] < 0.1 * size[1]


def in_small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (rigid_body, solvers):
        monkeypatch.setattr(module, "POINTS", 16)
    monkeypatch.setattr("kedfem.resume.SHARE", 0.0)


def ended(scene: Any, at: float) -> None:
    def watch(stage: str, done: int, total: int) -> None:
        if stage == "steps" and total and done >= at * total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        analyse(scene, watch, every=0.0)


@pytest.mark.long
def test_an_ended_run_has_its_last_step_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A state belongs to steps whose rows may not be written; after the last one no step follows that brings its row."""
    in_small_blocks(monkeypatch)
    whole = analyse(scene_of(tmp_path / "whole", 1))
    for at in (0.4, 1.0):
        scene = scene_of(tmp_path / str(at), 7)
        ended(scene, at)
        left = read_results(scene.results_folder / "results.h5")
        assert (left.status, left.every) == ("interrupted", 7)
        last = int(np.flatnonzero(whole.results.time == left.time[-1])[0])
        assert last >= at * STEPS
        assert_array_equal(left.time, whole.results.time[kept(last, 7)])
        assert left.largest
        assert_thinned(analyse(scene, resumes=True), whole, 7)


def test_a_run_goes_on_with_the_rows_that_it_had(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_small_blocks(monkeypatch)
    ended(scene_of(tmp_path, 7), 0.4)
    with pytest.raises(SceneError, match=r"output\.every: must be 7, as in the run to be resumed, got 5"):
        analyse(scene_of(tmp_path, 5), resumes=True)


@given(st.lists(st.integers(1, 9), min_size=1, max_size=12), st.integers(1, 12))
def test_blocks_of_any_length_leave_the_same_rows(lengths: list[int], every: int) -> None:
    """Each n-th of all, the last beside them, and the first of each largest value."""
    count, channel = sum(lengths), Channel("a/b", ("x", "y"), "N", "", "")
    x = np.random.default_rng(count).integers(-4, 5, (count, 2)).astype(float)
    rows = {"t": np.arange(count) * 1.0, "phi": np.arange(count) * 2.0, "a/b": x}
    thinning, found, last = Thinning([channel], every), [], None
    for first, length in zip(np.cumsum([0, *lengths]), lengths, strict=False):
        part, last = thinning.chosen({name: each[first : first + length] for name, each in rows.items()}, ("t", "phi"))
        found.append(part["t"])
    found += [] if last is None else [last["t"]]
    assert np.concatenate(found).tolist() == kept(count - 1, every)
    if every > 1:
        times = thinning.largest["a/b"][:, 0]
        assert set(times) == {*np.abs(x).argmax(axis=0), np.linalg.norm(x, axis=1).argmax()}
        assert (np.diff(times) > 0).all()


@pytest.mark.parametrize(
    ("every", "message"), [(0, "at least 1"), (-3, "at least 1"), (2.5, "whole"), (97, "at most 96")]
)
def test_what_is_no_interval_is_refused(every: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=rf"output\.every: must be .*{message}.*got {every}"):
        scene_of(tmp_path, every)
    assert len(analyse(scene_of(tmp_path, STEPS)).results.time) == 2


def test_a_planned_analysis_with_fewer_steps_is_refused_before_it_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Known only when the plan has chosen the step."""
    scene = scene_of(tmp_path, 90, accuracy="quick")
    monkeypatch.setattr(planning, "plan_for", lambda *_: None)
    analysis = scene.analysis.model_copy(update={"step": 0.2 / 50})
    with pytest.raises(SceneError, match=r"output\.every: must be at most 50, the steps of the analysis, got 90"):
        analyse(scene.model_copy(update={"analysis": analysis}))
    assert not (scene.results_folder / "results.h5").exists()


def test_loads_need_all_rows(thin: Run) -> None:
    """Means, and lives of bearings, of one step in seven would be others without a word."""
    with pytest.raises(OutputError, match=r"must have the rows of all steps for loads.*got those of one step in 7"):
        loads(thin.folder)


def test_runs_are_compared_at_rows_that_both_have(whole: Run, thin: Run, tmp_path: Path) -> None:
    """The same run differs by nothing, and peaks are those of all steps, whichever comes first."""
    for files in ([whole.folder, thin.folder], [thin.folder, whole.folder]):
        found = compare(files, folder=tmp_path, pictures=False)
        assert all(each.largest.max() == 0.0 for each in found.found)
        for each in found.found:
            assert each.peaks[0] == each.peaks[1]
        assert any("one step in 7 alone (output.every)" in text for text in found.warnings)
    assert not any("output.every" in text for text in compare([whole.folder] * 2, pictures=False).warnings)


def test_a_sweep_finds_extremes_of_all_steps(tmp_path: Path) -> None:
    rows = []
    for every in (1, 7):
        raw = scene_of(tmp_path, every).as_given
        base = BaseScene(raw, tmp_path, f"s{every}")
        rows.append(finished(Job(base, {}, SharedChoices(), 1.0)))
    assert rows[0].extremes
    assert repr(rows[0].extremes) == repr(rows[1].extremes)
    with pytest.raises(SceneError, match=r"output\.every: must be 1 for files that stay \(--keep\)"):
        sweep(base, axes_of(["analysis.rho_inf=0.9"], raw), SweepOptions(keep=True), tmp_path / "kept")


@pytest.mark.long
def test_load_cases_are_those_of_steps_without_rows(tmp_path: Path) -> None:
    """Instants between rows, and of the highest stress."""
    found: dict[int, Any] = {}
    for every in (1, 4):
        analysis = {"end_time": 1e-3, "step": 1e-4, "initial": "rest", "accuracy": "quick"}
        raw = arm(bar(element="hex8"), cycloidal(0.5, 1e-3), analysis=analysis, output=QUIET | {"every": every})
        folder = analyse(scene_from(raw, tmp_path / str(every))).folder
        found[every] = load_cases(folder, "arm", [5e-4, 7e-4, 1e-3]).cases + load_cases(folder, "arm").cases
    for one, other in zip(found[1], found[4], strict=True):
        assert one.time == other.time
        assert_array_equal(one.total, other.total)


def test_a_report_shows_largest_values_of_all_steps_and_leaves_out_loads(whole: Run, thin: Run) -> None:
    pytest.importorskip("jinja2")
    from kedfem.report.facts import facts

    said: Callable[[float, float], str] = lambda time, angle: f"{time} {angle}"  # noqa: E731
    assert facts(whole.results, None, said) == facts(thin.results, None, said)
    short = replace(thin.results, largest={})
    assert facts(whole.results, None, said) != facts(short, None, said)
