"""Stress stiffness of small links as the compiled loop takes it: dense, as few terms over a block as it takes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from kedfem.dynamics.history import Forcing
from kedfem.dynamics.stiffening import Stiffening, StressModes
from kedfem.links.record import Link

ROUNDING = 1e-15  # of the largest eigenvalue


@dataclass(frozen=True, slots=True)
class StressTerms:
    """Stress stiffness of all links in mass-orthonormal coordinates.

    qr : per link k_i = Σ_j r_ji q_j, q_j orthonormal as vectors of entries: q (n², m) and r (m, m)
    P : (L, D, D) `turned_directions`, padded
    """

    stiffening: Stiffening
    links: Sequence[Link]
    qr: Sequence[tuple[Float[np.ndarray, "z m"], Float[np.ndarray, "m m"]]]
    P: Float[np.ndarray, "L D D"]

    def over_block(self, forcing: Sequence[Forcing]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Factors (T, L, m) and matrices (L, m, S, S) of k over a block, and P."""
        few = [
            fewer_terms(each.stress @ r.T)
            for each, (_, r) in zip(self.stiffening.stressed(forcing), self.qr, strict=True)
            if each.stress is not None
        ]
        n, L, most = max(link.n for link in self.links), len(self.links), max(s.shape[1] for s, _ in few)
        s, k = np.zeros((len(few[0][0]), L, most)), np.zeros((L, most, n, n))
        for i, (link, (factors, V), (q, _)) in enumerate(zip(self.links, few, self.qr, strict=True)):
            s[:, i, : factors.shape[1]] = factors
            k[i, : factors.shape[1], : link.n, : link.n] = (q @ V).T.reshape(-1, link.n, link.n)
        return s, k, self.P


def stress_terms(
    links: Sequence[Link], T: Sequence[tuple[Float[np.ndarray, "_ _"], ...]], stiffening: Stiffening
) -> StressTerms:
    """Of links whose components have the mass-orthonormal coordinates T; stresses turn translations alone."""
    D = max(link.d for link in links)
    P, qr = np.zeros((len(links), D, D)), []
    for i, (link, t, modes) in enumerate(zip(links, T, stiffening.modes, strict=True)):
        P[i, : link.d, : link.d] = modes.P
        k = t[0].T @ _dense(modes) @ t[0]
        qr.append(np.linalg.qr(k.reshape(len(k), -1).T))
    return StressTerms(stiffening, links, qr, P)


def fewer_terms(
    a: Float[np.ndarray, "T m"],
) -> tuple[Float[np.ndarray, "T r"], Float[np.ndarray, "m r"]]:
    """Factors s and V with a = s Vᵀ, but for rounding of aᵀ a: what a few turns of a linkage need is little."""
    values, vectors = np.linalg.eigh(a.T @ a)
    V = vectors[:, values > ROUNDING * values[-1]]
    return a @ V, V


def _dense(modes: StressModes) -> Float[np.ndarray, "m n n"]:
    """The stress stiffness of all modes."""
    found = [modes.stiffness(s) for s in np.eye(len(modes.states))]
    return np.array([k.toarray() if sp.issparse(k) else k for k in found])
