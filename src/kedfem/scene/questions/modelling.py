"""Modelling of links and joints: frames, joints enforced by equations, moving parts of the ground, sliders."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from kedfem.scene.records.drives import Drive, prescribes_travel
from kedfem.scene.records.force_elements import LineSpring
from kedfem.scene.records.joints import Joint
from kedfem.scene.records.links import GROUND, Frames
from kedfem.scene.records.points import XYZ
from kedfem.scene.records.scene import Scene


def link_frames(scene: Scene, name: str) -> Frames:
    """The frames of one link: its own choice, else that of the analysis."""
    return scene.links[name].frames or scene.analysis.frames or default_frames(bool(scene.driven_joints))


def default_frames(driven: bool) -> Frames:
    """Frames by default: rigid-body ones with a drive; without one there is no rigid-body motion."""
    return "rigid-body" if driven else "co-rotational"


def corotational_links(scene: Scene) -> frozenset[str]:
    """Names of the links with co-rotational frames."""
    return frozenset(name for name in scene.links if link_frames(scene, name) == "co-rotational")


def corotational(scene: Scene) -> bool:
    """Whether any link has co-rotational frames, so that the equation is not linear."""
    return bool(corotational_links(scene))


def driven_travel(scene: Scene, name: str) -> bool:
    """Whether one of `Scene.all_drives` prescribes a travel of its joint and not an angle."""
    drive = scene.all_drives[name]
    return prescribes_travel(scene.joints[drive.joint].kind, drive.coordinate, drive.along)


def unsupported(scene: Scene) -> tuple[str, ...]:
    """Names of the links that neither joints nor springs connect with the ground, directly or by other links."""
    pairs = [set(joint.links) for joint in scene.joints.values()]
    springs = [x for x in scene.springs.values() if isinstance(x, LineSpring)]
    pairs += [{end.link for end in spring.between} for spring in springs if spring.between is not None]
    reached = {GROUND}
    while more := {name for pair in pairs if reached & pair for name in pair} - reached:
        reached |= more
    return tuple(name for name in scene.links if name not in reached)


SHARED = ("revolute", "spherical", "weld")  # kinds whose links can share points permanently


def by_constraint_equations(joint: Joint, drives: Sequence[Drive] = (), kinds: frozenset[str] = frozenset()) -> bool:
    """Whether a joint cannot be enforced by points that its links share permanently.

    Parameters
    ----------
    drives : drives of the joint
    kinds : models of its elastic links: a plane link has no rotation that it could share with a beam
    """
    if joint.kind == "weld" and kinds == {"plane", "beam"}:
        return True
    if joint.bushing is not None or any(drive.shaft_stiffness is not None for drive in drives):
        return True
    if joint.kind in SHARED:
        return bool(drives) and GROUND not in joint.links
    return joint.kind != "prismatic" or bool(drives) or GROUND not in joint.links


def moving_grounds(scene: Scene) -> dict[str, str]:
    """Moving parts of the ground (rigid links without a shape that drives alone move) with their driven joints."""
    shapeless = {name for name, link in scene.links.items() if link.model == "rigid" and link.shape is None}
    return dict(_moved_by_drives(shapeless, scene)) if shapeless else {}


def masses_alone(scene: Scene) -> dict[str, str]:
    """Sliders, which are rigid links without a shape that a guide keeps from rotating, with that joint.

    Of several guides it is one on the ground.
    """
    guides = [(key, joint) for key, joint in scene.joints.items() if joint.kind == "prismatic"]
    guides.sort(key=lambda each: GROUND not in each[1].links)
    bare = [name for name, link in scene.links.items() if link.model == "rigid" and link.shape is None]
    found = {name: next((key for key, joint in guides if name in joint.links), "") for name in bare}
    moved = moving_grounds(scene) if any(found.values()) else {}
    return {name: guide for name, guide in found.items() if guide and name not in moved}


def mass_place(scene: Scene, name: str) -> XYZ:
    """Place of the mass of a rigid link without a shape [m]: its driven joint, or the first joint that is not a guide."""
    if drive_joint := moving_grounds(scene).get(name):
        return scene.joints[drive_joint].at
    on = [joint for joint in scene.joints.values() if name in joint.links]
    return next((joint.at for joint in on if joint.kind != "prismatic"), on[0].at)


def _moved_by_drives(shapeless: set[str], scene: Scene) -> Iterator[tuple[str, str]]:
    """Links with one driven joint to the ground or another such link, nearest to the ground first, and that joint."""
    known, left = {GROUND}, dict.fromkeys(shapeless)
    while left:
        found = [(name, drive_joint) for name in left if (drive_joint := _drive_joint(name, known, scene))]
        if not found:
            return
        for name, drive_joint in found:
            known.add(name)
            del left[name]
            yield name, drive_joint


def _drive_joint(name: str, known: set[str], scene: Scene) -> str:
    """The driven joint that moves a link without a shape; empty without one, or if other joints constrain the link."""
    drives, joints = scene.driven_joints, scene.joints.items()
    own = {key: joint for key, joint in joints if name in joint.links}
    inner = [key for key, joint in own.items() if known & (set(joint.links) - {name})]
    if len(inner) != 1 or inner[0] not in drives:
        return ""
    drive_joint = own[inner[0]]
    if drive_joint.kind not in ("revolute", "prismatic") or drive_joint.bushing or drives[inner[0]][0].shaft_stiffness:
        return ""
    return inner[0]


def yield_strengths(scene: Scene) -> dict[str, float]:
    """Link → yield strength of its material [Pa], of links whose material has one."""
    named = {name: scene.materials.get(str(link.material)) for name, link in scene.links.items()}
    return {name: x.yield_strength for name, x in named.items() if x is not None and x.yield_strength is not None}
