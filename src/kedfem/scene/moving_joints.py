"""Joints whose directions vary in time, as they slide or turn between links that move."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from kedfem.scene.drives import Drive
from kedfem.scene.links import GROUND, Joint
from kedfem.scene.parts import Entry, Parts, fidelity, link_names

if TYPE_CHECKING:
    from kedfem.scene.scene import Scene

SHARED = (
    "revolute",
    "spherical",
    "weld",
)  # kinds that hold points of their links together, wherever these go


def by_constraint_equations(
    joint: Joint, drive: Drive | None = None, kinds: frozenset[str] = frozenset()
) -> bool:
    """Whether a joint cannot be said of points that its links share for good.

    Parameters
    ----------
    drive : of the joint, if it is driven
    kinds : what its links are meshed as: a plane link has no rotation that it could share with a beam
    """
    if joint.kind == "weld" and kinds == {"plane", "beam"}:
        return True
    if joint.bushing is not None or (drive is not None and drive.shaft_stiffness is not None):
        return True
    if joint.kind in SHARED:
        return drive is not None and GROUND not in joint.links
    return joint.kind != "prismatic" or drive is not None or GROUND not in joint.links


def moving_joints(parts: Parts) -> list[Entry]:
    """Good joints of a scene under validation enforced by constraint equations."""
    drives = {drive.word("joint"): drive.record for drive in parts.all_drives if drive.record is not None}
    good = [joint for joint in parts.joints.values() if joint.record is not None]
    return [
        joint for joint in good
        if by_constraint_equations(joint.record, drives.get(joint.name), kinds_joined(parts, joint))
    ]  # fmt: skip


def kinds_joined(parts: Parts, joint: Entry) -> frozenset[str]:
    """What the links of a joint are meshed as."""
    return frozenset(fidelity(parts.links[name]) for name in link_names(joint) if name in parts.links)


def enforced_by_equations(scene: Scene, name: str) -> bool:
    """Whether a joint of a scene is enforced by constraint equations."""
    joint = scene.joints[name]
    links = [scene.links[each] for each in joint.links if each != GROUND]
    kinds = frozenset("rigid" if link.fidelity == "rigid" else link.family for link in links)
    return by_constraint_equations(joint, scene.driven_joints.get(name), kinds)


def moving_grounds(scene: Scene) -> dict[str, str]:
    """Rigid links without a shape that drives alone move: parts of the ground. Each with its driven joint.

    One that slides on the ground and whose other joints all share points is a slider instead: its mass rides on a link.
    """
    shapeless = {
        name for name, link in scene.links.items() if link.fidelity == "rigid" and link.shape is None
    }
    return dict(_moved_by_drives(shapeless, scene.joints, scene.driven_joints)) if shapeless else {}


def moving_grounds_of(parts: Parts) -> dict[str, str]:
    """The same of a scene under validation, as far as its joints and drives are good."""
    shapeless = {
        link.name
        for link in parts.links.values()
        if link.word("fidelity") == "rigid" and not link.has("shape")
    }
    joints = {joint.name: joint.record for joint in parts.joints.values() if joint.record is not None}
    drives = {
        str(drive.word("joint")): drive.record for drive in parts.all_drives if drive.record is not None
    }
    return dict(_moved_by_drives(shapeless, joints, drives)) if shapeless else {}


def _moved_by_drives(
    shapeless: set[str], joints: Mapping[str, Joint], drives: Mapping[str, Drive]
) -> Iterator[tuple[str, str]]:
    """Links that are held by one driven joint, on the ground or on another such link, nearest to the ground first."""
    known, left = {GROUND}, dict.fromkeys(shapeless)
    while left:
        found = [(name, hub) for name in left if (hub := _hub(name, known, shapeless, joints, drives))]
        if not found:
            return
        for name, hub in found:
            known.add(name)
            del left[name]
            yield name, hub


def _hub(
    name: str, known: set[str], shapeless: set[str], joints: Mapping[str, Joint], drives: Mapping[str, Drive]
) -> str:
    """The driven joint that moves a link without a shape, "" if other joints hold it or there is none."""
    own = {key: joint for key, joint in joints.items() if name in joint.links}
    inner = [key for key, joint in own.items() if known & (set(joint.links) - {name})]
    if len(inner) != 1 or (drive := drives.get(inner[0])) is None:
        return ""
    hub = own[inner[0]]
    if (
        hub.kind not in ("revolute", "prismatic")
        or hub.bushing is not None
        or drive.shaft_stiffness is not None
    ):
        return ""
    if hub.kind == "prismatic" and GROUND in hub.links:
        others = {
            key: joint for key, joint in own.items() if key != inner[0] and not shapeless >= set(joint.links)
        }
        if others and not any(
            by_constraint_equations(joint, drives.get(key)) for key, joint in others.items()
        ):
            return ""
    return inner[0]
