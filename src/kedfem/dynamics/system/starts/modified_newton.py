"""The deflection in static balance at one instant, by a modified Newton method.

Its tangent is the stiffness of bodies in their mean frames, without terms of the rotation of forces. Where it diverges
`newton_krylov` takes over."""

from collections.abc import Callable

import numpy as np

from kedfem.dynamics.anderson import AndersonAcceleration
from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.linear_equations import LinearEquations
from kedfem.dynamics.system.starts.newton_krylov import Equilibrium, solution
from kedfem.dynamics.system.starts.open_joints import closed, stands_off
from kedfem.dynamics.system.starts.rotating_bodies import CONVERGED, RotatingBodies, Spins
from kedfem.dynamics.system.starts.temporary_springs import has_stops, with_temporary_springs
from kedfem.errors import SolveError

ITERATIONS = 60
DIRECT = 2  # iterations of a linear system of dense bodies before mass leaves its matrix
ROUNDING, LINEAR = 1e-8, 1e-3  # of the deflection: changes below it that do not fall are rounding
STALLED, IN_A_ROW = 1e-5, 3  # the same of so many changes that do not fall, by matrices without mass
FREE = 1e-3  # as ROUNDING where nothing drives the links: rounding moves them, held by next to nothing, as rigid ones
SHAKEN, LONG = 1e3, 10  # times the floor, and so many changes below that: the same of links that hardly deform
TOO_STIFF = 1e9  # times the softest: from some 1e12 on no balance is found beside such a link
DIVERGED = 1e3  # times the first change: iterations that Newton's method takes over


class NoBalanceError(SolveError):
    """No deflection is found at which all forces balance.

    moves : what changed most where the search ended, in words; empty if that is not known
    cause : why there is none and what to do, if that is known
    """

    def __init__(self, moves: str = "", cause: str = "") -> None:
        seen = f"; {moves}" * bool(moves)
        usual = (
            "links that nothing constrains but their weight, springs whose preload is far from what they bear there, "
            f"or a drive at a natural frequency{seen}; give springs preload or free_length near that, "
            'take initial = "rest", a slower drive, stiffer links'
        )
        super().__init__(
            f"analysis.initial: the start must be a deflection that can be found, got none: {cause or usual}"
        )
        self.moves = moves or cause


def equilibrium(
    now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None,
    z1: Flat | None, rounding: float = ROUNDING,
) -> Flat:  # fmt: skip
    """The deflection at which all forces balance and joints are closed."""
    frames = now.always.static.frames()
    try:
        return direct_balance(now, u, more, spins, z1, rounding)
    except NoBalanceError:
        if rounding == FREE or not has_stops(now):
            raise
        now.always.static.seek_from(frames)
        found = with_temporary_springs(now, u, z1, lambda at, near: direct_balance(at, near, more, spins, z1, rounding))
        if found is None:
            raise
    return found


def direct_balance(
    now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None, z1: Flat | None, rounding: float
) -> Flat:
    """The same as a search finds it by itself, where bodies are not held by stops alone; see `iterated`."""
    found = iterated(now, u, more, spins, z1, rounding)
    if not now.of.c.single and (off := stands_off(now, found, z1)):
        raise NoBalanceError(off)
    return found


@np.errstate(over="ignore", invalid="ignore")  # of iterations that diverge
def iterated(
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
    u = closed(now, u)  # changes leave joints as far open as they are
    of, anderson, bodies, settled, last = now.of, AndersonAcceleration(), RotatingBodies(now, spins), False, np.inf
    linear, slow, shaken, start, first = of.c.single, 0, 0, u, 0.0
    exact = now.slow or (linear and any(bodies.sparse))
    frames, balance = bodies.static.frames(), None
    for n in range(ITERATIONS):
        sure = exact or rounding == FREE  # its small changes are not those of mass in the matrices
        exact = exact or (linear and n >= DIRECT) or (settled and not sure)
        f, R = bodies.static.forces(now.motion.R[0], u, now.amounts)
        r = now.F - f + more(u, f) - bodies.inertia(u) - now.stress(u)
        try:
            if balance is None or not linear:
                balance = LinearEquations(of, bodies.held(R), R, _asked(now, u, z1))
            else:  # of a linear system they differ in what constraints are open by
                balance.asked = _asked(now, u, z1)
            change = bodies.change(balance, r, exact)
        except (SolveError, np.linalg.LinAlgError):
            break
        if not np.isfinite(change).all():
            break
        size, reached = float(np.linalg.norm(change)), float(np.linalg.norm(u))
        done = linear and exact and size <= CONVERGED * reached
        if done or (settled and (sure or size <= ROUNDING * reached + of.c.floor)):
            return np.asarray(u + change)  # what was left of stiff rigid cross-section nodes would be large accelerations
        if settled:  # small changes were those of mass in the matrices
            anderson, last, first, now.slow = AndersonAcceleration(), np.inf, size, True
        u = u + (change if linear else anderson.step(change))
        reached = float(np.linalg.norm(u))
        first = first or size
        if size > DIVERGED * first and not linear:
            break
        stalls = size > last / 2 and size <= (LINEAR if linear else rounding) * reached
        stalls = stalls and (n > DIRECT or not linear)
        if n >= DIRECT and size > last / 2 and rounding != FREE and not exact:
            exact, anderson, last, first = True, AndersonAcceleration(), np.inf, 0.0
            now.slow = True  # it may be the mass in the matrices that slows it
            continue
        slow = slow + 1 if exact and size > last / 2 and size <= STALLED * reached else 0
        shaken = shaken + 1 if rounding == FREE and size <= SHAKEN * of.c.floor else 0
        stalls = stalls or slow >= IN_A_ROW or shaken >= LONG
        settled, last = stalls or size <= CONVERGED * reached + of.c.floor, size
    if linear or rounding == FREE:  # what nothing drives has rigid motions without stiffness
        raise NoBalanceError(cause=_too_stiff(now))
    bodies.static.seek_from(frames)
    found, moves = solution(Equilibrium(now, more, spins, z1), start)  # which costs more an iteration
    if moves:
        raise NoBalanceError(moves)
    return found


def _too_stiff(now: Instant) -> str:
    """The link beside whose stiffness rounding leaves nothing of a balance, in words; empty if there is none."""
    of = now.of.system
    links = zip(of.model.links, of.names, strict=True)
    every = [(float(abs(link.K0).max()), name) for link, name in links if not link.rigid]
    (most, stiff), (least, soft) = max(every, default=(0.0, "")), min(every, default=(0.0, ""))
    if most < TOO_STIFF * least or not least:
        return ""
    ratio = f"{most / least:.0e} times as stiff as link '{soft}'"
    return f"link '{stiff}' is {ratio}: give it model = 'rigid', or take initial = 'rest'"


def _asked(now: Instant, u: Flat, z1: Flat | None) -> ConstraintTerms:
    """What constraints and laws ask of the change of a deflection."""
    z = now.interface(u)
    C, e = now.measured(z, z1)
    hard, laws = now.hard(C), now.forces(e)
    soft = laws[:, 1] > 0.0
    compliance = np.where(soft, 1 / np.where(soft, laws[:, 1], 1.0), 0.0)
    target = np.where(soft, laws[:, 0] * compliance, -e[0])
    every = hard | soft
    return ConstraintTerms(C[every], target[every], compliance[every], C.T @ np.where(every, 0.0, laws[:, 0]))
