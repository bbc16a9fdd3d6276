"""Deflections without vibration for starts, and for static and quasi-static analyses: quasi-static, static or plucked.

With a drive the deflection rotates with the rigid-body motion of its links, K δ = P − M R0'' − M ([α]× + [ω]×²) δ, with
the last term in the matrix. The rate is a difference of fourth order over one step, or more with dampers, as differences
add rounding. Without a drive links accelerate as rigid bodies in their positions, and K δ = P − M a."""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.starts.condensed import Rows, condensed
from kedfem.dynamics.system.starts.initial_states import as_coordinates, begun
from kedfem.dynamics.system.starts.instant import Flat, Instant, Motion, instant_near, term_angles
from kedfem.dynamics.system.starts.internal_forces import own
from kedfem.dynamics.system.starts.laws import feels_rates
from kedfem.dynamics.system.starts.modified_newton import ROUNDING, NoBalanceError, direct_balance, equilibrium
from kedfem.dynamics.system.starts.relieved import relieved
from kedfem.dynamics.system.starts.rotating_bodies import CONVERGED, Spins, spins_of
from kedfem.dynamics.system.state import State
from kedfem.errors import MotionError, SolveError
from kedfem.motion.newton import cross_matrix

DAMPED = 12  # times that rates of a deflection are found anew where dampers feel them
WIDER = 6  # times that their instants are taken four times as far apart, while rates change by no more than
SAME, ENOUGH = 3.0, 1e-7  # times what rounding leaves open of them; share of them that may stay open
# of rates, or of what rotates at 1 rad/s: the most that may stay open of what is released, which would be shaken else
OPEN = 1e-3
UNSETTLED = "rates with dampers do not converge: take weaker dampers, less force, a slower drive or short loads"
LEAST = 1 / 64  # of loads, that an increment of theirs is
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


def quasi_static(of: Ready, motion_at: Motion, rates: Rows | None = None, time: float = 0.0) -> State:
    """The state at a time with the quasi-static deflection: links move on without vibration.

    Parameters
    ----------
    motion_at : rigid-body motion at given times; of a system with a drive over a step from `time` on
    rates : per body (n, d) δ' of rigid motions, world components, where nothing drives the system; none if not given

    Raises
    ------
    NoBalanceError
        If no deflection is found.
    """
    now = Instant(of, motion_at, time)
    if not now.motion.drives.shape[1]:
        small = condensed(now, None)
        u, v = relieved(small.at(now, motion_at), small.onto(as_coordinates(of, rates or [])))
        return begun(now, small.back(u), small.back(v))
    return _moving_state(now, motion_at)


def quasi_static_position(
    of: Ready, motion_at: Motion, time: float, near: State | None = None, like: Instant | None = None
) -> State:
    """The same of a driven system where no march begins: its rates may be rounding, unless dampers feel them.

    Parameters
    ----------
    near : a state before, from which revolutions are counted on
    like : another instant, with what does not depend on time

    Raises
    ------
    NoBalanceError
        If no deflection is found.
    """
    now = instant_near(of, motion_at, time, like, near)
    return _moving_state(now, motion_at, WIDER if _feels_rates(of) else 0, near)


def _moving_state(
    now: Instant, motion_at: Motion, widenings: int = WIDER, near: State | None = None, forces: Rows | None = None
) -> State:
    """The state at an instant with a deflection that moves on with the rigid-body motion, under forces beside loads."""
    small = condensed(now, lambda: motion_at(now.time + now.of.c.h / 4 * np.arange(5)), forces)
    first = small.at(now, motion_at, near)
    found = _moving(first, motion_at, widenings, 0.0 if forces is None else small.forces(forces))
    return begun(now, small.back(found.u), small.back(found.v), strained=small.back(found.strained))


