"""Linear equations of all bodies with joints and constraints at one instant, condensed to the interface.

Starts solve them with any matrix A of each body:

    A_i x_i = r_i + W_iᵀ λ_i,   W_i (x_i + moved_i) = Rᵀ B z,   Σ Bᵀ R λ = Cᵀ m + known,   C z + m / κ = target

A need not be symmetric: the inertia of a deflection that rotates with its link is not. With Z the null space of W and
W M = 1,

    G = Z (Zᵀ A Z)⁻¹ Zᵀ,   Y = (1 − G A) M,   Ȳ = (1 − Gᵀ Aᵀ) M,   S = Ȳᵀ A Y,   x = G r + Y w,   λ = S w − Ȳᵀ r
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_rotation
from kedfem.dynamics.matrices.bordered import Bordered, ConstraintTerms
from kedfem.dynamics.matrices.substructure import Substructure, mass_substructure
from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.sparse import SparsePart, sparse_part
from kedfem.errors import SolveError
from kedfem.links.record import Link

Flat = Float[np.ndarray, " _"]


@dataclass(frozen=True, slots=True)
class HeldBody:
    """A body seen from its interface points, in its frame: G, Y, Ȳ, S as above, W (q, N); a sparse one's G acts."""

    G: Any
    Y: Float[np.ndarray, "N q"]
    left: Float[np.ndarray, "N q"]
    S: Float[np.ndarray, "q q"]
    W: Float[np.ndarray, "q N"]


def held_body(A: Float[np.ndarray, "N N"], W: Float[np.ndarray, "q N"]) -> HeldBody:
    """A body with any matrix A, held at its interface points by a basis of the null space of W.

    Raises
    ------
    SolveError
        If A is singular where these are held.
    """
    q = len(W)
    V, L = scipy.linalg.qr(W.T) if q else (np.eye(len(A)), np.zeros((len(A), 0)))
    Z = V[:, q:]
    try:
        G = Z @ np.linalg.solve(Z.T @ A @ Z, Z.T)
    except np.linalg.LinAlgError as error:
        raise SolveError(f"a body held at its interface points must have a definite matrix, got {error}") from error
    M = V[:, :q] @ np.linalg.inv(L[:q]).T
    Y, left = M - G @ (A @ M), M - G.T @ (A.T @ M)
    return HeldBody(G, Y, left, left.T @ A @ Y, W)


def sparse_body(link: Link, joint: Attachment, of: Substructure) -> HeldBody:
    """A sparse body with the symmetric matrix that was factored."""
    return stepped_body(sparse_part(link, joint, of), 1.0)


def stepped_body(part: SparsePart, share: float) -> HeldBody:
    """A sparse body with the matrix that it is factored for, divided by a share."""

    def applied(r: Flat) -> Flat:
        return share * np.asarray(part.held(r.reshape(part.components, -1).T)[0].T).ravel()

    G = LinearOperator((len(part.Y),) * 2, applied, dtype=float)
    return HeldBody(G, part.Y, part.Y, part.S / share, part.W)


def mass_body(of: Ready, k: int) -> HeldBody:
    """Body k with its mass for a matrix, which is one in the coordinates of dense bodies."""
    part, link, joint = of.parts[k], of.system.model.links[k], of.system.model.joints[k]
    if isinstance(part, SparsePart):
        return sparse_body(link, joint, mass_substructure(link, joint))
    return held_body(np.eye(part.W.shape[1]), part.W)


@dataclass(frozen=True, slots=True)
class Solved:
    """x (N,) of all bodies, z (k,), multipliers m (r,), forces (q,) on bodies at interface points; world components.

    f : (N,) internal force that stands against x, if any
    """

    x: Flat
    z: Flat
    m: Flat
    forces: Flat
    f: Flat | None = None


class LinearEquations:
    """A system of bodies and constraints at one instant, factored.

    Parameters
    ----------
    held : of all bodies
    R : (bodies, 3, 3) frames of their matrices, link to world
    asked : constraints that repeat others get no force
    """

    def __init__(
        self, of: Ready, held: Sequence[HeldBody], R: Float[np.ndarray, "_ 3 3"], asked: ConstraintTerms
    ) -> None:
        self.of, self.held, self.R, self.asked = of, held, R, asked
        joints = of.system.model.joints
        self.columns = [joint.columns for joint in joints]
        self.RT = [port_rotation(joint, each[: joint.components, : joint.components]).T
                   for joint, each in zip(joints, R, strict=True)]  # fmt: skip
        self.RB = [RT @ joint.B for RT, joint in zip(self.RT, joints, strict=True)]
        k = self.of.system.unknowns
        blocks = [RB.T @ each.S @ RB for each, RB in zip(self.held, self.RB, strict=True)]
        places = [(np.repeat(c, len(c)), np.tile(c, len(c))) for c in self.columns]
        index = tuple(np.concatenate(each) for each in zip(*places, strict=True))
        H = sp.coo_array((np.concatenate([b.ravel() for b in blocks]), index), (k, k))
        self.bordered = Bordered(H, asked.C, asked.compliance)

    def solved(self, r: Flat, moved: Flat | None = None, more: Flat | float = 0.0, alone: bool = False) -> Solved:
        """All bodies under given right-hand sides.

        Parameters
        ----------
        r : (N,) world components
        moved : (N,) what closes the joints together with x
        more : (k,) forces on the interface beside those that are known
        alone : whether these right-hand sides act alone, without what is asked: what they change
        """
        at, ports = self.of.bodies.at, self.of.bodies.port_at
        local, offset = [], []
        f = more + (0.0 * self.asked.known if alone else self.asked.known)
        for i, (each, RB) in enumerate(zip(self.held, self.RB, strict=True)):
            here = slice(int(at[i]), int(at[i + 1]))
            local.append(self.rotated(i, r[here], back=True))
            offset.append(np.zeros(len(each.W)) if moved is None else each.W @ self.rotated(i, moved[here], back=True))
            f[self.columns[i]] += RB.T @ (each.left.T @ local[i] + each.S @ offset[i])
        z, m = self.bordered.solved(f, (0.0 if alone else 1.0) * self.asked.target)
        x, forces = np.zeros(len(r)), np.zeros(int(ports[-1]))
        for i, (each, RB) in enumerate(zip(self.held, self.RB, strict=True)):
            w = RB @ z[self.columns[i]] - offset[i]
            x[at[i] : at[i + 1]] = self.rotated(i, each.G @ local[i] + each.Y @ w)
            forces[ports[i] : ports[i + 1]] = self.RT[i].T @ (each.S @ w - each.left.T @ local[i])
        return Solved(x, z, m, forces)

    def rotated(self, i: int, x: Flat, back: bool = False) -> Flat:
        """R x, or Rᵀ x, of a body's coordinates."""
        d = int(self.of.bodies.components[i])
        R = self.R[i, :d, :d]
        return np.asarray((R.T if back else R) @ x.reshape(d, -1)).ravel()
