"""Links reduced to the span of a few scalar modes, with the same equations.

Q (n, s) holds modes of a link, column by column. Q ⊗ Rᵈ is closed under rotation, so the reduced link is again a
link: mass Qᵀ m Q, stiffness (Q ⊗ I)ᵀ K0 (Q ⊗ I) [KED, eqs. (12)(14)]. Sources: Pechstein, Reischl, Gerstmayr
(2013), "A generalized component mode synthesis approach for flexible multibody systems"; Gerstmayr, Schöberl (2006).
"""

from dataclasses import replace
from itertools import product

import numpy as np
import scipy.sparse as sp
import skfem

from kedfem.arrays import Float
from kedfem.links.record import Link, read_only

RIGID = 1e3
LIGHT = 1e-10  # of a rigid link's mass: added to a mass matrix that could be singular
STRAIGHT = 1e-9  # of a link's length: smaller deviations from a line are rounding
INDEPENDENT = 1e-14  # of the largest eigenvalue: below, a function depends on others


def reduced(link: Link, Q: Float[np.ndarray, "n s"]) -> Link:
    """The link reduced to the span of modes Q, with dense matrices; `full` and `Q` refer to the original.

    Parameters
    ----------
    Q : (n, s) independent modes whose span holds 1 and the position [-]; they are made mass-orthonormal
    """
    Q = mass_orthonormal(link, Q)
    mass = tuple(_gram(m, Q) for m in link.mass)
    mQ = np.asarray(link.mass[0] @ Q)
    one, X = mQ.T @ link.one, mQ.T @ link.X
    if link.planar:
        X[:, 2] = 0.0  # the height of its plane, which is not in the span and has no effect
    K0 = projected_stiffness(link, Q)
    m1, mX = Q.T @ link.m1, Q.T @ link.mX
    volume = Q.T @ link.volume
    read_only(Q, one, X, m1, mX)
    made = replace(
        link, X=X, one=one, mass=mass, K0=K0, m1=m1, mX=mX, volume=volume, full=link, Q=Q,
        fit=None if link.fit is None else Q.T @ link.fit, frames=(), element=None,
    )  # fmt: skip
    return replace(made, K0=_unstrained(K0, rigid_modes(made)))


def mode_matrix(link: Link) -> Float[np.ndarray, "n s"]:
    """Q of a reduced link: weights of the unreduced link @ Q are weights of its modes."""
    if link.Q is None:
        raise ValueError(f"link {link.name} is not reduced")
    return link.Q


def mass_orthonormal(link: Link, Q: Float[np.ndarray, "n s"]) -> Float[np.ndarray, "n _"]:
    """Modes of the same span with Qᵀ m Q = 1; fewer if some depend on others."""
    Q = Q / np.sqrt(np.einsum("as,as->s", Q, np.asarray(link.mass[0] @ Q)))
    for _ in range(3):  # the second time for rounding, the third where modes nearly depend on each other
        values, vectors = np.linalg.eigh(_gram(link.mass[0], Q))
        kept = values > INDEPENDENT * values[-1]
        Q = Q @ (vectors[:, kept] / np.sqrt(values[kept]))
    return np.ascontiguousarray(Q)


def projected_stiffness(link: Link, Q: Float[np.ndarray, "n s"]) -> Float[np.ndarray, "k k"]:
    """(Q ⊗ I)ᵀ K0 (Q ⊗ I), scalar block by scalar block, (ds, ds) [KED, eq. (14)]."""
    d, s = link.d, Q.shape[1]
    blocks = stiffness_blocks(link)
    out = np.empty((s, d, s, d))
    for i, j in product(range(d), range(d)):
        if i <= j:
            out[:, i, :, j] = Q.T @ (scalar_block(blocks, i, j) @ Q)
            out[:, j, :, i] = out[:, i, :, j].T
    K0 = out.reshape(d * s, d * s)
    return (K0 + K0.T) / 2


def _unstrained(K0: Float[np.ndarray, "k k"], modes: Float[np.ndarray, "k r"]) -> Float[np.ndarray, "k k"]:
    """K0 without rounding errors on rigid motions, which are large with stiff modes."""
    B = np.linalg.qr(modes)[0]
    K0 = K0 - B @ (B.T @ K0)
    K0 = K0 - (K0 @ B) @ B.T
    return np.asarray((K0 + K0.T) / 2)


def stiffness_blocks(link: Link) -> sp.bsr_array:
    """K0 of an unreduced link, a (d, d) block for each pair of modes."""
    return sp.bsr_array(link.K0, blocksize=(link.d, link.d))


def scalar_block(blocks: sp.bsr_array, i: int, j: int) -> sp.csr_array:
    """The scalar matrix between components i and j, (n, n), of `stiffness_blocks`."""
    n = len(blocks.indptr) - 1
    return sp.csr_array((blocks.data[:, i, j].copy(), blocks.indices, blocks.indptr), shape=(n, n))


