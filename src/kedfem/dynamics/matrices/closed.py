"""The linkage with its joints closed: all links together, through the common system of their interface unknowns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.constraint_matrices import JointRows
from kedfem.dynamics.matrices.interface import MANY, solver, static_tie
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.errors import SolveError

Loads = Sequence[Float[np.ndarray, "T n_ d_"]]


@dataclass(frozen=True, slots=True)
class Closed:
    """A linkage with its joints closed where its links have some orientations at T times, for any loads.

    RB : per link Rᵀ B of the interface unknowns that it has a share in
    interface : z from what links exert on it
    """

    parts: Sequence[Substructure]
    RB: Sequence[Float[np.ndarray, "T _ _"]]
    interface: Callable[[Float[np.ndarray, "T k"]], Float[np.ndarray, "T k"]]

    def forces(self, loads: Loads) -> list[Float[np.ndarray, "T _"]]:
        """[λ; μ] on all links at their ports and anchors, link frames, from loads there."""
        v = [x.reshape(len(x), -1) @ part.Y for x, part in zip(loads, self.parts, strict=True)]
        each = [(part, b, part.attachment.columns, x) for part, b, x in zip(self.parts, self.RB, v, strict=True)]
        z = np.zeros((len(v[0]), self.parts[0].attachment.unknowns))
        for part, b, c, x in each:  # Σ Bᵀ (R S Rᵀ) B z = Σ Bᵀ R S v
            z[:, c] += np.einsum("tck,tc->tk", part.S @ b, x)
        z = self.interface(z)
        return [((b @ z[:, c, None])[..., 0] - x) @ part.S for part, b, c, x in each]

    def deflections(self, loads: Loads) -> Loads:
        """g of all links; all times go together."""
        every = zip(self.parts, loads, self.forces(loads), strict=True)
        return [
            (part.solve_many(x.reshape(len(x), -1).T) + part.Y @ force.T).T.reshape(x.shape) for part, x, force in every
        ]


def closed(
    parts: Sequence[Substructure], R: Sequence[Float[np.ndarray, "T _ _"]], rows: JointRows | None = None
) -> Closed:
    """A linkage with its joints closed: A g = r + Wᵀ λ, R W g = B z, and joint forces in balance, Σ Bᵀ R λ = 0.

    The mechanism of [KED, eq. (19)]: joints make shared points move together.

    Parameters
    ----------
    R : per link, link to world
    rows : constraint equations, springs of bushings among them, on z; then Σ Bᵀ R λ is what these exert

    Raises
    ------
    SolveError
        If something is free to move.
    """
    RB = [turned_interface(part, each) for part, each in zip(parts, R, strict=True)]
    held, k = [part.attachment.columns for part in parts], parts[0].attachment.unknowns
    own = [b.transpose(0, 2, 1) @ (part.S @ b) for part, b in zip(parts, RB, strict=True)]
    if not k:
        return Closed(parts, RB, lambda f: f)
    if rows is None and k <= MANY:
        H = np.zeros((len(RB[0]), k, k))
        for c, x in zip(held, own, strict=True):
            H[:, c[:, None], c] += x
        try:
            np.linalg.cholesky(H)
        except np.linalg.LinAlgError as error:
            raise SolveError(f"joints: the joints' common system must be definite, got {error}") from error
        return Closed(parts, RB, lambda f: np.linalg.solve(H, f[..., None])[..., 0])
    solvers = [
        solver(_common(held, [x[t] for x in own], k), None if rows is None else static_tie(rows, t))
        for t in range(len(RB[0]))
    ]
    return Closed(parts, RB, lambda f: np.stack([solved(x)[0] for solved, x in zip(solvers, f, strict=True)]))


def _common(
    held: Sequence[Int[np.ndarray, " c"]], own: Sequence[Float[np.ndarray, "c c"]], k: int
) -> Float[np.ndarray, "k k"] | sp.csr_array:
    """The links' matrices on the interface unknowns that each has a share in, added up; sparse where there are many."""
    if k <= MANY:
        H = np.zeros((k, k))
        for c, x in zip(held, own, strict=True):
            H[np.ix_(c, c)] += x
        return H
    at = [np.concatenate([x.ravel() for x in each]) for each in zip(*(np.meshgrid(c, c) for c in held), strict=True)]
    return sp.csr_array(sp.coo_array((np.concatenate([x.T.ravel() for x in own]), at), (k, k)))


def turned_interface(part: Substructure, R: Float[np.ndarray, "T d d"]) -> Float[np.ndarray, "T c k"]:
    """[Rᵀ B; 0] over time: port components in the link frame from the interface unknowns that the link has a share in."""
    joint = part.attachment
    (p, d), k = (len(joint.weights), joint.components), joint.B.shape[1]
    B = np.zeros((p * d, k))
    B[joint.keep] = joint.B
    turned = np.einsum("tba,pbk->tpak", R, B.reshape(p, d, k)).reshape(len(R), p * d, k)
    out = np.zeros((len(R), len(part.S), k))
    out[:, : len(joint.keep)] = turned[:, joint.keep]
    return out
