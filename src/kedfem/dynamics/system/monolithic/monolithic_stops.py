"""Stops in the monolithic solver: those active in a step, and the division of steps at impacts on damped ones.

A step is first solved without such a stop. At the time at which the cubic through its coordinate and rate at both ends
passes the limit, the accelerations change by −c e', with the matrix of the second part of the step:

    A x = c_M Wᵀ λ,   W x = B z,   Bᵀ λ = Cᵀ m,   C z = 0 of constraints,   m = −c e' of stops that are met

with A = c_M M + c_K K0, rotated with the links.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import CubicHermiteSpline

from kedfem.arrays import Float
from kedfem.dynamics.frames import mean_orientation
from kedfem.dynamics.system.monolithic.monolithic_tangent import assembled, inverse, rotated_stiffness
from kedfem.dynamics.system.record import Stop, System
from kedfem.motion.rigid import RigidMotion

if TYPE_CHECKING:
    from kedfem.dynamics.system.monolithic.monolithic import Monolithic, Now

NEAR = 1e-2  # of a step: a stop that is met so near to its beginning or end is met there, as in `impacts`
HALVINGS = 6  # parts of parts of a step, as in `march`
Motion = Callable[[Float[np.ndarray, " T"]], RigidMotion]
"""Rigid-body motion at given times."""


def sides(of: System, old: Now, apart: bool) -> list[int | None]:
    """Of all laws which stop pushes in a step: the upper (1), the lower (−1), where it is passed (0), or neither."""

    def waits(law: object, e: float) -> bool:
        return apart and isinstance(law, Stop) and law.damping > 0 and law.lower <= e <= law.upper

    pushes = -np.sign(old.multiplier).astype(int)
    every = zip(of.constraints, old.e[0], pushes, strict=True)
    return [None if not side and waits(each.law, e) else int(side) for each, e, side in every]


def in_parts(of: Monolithic, old: Now, at: RigidMotion, between: Motion | None, halvings: int) -> Now:
    """One step, divided where stops with damping are met; see `Monolithic.step`."""
    h, end = of.scheme.h, at.t
    if between is None:
        return of.undivided(old, at)
    if old.met.any():
        old = _pushed(of, old, between(end - h))
    found = of.undivided(old, at, apart=halvings > 0)
    shares = _shares(of, old, found, at)
    first, met = shares.min(initial=np.inf), shares <= shares.min(initial=np.inf) + NEAR
    if not np.isfinite(first):
        return found
    if first >= 1 - NEAR:
        return replace(found, met=met)
    if first > NEAR:
        old = _shortened(of, first * h).undivided(old, between(end - (1 - first) * h), apart=True)
        of = _shortened(of, (1 - first) * h)
    return of.step(replace(old, met=met), at, between, halvings - 1)


def _shortened(of: Monolithic, h: float) -> Monolithic:
    return replace(of, scheme=replace(of.scheme, h=h), kept=None)


def _shares(of: Monolithic, old: Now, found: Now, at: RigidMotion) -> Float[np.ndarray, " r"]:
    """After which share of a step each stop that waits is met."""
    out, e = np.full(len(of.sides), np.inf), np.stack([old.e[0], found.e[0]])
    for n in [n for n, side in enumerate(of.sides) if side is None]:
        law = cast("Stop", of.system.constraints[n].law)
        limit = float(np.clip(e[1, n], law.lower, law.upper))
        if limit != e[1, n]:
            rates = of.scheme.h * np.array([old.e[1, n], of.own_rates(found, found.z_rates[1], at)[n]])
            out[n] = CubicHermiteSpline([0, 1], e[:, n] - limit, rates).roots(extrapolate=False).min(initial=1.0)
    return out


def _pushed(of: Monolithic, now: Now, at: RigidMotion) -> Now:
    """The same time with accelerations and forces as stops that are met begin to push."""
    s, damping, hard = of.scheme, of.system.model.damping, of.hard
    c = [getattr(each.law, "damping", 0.0) for each in of.system.constraints]
    m = np.where(now.met, -np.array(c) * of.own_rates(now, now.z_rates[1], at), 0.0)
    C = of.coordinates(now.z, now.term_angles.copy(), at)[1]
    c_M = (1 - s.alpha_m) * s.a0 + (1 - s.alpha_f) * s.a1 * damping.alpha
    c_K = (1 - s.alpha_f) * (1 + s.a1 * damping.beta)
    A = sp.csr_array(c_M * of.M + c_K * sp.block_diag([_stiffness(of, k, now, at) for k in range(len(of.of))]))
    equations = assembled(of, A, np.zeros((of.k, of.k)), C[hard])
    right = np.concatenate([np.zeros(of.N + of.W.shape[0]), C.T @ m, np.zeros(len(hard))])
    x, z, lam, more = np.split(inverse(equations, C[hard])(right), np.cumsum([of.N, of.k, of.W.shape[0]]))
    x, z = c_M * x, c_M * z
    m[hard] = more
    e, z_rates = now.e.copy(), now.z_rates.copy()
    e[2] += C @ z
    z_rates[2] += z
    return replace(
        now, a=now.a + x, f=now.f + of.W.T @ lam - of.M @ x, e=e, z_rates=z_rates, multiplier=now.multiplier + m,
        bearing=now.bearing + C.T @ m, port_force=now.port_force + lam, met=np.zeros(len(m), bool),
    )  # fmt: skip


def _stiffness(of: Monolithic, k: int, now: Now, at: RigidMotion) -> sp.csr_array:
    """K0 of body k, turned as it is on the whole."""
    model = of.system.model
    link = model.links[k]
    R = at.R[0, model.bodies[k], : link.d, : link.d]
    turned = R if link.fit is None else mean_orientation(link, now.u[of.of[k]].reshape(link.n, link.d), R)
    return rotated_stiffness(link.K0, turned)