def _gram(m: sp.csr_array, Q: Float[np.ndarray, "n s"]) -> Float[np.ndarray, "s s"]:
    G = Q.T @ np.asarray(m @ Q)
    return np.asarray((G + G.T) / 2)


def rigid_body_functions(link: Link) -> Float[np.ndarray, "n r"]:
    """1 and the coordinates from the mean of the nodes: of planar links x and y, of a straight beam the one along it."""
    X = link.X[:, :2] if link.planar else link.X
    X = X - np.outer(link.one, X[link.one != 0].mean(axis=0))
    sizes, axes = np.linalg.svd(X, full_matrices=False)[1:]
    return np.concatenate([link.one[:, None], X @ axes[sizes > STRAIGHT * sizes[0]].T], axis=1)


def rigid(link: Link, frequency: float | None = None) -> Link:
    """The link reduced to {1, x, y, z} and made stiff, so that it only moves rigidly.

    Parameters
    ----------
    frequency : of its own vibrations [rad/s]; RIGID times its `wave_frequency` if not given
    """
    made = reduced(link, rigid_body_functions(link))
    if link.kind == "beam":  # ψ's mass may be at one point alone, as of a flywheel on a light beam
        e, m = made.one / np.linalg.norm(made.one), made.mass[2]
        made = replace(made, mass=(*made.mass[:2], m + LIGHT * np.trace(m) * (np.eye(len(m)) - np.outer(e, e))))
    stiffness = (RIGID * wave_frequency(link) if frequency is None else frequency) ** 2
    B = np.linalg.qr(_weighted(made, rigid_modes(made)))[0]
    K0 = _weighted(made, _weighted(made, stiffness * (np.eye(made.unknowns) - B @ B.T)).T)
    return replace(made, K0=K0, rigid=True)


def wave_frequency(link: Link) -> float:
    """√(E/ρ)/L, of the order of the frequency of a link's first axial vibration [1/s]."""
    density = float(link.one @ link.m1[:, 0]) / float(link.one @ link.volume)
    return float(np.sqrt(link.E / density) / overall_length(link))


def overall_length(link: Link) -> float:
    """Distance of the two ends of a link: from the node farthest from its middle to the node farthest from that [m]."""
    nodes = (link.full or link).nodes
    end = nodes[np.argmax(np.linalg.norm(nodes - nodes.mean(axis=0), axis=1))]
    return float(np.linalg.norm(nodes - end, axis=1).max())


def rigid_modes(link: Link) -> Float[np.ndarray, "k r"]:
    """States (dn,) of small rigid motions: translations and rotations, column by column."""
    modes = rigid_motions(link.X, link.one, 2 if link.planar else 3)
    if link.kind != "beam":
        return modes
    out = np.zeros((link.n, 3, 3))
    out[:, :2], out[:, 2, 2] = modes.reshape(link.n, 2, 3), link.one
    return out.reshape(-1, 3)


def rigid_motions(X: Float[np.ndarray, "n 3"], one: Float[np.ndarray, " n"], d: int) -> Float[np.ndarray, "k r"]:
    """Translations and rotations about the origin, (n functions, d components) by motions."""
    motions = [np.outer(one, e) for e in np.eye(d)]
    for i, j in ((0, 1), (1, 2), (2, 0))[: 1 if d == 2 else 3]:
        turn = np.zeros((len(X), d))
        turn[:, i], turn[:, j] = -X[:, j], X[:, i]
        motions.append(turn)
    return np.stack(motions, axis=2).reshape(d * len(X), -1)


def _weighted(link: Link, A: Float[np.ndarray, "k c"]) -> Float[np.ndarray, "k c"]:
    """M^½ A of a reduced link; only the mass of a beam's ψ is not 1."""
    out = A.reshape(link.n, link.d, -1).copy()
    for c, m in enumerate(link.mass):
        values, vectors = np.linalg.eigh(m)
        out[:, c] = (vectors * np.sqrt(values)) @ (vectors.T @ out[:, c])
    return out.reshape(A.shape)


def can_be_stored(link: Link) -> bool:
    """Whether `stored` makes a link small: it is reduced, or has no mesh."""
    return link.full is not None or link.basis is None


def stored(link: Link) -> Link:
    """A copy that can be pickled: of the unreduced link only geometry and function space are left."""
    if link.full is None:
        return link
    full, none = link.full, sp.csr_array((0, 0))
    if full.basis is not None:
        basis = full.basis
        full = replace(full, basis=(basis.mesh, type(basis.elem), basis.X, basis.W))
    return replace(link, basis=None, full=replace(full, K0=none, mass=(none,) * full.d))


def restored(link: Link) -> Link:
    """The link that `stored` was given, without the unreduced link's matrices."""
    if link.full is None or link.full.basis is None:
        return link
    mesh, element, X, W = link.full.basis
    basis = skfem.Basis(mesh, element(), quadrature=(X, W))
    return replace(link, basis=basis, full=replace(link.full, basis=basis))