def static(
    of: Ready, motion_at: Motion, time: float = 0.0, forces: Rows | None = None,
    near: State | None = None, like: Instant | None = None,
) -> State:  # fmt: skip
    """The state at a time at rest in static balance.

    Parameters
    ----------
    forces : per body (n, d), world components, beside its loads [N]; the march goes on without: a plucked start
    near : a state whose deflection, rotated with the links, the search begins with, and from which revolutions are
        counted on; none if not given
    like : another instant, with what does not depend on time

    Raises
    ------
    NoBalanceError
        If no balance is found, as of an unconstrained link.
    """
    now = instant_near(of, motion_at, time, like, near)
    small = condensed(now, None, forces)
    here = small.at(now, motion_at, near)
    none = np.zeros(int(here.of.bodies.at[-1]))
    pull, guess = none if forces is None else small.forces(forces), none
    if near is not None:
        before = Instant(here.of, motion_at, float(near.time[0]), here)
        guess = _with_links(before, here, small.onto(near.u))
    u = small.back(_balance(here, guess, pull, None))
    return begun(now, u, np.zeros_like(u))


def _constant(forces: Flat) -> Callable[[Flat, Flat], Flat]:
    """Forces that do not depend on the deflection."""
    return lambda u, f: forces


def _balance(now: Instant, guess: Flat, pull: Flat, spins: Spins | None) -> Flat:
    """The deflection at which all forces balance, in increments where it is too far from a guess."""
    frames = now.always.static.frames()
    try:
        return equilibrium(now, guess, _constant(pull), spins, None)
    except NoBalanceError:
        if now.of.c.single:
            raise
        now.always.static.seek_from(frames)
        return _in_increments(now, pull, spins)


def _in_increments(now: Instant, pull: Flat, spins: Spins | None) -> Flat:
    """The deflection under loads, and pulls of springs in the reference position, that grow from nothing, in parts as
    large as their balance can be found for."""
    part_loaded, static, u, before = copy(now), now.always.static, np.zeros_like(pull), np.zeros_like(pull)
    drawn_apart = now.forces(now.measured(now.interface(u))[1])[:, 0]

    def loaded(tried: float, u: Flat) -> Flat:
        part_loaded.F, part_loaded.amounts = tried * now.F, tried * now.amounts
        part_loaded.relief = (1.0 - tried) * drawn_apart
        return direct_balance(part_loaded, u, _constant(tried * pull), spins, None, ROUNDING)

    share, part, last, frames = 0.0, 0.25, 1.0, static.frames()
    loaded(LEAST, u)  # without a balance under the least part there is none to go on from, as of what nothing constrains
    static.seek_from(frames)
    while share < 1.0:
        tried = min(1.0, share + part)
        try:
            found = loaded(tried, u + (tried - share) / last * (u - before))  # as the last increment went
        except NoBalanceError:
            part /= 2
            if part < LEAST:
                raise
            static.seek_from(frames)
            continue
        frames = static.frames()
        u, before, last, share, part = found, u, tried - share, tried, 1.5 * part
    return u


def plucked(of: Ready, motion_at: Motion, forces: Rows, time: float = 0.0) -> State:
    """The state at a time in which the system is released from a deflection by forces.

    With a drive these have turned with its links, whose deflection is quasi-static under them and has its rates;
    without one, the system is at rest.
    """
    now = Instant(of, motion_at, time)
    if not now.motion.drives.shape[1]:
        return static(of, motion_at, time, forces)
    return _moving_state(now, motion_at, forces=forces)


def _moving(first: Instant, motion_at: Motion, widenings: int = WIDER, pull: Flat | float = 0.0) -> MovingDeflection:
    """Deflection and rate with the rigid-body motion, from instants as close as their rounding allows, put farther apart
    so many times at most; under a pull beside loads, as it is at the first instant, that turns with its links."""
    h = first.of.c.h / 4
    pull = pull + np.zeros(int(first.of.bodies.at[-1]))
    found, left = differenced_rates(first, motion_at, h, pull)
    for _ in range(widenings):
        if left <= ENOUGH * np.linalg.norm(found.v):
            break
        h *= 4
        try:
            wider, rest = differenced_rates(first, motion_at, h, pull)
        except (SolveError, MotionError):
            break
        if np.linalg.norm(wider.v - found.v) > SAME * left:  # the motion bends within
            break
        if rest < left:
            found, left = wider, rest
    if pull.any() and left > OPEN * max(np.linalg.norm(found.v), np.linalg.norm(found.u)):
        raise NoBalanceError(cause=UNSETTLED)
    return found


