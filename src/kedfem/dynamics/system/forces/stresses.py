"""Geometric stiffening of bodies of a system: k(t) = Σ s_j(t) k_j, with as few terms in a block as possible."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.history import Forcing
from kedfem.dynamics.stiffening import Stiffening, StressModes
from kedfem.dynamics.system.arrays import Stresses, ends_of, flat
from kedfem.dynamics.system.sparse import Part, SparsePart
from kedfem.motion.rigid import RigidMotion

ROUNDING = 1e-14  # of the largest singular value

Terms = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""factors, terms_at, entries_at and entries, see `Driving`"""
NO_TERMS: Terms = np.zeros((0, 0)), np.zeros(1, int), np.zeros(1, int), np.zeros(0)


@dataclass(frozen=True, slots=True)
class Stressed:
    """Stress stiffness of all bodies on their coordinates.

    entries : per body (m, z) of its stress modes, dense (n, n) or of the link's sparsity pattern; size : (m,) their norms
    """

    stiffening: Stiffening
    entries: Sequence[Float[np.ndarray, "m z"]]
    size: Sequence[Float[np.ndarray, " m"]]

    def over(self, forcing: Sequence[Forcing], motion: RigidMotion) -> Terms:
        """Terms over the times of a motion."""
        every = []
        for s, entries, size in zip(self.stiffening.over(forcing, motion), self.entries, self.size, strict=True):
            every.append(fewer_terms(s * size, entries / size[:, None]))
        sizes = [k.shape[1] for _, k in every for _ in range(len(k))]
        factors = np.ascontiguousarray(np.concatenate([s for s, _ in every], axis=1))
        return factors, ends_of([len(k) for _, k in every]), ends_of(sizes), flat([k for _, k in every])


def stressed(stiffening: Stiffening, parts: Sequence[Part]) -> Stressed:
    """Stress modes on the coordinates of bodies; stresses turn translations alone, which have the same coordinates."""
    entries = [
        modes.k if isinstance(part, SparsePart) else _dense(modes, part.T[0])
        for modes, part in zip(stiffening.modes, parts, strict=True)
    ]
    return Stressed(stiffening, entries, [np.maximum(np.linalg.norm(k, axis=1), 1e-300) for k in entries])


def stress_tables(stiffening: Stiffening | None, parts: Sequence[Part]) -> Stresses:
    """Where entries of the stress stiffness stand."""
    none = np.zeros(0, int)
    if stiffening is None:
        start = np.zeros(1, int)
        return Stresses(start, np.zeros((0, 3, 3)), start, none, start, none)
    P, sizes, rows, columns = np.zeros((len(parts), 3, 3)), [], [none], [none]
    for k, (modes, part) in enumerate(zip(stiffening.modes, parts, strict=True)):
        d, n = len(modes.P), modes.states.shape[1]
        P[k, :d, :d] = modes.P
        is_sparse = isinstance(part, SparsePart)
        sizes.append(modes.k.shape[1] if is_sparse else n * n)
        rows.append(none if not is_sparse or modes.indptr is None else modes.indptr.astype(int))
        columns.append(none if not is_sparse or modes.indices is None else modes.indices.astype(int))
    return Stresses(ends_of(sizes), P, ends_of([len(x) for x in rows[1:]]), np.concatenate(rows),
                    ends_of([len(x) for x in columns[1:]]), np.concatenate(columns))  # fmt: skip


def fewer_terms(
    s: Float[np.ndarray, "T m"], k: Float[np.ndarray, "m z"]
) -> tuple[Float[np.ndarray, "T r"], Float[np.ndarray, "r z"]]:
    """Factors and terms with the same Σ s_j k_j at all times but for rounding: a few revolutions need few."""
    left, size, right = np.linalg.svd(s, full_matrices=False)
    kept = size > ROUNDING * size.max(initial=0.0)
    return left[:, kept] * size[kept], right[kept] @ k


def _dense(modes: StressModes, T: Float[np.ndarray, "n n"]) -> Float[np.ndarray, "m z"]:
    """Tᵀ k T of all modes."""
    n = len(T)
    found = [modes.stiffness(s) for s in np.eye(len(modes.states))]
    every = [T.T @ (k.toarray() if sp.issparse(k) else k) @ T for k in found]
    return np.array(every).reshape(len(every), n * n)
