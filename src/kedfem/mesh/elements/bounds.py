"""Bounds of det J over whole elements, not only at the nodes and Gauss points.

det J of a hex27 is a polynomial of degree 5 in each reference coordinate (hex8: 2; quad9: 3); that of a tet10 has the
total degree 3. Its Bernstein coefficients bound it from both sides, and halving the element tightens the bounds:
A. Johnen, J.-F. Remacle, C. Geuzaine, Geometrical validity of curvilinear finite elements, J. Comput. Phys. 233 (2013)
359-372.
"""

from functools import cache, reduce
from math import comb, factorial, prod

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.mesh.elements.shape_functions import EDGES, HEX8, HEX20, NODES, QUAD9, TET10, shape_gradients

_CHUNK = 512  # elements at a time: their coefficients fit in a processor's cache
# most halvings; an element not proven valid then has a least det J within about 1e-3 of 0, or below
_DEPTH = 6


def determinant_bounds(
    points: Float[np.ndarray, "n d"], cells: Int[np.ndarray, "e k"], depth: int = _DEPTH
) -> tuple[Float[np.ndarray, " e"], Float[np.ndarray, " e"]]:
    """Lower and upper bound of the least det J in each element, divided by the mean of its absolute value.

    An element is valid if both bounds are positive, and inverted or folded somewhere if the upper one is not. Elements
    are halved only where the bounds have different signs.

    Parameters
    ----------
    points : (n, d) nodes, in the plane (d = 2) or in space [m]
    cells : (e, 9), (e, 8), (e, 20), (e, 27) or (e, 10) quad9, hex8, hex20, hex27 or tet10 in VTK order
    depth : most halvings

    Returns
    -------
    (e,) and (e,) [-]: 1 and 1 for a parallelepiped
    """
    chunks = np.array_split(cells, max(1, len(cells) // _CHUNK))
    lower, upper = zip(*(_chunk_bounds(points[chunk], depth) for chunk in chunks), strict=True)
    return np.concatenate(lower), np.concatenate(upper)


def valid_everywhere(points: Float[np.ndarray, "n d"], cells: Int[np.ndarray, "e k"]) -> Bool[np.ndarray, " e"]:
    """Whether each element is proven to have det J > 0 everywhere: by a cheap test if it suffices, else by the bounds.

    Shapes are those of :func:`determinant_bounds`.
    """
    sure = np.zeros(len(cells), dtype=bool)
    if cells.shape[1] >= len(HEX20):  # for the others the bounds are as cheap
        chunks = np.array_split(cells, max(1, len(cells) // _CHUNK))
        sure = np.concatenate([_nearly_affine(points[chunk]) for chunk in chunks])
    unsure = np.flatnonzero(~sure)
    if len(unsure):
        sure[unsure] = determinant_bounds(points, cells[unsure])[0] > 0
    return sure


def _nearly_affine(corners: Float[np.ndarray, "e k d"]) -> Bool[np.ndarray, " e"]:
    """Whether J of each element differs so little from its mean Jm that det J > 0: det Jm > 0 and |Jm⁻¹ J − 1| < 1.

    Each column of J is a polynomial and lies within the convex hull of its Bernstein coefficients.
    """
    matrices = _column_coefficients(corners.shape[1])
    columns = [np.tensordot(corners, matrix, axes=(1, 1)) for matrix in matrices]
    mean = np.stack([column.mean(axis=2) for column in columns], axis=2)
    upright = np.linalg.det(mean) > 0
    inverse = np.linalg.inv(np.where(upright[:, None, None], mean, np.eye(mean.shape[1])))
    square = np.zeros(len(corners))
    for j, column in enumerate(columns):
        offset = inverse @ column
        offset[:, j] -= 1
        square += (offset**2).sum(axis=1).max(axis=1)
    return np.asarray(upright & (square < 0.999))


def _chunk_bounds(
    corners: Float[np.ndarray, "e k d"], depth: int
) -> tuple[Float[np.ndarray, " e"], Float[np.ndarray, " e"]]:
    """The bounds of :func:`determinant_bounds` for one chunk of elements."""
    e, k, d = corners.shape
    gradients, transform, halves = _tables(k)
    J = np.swapaxes(np.tensordot(corners, gradients, axes=(1, 1)), 1, 2)
    determinants = _determinant(J)
    scale = abs(determinants).mean(axis=1)
    pieces = determinants @ transform.T / np.where(scale > 0, scale, 1.0)[:, None]
    owner, lower, upper = np.arange(e), np.full(e, np.inf), np.full(e, np.inf)
    for left in range(depth, -1, -1):
        least, least_value = pieces.min(axis=1), pieces[:, _ends(k)].min(axis=1)
        np.minimum.at(upper, owner, least_value)
        open_ = (least <= 0) & (upper[owner] > 0) & (left > 0)
        np.minimum.at(lower, owner[~open_], least[~open_])
        owner, pieces = np.repeat(owner[open_], 2**d), (pieces[open_] @ halves).reshape(-1, pieces.shape[1])
        if not len(owner):
            break
    return lower, upper


def _determinant(J: Float[np.ndarray, "e q d d"]) -> Float[np.ndarray, "e q"]:
    """det J, written out: faster than one factorisation for each matrix."""
    if J.shape[-1] == 2:
        return np.asarray(J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0])
    a, b, c = (J[..., 0], J[..., 1], J[..., 2])
    return np.asarray(
        a[..., 0] * (b[..., 1] * c[..., 2] - b[..., 2] * c[..., 1])
        + a[..., 1] * (b[..., 2] * c[..., 0] - b[..., 0] * c[..., 2])
        + a[..., 2] * (b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0])
    )


def _degree(k: int) -> int:
    """Degree of det J in each coordinate for an element with k nodes."""
    return {len(HEX8): 2, len(QUAD9): 3}.get(k, 5)


@cache
def _tables(k: int) -> tuple[Float[np.ndarray, "q k d"], Float[np.ndarray, "c q"], Float[np.ndarray, "c m"]]:
    """Gradients where det J is sampled; the matrix from values to coefficients; that to those of the halves."""
    if k == len(TET10):
        return _tetrahedron_tables()
    nodes, p = NODES[k], _degree(k)
    d, ends = nodes.shape[1], -np.cos(np.pi * np.arange(p + 1) / p)
    places, transform = _sampled(p, ends, d)
    left, right = (np.linalg.inv(_bernstein(p, ends)) @ _bernstein(p, (ends + s) / 2) for s in (-1, 1))
    pieces = [reduce(np.kron, [left if (i >> j) & 1 else right for j in range(d)]) for i in range(2**d)]
    return shape_gradients(nodes, places), transform, np.concatenate(pieces).T


def _grid(line: np.ndarray, d: int) -> np.ndarray:
    """All points (q, d) whose coordinates are among some values (p,)."""
    return np.stack(np.meshgrid(*[line] * d, indexing="ij"), axis=-1).reshape(-1, d)


def _sampled(p: int, line: Float[np.ndarray, " p"], d: int) -> tuple[Float[np.ndarray, "q d"], Float[np.ndarray, "c q"]]:
    """Points at which a polynomial of degree p in each coordinate is sampled; the matrix from values to coefficients."""
    return _grid(line, d), reduce(np.kron, [np.linalg.inv(_bernstein(p, line))] * d)


@cache
def _ends(k: int) -> Int[np.ndarray, " v"]:
    """Indices of the coefficients that are values of the polynomial: those at the corners."""
    if k == len(TET10):
        return np.flatnonzero((_LATTICE == _CUBIC).any(axis=1))
    p, d = _degree(k), NODES[k].shape[1]
    grid = _grid(np.arange(p + 1), d)
    return np.flatnonzero(((grid == 0) | (grid == p)).all(axis=1))


_CUBIC = 3  # degree of det J of a tet10
_LATTICE = np.array(
    [(_CUBIC - i - j - k, i, j, k) for i, j, k in np.ndindex(4, 4, 4) if i + j + k <= _CUBIC]
)  # exponents of its Bernstein polynomials


@cache
def _tetrahedron_tables() -> tuple[Float[np.ndarray, "q k d"], Float[np.ndarray, "c q"], Float[np.ndarray, "c m"]]:
    """`_tables` of a tet10, which is divided into eight tetrahedra between its corners and the middles of its edges."""
    samples = _LATTICE / _CUBIC
    inverse = np.linalg.inv(_simplex_bernstein(samples))
    corners = np.concatenate([np.eye(4), np.eye(4)[EDGES].mean(axis=1)])
    eighths = [(0, 4, 6, 7), (1, 5, 4, 8), (2, 6, 5, 9), (3, 7, 9, 8)]
    eighths += [(4, 9, a, b) for a, b in ((5, 6), (6, 7), (7, 8), (8, 5))]  # about the edge between 4 and 9
    pieces = [inverse @ _simplex_bernstein(samples @ corners[list(eighth)]) for eighth in eighths]
    return shape_gradients(TET10, samples[:, 1:]), inverse, np.concatenate(pieces).T


def _simplex_bernstein(b: Float[np.ndarray, "q 4"]) -> Float[np.ndarray, "q c"]:
    """Values of a tetrahedron's Bernstein polynomials of degree 3 at barycentric coordinates."""
    often = [factorial(_CUBIC) // prod(map(factorial, exponents)) for exponents in _LATTICE.tolist()]
    return np.asarray(often * np.prod(b[:, None] ** _LATTICE, axis=2))


@cache
def _column_coefficients(k: int) -> list[Float[np.ndarray, "c k"]]:
    """Matrices from the nodes to the Bernstein coefficients, of degree 2 in each coordinate, of each column of J."""
    nodes, p = NODES[k], 2
    places, transform = _sampled(p, np.linspace(-1, 1, p + 1), nodes.shape[1])
    return [transform @ gradient for gradient in np.moveaxis(shape_gradients(nodes, places), 2, 0)]


def _bernstein(p: int, x: Float[np.ndarray, " q"]) -> Float[np.ndarray, "q b"]:
    """Values of the Bernstein polynomials of degree p on [-1, 1]."""
    t = (x[:, None] + 1) / 2
    i = np.arange(p + 1)
    return np.asarray(np.array([comb(p, j) for j in i]) * t**i * (1 - t) ** (p - i))
