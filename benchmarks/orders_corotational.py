"""Schemes with co-rotational frames: error against passes, whose processor time is that of the solver's own steps.

Diagonally implicit stages are solved by the solver's own compiled passes; coupled ones, a complex pair, here, densely.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from time import process_time
from typing import Any

import numpy as np
import scipy.linalg
from jaxtyping import Float

from benchmarks.orders_equation import SEEN, TURN, TURNS, Equation, Mechanism, Run
from benchmarks.orders_kernel import force_at, solved_often, staged
from benchmarks.orders_schemes import Scheme, Tableau, extrapolated, is_coupled
from kedfem.dynamics.anderson import AndersonAcceleration
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.stepping.scheme import Scheme as Newmark
from kedfem.dynamics.system.arrays import Coefficients
from kedfem.dynamics.system.ready import Ready, driving, ready
from kedfem.dynamics.system.reference import by_address
from kedfem.dynamics.system.sparse import solver
from kedfem.dynamics.system.state import copied, empty_trial, room

LARGE = 100  # unknowns from which on marches are shorter
COUNT, SOLVES = 500, 25  # solves that are timed together, how often
ITERATIONS = 40
COARSE, FINE, REPEATS = 800, 12_800, 5  # steps of the runs that show what a step and a pass cost
Flat = Float[np.ndarray, " N"]
Stages = Float[np.ndarray, "s F"]


@dataclass(frozen=True)
class Costs:
    """Processor time of a step without its passes, of a pass, and of its solve, real or with complex matrices [s]."""

    step: float
    one: float
    real: float
    pair: float

    @property
    def coupled(self) -> float:
        """A pass of two coupled stages, of a pass: forces of both, and one solve with complex matrices."""
        return (2 * (self.one - self.real) + self.pair) / self.one


class Corotational(Mechanism):
    """A mechanism with co-rotational frames, whose joints share points."""

    def __init__(self, raw: Mapping[str, Any]) -> None:
        super().__init__({**raw, "analysis": {**raw["analysis"], "frames": "co-rotational"}})
        self.size = max(link.size for link in self.model.links)
        self.equation = Equation(self)

    def levels(self, steps: int, count: int) -> tuple[Float[np.ndarray, "S N"], float]:
        """Levels of generalised-α, and their work in passes."""
        runs = [self.alpha(steps * 2**k) for k in range(count)]
        work = sum(x.passes for x in runs) + self.beginning * steps * (2**count - 1)
        return extrapolated([x.u for x in runs]), work

    def truth(self, steps: int, count: int) -> tuple[Run, Float[np.ndarray, "S N"]]:
        """Levels of so many steps; and those without the coarsest, which show how far off the truth is."""
        runs = [self.alpha(steps * 2**k) for k in range(count)]
        fine = runs[-1]
        return Run(extrapolated([x.u for x in runs]), 0, 0.0, fine.energy), extrapolated([x.u for x in runs[1:]])

    @property
    def large(self) -> bool:
        """Whether marches are to be shorter."""
        return int(self.of.bodies.at[-1]) > LARGE

    @cached_property
    def costs(self) -> Costs:
        """Processor times, least of some runs."""
        rows, seconds = [], []
        for steps in (COARSE // 2, FINE // 8) if self.large else (COARSE, FINE):
            runs = [self.alpha(steps) for _ in range(REPEATS)]
            rows.append((steps, runs[0].passes))
            seconds.append(min(x.seconds for x in runs))
        step, one = np.linalg.solve(np.array(rows, float), seconds)
        return Costs(max(0.0, float(step)), float(one), *self._solves())

    def _solves(self) -> tuple[float, float]:
        """Processor time of the solve of a pass, with real and with complex matrices, timed in turn."""
        times = []
        for _ in range(SOLVES + 1):
            times.append([self._solve(float), self._solve(complex)])
        real, pair = np.min(times[1:], axis=0)
        return float(real), float(pair)

    def _solve(self, kind: type) -> float:
        of, state = self.of, self.state
        trial = empty_trial(of.bodies, of.ends, of.constraints, state)
        trial.Rp[:], trial.inverse[:], trial.r[:] = np.eye(3), 1.0, 1.0
        names = ("r", "reaction", "w", "force", "SRB", "K", "inverse", "x", "dz", "right", "held")
        trial = trial._replace(**{name: getattr(trial, name).astype(kind) for name in names})
        bodies = of.bodies._replace(**{name: getattr(of.bodies, name).astype(kind) for name in "GYS"})
        since = process_time()
        solved_often(by_address(bodies), COUNT, by_address(trial), np.zeros(len(trial.u), kind))
        return (process_time() - since) / COUNT

    @property
    def beginning(self) -> float:
        """A step without its passes, of a pass."""
        return self.costs.step / self.costs.one

    def march(self, scheme: Scheme, steps: int) -> tuple[Float[np.ndarray, "S N"], float]:
        """Coordinates at `SEEN` instants, and the work in passes."""
        if scheme.tableau is None:
            return self.levels(steps, scheme.levels)
        if is_coupled(scheme.tableau):
            return Coupled(self, scheme.tableau, steps).marched()
        u, passes = self._in_turn(scheme.tableau, steps)
        return u, passes + self.beginning * steps * scheme.solves

    def _in_turn(self, tableau: Tableau, steps: int) -> tuple[Float[np.ndarray, "S N"], int]:
        A, b, c = tableau
        h, state = TURN * TURNS / steps, copied(self.state)
        of, own, inside = stage_numbers(self, h, float(A.diagonal().max()))
        along = driving(of, self.motion_at(((np.arange(steps)[:, None] + c) * h).clip(0.0).ravel()))
        trial = empty_trial(of.bodies, of.ends, of.constraints, state)
        solved = solver(of.parts, of.bodies.at, trial)
        records = (own, inside, of.bodies, of.ends, of.constraints, along)
        found, passes, failed = staged(
            *map(by_address, records), (A, b, c, h), self.size, steps // SEEN,
            *map(by_address, (state, trial, room(of.bodies))), solved,
        )  # fmt: skip
        return np.where(failed, np.nan, found), passes

    def errors(self, truth: Run) -> "Errors":
        """What measures errors against a run."""
        return Errors(self, truth)


def stage_numbers(of: Corotational, h: float, share: float) -> tuple[Ready, Coefficients, Coefficients]:
    """The system made ready for stages of a factor, their numbers, and these with zeros for those of the history."""
    g, zero = share * h, np.zeros(3)
    made = ready(of.of.system, Newmark(h, 0.0, 0.0, share**2, share), of.of.c.tolerance)
    own = made.c._replace(acceleration=np.array([1 / g**2, 0, 0]), rate=np.array([1 / g, 0, 0]), late=g, early=0.0)
    return made, own, own._replace(acceleration=zero, rate=zero, late=0.0)


class Errors:
    """Largest error in time in the norm of strain energy as frames see it along a run, of that run's largest."""

    def __init__(self, of: Corotational, truth: Run) -> None:
        self.of, self.truth = of.equation, of.equation.unknowns(truth.u)
        force = Force(of, TURN * TURNS / SEEN * np.arange(1, SEEN + 1))
        turns = [force.turns(n, u) for n, u in enumerate(truth.u)]
        self.K = np.array([np.tensordot(x, self.of.K, 1) for x in turns])
        self.size = np.sqrt(2 * truth.energy.max())

    def __call__(self, u: Float[np.ndarray, "S N"]) -> float:
        """Of coordinates."""
        if not np.isfinite(u).all():
            return float("inf")
        off = self.of.unknowns(u) - self.truth
        return float(np.sqrt(np.abs(np.einsum("ti,tij,tj->t", off, self.K, off)).max()) / self.size)


