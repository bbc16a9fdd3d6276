"""Energy, momentum and power of one link, seen from the general equation, [KED, eq. (20)].

The absolute motion is R' = R0 + δ, its rate R0' + δ' with R0' = 1 ⊗ p' + X R'ᵀ.
"""

from dataclasses import dataclass, fields

import numpy as np

from kedfem.dynamics.history import LinkHistory, Products
from kedfem.dynamics.ports import turned_vectors
from kedfem.motion.rigid import RigidMotion
from kedfem.motion.rows import cross
from kedfem.results.moments import (
    Constants,
    Field,
    Nominal,
    Scalars,
    Vectors,
    crossed,
    dot,
    is_nominal,
    mass_moments,
    nominal,
    power,
    rigid_moments,
    rotated,
    swept,
    work_on,
    wrench,
)


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


def link_flow(of: Constants, history: LinkHistory, made: Products, motion: RigidMotion) -> Flow:
    """Of an elastic link."""
    link, u, v, at = of.link, history.u, history.v, nominal(motion, of.body)
    Mv, Mu, F = mass_moments(of, v), mass_moments(of, u), of.fit.T @ history.F
    rigid, inertia = rigid_moments(of, at.v, at.spin, at.omega), rigid_moments(of, at.a, at.R2, at.alpha)
    ports, on_ports, supports = _ports(of, history, at)
    kinetic = power(link, 0.5 * rigid + Mv, at) + 0.5 * dot(v, made.Mv)
    loads = power(link, F + inertia, at) + dot(v, history.F) + work_on(link, Mv, at.a, at.R2, at.alpha)
    momentum, about = wrench(link, rigid + Mv, at)
    force, moment = wrench(link, F + inertia, at)
    bent = crossed(link, u, made.Mv) + swept(link, Mu, at.v, at.spin)
    arms = crossed(link, u, history.F) + swept(link, Mu, at.a, at.R2)
    turning, neglected = np.zeros_like(force), np.zeros(len(u))
    if is_nominal(of, history, motion):
        turning = rotated(at.R, crossed(link, history.g, made.Kg))
        neglected = dot(turning, at.omega)
    force = force + ports
    return Flow(
        kinetic, momentum, cross(at.p, momentum) + about + bent, loads, supports,
        force, cross(at.p, force) + moment + arms + on_ports, turning, neglected,
    )  # fmt: skip


def carried_flow(of: Constants, F: Field, motion: RigidMotion) -> Flow:
    """Of a rigid link that the drive carries along; its supports give what its motion asks for, M R0'' − P."""
    at = nominal(motion, of.body)
    rigid, inertia = rigid_moments(of, at.v, at.spin, at.omega), rigid_moments(of, at.a, at.R2, at.alpha)
    load = of.fit.T @ F
    momentum, about = wrench(of.link, rigid, at)
    force, moment = wrench(of.link, inertia, at)
    none = np.zeros_like(force)
    return Flow(
        power(of.link, 0.5 * rigid, at), momentum, cross(at.p, momentum) + about, power(of.link, load + inertia, at),
        -power(of.link, load, at), force, cross(at.p, force) + moment, none, none[:, 0],
    )  # fmt: skip


def _ports(of: Constants, history: LinkHistory, at: Nominal) -> tuple[Vectors, Vectors, Scalars]:
    """Sum of the port forces, their moment about the body's origin where the bent link has its ports, and their power.

    δ' has no share in the power: its ports move together, and Σ Bᵀ R λ = 0.
    """
    link, joint = of.link, of.joint
    force = turned_vectors(joint, history.R, history.port_forces)
    total, moment = wrench(
        link, np.concatenate([force.sum(axis=1, keepdims=True), of.stations.T @ force], axis=1), at
    )
    power = dot(total, at.v) + dot(moment, at.omega)
    bent = joint.weights @ (history.u if len(joint.nodes) == link.n else history.u[:, joint.nodes])
    return total, moment + crossed(link, bent, force), power
