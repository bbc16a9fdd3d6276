"""Joints whose directions vary in time, as they slide or turn between links that move."""

from __future__ import annotations

from kedfem.scene.drives import Drive
from kedfem.scene.links import GROUND, Joint
from kedfem.scene.parts import Entry, Parts

SHARED = (
    "revolute",
    "spherical",
    "weld",
)  # kinds that hold points of their links together, wherever these go


def by_constraint_equations(joint: Joint, drive: Drive | None = None) -> bool:
    """Whether a joint cannot be said of points that its links share for good.

    Parameters
    ----------
    drive : of the joint, if it is driven
    """
    if joint.bushing is not None or (drive is not None and drive.shaft_stiffness is not None):
        return True
    if joint.kind in SHARED:
        return drive is not None and GROUND not in joint.links
    return joint.kind != "prismatic" or drive is not None or GROUND not in joint.links


def moving_joints(parts: Parts) -> list[Entry]:
    """Good joints of a scene under validation enforced by constraint equations."""
    drives = {drive.word("joint"): drive.record for drive in parts.all_drives if drive.record is not None}
    good = [joint for joint in parts.joints.values() if joint.record is not None]
    return [joint for joint in good if by_constraint_equations(joint.record, drives.get(joint.name))]
