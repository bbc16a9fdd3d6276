"""Sparse constraint equations of large linkages, each between few bodies: least squares and singular values.

The matrix of a small linkage is dense (`newton.Factor`). That of a large one is stored by its entries, for the two to
four bodies of each equation. JᵀJ is factored in blocks of six, in an order of minimum degree, so that the cost grows in
proportion to the number of loops.
"""

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.motion.constraints import Rows
from kedfem.motion.values import Features, coupled_terms, gradients


class Plan(NamedTuple):
    """The plan of the factorisation of JᵀJ and of products with J, as `blocks_kernel` takes it.

    starts : (m + 1,) first entry of each row, and their number
    body : (e,) place of each entry's body in the order of elimination
    pairs : (n, 3) block of JᵀJ and the two entries whose product goes there
    columns, below : (b + 1,), (blocks,) first block of each column of the factor, its diagonal; row of each block
    updates, of_column : (u, 3) block changed by two others of one column, and these; (b + 1,) first of each column
    """

    starts: Int[np.ndarray, " m1"]
    body: Int[np.ndarray, " e"]
    pairs: Int[np.ndarray, "p 3"]
    columns: Int[np.ndarray, " c"]
    below: Int[np.ndarray, " n"]
    updates: Int[np.ndarray, "u 3"]
    of_column: Int[np.ndarray, " c"]


