"""Bent bars, pipes and ring segments: one section meshed with quadrilaterals and carried along lines and arcs."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import ModuleType

import numpy as np

from kedfem.mesh.cad.solids import OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh, stacked, without_spare_nodes
from kedfem.mesh.layered.division import plan_size
from kedfem.mesh.layered.partition import Plan
from kedfem.mesh.layered.plan_mesh import plan_mesh
from kedfem.mesh.layered.sections import check_volume, laid_over, reporting, section
from kedfem.mesh.session import gmsh_copy
from kedfem.mesh.swept.path import Frame, Leg, path
from kedfem.mesh.swept.shares import sized

_TURN = np.radians(18)  # of an arc per element where no size is asked for, as about an axis
_LONG = 2.5  # an element's length along the path by its size in the section, where no size is asked for


def path_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """Hexahedra of a solid that one section sweeps from end to end: bent bars and pipes, elbows, ring segments.

    Parameters
    ----------
    gmsh : with the solid in its current model, which is left as it is
    solid : the only solid in that model
    sizing : how fine: the rule of layers, in the section; along the path that size, or two and a half times it where
        none is asked for, and 20 elements to a turn

    Returns
    -------
    27-node elements, the nodes of the surface on the solid's own faces

    Raises
    ------
    OtherMethodError
        There is no such path, or the elements are poor.
    """
    legs = path(gmsh, solid)
    if not any(leg.radius for leg in legs):
        raise OtherMethodError(f"{solid.name}: a path of lines alone is one of layers")

    def mesh_of(share: float) -> SolidMesh:
        with _section_plan(gmsh, solid, legs) as plan:
            size = share * plan_size(plan, sizing)
            flat = plan_mesh(solid.name, plan, size, sizing)
        counts = [_count(leg, size * solid.extent, sizing) for leg in legs]
        frames = [legs[0].start, *(leg.at(k / (2 * n)) for leg, n in zip(legs, counts, strict=True)
                                   for k in range(1, 2 * n + 1))]  # fmt: skip
        layers, each = sum(counts), len(flat.cells)
        mesh = stacked(flat.points, np.arange(2 * layers + 1.0), np.tile(flat.cells, (layers, 1)),
                       np.repeat(np.arange(layers), each))  # fmt: skip
        points = np.concatenate(
            [frame.origin + solid.extent * flat.points @ frame.axes[:2] for frame in frames]
        )
        kind = "quadrilaterals" if flat.settings else "mapped blocks,"
        words = f"{kind} carried along {_in_words(legs)} in {layers} elements"
        return without_spare_nodes(SolidMesh(points, mesh.cells, method=words))

    return sized(solid, sizing, mesh_of)


def _in_words(legs: tuple[Leg, ...]) -> str:
    """How many lines and arcs there are."""
    arcs = sum(leg.radius > 0 for leg in legs)
    counts = {"arc": arcs, "line": len(legs) - arcs}
    return " and ".join(f"{n} {kind}{'s' * (n > 1)}" for kind, n in counts.items() if n)


def _count(leg: Leg, size: float, sizing: Sizing) -> int:
    """Elements along a leg."""
    longest, turn = (
        (size, sizing.turn) if sizing.size is not None else (_LONG * size, min(_TURN, sizing.turn))
    )
    return max(
        1, sizing.layers, round(leg.length / longest), int(np.ceil(leg.travel / turn * (leg.radius > 0)))
    )


@contextmanager
def _section_plan(gmsh: ModuleType, solid: Solid, legs: tuple[Leg, ...]) -> Iterator[Plan]:
    """The plan of the section half way along the first leg, about its centre, as thick as the path is long."""
    frame = legs[0].at(0.5)
    with gmsh_copy(gmsh, 1 / solid.extent) as copy:
        with reporting(solid, "it must have a section across its path"):
            faces = _section(copy, solid, frame)
            length = sum(leg.length for leg in legs) / solid.extent
            plan = laid_over(copy, [faces], frame.axes, solid.extent, np.array([0.0, length]))
        check_volume(solid, plan)
        yield replace(plan, origin=frame.origin)


def _section(gmsh: ModuleType, solid: Solid, frame: Frame) -> list[tuple[int, int]]:
    """The face around a frame in which its plane cuts the solid, moved to the origin."""
    occ = gmsh.model.occ
    [(_, tag)] = gmsh.model.getEntities(3)
    origin = frame.origin / solid.extent
    corners = np.array([(-1.5, -1.5, 0), (1.5, -1.5, 0), (1.5, 1.5, 0), (-1.5, 1.5, 0)]) @ frame.axes
    faces = section(gmsh, int(tag), origin + corners)
    occ.translate(faces, *(-origin))

    def away(face: tuple[int, int]) -> float:
        return float(np.linalg.norm(occ.getCenterOfMass(2, face[1])))

    nearest = min(faces, key=away)
    return [nearest]
