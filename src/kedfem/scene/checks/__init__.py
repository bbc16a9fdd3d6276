"""Checks of a scene beyond its single records: references between tables, and combinations of options.

The checks examine the given keys and not only valid records, so that a fault of one key hides no fault of another.
"""

from __future__ import annotations

from kedfem.errors import Fault
from kedfem.scene.checks.combinations import combination_faults
from kedfem.scene.checks.drives import analysis_faults, drive_faults, gear_faults, initial_faults, undriven_faults
from kedfem.scene.checks.joints import beam_faults, coordinate_faults, joint_faults, planar_faults
from kedfem.scene.checks.links import frame_faults, link_faults
from kedfem.scene.checks.loads import fatigue_faults, load_faults, spring_faults
from kedfem.scene.checks.parts import Parts
from kedfem.scene.checks.values import reference_faults

CHECKS = (
    reference_faults, link_faults, joint_faults, coordinate_faults, drive_faults, gear_faults, load_faults, planar_faults,
    beam_faults, analysis_faults, frame_faults, spring_faults, initial_faults, undriven_faults, fatigue_faults,
    combination_faults,
)  # fmt: skip


def cross_faults(parts: Parts) -> list[Fault]:
    """The faults of combinations of keys in different parts of the scene."""
    return [fault for check in CHECKS for fault in check(parts)]
