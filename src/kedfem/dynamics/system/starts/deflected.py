"""Deflections without vibration: quasi-static, in static balance, or plucked. Marches begin there, and they are the
positions of static and quasi-static analyses.

With a drive the deflection turns with its links, K δ = P − M R0'' − M ([α]× + [ω]×²) δ, each with its own rigid-body
motion: the matrix has that inertia in it, so that no frequency is too near. Its rate is a difference of fourth order over
one step. Without a drive links accelerate as rigid bodies where they are, and K δ = P − M a carries that.
"""

from collections.abc import Callable, Sequence
from copy import copy

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.anderson import Mixing
from kedfem.dynamics.matrices.dense import work_on
from kedfem.dynamics.system.march import Ready
from kedfem.dynamics.system.record import RATE, Spring, Stop, curve_of
from kedfem.dynamics.system.starts.accelerations import accelerations, own_spin
from kedfem.dynamics.system.starts.balance import Asked, Balance
from kedfem.dynamics.system.starts.equilibrium import Equilibrium, equilibrium, stands_off
from kedfem.dynamics.system.starts.instant import Flat, Instant, Motion, turned
from kedfem.dynamics.system.starts.internal import own, rows, turned_rate
from kedfem.dynamics.system.starts.start import as_coordinates, begun
from kedfem.dynamics.system.starts.turning_bodies import CONVERGED, Spins, TurningBodies
from kedfem.dynamics.system.state import State
from kedfem.errors import SolveError
from kedfem.motion.newton import cross_matrix

ITERATIONS = 60
DAMPED = 8  # times that rates of a deflection are found anew where dampers feel them
DIRECT = 2  # iterations of a linear system of dense bodies before mass leaves its matrix
LEAST = 1 / 64  # of loads, that an increment of theirs is
ROUNDING, LINEAR = 1e-8, 1e-3  # of the deflection: changes below it that do not fall are rounding
STALLED, IN_A_ROW = 1e-5, 3  # the same of so many changes that do not fall, by matrices without mass
FREE = 1e-3  # as ROUNDING where nothing drives the links: rounding moves them, held by next to nothing, as rigid ones
DIVERGED = 1e3  # times the first change: iterations that Newton's method takes over
LATER = np.array([
    [-25, 48, -36, 16, -3], [-3, -10, 18, -6, 1], [1, -8, 0, 8, -1], [-1, 6, -18, 10, 3], [3, -16, 36, -48, 25],
]) / 12  # rates at five instants, of fourth order  # fmt: skip
AHEAD = {1: [1], 2: [-1, 2], 3: [1, -3, 3], 4: [-1, 4, -6, 4]}  # the next of values at equal steps

Rows = Sequence[Float[np.ndarray, "_ _"]]


class NoBalanceError(SolveError):
    """No deflection is found at which all forces balance.

    moves : what changed most where the search ended, in words; empty if that is not known
    """

    def __init__(self, moves: str = "") -> None:
        seen = f"; {moves}" * bool(moves)
        super().__init__(
            "analysis.initial: the start must be a deflection that can be found, got none: links that nothing holds but "
            "their weight, springs whose preload is far from what they bear there, or a drive at a natural frequency"
            f'{seen}; give springs preload or free_length near that, take initial = "rest", a slower drive, stiffer links'
        )
        self.moves = moves


def quasi_static(
    of: Ready, motion_at: Motion, rates: Rows | None = None, time: float = 0.0,
    near: State | None = None, like: Instant | None = None,
) -> State:  # fmt: skip
    """The state at a time with the deflection that its links have as they move on without vibrating.

    Parameters
    ----------
    motion_at : rigid-body motion at given times; of a system with a drive over a step from `time` on
    rates : per body (n, d) δ' of rigid motions, world components, where nothing drives the system; none if not given
    near : a state before, from which turns are counted on
    like : another instant, with what does not depend on time

    Raises
    ------
    NoBalanceError
        If no deflection is found.
    """
    now = Instant(of, motion_at, time, like, None if near is None else near.turned)
    if not now.motion.drives.shape[1]:
        return begun(now, *_relieved(now, as_coordinates(of, rates or [])))
    u, v = _moving(now, motion_at)
    return begun(now, u, v)


def static(
    of: Ready, motion_at: Motion, time: float = 0.0, forces: Rows | None = None,
    near: State | None = None, like: Instant | None = None,
) -> State:  # fmt: skip
    """The state at a time at rest in static balance.

    Parameters
    ----------
    forces : per body (n, d), world components, beside its loads [N]; the march goes on without: a plucked start
    near : a state whose deflection the search begins with, and from which turns are counted on; none if not given
    like : another instant, with what does not depend on time

    Raises
    ------
    NoBalanceError
        If no balance is found: as of a link that hangs, and is not held.
    """
    now = Instant(of, motion_at, time, like, None if near is None else near.turned)
    none = np.zeros(int(of.bodies.at[-1]))
    pull = none if forces is None else as_work(of, forces)
    try:
        u = _balanced(now, none if near is None else near.u, _constant(pull), None, None)
    except NoBalanceError:
        if of.c.single:
            raise
        u = _in_increments(now, pull)
    return begun(now, u, none)


