"""What joints hold and what balances, from ports, nodes and the rigid motion alone: not by the rows that hold them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.interpolate import CubicSpline

from kedfem.accuracy.prepared import Prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.attachments import Attachment, interface_matrix
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.joints.ports import port_values, rotated_ports, rotated_vectors
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.system.record import TURN
from kedfem.links.record import Link, in_space
from kedfem.motion.joint_equations import joint_axis, unit
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import GROUND, Joint, time_grid
from tests.moving import channels, state

LENGTH = 0.1  # m, by which turns are compared with displacements


@dataclass(frozen=True)
class Bodies:
    """Rigid motion of all links over a run, and the numbers of their names."""

    p: np.ndarray
    R: np.ndarray
    numbers: dict[str, int]

    def of(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        return self.p[:, self.numbers[name]], self.R[:, self.numbers[name]]

    def place(self, name: str, X: np.ndarray) -> np.ndarray:
        """Where points (…, 3) of a link in the reference position are (T, …, 3)."""
        p, R = self.of(name)
        return p.reshape(-1, *[1] * (X.ndim - 1), 3) + np.einsum("tij,...j->t...i", R, X)


def bodies(ready: Prepared, blocks: list[Block]) -> Bodies:
    p, R = (np.concatenate([getattr(block.motion, x) for block in blocks]) for x in ("p", "R"))
    return Bodies(p, R, {name: k for k, name in enumerate(ready.linkage.bodies)})


def sides(joint: Joint) -> tuple[str, str]:
    """Links i and j: what a joint exerts is said of i, at its point there; its axis is fixed in j."""
    first, second = joint.links
    return (second, first) if first == GROUND else (first, second)


def point_of(ready: Prepared, at: Bodies, name: str) -> np.ndarray:
    joint = ready.scene.joints[name]
    return at.place(sides(joint)[0], np.asarray(joint.at))


def free_twists(ready: Prepared, at: Bodies, name: str) -> np.ndarray:
    """Of link i against j about the joint's point, (T, f, 6): displacement and LENGTH times turn, of unit size."""
    joint, zero = ready.scene.joints[name], np.zeros(3)
    i, j = sides(joint)
    (_, Ri), (_, Rj) = at.of(i), at.of(j)
    along = [(zero, e) for e in np.eye(3)]
    z = joint_axis(joint)
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    pitch = (joint.lead or 0.0) / (2 * np.pi)
    turns = {
        "revolute": [(zero, z)], "spherical": along, "weld": [], "prismatic": [(z, zero)], "universal": [],
        "cylindrical": [(z, zero), (zero, z)], "planar": [(x, zero), (np.cross(z, x), zero), (zero, z)],
        "slot": [(z, zero), *along], "screw": [(pitch * z, z)],
    }[joint.kind]  # fmt: skip
    if any(drive.shaft_stiffness is None for drive in ready.scene.driven_joints.get(name, ())):
        turns = []
    out = [np.hstack([Rj @ v, LENGTH * (Rj @ w)]) for v, w in turns]
    if joint.axes is not None:
        a, b = (unit(joint.axes[joint.links.index(link)]) for link in (i, j))
        out = [np.hstack([0 * (R @ c), LENGTH * (R @ c)]) for R, c in ((Ri, a), (Rj, b))]
    found = np.stack(out, axis=1) if out else np.zeros((len(Ri), 0, 6))
    return np.asarray(found / np.linalg.norm(found, axis=2, keepdims=True))


def held_twists(free: np.ndarray) -> np.ndarray:
    """What is at right angles to all that is free (T, 6 - f, 6)."""
    return np.stack([scipy.linalg.null_space(each).T if len(each) else np.eye(6) for each in free])


def ports(ready: Prepared, name: str, on: str) -> tuple[int, np.ndarray]:
    """The link that has a joint's ports, and which of its ports these are."""
    k = next(k for k, link in enumerate(ready.model.links) if link.name == on)
    return k, np.flatnonzero([x == name for x in ready.model.joints[k].joints])


def port_motion(ready: Prepared, blocks: list[Block], name: str, on: str) -> tuple[np.ndarray, np.ndarray]:
    """Ports in the reference position (p, 3), and their displacements (T, p, 3)."""
    k, here = ports(ready, name, on)
    joint, link = ready.model.joints[k], ready.model.links[k]
    u = joint.weights[here] @ state(blocks, k, "u")[:, joint.nodes]
    return joint.points[here], in_space(link, u) if link.d == 2 else u


