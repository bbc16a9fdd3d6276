"""Second-order tetrahedra, each cut into four hexahedra of 27 nodes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from kedfem.mesh.hexahedra import HEX8, HEX27, HexMesh, quadratic, shape_functions

#: Edges of a tetrahedron in the order of gmsh's 10-node element, whose nodes 4 to 9 are their middles.
EDGES: Int[np.ndarray, "6 2"] = np.array([(0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1)])
#: Sides of a tetrahedron: side k is opposite to corner k.
SIDES: Int[np.ndarray, "4 3"] = np.array([(1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)])
_AROUND = (
    (1, 2, 3),
    (2, 0, 3),
    (0, 1, 3),
    (0, 2, 1),
)  # the other corners, right-handed, seen from each corner


@dataclass(frozen=True, slots=True)
class Tetrahedra:
    """A mesh of 10-node tetrahedra and what of its boundary lies on which face and curve of the CAD model.

    Attributes
    ----------
    points : (n, 3) [m]
        Nodes.
    cells : (t, 10)
        Node numbers, gmsh's order.
    sides, rims : dict
        Tag of a face: (s, 3) corner nodes of the triangles on it; tag of a curve: (r, 2) of the edges on it.
    """

    points: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "t 10"]
    sides: dict[int, Int[np.ndarray, "_ 3"]]
    rims: dict[int, Int[np.ndarray, "_ 2"]]


@dataclass(frozen=True, slots=True)
class Subdivision:
    """The hexahedra of a :class:`Tetrahedra`: mesh, and the nodes on each face and curve of the CAD model."""

    mesh: HexMesh
    on_face: dict[int, Int[np.ndarray, " _"]]
    on_curve: dict[int, Int[np.ndarray, " _"]]


def hexahedron_corners() -> Int[np.ndarray, "4 8"]:
    """Corners of the four hexahedra of a tetrahedron: 0–3 corners, 4–9 middles of EDGES, 10–13 of SIDES, 14 centre.

    Hexahedron v holds corner v.
    """
    middle = {frozenset(edge): 4 + i for i, edge in enumerate(EDGES.tolist())}
    side = {frozenset(corners): 10 + i for i, corners in enumerate(SIDES.tolist())}
    out = []
    for v, (a, b, c) in enumerate(_AROUND):
        below = [v, middle[frozenset({v, a})], side[frozenset({v, a, b})], middle[frozenset({v, b})]]
        above = [middle[frozenset({v, c})], side[frozenset({v, a, c})], 14, side[frozenset({v, b, c})]]
        out.append(below + above)
    return np.array(out)


def barycentric_nodes() -> Float[np.ndarray, "4 27 4"]:
    """Barycentric coordinates in the tetrahedron of the 27 nodes of its four hexahedra."""
    unit = np.eye(4)
    fifteen = np.concatenate([unit, unit[EDGES].mean(axis=1), unit[SIDES].mean(axis=1), [unit.mean(axis=0)]])
    return np.asarray(shape_functions(HEX8, HEX27.astype(float)) @ fifteen[hexahedron_corners()])


def tetrahedron_functions(b: Float[np.ndarray, "q 4"]) -> Float[np.ndarray, "q 10"]:
    """The ten quadratic functions of a tetrahedron at barycentric coordinates, gmsh's order."""
    corners, middles = b * (2 * b - 1), 4 * b[:, EDGES[:, 0]] * b[:, EDGES[:, 1]]
    return np.concatenate([corners, middles], axis=1)


def subdivision(tetrahedra: Tetrahedra) -> Subdivision:
    """Four hexahedra in place of each tetrahedron, of exactly its form.

    The barycentric coordinates are trilinear in those of a hexahedron and the tetrahedron's map is quadratic in
    them: triquadratic, which 27 nodes represent. det J is the tetrahedron's times that of the straight cut, so
    the hexahedra of a valid tetrahedron are valid.
    """
    corners = tetrahedra.cells[:, :4]
    edges, edge = _numbered(corners[:, EDGES])
    sides, side = _numbered(corners[:, SIDES])
    n, t = len(tetrahedra.points), len(corners)
    first_side = n + len(edges)
    centre = first_side + len(sides) + np.arange(t)[:, None]
    fifteen = np.concatenate([corners, n + edge, first_side + side, centre], axis=1)
    cells = fifteen[:, hexahedron_corners()].reshape(-1, 8)
    used, cells = np.unique(cells, return_inverse=True)
    full = quadratic(HexMesh(np.zeros((len(used), 3)), cells.reshape(-1, 8)))
    functions = tetrahedron_functions(barycentric_nodes().reshape(-1, 4))
    points = np.empty_like(full.points)
    points[full.cells.reshape(t, -1)] = np.einsum(
        "qa,taj->tqj", functions, tetrahedra.points[tetrahedra.cells]
    )
    slots = full.cells.reshape(t, -1)
    on_side = {tag: _on(slots, _found(sides, s), side, _slots(SIDES)) for tag, s in tetrahedra.sides.items()}
    on_edge = {tag: _on(slots, _found(edges, r), edge, _slots(EDGES)) for tag, r in tetrahedra.rims.items()}
    return Subdivision(HexMesh(points, full.cells), on_side, on_edge)


def _numbered(
    parts: Int[np.ndarray, "t p k"],
) -> tuple[Int[np.ndarray, "u k"], Int[np.ndarray, "t p"]]:
    """The different edges or sides, corners in rising order, and the number of each tetrahedron's."""
    t, p, k = parts.shape
    unique, number = np.unique(np.sort(parts, axis=2).reshape(-1, k), axis=0, return_inverse=True)
    return unique, number.reshape(t, p)


def _found(known: Int[np.ndarray, "u k"], wanted: Int[np.ndarray, "w k"]) -> Int[np.ndarray, " w"]:
    """Places of the rows `wanted`, corners in any order, in the sorted rows `known`."""
    base = int(known.max()) + 1
    powers = [base**i for i in range(known.shape[1])][::-1]
    return np.asarray(np.searchsorted(known @ powers, np.sort(wanted, axis=1) @ powers))


def _slots(parts: Int[np.ndarray, "p k"]) -> Bool[np.ndarray, "p 108"]:
    """Which of the 4 · 27 nodes of a tetrahedron lie on each of its edges or sides."""
    b = barycentric_nodes().reshape(-1, 4)
    off = np.ones((len(parts), 4), dtype=bool)
    np.put_along_axis(off, parts, values=False, axis=1)
    return np.asarray((b[None] * off[:, None] == 0).all(axis=2))


def _on(
    slots: Int[np.ndarray, "t 108"],
    wanted: Int[np.ndarray, " w"],
    number: Int[np.ndarray, "t p"],
    slot: Bool[np.ndarray, "p 108"],
) -> Int[np.ndarray, " m"]:
    """Nodes of the hexahedra on the edges or sides with the numbers `wanted`."""
    chosen = np.isin(number, wanted)
    return np.unique(np.concatenate([slots[chosen[:, p]][:, on].ravel() for p, on in enumerate(slot)]))
