"""Nodes in the middle of edges and sides on a curved surface: quadratic elements follow it best from there."""

import numpy as np
from jaxtyping import Bool, Float, Int

from kedfem.mesh.cut.unfolding import Settle
from kedfem.mesh.hexahedra import HEX8, HEX27
from kedfem.mesh.quality import scaled_jacobian

_ON = (HEX27[8:26, None] * HEX27[None, :20] >= 0).all(axis=2) & (
    (HEX27[8:26, None] == HEX27[None, :20]) | (HEX27[8:26, None] == 0)
).all(axis=2)
#: Corners of each of the 12 edges (nodes 8 to 19); corners and middles of edges of each of the 6 sides (20 to 25).
ENDS: Int[np.ndarray, "12 2"] = np.array([np.flatnonzero(row[: len(HEX8)]) for row in _ON[:12]])
RIMS: Int[np.ndarray, "6 8"] = np.array([np.flatnonzero(row) for row in _ON[12:]])
_BLEND = np.array(
    [-0.25] * 4 + [0.5] * 4
)  # the middle of a side from its corners and the middles of its edges


def centred(
    points: Float[np.ndarray, "n 3"], cells: Int[np.ndarray, "e 27"], settle: Settle, wanted: float
) -> Float[np.ndarray, "n 3"]:
    """Nodes on the boundary put where they are in the middle, unless that makes an element bad.

    A middle that has slid along an arc costs an order of accuracy of its form: cubic, not quartic in the turn.

    Parameters
    ----------
    points : (n, 3) [m]
        Nodes, those of the boundary on the surface.
    cells : (e, 27)
        hex27 in VTK order.
    settle : function
        Puts nodes on the surface, see `unfolding.Settle`.
    wanted : float [-]
        Elements of less than this scaled Jacobian must not become worse, the others not less than this.

    Returns
    -------
    (n, 3) [m]
        A new array.
    """
    allowed = scaled_jacobian(points, cells)
    allowed = np.minimum(allowed, wanted)
    _, freedom = settle(np.arange(len(points)), points)
    chosen = (freedom != np.eye(3)).any(axis=(1, 2))
    for _ in range(4):
        moved = _middles(points, cells, chosen, settle)
        worse = scaled_jacobian(moved, cells) < allowed
        if not worse.any():
            return moved
        chosen[cells[worse]] = False
    return points.copy()


def _middles(
    points: Float[np.ndarray, "n 3"],
    cells: Int[np.ndarray, "e 27"],
    chosen: Bool[np.ndarray, " n"],
    settle: Settle,
) -> Float[np.ndarray, "n 3"]:
    """The chosen nodes in the middle: first those of edges, then those of sides."""
    moved = points.copy()
    for first, parts, weights in ((8, ENDS, np.array([0.5, 0.5])), (20, RIMS, _BLEND)):
        middles = cells[:, first : first + len(parts)].ravel()
        nodes, where = np.unique(middles, return_index=True)
        around = cells[:, parts].reshape(len(middles), -1)[where[chosen[nodes]]]
        nodes = nodes[chosen[nodes]]
        moved[nodes], _ = settle(nodes, np.einsum("k,mkj->mj", weights, moved[around]))
    return moved