class Force:
    """Internal and applied forces on coordinates at some times."""

    def __init__(self, of: Corotational, t: Flat) -> None:
        self.size, self.bodies, self.state = of.size, of.of.bodies, copied(of.state)
        self.along, self.work = driving(of.of, of.motion_at(t)), room(of.of.bodies)
        self.trial = empty_trial(self.bodies, of.of.ends, of.of.constraints, self.state)
        self.c = stage_numbers(of, 1.0, 1.0)[2]._replace(late=1.0)

    def __call__(self, n: int, u: Flat, v: Flat) -> Flat:
        """Applied less internal force at the time of a number."""
        self.trial.u[:] = self.state.u[:] = u
        self.state.v[:] = v
        c, bodies, along = map(by_address, (self.c, self.bodies, self.along))
        force_at(c, bodies, along, n, self.size, *map(by_address, (self.state, self.trial, self.work)))
        return np.asarray(self.along.F[n] - self.trial.f)

    def turns(self, n: int, u: Flat) -> Flat:
        """1, cos θ, sin θ, cos 2θ, sin 2θ of all bodies as their frames see them."""
        self(n, u, 0 * u)
        c, s = self.trial.Rp[:, 0, 0], self.trial.Rp[:, 1, 0]
        return np.stack([np.ones_like(c), c, s, c * c - s * s, 2 * c * s], axis=1).ravel()


