"""Energy, momentum and power of links, seen from the general equation, [KED, eq. (20)].

The absolute motion is R' = R0 + δ, its rate R0' + δ' with R0' = 1 ⊗ p' + X R'ᵀ.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.history import LinkHistory, Products
from kedfem.dynamics.joints.ports import turned_vectors
from kedfem.results.forces.moments import Constants, Field, RigidRates, dot, in_world, paired, rotated, turned

Scalars = Float[np.ndarray, " T"]
Vectors = Float[np.ndarray, "3 T"]


@dataclass(frozen=True, slots=True)
class Flow:
    """Of one or several links at T time points; world components, moments about the world's origin.

    kinetic : (T,) energy of the absolute motion [J]
    momentum, angular : (3, T) [N s, N m s]; sizes: (3, T) their lengths, added up over links, and that of the larger of P
        and the port forces
    loads, supports : (T,) power of P and of the port forces [W]; that of joints between links cancels in the sum, but
        for what directions that vary in time do on the elastic motion
    force, moment : (3, T) of P and the port forces together [N, N m]
    turning : (3, T) Σ δ × K δ: moment that K's forces have on the bent link, as K turns with the rigid-body frame [N m]
    neglected : (T,) its power on the rigid-body rotation [W]
    led : (T,) power of the port forces on the elastic motion, where joints are enforced by constraint equations [W]
    """

    kinetic: Scalars
    momentum: Vectors
    angular: Vectors
    sizes: Float[np.ndarray, "3 T"]
    loads: Scalars
    supports: Scalars
    force: Vectors
    moment: Vectors
    turning: Vectors
    neglected: Scalars
    led: Scalars

    def __add__(self, other: "Flow") -> "Flow":
        """Both together."""
        return Flow(*(getattr(self, each.name) + getattr(other, each.name) for each in fields(self)))


@dataclass(frozen=True, slots=True)
class Fields:
    """Nodal fields of S links at T time points, as far as they matter, time last, in k dimensions.

    rows : (4, (1 + k) k + 1, S, T) moments and couple of M δ', P − M R0'', port forces and M δ
    arms : (2, k, k, S, T) Σ δ ⊗ M δ', and Σ δ ⊗ y of P − M R0'' and the port forces
    elastic : (k, k, S, T) Σ g ⊗ K0 g, link frame; None if K turns with no link's rigid-body motion
    powers : (3, S, T) δ' · M δ', δ' · (P − M R0'') and, where joints are enforced by constraint equations, δ' · port
    forces"""

    rows: Float[np.ndarray, "4 m S T"]
    arms: Float[np.ndarray, "2 k k S T"]
    elastic: Float[np.ndarray, "k k S T"] | None
    powers: Float[np.ndarray, "3 S T"]


def fields_of(
    of: Sequence[Constants], histories: Sequence[LinkHistory], made: Sequence[Products], turns: Sequence[bool],
    rows_work: bool = False,
) -> Fields:  # fmt: skip
    """Of elastic links, all planar or all in space.

    Parameters
    ----------
    made : K0 g where K turns with the rigid-body motion, as `turns` says
    rows_work : whether joints are enforced by constraint equations, whose forces do work on the elastic motion
    """
    S, T, k = len(of), len(histories[0].u), of[0].k
    rows, arms = np.empty((4, len(of[0].fit), S, T)), np.empty((2, k, k, S, T))
    powers, elastic = np.zeros((3, S, T)), np.zeros((k, k, S, T)) if any(turns) else None
    for i, (x, history, product) in enumerate(zip(of, histories, made, strict=True)):
        u, v, F = history.u, history.v, history.F
        f = turned_vectors(x.joint, history.R, history.port_forces)
        bent = x.joint.weights @ (u if len(x.joint.nodes) == x.link.n else u[:, x.joint.nodes])
        for slot, (A, y) in enumerate(((x.weighted, v), (x.fit, F), (x.ports, f), (x.weighted, u))):
            np.matmul(A, y.reshape(T, -1).T, out=rows[slot, :, i])
        arms[0, :, :, i] = paired(k, u, product.Mv)
        arms[1, :, :, i] = paired(k, u, F) + paired(k, bent, f)
        if elastic is not None and turns[i]:
            elastic[:, :, i] = paired(k, history.g, product.Kg)
        powers[0, i], powers[1, i] = dot(v, product.Mv), dot(v, F)
        if rows_work:
            powers[2, i] = dot(
                x.joint.weights @ (v if len(x.joint.nodes) == x.link.n else v[:, x.joint.nodes]), f
            )
    return Fields(rows, arms, elastic, powers)


def prescribed_fields(of: Sequence[Constants], forces: Sequence[Field]) -> Fields:
    """Of rigid links that the drive carries along; their supports give what their motion asks for, M R0'' − P."""
    S, T, k = len(of), len(forces[0]), of[0].k
    rows = np.zeros((4, len(of[0].fit), S, T))
    for i, (x, F) in enumerate(zip(of, forces, strict=True)):
        rows[1, :, i] = x.fit @ F.reshape(T, -1).T
    rows[2] = -rows[1]
    return Fields(rows, np.zeros((2, k, k, S, T)), None, np.zeros((3, S, T)))


def flow(of: Sequence[Constants], found: Fields, at: RigidRates) -> Flow:
    """All links together, from their fields and their rigid-body motion."""
    gram, spin = np.stack([x.gram for x in of], axis=-1), np.array([x.spin for x in of])
    Mv, F, ports, Mu = found.rows[:, :-1].reshape(4, *at.rates.shape[1:])
    couples, turns = found.rows[:3, -1], np.stack([at.omega[-1], at.alpha[-1]])
    # M (R0' + δ') and P = (P − M R0'') + M R0''
    y = np.einsum("abs,zbjst->zajst", gram, at.rates)
    y[0] += Mv
    y[1] += F
    couple = couples[:2] + spin[:, None] * turns
    kinetic = 0.5 * (_work(y[0] + Mv, at.rates[0]) + (couple[0] + couples[0]) * turns[0] + found.powers[0])
    loads = _work(y[1], at.rates[0]) + couple[1] * turns[0] + found.powers[1]
    loads += _work(Mv, at.rates[1]) + couples[0] * turns[1]
    supports = _work(ports, at.rates[0]) + couples[2] * turns[0] + found.powers[2]
    pushed = np.maximum(_lengths(y[1, 0]), _lengths(ports[0]))
    y[1] += ports
    # Σ x ⊗ y with x = p + R X + δ
    N = np.einsum("iast,zajst->zijst", at.place, y)
    N += np.einsum("aist,zajst->zijst", Mu, at.rates)
    N += found.arms
    about = turned(N)
    about[0, -1] += couple[0]
    about[1, -1] += couple[1] + couples[2]
    sizes = np.stack([_lengths(y[0, 0]), _lengths(about[0]), pushed]).sum(axis=1)
    return Flow(
        kinetic.sum(axis=0), in_world(y[0, 0]), in_world(about[0]), sizes, loads.sum(axis=0), supports.sum(axis=0),
        in_world(y[1, 0]), in_world(about[1]), *_neglected(found, at), found.powers[2].sum(axis=0),
    )  # fmt: skip


def _lengths(x: Float[np.ndarray, "k S T"]) -> Float[np.ndarray, "S T"]:
    return np.asarray(np.sqrt(np.einsum("ist,ist->st", x, x)))


def _neglected(found: Fields, at: RigidRates) -> tuple[Vectors, Scalars]:
    """Moment of the elastic forces on bent links, and its power."""
    if found.elastic is None:
        T = found.powers.shape[2]
        return np.zeros((3, T)), np.zeros(T)
    turning = rotated(at, turned(found.elastic))
    return in_world(turning), np.einsum("ist,ist->t", turning, at.omega)


def _work(y: Float[np.ndarray, "k1 k S T"], rates: Float[np.ndarray, "k1 k S T"]) -> Float[np.ndarray, "S T"]:
    """Σ (1 ⊗ a + X Bᵀ) · y of nodal forces with these moments."""
    return np.asarray(np.einsum("ajst,ajst->st", y, rates))


@dataclass(frozen=True, slots=True)
class Balance:
    """The residual at worst, of the largest energy or momentum that is exchanged.

    Momentum is judged by that of all links or by what forces pass on in time, whichever is more: a lift that hardly moves
    passes on its weight. Angular momentum is judged by the linear at the linkage's size at least, for it may vanish.

    energy : of the integration [-]
    neglected : energy that the neglected turning of K exchanges [-]
    linear, angular : of the integration's momentum, about the world's origin [-]
    turned : angular momentum that K's neglected turning brings in [-]
    """

    energy: float = 0.0
    neglected: float = 0.0
    linear: float = 0.0
    angular: float = 0.0
    turned: float = 0.0


def balance_notes(found: Balance) -> dict[str, float]:
    """The balance as notes of a results file, all as parts of one."""
    return {
        "residual of energy": found.energy,
        "residual of momentum": found.linear,
        "residual of angular momentum": found.angular,
        "neglected energy": found.neglected,
        "neglected angular momentum": found.turned,
    }
