"""Joints enforced by constraint equations: their statically determinate forces, and the energy of springs in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, in_plane
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.joints.independent import blocks
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.forces.exerted import springs, wrench
from kedfem.dynamics.system.forces.supports import supports
from kedfem.motion.rigid import resting

DEPENDENT = 1e-9  # singular values of rows of length one: below, a row is a combination of others


@dataclass
class ConstraintForces:
    """Joints enforced by constraint equations over successive blocks."""

    model: Model

    @cached_property
    def rows(self) -> tuple[Float[np.ndarray, "r k"], Float[np.ndarray, "r n"]]:
        """Rows of all joints in the reference position, and redundant combinations of those without springs."""
        still = resting(1 + max((b for joint in self.model.rows for b in joint.bodies), default=0), np.zeros(1))
        found = constraint_matrices(self.model.rows, still, self.model.interface_unknowns)
        C, holds = found.at(0), np.isinf(found.stiffness)
        silent, null = holds.copy(), []
        for here, _, dense in blocks(sp.csr_array(sp.diags_array(holds.astype(float)) @ C)):
            U, s, _ = np.linalg.svd(dense / np.linalg.norm(dense, axis=1, keepdims=True))
            part = np.zeros((len(silent), len(here) - int((s > DEPENDENT).sum())))
            part[here], silent[here] = U[:, len(here) - part.shape[1] :], False
            null.append(part)
        return C.toarray(), np.concatenate([np.eye(len(silent))[:, silent], *null], axis=1)

    def wrench(
        self, name: str, block: Block
    ) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
        """Force of a joint on its link i, moment about its point there, and that point; world components."""
        return wrench(supports(block), of_joint(self.model.rows, name)[0])

    def determined(self, name: str) -> tuple[bool, bool]:
        """Whether statics determine the force and the moment of a joint enforced by constraint equations.

        A planar link does not constrain a solid out of the plane, where other joints do and nothing loads either.
        """
        if all(joint.name != name for joint in self.model.rows):
            return True, True
        (C, null), (joint, here) = self.rows, of_joint(self.model.rows, name)
        loose = np.abs(null[here]).max(axis=1, initial=0.0) > 1e3 * DEPENDENT
        planar = {body for link, body in zip(self.model.links, self.model.bodies, strict=True) if link.planar}
        if planar.intersection(joint.bodies):
            loose &= C[here].any(axis=1) | in_plane(*joint.along)
        force, moment = (along.any(axis=1) for along in joint.along)
        return not bool((loose & force).any()), not bool((loose & moment).any())

    def shared(self, name: str) -> list[str]:
        """Joints whose constraints repeat those of a joint, in the reference position."""
        if all(joint.name != name for joint in self.model.rows):
            return []
        null = np.abs(self.rows[1]) > 1e3 * DEPENDENT
        columns = null[of_joint(self.model.rows, name)[1]].any(axis=0)
        each = ((joint.name, of_joint(self.model.rows, joint.name)[1]) for joint in self.model.rows)
        return [other for other, here in each if null[here][:, columns].any()]


def of_joint(joints: Sequence[ConstraintJoint], name: str) -> tuple[ConstraintJoint, slice]:
    """A joint enforced by constraint equations, and where its rows are among all."""
    first = 0
    for joint in joints:
        if joint.name == name:
            return joint, slice(first, first + len(joint.constraints))
        first += len(joint.constraints)
    raise KeyError(name)


@dataclass(frozen=True, slots=True)
class ConstraintWork:
    """Work of springs and dampers over a block of T time points.

    stored : (T,) ½ Σ k e² [J]
    dissipated : (T,) in the step that ends there, Σ c (Δe)²/h [J]
    pushed : (T,) work of springs and dampers on their links in that step, as their deflection changes [J]
    last : e and force of each at the end
    """

    stored: Float[np.ndarray, " T"]
    dissipated: Float[np.ndarray, " T"]
    pushed: Float[np.ndarray, " T"]
    last: tuple[float, Float[np.ndarray, " s"], Float[np.ndarray, " s"]]


def joint_spring_work(
    block: Block, before: tuple[float, Float[np.ndarray, " s"], Float[np.ndarray, " s"]] | None
) -> ConstraintWork | None:
    """Work of all springs in joints; None without any.

    Parameters
    ----------
    before : time, e and forces at the end of the block before
    """
    (e, force, k, c), t = springs(supports(block)), block.motion.t
    if not len(k):
        return None
    t0, e0, f0 = before or (float(t[0]), e[0], force[0])
    change = np.diff(e, axis=0, prepend=e0[None])
    h = np.diff(t, prepend=t0)
    mean = 0.5 * (force + np.vstack([f0[None], force[:-1]]))
    return ConstraintWork(
        0.5 * (e**2) @ k, (change**2) @ c / np.where(h > 0, h, np.inf), (mean * change).sum(axis=1),
        (float(t[-1]), e[-1], force[-1]),
    )  # fmt: skip
