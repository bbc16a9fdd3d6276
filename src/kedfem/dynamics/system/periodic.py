"""The steady state: the state that a march over one period leads back to, and what small vibrations about it grow by.

x = P(x) by Newton's method. Each of its linear systems, (I − Φ) d = P(x) − x with Φ the derivative of P, is solved by
GMRES: a product with Φ is one more march over the period, so that it takes as many marches as there are vibrations that a
period does not damp away. Of a linear system P is affine, and one such solution is all. Of others Anderson mixing of P
comes first: it takes a march for each vibration where Newton's method takes one again in each of its solutions.

Multipliers, the eigenvalues of Φ, are found by Arnoldi's method from a state that a random blow has left, so that
vibrations show which the loads do not excite: by its largest magnitude a vibration grows, or falls, in a period
(Floquet).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex, Float

from kedfem.dynamics.system.arrays import State
from kedfem.dynamics.system.instant import TURN, Flat
from kedfem.dynamics.system.period_map import PeriodMap
from kedfem.dynamics.system.record import ANGLE, COORDINATE, Curve, Spring, Stop
from kedfem.errors import SolveError

CLOSED = 1e-9  # what a period may leave of the size of a state
ENOUGH, LOOSE = 1e-8, 1e-6  # what is taken where nothing less is found, of linear systems and of others
ROUGH = 0.3  # of the tolerance of iterations: what a period may leave where steps iterate
NEWTON, KRYLOV, INNER = 12, 300, 0.1  # solutions; marches of one; what it may leave, of what a period may
MIXINGS, PATIENCE, DEPTH = 60, 8, 30  # of Anderson: marches, those without gain, those that it remembers
SMALL = 1e-4  # of the size of the state: differences by which Φ of a system that is not linear is found
REPEATS = 1e-4  # |1 − μ| of a vibration that repeats itself with the period
WHOLE = 1e-12  # what a new direction adds where a basis holds all that there is
MULTIPLIERS, AGAIN = 80, 5  # marches for them, at most; those after which no larger one may have come up
SURE, ABOUT = 1e-7, 1e-3  # residuals of multipliers of linear systems, and of others
Watch = Callable[[int], None]
"""Told of the periods that were marched so far."""


@dataclass(frozen=True, slots=True)
class Periodic:
    """The steady state of a system.

    state : at the beginning of the period
    period : [s]
    residual : what the period leaves of it, of its size
    marches : periods that were marched to find it, and its multipliers
    multipliers : those found, of largest magnitude first; none if not asked for
    certain : whether the first of them was found to SURE, or ABOUT
    """

    state: State
    period: float
    residual: float
    marches: int
    multipliers: Complex[np.ndarray, " f"] = field(default_factory=lambda: np.zeros(0, complex))
    certain: bool = True

    @property
    def growth(self) -> float:
        """By which the least damped vibration is multiplied in a period."""
        return float(np.abs(self.multipliers).max(initial=0.0))


def periodic(over: PeriodMap, stability: bool = True, watch: Watch = lambda marched: None) -> Periodic:
    """The state at t = 0 that returns after a period; the search begins with `over.start`.

    Parameters
    ----------
    stability : whether multipliers are asked for; with stops there are none, as P is not smooth where these are met

    Raises
    ------
    SolveError
        If there is none, or none is found; iterations of a step that do not converge.
    """
    steps = _Watched(over, watch)
    x, y = _fixed(steps, over.vector(over.start))
    residual = over.size(over.change(y, x)) / max(_scale(over, y), 1e-300)
    stops = any(isinstance(each.law, Stop) for each in over.of.system.constraints)
    found, certain = np.zeros(0, complex), not stops
    if stability and not stops:
        found, certain = _multipliers(steps, x, y)
    return Periodic(over.state(x), over.period, residual, over.marches, found, certain)


@dataclass(frozen=True, slots=True)
class _Watched:
    """The map, told about."""

    map: PeriodMap
    watch: Watch

    def __call__(self, x: Flat, blow: Sequence[np.ndarray] | None = None) -> Flat:
        out = self.map(x, blow)
        self.watch(self.map.marches)
        return out

    def product(self, x: Flat, y: Flat, v: Flat, by: float) -> Flat:
        """Φ v at x, of which y = P(x), from the difference that `by` v makes."""
        moved = self.map.possible(x + by * v)
        return self.map.change(self(moved), y) / by


def _closed(of: PeriodMap) -> float:
    """What a period may leave of the size of a state: what iterations of steps leave of it are more, if there are any."""
    return CLOSED if of.linear else max(CLOSED, ROUGH * of.of.c.tolerance)


def _scale(of: PeriodMap, y: Flat) -> float:
    """√ of the largest energy in a period."""
    return float(np.sqrt(of.largest)) + of.size(y)


def _fixed(steps: _Watched, x: Flat) -> tuple[Flat, Flat]:
    """x and P(x), which are the same."""
    map_, last = steps.map, np.inf
    y = steps(x)
    _refuse_windings(map_, x, y)
    map_.weighed(y)
    x, y = y, steps(y)  # a period damps most vibrations away
    if not map_.linear:
        x, y = _mixed(steps, x, y)
    for _ in range(NEWTON):
        r, scale = map_.change(y, x), _scale(map_, y)
        left = map_.size(r)
        enough = (ENOUGH if map_.linear else LOOSE) * scale
        if left <= _closed(map_) * scale or (left <= enough and left > 0.5 * last):
            return x, y
        if not np.isfinite(left):
            break
        last = left
        x = map_.possible(x + _solved(steps, x, y, r, scale))
        y = steps(x)
    raise SolveError(
        "analysis.kind: must be a motion for which a steady state can be found, got one whose search does not "
        f"converge: a period still leaves {100 * left / scale:.2g} % of it; take more damping, smaller steps, or "
        "kind = 'transient'"
    )


def _mixed(steps: _Watched, x: Flat, y: Flat) -> tuple[Flat, Flat]:
    """x and P(x) nearer to one another, by Anderson mixing.

    Until a period leaves as little as it must, or no march of the last PATIENCE has led nearer.
    """
    map_, best, since = steps.map, (np.inf, x, y), 0
    before: list[tuple[Flat, Flat]] = []  # differences of residuals and of P(x), one march to the next
    r = map_.change(y, x)
    for _ in range(MIXINGS):
        left, scale = map_.size(r), _scale(map_, y)
        best, since = ((left, x, y), 0) if left < best[0] else (best, since + 1)
        if left <= _closed(map_) * scale or since > PATIENCE or not np.isfinite(left):
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


def _solved(steps: _Watched, x: Flat, y: Flat, r: Flat, scale: float) -> Flat:
    """d with (I − Φ) d = r, by GMRES in the energy's product.

    Raises
    ------
    SolveError
        If a vibration repeats itself with the period.
    """
    map_, beta = steps.map, steps.map.whole(r)
    least = INNER * _closed(map_) * scale
    by, allowed = (beta, least) if map_.linear else (SMALL * scale, max(least, SMALL * beta))
    basis = [r / beta]
    for H in _arnoldi(steps, (x, y), basis, by, KRYLOV):
        rest, asked = np.eye(*H.shape) - H, beta * np.eye(len(H))[0]
        d = np.linalg.lstsq(rest, asked, rcond=None)[0]
        if float(np.linalg.norm(rest @ d - asked)) <= allowed:
            break
    values, shapes = np.linalg.eig(rest[:-1].astype(complex))
    nearest = shapes[:, int(np.abs(values).argmin())]
    if np.abs(values).min() < REPEATS:
        raise SolveError(_resonant(map_, [combined(part, basis) for part in (nearest.real, nearest.imag)]))
    return combined(d, basis)


def combined(c: Flat, basis: Sequence[Flat]) -> Flat:
    """Σ c_i v_i of the first vectors of a basis."""
    out = np.zeros_like(basis[0])
    for k, v in zip(c, basis, strict=False):
        out += k * v
    return out


def _arnoldi(
    steps: _Watched, at: tuple[Flat, Flat], basis: list[Flat], by: float, most: int
) -> Iterator[Float[np.ndarray, "j1 j"]]:
    """H of Φ V = V₊ H, on an orthonormal basis that grows by a vector, and a march, each time.

    It ends where the basis holds all that there is, after `most` marches at the latest.

    Parameters
    ----------
    at : x and P(x)
    basis : its first vector; the others are added
    by : size of the differences by which Φ is found
    """
    H = np.zeros((most + 1, most))
    for j in range(most):
        w, H[: j + 2, j] = _orthogonal(steps.map, basis, steps.product(*at, basis[j], by))
        yield H[: j + 2, : j + 1]
        if H[j + 1, j] <= WHOLE * max(1.0, np.abs(H[: j + 2, : j + 1]).max()):
            return
        basis.append(w / H[j + 1, j])


def _orthogonal(of: PeriodMap, basis: Sequence[Flat], w: Flat) -> tuple[Flat, Flat]:
    """What is left of w beside a basis, its coefficients there and its size."""
    h = np.zeros(len(basis) + 1)
    for _ in range(2):
        c = of.products(basis, w)
        h[:-1] += c
        w = w - combined(c, basis)
    h[-1] = of.whole(w)
    return w, h


def _multipliers(steps: _Watched, x: Flat, y: Flat) -> tuple[Complex[np.ndarray, " f"], bool]:
    """Eigenvalues of Φ, of largest magnitude first, and whether the first is certain."""
    map_, tolerance = steps.map, SURE if steps.map.linear else ABOUT
    links = map_.of.system.model.links
    random = np.random.default_rng(0)
    blow = [random.standard_normal((link.n, link.d)) for link in links]
    v, scale = map_.change(steps(x, blow), y), _scale(map_, y)
    if not map_.linear and map_.size(v) > 0.0:
        blow = [each * (SMALL * scale / map_.size(v)) for each in blow]
        v = map_.change(steps(x, blow), y)
    map_.weighed(v)
    size = map_.whole(v)
    if not size > 0.0:
        return np.zeros(1, complex), True
    by, found, since = (scale or 1.0) * (1.0 if map_.linear else SMALL), np.zeros(0, complex), 0
    for H in _arnoldi(steps, (x, y), [v / size], by, MULTIPLIERS):
        values, shapes = np.linalg.eig(H[:-1].astype(complex))
        order = np.argsort(-np.abs(values))
        off = H[-1, -1] * np.abs(shapes[-1, order]) / np.linalg.norm(shapes[:, order], axis=0)
        found = values[order]
        sure = len(found) > 2 and off[0] <= tolerance * max(abs(found[0]), tolerance)
        since = since + 1 if sure else 0
        if since > AGAIN:  # the first that is found need not be the largest: some are hardly struck
            good = off <= max(tolerance, 1e-4) * np.maximum(np.abs(found), tolerance)
            return found[good], True
    return (found, True) if len(found) < MULTIPLIERS else (found[:1], since > 0)


def _resonant(of: PeriodMap, shapes: Sequence[Flat]) -> str:
    """What repeats itself with the period, so that nothing says how large it is."""
    return (
        "analysis.kind: must be a motion whose vibrations die away for a steady motion, got a resonance without "
        f"damping: a natural vibration of about {of.frequency(*shapes):.4g} Hz repeats itself with the period of "
        f"{of.period:.6g} s; give it damping, or another speed"
    )


def _refuse_windings(map_: PeriodMap, x: Flat, y: Flat) -> None:
    """Refuse springs on hinges that go on turning: they are wound up further in each period.

    Raises
    ------
    SolveError
    """
    before, after = (map_.state(each).e[0] for each in (x, y))
    for n, each in enumerate(map_.of.system.constraints):
        depends = isinstance(each.law, Spring) or (
            isinstance(each.law, Curve) and each.law.over == COORDINATE
        )
        winds = any(term.kind == ANGLE for term in each.terms) and abs(after[n] - before[n]) > TURN / 2
        if depends and winds:
            raise SolveError(
                f"{each.name}: must act on a joint that swings for a steady state, got one that goes on turning: its "
                "force grows in each period; take kind = 'transient'"
            )
