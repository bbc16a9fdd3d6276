"""The steady state: the state to which a march over one period returns, and its Floquet multipliers.

x = P(x) by Newton's method. Each of its linear systems, (I − Φ) d = P(x) − x with Φ the derivative of P, is solved by
GMRES: a product with Φ is one more march over the period, so that it takes as many marches as there are vibrations that a
period does not damp away. P of a linear system is affine and needs one such solution. For other systems Anderson
acceleration of P comes first: it takes one march for each vibration, Newton's method one for each in every iteration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Complex
from kedfem.dynamics.system.period.coarse import Coarse
from kedfem.dynamics.system.period.krylov import SMALL, Derivative, Solution, combined, gmres, scale_of
from kedfem.dynamics.system.period.map import VECTOR_FIELDS, PeriodMap, StateArrays
from kedfem.dynamics.system.period.multipliers import multipliers
from kedfem.dynamics.system.record import ANGLE, COORDINATE, Spring, Stop, curve_of
from kedfem.dynamics.system.starts.instant import TURN, Flat
from kedfem.dynamics.system.state import State, copied
from kedfem.errors import SolveError
from kedfem.scene import Pieces, percentage

REPEATED = 1e-3  # of a curve's period, which elastic links may miss by so much
CLOSED = 1e-9  # what a period may leave of the size of a state
ENOUGH, LOOSE = 1e-8, 1e-6  # what is taken where nothing less is found, of linear systems and of others
ROUGH = 0.3  # of the tolerance of iterations: what a period may leave where steps iterate
NEWTON, KRYLOV, INNER = 12, 300, 0.1  # solutions; marches of one; what it may leave, of what a period may
MIXINGS, PATIENCE, DEPTH = 60, 8, 30  # of Anderson: marches, those without gain, those that it remembers
REPEATS = 1e-4  # |1 − μ| of a vibration that repeats itself with the period


@dataclass(frozen=True, slots=True)
class Search:
    """How a steady state is looked for.

    near : a state that is near to it, to begin with; one of another system is left out
    closed : what a period may leave of its size
    """

    near: StateArrays | None = None
    closed: float = CLOSED

    def start(self, usual: State) -> State:
        """The state to begin with."""
        near = self.near
        if near is None or any(near[x].shape != getattr(usual, x).shape for x in VECTOR_FIELDS):
            return usual
        return copied(usual)._replace(**{name: np.array(near[name]) for name in VECTOR_FIELDS})


@dataclass(frozen=True, slots=True)
class Periodic:
    """The steady state of a system.

    state : at the beginning of the period
    period : [s]
    residual : what the period leaves of it, of its size; of linear systems without multipliers as GMRES knows it, until
        the period is recorded
    scale : that size [J^½]
    marches : periods that were marched to find it, and its multipliers
    multipliers : those found, of largest magnitude first; none if not asked for
    certain : whether the first of them was found to SURE, or ABOUT
    shape : of its vibration, a difference of vectors of the map at the beginning of the period; none if not asked for
    """

    state: State
    period: float
    residual: float
    scale: float
    marches: int
    multipliers: Complex[np.ndarray, " f"] = field(default_factory=lambda: np.zeros(0, complex))
    certain: bool = True
    shape: Flat = field(default_factory=lambda: np.zeros(0))

    @property
    def growth(self) -> float:
        """By which the least damped vibration is multiplied in a period."""
        return float(np.abs(self.multipliers).max(initial=0.0))


def periodic(over: PeriodMap, stability: bool = True, closed: float = CLOSED, small: PeriodMap | None = None) -> Periodic:
    """The state at t = 0 that returns after a period; the search begins with `over.start`.

    Parameters
    ----------
    stability : whether multipliers are asked for; with stops there are none, as P is not smooth where these are met
    closed : what a period may leave of its size
    small : the map of the same linear system with reduced links, which preconditions the search; none: nothing does

    Raises
    ------
    SolveError
        If there is none, or none is found; iterations of a step that do not converge.
    """
    if not over.linear:  # what iterations of steps leave is more
        closed = max(closed, ROUGH * over.of.c.tolerance)
    x, y, scale = _fixed(over, closed, None if small is None else Coarse(over, small))
    stops = any(isinstance(each.law, Stop) for each in over.of.system.constraints)
    found, certain, shape = np.zeros(0, complex), not stops, np.zeros(0)
    if stability and not stops:
        if over.linear:  # P(x) as GMRES knows it is noise beside small multipliers
            y = over(x)
            scale = scale_of(over, y)
        found, certain, shape = multipliers(over, x, y)
    residual = residual_of(over, x, y, scale)
    return Periodic(over.state(x), over.period, residual, scale, over.marches, found, certain, shape)


def residual_of(over: PeriodMap, x: Flat, y: Flat, scale: float) -> float:
    """What a period that leads from x to y leaves, of the size of the state."""
    return over.size(over.change(y, x)) / max(scale, 1e-300)


def _fixed(over: PeriodMap, closed: float, coarse: Coarse | None) -> tuple[Flat, Flat, float]:
    """x and P(x), which are the same, and their size, to which what a period leaves is compared."""
    x, last = over.vector(over.start), np.inf
    y = over(x)
    _refuse_windings(over, x, y)
    over.weighed(y)
    x = y if coarse is None else x + coarse.start(over.change(y, x))  # a period damps most vibrations away
    y = over(x)
    if not over.linear:
        x, y = _mixed(over, closed, x, y)
    scale = scale_of(over, y)
    for _ in range(NEWTON):
        r = over.change(y, x)
        left = over.size(r)
        enough = (ENOUGH if over.linear else LOOSE) * scale
        if left <= closed * scale or (left <= enough and left > 0.5 * last):
            return x, y, scale
        if not np.isfinite(left):
            break
        last = left
        found = _solved(over, x, y, closed * scale, scale, coarse)
        x = over.possible(x + found.d)
        y = x + found.left if over.linear else over(x)
        now = scale_of(over, y)
        scale = min(scale, now) if over.linear else now  # the last march was not that of x, but of a product
    raise SolveError(
        "analysis.kind: must be a motion for which a steady state can be found, got one whose search does not "
        f"converge: a period still leaves {percentage(left / scale)} of it; take more damping, smaller steps, or "
        "kind = 'transient'"
    )


def _mixed(over: PeriodMap, closed: float, x: Flat, y: Flat) -> tuple[Flat, Flat]:
    """x and P(x) nearer to one another, by Anderson acceleration.

    Until a period leaves as little as it must, or no march of the last PATIENCE has led nearer.
    """
    best, since = (np.inf, x, y), 0
    before: list[tuple[Flat, Flat]] = []  # differences of residuals and of P(x), one march to the next
    r = over.change(y, x)
    for _ in range(MIXINGS):
        left, scale = over.size(r), scale_of(over, y)
        best, since = ((left, x, y), 0) if left < best[0] else (best, since + 1)
        if left <= closed * scale or since > PATIENCE or not np.isfinite(left):
            break
        r0, y0 = r, y
        x = y
        if before:
            basis = [each for each, _ in before]
            G = np.array([over.products(basis, each) for each in basis])
            c = np.linalg.lstsq(G, over.products(basis, r), rcond=1e-14)[0]
            x = y - combined(c, [moved for _, moved in before])
        x = over.possible(x)
        y = over(x)
        r = over.change(y, x)
        before = [*before, (r - r0, over.change(y, y0))][-DEPTH:]
    return best[1], best[2]


def _solved(over: PeriodMap, x: Flat, y: Flat, enough: float, scale: float, coarse: Coarse | None) -> Solution:
    """(I − Φ) d = r by GMRES in the energy's product, r what a period from x to y leaves; enough : what it may leave.

    Raises
    ------
    SolveError
        If a vibration repeats itself with the period.
    """
    r, least = over.change(y, x), INNER * enough
    beta = over.whole(r)
    by, allowed = (beta, least) if over.linear else (SMALL * scale, max(least, SMALL * beta))
    found = gmres(Derivative(over, x, y, by), r, allowed, KRYLOV, coarse)
    if found.nearest < REPEATS:
        raise SolveError(_resonant(over, found.shape))
    return found


def _resonant(of: PeriodMap, shapes: Sequence[Flat]) -> str:
    """What repeats itself with the period, so that nothing says how large it is."""
    return (
        "analysis.kind: must be a motion whose vibrations die away for a steady motion, got a resonance without "
        f"damping: a natural vibration of about {of.frequency(*shapes):.4g} Hz repeats itself with the period of "
        f"{of.period:.6g} s{of.speed_words}; give it damping, or another speed"
    )


def _repeats(curve: Pieces, gone: float) -> bool:
    """Whether a curve is where it was after a coordinate has gone on."""
    times = gone / curve.period if curve.period else 0.5
    return abs(times - round(times)) < REPEATED


def _refuse_windings(over: PeriodMap, x: Flat, y: Flat) -> None:
    """Refuse springs on hinges that rotate continuously: they are wound up further in each period.

    Raises
    ------
    SolveError
    """
    before, after = (over.state(each).e[0] for each in (x, y))
    for n, each in enumerate(over.of.system.constraints):
        gone = float(after[n] - before[n])
        curve = curve_of(each.law)
        depends = (isinstance(each.law, Spring) and each.law.stiffness != 0.0) or (
            curve is not None and curve.over == COORDINATE and not _repeats(curve.force, gone)
        )
        winds = any(term.kind == ANGLE for term in each.terms) and abs(gone) > TURN / 2
        if depends and winds:
            raise SolveError(
                f"{each.name}: must act on a joint that swings for a steady state, got one that rotates continuously: "
                "its force grows in each period; take kind = 'transient'"
            )
