"""Meshes of plane outlines with straight and circular edges and round holes, made as sections of parts are."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.mesh.cad.solids import OtherMethodError, Sizing
from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.layered.cusps import without_cusps
from kedfem.mesh.layered.division import plan_size
from kedfem.mesh.layered.partition import Plan
from kedfem.mesh.layered.plan_mesh import PlanMesh, plan_mesh
from kedfem.mesh.layered.sections import plan_of_sections
from kedfem.mesh.layered.size_trials import first_good
from kedfem.mesh.memory_forecast import check_count, check_size, size_key
from kedfem.mesh.planar.areas import Quads
from kedfem.mesh.session import gmsh_model
from kedfem.scene.records.outlines import Arc, Profile

_FLAT = np.array([0.0, 1.0])  # bounds of the plan's only slab, on which sizes do not depend
_STRAIGHT = (np.nan, np.nan)


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed plane outline and round holes inside it; the scene has checked it.

    corners : (k, 2) ends of the edges in order [m]; edge i runs from corner i to corner i+1, the last one back to the
        first
    via : (k, 2) a point between the ends of each circular edge [m]; nan where the edge is straight
    centres : (h, 2) centres of the holes [m]
    radii : (h,) radii of the holes [m]
    """

    corners: Float[np.ndarray, "k 2"]
    via: Float[np.ndarray, "k 2"]
    centres: Float[np.ndarray, "h 2"]
    radii: Float[np.ndarray, " h"]


def profile_outline(profile: Profile) -> Outline:
    """The outline of a profile of the scene, in its own x and y."""
    ends = [item.to if isinstance(item, Arc) else item for item in profile.outline]
    via = [item.via[:2] if isinstance(item, Arc) else _STRAIGHT for item in profile.outline]
    corners = np.array([end[:2] for end in ends])
    edges = np.array(via[1:] + via[:1])  # an arc leads to its corner: it is the edge that starts one before
    if np.allclose(corners[0], corners[-1], rtol=0, atol=1e-9 * np.ptp(corners)):
        corners, edges = corners[:-1], edges[:-1]
    centres = np.array([hole.at[:2] for hole in profile.holes]).reshape(-1, 2)
    return Outline(corners, edges, centres, np.array([hole.diameter / 2 for hole in profile.holes]))


def rotated_outline(outline: Outline, origin: Float[np.ndarray, "2"], axis: Float[np.ndarray, "2"]) -> Outline:
    """The outline in a frame at `origin` [m] whose x runs along `axis`."""
    x = axis / np.linalg.norm(axis)
    to_frame = np.array([[x[0], -x[1]], [x[1], x[0]]])
    every = outline.corners, outline.via, outline.centres
    corners, via, centres = ((points - origin) @ to_frame for points in every)
    return Outline(corners, via, centres, outline.radii)


def outline_quads(where: str, outline: Outline, sizing: Sizing) -> tuple[Quads, str]:
    """quad9 mesh of the area inside an outline, nodes on the boundary exactly on its arcs and holes.

    Parameters
    ----------
    sizing : as for parts from CAD, see :func:`~kedfem.mesh.layered.division.plan_size`

    Returns
    -------
    (n, 2) [m] and (e, 9)
        Plane nodes; cells in VTK order, anticlockwise.
    str
        A note on cusps that were cut off, empty without any.

    Raises
    ------
    MeshError
        The size is larger than the outline or gives far too many elements, gmsh cannot be used, or the outline cannot be
        filled with quadrilaterals.
    """
    with _plan(where, outline) as plan:
        size = plan_size(plan, sizing)
        check_size(where, sizing.size, plan.extent * size, plan.extent)
        check_count(size_key(where, sizing.size), sizing.layers * plan.volume / size**2)
        try:
            _, (flat, lost) = first_good(
                lambda share: _meshed(f"{where}.shape", plan, share * size, sizing),
                lambda made: float(scaled_jacobian(made[0].points, made[0].cells).min()),
            )
        except OtherMethodError as error:
            raise MeshError(f"{error}; change mesh.size or the outline") from error
    note = f"cusps between touching edges cut off, {100 * lost:.2g} % of the area" if lost > 0 else ""
    return (plan.extent * flat.points, flat.cells), note


def _meshed(where: str, plan: Plan, size: float, sizing: Sizing) -> tuple[PlanMesh, float]:
    """The mesh of a plan without its cusps, and their share of the area."""
    whole, lost = without_cusps(plan, size)
    return plan_mesh(where, whole, size, sizing), lost


@contextmanager
def _plan(where: str, outline: Outline) -> Iterator[Plan]:
    """An outline as a plan of one region; its curves give points only within the context."""
    extent = float(np.linalg.norm(np.ptp(outline.corners, axis=0)))
    with gmsh_model() as gmsh:
        try:
            plan = plan_of_sections(gmsh, [[(2, surface_of(gmsh, outline, 1 / extent))]], np.eye(3), extent, _FLAT)
        except Exception as error:  # gmsh raises nothing more special
            raise MeshError(
                f"{where}.shape: must be an area, got none from OpenCASCADE: {error}; change the outline"
            ) from error
        yield plan


def surface_of(gmsh: ModuleType, outline: Outline, factor: float) -> int:
    """The area inside an outline as a face of gmsh's model, lengths times a factor because tolerances are absolute."""
    occ = gmsh.model.occ
    corners = [occ.addPoint(x, y, 0) for x, y in factor * outline.corners]
    edges = zip(corners, corners[1:] + corners[:1], factor * outline.via, strict=True)
    loops = [occ.addCurveLoop([
        occ.addLine(start, end) if np.isnan(via[0]) else occ.addCircleArc(start, occ.addPoint(*via, 0), end, center=False)
        for start, end, via in edges
    ])]  # fmt: skip
    for (x, y), radius in zip(factor * outline.centres, factor * outline.radii, strict=True):
        loops.append(occ.addCurveLoop([occ.addCircle(x, y, 0, radius)]))
    return int(occ.addPlaneSurface(loops))
