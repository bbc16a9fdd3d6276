"""Coupling surfaces of joints on links and on segments of links."""

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import bore_axis
from kedfem.errors import KedfemError, MeshError, SceneError
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import (
    CouplingSurface,
    determines_gradient,
    joint_surface,
    rigid_link_surface,
)
from kedfem.scene import Scene

Key = TypeVar("Key")
T = TypeVar("T")


def surface_of(scene: Scene, name: str, link: Link) -> CouplingSurface:
    """The coupling surface of a joint on a link; all of a rigid one for a hinge across a flat face of it."""
    joint = scene.joints[name]
    axis, at = bore_axis(joint, link.name), np.asarray(joint.at)
    surface = joint_surface(link, f"joints.{name}", at, axis, joint.face_names(link.name))
    across = joint.kind == "revolute" and axis is not None and not determines_gradient(surface, axis)
    whole = across and link.rigid and link.d == 3 and link.full is not None and link.full.meshed
    return rigid_link_surface(link, at) if whole else surface


def on_part(
    links: Mapping[Key, Link], name: str, at: Float[np.ndarray, "3"], found: Callable[[Link], T]
) -> tuple[Key, T]:
    """The key of the segment of a link that has something at a point, nearest first, and what was found on it.

    Raises
    ------
    MeshError, SceneError
        That of the nearest segment, if none has it.
    """
    parts = {key: link for key, link in links.items() if link.name == name}
    gap = {key: float(np.linalg.norm((link.full or link).nodes - at, axis=1).min()) for key, link in parts.items()}
    first: KedfemError | None = None
    for key in sorted(parts, key=lambda key: gap[key]):
        try:
            return key, found(parts[key])
        except (MeshError, SceneError) as error:
            first = first or error
    raise first or MeshError(f"links.{name}: must be elastic, got no link of that name")


def part_surface(scene: Scene, joint: str, links: Mapping[str, Link], name: str) -> tuple[str, CouplingSurface]:
    """The segment of a link on which a joint sits, and the coupling surface."""
    at = np.asarray(scene.joints[joint].at)
    return on_part(links, name, at, lambda link: surface_of(scene, joint, link))