def differenced_rates(first: Instant, motion_at: Motion, h: float, pull: Flat) -> tuple[MovingDeflection, float]:
    """Deflection and rate from five instants, h after each other, and by how much rates are open where rounding ends what
    dampers feel of them."""
    of = first.of
    instants = [first, *(Instant(of, motion_at, first.time + k * h, first) for k in range(1, 5))]
    pulls = [_with_links(first, now, pull) for now in instants]
    u, change = np.zeros((5, len(pull))), np.inf
    v = felt = np.zeros((5, 0))
    left = 0.0
    for again in range(DAMPED if _feels_rates(of) else 1):
        before, earlier, felt = u.copy(), felt, v
        try:
            for k, now in enumerate(instants):
                guess = u[k]
                if again == 0 and k:  # joints are closed in all before, and so in what these go on to
                    guess = AHEAD[k] @ u[:k]
                    now.near = term_angles(instants[k - 1], instants[k - 1].interface(u[k - 1]))
                now.slow = now.slow or instants[k - 1].slow
                z1 = now.interface(v[k]) if again else None
                if again or k:
                    u[k] = equilibrium(now, guess, _constant(pulls[k]), spins_of(now), z1)
                else:
                    u[k] = _balance(now, guess, pulls[k], spins_of(now))
        except SolveError:
            if again < 2:  # rounding has not grown yet
                raise
            return _moved(instants, before, earlier, h), np.inf
        v, last, change = LATER @ u / h, change, float(np.linalg.norm(u[0] - before[0]))
        rest, left = left, float(np.linalg.norm(v[0] - felt[0])) if again else 0.0
        if again > 1 and change > last:  # rounding of rates; changes that only fall unevenly go on
            return _moved(instants, before, earlier, h), max(left, rest)
        if again and change <= CONVERGED * float(np.linalg.norm(u[0])):
            return _moved(instants, u, felt, h), 0.0
    if again == 0:
        return _moved(instants, u, v, h), _scatter(u) / h
    return _moved(instants, u, felt, h), left  # the rates that dampers have felt: u balances these


def _with_links(first: Instant, now: Instant, pull: Flat) -> Flat:
    """Forces or deflections as they are at a first instant, at another that links have turned to."""
    out = np.empty_like(pull)
    for k, link in enumerate(now.of.system.model.links):
        here, turn = own(now.of, k), (now.R[k] @ first.R[k].T)[: link.d, : link.d]
        out[here] = (turn @ pull[here].reshape(link.d, -1)).ravel()
    return out


def _moved(
    instants: Sequence[Instant], u: Float[np.ndarray, "5 N"], v: Float[np.ndarray, "5 N"], h: float
) -> MovingDeflection:
    """At the first of five instants, h after each other."""
    now, strained = instants[0], np.empty(u.shape[1])
    for k, link in enumerate(now.of.system.model.links):
        here, d = own(now.of, k), link.d
        x = u[:, here].reshape(len(u), d, -1)
        g = np.stack([each.R[k][:d, :d].T @ y for each, y in zip(instants, x, strict=True)])
        rate = now.R[k][:d, :d] @ (np.tensordot(LATER[0], g, 1) / h)
        strained[here] = (rate + cross_matrix(now.omega[k])[:d, :d] @ x[0]).ravel()
    return MovingDeflection(u[0], v[0], strained)


def _scatter(u: Float[np.ndarray, "5 N"]) -> float:
    """How far values at five instants are from a smooth curve: nothing where higher differences fall."""
    third, fourth = (float(np.linalg.norm(each @ u)) for each in (THIRD, FOURTH))
    return fourth if fourth > third / 4 else 0.0


def _feels_rates(of: Ready) -> bool:
    """Whether a law's force depends on a rate."""
    return any(feels_rates(each.law) for each in of.system.constraints)
