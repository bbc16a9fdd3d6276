"""The core of a solid of revolution: a disc of quadrilaterals extruded along the axis, so that no wedges are needed."""

from collections.abc import Callable

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.elements.hexahedra import SolidMesh, in_layers
from kedfem.mesh.layered.mapping import Mapping, Rim, mapped
from kedfem.mesh.layered.partition import Curve, Plan, Region
from kedfem.mesh.planar.areas import quadratic_quads
from kedfem.mesh.planar.choice import best_quads

NEAR = 1e-7  # distance, in sizes of the solid, within which points are on the axis or the same
_SHARE = 0.6  # the core's radius over the least radius of anything off the axis
_HALVINGS = 50

Ending = Callable[[Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]


def core_radius(plan: Plan) -> float:
    """Radius of a core whose ends are smooth faces across the axis [-]; 0 if nothing touches the axis.

    Parameters
    ----------
    plan : the meridian section: x along the axis, y from it
    """
    least, touches = np.inf, False
    for radii in (curve.samples[:, 1] for curve in plan.curves):
        if radii.max() < NEAR:
            touches = True
            continue
        from_axis = [way for way in (radii, radii[::-1]) if way[0] < NEAR]
        rising = [np.append(np.diff(way) > 0, False) for way in from_axis]
        least = min([least, *(float(way[np.argmin(up)]) for way, up in zip(from_axis, rising, strict=True))])
        if not from_axis:
            least = min(least, float(radii.min()))
    return _SHARE * least if touches else 0.0


def disc(around: int) -> tuple[Float[np.ndarray, "n 2"], Int[np.ndarray, "e 9"]]:
    """Nodes and quad9 cells of the unit disc, the first corner at angle 0: a square of cells inside rings of cells.

    Parameters
    ----------
    around : number of sides around it, a multiple of 4
    """
    angles = np.arange(2 * around) * np.pi / around
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rim = Rim(circle[::2], ((np.append(np.arange(around), 0),),), circle[1::2])
    best = best_quads([mapped(rim, Mapping("disc"))])
    if best is None:
        raise ValueError("a disc must have a mesh")
    full = quadratic_quads(best.corners)
    return full.points, full.cells


def core_mesh(plan: Plan, region: Region, radius: float, stations: Float[np.ndarray, " s"], around: int) -> SolidMesh:
    """hex27 mesh of the solid that a region about the axis sweeps, by the solid's extent; x runs along the axis.

    Each layer is a disc; their shapes change gradually from one end to the other.

    Parameters
    ----------
    plan : the meridian section, within its context
    region : the part between the axis and the core's radius, from one end to the other
    radius : the core's radius [-]
    stations : (s,) rising x of the nodes on the core's surface, two for each element and one more [-]
    around : number of elements around the axis
    """
    points, quads = disc(around)
    low, high = _ends(plan, region)
    shares = (stations - stations[0]) / (stations[-1] - stations[0])
    mesh = in_layers(points, shares, quads)
    radii, back = np.unique(np.round(np.linalg.norm(points, axis=1), 12), return_inverse=True)
    first, last = (np.tile(end(radius * radii)[back], len(shares)) for end in (low, high))
    share = mesh.points[:, 2]
    along = (1 - share) * first + share * last
    return SolidMesh(np.column_stack([along, radius * mesh.points[:, :2]]), mesh.cells)


def _ends(plan: Plan, region: Region) -> list[Ending]:
    """Functions from radii to x of both ends of a core, that with the least x first."""
    (loop,) = region.loops
    ends = []
    for i, _ in loop:
        radii = plan.curves[i].samples[[0, -1], 1]
        if radii.min() < NEAR < radii.max():
            ends.append(plan.curves[i])
    if len(ends) != 2:
        raise ValueError("a core must have two ends")
    ends.sort(key=lambda curve: float(curve.samples[:, 0].mean()))
    return [_along(curve) for curve in ends]


def _along(curve: Curve) -> Ending:
    """The function from radii to x of a curve that rises from the axis, by bisection."""
    rises = curve.samples[0, 1] < curve.samples[-1, 1]

    def at(radii: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        low, high = np.zeros(len(radii)), np.full(len(radii), curve.length)
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            beyond = (curve.places(middle)[:, 1] > radii) == rises
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return np.asarray(curve.places((low + high) / 2)[:, 0])

    return at
