"""Animation frames of rigid links: their surfaces, or sticks between joints where there is no shape."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int

from kedfem.links.beams.spatial_recovery import drawn
from kedfem.links.record import Link
from kedfem.mesh.cad.sides import boundary_sides, side_corners
from kedfem.motion.constraints import cross
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.output.fields import RigidField
from kedfem.scene import Scene


@dataclass(frozen=True, slots=True)
class Sight:
    """What is seen of a link.

    body : its number
    points : (n, 3) in the reference position [m]
    cells : (e, k) and meshio's name of them
    """

    name: str
    body: int
    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "e k"]
    cell_type: str


def sights(scene: Scene, linkage: Linkage, links: Mapping[str, Link]) -> list[Sight]:
    """Of all links; those without a record are sticks between their joints."""
    out = []
    for name in scene.links:
        link = links.get(name)
        points, cells, kind = _sticks(scene, name) if link is None else _seen(link)
        used, numbers = np.unique(cells, return_inverse=True)
        body = linkage.bodies.index(name)
        out.append(Sight(name, body, points[used], numbers.reshape(cells.shape), kind))
    return out


def rigid_fields(every: Sequence[Sight], motion: RigidMotion, k: int) -> list[RigidField]:
    """All links at one time point, with velocities and accelerations."""
    out = []
    for each in every:
        b = each.body
        arms = each.points @ motion.R[k, b].T
        velocity = motion.v[k, b] + cross(np.broadcast_to(motion.omega[k, b], arms.shape), arms)
        acceleration = motion.p2[k, b] + each.points @ motion.R2[k, b].T
        points = motion.p[k, b] + arms
        out.append(RigidField(each.name, each.cell_type, each.cells, points, velocity, acceleration))
    return out


def _seen(link: Link) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e k"], str]:
    if link.kind == "spatial_beam":
        values, _, cells = drawn(link)
        return np.asarray(values @ link.X), boundary_sides(cells), "quad"
    if link.kind == "beam":
        return link.X, link.cells, link.cell_type
    if link.kind == "plane":
        return link.X, link.cells[:, :4], "quad"
    sides = boundary_sides(link.cells)
    corners = side_corners(sides.shape[1])
    return link.X, sides[:, :corners], "quad" if corners == 4 else "triangle"


def _sticks(scene: Scene, name: str) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e k"], str]:
    """Lines between all joints of a link; a dot where all are at one place."""
    at = [joint.at for joint in scene.joints.values() if name in joint.links]
    points = np.array(list(dict.fromkeys(at)))
    if len(points) == 1:
        return points, np.zeros((1, 1), int), "vertex"
    return points, np.array(list(combinations(range(len(points)), 2))), "line"
