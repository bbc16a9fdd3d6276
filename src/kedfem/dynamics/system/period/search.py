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
from kedfem.dynamics.system.period.krylov import Derivative, Solution, Watch, Watched, combined, gmres, scale_of
from kedfem.dynamics.system.period.map import VECTOR_FIELDS, PeriodMap, StateArrays
from kedfem.dynamics.system.period.multipliers import multipliers
from kedfem.dynamics.system.record import ANGLE, COORDINATE, Spring, Stop, curve_of
from kedfem.dynamics.system.starts.instant import TURN, Flat
from kedfem.dynamics.system.state import State, copied
from kedfem.errors import SolveError
from kedfem.scene import Pieces

REPEATED = 1e-3  # of a curve's period, which elastic links may miss by so much
CLOSED = 1e-9  # what a period may leave of the size of a state
ENOUGH, LOOSE = 1e-8, 1e-6  # what is taken where nothing less is found, of linear systems and of others
ROUGH = 0.3  # of the tolerance of iterations: what a period may leave where steps iterate
NEWTON, KRYLOV, INNER = 12, 300, 0.1  # solutions; marches of one; what it may leave, of what a period may
MIXINGS, PATIENCE, DEPTH = 60, 8, 30  # of Anderson: marches, those without gain, those that it remembers
SMALL = 1e-4  # of the size of the state: differences by which Φ of a system that is not linear is found
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


def periodic(
    over: PeriodMap, stability: bool = True, watch: Watch = lambda marched: None, closed: float = CLOSED,
    small: PeriodMap | None = None,
) -> Periodic:  # fmt: skip
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
    steps = Watched(over, watch, closed)
    x, y, scale = _fixed(steps, over.vector(over.start), None if small is None else Coarse(over, small))
    stops = any(isinstance(each.law, Stop) for each in over.of.system.constraints)
    found, certain, shape = np.zeros(0, complex), not stops, np.zeros(0)
    if stability and not stops:
        if over.linear:  # P(x) as GMRES knows it is noise beside small multipliers
            y = steps(x)
            scale = scale_of(over, y)
        found, certain, shape = multipliers(steps, x, y)
    residual = residual_of(over, x, y, scale)
    return Periodic(over.state(x), over.period, residual, scale, over.marches, found, certain, shape)


def residual_of(over: PeriodMap, x: Flat, y: Flat, scale: float) -> float:
    """What a period that leads from x to y leaves, of the size of the state."""
    return over.size(over.change(y, x)) / max(scale, 1e-300)


def _closed(steps: Watched) -> float:
    """What a period may leave of the size of a state: what iterations of steps leave of it are more, if there are any."""
    of = steps.map
    return steps.closed if of.linear else max(steps.closed, ROUGH * of.of.c.tolerance)


def _fixed(steps: Watched, x: Flat, coarse: Coarse | None) -> tuple[Flat, Flat, float]:
    """x and P(x), which are the same, and their size, to which what a period leaves is compared."""
    map_, last = steps.map, np.inf
    y = steps(x)
    _refuse_windings(map_, x, y)
    map_.weighed(y)
    x = y if coarse is None else x + coarse.start(map_.change(y, x))  # a period damps most vibrations away
    y = steps(x)
    if not map_.linear:
        x, y = _mixed(steps, x, y)
    scale = scale_of(map_, y)
    for _ in range(NEWTON):
        r = map_.change(y, x)
        left = map_.size(r)
        enough = (ENOUGH if map_.linear else LOOSE) * scale
        if left <= _closed(steps) * scale or (left <= enough and left > 0.5 * last):
            return x, y, scale
        if not np.isfinite(left):
            break
        last = left
        found = _solved(steps, x, y, r, scale, coarse)
        x = map_.possible(x + found.d)
        y = x + found.left if map_.linear else steps(x)
        now = scale_of(map_, y)
        scale = min(scale, now) if map_.linear else now  # the last march was not that of x, but of a product
    raise SolveError(
        "analysis.kind: must be a motion for which a steady state can be found, got one whose search does not "
        f"converge: a period still leaves {100 * left / scale:.2g} % of it; take more damping, smaller steps, or "
        "kind = 'transient'"
    )


def _mixed(steps: Watched, x: Flat, y: Flat) -> tuple[Flat, Flat]:
    """x and P(x) nearer to one another, by Anderson acceleration.

    Until a period leaves as little as it must, or no march of the last PATIENCE has led nearer.
    """
    map_, best, since = steps.map, (np.inf, x, y), 0
    before: list[tuple[Flat, Flat]] = []  # differences of residuals and of P(x), one march to the next
    r = map_.change(y, x)
    for _ in range(MIXINGS):
        left, scale = map_.size(r), scale_of(map_, y)
        best, since = ((left, x, y), 0) if left < best[0] else (best, since + 1)
        if left <= _closed(steps) * scale or since > PATIENCE or not np.isfinite(left):
            break
        r0, y0 = r, y
        x = y
        if before:
            basis = [each for each, _ in before]
            G = np.array([map_.products(basis, each) for each in basis])
            c = np.linalg.lstsq(G, map_.products(basis, r), rcond=1e-14)[0]
            x = y - combined(c, [moved for _, moved in before])
        x = map_.possible(x)
        y = steps(x)
        r = map_.change(y, x)
        before = [*before, (r - r0, map_.change(y, y0))][-DEPTH:]
    return best[1], best[2]


def _solved(steps: Watched, x: Flat, y: Flat, r: Flat, scale: float, coarse: Coarse | None) -> Solution:
    """(I − Φ) d = r by GMRES in the energy's product.

    Raises
    ------
    SolveError
        If a vibration repeats itself with the period.
    """
    map_, beta = steps.map, steps.map.whole(r)
    least = INNER * _closed(steps) * scale
    by, allowed = (beta, least) if map_.linear else (SMALL * scale, max(least, SMALL * beta))
    found = gmres(Derivative(steps, x, y, by), r, allowed, KRYLOV, coarse)
    if found.nearest < REPEATS:
        raise SolveError(_resonant(map_, found.shape))
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


def _refuse_windings(map_: PeriodMap, x: Flat, y: Flat) -> None:
    """Refuse springs on hinges that rotate continuously: they are wound up further in each period.

    Raises
    ------
    SolveError
    """
    before, after = (map_.state(each).e[0] for each in (x, y))
    for n, each in enumerate(map_.of.system.constraints):
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
