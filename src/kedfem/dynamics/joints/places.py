"""Coupling surfaces of joints on links and on segments of links."""

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import bore_axis
from kedfem.errors import KedfemError, MeshError, SceneError
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, joint_surface
from kedfem.scene import Scene

Key = TypeVar("Key")
T = TypeVar("T")


def surface_of(scene: Scene, name: str, link: Link) -> CouplingSurface:
    """The coupling surface of a joint on a link."""
    joint = scene.joints[name]
    axis = bore_axis(joint, link.name)
    return joint_surface(link, f"joints.{name}", np.asarray(joint.at), axis, joint.face_names(link.name))


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