@dataclass(frozen=True, slots=True)
class Blocks:
    """The positions of entries of constraint rows, and the plan of the factorisation of JᵀJ.

    row : (e,) constraint of each entry, rising
    term, side, share : (e,) its elementary row, which of the two bodies of that, and the coefficient
    place : (b,) of each moving body in the order of elimination
    """

    row: Int[np.ndarray, " e"]
    term: Int[np.ndarray, " e"]
    side: Int[np.ndarray, " e"]
    share: Float[np.ndarray, " e"]
    place: Int[np.ndarray, " b"]
    plan: Plan

    @property
    def rows(self) -> int:
        """Number of constraints."""
        return len(self.plan.starts) - 1

    @property
    def count(self) -> int:
        """Number of moving bodies."""
        return len(self.place)

    def values(self, rows: Rows, f: Features, size: float) -> Float[np.ndarray, "T e 6"]:
        """Entries of the scaled rows, as `values.jacobian` has them."""
        found = gradients(rows, f, size)[self.term, self.side]
        return np.ascontiguousarray(found.transpose(2, 0, 1) * self.share[:, None])

    def least_squares(
        self, values: Float[np.ndarray, "T e 6"], rhs: Float[np.ndarray, "T m c"]
    ) -> Float[np.ndarray, "T k c"]:
        """x of the least squares of J x − rhs.

        Raises
        ------
        LinAlgError
            J does not have full column rank.
        """
        x = self._solved(values, rhs)[0]
        return np.moveaxis(x[:, :, self.place].reshape(*x.shape[:2], -1), 1, 2)

    def left(self, values: Float[np.ndarray, "T e 6"], rhs: Float[np.ndarray, "T m c"]) -> Float[np.ndarray, "T m c"]:
        """Residual of the least squares of J x − rhs: the part of rhs in the null space of Jᵀ."""
        return np.swapaxes(self._solved(values, rhs)[1], 1, 2)

    def _solved(self, values: np.ndarray, rhs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        from kedfem.motion.blocks_kernel import least_squares

        T, _, c = rhs.shape
        x, left = np.empty((T, c, self.count, 6)), np.array(np.swapaxes(rhs, 1, 2), order="C")
        if least_squares(values, left, self.plan, x) < T:
            raise np.linalg.LinAlgError("rows leave a motion free")
        return x, left

    def least_norm(self, values: Float[np.ndarray, "T e 6"], rhs: Float[np.ndarray, "T b 6"]) -> Float[np.ndarray, "T m"]:
        """The y of least norm with Jᵀ y = rhs.

        Raises
        ------
        LinAlgError
            J does not have full column rank.
        """
        from kedfem.motion.blocks_kernel import least_norm

        y, right = np.empty((len(rhs), self.rows)), np.empty(rhs.shape)
        right[:, self.place] = rhs
        if least_norm(values, right, self.plan, y) < len(rhs):
            raise np.linalg.LinAlgError("rows leave a motion free")
        return y

    def extremes(self, values: Float[np.ndarray, "T e 6"]) -> Float[np.ndarray, "T 2"]:
        """Greatest and least singular value of J, the latter 0 where J does not have full column rank."""
        from kedfem.motion.blocks_kernel import extremes

        out = np.empty((len(values), 2))
        first = np.random.default_rng(1).standard_normal((self.count, 6))
        first /= np.linalg.norm(first)
        extremes(values, self.plan, first, out)
        return out

    def agree(self, one: Float[np.ndarray, "e 6"], other: Float[np.ndarray, "e 6"]) -> bool:
        """Whether J₁ᵀ J₂ has a positive determinant, so that no singular position lies between both."""
        import scipy.sparse as sp
        from scipy.sparse.linalg import splu

        columns = (6 * self.plan.body[:, None] + np.arange(6)).ravel()
        shape = (self.rows, 6 * self.count)
        J1, J2 = (sp.csr_matrix((x.ravel(), (np.repeat(self.row, 6), columns)), shape) for x in (one, other))
        try:
            factor = splu((J1.T @ J2).tocsc())
        except RuntimeError:  # singular
            return False
        sign = np.sign(factor.U.diagonal()).prod() * _parity(factor.perm_r) * _parity(factor.perm_c)
        return bool(sign > 0)


def blocks(rows: Rows, bodies: int, size: float) -> Blocks:
    """The entries of rows on all bodies but the ground, scaled with a size, and the plan to factor JᵀJ."""
    terms = [(k, k, 1.0) for k in range(rows.count)] + list(coupled_terms(rows, size))
    entries = sorted(
        (row, term, side, c, int(b) - 1)
        for row, term, c in terms
        for side, b in enumerate((rows.i[term], rows.j[term]))
        if b > 0
    )
    of_row: dict[int, list[int]] = {}
    for n, each in enumerate(entries):
        of_row.setdefault(each[0], []).append(n)
    near: list[set[int]] = [set() for _ in range(bodies - 1)]
    for here in of_row.values():
        together = {entries[n][4] for n in here}
        for b in together:
            near[b] |= together - {b}
    order, later = _elimination(near)
    place = np.empty(bodies - 1, int)
    place[order] = np.arange(bodies - 1)
    below: list[int] = []
    columns, number = [0], {}
    for k, b in enumerate(order):
        for at in (k, *sorted(int(place[x]) for x in later[b])):
            number[at, k] = len(below)
            below.append(at)
        columns.append(len(below))
    updates, of_column = [], [0]
    for k in range(len(order)):
        here = below[columns[k] + 1 : columns[k + 1]]
        updates += [(number[i, j], number[i, k], number[j, k]) for n, j in enumerate(here) for i in here[n:]]
        of_column.append(len(updates))
    body = place[[each[4] for each in entries]] if entries else np.zeros(0, int)
    every = (pair for here in of_row.values() for pair in product(here, here))
    pairs = [(number[int(body[a]), int(body[b])], a, b) for a, b in every if body[a] >= body[b]]
    row, term, side, share, _ = (np.array(x) for x in zip(*entries, strict=True))
    plan = Plan(
        np.searchsorted(row, np.arange(rows.count + 1)), body, np.array(pairs, int).reshape(-1, 3), np.array(columns),
        np.array(below), np.array(updates, int).reshape(-1, 3), np.array(of_column),
    )  # fmt: skip
    return Blocks(row, term, side, share.astype(float), place, plan)


def _elimination(near: list[set[int]]) -> tuple[list[int], dict[int, set[int]]]:
    """Bodies in order of minimum degree, and the later bodies in each one's column of the factor."""
    near = [set(each) for each in near]
    left, order, later = set(range(len(near))), [], {}
    while left:
        b = min(left, key=lambda x: (len(near[x]), x))
        left.remove(b)
        order.append(b)
        later[b] = near[b]
        for x in near[b]:
            near[x] |= near[b]
            near[x] -= {b, x}
    return order, later


def _parity(order: Int[np.ndarray, " n"]) -> int:
    """1 of an even permutation, -1 of an odd one: by the number of its cycles."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    n = len(order)
    cycles, _ = connected_components(sp.csr_array((np.ones(n), order, np.arange(n + 1)), shape=(n, n)))
    return -1 if (n - cycles) % 2 else 1
