"""A segment seen from its ports, what it does while they are held; and all segments solved together."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.dense import SMALL, dense_part
from kedfem.dynamics.ports import port_columns
from kedfem.dynamics.state import Nodal, NodalOf
from kedfem.dynamics.substructure import Substructure, factored
from kedfem.links.record import Link


@dataclass(frozen=True, slots=True)
class HeldPart:
    """A segment with A = c_M M + c_K K0 seen from its ports: g = G r + Y w, λ = S w − Yᵀ r, w = W g; link frame.

    held : r (n, d) → G r (n, d) and Yᵀ r (q,): what r does while ports are held, and what they take
    Y : (dn, q); S : (q, q)
    """

    held: Callable[[Nodal], tuple[Nodal, Float[np.ndarray, " q"]]]
    Y: Float[np.ndarray, "k q"]
    S: Float[np.ndarray, "q q"]


def held_part(link: Link, joint: Attachment, c_M: float, c_K: float) -> HeldPart:
    """Dense and exact to rounding where the segment is small, whose stiff hubs lose digits otherwise."""
    if link.unknowns <= SMALL:
        return _small_part(link, joint, c_M, c_K)
    return held_substructure(factored(link, joint, c_M, c_K))


def held_substructure(part: Substructure) -> HeldPart:
    """A link condensed onto ports and anchors, seen from its ports."""
    q = len(part.attachment.keep)
    Y, rows = part.Y @ part.S[:, :q], np.ascontiguousarray(part.Y.T)

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        y = part.solve(r)
        at_ports = part.S @ part.seen(y)
        return y - (at_ports @ rows).reshape(y.shape), at_ports[:q]

    return HeldPart(held, Y, part.S[:q, :q])


def _small_part(link: Link, joint: Attachment, c_M: float, c_K: float) -> HeldPart:
    part = dense_part(link, joint, c_M, c_K)
    T, n, d = scipy.linalg.block_diag(*part.T), link.n, link.d
    nodal = np.arange(n * d).reshape(d, n).T.ravel()  # component first to row by row
    G, Y = (T @ part.G @ T.T)[np.ix_(nodal, nodal)], (T @ part.Y)[nodal]

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        return (G @ r.ravel()).reshape(r.shape), Y.T @ r.ravel()

    return HeldPart(held, Y, part.S)


def interface_factor(parts: Sequence[HeldPart], RB: Sequence[NodalOf]) -> tuple[np.ndarray, bool] | None:
    """Factor of H = Σ Bᵀ R S Rᵀ B, None without interface unknowns; a segment has a share in few rows of it."""
    H = np.zeros((RB[0].shape[1], RB[0].shape[1]))
    if not len(H):
        return None
    for part, b in zip(parts, RB, strict=True):
        own = np.flatnonzero(b.any(axis=0))
        known = b[:, own]
        H[np.ix_(own, own)] += known.T @ part.S @ known
    factor, lower = scipy.linalg.cho_factor(H, check_finite=False)
    return np.asarray(factor), bool(lower)


def solved(
    parts: Sequence[HeldPart],
    rhs: Sequence[NodalOf],
    RB: Sequence[NodalOf],
    factor: tuple[np.ndarray, bool] | None,
) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
    """Changes of all segments in their frames, and port forces: A Δ = r + Wᵀ λ, Σ Bᵀ R λ = 0, R W Δ = B z.

    Parameters
    ----------
    rhs : r per segment (n, d)
    RB : Rᵀ B
    factor : of `interface_factor`
    """
    held, reactions = zip(*(part.held(r) for part, r in zip(parts, rhs, strict=True)), strict=True)
    z = np.zeros(RB[0].shape[1])
    if factor is not None:
        f = np.sum([b.T @ x for b, x in zip(RB, reactions, strict=True)], axis=0)
        z = scipy.linalg.cho_solve(factor, f, check_finite=False)
    w = [b @ z for b in RB]
    forces = [part.S @ x - y for part, x, y in zip(parts, w, reactions, strict=True)]
    return [x + (part.Y @ y).reshape(x.shape) for part, x, y in zip(parts, held, w, strict=True)], forces


@dataclass(frozen=True, slots=True)
class Closure:
    """How joints are closed that rounding has opened: of port values w = W u as little is changed as can be, w = B z.

    B, inverse : all segments' B below each other, and its pseudo-inverse
    weights : per segment W (q, N) on its coordinates, flat, and its pseudo-inverse (N, q)
    """

    B: Float[np.ndarray, "Q k"]
    inverse: Float[np.ndarray, "k Q"]
    weights: tuple[tuple[Float[np.ndarray, "q N"], Float[np.ndarray, "N q"]], ...]


def closure(joints: Sequence[Attachment], W: Sequence[Float[np.ndarray, "_ _"]]) -> Closure:
    """Made ready for the steps of a model.

    Parameters
    ----------
    W : per segment its held port components from its coordinates, world axes as well as its own: weights are scalar
    """
    B = np.concatenate([joint.B for joint in joints])
    return Closure(B, np.linalg.pinv(B), tuple((w, np.linalg.pinv(w)) for w in W))


def on_nodes(link: Link, joint: Attachment) -> Float[np.ndarray, "q k"]:
    """W of a link from the rows of the nodes that its ports have, flat."""
    columns = port_columns(joint, link.n).reshape(link.n, link.d, -1)[joint.nodes]
    return np.asarray(columns.reshape(-1, columns.shape[2]).T)


def closed(of: Closure, x: Sequence[Float[np.ndarray, " _"]]) -> list[Float[np.ndarray, " _"]]:
    """Displacements (or their rates) of all segments, flat, with the joints closed.

    Sweeps close them up to rounding only, which would grow with the square of the number of steps.
    """
    w = np.concatenate([W @ y for (W, _), y in zip(of.weights, x, strict=True)])
    gap = of.B @ (of.inverse @ w) - w
    ends = np.cumsum([len(W) for W, _ in of.weights])[:-1]
    return [y + back @ g for (_, back), y, g in zip(of.weights, x, np.split(gap, ends), strict=True)]
