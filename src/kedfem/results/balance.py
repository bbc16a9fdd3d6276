"""Energy, momentum and power of one link, seen from the general equation, [KED, eq. (20)].

The absolute motion is R' = R0 + δ, its rate R0' + δ' with R0' = 1 ⊗ p' + X R'ᵀ. All that a link's rigid motion has to do
with a nodal field y is Σ y and Σ X ⊗ y, its *moments*; those of M y need m·1 and m·X only. So the audit of a block of
time points costs a few passes over its arrays.
"""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.condensed import turned_vectors
from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.history import LinkHistory, Products
from kedfem.dynamics.state import Rayleigh
from kedfem.links.record import Link, Matrix, in_space
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion
from kedfem.motion.rows import cross

DENSE = 400  # unknowns of a link: up to here a dense product beats a sparse one
Scalars = Float[np.ndarray, " T"]
Vectors = Float[np.ndarray, "T 3"]
Field = Float[np.ndarray, "T n d"]
Moments = Float[np.ndarray, "T 4 d"]


@dataclass(frozen=True, slots=True)
class Constants:
    """What the audit needs of a link, constant.

    fit, weighted : (n, 4) [1, X] and m [1, X]: moments of a field y, and of M y
    gram : (4, 4) [1, X]ᵀ m [1, X]: mass, its first and second moment; spin: of a planar beam its sections' inertia
    stations : (p, 3) where the ports are drawn
    K0, masses : dense if small; None for a mass that is 1
    """

    link: Link
    joint: Attachment
    body: int
    damping: Rayleigh
    fit: Float[np.ndarray, "n 4"]
    weighted: Float[np.ndarray, "n 4"]
    gram: Float[np.ndarray, "4 4"]
    spin: float
    stations: Float[np.ndarray, "p 3"]
    K0: Matrix
    masses: tuple[Matrix | None, ...]


def constants(link: Link, joint: Attachment, body: int, damping: Rayleigh) -> Constants:
    """Of a link that is body number `body` of the motion."""
    fit = np.column_stack([link.one, link.X])
    weighted = np.column_stack([link.m1[:, 0], link.mX])
    spin = float(link.one @ link.m1[:, 2]) if link.kind == "beam" else 0.0
    stations = joint.weights @ link.X[joint.nodes]
    masses = tuple(None if _is_one(m) else _dense(m, link.unknowns) for m in link.mass)
    K0 = _dense(link.K0, link.unknowns)
    return Constants(link, joint, body, damping, fit, weighted, fit.T @ weighted, spin, stations, K0, masses)


@dataclass(frozen=True, slots=True)
class Flow:
    """Of one link, or of several, at T time points; world components, moments about the world's origin.

    kinetic : (T,) energy of the absolute motion [J]
    momentum, angular : (T, 3) [N s, N m s]
    loads, supports : (T,) power of P and of the port forces [W]; that of joints between links cancels in the sum
    force, moment : (T, 3) of P and the port forces together [N, N m]
    turning : (T, 3) Σ δ × K δ: moment that K's forces have on the bent link, as K turns with the nominal frame [N m]
    neglected : (T,) its power on the nominal rotation [W]
    """

    kinetic: Scalars
    momentum: Vectors
    angular: Vectors
    loads: Scalars
    supports: Scalars
    force: Vectors
    moment: Vectors
    turning: Vectors
    neglected: Scalars

    def __add__(self, other: "Flow") -> "Flow":
        """Both together."""
        return Flow(*(getattr(self, each.name) + getattr(other, each.name) for each in fields(self)))


@dataclass(frozen=True, slots=True)
class Nominal:
    """Rigid motion of one body: R, origin p, and (v, spin), (a, R2): p', R' and p'', R''; turning rate and its own."""

    R: Float[np.ndarray, "T 3 3"]
    p: Vectors
    v: Vectors
    spin: Float[np.ndarray, "T 3 3"]
    a: Vectors
    R2: Float[np.ndarray, "T 3 3"]
    omega: Vectors
    alpha: Vectors


def nominal(motion: RigidMotion, body: int) -> Nominal:
    """Of a body of the motion."""
    R, omega = motion.R[:, body], motion.omega[:, body]
    return Nominal(
        R, motion.p[:, body], motion.v[:, body], cross_matrix(omega) @ R, motion.p2[:, body], motion.R2[:, body],
        omega, motion.alpha[:, body],
    )  # fmt: skip


