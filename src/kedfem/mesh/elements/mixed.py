"""Meshes of mixed cells converted to one kind: 20-node hexahedra if all are hexahedra, else 10-node tetrahedra.

Hexahedra, wedges and pyramids are divided from their corner of least number, their quadrilateral sides likewise, so
that neighbours agree: J. Dompierre, P. Labbé, M.-G. Vallet, R. Camarero, How to subdivide pyramids, prisms and hexahedra
into tetrahedra, Proc. 8th Int. Meshing Roundtable (1999) 195-204.
"""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.mesh.elements.shape_functions import EDGES, HEX20, HEX27, node_numbers, shape_functions

#: Sides of each kind of cell, by its number of corners, in VTK's order.
_SIDES: dict[int, tuple[tuple[int, ...], ...]] = {
    4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    5: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
#: Edges of each kind of cell in the order of the nodes in their middles.
EDGES_OF: dict[int, tuple[tuple[int, int], ...]] = {
    4: tuple((int(i), int(j)) for i, j in EDGES),
    5: ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)),
    6: ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
    8: ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
}
_DIAGONALS = ((0, 6), (1, 7), (2, 4), (3, 5))  # of a hexahedron, through its centre
_CENTRE = shape_functions(HEX20, np.zeros((1, 3)))[0]

Cells = Int[np.ndarray, "e k"]


def one_kind(
    points: Float[np.ndarray, "n 3"], blocks: Mapping[int, list[Cells]]
) -> tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "q k"]]:
    """All cells as hexahedra of 20 nodes, or as tetrahedra of 10 if not all are hexahedra.

    Parameters
    ----------
    blocks : cells in VTK's order, by their number of corners

    Returns
    -------
    (m, 3) [m]
        The given nodes, then new ones in the middles of edges, taken from quadratic cells where there are any.
    (e, 20) or (e, 10)
        The cells.

    Raises
    ------
    MeshError
        A quadrilateral side lies on two triangles of tetrahedra that divide it along the other diagonal.
    """
    if set(blocks) == {8}:
        corners = np.concatenate([cells[:, :8] for cells in blocks[8]])
        return _with_middles(points, blocks, corners, corners[:, np.array(EDGES_OF[8])])
    return tetrahedra(points, blocks)


def tetrahedra(
    points: Float[np.ndarray, "n 3"], blocks: Mapping[int, list[Cells]]
) -> tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "t 10"]]:
    """All cells as tetrahedra of 10 nodes; parameters, nodes and errors are those of `one_kind`."""
    every = ((count, cells) for count, each in blocks.items() for cells in each)
    fours = np.concatenate([_tetrahedra(cells[:, :count], count) for count, cells in every])
    if len(blocks) > 1:
        _check_fit(fours, blocks)
    return _with_middles(points, blocks, fours, fours[:, EDGES])


def triangles(quads: Int[np.ndarray, "q 4"]) -> Int[np.ndarray, "t 3"]:
    """Two triangles of each quadrilateral side, divided from its corner of least number."""
    turned = _from_least(quads)
    return np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])


def _from_least(quads: Int[np.ndarray, "q 4"]) -> Int[np.ndarray, "q 4"]:
    return np.take_along_axis(quads, (quads.argmin(axis=1)[:, None] + np.arange(4)) % 4, axis=1)


def _tetrahedra(corners: Cells, count: int) -> Int[np.ndarray, "t 4"]:
    """Tetrahedra from each cell's corner of least number to the triangles of the sides that do not contain it."""
    if count == 4:
        return corners
    first = corners.argmin(axis=1)
    out = []
    for side in _SIDES[count]:
        opposite = corners[~np.isin(first, side)]
        flat = opposite[:, side]
        three = flat if len(side) == 3 else triangles(flat)
        apex = np.tile(opposite.min(axis=1), len(three) // max(len(opposite), 1))
        out.append(np.column_stack([three[:, ::-1], apex]))  # sides are listed as seen from outside
    return np.concatenate(out)


def _middles(
    points: Float[np.ndarray, "n 3"], blocks: Mapping[int, list[Cells]]
) -> tuple[Int[np.ndarray, "p 2"], Float[np.ndarray, "p 3"]]:
    """Pairs of corners with an edge or diagonal between them, and its middle, that of quadratic cells first."""
    pairs, places = [], []
    each = [(count, cells) for count, several in blocks.items() for cells in several]
    for count, cells in sorted(each, key=lambda one: one[1].shape[1] == one[0]):
        edges, corners = EDGES_OF[count], cells[:, :count]
        X = points[corners]
        M = X[:, np.array(edges)].mean(axis=2)
        if cells.shape[1] > count:
            M = points[cells[:, count : count + len(edges)]]
        pairs += [corners[:, [i, j]] for i, j in edges]
        places += list(np.swapaxes(M, 0, 1))
        for side in (each for each in _SIDES[count] if len(each) == 4):
            round_ = [edges.index((i, j) if (i, j) in edges else (j, i)) for i, j in pairwise([*side, side[0]])]
            centre = M[:, round_].sum(axis=1) / 2 - X[:, side].sum(axis=1) / 4  # of a serendipity side
            if cells.shape[1] == len(HEX27):
                middle = node_numbers(HEX27, HEX27[list(side)].mean(axis=0, keepdims=True))[0]
                centre = points[cells[:, middle]]
            pairs += [corners[:, [side[0], side[2]]], corners[:, [side[1], side[3]]]]
            places += [centre, centre]
        if count == 8:
            body = np.einsum("a,eak->ek", _CENTRE, np.concatenate([X, M], axis=1))
            if cells.shape[1] == len(HEX27):
                body = points[cells[:, 26]]
            pairs += [corners[:, list(ends)] for ends in _DIAGONALS]
            places += [body] * len(_DIAGONALS)
    known, first = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0, return_index=True)
    return known, np.concatenate(places)[first]


def _with_middles(
    points: Float[np.ndarray, "n 3"], blocks: Mapping[int, list[Cells]], corners: Cells, ends: Int[np.ndarray, "e j 2"]
) -> tuple[Float[np.ndarray, "m 3"], Int[np.ndarray, "e q"]]:
    """Cells with a node in the middle of each edge, all middles after the other nodes."""
    n, (pairs, middles) = len(points), _middles(points, blocks)
    keys = pairs[:, 0] * n + pairs[:, 1]
    wanted = np.sort(ends, axis=2)
    number = np.searchsorted(keys, wanted[..., 0] * n + wanted[..., 1])
    return np.concatenate([points, middles]), np.column_stack([corners, n + number])


def _check_fit(fours: Int[np.ndarray, "t 4"], blocks: Mapping[int, list[Cells]]) -> None:
    """Refuse sides that neighbouring tetrahedra divide along the other diagonal: the mesh would be open there."""
    sides = np.sort(np.concatenate([fours[:, list(side)] for side in _SIDES[4]]), axis=1)
    alone, often = np.unique(sides, axis=0, return_counts=True)
    outer = {tuple(side) for side in alone[often == 1].tolist()}
    wrong = 0
    for count, several in blocks.items():
        for side in (side for side in _SIDES[count] if len(side) == 4):
            turned = _from_least(np.concatenate([cells[:, list(side)] for cells in several]))
            other = np.sort(turned[:, [0, 1, 3]], axis=1).tolist()
            wrong += sum(tuple(three) in outer for three in other)
    if wrong:
        raise MeshError(
            "hexahedra, wedges and pyramids must share whole sides with their neighbours, "
            f"got {wrong} quadrilateral sides that neighbouring tetrahedra divide along the other diagonal; "
            "put pyramids between them"
        )
