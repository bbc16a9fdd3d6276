"""The energy that damping dissipates, and the work of damping forces on the rigid-body motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import LinkHistory, Products
from kedfem.results.forces.moments import (
    Constants,
    Field,
    RigidRates,
    crossed,
    dot,
    flat_times,
    mass_times,
    rotated,
    turned,
)

Scalars = Float[np.ndarray, " T"]


@dataclass(frozen=True, slots=True)
class PreviousPoint:
    """The time point before a block, T = 1: t, rigid-body motion, and of each link g, K0 g, C0 g and its deflection.

    links : its deflection is that of `rigid_frame_deflection`
    """

    t: Scalars
    at: RigidRates
    links: Sequence[tuple[Field, Field, Field | None, Field | None]]


def damping_work(
    of: Sequence[Constants], histories: Sequence[LinkHistory], made: Sequence[Products], turns: Sequence[bool],
    now: tuple[Scalars, RigidRates], before: PreviousPoint,
) -> tuple[Scalars, Scalars]:  # fmt: skip
    """Work of damped links over a block, from the previous time point on.

    Parameters
    ----------
    turns : whether K, and so the damping forces, turn with the rigid-body motion
    now : times, and rigid-body motion of all bodies

    Returns
    -------
    dissipated, drag : (T,) each, in the steps that end there: energy that damping dissipates, h ġᵀ C0 ġ with
        ġ = (g1 − g0)/h; work of damping forces against the rigid-body motion, where they rotate with it [J]
    """
    t, at = now
    h = np.diff(t, prepend=before.t)
    seen = [rigid_frame_deflection(x, history, at) for x, history in zip(of, histories, strict=True)]
    which = np.flatnonzero([turn or u is not None for turn, u in zip(turns, seen, strict=True)])
    bodies = np.array([x.body for x in of])[which]
    taken = np.zeros(len(t))
    k, size = of[0].k, (len(which), len(t))
    rows, arms = np.empty((of[0].fit.m, *size)), np.empty((2 * k - 3, *size))
    for i, (x, history, product, last) in enumerate(zip(of, histories, made, before.links, strict=True)):
        end, (g, Cg) = history.g, _changes(x, history.g, product, *last[:3])
        taken += dot(g, Cg)
        u = seen[i]
        if u is not None and last[3] is not None:
            end, g = u, _change(u, last[3])
            Cg = x.damping.alpha * mass_times(x, g)
            taken += dot(g, Cg)
        if i in which:
            slot = int(np.searchsorted(which, i))
            x.fit.of(Cg, rows[:, slot])
            arms[:, slot] = crossed(k, end, Cg) - 0.5 * crossed(k, g, Cg)
    taken /= np.where(h > 0, h, 1.0)
    if not len(which):
        return taken, np.zeros(len(t))
    return taken, _drag(rows, arms, _mean(at.of(bodies, k), before.at.of(bodies, k)))


def _drag(rows: Float[np.ndarray, "m S T"], arms: Float[np.ndarray, "c S T"], at: RigidRates) -> Scalars:
    """Drag of damping forces that rotate with the rigid-body motion."""
    y = rows[:-1].reshape(at.rates.shape[1:])
    moment = turned(y[1:]) + arms
    moment[-1] += rows[-1]
    impulse, turn = np.einsum("ijst,jst->ist", at.R, y[0]), rotated(at, moment)
    both = (impulse, at.rates[0, 0]), (turn, at.omega)
    return np.asarray(sum(np.einsum("ist,ist->t", x, y) for x, y in both))


def rigid_frame_deflection(of: Constants, history: LinkHistory, at: RigidRates) -> Field | None:
    """Of a link with co-rotational frames, the deflection in the rigid-body frame, where α acts; None without."""
    if of.link.fit is None or not of.damping.alpha:
        return None
    d = of.link.d
    return np.asarray(history.u @ at.R[:d, :d, of.body].transpose(2, 0, 1))


def previous_of(
    t: Scalars, at: RigidRates, of: Sequence[Constants], histories: Sequence[LinkHistory], made: Sequence[Products],
    which: int,
) -> PreviousPoint:  # fmt: skip
    """The data of one time point that the next block needs."""
    first = which % len(t)
    one = slice(first, first + 1)
    then = at.every(one)
    kept = []
    for link, x, y in zip(of, histories, made, strict=True):
        Cg = None if y.Cg is None else y.Cg[one].copy()
        kept.append((x.g[one].copy(), y.Kg[one].copy(), Cg, rigid_frame_deflection(link, x.every(one), then)))
    return PreviousPoint(t[one], then, kept)


def products(of: Constants, history: LinkHistory, turns: bool) -> Products:
    """M δ', and K0 g if K turns with the rigid-body motion, made here if the solver did not hand them on."""
    if history.products is not None:
        return history.products
    Kg = flat_times(of.K0, history.g) if turns else np.zeros((len(history.g), 0, 0))
    return Products(mass_times(of, history.v), Kg, None)


def _changes(
    of: Constants, now: Field, made: Products, before: Field, Kg: Field, last: Field | None
) -> tuple[Field, Field]:
    """Changes of g and C0 g in each step; with co-rotational frames without α, see `rigid_frame_deflection`."""
    g = _change(now, before)
    if made.Cg is not None and last is not None:
        return g, _change(made.Cg, last)
    Cg = _change(made.Kg, Kg) if made.Kg.size else flat_times(of.K0, g)
    Cg *= of.damping.beta
    if of.damping.alpha and of.link.fit is None:
        Cg += of.damping.alpha * mass_times(of, g)
    return g, Cg


def _change(now: Float[np.ndarray, "T ..."], before: Float[np.ndarray, "1 ..."]) -> Float[np.ndarray, "T ..."]:
    """In each step."""
    out = np.empty_like(now)
    np.subtract(now[1:], now[:-1], out=out[1:])
    np.subtract(now[0], before[0], out=out[0])
    return out


def _mean(now: RigidRates, before: RigidRates) -> RigidRates:
    """Of the two ends of each step."""
    pairs = ((getattr(now, x), getattr(before, x)) for x in ("R", "rates", "omega", "alpha"))
    return RigidRates(*(0.5 * (x + np.concatenate([y, x[..., :-1]], axis=-1)) for x, y in pairs))
