"""Co-rotational frame of a segment: its mean rotation, the deformation in that frame, and the internal force.

With y the segment's position in the link's rigid-body frame, c the weights of the frame and K0 its stiffness,

    Σ y_a ⊗ c_a = Q U,  Q a rotation, U symmetric          g = Qᵀ y − X          strain energy ½ gᵀ K0 g

The force is the gradient of that energy: with f = K0 g and τ = Σ g_a × f_a, the moment of f about the deformed
segment, a rotation of Q does the work of τ, so F_a = f_a − (G⁻¹ τ) × c_a with G = tr(U) 1 − U; F has neither resultant
nor moment.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.stepping.state import Nodal
from kedfem.links.beams.metric import pulled_back, strains_of
from kedfem.links.record import Frame, Link
from kedfem.motion.newton import rotation as exponential
from kedfem.vectors import nearest_rotations

NUDGE = 1e-5  # of a link's size: what it moves by to show the rate of its deformation, rounding and error 1e-10 of it


def frames_of(link: Link) -> tuple[Frame, ...]:
    """The frames of a link: several, one, or none with a rigid-body frame."""
    if link.frames or link.fit is None:
        return link.frames
    return (Frame(link.fit, link.K0),)


@dataclass(frozen=True, slots=True)
class Deformed:
    """One frame at one time: Q (d, d), the angle of a planar link [rad], deformation g and its rate, (n, d) each."""

    Q: Float[np.ndarray, "d d"]
    angle: float
    g: Nodal
    g1: Nodal


def rotation(link: Link, fit: Float[np.ndarray, "n 3"], y: Nodal, angle: float) -> tuple[Float[np.ndarray, "d d"], float]:
    """Q of Σ y_a ⊗ fit_a; of a planar link with its angle, counted on beyond a revolution.

    Parameters
    ----------
    angle : an earlier one
    """
    Q = mean_rotations(link, fit, y[None])[0]
    if not link.planar:
        return Q, 0.0
    turn = np.arctan2(Q[1, 0], Q[0, 0])
    return Q, float(turn + 2 * np.pi * np.round((angle - turn) / (2 * np.pi)))


def mean_rotations(
    link: Link, fit: Float[np.ndarray, "n 3"], y: Float[np.ndarray, "T n d"]
) -> Float[np.ndarray, "T d d"]:
    """Q of `rotation` at T times."""
    A = np.einsum("tna,nb->tab", y, fit[:, : y.shape[2]])
    Q = nearest_rotations(A, link.planar)
    if link.planar:
        return Q
    # once more by Newton: a slender segment shows its twist by small numbers
    U = Q.transpose(0, 2, 1) @ A
    axial = np.stack([U[:, 2, 1] - U[:, 1, 2], U[:, 0, 2] - U[:, 2, 0], U[:, 1, 0] - U[:, 0, 1]], axis=1)
    G = np.trace(U, axis1=1, axis2=2)[:, None, None] * np.eye(3) - (U + U.transpose(0, 2, 1)) / 2
    return np.asarray(Q @ exponential(np.linalg.solve(G, axial[:, :, None])[:, :, 0]))


def deformation(link: Link, y: Nodal, Q: Float[np.ndarray, "d d"], angle: float) -> Nodal:
    """g = Qᵀ y − X less its mean, a rigid motion; for a planar beam ψ less the frame's angle.

    For a beam in space it is a displacement with the same strains, as these need no frame.
    """
    if link.element is not None:
        return np.asarray(link.element.share @ strains_of(link.element, y)).reshape(y.shape)
    g = y @ Q - link.X[:, : link.d]
    if link.kind == "beam":
        g[:, 2] = y[:, 2] - angle * link.one
    k, m1 = 2 if link.planar else 3, link.m1[:, 0]
    g[:, :k] -= np.outer(link.one, m1 @ g[:, :k] / (m1 @ link.one))
    return np.asarray(g)


def seen_from(link: Link, frame: Frame, y: Nodal, y1: Nodal | None = None) -> Deformed:
    """A frame within half a revolution of the rigid-body one, of a planar beam of its ψ, with the rate of deformation.

    Parameters
    ----------
    y, y1 : (n, d) position in the rigid-body frame, of a planar beam (x, y, ψ), and its rate; at rest if not given
    """
    m1 = link.m1[:, 0]
    Q, angle = rotation(link, frame.fit, y, float(m1 @ y[:, 2] / (m1 @ link.one)) if link.kind == "beam" else 0.0)
    g = deformation(link, y, Q, angle)
    g1, size = np.zeros_like(g), 0.0 if y1 is None else float(np.abs(y1).max(initial=0.0))
    if y1 is not None and size:
        part = NUDGE * link.size / size
        ahead, behind = (
            deformation(link, z, *rotation(link, frame.fit, z, angle)) for z in (y + part * y1, y - part * y1)
        )
        g1 = (ahead - behind) / (2 * part)
    return Deformed(Q, angle, g, g1)


def frame_force(link: Link, frame: Frame, now: Deformed, y: Nodal, beta: float) -> tuple[Nodal, float]:
    """Internal force of a frame in the rigid-body frame: (∂g/∂y)ᵀ K0 (g + β g'), and its strain energy."""
    Kg = _times(frame.K0, now.g)
    energy = 0.5 * float(np.vdot(now.g, Kg))
    f = Kg + beta * _times(frame.K0, now.g1) if beta else Kg
    if link.element is not None:
        strains = link.element.rows @ (now.g + beta * now.g1).ravel()
        return pulled_back(link.element, y, link.element.stiffness * strains), energy
    k = 2 if link.planar else 3
    A = y[:, :k].T @ frame.fit[:, :k]
    U = now.Q[:k, :k].T @ A
    c, g = frame.fit[:, :k], now.g[:, :k]
    if link.planar:
        torque = float(g[:, 0] @ f[:, 1] - g[:, 1] @ f[:, 0]) / np.trace(U)
        f = f.copy()
        f[:, 0] += torque * c[:, 1]
        f[:, 1] -= torque * c[:, 0]
    else:
        N = g.T @ f
        axial = np.array([N[1, 2] - N[2, 1], N[2, 0] - N[0, 2], N[0, 1] - N[1, 0]])
        f = f - np.cross(np.linalg.solve(np.trace(U) * np.eye(3) - (U + U.T) / 2, axial), c)
    return np.asarray(f @ now.Q.T), energy


def _times(K: np.ndarray, g: Nodal) -> Nodal:
    return np.asarray((K @ g.ravel()).reshape(g.shape))


def position(link: Link, u: Float[np.ndarray, "... n d"]) -> Float[np.ndarray, "... n d"]:
    """Position of a segment displaced by u, both in the rigid-body frame; of a planar beam (x, y, ψ)."""
    X = link.X[:, : link.d]
    return np.asarray((X * [1, 1, 0] if link.kind == "beam" else X) + u)


def mean_orientation(link: Link, u: Nodal, R: Float[np.ndarray, "d d"]) -> Float[np.ndarray, "d d"]:
    """Mean orientation of a segment displaced by u, link to world; R where it keeps the rigid-body frame."""
    if link.fit is None:
        return R
    return np.asarray(R @ mean_rotations(link, link.fit, position(link, u @ R)[None])[0])
