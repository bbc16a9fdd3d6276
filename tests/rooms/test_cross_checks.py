"""Runs that contradict themselves say so: elastic against rigid efforts, drives against energy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kedfem.analysis import analyse
from kedfem.results.acting import Measured
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.recording import recording, rows
from kedfem.scene import scene_from
from tests.moving import ran
from tests.rooms.test_driven_efforts import ON_CRANK, four_bar
from tests.spatial_joints import SLIDERS


def checked(raw: dict[str, Any], **changed: float) -> tuple[str, ...]:
    """Warnings of a run with some channels multiplied."""
    ready, blocks = ran(raw)
    every = recording(ready.scene, ready.model, along=ready.path)
    checks = CrossChecks(ready.scene, ready.linkage, [each.channel for each in every], ready.model.rows)
    for block in blocks:
        values = rows(every, block)
        checks.add(block.motion, values | {name: x * values[name] for name, x in changed.items()})
    return checks.warnings()


def test_a_drive_that_is_dropped_contradicts_rigid_links() -> None:
    raw = SLIDERS["driven slider without a shape"]()
    assert checked(raw) == ()
    (effort,) = checked(raw, **{"drive/force": 0.0})
    assert effort.startswith("drive/force contradicts drive/rigid_force: over the run it is 0 % of it")


@pytest.mark.parametrize("acting", ["spring to the ground", "motor"])
def test_a_spring_or_motor_that_is_missing_at_the_hub_is_noticed(acting: str, monkeypatch: Any) -> None:
    raw = four_bar("rigid", ON_CRANK[acting])
    assert checked(raw) == ()
    monkeypatch.setattr(Measured, "on", lambda self, link, block, about: np.zeros((2, len(block), 3)))
    found = checked(raw)
    assert any(each.startswith("drive/torque contradicts drive/rigid_torque") for each in found)
    assert any(each.startswith("drive/torque: the work of the drive is off") for each in found)


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
