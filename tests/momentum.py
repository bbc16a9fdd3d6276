"""The momentum of a run balanced from its histories alone: an oracle that shares no code with the account of energy.

Linear, Σ M (R0' + δ'), against the impulse of loads, supports and damping forces; angular, about the world's origin with
arms to deflected points, against their moments and that of K δ, which turns with the rigid-body frame [KED, eq. (20)].
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.dynamics.history import Block, LinkHistory
from kedfem.dynamics.joints.ports import rotated_vectors
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.links.record import Link


@dataclass(frozen=True, slots=True)
class Momentum:
    """The residual at worst: of the largest that all links have, or that forces pass on in time, whichever is more.

    linear, angular : of the integration [-]; angular momentum is judged by the linear at the linkage's size at least
    turned : angular momentum that K's neglected turning brings in [-]
    """

    linear: float
    angular: float
    turned: float


def momentum(model: Model, blocks: Sequence[Block]) -> Momentum:
    """Of a run from its first block to its last."""
    t = np.concatenate([block.motion.t for block in blocks])
    h = np.diff(t, prepend=t[0])[:, None]
    kept, forces, turning, taken = (np.zeros((len(t), 6)) for _ in range(4))
    sizes = np.zeros((len(t), 3))
    for k, body in enumerate(model.bodies):
        last, parts = None, []
        for block in blocks:
            parts.append(_of_link(model, k, block, last))
            of, motion = block.links[k], block.motion
            last = _Before(of.g[-1], of.u[-1], motion.p[-1, body], motion.R[-1, body])
        found = [np.concatenate(x) for x in zip(*parts, strict=True)]
        kept, forces, turning, taken = (a + b for a, b in zip((kept, forces, turning, taken), found[:4], strict=True))
        sizes += np.stack([_size(found[0][:, :3]), _size(found[0][:, 3:]), found[4]], axis=1)
    work, turned = (np.cumsum(0.5 * h * (x + np.vstack([x[:1], x[:-1]])), axis=0) for x in (forces, turning))
    left = kept - kept[0] - work + turned + np.cumsum(taken, axis=0)
    which = [0, 1, 5] if any(link.planar for link in model.links) else list(range(6))
    shown = np.isin(np.arange(6), which)
    passed = np.cumsum(h[:, 0] * sizes[:, 2])
    linear = max(float(sizes[:, 0].max()), float(passed.max()))
    nodes = np.concatenate([(link.full or link).nodes for link in model.links])
    angular = max(float(sizes[:, 1].max()), linear * float(np.ptp(nodes, axis=0).max()))
    left, turned = left * shown, turned * shown
    return Momentum(
        float(_size(left[:, :3]).max()) / linear, float(_size(left[:, 3:]).max()) / angular,
        float(_size(turned[:, 3:]).max()) / angular,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Fields:
    """Nodal fields of a link: affine ones, M times them, and forces and moments of nodal forces about the origin."""

    link: Link

    @property
    def k(self) -> int:
        return 2 if self.link.planar else 3

    def affine(self, a: np.ndarray, A: np.ndarray, spin: np.ndarray) -> np.ndarray:
        """1 ⊗ a + X Aᵀ (T, n, d), and the rotation of a planar beam."""
        k, one, X = self.k, self.link.one, self.link.X[:, : self.k]
        out = np.zeros((len(a), self.link.n, self.link.d))
        out[:, :, :k] = one[None, :, None] * a[:, None, :k] + X @ A[:, :k, :k].transpose(0, 2, 1)
        if self.link.kind == "beam":
            out[:, :, 2] = one * spin[:, 2:]
        return out

    def mass_times(self, x: np.ndarray) -> np.ndarray:
        return np.stack([(m @ x[:, :, j].T).T for j, m in enumerate(self.link.mass)], axis=2)

    def stiffness_times(self, x: np.ndarray) -> np.ndarray:
        K = self.link.K0 if isinstance(self.link.K0, np.ndarray) else self.link.K0.toarray()
        return (x.reshape(len(x), -1) @ K).reshape(x.shape)

    def moment(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Σ x × y of places and forces."""
        N = np.zeros((len(y), 3, 3))
        N[:, : self.k, : self.k] = np.einsum("tni,tnj->tij", x[:, :, : self.k], y[:, :, : self.k])
        return np.stack([N[:, 1, 2] - N[:, 2, 1], N[:, 2, 0] - N[:, 0, 2], N[:, 0, 1] - N[:, 1, 0]], axis=1)

    def wrench(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Force, and moment about the origin of the places x, of nodal forces y (T, 6); a planar beam's couples too."""
        force = np.zeros((len(y), 3))
        force[:, : self.k] = np.einsum("n,tnk->tk", self.link.one, y[:, :, : self.k])
        moment = self.moment(x, y)
        if self.link.kind == "beam":
            moment[:, 2] += y[:, :, 2] @ self.link.one
        return np.hstack([force, moment])


@dataclass(frozen=True, slots=True)
class _Before:
    """The time point before a block: deformation and displacement of a link, its place and orientation."""

    g: np.ndarray
    u: np.ndarray
    p: np.ndarray
    R: np.ndarray


def _of_link(model: Model, k: int, block: Block, last: _Before | None) -> tuple[np.ndarray, ...]:
    """Momentum, forces, moment of K δ, what damping takes in each step, each (T, 6), and the larger of its forces."""
    link, joint, of, body = model.links[k], model.joints[k], block.links[k], model.bodies[k]
    fields, motion = _Fields(link), block.motion
    p, R, omega = motion.p[:, body], motion.R[:, body], motion.omega[:, body]
    turning = np.cross(omega[:, None], R.transpose(0, 2, 1)).transpose(0, 2, 1)  # R'
    place = fields.affine(p, R, 0 * omega) + of.u
    velocity = fields.affine(motion.v[:, body], turning, omega) + of.v
    inertia = fields.mass_times(fields.affine(motion.p2[:, body], motion.R2[:, body], motion.alpha[:, body]))
    loads, ports = of.F + inertia, np.zeros_like(of.F)
    ports[:, joint.nodes] = np.einsum("pn,tpd->tnd", joint.weights, rotated_vectors(joint, of.R, of.port_forces))
    turned = np.zeros((len(p), 6))
    if link.fit is None:
        turned[:, 3:] = np.einsum("tij,tj->ti", R, fields.moment(of.g, fields.stiffness_times(of.g)))
    return (
        fields.wrench(place, fields.mass_times(velocity)), fields.wrench(place, loads + ports), turned,
        _damped(model.damping, fields, of, (p, R), last),
        np.maximum(*(_size(fields.wrench(place, y)[:, :3]) for y in (loads, ports))),
    )  # fmt: skip


def _damped(
    damping: Rayleigh, fields: _Fields, of: LinkHistory, pose: tuple[np.ndarray, np.ndarray], last: _Before | None
) -> np.ndarray:
    """Impulse (T, 6) of damping forces in each step, at the mean of its ends, where they turn with the rigid links."""
    (p, R), link = pose, fields.link
    if not damping.present or (link.fit is not None and not damping.alpha):
        return np.zeros((len(p), 6))
    d, last = link.d, last or _Before(of.g[0], of.u[0], p[0], R[0])
    g, before = (of.g, last.g) if link.fit is None else (of.u @ R[:, :d, :d], last.u @ last.R[:d, :d])
    earlier = np.concatenate([before[None], g[:-1]])
    change, middle = g - earlier, 0.5 * (g + earlier)
    y = damping.alpha * fields.mass_times(change)
    if link.fit is None:
        y = y + damping.beta * fields.stiffness_times(change)
    middle[:, :, : fields.k] += link.X[:, : fields.k]
    local = fields.wrench(middle, y)
    mean_R, mean_p = (0.5 * (x + np.concatenate([x0[None], x[:-1]])) for x, x0 in ((R, last.R), (p, last.p)))
    force, moment = (np.einsum("tij,tj->ti", mean_R, x) for x in (local[:, :3], local[:, 3:]))
    return np.hstack([force, np.cross(mean_p, force) + moment])


def _size(x: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(x, axis=1))