def link_flow(of: Constants, history: LinkHistory, made: Products, motion: RigidMotion) -> Flow:
    """Of an elastic link."""
    link, u, v, at = of.link, history.u, history.v, nominal(motion, of.body)
    Mv, Mu, F = _mass_moments(of, v), _mass_moments(of, u), of.fit.T @ history.F
    rigid, inertia = _rigid(of, at.v, at.spin, at.omega), _rigid(of, at.a, at.R2, at.alpha)
    ports, on_ports, supports = _ports(of, history, at)
    kinetic = _power(link, 0.5 * rigid + Mv, at) + 0.5 * _dot(v, made.Mv)
    loads = _power(link, F + inertia, at) + _dot(v, history.F) + _work(link, Mv, at.a, at.R2, at.alpha)
    momentum, about = _wrench(link, rigid + Mv, at)
    force, moment = _wrench(link, F + inertia, at)
    swept = _turned(_crossed(link, u, made.Mv) + _swept(link, Mu, at.v, at.spin))
    arms = _turned(_crossed(link, u, history.F) + _swept(link, Mu, at.a, at.R2))
    turning, neglected = np.zeros_like(force), np.zeros(len(u))
    if is_nominal(of, history, motion):
        turning = _rotated(at.R, _turned(_crossed(link, history.g, made.Kg)))
        neglected = _dot(turning, at.omega)
    force = force + ports
    return Flow(
        kinetic, momentum, cross(at.p, momentum) + about + swept, loads, supports,
        force, cross(at.p, force) + moment + arms + on_ports, turning, neglected,
    )  # fmt: skip


def carried_flow(of: Constants, F: Field, motion: RigidMotion) -> Flow:
    """Of a rigid link that the drive carries along; its supports give what its motion asks for, M R0'' − P."""
    at = nominal(motion, of.body)
    rigid, inertia = _rigid(of, at.v, at.spin, at.omega), _rigid(of, at.a, at.R2, at.alpha)
    load = of.fit.T @ F
    momentum, about = _wrench(of.link, rigid, at)
    force, moment = _wrench(of.link, inertia, at)
    none = np.zeros_like(force)
    return Flow(
        _power(of.link, 0.5 * rigid, at), momentum, cross(at.p, momentum) + about, _power(of.link, load + inertia, at),
        -_power(of.link, load, at), force, cross(at.p, force) + moment, none, none[:, 0],
    )  # fmt: skip


def is_nominal(of: Constants, history: LinkHistory, motion: RigidMotion) -> bool:
    """Whether the link's frame is that of the nominal motion, so that K turns with it and not with the bent link."""
    d = of.link.d
    return np.array_equal(history.R, motion.R[:, of.body, :d, :d])


def products(of: Constants, history: LinkHistory) -> Products:
    """M δ', K0 g and C0 g, made here if the solver did not hand them on."""
    if history.products is not None:
        return history.products
    g, alpha, beta = history.g, of.damping.alpha, of.damping.beta
    Kg = np.asarray((of.K0 @ g.reshape(len(g), -1).T).T).reshape(g.shape)
    Cg = None
    if of.damping.present:
        Cg = beta * Kg
        if alpha:
            Cg += alpha * _mass_times(of, g)
    return Products(_mass_times(of, history.v), Kg, Cg)


def _mass_times(of: Constants, u: Field) -> Field:
    """M u over time."""
    out = u.copy()
    for k, m in enumerate(of.masses):
        if m is not None:
            out[:, :, k] = (m @ u[:, :, k].T).T
    return out


def _mass_moments(of: Constants, u: Field) -> Moments:
    """Moments of M u; the third row of a planar beam has a mass of its own."""
    out = of.weighted.T @ u
    if of.link.kind == "beam":
        out[:, 0, 2] = u[:, :, 2] @ of.link.m1[:, 2]
    return np.asarray(out)


def _rigid(of: Constants, a: Vectors, B: Float[np.ndarray, "T 3 3"], turn: Vectors) -> Moments:
    """Moments of M (1 ⊗ a + X Bᵀ)."""
    affine = np.concatenate([a[:, None], B.transpose(0, 2, 1)], axis=1)
    out = np.ascontiguousarray((of.gram @ affine)[:, :, : of.link.d])
    if of.link.kind == "beam":
        out[:, 0, 2] = of.spin * turn[:, 2]
    return out


def _work(link: Link, y: Moments, a: Vectors, B: Float[np.ndarray, "T 3 3"], turn: Vectors) -> Scalars:
    """Σ (1 ⊗ a + X Bᵀ) · y, of nodal forces with these moments."""
    affine = np.concatenate([a[:, None], B.transpose(0, 2, 1)], axis=1)
    work = _dot(in_space(link, y), affine)
    return work + turn[:, 2] * y[:, 0, 2] if link.kind == "beam" else work


def _power(link: Link, y: Moments, at: Nominal) -> Scalars:
    """Of nodal forces with these moments on the nominal motion."""
    return _work(link, y, at.v, at.spin, at.omega)


def _wrench(link: Link, y: Moments, at: Nominal) -> tuple[Vectors, Vectors]:
    """Force, and moment about the body's origin, of nodal forces with these moments on the undeformed link."""
    rows = in_space(link, y)
    moment = _turned(at.R @ rows[:, 1:])
    if link.kind == "beam":
        moment[:, 2] += y[:, 0, 2]
    return rows[:, 0], moment


def _ports(of: Constants, history: LinkHistory, at: Nominal) -> tuple[Vectors, Vectors, Scalars]:
    """Sum of the port forces, their moment about the body's origin where the bent link has its ports, and their power.

    δ' has no share in the power: its ports move together, and Σ Bᵀ R λ = 0.
    """
    link, joint = of.link, of.joint
    force = turned_vectors(joint, history.R, history.port_forces)
    total, moment = _wrench(link, np.concatenate([force.sum(axis=1, keepdims=True), of.stations.T @ force], axis=1), at)
    power = _dot(total, at.v) + _dot(moment, at.omega)
    bent = joint.weights @ history.u[:, joint.nodes]
    return total, moment + _turned(_crossed(link, bent, force)), power


