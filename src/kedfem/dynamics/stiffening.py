"""Geometric stiffening: M δ'' + C δ' + (K + K_σ) δ = P − M R0'', K_σ from the stresses of the rigid-body motion.

The stresses are quasi-static: those of P − M R0'' and the joint forces in balance with it, on each link. In the
link frame such loads are combinations of a few constant ones: six of rotation, three in a plane (the deforming part of
−M R0'' = −(m·1) ⊗ p'' − (m·X) R''ᵀ), the link's loads, those of motors and springs, and its port forces. Their static
states g_i
are made orthonormal in strain energy; then K0 g = F has the solution g = Σ s_i g_i with s_i = g_i · F, and
K_σ = T (k ⊗ P) Tᵀ, k(t) = Σ s_i(t) k_i, k_i constant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Forcing
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.joints.ports import Rotation, port_columns
from kedfem.dynamics.loads import Pattern, applied
from kedfem.dynamics.matrices.closed import closed
from kedfem.dynamics.matrices.substructure import Substructure, factored, mass_matrix
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_elements import RigidElements
from kedfem.dynamics.stepping.state import Nodal
from kedfem.links.record import Link, Matrix
from kedfem.links.reduced import rigid_modes
from kedfem.links.stress_stiffness import rotated_directions, stress_stiffness
from kedfem.motion.rigid import RigidMotion

BALANCED = 1e-9  # of a load: what is left of one that only accelerates the link is rounding
INDEPENDENT = 1e-10  # of the largest energy: loads below repeat others
NEGLIGIBLE = 1e-12  # of the largest stress: rounding, as of what leaves the plane of a planar linkage
StressForce = Callable[[Nodal], Nodal]
"""k g P of a link at one time, from g."""


@dataclass(frozen=True, slots=True)
class StressModes:
    """Stress modes of one link: its stresses under the loads of the rigid-body motion.

    states : (m, n, d) g_i, without rigid motion, orthonormal in strain energy [1/√J times a state's unit]
    k : (m, z) their stress stiffness, entries of one sparsity pattern or all n² of dense matrices [N/m, times 1/√J]
    indices, indptr : of that pattern; None if dense
    P : (d, d) `rotated_directions`
    """

    states: Float[np.ndarray, "m n d"]
    k: Float[np.ndarray, "m z"]
    indices: Int[np.ndarray, " z"] | None
    indptr: Int[np.ndarray, " n1"] | None
    P: Rotation

    def stiffness(self, s: Float[np.ndarray, " m"]) -> Matrix:
        """k = Σ s_i k_i, (n, n) [N/m]."""
        n, data = self.states.shape[1], s @ self.k
        if self.indices is None:
            return data.reshape(n, n)
        return sp.csr_array((data, self.indices, self.indptr), shape=(n, n))

    def force(self, s: Float[np.ndarray, " m"]) -> StressForce:
        """g → k g P."""
        k = self.stiffness(s)
        return lambda g: np.asarray(k @ (g @ self.P))


@dataclass(frozen=True, slots=True)
class Stiffening:
    """Stress modes of all links, and the static linkage that shares the loads out among the joints (A = K0).

    joints : those that are enforced by constraint equations
    elements : motors and springs, whose forces are those that the rigid-body motion has
    following : links with follower loads in co-rotational frames: number, link, all its loads, as rotated by the
        rigid-body motion, and number in the linkage
    """

    parts: Sequence[Substructure]
    modes: Sequence[StressModes]
    joints: Sequence[ConstraintJoint]
    elements: RigidElements | None
    following: Sequence[tuple[int, Link, tuple[Pattern, ...], int]]

    def over(self, forcing: Sequence[Forcing], motion: RigidMotion) -> list[Float[np.ndarray, "T _"]]:
        """Factors s_i (T, m) of the stress modes of all links over the times of a motion."""
        rows = constraint_matrices(self.joints, motion, self.parts[0].attachment.unknowns)
        loads = [F @ each.R for F, each in zip(self._loads(forcing, motion), forcing, strict=True)]
        forces = closed(self.parts, [each.R for each in forcing], rows).forces(loads)
        return [_factors(*each) for each in zip(self.modes, self.parts, loads, forces, strict=True)]

    def _loads(self, forcing: Sequence[Forcing], motion: RigidMotion) -> list[Float[np.ndarray, "T n d"]]:
        """Loads of all links with those of motors and springs, world components."""
        F = [each.F for each in forcing]
        for k, link, loads, body in self.following:
            F[k] = applied(link, loads, motion, body)
        for k, more in self.elements.loads(motion) if self.elements else ():
            F[k] = F[k] + more
        return F

    def stress_forces(self, forcing: Sequence[Forcing], motion: RigidMotion) -> list[StressForce]:
        """g → k g P of all links at the first time of a motion."""
        return [modes.force(s[0]) for modes, s in zip(self.modes, self.over(forcing, motion), strict=True)]

    def stiffness(self, forcing: Sequence[Forcing], motion: RigidMotion) -> list[Matrix]:
        """k ⊗ R P Rᵀ of all links at the first time of a motion, world frame, (dn, dn)."""
        every = zip(self.modes, self.over(forcing, motion), forcing, strict=True)
        return [
            sp.kron(modes.stiffness(s[0]), each.R[0] @ modes.P @ each.R[0].T, format="csr") for modes, s, each in every
        ]


def stiffening(model: Model, elements: RigidElements | None = None) -> Stiffening:
    """Stress modes of a model's links; none with co-rotational frames, which include the effect of stresses.

    Parameters
    ----------
    elements : motors and springs on them, if there are any

    Raises
    ------
    SolveError
        If a link is not supported.
    """
    parts = [factored(link, joint, 0.0, 1.0) for link, joint in zip(model.links, model.joints, strict=True)]
    modes = [
        _no_modes(link) if link.fit is not None
        else stress_modes(link, part, loads, [] if elements is None else elements.unit_loads(k))
        for k, (link, part, loads) in enumerate(zip(model.links, parts, model.loads, strict=True))
    ]  # fmt: skip
    every = enumerate(zip(model.links, model.loads, model.bodies, strict=True))
    following = [
        (k, link, tuple(replace(load, own=False) for load in loads), body)
        for k, (link, loads, body) in every if any(load.own for load in loads)
    ]  # fmt: skip
    return Stiffening(parts, modes, model.rows, elements, following)


def stress_modes(link: Link, part: Substructure, loads: Sequence[Pattern], elements: Sequence[Nodal] = ()) -> StressModes:
    """Static states of a link under all loads in balance that the rigid-body motion can put on it, and their k.

    Parameters
    ----------
    part : the link with A = K0
    elements : unit forces of motors and springs, link frame
    """
    F = unit_loads(link, part.attachment, loads, elements)
    B = rigid_modes(link)
    MB = mass_matrix(link) @ B
    lever = np.linalg.solve(B.T @ MB, MB.T)
    balanced = F - MB @ np.linalg.solve(B.T @ MB, B.T @ F)
    deforming = np.linalg.norm(balanced, axis=0) > BALANCED * np.linalg.norm(F, axis=0)
    balanced = balanced[:, deforming]
    g = free_states(link, part, balanced)
    g -= B @ (lever @ g)
    energy = g.T @ balanced
    size = np.sqrt(np.diag(energy))
    values, vectors = np.linalg.eigh((energy + energy.T) / 2 / np.outer(size, size))
    kept = values > INDEPENDENT * values.max(initial=0.0)
    states = (g @ (vectors[:, kept] / size[:, None] / np.sqrt(values[kept]))).T.reshape(-1, link.n, link.d)
    of = stress_stiffness(link)
    return StressModes(states, *_stacked([of(each) for each in states], link.n), rotated_directions(link))


def _no_modes(link: Link) -> StressModes:
    none, pattern = np.zeros((0, link.n, link.d)), np.zeros(link.n + 1, np.int32)
    return StressModes(none, np.zeros((0, 0)), pattern[:0], pattern, rotated_directions(link))


def unit_loads(
    link: Link, joint: Attachment, loads: Sequence[Pattern], elements: Sequence[Nodal] = ()
) -> Float[np.ndarray, "k u"]:
    """Loads, link frame, that those of the rigid-body motion are combinations of, but for accelerations of the link."""
    space = 2 if link.planar else 3
    columns: list[Nodal] = [*elements]

    def along(weights: Float[np.ndarray, " n"], j: int) -> Nodal:
        out = np.zeros((link.n, link.d))
        out[:, j] = weights
        return out

    columns += [along(link.mX[:, j], i) + along(link.mX[:, i], j) for i in range(space) for j in range(i + 1)]
    for load in loads:
        if load.follows:
            columns.append(load.forces)
            continue
        weights, sizes, _ = np.linalg.svd(load.forces[:, :space], full_matrices=False)
        columns += [along(w, j) for w in weights.T[sizes > BALANCED * sizes[0]] for j in range(space)]
        columns += [along(load.forces[:, j], j) for j in range(space, link.d)]
    loaded = np.stack([x.ravel() for x in columns if x.any()], axis=1)
    return np.concatenate([loaded, port_columns(joint, link.n)], axis=1)


def free_states(link: Link, part: Substructure, F: Float[np.ndarray, "k u"]) -> Float[np.ndarray, "k u"]:
    """g with K0 g = F of loads in balance, up to rigid motion.

    y = Ã⁻¹ F leaves K0 y = F − E m at the anchors; what Ã⁻¹ E takes away there makes it good, in least squares because
    only deformation distinguishes anchors in balance.
    """
    y = np.stack([part.solve(f.reshape(-1, link.d)).ravel().copy() for f in F.T], axis=1)
    held = part.Y[:, len(part.attachment.keep) :]
    m = (F - link.K0 @ y)[part.anchors]
    D = (link.K0 @ held)[part.anchors]
    return np.asarray(y + held @ np.linalg.lstsq(D, m, rcond=BALANCED)[0])


def _factors(
    modes: StressModes, part: Substructure, load: Float[np.ndarray, "T n d"], force: Float[np.ndarray, "T q"]
) -> Float[np.ndarray, "T m"]:
    """s_i = g_i · (load + Wᵀ λ), λ the first of all forces."""
    flat = modes.states.reshape(len(modes.states), load[0].size)
    at_ports = flat @ port_columns(part.attachment, modes.states.shape[1])
    s = np.asarray(load.reshape(len(load), -1) @ flat.T + force[:, : at_ports.shape[1]] @ at_ports.T)
    share = np.abs(s).max(axis=0) * np.linalg.norm(modes.k, axis=1)
    s[:, share < NEGLIGIBLE * share.max(initial=0.0)] = 0.0
    return s


def _stacked(
    matrices: Sequence[Matrix], n: int
) -> tuple[Float[np.ndarray, "m z"], Int[np.ndarray, " z"] | None, Int[np.ndarray, " n1"] | None]:
    """Matrices (n, n) as rows of entries, and the sparsity pattern that holds them all."""
    if not matrices or not sp.issparse(matrices[0]):
        return np.array(matrices).reshape(len(matrices), n * n), None, None
    rows = [sp.coo_array(each) for each in matrices]
    places = [each.row.astype(np.int64) * n + each.col for each in rows]
    found = np.unique(np.concatenate(places))
    k = np.zeros((len(rows), len(found)))
    for data, each, at in zip(k, rows, places, strict=True):
        np.add.at(data, np.searchsorted(found, at), each.data)
    indptr = np.searchsorted(found, n * np.arange(n + 1))
    return k, (found % n).astype(np.int32), indptr.astype(np.int32)
