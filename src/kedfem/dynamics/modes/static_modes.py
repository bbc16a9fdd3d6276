"""Modes in which a link takes every static deflection that its joints, its frame and its loads give it.

In its frame a link that is at rest, or accelerates as a rigid body, balances K0 g = Σ φ ⊗ a: a vector a each for the
weights φ of its ports and of its frame, for m {1, x, y, z} and for the components of its loads. The solutions of all
balanced sums are few. They do not change, so that a balance on their components is that of the whole link.
The inertia of a deflection that rotates with its link, M ([α]× + [ω]×²) g, is none of these; what it adds is less by ω²
over the square of the link's first frequency, and so is what it adds in turn.
"""

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.matrices.substructure import anchored
from kedfem.dynamics.modes.reduction import energy_product, orthonormal
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import mass_orthonormal, rigid_body_functions, rigid_modes

BALANCED = 1e-9  # of unit forces: resultants of fewer directions are rounding
REPEATED = 1e-11  # of the largest: modes below repeat others
NEGLIGIBLE = 1e-9  # of the energy norm of a deflection: what its inertia may bend the link by outside its modes


def static_modes(link: Link, joint: Attachment, loads: Sequence[Float[np.ndarray, "n d"]]) -> Float[np.ndarray, "n s"]:
    """1, the position, and all components of static deflections.

    Parameters
    ----------
    loads : nodal forces whose components act in any direction

    Raises
    ------
    SolveError
        If K0 is not that of an elastic body.
    """
    g = StaticResponses(link).deflections(_forces(link, joint, loads))
    rigid = mass_orthonormal(link, rigid_body_functions(link))
    S = g.reshape(link.n, -1)
    S = S - rigid @ (rigid.T @ np.asarray(link.mass[0] @ S))
    weight = np.sqrt(energy_product(link).diagonal())[:, None]
    U, size, _ = np.linalg.svd(weight * S, full_matrices=False)
    return np.concatenate([rigid, U[:, size > REPEATED * size.max(initial=0.0)] / weight], axis=1)


def _forces(link: Link, joint: Attachment, loads: Sequence[Float[np.ndarray, "n d"]]) -> Float[np.ndarray, "k c"]:
    """All forces, each of unit size."""
    d, unit = link.d, np.eye(link.d)
    shapes = [np.asarray(link.mass[0] @ link.one), *np.asarray(link.mass[0] @ link.X[:, :d]).T]
    shapes += [each for load in loads for each in load.T]
    out = [port_columns(joint, link.n), *(np.outer(each, e).reshape(-1, 1) for each in shapes for e in unit)]
    if link.fit is not None:  # f is corrected by a × fit
        turns = ((0, 1), (1, 2), (2, 0))[: 1 if d == 2 else 3]
        couples = np.zeros((len(turns), link.n, d))
        for couple, (i, j) in zip(couples, turns, strict=True):
            couple[:, i], couple[:, j] = -link.fit[:, j], link.fit[:, i]
        out.append(couples.reshape(len(turns), -1).T)
    every = np.concatenate(out, axis=1)
    size = np.linalg.norm(every, axis=0)
    return np.asarray(every[:, size > 0] / size[size > 0])


class StaticResponses:
    """Static deflections of a free link under forces in balance; K0 is factored once, held at the link's anchors."""

    def __init__(self, link: Link) -> None:
        self.link, (self.factor, self.anchors, self.kappa) = link, anchored(link, 0.0, 1.0)
        self.rigid = rigid_modes(link)
        self.momentum = _columns_times_mass(link, self.rigid)
        E = np.zeros((link.unknowns, len(self.anchors)))
        E[self.anchors, np.arange(len(self.anchors))] = 1.0
        self.Y = self.factor.solve_many(E)

    def deflections(self, forces: Float[np.ndarray, "k c"]) -> Float[np.ndarray, "k b"]:
        """Of all sums of forces in balance, of unit strain energy, about the link's mean rigid motion."""
        resultants = np.linalg.qr(self.rigid)[0].T @ forces
        g = self.under(forces @ scipy.linalg.null_space(resultants, rcond=BALANCED))
        G = g.T @ np.asarray(self.link.K0 @ g)
        return np.asarray(g / np.sqrt(np.diag(G)))

    def under(self, balanced: Float[np.ndarray, "k b"]) -> Float[np.ndarray, "k b"]:
        """The deflections under forces in balance, about the link's mean rigid motion."""
        g = self.factor.solve_many(balanced)
        # what the anchors take is given back: forces in balance need none of it
        at = self.anchors
        g = g + self.Y @ np.linalg.lstsq(np.diag(1 / self.kappa) - self.Y[at], g[at], rcond=BALANCED)[0]
        return np.asarray(g - self.rigid @ self._rigidly(self.momentum.T @ g))

    def of_inertia(self, x: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "n b"]:
        """Components of the deflections under inertia m x ⊗ e that these functions have in all directions e."""
        n, d = self.link.n, self.link.d
        forces = np.einsum("nc,ie->nice", np.asarray(self.link.mass[0] @ x), np.eye(d)).reshape(n * d, -1)
        return self.under(forces - self.momentum @ self._rigidly(self.rigid.T @ forces)).reshape(n, -1)

    def _rigidly(self, resultants: Float[np.ndarray, "r c"]) -> Float[np.ndarray, "r c"]:
        """The rigid motion that has momenta, or the acceleration by forces, with given resultants."""
        return np.asarray(np.linalg.solve(self.rigid.T @ self.momentum, resultants))


def with_inertia(
    held: StaticResponses, Q: Float[np.ndarray, "n s"], x: Sequence[Float[np.ndarray, "n d"]], spin: float
) -> Float[np.ndarray, "n _"] | None:
    """Modes with those under the inertia of deflections x that rotate with the link; None if they have it already.

    Parameters
    ----------
    Q : mass-orthonormal modes, rigid motion among them
    spin : of the order of ω² and α [1/s²]
    """
    link, H = held.link, energy_product(held.link)
    rigid = mass_orthonormal(link, rigid_body_functions(link))
    shapes = [each - rigid @ (rigid.T @ np.asarray(link.mass[0] @ each)) for each in x]
    sizes = [float(np.sqrt(np.vdot(each, H @ each))) for each in shapes]
    S = held.of_inertia(np.concatenate([y / size for y, size in zip(shapes, sizes, strict=True) if size > 0], axis=1))
    for _ in range(2):
        S = S - rigid @ (rigid.T @ np.asarray(link.mass[0] @ S))
        own = orthonormal(Q - rigid @ (rigid.T @ np.asarray(link.mass[0] @ Q)), H, REPEATED)[0]
        S = S - own @ (own.T @ np.asarray(H @ S))
    more, weights = orthonormal(spin * S, H, REPEATED)
    more = more[:, weights > NEGLIGIBLE]
    return np.concatenate([Q, more], axis=1) if more.shape[1] else None


def _columns_times_mass(link: Link, columns: Float[np.ndarray, "k r"]) -> Float[np.ndarray, "k r"]:
    return np.stack([mass_times(link.mass, x.reshape(link.n, link.d)).ravel() for x in columns.T], axis=1)