def _constant(forces: Flat) -> Callable[[Flat, Flat], Flat]:
    """Forces that do not depend on the deflection."""
    return lambda u, f: forces


def _in_increments(now: Instant, pull: Flat) -> Flat:
    """The deflection under loads that grow from nothing, in parts as large as their balance can be found for."""
    part_loaded, u = copy(now), np.zeros_like(pull)
    share, part = 0.0, 0.25
    while share < 1.0:
        tried = min(1.0, share + part)
        part_loaded.F, part_loaded.amounts = tried * now.F, tried * now.amounts
        try:
            u = _balanced(part_loaded, u, _constant(tried * pull), None, None)
        except NoBalanceError:
            part /= 2
            if part < LEAST:
                raise
            continue
        share, part = tried, 1.5 * part
    return u


def plucked(of: Ready, motion_at: Motion, forces: Rows, time: float = 0.0) -> State:
    """The state at a time in which the system is let go by forces that have deflected it.

    With a drive these act on the quasi-static deflection, whose rates it has; without one, on a system at rest.
    """
    now = Instant(of, motion_at, time)
    if not now.motion.drives.shape[1]:
        return static(of, motion_at, time, forces)
    u, v = _moving(now, motion_at)
    pull = as_work(of, forces)
    return begun(now, _balanced(now, u, _constant(pull), _spins(now), now.interface(v)), v)


def as_work(of: Ready, forces: Rows) -> Flat:
    """Nodal forces (n, d) of all bodies on their coordinates."""
    return np.concatenate([work_on(part, each).ravel() for part, each in zip(of.parts, forces, strict=True)])


def _moving(first: Instant, motion_at: Motion) -> tuple[Flat, Flat]:
    """Deflection and rate with the rigid-body motion, from five instants within a step."""
    of, h = first.of, first.of.c.h / 4
    instants = [first, *(Instant(of, motion_at, first.time + k * h, first) for k in range(1, 5))]
    u, change = np.zeros((5, int(of.bodies.at[-1]))), np.inf
    v = felt = np.zeros((5, 0))
    for again in range(DAMPED if _feels_rates(of) else 1):
        before, earlier, felt = u.copy(), felt, v
        for k, now in enumerate(instants):
            guess = u[k]
            if again == 0 and k:  # joints are closed in all before, and so in what these go on to
                guess = AHEAD[k] @ u[:k]
                now.near = turned(instants[k - 1], instants[k - 1].interface(u[k - 1]))
            now.slow = now.slow or instants[k - 1].slow
            z1 = now.interface(v[k]) if again else None
            u[k] = _balanced(now, guess, _constant(np.zeros_like(guess)), _spins(now), z1)
        v, last, change = LATER @ u / h, change, float(np.linalg.norm(u[0] - before[0]))
        if again > 1 and change > last:  # rounding of rates; changes that only fall unevenly go on
            return before[0], earlier[0]
        if again and change <= CONVERGED * float(np.linalg.norm(u[0])):
            break
    return u[0], v[0] if again == 0 else felt[0]  # the rates that dampers have felt: u balances these


def _feels_rates(of: Ready) -> bool:
    """Whether a law's force depends on a rate."""
    laws = [each.law for each in of.system.constraints]
    curves = [curve for law in laws if (curve := curve_of(law)) is not None]
    damped = any(isinstance(law, Spring | Stop) and law.damping != 0 for law in laws)
    return damped or any(curve.over == RATE for curve in curves)


def _spins(now: Instant) -> Spins:
    """[α]× + [ω]×² of all bodies, world components."""
    alpha = cross_matrix(now.motion.alpha[0][now.of.bodies.motion])
    omega = cross_matrix(now.omega)
    return np.asarray(alpha + omega @ omega)


