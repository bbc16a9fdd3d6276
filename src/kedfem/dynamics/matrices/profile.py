"""Order and profile of the matrix of interface unknowns and constraints: each row is stored from its first entry on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from kedfem.arrays import Bool, Int

Group = Int[np.ndarray, " c"]


@dataclass(frozen=True, slots=True)
class Profile:
    """Rows of k interface unknowns and r constraints in one matrix, kept one after the other.

    number : (k,) new number of each unknown, so that those of a group stand near each other
    columns : per constraint the new numbers that it couples, in rising order
    unknown, constraint : (k,), (r,) row of each unknown by its new number, and of each constraint
    first, at : (n,), (n + 1,) first column of each row, and where the row begins; it ends with its diagonal
    multiplier : (n,) whether a row is that of a constraint
    """

    number: Int[np.ndarray, " k"]
    columns: list[Group]
    unknown: Int[np.ndarray, " k"]
    constraint: Int[np.ndarray, " r"]
    first: Int[np.ndarray, " n"]
    at: Int[np.ndarray, " m"]
    multiplier: Bool[np.ndarray, " n"]


def profile_of(bodies: Sequence[Group], constraints: Sequence[Group], k: int) -> Profile:
    """The profile of k unknowns that bodies and constraints couple in groups.

    A constraint follows the last unknown that it couples, so that its pivot is not zero, and fills few rows.
    """
    number = near_diagonal([*bodies, *constraints], k)
    columns = [np.sort(number[group]) for group in constraints]
    last = [int(c[-1]) if len(c) else -1 for c in columns]
    order = np.argsort(np.concatenate([np.arange(k), np.array(last, int)]), kind="stable")
    n = len(order)
    row = np.empty(n, int)
    row[order] = np.arange(n)
    unknown, constraint = row[:k], row[k:]
    first = np.arange(n)
    for group in [*(number[each] for each in bodies), *columns]:
        if len(group):
            first[unknown[group]] = np.minimum(first[unknown[group]], unknown[group].min())
    for own, group in zip(constraint, columns, strict=True):
        first[own] = unknown[group[0]] if len(group) else own
    at = np.concatenate([[0], np.cumsum(np.arange(n) - first + 1)])
    return Profile(number, columns, unknown, constraint, first, at, order >= k)


def near_diagonal(groups: Sequence[Group], k: int) -> Int[np.ndarray, " k"]:
    """New number of each of k unknowns, so that those of a group stand near each other."""
    touched = sp.lil_array((max(len(groups), 1), max(k, 1)))
    for row, group in enumerate(groups):
        touched[row, group] = 1.0
    order = reverse_cuthill_mckee(sp.csr_array(touched.T @ touched), symmetric_mode=True)[:k] if k else np.zeros(0, int)
    number = np.empty(k, int)
    number[order] = np.arange(k)
    return number
