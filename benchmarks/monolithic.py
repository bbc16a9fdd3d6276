"""The step that [KED, eqs. (14)-(20)] describes, undamped: T K0 Tᵀ assembled, nodes shared and all factored each time."""

from collections.abc import Sequence
from time import process_time

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import splu

from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.matrices.substructure import mass_matrix
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.system.monolithic.monolithic_tangent import rotated_stiffness
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion

Column = Float[np.ndarray, " _"]


def shared_nodes(links: Sequence[Link], joints: Sequence[Attachment]) -> sp.csr_array:
    """The constant map T (N, free) from free unknowns to all nodal displacements that keeps every joint closed.

    [KED, eq. (19)]: joints make shared nodes move together.
    Per link, as many components near each joint as it holds are expressed by the others: Ws u_s = B z − Wm u_m.
    """
    blocks, interface = [], []
    for link, joint in zip(links, joints, strict=True):
        W = port_columns(joint, link.n).T
        s = scipy.linalg.qr(W, pivoting=True, mode="r")[1][: len(W)] if len(W) else np.zeros(0, int)
        m = np.setdiff1d(np.arange(link.unknowns), s)
        inverse = np.linalg.inv(W[:, s]) if len(W) else np.zeros((0, 0))
        T = sp.lil_array((link.unknowns, len(m)))
        T[m, np.arange(len(m))] = 1.0
        Tz = np.zeros((link.unknowns, joint.unknowns))
        if len(s):
            near = np.flatnonzero(W[:, m].any(axis=0))
            T[np.ix_(s, near)] = -inverse @ W[:, m[near]]
            Tz[np.ix_(s, joint.columns)] = inverse @ joint.B
        blocks.append(sp.csr_array(T))
        interface.append(sp.csr_array(Tz))
    return sp.csr_array(sp.hstack([sp.block_diag(blocks), sp.vstack(interface)]))


def marched(model: Model, scheme: Scheme, motion: RigidMotion) -> tuple[Float[np.ndarray, "T N"], float]:
    """Displacements of all links from rest at the first time on, world components, and mean seconds of a step."""
    T = shared_nodes(model.links, model.joints)
    M = sp.csr_array(sp.block_diag([mass_matrix(link) for link in model.links]))
    forcing = forcings(model, motion)
    c_m, c_f, b = 1 - scheme.alpha_m, 1 - scheme.alpha_f, scheme.acceleration
    F = np.concatenate([each.F[0].ravel() for each in forcing])
    a = T @ _solved(T.T @ M @ T, T.T @ F)
    u, v, f, out, since = 0 * a, 0 * a, 0 * a, [0 * a], process_time()
    for k in range(1, len(motion.t)):
        stiff = zip(model.links, forcing, strict=True)
        K = sp.csr_array(sp.block_diag([rotated_stiffness(link.K0, each.R[k]) for link, each in stiff]))
        before, F = F, np.concatenate([each.F[k].ravel() for each in forcing])
        right = M @ (c_m * (b[0] * u + b[1] * v + b[2] * a) - scheme.alpha_m * a)
        right += c_f * F + scheme.alpha_f * (before - f)
        new = T @ _solved(T.T @ (c_m * scheme.a0 * M + c_f * K) @ T, T.T @ right)
        later = b[0] * (new - u) - b[1] * v - b[2] * a
        v = v + scheme.h * ((1 - scheme.gamma) * a + scheme.gamma * later)
        u, a, f = new, later, K @ new
        out.append(u)
    return np.array(out), (process_time() - since) / (len(motion.t) - 1)


def _solved(A: sp.csr_array, right: Column) -> Column:
    lu = splu(sp.csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.asarray(lu.solve(right))