def _relieved(now: Instant, v: Flat) -> tuple[Flat, Flat]:
    """Deflection of a system that nothing drives, and its rates: it turns with its links."""
    of, links = now.of, now.of.system.model.links
    spins = [own_spin(link, rows(of, k, v[own(of, k)]), now.R[k]) for k, link in enumerate(links)]

    def rate(u: Flat) -> Flat:
        turning = [turned_rate(S, rows(of, k, u[own(of, k)])) for k, S in enumerate(spins)]
        return np.asarray(v + as_coordinates(of, turning))

    def inertia(u: Flat, f: Flat) -> Flat:
        z, moving = now.interface(u), rate(u)
        C, e = now.gradients(z), now.coordinates(np.stack([z, now.interface(moving), 0 * z]))
        hard = now.hard(C)
        m = np.where(hard, 0.0, now.forces(e)[:, 0])
        asked = Asked(C[hard], -e[2, hard], np.zeros(int(hard.sum())), C.T @ m)
        return -accelerations(now, now.F - f, u, moving, asked, rigid=True).x

    u = _balanced(now, np.zeros_like(v), inertia, None, now.interface(v), FREE)
    return u, rate(u)


def _balanced(
    now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None,
    z1: Flat | None, rounding: float = ROUNDING,
) -> Flat:  # fmt: skip
    """The deflection at which all forces balance and joints are closed; see `_iterated`."""
    found = _iterated(now, u, more, spins, z1, rounding)
    if not now.of.c.single and (off := stands_off(now, found, z1)):
        raise NoBalanceError(off)
    return found


@np.errstate(over="ignore", invalid="ignore")  # of iterations that diverge
def _iterated(
    now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None,
    z1: Flat | None, rounding: float,
) -> Flat:  # fmt: skip
    """The deflection at which all forces balance, by Newton's method with the stiffness of the mean frames.

    Parameters
    ----------
    more : forces beside applied and internal ones, at a deflection u with the internal force f
    spins : of the inertia that it has as it turns, if any
    z1 : rates of the interface unknowns
    rounding : of the deflection, below which changes that do not fall are taken for rounding
    """
    of, mixing, bodies, settled, last = now.of, Mixing(), TurningBodies(now, spins), False, np.inf
    linear, slow, start, first = of.c.single, 0, u, 0.0
    exact = now.slow or (linear and any(bodies.sparse))
    for n in range(ITERATIONS):
        sure = exact or rounding == FREE  # its small changes are not those of mass in the matrices
        exact = exact or (linear and n >= DIRECT) or (settled and not sure)
        f, R = bodies.still.forces(now.motion.R[0], u, now.amounts)
        r = now.F - f + more(u, f) - bodies.inertia(u) - now.stress(u)
        try:
            balance = Balance(of, bodies.held(R), R, _asked(now, u, z1))
            change = bodies.change(balance, r, exact)
        except (SolveError, np.linalg.LinAlgError):
            break
        if not np.isfinite(change).all():
            break
        size, reached = float(np.linalg.norm(change)), float(np.linalg.norm(u))
        if settled and (sure or size <= ROUNDING * reached + of.c.floor):
            return np.asarray(u + change)  # what was left of stiff hubs would be large accelerations
        if settled:  # small changes were those of mass in the matrices
            mixing, last, first, now.slow = Mixing(), np.inf, size, True
        u = u + (change if linear else mixing.step(change))
        reached = float(np.linalg.norm(u))
        first = first or size
        if size > DIVERGED * first and not linear:
            break
        stalls = size > last / 2 and size <= (LINEAR if linear else rounding) * reached
        stalls = stalls and (n > DIRECT or not linear)
        if n >= DIRECT and size > last / 2 and rounding != FREE and not exact:
            exact, mixing, last, first = True, Mixing(), np.inf, 0.0
            now.slow = True  # it may be the mass in the matrices that slows it
            continue
        slow = slow + 1 if exact and size > last / 2 and size <= STALLED * reached else 0
        stalls = stalls or slow >= IN_A_ROW
        settled, last = stalls or size <= CONVERGED * reached + of.c.floor, size
    if linear or rounding == FREE:  # what nothing drives has rigid motions without stiffness
        raise NoBalanceError()
    return _by_newton(now, start, more, spins, z1)


def _by_newton(
    now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None, z1: Flat | None
) -> Flat:
    """The same by Newton's method with all that rotates with bodies, which costs more an iteration."""
    found = equilibrium(Equilibrium(now, more, spins, z1), u)
    if found.moves:
        raise NoBalanceError(found.moves)
    return found.u


def _asked(now: Instant, u: Flat, z1: Flat | None) -> Asked:
    """What constraints and laws ask of the change of a deflection."""
    z = now.interface(u)
    C, e = now.gradients(z), now.coordinates(np.stack([z, 0 * z if z1 is None else z1, 0 * z]))
    hard, laws = now.hard(C), now.forces(e)
    soft = laws[:, 1] > 0.0
    compliance = np.where(soft, 1 / np.where(soft, laws[:, 1], 1.0), 0.0)
    target = np.where(soft, laws[:, 0] * compliance, -e[0])
    every = hard | soft
    return Asked(C[every], target[every], compliance[every], C.T @ np.where(every, 0.0, laws[:, 0]))
