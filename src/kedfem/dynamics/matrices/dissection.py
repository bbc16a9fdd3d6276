"""Nested dissection of a solid link's nodes by their coordinates: an order in which a thick body's factor has less fill.

George (1973): a separator halves the body and is eliminated last, and each half is ordered in the same way. The cut is
the median of a coordinate; the separator is the smallest set of nodes that meets all edges across the cut (König 1931).
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import maximum_bipartite_matching

from kedfem.arrays import Bool, Float, Int

WHOLE = 24  # nodes that are not divided: fewer gain nothing, more take the fill of a dense block
FEW = 1500  # nodes up to which the longest coordinate is taken, else the one with the smallest separator
THICK = 0.3  # of n^⅔, the first separator of bodies that are divided: thinner ones have as little fill by minimum degree


def dissected(A: sp.csr_array, X: Float[np.ndarray, "n c"]) -> Int[np.ndarray, " N"] | None:
    """An order of the unknowns of A, (N, N), by nested dissection; None of a thin body, which does not need it.

    Parameters
    ----------
    A : of nodal rows: the d unknowns of a node follow each other
    X : where the nodes are [m]
    """
    n, d = len(X), A.shape[0] // len(X)
    joined = _joined(A, n, d)
    last_first: list[Int[np.ndarray, " k"]] = []
    left = [np.arange(n)]
    while left:
        nodes = left.pop()
        if len(nodes) <= WHOLE:
            last_first.append(nodes)
            continue
        one, separator, other = _halves(joined[nodes][:, nodes], X[nodes])
        if len(nodes) == n and separator.sum() < THICK * n ** (2 / 3):
            return None
        last_first.append(nodes[separator])
        left += [nodes[half] for half in (one, other) if half.any()]
    order = np.concatenate(last_first)[::-1]
    return np.asarray((d * order[:, None] + np.arange(d)).ravel())


def _joined(A: sp.csr_array, n: int, d: int) -> sp.csr_array:
    """Which nodes have a number of A in common, (n, n)."""
    entries = sp.coo_array(A)
    rows, columns = (index // d for index in entries.coords)
    return sp.csr_array((np.ones(entries.nnz, np.int8), (rows, columns)), shape=(n, n)).astype(bool)


def _halves(joined: sp.csr_array, X: Float[np.ndarray, "n c"]) -> tuple[Bool[np.ndarray, " n"], ...]:
    """One half, separator and other half of nodes, along one of the coordinates."""
    found = []
    axes = np.argsort(-np.ptp(X, axis=0))[: None if len(X) > FEW else 1]
    for x in X.T[axes]:
        low = np.zeros(len(X), bool)
        low[np.argsort(x, kind="stable")[: len(X) // 2]] = True
        separator = np.zeros(len(X), bool)
        separator[low], separator[~low] = _cover(sp.csr_array(joined[low][:, ~low]))
        found.append((low & ~separator, separator, ~low & ~separator))
    return min(found, key=lambda each: each[1].sum())


def _cover(across: sp.csr_array) -> tuple[Bool[np.ndarray, " r"], Bool[np.ndarray, " c"]]:
    """Fewest rows and columns that have all numbers of a matrix among them: by König from a largest matching."""
    column_of = maximum_bipartite_matching(across, perm_type="column")
    row_of = np.full(across.shape[1], -1)
    row_of[column_of[column_of >= 0]] = np.flatnonzero(column_of >= 0)
    # reached from unmatched rows by steps along any number to a column, and back along the matching
    rows, columns = column_of < 0, np.zeros(across.shape[1], bool)
    new = rows
    while new.any():
        seen = np.zeros(across.shape[1], bool)
        seen[across[new].indices] = True
        back = row_of[seen & ~columns]
        columns |= seen
        new = np.zeros(len(rows), bool)
        new[back[back >= 0]] = True
        new &= ~rows
        rows |= new
    return ~rows, columns
