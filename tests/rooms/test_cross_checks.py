"""Runs that contradict themselves say so: elastic against rigid efforts, drives against energy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.prepared import Prepared
from kedfem.analysis import analyse
from kedfem.dynamics.history import Block
from kedfem.results.audit import Account
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.forces.force_elements import ElementForces, element_forces
from kedfem.results.recording import recording, rows
from kedfem.scene import scene_from
from tests.joint_checks import row_values
from tests.laws.test_limits import AXES
from tests.laws.test_moving_ground import sprung
from tests.moving import ran
from tests.rooms.test_driven_efforts import ON_CRANK, four_bar
from tests.spatial_joints import BEAMS, SLIDERS


def checked(raw: dict[str, Any], **changed: float) -> tuple[str, ...]:
    """Warnings of a run with some channels multiplied."""
    return compared(*ran(raw), **changed)[0].warnings()


def compared(ready: Prepared, blocks: list[Block], **changed: float) -> tuple[CrossChecks, Account]:
    """A run's efforts with some channels multiplied, and its energy."""
    account = Account(ready.model, element_forces(ready.scene, ready.model))
    every = recording(ready.scene, ready.model, account, ready.path)
    checks = CrossChecks(ready.scene, ready.linkage, [each.channel for each in every], account)
    for block in blocks:
        values = rows(every, block)
        checks.add(block, values | {name: x * values[name] for name, x in changed.items()})
    return checks, account


def test_a_drive_that_is_dropped_contradicts_rigid_links() -> None:
    raw = SLIDERS["driven slider without a shape"]()
    assert checked(raw) == ()
    effort, work = checked(raw, **{"drive/force": 0.0})
    assert effort.startswith("drive/force contradicts drive/rigid_force: over the run it is 0 % of it")
    assert work.startswith("drive/force: the work of the drive is off")


@pytest.mark.parametrize("acting", ["spring to the ground", "motor"])
def test_a_spring_or_motor_that_is_missing_at_the_hub_is_noticed(acting: str, monkeypatch: Any) -> None:
    raw = four_bar("rigid", ON_CRANK[acting])
    assert checked(raw) == ()
    monkeypatch.setattr(ElementForces, "on", lambda self, link, block, about: np.zeros((2, len(block), 3)))
    found = checked(raw)
    assert any(each.startswith("drive/torque contradicts drive/rigid_torque") for each in found)
    assert any(each.startswith("drive/torque: the work of the drive is off") for each in found)


@pytest.mark.parametrize("kind", [*BEAMS, *SLIDERS])
def test_drives_do_the_work_of_all_port_forces_on_the_rigid_body_motion(kind: str) -> None:
    """To rounding, with every kind of joint between links that move, springs in them or not; of inertia's slider 2e-9."""
    checks, _ = compared(*ran((BEAMS | SLIDERS)[kind]()))
    assert checks.worked
    assert checks.unworked < 1e-8


@pytest.mark.parametrize("moves", [0.0, 1e-5], ids=["at rest", "by 10 µm"])
def test_a_drive_that_holds_what_rests_is_not_judged_by_rounding(moves: float) -> None:
    """A block hangs on a spring of a ground that rests; what moves by a 30,000th of the size is judged as all else."""
    motion = {"kind": "curve", "time": [0, 0.01, 0.02], "value": [0.0, moves / 2, moves]}
    raw = sprung(AXES["oblique"], motion, end_time=0.02, step=1e-3, initial="quasi-static")
    checks, _ = compared(*ran(raw | {"gravity": [0, 0, -9.81]}))
    assert checks.warnings() == ()
    checks.unbalanced = 0.42 * checks.exchanged
    assert checks.unbalanced > 0
    if moves:
        assert checks.unworked == pytest.approx(0.42)
    assert any("by 42 % of the energy exchanged" in text for text in checks.warnings()) == bool(moves)


@pytest.mark.parametrize("effort", ["drive/A/torque", "drive/J/torque", "drive/K/force"])
def test_a_drive_that_is_dropped_beside_constraints_that_vary_is_noticed(effort: str) -> None:
    found = checked(BEAMS["driven hinge and slide"](), **{effort: 0.0})
    assert any("the work of the drive is off" in each for each in found)


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.0005, ""),
        (0.0011, "0.11 % of the energy exchanged, no more"),
        (0.075, "7.5 % of the energy exchanged: a part of its effort is missing"),
    ],
)
def test_a_little_work_that_is_left_over_is_no_missing_effort(share: float, said: str) -> None:
    checks, _ = compared(*ran(BEAMS["driven hinge and slide"]()))
    checks.unbalanced = share * checks.exchanged
    assert [said in each for each in checks.warnings()] == [True] * bool(said)
    assert all("missing" in each for each in checks.warnings()) == (share > 0.02 or not said)


@pytest.mark.parametrize(
    ("kind", "part"), [("prismatic", 1e-4), ("cylindrical", 1e-3), ("screw", 1e-2), ("universal", 5e-9)]
)
def test_what_constraints_that_vary_do_on_the_elastic_motion_is_their_forces_times_how_they_vary(
    kind: str, part: float
) -> None:
    """−∫ μᵀ C' z dt, by C and z of both ends of each step: C z = 0 at all times, so μᵀ C z' = −μᵀ C' z."""
    off = []
    for step in (1e-3, 5e-4, 2.5e-4):
        raw = BEAMS[kind]()
        raw["analysis"]["step"] = step
        ready, blocks = ran(raw)
        checks, account = compared(ready, blocks)
        work, seen = [], []
        for block in blocks:
            found = account.rows(block)
            work.append(found["work"][:, 1] - found["driven"][:, 0])
            seen.append(row_values(ready, block))
        C, z, mu = map(list, zip(*seen, strict=True))
        rate = np.einsum("tr,trk,tk->t", means(mu), np.diff(np.concatenate(C), axis=0), means(z))
        by_rows = np.concatenate([[0.0], -np.cumsum(rate)])
        assert np.abs(by_rows).max() > part * checks.exchanged
        off.append(np.abs(np.concatenate(work) - by_rows).max() / checks.exchanged)
    assert off[1] < 1e-4
    slopes = np.diff(np.log2(off))
    assert ((slopes > -2.3) & (slopes < -1.8)).all()


def means(x: list[np.ndarray]) -> np.ndarray:
    """Of both ends of each step."""
    every = np.concatenate(x)
    return 0.5 * (every[1:] + every[:-1])


@pytest.mark.parametrize(("by", "alarms"), [(0.45, 1), (0.98, 0), (1.3, 0)])
def test_half_an_effort_alarms_and_what_elastic_links_explain_does_not(by: float, alarms: int) -> None:
    """At 1 rpm nothing swings. c = 1.3 is elastic links at half of a resonance: 1 / (1 − 1/4)."""
    raw = four_bar("beam", {})
    found = checked(raw, **{"joints/C/force": by})
    assert len(found) == alarms


def test_a_force_that_statics_does_not_determine_is_named_with_its_reason(tmp_path: Path) -> None:
    """Two hinges of one link on the ground at one place share what they bear."""
    raw = four_bar("beam", {})
    raw["joints"]["D2"] = dict(raw["joints"]["D"])
    raw["output"] = {"animation": False, "plots": False, "picture": False, "folder": str(tmp_path / "r")}
    run = analyse(scene_from(raw))
    named = [each for each in run.warnings if "not reported" in each]
    assert [each.split(":")[0] for each in named] == ["joints/D/force", "joints/D2/force"]
    assert "with joint D2 (redundant constraints)" in named[0]
    assert "with joint D2 (redundant constraints)" in run.results.notes["not reported: joints/D/force"]
