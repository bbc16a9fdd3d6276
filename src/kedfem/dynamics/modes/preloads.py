"""Stiffness by the change in direction of forces of springs and motors: −Q ∂²q/∂z² for a coordinate q.

Second derivatives are exact: if z moves along x at a constant rate and nothing else moves, q'' = xᵀ (∂²q/∂z²) x.
"""

from itertools import combinations

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.system.record import Constraint
from kedfem.dynamics.system.starts.coordinate_rates import coordinate, moved_by
from kedfem.dynamics.system.starts.instant import Instant

ROUNDING = 1e-12  # of the largest eigenvalue of a law's second derivatives


def with_preloads(now: Instant, asked: ConstraintTerms) -> ConstraintTerms:
    """Springs along the directions in which each law's force changes, beside what is asked of a small motion."""
    none = np.zeros((3, now.of.system.unknowns))
    forces = now.forces(now.coordinates(none))[:, 0]
    rows, stiffness = [asked.C], [np.zeros(0)]
    for n, each in enumerate(now.of.system.constraints):
        if forces[n] and not each.linear:
            columns, second = _second_derivatives(now, each)
            values, vectors = np.linalg.eigh(-forces[n] * second)
            some = np.abs(values) > ROUNDING * np.abs(values).max(initial=0.0)
            row = np.zeros((int(some.sum()), none.shape[1]))
            row[:, columns] = vectors[:, some].T
            rows.append(sp.csr_array(row))
            stiffness.append(values[some])
    more = 1 / np.concatenate(stiffness)
    target, compliance = np.append(asked.target, 0 * more), np.append(asked.compliance, more)
    return ConstraintTerms(sp.vstack(rows, format="csr"), target, compliance, asked.known)


def _second_derivatives(now: Instant, each: Constraint) -> tuple[list[int], Float[np.ndarray, "m m"]]:
    """Interface unknowns that a coordinate depends on, and its second derivatives by these at z = 0."""
    system, still = now.of.system, now.at.at_rest()
    columns = sorted(moved_by(system, each.terms))

    def along(*moving: int) -> float:
        z = np.zeros((3, system.unknowns))
        z[1, [columns[a] for a in moving]] = 1.0
        return float(coordinate(system, each, still, z)[2])

    out = np.diag([along(a) for a in range(len(columns))])
    for a, b in combinations(range(len(columns)), 2):
        out[a, b] = out[b, a] = (along(a, b) - out[a, a] - out[b, b]) / 2
    return columns, out
