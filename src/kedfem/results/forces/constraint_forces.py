"""Joints enforced by constraint equations: their forces, Σ Bᵀ R λ = Cᵀ μ, and the energy of springs in them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, in_plane
from kedfem.dynamics.joints.constraint_matrices import (
    JointRows,
    RowGroup,
    directions,
    joint_rows,
    port_rows,
    row_groups,
)
from kedfem.dynamics.joints.ports import turned_ports
from kedfem.dynamics.model import Model
from kedfem.motion.rigid import resting
from kedfem.results.recorded import once

DEPENDENT = 1e-9  # singular values of rows of length one: below, one row says what others say


@dataclass
class ConstraintForces:
    """μ of all rows over successive blocks, worked out once for each block; rows that share no unknown one by one."""

    model: Model

    @cached_property
    def groups(self) -> tuple[RowGroup, ...]:
        """Joints by constraint equations that share interface unknowns."""
        return tuple(row_groups(self.model.rows))

    @cached_property
    def of(self) -> Callable[[Block], Float[np.ndarray, "T r"]]:
        """Force of each row on link i along its gap, moment along its turn [N, N m]; none where no joint has rows."""
        return once(self._multipliers)

    def wrench(
        self, name: str, block: Block
    ) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
        """Force of a joint on its link i, moment about its point there, and that point; world components."""
        if block.exerted is not None:
            force, moment, point = np.moveaxis(block.exerted.wrench[:, self._number(name)], 1, 0)
            return force, moment, point
        joint, rows = of_joint(self.model.rows, name)
        along, mu = directions(joint, block.motion), self.of(block)[:, rows]
        return np.einsum("tr,trk->tk", mu, along.gap), np.einsum("tr,trk->tk", mu, along.turn), along.point

    def between_gears(self, name: str, block: Block) -> Float[np.ndarray, " T"]:
        """Force along the coordinate of a pair of gears [N m or N]."""
        if block.exerted is not None:
            return np.asarray(block.exerted.effort[:, self._number(f"gears.{name}")])
        return np.asarray(self.of(block)[:, of_joint(self.model.rows, f"gears.{name}")[1]][:, 0])

    def _number(self, name: str) -> int:
        return [joint.name for joint in self.model.rows].index(name)

    def on_ports(self, block: Block) -> Float[np.ndarray, "T m"]:
        """Forces on the ports of all rows, side by side, world components."""
        return block.exerted.ports if block.exerted is not None else self._ports(block)

    @cached_property
    def _ports(self) -> Callable[[Block], Float[np.ndarray, "T m"]]:
        """The same from the rows' forces, once for all joints that ask."""
        return once(self._from_rows)

    def _from_rows(self, block: Block) -> Float[np.ndarray, "T m"]:
        mu, out, first = self.of(block), [], 0
        for joint in self.model.rows:
            here = mu[:, first : first + len(joint.gap)]
            first += len(joint.gap)
            for side, each in port_rows(joint, block.motion):
                if side.shared:
                    out.append(np.einsum("tr,trpd->tpd", here, each).reshape(len(here), -1))
        return np.concatenate(out, axis=1)

    def _multipliers(self, block: Block) -> Float[np.ndarray, "T r"]:
        rows = sum(len(group.rows) for group in self.groups)
        mu = np.zeros((len(block), rows))
        if not rows:
            return mu
        p = np.zeros((len(block), self.model.interface_unknowns))
        for joint, history in zip(self.model.joints, block.links, strict=True):
            p[:, joint.columns] += turned_ports(joint, history.R, history.port_forces) @ joint.B
        for group in self.groups:
            C, size = _scaled(group.over(block.motion))
            inverse = np.linalg.pinv(C.transpose(0, 2, 1), rcond=DEPENDENT)
            mu[:, group.rows] = np.einsum("trk,tk->tr", inverse, p[:, group.columns]) / size
        return mu

    def determined(self, name: str) -> tuple[bool, bool]:
        """Whether statics determine the force and the moment of a joint enforced by constraint equations.

        What a planar link holds of a solid out of the plane, other joints hold already; nothing there loads either.
        """
        group = next((x for x in self.groups if any(joint.name == name for joint in x.joints)), None)
        if group is None:
            return True, True
        C, null = _null_space(group)
        joint, here = of_joint(group.joints, name)
        loose = np.abs(null[here]).max(axis=1, initial=0.0) > 1e3 * DEPENDENT
        planar = {body for link, body in zip(self.model.links, self.model.bodies, strict=True) if link.planar}
        if planar.intersection(joint.bodies):
            loose &= C[here].any(axis=1) | in_plane(joint.gap, joint.turn)
        force, moment = joint.gap.any(axis=1), joint.turn.any(axis=1)
        return not bool((loose & force).any()), not bool((loose & moment).any())

    def shared(self, name: str) -> list[str]:
        """Joints whose constraints repeat those of a joint, in the reference position."""
        for group in self.groups:
            if any(joint.name == name for joint in group.joints):
                null = np.abs(_null_space(group)[1]) > 1e3 * DEPENDENT
                columns = null[of_joint(group.joints, name)[1]].any(axis=0)
                each = ((joint.name, of_joint(group.joints, joint.name)[1]) for joint in group.joints)
                return [other for other, here in each if null[here][:, columns].any()]
        return []


