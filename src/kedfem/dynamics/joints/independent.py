"""Joints that share port points: which of their conditions are independent, and the port forces that follow."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Bool, Float, Int
from scipy.sparse.csgraph import connected_components

from kedfem.dynamics.joints.attachments import Attachment

DEPENDENT = (
    1e-9  # relative: ports of one coupling surface repeat each other to rounding, others differ by far more
)
ROUNDING = 1e-13  # entries of relations of order one that couple nothing
Block = tuple[Int[np.ndarray, " _"], Int[np.ndarray, " _"]]
"""Rows and columns of a matrix."""


def independent(
    every: Sequence[Attachment], own: Sequence[int] = (), riding: Sequence[int] = ()
) -> tuple[list[Attachment], Float[np.ndarray, "k r"]]:
    """Joints on one coupling surface repeat rows of W: w_d = Σ l w_r. Each is held once, and the rest said of z instead.

    With all rows W = L W_r of the independent ones W_r, (B − L B_r) z = 0. An orthonormal basis Z of these z makes
    B_r Z the new B. L is scalar, so it commutes with the link's rotation.

    Parameters
    ----------
    own : unknowns z of ports on which rows of joints bear, side by side
    riding : those of rigid sliders on which rows bear

    Returns
    -------
    attachments on the new unknowns, and Z
    """
    relations = [_relation(each) for each in every]
    B = np.vstack([each.B for each in every])
    shares, loose, from_rows = np.eye(len(B)), np.zeros((len(B), 0)), np.zeros((len(B), 0))
    Z = np.eye(B.shape[1])
    if not all(kept.all() for kept, _ in relations):
        L = scipy.linalg.block_diag(*(L for _, L in relations))
        kept = np.concatenate([kept for kept, _ in relations])
        left = B - L @ B[kept]
        Z = _null_space(left, list(_blocks(left)))
        shares, from_rows, loose = _port_forces(L, B, own, riding)
    ends = np.cumsum([len(each.keep) for each in every])[:-1]
    columns = np.cumsum([kept.sum() for kept, _ in relations])[:-1]
    return [
        replace(
            each, keep=each.keep[kept], B=each.B[kept] @ Z, loose=_placed(each, theirs),
            shares=tuple(_placed(each, x) for x in np.split(share, columns, axis=1)), from_rows=_placed(each, rows),
        )
        for each, (kept, _), share, theirs, rows in zip(
            every, relations, np.split(shares, ends), np.split(loose, ends), np.split(from_rows, ends), strict=True
        )
    ], Z  # fmt: skip


def _relation(each: Attachment) -> tuple[Bool[np.ndarray, " h"], Float[np.ndarray, "h q"]]:
    """Which held components are independent, and L: all from those."""
    port, component = np.divmod(each.keep, each.components)
    kept, L = np.zeros(len(port), bool), np.zeros((len(port), len(port)))
    for c in range(each.components):
        at = np.flatnonzero(component == c)
        if len(at):
            # u, v(, w) are held by the same ports, so the choice is the same for them
            chosen, coefficients = _independent_rows(each.weights[port[at]])
            kept[at[chosen]] = True
            L[np.ix_(at, at[chosen])] = coefficients
    return kept, L[:, kept]


def _independent_rows(W: Float[np.ndarray, "p b"]) -> tuple[Int[np.ndarray, " r"], Float[np.ndarray, "p r"]]:
    """Independent rows of W and the coefficients of all rows in them, by rank-revealing QR."""
    R, order = scipy.linalg.qr(W.T, mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    r = int((size > DEPENDENT * size[0]).sum())
    coefficients = np.zeros((len(W), r))
    coefficients[order[:r]] = np.eye(r)
    coefficients[order[r:]] = scipy.linalg.solve_triangular(R[:r, :r], R[:r, r:]).T
    in_order = np.argsort(order[:r])
    return order[:r][in_order], coefficients[:, in_order]


def _port_forces(
    L: Float[np.ndarray, "h q"], B: Float[np.ndarray, "h k"], own: Sequence[int], riding: Sequence[int]
) -> tuple[Float[np.ndarray, "h q"], Float[np.ndarray, "h o"], Float[np.ndarray, "h r"]]:
    """Forces μ at all ports from the λ at the independent ones, Lᵀ μ = λ, every joint in balance, Bᵀ μ = p.

    p is zero but for what rows exert on their own unknowns.

    Returns
    -------
    (h, q) μ from λ, (h, o) μ from p of the rows' own unknowns, and (h, r) the μ that neither equation sees
    """
    determined = np.setdiff1d(np.arange(B.shape[1]), riding)  # what holds a slider is left open
    G = np.vstack([L.T, B.T[determined]])
    inverse, blocks = np.zeros(G.T.shape), list(_blocks(G))
    for rows, columns in blocks:
        inverse[np.ix_(columns, rows)] = np.linalg.pinv(G[np.ix_(rows, columns)], rcond=DEPENDENT)
    inverse[np.abs(inverse) < DEPENDENT] = 0.0  # rounding
    q = L.shape[1]
    return (
        inverse[:, :q],
        inverse[:, q + np.searchsorted(determined, np.asarray(own, int))],
        _null_space(G, blocks),
    )


def _null_space(A: Float[np.ndarray, "m n"], blocks: Sequence[Block]) -> Float[np.ndarray, "n r"]:
    """Orthonormal basis of A x = 0, A of order one: each of its vectors within one block, so that few bodies share it."""
    alone, parts = np.ones(A.shape[1], bool), list[np.ndarray]()
    for rows, own in blocks:
        _, s, Vt = np.linalg.svd(A[np.ix_(rows, own)])
        part = np.zeros((A.shape[1], len(own) - int((s > DEPENDENT).sum())))
        part[own] = Vt[len(own) - part.shape[1] :].T
        parts.append(part)
        alone[own] = False
    every = np.concatenate([np.eye(A.shape[1])[:, alone], *parts], axis=1)
    first = np.abs(every).argmax(axis=0)
    return np.asarray(every[:, np.argsort(first, kind="stable")])


def _blocks(A: Float[np.ndarray, "m n"]) -> Iterator[Block]:
    """Rows and columns of each part of a matrix that shares none with the others; columns of zeros are left out."""
    m, (rows, columns) = len(A), np.nonzero(np.abs(A) > ROUNDING)
    count = m + A.shape[1]
    graph = sp.coo_array((np.ones(len(rows)), (rows, m + columns)), (count, count))
    label = connected_components(graph, directed=False)[1]
    used = np.unique(columns)
    for part in np.unique(label[m + used]):
        yield np.flatnonzero(label[:m] == part), used[label[m + used] == part]


def _placed(each: Attachment, rows: Float[np.ndarray, "h c"]) -> Float[np.ndarray, "m c"]:
    """Rows of held components among those of all components of all ports."""
    out = np.zeros((each.components * len(each.weights), rows.shape[1]))
    out[each.keep] = rows
    return out
