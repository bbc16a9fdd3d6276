"""Joints whose directions vary in time, as they slide or turn between links that move: what they need."""

from __future__ import annotations

from collections.abc import Iterator

from kedfem.scene.drives import Drive
from kedfem.scene.faults import line
from kedfem.scene.free import any_following
from kedfem.scene.links import GROUND, Joint
from kedfem.scene.parts import Entry, Parts

SHARED = (
    "revolute",
    "spherical",
    "weld",
)  # kinds that hold points of their links together, wherever these go


def holds_by_rows(joint: Joint, drive: Drive | None = None) -> bool:
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
    """Good joints of a scene under validation that hold by rows."""
    drives = {drive.word("joint"): drive.record for drive in parts.all_drives if drive.record is not None}
    good = [joint for joint in parts.joints.values() if joint.record is not None]
    return [joint for joint in good if holds_by_rows(joint.record, drives.get(joint.name))]


def moving_faults(parts: Parts) -> Iterator[str]:
    """Frames, stiffening and numerical damping that do not suit such joints; shafts of slides."""
    for joint in moving_joints(parts):
        key, got = (
            "kind",
            f"got a {'driven ' if joint.word('kind') in SHARED else ''}{joint.word('kind')} joint",
        )
        if joint.record.bushing is not None:
            key, got = "bushing", "got one"
        if any_following(parts) and joint.word("kind") == "slot":
            yield joint.fault("kind", 'must be another than slot with frames = "following", got a slot')
        if parts.analysis.raw.get("stiffening") is True:
            yield joint.fault(key, f"must stand without analysis.stiffening, {got}")
        if parts.analysis.record is not None and parts.analysis.record.rho_inf == 1.0:
            wanted = f"must be less than 1 with joints.{joint.name} (its force would swing from step to step, and grow)"
            yield parts.analysis.fault("rho_inf", f"{wanted}: take 0.95, got 1")
        if joint.record.bushing is not None:
            yield from bushing_faults(joint)
    for drive in parts.all_drives:
        driven = parts.joints.get(drive.word("joint") or "")
        if drive.has("shaft_stiffness") and driven is not None and driven.word("kind") == "prismatic":
            yield drive.fault(
                "shaft_stiffness", f"must be given for a hinge, got {driven.name!r}, which is prismatic"
            )


def gear_frame_faults(parts: Parts) -> Iterator[str]:
    """Gears where stiffening would leave their constraint equations out."""
    for gear in parts.gears.values():
        if parts.analysis.raw.get("stiffening") is True:
            yield line(
                gear.where, "must stand without analysis.stiffening (which does not hold gears), got it"
            )


def bushing_faults(joint: Entry) -> Iterator[str]:
    """Springs against turns of a joint that lets its links turn freely."""
    kind = joint.word("kind")
    if kind in {"spherical", "slot"} and joint.record.bushing.turning_stiffness is not None:
        wanted = "must be given for a joint that holds turns"
        yield joint.fault(
            "bushing", f"{wanted}, got a {kind} joint, which leaves all free", "turning_stiffness"
        )
