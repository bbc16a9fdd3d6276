"""Runs that were ended from outside go on from their stored state to the same rows, peaks, frames and estimates."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.histories import Histories, relative_errors
from kedfem.analysis import Run, analyse
from kedfem.dynamics import rigid_body
from kedfem.dynamics.stepping import solvers
from kedfem.errors import OutputError, SceneError
from kedfem.memory import Packed, packed
from kedfem.results import read_results
from kedfem.results.stresses import envelope
from kedfem.resume import STATE
from kedfem.scene import Scene, scene_from
from tests.laws.test_levels import linkage
from tests.scenes import constant_speed, four_bar, material

STEPS = 96  # of an analysis
LOOPS = {  # as `dynamics.stepping.solvers` chooses them, each in one of the ways to begin and to combine levels
    "dense": ("rigid-body", {"extrapolation_levels": 1}),
    "dense, two levels": ("rigid-body", {"extrapolation_levels": 2}),
    "system": ("springs", {"extrapolation_levels": 1}),
    "system, three levels": ("springs", {"extrapolation_levels": 3}),
    "co-rotational": ("co-rotational", {"extrapolation_levels": 1}),
    "co-rotational, two levels": ("co-rotational", {"extrapolation_levels": 2}),
    "monolithic": ("rigid-body", {"extrapolation_levels": 1, "solver": "monolithic"}),
    "rows": ("rows", {"extrapolation_levels": 1}),
    "stiffened": ("stiffened", {"extrapolation_levels": 1}),
}
CHEAP = {"dense, two levels", "co-rotational"}


def scene_of(kind: str, folder: Path, analysis: dict[str, Any]) -> Scene:
    raw = linkage(kind)
    raw["analysis"] |= {"step": raw["analysis"]["end_time"] / STEPS, **analysis}
    raw["output"] = raw["output"] | {"animation": {"frames_per_revolution": 20}, "plots": False, "picture": False}
    return scene_from(raw, folder)


def turning(folder: Path, loads: dict[str, Any] | None = None, **analysis: Any) -> Scene:
    """A crank at constant speed for two revolutions: the second turn takes its motion from the first."""
    beam = {
        "material": "soft",
        "model": "beam",
        "element": "beam3",
        "mesh": {"elements": 1},
        "shape": {"kind": "bar", "width": 0.02, "thickness": 0.01},
    }
    raw = four_bar((0.1, 0.3, 0.25, 0.3), beam, constant_speed("60 rpm"))
    raw |= {"materials": {"soft": material(2700, 7e10)}, "output": {"plots": False, "picture": False}}
    raw["loads"] = loads or {}
    raw["analysis"] = {
        "revolutions": 2,
        "steps_per_revolution": 48,
        "extrapolation_levels": 1,
        "frames": "rigid-body",
        **analysis,
    }
    raw["analysis"] = {key: value for key, value in raw["analysis"].items() if value is not None}
    return scene_from(raw, folder)


@pytest.fixture(autouse=True)
def _states_at_every_block(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of few steps, and a state after each, however long that takes."""
    monkeypatch.setattr(rigid_body, "POINTS", 16)
    monkeypatch.setattr(solvers, "POINTS", 16)
    monkeypatch.setattr("kedfem.resume.SHARE", 0.0)


def ended_early(scene: Scene, at: float, every: float = 0.0) -> None:
    """A run that is interrupted after a part of its steps."""

    def watch(stage: str, done: int, total: int) -> None:
        if stage == "steps" and total and done >= at * total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        analyse(scene, watch, every=every)


def content(run: Run) -> dict[str, Any]:
    """All that a run leaves, but what is drawn."""
    results = run.results
    rows = {name: values for name, (_, values) in results.channels.items()}
    files = {path.name: path.read_bytes() for path in run.folder.iterdir() if path.suffix in {".vtu", ".pvd"}}
    return {
        "rows": rows | {"t": results.time, "angle": results.angle}, "status": (results.status, results.reason),
        "notes": dict(results.notes), "peaks": dict(results.peaks), "files": files, "warnings": run.warnings,
    }  # fmt: skip