class Coupled:
    """A march with two coupled stages: quasi-Newton iterations with the frames' stiffness, one complex matrix a step."""

    def __init__(self, of: Corotational, tableau: Tableau, steps: int) -> None:
        self.of, self.steps, self.h = of, steps, TURN * TURNS / steps
        self.A, self.b, self.c = tableau
        equation, model = of.equation, of.model
        L = np.linalg.cholesky(equation.M)
        inverse = np.linalg.inv(L)
        self.K, self.C = (inverse @ x @ inverse.T for x in (equation.K, equation.C))
        parts = zip(model.links, of.of.parts, pairwise(equation.at), strict=True)
        self.Q = np.concatenate([  # coordinates, from unknowns whose mass is one
            np.array([coordinates(link, part, x.reshape(link.n, link.d)).ravel() for x in equation.T[a:b].T]).T
            for link, part, (a, b) in parts
        ]) @ inverse.T  # fmt: skip
        self.force = Force(of, ((np.arange(steps)[:, None] + self.c) * self.h).ravel())
        self.anderson, self.passes = AndersonAcceleration(), 0

    def marched(self) -> tuple[Float[np.ndarray, "S N"], float]:
        """Coordinates at `SEEN` instants, and the work in passes: by what forces, and solves of either kind, cost."""
        state, out = self.of.state, []
        q, v, a = (self.Q.T @ x for x in (state.u, state.v, state.a))
        a = np.stack([a, a])
        for k in range(self.steps):
            a = self._stages(k, q, v, a)
            q = q + self.h * v + self.h**2 * (self.b @ self.A) @ a
            v = v + self.h * self.b @ a
            if (k + 1) % (self.steps // SEEN) == 0:
                out.append(self.Q @ q)
        costs = self.of.costs
        begun = self.steps * self.of.beginning * costs.pair / costs.real
        return np.array(out), self.passes * costs.coupled + begun

    def _stages(self, k: int, q: Flat, v: Flat, before: Stages) -> Stages:
        """Accelerations of both stages; those of the step before serve as a guess, drawn on."""
        h, A, c, Q = self.h, self.A, self.c, self.Q
        slope = (before[1] - before[0]) / (c[1] - c[0])
        a = before[1] + np.outer(1 + c - c[1], slope)
        solve = self._inverse(self.force.turns(2 * k, Q @ (q + h * c[0] * v + h * h * (A @ A @ a)[0])))
        self.anderson.begin()
        for _ in range(ITERATIONS):
            X, V = q + h * np.outer(c, v) + h * h * A @ A @ a, v + h * A @ a
            left = np.array([Q.T @ self.force(2 * k + i, Q @ X[i], Q @ V[i]) for i in range(2)]) - a
            change = h * h * A @ A @ solve(left)
            self.passes += 1
            size, moved = np.linalg.norm(change), np.linalg.norm(X - q)
            if not np.isfinite(size):
                return np.full_like(a, np.nan)
            settled = size <= self.of.of.c.tolerance * moved + self.of.of.c.floor
            taken = change if settled else self.anderson.step(change.ravel()).reshape(change.shape)
            a = a + np.linalg.solve(h * h * A @ A, taken)
            if settled:
                return np.asarray(a)
        return np.full_like(a, np.nan)

    def _inverse(self, turns: Flat) -> Any:
        """What solves (1 + h A ⊗ C + h² A² ⊗ K) a = r: A's eigenvalues are a pair, and so are the solutions."""
        K, C = np.tensordot(turns, self.K, 1), np.tensordot(turns, self.C, 1)
        values, P = np.linalg.eig(self.A)
        z = self.h * values[0]
        factor = scipy.linalg.lu_factor(np.eye(len(K)) + z * C + z * z * K)
        first = np.linalg.inv(P)[0]

        def solve(r: Stages) -> Stages:
            return np.asarray(2 * np.outer(P[:, 0], scipy.linalg.lu_solve(factor, first @ r)).real)

        return solve
