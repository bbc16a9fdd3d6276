"""The deflection at which all forces balance at one instant, by a modified Newton method: the tangent is the stiffness
of bodies in their mean frames, without what turns with them. Where it diverges `newton_krylov` takes over."""

from collections.abc import Callable

import numpy as np

from kedfem.dynamics.anderson import Mixing
from kedfem.dynamics.matrices.bordered import Asked
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.linear_equations import LinearEquations
from kedfem.dynamics.system.starts.newton_krylov import Equilibrium, solution, stands_off
from kedfem.dynamics.system.starts.props import has_stops, without_props
from kedfem.dynamics.system.starts.turning_bodies import CONVERGED, Spins, TurningBodies
from kedfem.errors import SolveError

ITERATIONS = 60
DIRECT = 2  # iterations of a linear system of dense bodies before mass leaves its matrix
ROUNDING, LINEAR = 1e-8, 1e-3  # of the deflection: changes below it that do not fall are rounding
STALLED, IN_A_ROW = 1e-5, 3  # the same of so many changes that do not fall, by matrices without mass
FREE = 1e-3  # as ROUNDING where nothing drives the links: rounding moves them, held by next to nothing, as rigid ones
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
            "links that nothing holds but their weight, springs whose preload is far from what they bear there, or a "
            f'drive at a natural frequency{seen}; give springs preload or free_length near that, take initial = "rest", '
            "a slower drive, stiffer links"
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
    frames = now.always.still.frames()
    try:
        return unpropped(now, u, more, spins, z1, rounding)
    except NoBalanceError:
        if rounding == FREE or not has_stops(now):
            raise
        now.always.still.seek_from(frames)
        found = without_props(now, u, z1, lambda propped, near: unpropped(propped, near, more, spins, z1, rounding))
        if found is None:
            raise
    return found


def unpropped(
    now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None, z1: Flat | None, rounding: float
) -> Flat:
    """The same as a search finds it by itself, where bodies are not held by stops alone; see `_iterated`."""
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
    frames, balance = bodies.still.frames(), None
    for n in range(ITERATIONS):
        sure = exact or rounding == FREE  # its small changes are not those of mass in the matrices
        exact = exact or (linear and n >= DIRECT) or (settled and not sure)
        f, R = bodies.still.forces(now.motion.R[0], u, now.amounts)
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
        raise NoBalanceError(cause=_too_stiff(now))
    bodies.still.seek_from(frames)
    return _by_newton(now, start, more, spins, z1)


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


def _by_newton(now: Instant, u: Flat, more: Callable[[Flat, Flat], Flat], spins: Spins | None, z1: Flat | None) -> Flat:
    """The same by Newton's method with all that rotates with bodies, which costs more an iteration."""
    found = solution(Equilibrium(now, more, spins, z1), u)
    if found.moves:
        raise NoBalanceError(found.moves)
    return found.u


def _asked(now: Instant, u: Flat, z1: Flat | None) -> Asked:
    """What constraints and laws ask of the change of a deflection."""
    z = now.interface(u)
    C, e = now.measured(z, z1)
    hard, laws = now.hard(C), now.forces(e)
    soft = laws[:, 1] > 0.0
    compliance = np.where(soft, 1 / np.where(soft, laws[:, 1], 1.0), 0.0)
    target = np.where(soft, laws[:, 0] * compliance, -e[0])
    every = hard | soft
    return Asked(C[every], target[every], compliance[every], C.T @ np.where(every, 0.0, laws[:, 0]))
