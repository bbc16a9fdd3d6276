"""The linkage with its joints closed: all links together, through the common system of their interface unknowns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.ports import Rotation, port_rotation
from kedfem.dynamics.matrices.interface import MANY, Tie, solver
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
    interface: (
        Callable[[Float[np.ndarray, " k"]], tuple[Float[np.ndarray, " k"], Float[np.ndarray, " r"]]] | None
    )

    def coupled(self, rhs: Sequence[NodalOf]) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
        """g and forces for one more rhs; see the function."""
        return self.answer([part.solve(r) for part, r in zip(self.parts, rhs, strict=True)])

    def answer(self, y: Sequence[NodalOf]) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
        """As `coupled`, from y = Ã⁻¹ r."""
        v = [part.seen(x) for part, x in zip(self.parts, y, strict=True)]
        each = list(zip(self.parts, self.RB, self.held, v, strict=True))
        z = np.zeros(self.unknowns)
        if self.interface is not None:
            # Σ Bᵀ (R S Rᵀ) B z = Σ Bᵀ R S v
            for part, b, c, x in each:
                z[c] += b.T @ (part.S @ x)
            z, _ = self.interface(z)
        forces = [part.S @ (b @ z[c] - x) for part, b, c, x in each]
        g = [
            x + (part.Y @ force).reshape(x.shape)
            for part, x, force in zip(self.parts, y, forces, strict=True)
        ]
        return g, [force[: len(part.attachment.keep)] for part, force in zip(self.parts, forces, strict=True)]


def coupled(
    parts: Sequence[Substructure], R: Sequence[Rotation], rhs: Sequence[NodalOf], tie: Tie | None = None
) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
    """Solve all links together: A g = r + Wᵀ λ, joints closed: R W g = B z, joint forces in balance: Σ Bᵀ R λ = 0.

    The mechanism of [KED, eq. (19)]: joints make shared points move together.

    Parameters
    ----------
    parts, R, rhs : per link; R link to world, rhs (n, d) in the link frame
    tie : what joints enforced by constraint equations ask of z; then Σ Bᵀ R λ is what these exert

    Returns
    -------
    g : per link (n, d), link frame
    forces : per link (q,) λ on the link at its ports, link frame
    """
    return closed(parts, R, tie).coupled(rhs)


def coupled_all(
    parts: Sequence[Substructure], cases: Sequence[tuple[Closed, Sequence[NodalOf]]]
) -> list[list[NodalOf]]:
    """g of several linkages with closed joints and their rhs, as of `coupled`: each link's solves go together."""
    if not cases:
        return []
    answers = [
        part.solve_many(np.stack([rhs[k].ravel() for _, rhs in cases], axis=1))
        for k, part in enumerate(parts)
    ]
    return [
        case.answer([X[:, k].reshape(r.shape) for X, r in zip(answers, rhs, strict=True)])[0]
        for k, (case, rhs) in enumerate(cases)
    ]


def closed(parts: Sequence[Substructure], R: Sequence[Rotation], tie: Tie | None) -> Closed:
    """A linkage with its joints closed; `coupled` has what is asked for."""
    held = [part.attachment.columns for part in parts]
    RB = [_interface(part, R_) for part, R_ in zip(parts, R, strict=True)]
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


def _interface(part: Substructure, R: Rotation) -> Float[np.ndarray, "p c"]:
    """[Rᵀ B; 0]: port components in the link frame from the interface unknowns that the link has a share in."""
    B = part.attachment.B
    out = np.zeros((len(part.S), B.shape[1]))
    out[: len(B)] = port_rotation(part.attachment, R).T @ B
    return out
