"""What a scene must satisfy beyond its records: tables that refer to each other, and what is combined in it.

The checks look at what was given, not only at good records, so that a fault in one key hides no fault in another.
"""

from __future__ import annotations

from kedfem.errors import Fault
from kedfem.scene.checks.analysis import analysis_faults
from kedfem.scene.checks.combinations import combination_faults
from kedfem.scene.checks.drives import drive_faults, gear_faults
from kedfem.scene.checks.fatigue import fatigue_faults
from kedfem.scene.checks.joints import joint_faults
from kedfem.scene.checks.links import link_faults
from kedfem.scene.checks.loads import load_faults, reference_faults
from kedfem.scene.checks.parts import Parts
from kedfem.scene.checks.planes import beam_faults, planar_faults
from kedfem.scene.checks.undriven import (
    frame_faults,
    initial_faults,
    limit_faults,
    motor_faults,
    spring_faults,
    undriven_faults,
)


def cross_faults(parts: Parts) -> list[Fault]:
    """The faults that only show when parts of the scene are seen together."""
    checks = (
        reference_faults,
        link_faults,
        joint_faults,
        drive_faults,
        gear_faults,
        load_faults,
        planar_faults,
        beam_faults,
        analysis_faults,
        frame_faults,
        motor_faults,
        spring_faults,
        limit_faults,
        initial_faults,
        undriven_faults,
        fatigue_faults,
        combination_faults,
    )
    return [fault for check in checks for fault in check(parts)]