def assert_same(one: dict[str, Any], other: dict[str, Any]) -> None:
    for name, values in one["rows"].items():
        np.testing.assert_array_equal(other["rows"][name], values, err_msg=name)
    for key in ("status", "notes", "peaks", "files", "warnings"):
        assert one[key] == other[key], key


@pytest.mark.parametrize("loop", [pytest.param(loop, marks=() if loop in CHEAP else pytest.mark.long) for loop in LOOPS])
def test_a_resumed_run_leaves_what_an_undisturbed_one_does_bit_by_bit(tmp_path: Path, loop: str) -> None:
    kind, analysis = LOOPS[loop]
    whole = content(analyse(scene_of(kind, tmp_path / "whole", analysis)))
    ended = scene_of(kind, tmp_path / "ended", analysis)
    ended_early(ended, 0.4)
    state = (ended.results_folder / STATE).read_bytes()
    rows = Packed(state[32:]).content["steps"]
    assert STEPS / 4 < rows <= len(read_results(ended.results_folder / "results.h5").time) < STEPS
    resumed = analyse(ended, resumes=True)
    assert_same(whole, content(resumed))
    assert not (ended.results_folder / STATE).exists()


def test_resumed_static_positions_of_a_beam_that_bends_in_space_are_the_same_bit_by_bit(tmp_path: Path) -> None:
    """Its frames are sought from those of the position before, also where a resumed run has found none yet."""

    def arm(folder: Path) -> Scene:
        shape = {"kind": "bar", "between": [[0, 0], [0.2, 0]], "width": 0.02, "thickness": 0.02}
        load = {"kind": "line", "link": "arm", "vector": [0, 0, -300], "factor": {"time": [0, 0.1], "value": [0, 1]}}
        raw = {
            "links": {"arm": {"material": "steel", "model": "beam", "shape": shape, "mesh": {"elements": 2}}},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
            "drive": {"joint": "A", "motion": constant_speed("60 rpm")},
            "loads": {"across": load},
            "analysis": {
                "kind": "static", "end_time": 0.1, "step": 0.005, "frames": "co-rotational", "accuracy": "quick"
            },
            "output": {"plots": False, "picture": False},
        }  # fmt: skip
        return scene_from(raw, folder)

    whole, ended = content(analyse(arm(tmp_path / "whole"))), arm(tmp_path / "ended")
    ended_early(ended, 0.5)
    assert_same(whole, content(analyse(ended, resumes=True)))


KERNELS = {"OPENBLAS_CORETYPE", "NUMBA_CPU_NAME"}
ELSEWHERE = """
import sys
from pathlib import Path
from kedfem.analysis import analyse
from kedfem.dynamics import rigid_body
from kedfem.dynamics.stepping import solvers
from tests.rooms.test_resume import turning
rigid_body.POINTS = solvers.POINTS = 16
run = analyse(turning(Path(sys.argv[1]), frames=sys.argv[2], extrapolation_levels=2), resumes=True)
print(max(run.step.errors.values()))
"""


