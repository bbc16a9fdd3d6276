"""Solids with six four-edged faces, such as a tapered or a bent bar, which gmsh maps as one block."""

from types import ModuleType

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh.cad.solids import OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh, without_unused_nodes
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.elements.shape_functions import HEX27, node_numbers
from kedfem.mesh.layered.size_trials import good_enough
from kedfem.mesh.session import GMSH_HEX27, boundary, gmsh_copy, gmsh_errors_at_end, gmsh_options, numbered_nodes

_MOST = 2000  # cubes of the default size in the volume
_TURN = np.radians(20)  # angle of a curved edge per element: parabolas miss 5e-5 of a circle's area
#: gmsh's defaults, which an earlier mesh may have changed.
_OPTIONS: dict[str, float] = {
    "Mesh.ElementOrder": 1.0,
    "Mesh.SecondOrderIncomplete": 0.0,
    "Mesh.SecondOrderLinear": 0.0,
    "Mesh.SubdivisionAlgorithm": 0.0,
}


def block_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """hex27 mesh of a solid that has six faces of any form with four edges each, a `Method`.

    Without a size there are `across` elements along the shortest of the three sets of opposite edges, by their mean
    length, but not more than about 2000 in all.

    Raises
    ------
    OtherMethodError
        The solid is not such a block, gmsh cannot map it, or the elements are bad.
    """
    with gmsh_copy(gmsh, 1 / solid.extent) as copy:
        groups = _edge_groups(copy, solid)
        counts = _counts(copy, solid, groups, sizing)
        try:
            mesh = _transfinite(copy, groups, counts)
        except Exception as error:  # gmsh raises nothing more special
            got = f"one block must be mapped, got from gmsh: {error}"
            raise OtherMethodError(f"{solid.name}: {got}") from error
    method = "one mapped block of {} × {} × {} elements".format(*sorted(counts, reverse=True))
    return good_enough(solid, SolidMesh(solid.extent * mesh.points, mesh.cells, method=method), "one block")


def _edge_groups(gmsh: ModuleType, solid: Solid) -> list[set[int]]:
    """The three sets of four edges that are opposite each other in the faces."""
    faces = [boundary(gmsh, 2, tag) for _, tag in gmsh.model.getEntities(2)]
    edges = set().union(*faces)
    ends = {edge: boundary(gmsh, 1, edge) for edge in edges}
    groups = [{edge} for edge in sorted(edges)]
    for face in faces:
        for edge in face:
            opposite = [other for other in face if not ends[other] & ends[edge]]
            ours = [group for group in groups if group & {edge, *opposite}]
            groups = [group for group in groups if group not in ours] + [set().union(*ours)]
    vertices = set().union(*ends.values()) if ends else set()
    if (len(faces), len(vertices), [len(group) for group in groups]) != (6, 8, [4, 4, 4]):
        wanted = "one block must have six faces with four edges each"
        raise OtherMethodError(f"{solid.name}: {wanted}, got {len(faces)} faces")
    return groups


def _counts(gmsh: ModuleType, solid: Solid, groups: list[set[int]], sizing: Sizing) -> list[int]:
    """Number of elements along each set of edges."""
    lengths = [[float(gmsh.model.occ.getMass(1, edge)) for edge in group] for group in groups]
    turns = [max(_angle(gmsh, edge) for edge in group) for group in groups]
    if sizing.size is not None:
        size = sizing.size / solid.extent
    else:
        least = (solid.volume / solid.extent**3 / _MOST) ** (1 / 3)
        size = max(min(float(np.mean(group)) for group in lengths) / sizing.across, least)
    turn = min(_TURN, sizing.angle)
    return [
        max(sizing.layers, int(np.rint(max(group) / size)), int(np.ceil(angle / turn - 1e-9)), 1)
        for group, angle in zip(lengths, turns, strict=True)
    ]


def _angle(gmsh: ModuleType, edge: int) -> float:
    """Angle by which the tangent turns along an edge [rad]."""
    low, high = (float(bound[0]) for bound in gmsh.model.getParametrizationBounds(1, edge))
    slopes = np.reshape(gmsh.model.getDerivative(1, edge, np.linspace(low, high, 33)), (-1, 3))
    along = slopes / np.linalg.norm(slopes, axis=1, keepdims=True)
    return float(np.arccos(np.clip((along[1:] * along[:-1]).sum(axis=1), -1, 1)).sum())


def _transfinite(gmsh: ModuleType, groups: list[set[int]], counts: list[int]) -> SolidMesh:
    """gmsh's mapped mesh of hex27 elements, nodes in VTK's order."""
    model = gmsh.model.mesh
    for group, count in zip(groups, counts, strict=True):
        for edge in group:
            model.setTransfiniteCurve(edge, count + 1)
    for _, face in gmsh.model.getEntities(2):
        model.setTransfiniteSurface(face)
        model.setRecombine(2, face)
    for _, volume in gmsh.model.getEntities(3):
        model.setTransfiniteVolume(volume)
    with gmsh_options(gmsh, _OPTIONS), gmsh_errors_at_end(gmsh):
        model.generate(3)
        model.setOrder(2)
    kinds, _, nodes = model.getElements(3)
    if list(kinds) != [GMSH_HEX27]:
        raise OtherMethodError("other elements than hexahedra")
    points, tags = numbered_nodes(gmsh)
    return gmsh_hexahedra(gmsh, points, np.searchsorted(tags, nodes[0]).reshape(-1, len(HEX27)))


def gmsh_hexahedra(gmsh: ModuleType, points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e 27"]) -> SolidMesh:
    """The mesh of hex27 cells in gmsh's order of nodes, which may be mirrored."""
    theirs = np.reshape(gmsh.model.mesh.getElementProperties(GMSH_HEX27)[4], (-1, 3)).round()
    mesh = without_unused_nodes(SolidMesh(points, cells[:, node_numbers(theirs, HEX27)]))
    if (mesh_quality(mesh).scaled_jacobian < 0).all():
        mesh = SolidMesh(mesh.points, mesh.cells[:, node_numbers(HEX27, HEX27 * [-1, 1, 1])])
    return mesh