def port_wrench(ready: Prepared, blocks: list[Block], name: str, on: str) -> np.ndarray:
    """Force of a joint on a link at its ports, and moment about the joint's point over LENGTH (T, 6)."""
    at, (k, here) = bodies(ready, blocks), ports(ready, name, on)
    joint = ready.model.joints[k]
    f = rotated_vectors(joint, state(blocks, k, "R"), state(blocks, k, "port_forces"))[:, here]
    arms = at.place(on, joint.points[here]) - point_of(ready, at, name)[:, None]
    return np.hstack([f.sum(axis=1), np.cross(arms, f).sum(axis=1) / LENGTH])


def twist(ready: Prepared, blocks: list[Block], name: str, on: str) -> np.ndarray:
    """Displacement and LENGTH times turn of a link's coupling surface at a joint's point (T, 6), by its ports; none of
    the ground."""
    at = bodies(ready, blocks)
    P = point_of(ready, at, name)
    if on == GROUND:
        return np.zeros((len(P), 6))
    joint = ready.scene.joints[name]
    if joint.kind == "slot" and on == joint.links[1]:
        X, u = port_motion(ready, blocks, name, on)
        s = np.linalg.norm(X - X[0], axis=1)
        travel = np.linalg.norm(P - at.place(on, X[0]), axis=1)
        value = np.stack([CubicSpline(s, row)(t) for row, t in zip(u, travel, strict=True)])
        return np.hstack([value, np.zeros_like(value)])
    x, u0, turn = surface_motion(ready, blocks, name, on)
    return np.hstack([u0 + np.cross(turn, P - x), LENGTH * turn])