@pytest.mark.long
@pytest.mark.kernels
@pytest.mark.parametrize(("frames", "within"), [("rigid-body", 1e-10), ("co-rotational", None)])
def test_a_run_goes_on_on_another_machine(tmp_path: Path, frames: str, within: float | None) -> None:
    """With the kernels of another processor: as without an interruption to rounding, or to the step's own error."""
    whole = analyse(turning(tmp_path / "whole", frames=frames, extrapolation_levels=2))
    ended = turning(tmp_path / "ended", frames=frames, extrapolation_levels=2)
    ended_early(ended, 0.6)
    given = {name: value for name, value in os.environ.items() if name not in KERNELS}
    others = {} if KERNELS & os.environ.keys() else {"OPENBLAS_CORETYPE": "Prescott"}
    other = {**given, **others, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", ELSEWHERE, str(tmp_path / "ended"), frames]
    done = subprocess.run(command, env=other, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    if within is None:
        assert whole.step is not None
        within = max(whole.step.errors.values())
    resumed = read_results(ended.results_folder / "results.h5")
    assert resumed.status == whole.results.status
    off = relative_errors(*(Histories(x.time, x.channels) for x in (resumed, whole.results)))
    assert max(off.values()) < within


@pytest.mark.parametrize("levels", [1, pytest.param(2, marks=pytest.mark.long)])
def test_a_resumed_steady_motion_knows_what_the_search_for_it_found(tmp_path: Path, levels: int) -> None:
    given = {"kind": "steady", "revolutions": None, "extrapolation_levels": levels}
    whole = content(analyse(turning(tmp_path / "whole", **given)))
    ended = turning(tmp_path / "ended", **given)
    ended_early(ended, 0.6)
    assert_same(whole, content(analyse(ended, resumes=True)))
    assert whole["notes"]["steady growth in a period"] > 0.1


@pytest.mark.parametrize("at", [pytest.param(0.1, marks=pytest.mark.long), 0.7])
@pytest.mark.parametrize("points", [16, 1024])
def test_poses_that_return_are_found_again(tmp_path: Path, at: float, points: int, monkeypatch: Any) -> None:
    """Wherever blocks of the rigid-body motion end: beyond the first revolution its poses are those of the first."""
    monkeypatch.setattr(rigid_body, "POINTS", points)
    whole = content(analyse(turning(tmp_path / "whole")))
    ended_early(turning(tmp_path / "ended"), at)
    assert_same(whole, content(analyse(turning(tmp_path / "ended"), resumes=True)))


def test_the_envelope_goes_on_with_the_modes_that_it_had(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Looked at after so few steps that there are modes, and steps that wait, in the state."""
    monkeypatch.setattr(envelope, "STEPS", 20)
    whole = content(analyse(turning(tmp_path / "whole")))
    ended = turning(tmp_path / "ended")
    ended_early(ended, 0.7)
    stored = Packed((ended.results_folder / STATE).read_bytes()[32:])
    held = envelope_in(stored.content)
    assert all(modes["remembered"]["gain"] > 0 for modes in held["_modes"]["list"])
    assert_same(whole, content(analyse(ended, resumes=True)))


def envelope_in(said: Any) -> Any:
    """What an envelope remembers, wherever it stands in a state."""
    if isinstance(said, dict) and "_modes" in said:
        return said
    inner = said.values() if isinstance(said, dict) else said if isinstance(said, list) else ()
    return next((found for each in inner if (found := envelope_in(each)) is not None), None)


@pytest.mark.long
def test_a_run_that_is_ended_twice_goes_on_twice(tmp_path: Path) -> None:
    whole = content(analyse(turning(tmp_path / "whole")))
    scene = turning(tmp_path / "ended")
    ended_early(scene, 0.2)

    def watch(stage: str, done: int, total: int) -> None:
        if stage == "steps" and done >= 0.7 * total > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        analyse(scene, watch, resumes=True, every=0.0)
    assert_same(whole, content(analyse(scene, resumes=True)))


@pytest.mark.parametrize(
    ("changed", "key"), [({"revolutions": 3}, "analysis.revolutions"), ({"rho_inf": 0.5}, "analysis.rho_inf")]
)
def test_another_scene_is_refused_with_the_key_that_differs(tmp_path: Path, changed: dict[str, Any], key: str) -> None:
    ended_early(turning(tmp_path), 0.5)
    before = read_results(turning(tmp_path).results_folder / "results.h5")
    with pytest.raises(SceneError, match=rf"^{key}: must be .*, got "):
        analyse(turning(tmp_path, **changed), resumes=True)
    after = read_results(turning(tmp_path).results_folder / "results.h5")
    np.testing.assert_array_equal(after.time, before.time)


def test_what_a_scene_has_more_is_refused_too(tmp_path: Path) -> None:
    """Beside tables of the same kind; a second load began in the middle of the run."""
    load = {"kind": "force", "link": "coupler", "at": "B", "vector": [0, -10]}
    first, both = (turning(tmp_path, loads=dict.fromkeys(names, load)) for names in (["one"], ["one", "more"]))
    ended_early(first, 0.5)
    with pytest.raises(
        SceneError, match=r"^loads\.more\.kind: must be nothing, as in .*, got force; it has to be changed"
    ):
        analyse(both, resumes=True)


def test_another_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ended_early(turning(tmp_path), 0.5)
    monkeypatch.setattr("kedfem.resume.software", lambda: "another")
    with pytest.raises(SceneError, match=r"^software: must be .*, got another"):
        analyse(turning(tmp_path), resumes=True)


def test_without_a_state_nothing_is_resumed(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"state\.kept: must be the stored state of a run, got nothing there"):
        analyse(turning(tmp_path), resumes=True)
    run = analyse(turning(tmp_path))
    with pytest.raises(OutputError, match="the run is complete"):
        analyse(turning(tmp_path), resumes=True)
    assert read_results(run.folder / "results.h5").status == "complete"


def test_the_state_of_one_run_never_meets_the_rows_of_another(tmp_path: Path) -> None:
    scene = turning(tmp_path)
    ended_early(scene, 0.5)
    old = (scene.results_folder / STATE).read_bytes()
    analyse(scene)
    (scene.results_folder / STATE).write_bytes(old)
    with pytest.raises(OutputError, match="got another run's or fewer"):
        analyse(scene, resumes=True)
    assert read_results(scene.results_folder / "results.h5").status == "complete"


def test_missing_frames_are_noticed(tmp_path: Path) -> None:
    analysis = LOOPS["system"][1]
    ended_early(scene_of("springs", tmp_path, analysis), 0.5)
    folder = scene_of("springs", tmp_path, analysis).results_folder
    lost = sorted((folder / "animation").glob("*_0001.vtu"))[0]
    lost.unlink()
    with pytest.raises(OutputError, match=rf"{lost.name}: must be there, with its frames, to resume"):
        analyse(scene_of("springs", tmp_path, analysis), resumes=True)


def test_a_damaged_state_is_refused(tmp_path: Path) -> None:
    """A digest stands before all; behind it, what makes a file one of arrays must not be trusted either."""
    ended_early(turning(tmp_path), 0.5)
    path = turning(tmp_path).results_folder / STATE
    good = path.read_bytes()
    random = np.random.default_rng(17)
    for k in range(40):
        changed = bytearray(good)
        if k % 2:
            changed[random.integers(len(changed))] ^= 1 << int(random.integers(8))
        else:
            changed = changed[: random.integers(len(changed))]
        path.write_bytes(changed)
        with pytest.raises(OutputError, match="must be a stored state"):
            analyse(turning(tmp_path), resumes=True)


def test_a_state_makes_records_and_nothing_else() -> None:
    """No code of whoever wrote it: names of classes that are not kedfem's own records are refused."""
    for name in ("os:system", "kedfem.store:clear", "subprocess:Popen", "kedfem.cli:typer", "kedfem.resume:Keeper"):
        made = Packed(packed({"x": 1}))
        made.content["x"] = {"record": [name, {"folder": "."}]}
        if name == "kedfem.resume:Keeper":
            continue
        with pytest.raises(ValueError, match="not what was written"):
            made.put_back("x")


def test_what_was_packed_comes_back() -> None:
    said = {"a": [1, 2.5, None, float("inf")], "b": (np.arange(3.0), {"k": np.float64(0.1), 3: "x"}), "c": True}
    back = {name: Packed(packed(said)).put_back(name) for name in said}
    assert back["a"] == said["a"]
    assert back["c"] is True
    np.testing.assert_array_equal(back["b"][0], np.arange(3.0))
    assert back["b"][1] == {"k": 0.1, 3: "x"}


def test_what_cannot_be_stored_is_no_fault_of_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path) -> Any:
        raise OutputError(f"{path}: must be a file that can be written, got No space left on device")

    monkeypatch.setattr("kedfem.resume.replacing", full)
    run = analyse(turning(tmp_path), every=0.0)
    assert run.results.status == "complete"
    assert any("it could not have gone on" in each for each in run.warnings)
