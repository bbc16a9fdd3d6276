"""Energy and power of links, by the general equation, [KED, eq. (20)].

The absolute motion is R' = R0 + δ, its rate R0' + δ' with R0' = 1 ⊗ p' + X R'ᵀ.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import LinkHistory, Products
from kedfem.dynamics.joints.ports import rotated_vectors
from kedfem.dynamics.stiffening import StressModes
from kedfem.results.forces.moments import Constants, Field, RigidRates, crossed, dot, rotated

Scalars = Float[np.ndarray, " T"]


@dataclass(frozen=True, slots=True)
class Flow:
    """Energy and power of one or several links at T time points.

    kinetic : (T,) energy of the absolute motion [J]
    loads, supports : (T,) power of P and of the port forces [W]; that of joints between links cancels in the sum, but
        for what directions that vary in time do on the elastic motion
    neglected : (T,) power on the rigid-body rotation of Σ δ × K δ, the moment that K's forces have on the bent link, as
        K turns with the rigid-body frame [W]
    constraint_joints : (T,) power of port forces of joints enforced by constraint equations, on the elastic motion [W]
    mass_damping : (T,) power dissipated by mass-proportional damping, α δ' · M δ' [W]
    """

    kinetic: Scalars
    loads: Scalars
    supports: Scalars
    neglected: Scalars
    constraint_joints: Scalars
    mass_damping: Scalars

    def __add__(self, other: "Flow") -> "Flow":
        """The sum of both."""
        return Flow(*(getattr(self, each.name) + getattr(other, each.name) for each in fields(self)))


def stress(
    of: Sequence[Constants],
    histories: Sequence[LinkHistory],
    made: Sequence[tuple[StressModes, Float[np.ndarray, "T m"]]],
    at: RigidRates,
) -> Float[np.ndarray, "2 T"]:
    """Geometric stiffening of links that are all planar or all in space, all together.

    Parameters
    ----------
    made : stress modes of each link, and their factors over time
    at : rigid-body motion of their bodies

    Returns
    -------
    Power of its forces R (k g P) against the absolute motion R0' + δ' [W]; its energy ½ Σ g · k g P [J]
    """
    S, T = len(of), len(histories[0].u)
    rows, power, stored = np.empty((of[0].fit.m, S, T)), np.zeros((S, T)), np.zeros(T)
    for i, (x, history, (modes, factors)) in enumerate(zip(of, histories, made, strict=True)):
        f = np.stack([modes.force(s)(g) for s, g in zip(factors, history.g, strict=True)])
        stored += 0.5 * dot(history.g, f)
        f = f @ history.R.transpose(0, 2, 1)
        x.fit.of(f, rows[:, i])
        power[i] = dot(history.v, f)
    power += _work(rows[:-1].reshape(at.rates.shape[1:]), at.rates[0]) + rows[-1] * at.omega[-1]
    return np.stack([power.sum(axis=0), stored])


@dataclass(frozen=True, slots=True)
class Fields:
    """Moments of the nodal fields of S links at T time points, time last, in k dimensions.

    rows : (3, (1 + k) k + 1, S, T) moments and couple of M δ', P − M R0'' and port forces
    elastic : (c, S, T) Σ g × K0 g, link frame, in a plane the one component across it;
        None if K turns with no link's rigid-body motion
    powers : (3, S, T) δ' · M δ', δ' · (P − M R0'') and, where joints are enforced by constraint equations, δ' · port
        forces
    """

    rows: Float[np.ndarray, "3 m S T"]
    elastic: Float[np.ndarray, "c S T"] | None
    powers: Float[np.ndarray, "3 S T"]


def fields_of(
    of: Sequence[Constants], histories: Sequence[LinkHistory], made: Sequence[Products], turns: Sequence[bool],
    rows_work: bool = False,
) -> Fields:  # fmt: skip
    """Fields of elastic links, all planar or all in space.

    Parameters
    ----------
    made : K0 g where K turns with the rigid-body motion, as `turns` says
    rows_work : whether joints are enforced by constraint equations, whose forces do work on the elastic motion
    """
    S, T, k = len(of), len(histories[0].u), of[0].k
    rows, powers = np.empty((3, of[0].fit.m, S, T)), np.zeros((3, S, T))
    elastic = np.zeros((2 * k - 3, S, T)) if any(turns) else None
    for i, (x, history, product) in enumerate(zip(of, histories, made, strict=True)):
        v, F = history.v, history.F
        f = rotated_vectors(x.joint, history.R, history.port_forces)
        for slot, (A, y) in enumerate(((x.weighted, v), (x.fit, F), (x.ports, f))):
            A.of(y, rows[slot, :, i])
        if elastic is not None and turns[i]:
            elastic[:, i] = crossed(k, history.g, product.Kg)
        powers[0, i], powers[1, i] = dot(v, product.Mv), dot(v, F)
        if rows_work:
            there = v if len(x.joint.nodes) == x.link.n else v[:, x.joint.nodes]
            powers[2, i] = dot(x.joint.weights @ there, f)
    return Fields(rows, elastic, powers)


def prescribed_fields(of: Sequence[Constants], forces: Sequence[Field]) -> Fields:
    """Fields of rigid links that the drive prescribes; their supports exert the force of their motion, M R0'' − P."""
    S, T = len(of), len(forces[0])
    rows = np.zeros((3, of[0].fit.m, S, T))
    for i, (x, F) in enumerate(zip(of, forces, strict=True)):
        x.fit.of(F, rows[1, :, i])
    rows[2] = -rows[1]
    return Fields(rows, None, np.zeros((3, S, T)))


def flow(of: Sequence[Constants], found: Fields, at: RigidRates) -> Flow:
    """Energy and power of all links, from their fields and their rigid-body motion."""
    gram, spin = np.stack([x.gram for x in of], axis=-1), np.array([x.spin for x in of])
    Mv, F, ports = found.rows[:, :-1].reshape(3, *at.rates.shape[1:])
    couples, turns = found.rows[:, -1], np.stack([at.omega[-1], at.alpha[-1]])
    # M (R0' + δ') and P = (P − M R0'') + M R0''
    y = np.einsum("abs,zbjst->zajst", gram, at.rates)
    y[0] += Mv
    y[1] += F
    couple = couples[:2] + spin[:, None] * turns
    kinetic = 0.5 * (_work(y[0] + Mv, at.rates[0]) + (couple[0] + couples[0]) * turns[0] + found.powers[0])
    loads = _work(y[1], at.rates[0]) + couple[1] * turns[0] + found.powers[1]
    loads += _work(Mv, at.rates[1]) + couples[0] * turns[1]
    supports = _work(ports, at.rates[0]) + couples[2] * turns[0] + found.powers[2]
    return Flow(
        kinetic.sum(axis=0), loads.sum(axis=0), supports.sum(axis=0), _neglected(found, at),
        found.powers[2].sum(axis=0), np.array([x.damping.alpha for x in of]) @ found.powers[0],
    )  # fmt: skip


def _neglected(found: Fields, at: RigidRates) -> Scalars:
    """Power of the moment of the elastic forces on bent links."""
    if found.elastic is None:
        return np.zeros(found.powers.shape[2])
    return np.asarray(np.einsum("ist,ist->t", rotated(at, found.elastic), at.omega))


def _work(y: Float[np.ndarray, "k1 k S T"], rates: Float[np.ndarray, "k1 k S T"]) -> Float[np.ndarray, "S T"]:
    """Σ (1 ⊗ a + X Bᵀ) · y of nodal forces with these moments."""
    return np.asarray(np.einsum("ajst,ajst->st", y, rates))


@dataclass(frozen=True, slots=True)
class Balance:
    """The largest residual of the energy account, relative to the largest energy exchanged.

    energy : of the integration [-]
    neglected : energy exchanged by the neglected rotation of K [-]
    mass_damping : energy dissipated by mass-proportional damping [-]
    """

    energy: float = 0.0
    neglected: float = 0.0
    mass_damping: float = 0.0


def balance_notes(found: Balance) -> dict[str, float]:
    """The balance as notes of a results file, as parts of one."""
    return {"residual of energy": found.energy, "neglected energy": found.neglected}
