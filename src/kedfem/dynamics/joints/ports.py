"""Ports of one link: displacements W u and forces Wᵀ λ, in the link frame or rotated."""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.stepping.state import Nodal
from kedfem.links.record import Link
from kedfem.links.reduced import rigid_modes

Rotation = Float[np.ndarray, "d d"]

RIGIDLY = 1e-9  # of the largest motion of ports


def port_columns(attachment: Attachment, n: int) -> Float[np.ndarray, "k q"]:
    """Wᵀ for all held components of a link with n functions, (dn, q)."""
    p, d = len(attachment.weights), attachment.components
    W = np.zeros((p, d, n, d))
    for k in range(d):
        W[:, k, attachment.nodes, k] = attachment.weights
    return np.asarray(W.reshape(d * p, d * n)[attachment.keep].T)


def port_values(attachment: Attachment, u: Nodal) -> Float[np.ndarray, " q"]:
    """W u, the held components."""
    return np.asarray((attachment.weights @ u[attachment.nodes]).ravel()[attachment.keep])


def port_rotation(attachment: Attachment, R: Rotation) -> Float[np.ndarray, "q q"]:
    """R on all held components."""
    port, component = np.divmod(attachment.keep, attachment.components)
    return np.where(port[:, None] == port, R[component[:, None], component], 0.0)


def port_vectors(attachment: Attachment, force: Float[np.ndarray, "*T q"]) -> Float[np.ndarray, "*T p d"]:
    """Port forces as one row per port, zero where a component is not held."""
    full = np.zeros((*force.shape[:-1], len(attachment.weights) * attachment.components))
    full[..., attachment.keep] = force
    return full.reshape(*force.shape[:-1], -1, attachment.components)


def add_port_forces(out: Nodal, attachment: Attachment, force: Float[np.ndarray, " q"]) -> None:
    """Add Wᵀ λ to nodal forces in place."""
    out[attachment.nodes] += attachment.weights.T @ port_vectors(attachment, force)


def rotated_vectors(
    attachment: Attachment, R: Float[np.ndarray, "T d d"], force: Float[np.ndarray, "T q"]
) -> Float[np.ndarray, "T p d"]:
    """R λ over time, a row per port in world components, zero where a component is not held."""
    return np.asarray(port_vectors(attachment, force) @ R.transpose(0, 2, 1))


def rotated_ports(
    attachment: Attachment, R: Float[np.ndarray, "T d d"], force: Float[np.ndarray, "T q"]
) -> Float[np.ndarray, "T q"]:
    """R λ over time: port forces of the link frame in world components."""
    return rotated_vectors(attachment, R, force).reshape(len(force), -1)[:, attachment.keep]


def in_balance(link: Link, joint: Attachment, S: Float[np.ndarray, "c c"]) -> Float[np.ndarray, "c c"]:
    """Stiffness at ports, the first of its rows, with exactly no force in rigid motions of the link.

    Otherwise rounding of a stiff massless link could exceed the forces of soft mounts.
    """
    N, size, _ = np.linalg.svd(port_columns(joint, link.n).T @ rigid_modes(link), full_matrices=False)
    N = N[:, size > RIGIDLY * size.max(initial=0.0)]
    out, ports = S.copy(), len(joint.keep)
    out[:ports, :ports] -= N @ (N.T @ out[:ports, :ports])
    out[:ports, :ports] -= (out[:ports, :ports] @ N) @ N.T
    return out