def _crossed(link: Link, x: Field, y: Field) -> Float[np.ndarray, "T 3 3"]:
    """Σ x ⊗ y of translations and forces."""
    c = 2 if link.planar else 3
    out = np.zeros((len(x), 3, 3))
    out[:, :c, :c] = x[..., :c].transpose(0, 2, 1) @ y[..., :c]
    return out


def _swept(link: Link, Mu: Moments, a: Vectors, B: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, "T 3 3"]:
    """Σ u ⊗ M (1 ⊗ a + X Bᵀ) from the moments of M u."""
    affine = np.concatenate([a[:, None], B.transpose(0, 2, 1)], axis=1)
    return np.asarray(in_space(link, Mu).transpose(0, 2, 1) @ affine)


def _turned(N: Float[np.ndarray, "T 3 3"]) -> Vectors:
    """Σ x × y from Σ x ⊗ y."""
    return np.stack([N[:, i, j] - N[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


def _rotated(R: Float[np.ndarray, "T 3 3"], x: Vectors) -> Vectors:
    return np.asarray((R @ x[:, :, None])[:, :, 0])


def _dot(x: Float[np.ndarray, "T ..."], y: Float[np.ndarray, "T ..."]) -> Scalars:
    """Σ x · y at every time point."""
    return np.einsum("tk,tk->t", x.reshape(len(x), -1), y.reshape(len(y), -1))


def _dense(matrix: Matrix, unknowns: int) -> Matrix:
    return matrix.toarray() if unknowns <= DENSE and not isinstance(matrix, np.ndarray) else matrix


def _is_one(m: Matrix) -> bool:
    """Whether a reduced link's mass is 1, as its functions are made."""
    return isinstance(m, np.ndarray) and bool(np.abs(m - np.eye(len(m))).max() < 1e-10)


@dataclass(frozen=True, slots=True)
class Resistance:
    """What damping takes in each of the steps that end at T time points.

    dissipated : (T,) h ġᵀ C0 ġ with ġ = (g1 − g0)/h [J]
    drag : (T,) work of the damping forces against the nominal motion, where these turn with it [J]
    impulse, angular : (T, 3) of the damping forces, about the world's origin [N s, N m s]
    """

    dissipated: Scalars
    drag: Scalars
    impulse: Vectors
    angular: Vectors


@dataclass(frozen=True, slots=True)
class Last:
    """A link at the time point before a block: t, g, C0 g and nominal motion, each with a first dimension of one."""

    t: Scalars
    g: Field
    Cg: Field
    at: Nominal


def resistance(
    of: Constants, history: LinkHistory, made: Products, motion: RigidMotion, before: Last | None
) -> tuple[Resistance, Last] | None:
    """Of one link over a block, from the time point before it on; None without damping."""
    if made.Cg is None:
        return None
    now = Last(motion.t, history.g, made.Cg, nominal(motion, of.body))
    last = _at(now, slice(-1, None))
    since = _at(now, slice(0, 1)) if before is None else before
    g, Cg = _change(now.g, since.g), _change(now.Cg, since.Cg)
    h = np.diff(now.t, prepend=since.t)
    dissipated = _dot(g, Cg) / np.where(h > 0, h, 1.0)
    none = np.zeros((len(h), 3))
    if not is_nominal(of, history, motion):
        return Resistance(dissipated, none[:, 0], none, none), last
    R, p, v, omega = (_mean(getattr(now.at, x), getattr(since.at, x)) for x in ("R", "p", "v", "omega"))
    y = in_space(of.link, of.fit.T @ Cg)
    moment = _turned(y[:, 1:] + _crossed(of.link, history.g - 0.5 * g, Cg))
    if of.link.kind == "beam":
        moment[:, 2] += Cg[:, :, 2] @ of.link.one
    impulse, turn = _rotated(R, y[:, 0]), _rotated(R, moment)
    drag = _dot(impulse, v) + _dot(turn, omega)
    return Resistance(dissipated, drag, impulse, cross(p, impulse) + turn), last


def _at(now: Last, which: slice) -> Last:
    at = Nominal(*(getattr(now.at, each.name)[which] for each in fields(Nominal)))
    return Last(now.t[which], now.g[which].copy(), now.Cg[which].copy(), at)


def _change(now: Float[np.ndarray, "T ..."], before: Float[np.ndarray, "1 ..."]) -> Float[np.ndarray, "T ..."]:
    """In each step."""
    out = np.empty_like(now)
    np.subtract(now[1:], now[:-1], out=out[1:])
    np.subtract(now[0], before[0], out=out[0])
    return out


def _mean(now: Float[np.ndarray, "T ..."], before: Float[np.ndarray, "1 ..."]) -> Float[np.ndarray, "T ..."]:
    """Of the two ends of each step."""
    return np.asarray(now - 0.5 * _change(now, before))
