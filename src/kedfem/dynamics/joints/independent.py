"""Independent conditions of joints that share interface points, and the port forces that follow from these."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from kedfem.arrays import Bool, Float, Int
from kedfem.dynamics.joints.attachments import Attachment, used_columns

DEPENDENT = 1e-9  # relative: ports of one coupling surface repeat each other to rounding, others differ by far more
ROUNDING = 1e-13  # entries of relations of order one that couple nothing
Block = tuple[Int[np.ndarray, " r"], Int[np.ndarray, " c"], Float[np.ndarray, "r c"]]
"""Rows and columns of a matrix, and what it has there."""


def independent(
    every: Sequence[Attachment], selected: Sequence[sp.csr_array], own: Sequence[int] = ()
) -> tuple[list[Attachment], sp.csr_array]:
    """Joints on one coupling surface repeat rows of W: w_d = Σ l w_r. Each is constrained once; others relate z.

    With all rows W = L W_r of the independent ones W_r, (B − L B_r) z = 0. An orthonormal basis Z of these z makes
    B_r Z the new B. L is scalar, so it commutes with the link's rotation.

    Parameters
    ----------
    selected : (q, k) held components of each, in world axes, from all interface unknowns
    own : unknowns z of ports on which rows of joints bear, side by side

    Returns
    -------
    attachments on the new unknowns, and Z (k, r)
    """
    relations = [_relation(each) for each in every]
    every_B = sp.vstack(selected, format="csr")
    h, k = every_B.shape
    shares, loose, from_rows = sp.eye_array(h, format="csr"), sp.csr_array((h, 0)), sp.csr_array((h, 0))
    Z = sp.eye_array(k, format="csr")
    if not all(kept.all() for kept, _ in relations):
        L = sp.block_diag([L for _, L in relations], format="csr")
        left = every_B - L @ every_B[np.concatenate([kept for kept, _ in relations])]
        Z = _null_space(left, list(blocks(left)))
        shares, from_rows, loose = _port_forces(L, every_B, own)
    found, first = [], 0
    for each, own_B, (kept, _) in zip(every, selected, relations, strict=True):
        here = slice(first, first := first + len(each.keep))
        columns, B = used_columns(own_B[kept] @ Z)
        found.append(
            replace(
                each, keep=each.keep[kept], columns=columns, B=B, unknowns=Z.shape[1], shares=_placed(each, shares[here]),
                from_rows=_placed(each, from_rows[here]), loose=_placed(each, loose[here]),
            )
        )  # fmt: skip
    return found, Z


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


def _port_forces(L: sp.csr_array, B: sp.csr_array, own: Sequence[int]) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
    """Forces μ at all ports from the λ at the independent ones, Lᵀ μ = λ, every joint in balance, Bᵀ μ = p.

    p is zero but for forces of constraint equations on their own unknowns.

    Returns
    -------
    (h, q) μ from λ, (h, o) μ from p of the rows' own unknowns, and (h, r) the μ that neither equation sees
    """
    G = sp.vstack([L.T, B.T], format="csr")
    of_G = list(blocks(G))
    parts = []
    for rows, columns, dense in of_G:
        part = np.linalg.pinv(dense, rcond=DEPENDENT)
        parts.append((columns, rows, np.where(np.abs(part) < DEPENDENT, 0.0, part)))  # rounding
    inverse = _assembled(parts, G.T.shape)
    q = L.shape[1]
    return inverse[:, :q], inverse[:, q + np.asarray(own, int)], _null_space(G, of_G)


def _null_space(A: sp.csr_array, parts_of: Sequence[Block]) -> sp.csr_array:
    """Orthonormal basis of A x = 0, A of order one: each of its vectors within one block, so that few bodies share it."""
    alone, parts, count = np.ones(A.shape[1], bool), [], 0
    for _, columns, dense in parts_of:
        _, s, Vt = np.linalg.svd(dense)
        part = Vt[int((s > DEPENDENT).sum()) :].T
        parts.append((columns, count + np.arange(part.shape[1]), part))
        count, alone[columns] = count + part.shape[1], False
    rest = np.flatnonzero(alone)
    shape = A.shape[1], count + len(rest)
    units = sp.csr_array((np.ones(len(rest)), (rest, count + np.arange(len(rest)))), shape)
    every = _assembled(parts, shape) + units
    first = abs(every).argmax(axis=0)
    return every[:, np.argsort(first, kind="stable")]


def _assembled(parts: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], shape: tuple[int, int]) -> sp.csr_array:
    """Dense parts at their rows and columns."""
    if not parts:
        return sp.csr_array(shape)
    rows, columns, values = (
        np.concatenate([x.ravel() for x in each])
        for each in zip(*((*np.broadcast_arrays(i[:, None], j), x) for i, j, x in parts), strict=True)
    )
    out = sp.csr_array((values, (rows.astype(int), columns.astype(int))), shape)
    out.eliminate_zeros()
    return out


def blocks(A: sp.csr_array) -> Iterator[Block]:
    """Each part of a matrix that shares neither rows nor columns with the others; columns of zeros are left out."""
    m, entries = A.shape[0], A.tocoo()
    large = np.abs(entries.data) > ROUNDING
    rows, columns, values = entries.row[large], entries.col[large], entries.data[large]
    count = m + A.shape[1]
    graph = sp.coo_array((np.ones(len(rows)), (rows, m + columns)), (count, count))
    part = connected_components(graph, directed=False)[1][rows]
    order = np.argsort(part, kind="stable")
    for here in np.split(order, np.flatnonzero(np.diff(part[order])) + 1) if len(order) else ():
        own_rows, i = np.unique(rows[here], return_inverse=True)
        own_columns, j = np.unique(columns[here], return_inverse=True)
        dense = np.zeros((len(own_rows), len(own_columns)))
        dense[i, j] = values[here]
        yield own_rows, own_columns, dense


def _placed(each: Attachment, rows: sp.csr_array) -> sp.csr_array:
    """Rows of held components among those of all components of all ports."""
    entries = rows.tocoo()
    shape = each.components * len(each.weights), rows.shape[1]
    return sp.csr_array((entries.data, (each.keep[entries.row], entries.col)), shape)
