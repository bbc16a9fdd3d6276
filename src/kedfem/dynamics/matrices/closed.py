"""The linkage with its joints closed: all links together, through the common system of their interface unknowns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.ports import Rotation
from kedfem.dynamics.matrices.bordered import Asked
from kedfem.dynamics.matrices.interface import MANY, solver
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.stepping.state import NodalOf


@dataclass(frozen=True, slots=True)
class Closed:
    """A linkage with its joints closed where its links have some orientations, for any loads.

    held : interface unknowns that each link has a share in; RB : Rᵀ B of these
    interface : z and the rows' forces from what links exert on z; None without interface unknowns
    """

    parts: Sequence[Substructure]
    held: Sequence[Int[np.ndarray, " c"]]
    RB: Sequence[Float[np.ndarray, "p c"]]
    unknowns: int
    interface: Callable[[Float[np.ndarray, " k"]], tuple[Float[np.ndarray, " k"], Float[np.ndarray, " r"]]] | None

    def coupled(self, rhs: Sequence[NodalOf]) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
        """g (n, d) of all links and λ (q,) on them at their ports, link frames, from right-hand sides (n, d) there."""
        return self.answer([part.solve(r) for part, r in zip(self.parts, rhs, strict=True)])

    def answer(self, y: Sequence[NodalOf]) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
        """The same from y = Ã⁻¹ r."""
        v = [part.seen(x) for part, x in zip(self.parts, y, strict=True)]
        each = list(zip(self.parts, self.RB, self.held, v, strict=True))
        z = np.zeros(self.unknowns)
        if self.interface is not None:
            # Σ Bᵀ (R S Rᵀ) B z = Σ Bᵀ R S v
            for part, b, c, x in each:
                z[c] += b.T @ (part.S @ x)
            z, _ = self.interface(z)
        forces = [part.S @ (b @ z[c] - x) for part, b, c, x in each]
        g = [x + (part.Y @ force).reshape(x.shape) for part, x, force in zip(self.parts, y, forces, strict=True)]
        return g, [force[: len(part.attachment.keep)] for part, force in zip(self.parts, forces, strict=True)]


def coupled_all(parts: Sequence[Substructure], cases: Sequence[tuple[Closed, Sequence[NodalOf]]]) -> list[list[NodalOf]]:
    """g of several linkages with closed joints and their rhs, as of `coupled`: each link's solves go together."""
    if not cases:
        return []
    answers = [part.solve_many(np.stack([rhs[k].ravel() for _, rhs in cases], axis=1)) for k, part in enumerate(parts)]
    return [
        case.answer([X[:, k].reshape(r.shape) for X, r in zip(answers, rhs, strict=True)])[0]
        for k, (case, rhs) in enumerate(cases)
    ]


def closed(parts: Sequence[Substructure], R: Sequence[Rotation], tie: Asked | None) -> Closed:
    """A linkage with its joints closed: A g = r + Wᵀ λ, R W g = B z, and joint forces in balance, Σ Bᵀ R λ = 0.

    The mechanism of [KED, eq. (19)]: joints make shared points move together.

    Parameters
    ----------
    R : per link, link to world
    tie : what joints enforced by constraint equations ask of z; then Σ Bᵀ R λ is what these exert
    """
    held = [part.attachment.columns for part in parts]
    RB = [turned_interface(part, each[None])[0] for part, each in zip(parts, R, strict=True)]
    k = parts[0].attachment.unknowns
    H = [b.T @ part.S @ b for part, b in zip(parts, RB, strict=True)]
    return Closed(parts, held, RB, k, solver(_common(held, H, k), tie) if k else None)


def _common(
    held: Sequence[Int[np.ndarray, " c"]], own: Sequence[Float[np.ndarray, "c c"]], k: int
) -> Float[np.ndarray, "k k"] | sp.csr_array:
    """The links' matrices on the interface unknowns that each has a share in, added up; sparse where there are many."""
    if k > MANY:
        columns = [np.broadcast_to(c, (len(c), len(c))) for c in held]
        at = [np.concatenate([x.ravel() for x in each]) for each in ([c.T for c in columns], columns)]
        return sp.csr_array(sp.coo_array((np.concatenate([x.ravel() for x in own]), at), (k, k)))
    H = np.zeros((k, k))
    for c, x in zip(held, own, strict=True):
        H[np.ix_(c, c)] += x
    return H


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
