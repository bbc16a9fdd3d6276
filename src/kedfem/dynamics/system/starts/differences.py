"""Deflections at instants close after each other: their rates by differences of fourth order, and how smooth they are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.starts.initial_states import as_coordinates
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import own, rotated_rate, rows
from kedfem.motion.newton import cross_matrix

LATER = np.array([
    [-25, 48, -36, 16, -3], [-3, -10, 18, -6, 1], [1, -8, 0, 8, -1], [-1, 6, -18, 10, 3], [3, -16, 36, -48, 25],
]) / 12  # rates at five instants, of fourth order  # fmt: skip
AHEAD = {1: [1], 2: [-1, 2], 3: [1, -3, 3], 4: [-1, 4, -6, 4]}  # the next of values at equal steps
THIRD, FOURTH = np.array([[-1, 3, -3, 1, 0], [1, -4, 6, -4, 1]])  # third and fourth differences


@dataclass(frozen=True, slots=True)
class MovingDeflection:
    """A deflection u with its rate v, (N,) world components.

    strained : the rate by differences in rigid-body frames, for damping, as the error of v strains a stiff link"""

    u: Flat
    v: Flat
    strained: Flat


def with_links(first: Instant, now: Instant, pull: Flat) -> Flat:
    """Forces or deflections as they are at a first instant, at another that links have turned to."""
    out = np.empty_like(pull)
    for k, link in enumerate(now.of.system.model.links):
        here, turn = own(now.of, k), (now.R[k] @ first.R[k].T)[: link.d, : link.d]
        out[here] = (turn @ pull[here].reshape(link.d, -1)).ravel()
    return out


def moved(
    instants: Sequence[Instant], u: Float[np.ndarray, "5 N"], v: Float[np.ndarray, "5 N"], h: float
) -> MovingDeflection:
    """At the first of five instants, h after each other."""
    return MovingDeflection(u[0], v[0], strained(instants, u, h))


def strained(instants: Sequence[Instant], u: Float[np.ndarray, "5 N"], h: float, i: int = 0) -> Flat:
    """Rates by differences in rigid-body frames at one of five instants, h after each other."""
    now, out = instants[i], np.empty(u.shape[1])
    for k, link in enumerate(now.of.system.model.links):
        here, d = own(now.of, k), link.d
        x = u[:, here].reshape(len(u), d, -1)
        g = np.stack([each.R[k][:d, :d].T @ y for each, y in zip(instants, x, strict=True)])
        rate = now.R[k][:d, :d] @ (np.tensordot(LATER[i], g, 1) / h)
        out[here] = (rate + cross_matrix(now.omega[k])[:d, :d] @ x[i]).ravel()
    return out


def resistance(now: Instant, u: Flat, v: Flat) -> Flat:
    """Forces by which links resist the rate of their deflection, C g'."""
    both = zip(now.internal_states(u, v), now.internal_states(u, rotating(now, u)), strict=True)
    return np.concatenate([moving.f - still.f for moving, still in both])


def rotating(now: Instant, u: Flat) -> Flat:
    """Rates of a deflection that only rotates with its links."""
    every = enumerate(cross_matrix(now.omega))
    return as_coordinates(now.of, [rotated_rate(spin, rows(now.of, k, u[own(now.of, k)])) for k, spin in every])


def scatter(u: Float[np.ndarray, "5 N"]) -> float:
    """How far values at five instants are from a smooth curve: nothing where higher differences fall."""
    third, fourth = (float(np.linalg.norm(each @ u)) for each in (THIRD, FOURTH))
    return fourth if fourth > third / 4 else 0.0