def surface_motion(ready: Prepared, blocks: list[Block], name: str, on: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle of a joint's or gears' coupling surface, its displacement and turn, world components (T, 3), from its
    ports."""
    X, u = port_motion(ready, blocks, name, on)
    x = bodies(ready, blocks).place(on, X)
    turn = np.stack([_turn(dx, du) for dx, du in zip(x[:, 1:] - x[:, :1], u[:, 1:] - u[:, :1], strict=True)])
    return x[:, 0], u[:, 0], turn


def _turn(dx: np.ndarray, du: np.ndarray) -> np.ndarray:
    """Of du = θ × dx of differences in two or three directions; with two nothing strains across them."""
    if np.linalg.matrix_rank(dx, tol=1e-6 * np.abs(dx).max()) == 2:
        dx, du = dx[:2], du[:2]
        n = np.cross(*dx)
        du = np.vstack([du, -np.linalg.solve(np.vstack([dx, n]), [*(du @ n), 0.0])])
        dx = np.vstack([dx, n])
    G = np.linalg.lstsq(dx, du, rcond=None)[0].T
    return 0.5 * np.array([G[2, 1] - G[1, 2], G[0, 2] - G[2, 0], G[1, 0] - G[0, 1]])


def shared_gap(ready: Prepared, blocks: list[Block], name: str) -> np.ndarray:
    """How far the port points of a joint that shares them gape (T, p, 3); of a slide on the ground across its axis."""
    joint = ready.scene.joints[name]
    i, j = sides(joint)
    X, gap = port_motion(ready, blocks, name, i)
    if j != GROUND:
        Y, other = port_motion(ready, blocks, name, j)
        assert np.allclose(X, Y, atol=1e-12)
        gap = gap - other
    if joint.kind == "prismatic":
        z = bodies(ready, blocks).of(j)[1] @ joint_axis(joint)
        gap = gap - np.einsum("tk,tpk->tp", z, gap)[..., None] * z[:, None]
    return gap


def balanced(ready: Prepared, a: np.ndarray) -> np.ndarray:
    """The accelerations with which forces at the end of steps are in balance."""
    scheme = generalised_alpha(time_grid(ready.scene).step, ready.scene.analysis.rho_inf)
    out = a.copy()
    for k in range(1, len(a)):
        both = (1 - scheme.alpha_m) * a[k] + scheme.alpha_m * a[k - 1]
        out[k] = (both - scheme.alpha_f * out[k - 1]) / (1 - scheme.alpha_f)
    return out


def unbalanced(ready: Prepared, blocks: list[Block]) -> tuple[float, float]:
    """Greatest residual force and moment at any link and time: joints, gears, P − M R0'' and M δ''; of the greatest."""
    at, found, sizes = bodies(ready, blocks), [], [0.0, 0.0]
    forces = channels(ready, blocks)
    for k, link in enumerate(ready.model.links):
        acting = _link_wrenches(ready, at, forces, link.name)
        acting += [_of_nodes(link, at, _left(ready, blocks, k))]
        found.append([np.abs(np.sum([x[part] for x in acting], axis=0)).max() for part in (0, 1)])
        sizes = [max(sizes[part], *(np.abs(x[part]).max() for x in acting)) for part in (0, 1)]
    force, moment = np.max(found, axis=0) / sizes
    return float(force), float(moment)


def _left(ready: Prepared, blocks: list[Block], k: int) -> np.ndarray:
    """P − M R0'' − M δ'' at the functions of link k; K δ has neither force nor moment."""
    a, F = balanced(ready, state(blocks, k, "a")), state(blocks, k, "F").copy()
    for c, m in enumerate(ready.model.links[k].mass):
        F[:, :, c] -= (m @ a[:, :, c].T).T
    return F


def interface_values(joints: Sequence[Attachment], u: Sequence[np.ndarray]) -> np.ndarray:
    """z (k,) from states (n, d) with joints closed, world components: W u = B z."""
    w = np.concatenate([port_values(joint, x) for joint, x in zip(joints, u, strict=True)])
    return np.asarray(np.linalg.lstsq(interface_matrix(joints).toarray(), w)[0])


def row_values(ready: Prepared, block: Block) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """C (T, r, k) of all rows, z (T, k), and the rows' forces μ (T, r) from port forces alone: Σ Bᵀ R λ = Cᵀ μ."""
    model, T = ready.model, len(block)
    rows = constraint_matrices(model.rows, block.motion, model.interface_unknowns)
    C = np.stack([rows.at(k).toarray() for k in range(T)])
    every = list(zip(model.joints, block.links, strict=True))
    w = [(x.weights @ own.u[:, x.nodes]).reshape(T, -1)[:, x.keep] for x, own in every]
    p = [rotated_ports(x, own.R, own.port_forces) for x, own in every]
    B = interface_matrix(model.joints).toarray()
    pushed = np.concatenate(p, axis=1) @ B
    mu = np.linalg.pinv(C.transpose(0, 2, 1), rcond=1e-9) @ pushed[..., None]
    return C, np.concatenate(w, axis=1) @ np.linalg.pinv(B).T, mu[..., 0]


def directions(joint: ConstraintJoint, motion: RigidMotion) -> np.ndarray:
    """What constraints of a joint are along and about (2, T, r, 3): fixed in j, but about a cross."""
    i, j = joint.bodies
    out = np.array(joint.along)[:, None] @ motion.R[:, j].transpose(0, 2, 1)
    for n, each in enumerate(joint.constraints):
        for term in each.terms:
            if term.kind == TURN:
                out[1, :, n] = np.cross(motion.R[:, i] @ term.a, motion.R[:, j] @ term.b)
    return out


def _of_nodes(link: Link, at: Bodies, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Resultant of forces at a link's functions, and moment about the world's origin."""
    p, R = at.of(link.name)
    arms = link.one[:, None] * p[:, None] + link.X @ R.transpose(0, 2, 1)
    f = in_space(link, y)
    moment = np.cross(arms, f).sum(axis=1)
    if link.kind == "beam":
        moment[:, 2] += y[:, :, 2] @ link.one
    return link.one @ f, moment


def _link_wrenches(ready: Prepared, at: Bodies, forces: dict[str, np.ndarray], on: str) -> list[tuple]:
    """Forces of joints and gears on a link, as their channels say, and moments about the world's origin."""
    out = []
    for name, joint in ready.scene.joints.items():
        if on in joint.links:
            sign = 1.0 if sides(joint)[0] == on else -1.0
            f, m = (sign * forces[f"joints/{name}/{x}"] for x in ("force", "moment"))
            out.append((f, m + np.cross(point_of(ready, at, name), f)))
    for name, gear in ready.scene.gears.items():
        first = forces[f"gears/{name}/torque"]
        for one, effort in zip(gear.joints, (first, -first / gear.transmission), strict=True):
            joint = ready.scene.joints[one]
            if on in joint.links:
                sign = 1.0 if sides(joint)[0] == on else -1.0
                along = sign * effort * (at.of(sides(joint)[1])[1] @ joint_axis(joint))
                slides = joint.kind == "prismatic"
                moment = np.cross(point_of(ready, at, one), along) if slides else along
                out.append((along if slides else 0 * along, moment))
    return out
