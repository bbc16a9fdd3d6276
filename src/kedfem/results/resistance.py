"""What damping takes: of energy, and where its forces turn with the nominal motion, of momentum."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.history import LinkHistory, Products
from kedfem.links.record import in_space
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
    nominal,
    rotated,
    turned,
)


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
    """A link at the time point before a block: t, nominal motion, (g, C0 g) of each part of the damping; T is 1."""

    t: Scalars
    at: Nominal
    parts: tuple[tuple[Field, Field], ...]


def resistance(
    of: Constants, history: LinkHistory, made: Products, motion: RigidMotion, before: Last | None
) -> tuple[Resistance, Last] | None:
    """Of one link over a block, from the time point before it on; None without damping.

    In a frame that follows β acts on its own deformation, α on that of the nominal frame.
    """
    if made.Cg is None:
        return None
    at = nominal(motion, of.body)
    now = Last(motion.t, at, _apart(of, history, made, at))
    last = _at(now, slice(-1, None))
    since = _at(now, slice(0, 1)) if before is None else before
    h = np.diff(now.t, prepend=since.t)
    total = np.zeros((len(h), 8))
    for k, (end, start) in enumerate(zip(now.parts, since.parts, strict=True)):
        total[:, 0] += dot(_change(end[0], start[0]), _change(end[1], start[1])) / np.where(h > 0, h, 1.0)
        if k == 1:
            total[:, 1:] += _turning(of, end, start, at, since.at)
    return Resistance(total[:, 0], total[:, 1], total[:, 2:5], total[:, 5:]), last


def _apart(
    of: Constants, history: LinkHistory, made: Products, at: Nominal
) -> tuple[tuple[Field, Field], tuple[Field, Field]]:
    """(g, C g) of β K0 in the link's own frame and of α M in the nominal one, where that is not all the same."""
    if of.link.fit is None and made.Cg is not None:
        none = np.zeros_like(history.g)
        return (none, none), (history.g, made.Cg)
    u = history.u @ at.R[:, : of.link.d, : of.link.d]
    return (history.g, of.damping.beta * made.Kg), (u, of.damping.alpha * _mass_times(of, u))


def _turning(
    of: Constants, end: tuple[Field, Field], start: tuple[Field, Field], at: Nominal, before: Nominal
) -> Float[np.ndarray, "T 7"]:
    """Drag, impulse and angular impulse of damping forces that turn with the nominal motion."""
    g, Cg = _change(end[0], start[0]), _change(end[1], start[1])
    R, p, v, omega = (_mean(getattr(at, x), getattr(before, x)) for x in ("R", "p", "v", "omega"))
    y = in_space(of.link, of.fit.T @ Cg)
    moment = turned(y[:, 1:]) + crossed(of.link, end[0] - 0.5 * g, Cg)
    if of.link.kind == "beam":
        moment[:, 2] += Cg[:, :, 2] @ of.link.one
    impulse, turn = rotated(R, y[:, 0]), rotated(R, moment)
    drag = dot(impulse, v) + dot(turn, omega)
    return np.column_stack([drag, impulse, cross(p, impulse) + turn])


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
    if not any(m is not None for m in of.masses):
        return u
    out = u.copy()
    for k, m in enumerate(of.masses):
        if m is not None:
            out[:, :, k] = (m @ u[:, :, k].T).T
    return out


def _at(now: Last, which: slice) -> Last:
    at = Nominal(*(getattr(now.at, each.name)[which] for each in fields(Nominal)))
    return Last(now.t[which], at, tuple((g[which].copy(), Cg[which].copy()) for g, Cg in now.parts))


def _change(
    now: Float[np.ndarray, "T ..."], before: Float[np.ndarray, "1 ..."]
) -> Float[np.ndarray, "T ..."]:
    """In each step."""
    out = np.empty_like(now)
    np.subtract(now[1:], now[:-1], out=out[1:])
    np.subtract(now[0], before[0], out=out[0])
    return out


def _mean(now: Float[np.ndarray, "T ..."], before: Float[np.ndarray, "1 ..."]) -> Float[np.ndarray, "T ..."]:
    """Of the two ends of each step."""
    return np.asarray(now - 0.5 * _change(now, before))