def of_joint(joints: Sequence[ConstraintJoint], name: str) -> tuple[ConstraintJoint, slice]:
    """A joint enforced by constraint equations, and where its rows are among all."""
    first = 0
    for joint in joints:
        if joint.name == name:
            return joint, slice(first, first + len(joint.gap))
        first += len(joint.gap)
    raise KeyError(name)


def _null_space(group: RowGroup) -> tuple[Float[np.ndarray, "r c"], Float[np.ndarray, "r n"]]:
    """Rows of joints in the reference position, and the combinations of them that say nothing."""
    bodies = 1 + max(b for joint in group.joints for b in joint.bodies)
    C = group.over(resting(bodies, np.zeros(1)))
    U, s, _ = np.linalg.svd(_scaled(C)[0][0])
    return C[0], U[:, int((s > DEPENDENT).sum()) :]


def _scaled(C: Float[np.ndarray, "T r k"]) -> tuple[Float[np.ndarray, "T r k"], Float[np.ndarray, "T r"]]:
    size = np.linalg.norm(C, axis=2)
    size = np.where(size > 0, size, 1.0)
    return C / size[..., None], size


@dataclass(frozen=True, slots=True)
class ConstraintWork:
    """Over a block of T time points.

    stored : (T,) ½ Σ k e² [J]
    dissipated : (T,) in the step that ends there, Σ c (Δe)²/h [J]
    pushed : (T,) work of springs and dampers on their links in that step, as their deflection changes [J]
    last : e and force of each at the end
    """

    stored: Float[np.ndarray, " T"]
    dissipated: Float[np.ndarray, " T"]
    pushed: Float[np.ndarray, " T"]
    last: tuple[float, Float[np.ndarray, " s"], Float[np.ndarray, " s"]]


def row_work(
    model: Model, block: Block, mu: Float[np.ndarray, "T r"],
    before: tuple[float, Float[np.ndarray, " s"], Float[np.ndarray, " s"]] | None,
) -> ConstraintWork | None:  # fmt: skip
    """Of all springs in joints; None without any.

    Parameters
    ----------
    mu : forces of all rows, where the block does not know what springs exert
    before : time, e and forces at the end of the block before
    """
    found = _springs(model, block, mu)
    if found is None:
        return None
    (e, force, k, c), t = found, block.motion.t
    t0, e0, f0 = before or (float(t[0]), e[0], force[0])
    change = np.diff(e, axis=0, prepend=e0[None])
    h = np.diff(t, prepend=t0)
    mean = 0.5 * (force + np.vstack([f0[None], force[:-1]]))
    return ConstraintWork(
        0.5 * (e**2) @ k, (change**2) @ c / np.where(h > 0, h, np.inf), (mean * change).sum(axis=1),
        (float(t[-1]), e[-1], force[-1]),
    )  # fmt: skip


def _springs(model: Model, block: Block, mu: Float[np.ndarray, "T r"]) -> tuple[np.ndarray, ...] | None:
    """Deflections and forces (T, s) of springs in joints, and their stiffness and damping; None without any."""
    if block.exerted is not None:
        of = block.exerted
        return (of.spring[:, 0], of.spring[:, 1], of.stiffness, of.damping) if len(of.stiffness) else None
    springs = any(np.isfinite(joint.stiffness).any() for joint in model.rows)
    rows = joint_rows(model.rows, block.motion, model.interface_unknowns) if springs else None
    if rows is None:
        return None
    soft = rows.soft
    return deflections(model, block, rows)[:, soft], mu[:, soft], rows.stiffness[soft], rows.damping[soft]


def deflections(model: Model, block: Block, rows: JointRows) -> Float[np.ndarray, "T r"]:
    """e = C z over time."""
    z = interface(model, block)
    return np.stack([rows.at(k) @ x for k, x in enumerate(z)])


def interface(model: Model, block: Block) -> Float[np.ndarray, "T k"]:
    """Interface unknowns z over time, from the displacements at all ports."""
    w = [
        (joint.weights @ history.u[:, joint.nodes]).reshape(len(block), -1)[:, joint.keep]
        for joint, history in zip(model.joints, block.links, strict=True)
    ]
    return np.asarray(np.concatenate(w, axis=1) @ np.linalg.pinv(interface_matrix(model.joints).toarray()).T)
