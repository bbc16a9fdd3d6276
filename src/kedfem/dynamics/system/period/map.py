"""The period map: from the state at the start of a period, as a vector, to the state at its end.

The vector has all variables of a step but the time and the memory of Anderson acceleration, which only saves iterations.
Its norm is √(u K u + ω² u M u + v M v), ω = 2π/T: the rest of a state follows from displacements and rates, but for the
part that numerical damping removes, which has a small weight (`weighed`).

Sums of states of a linear system are states. With co-rotational frames the nonlinear functions of displacements are
computed anew (`possible`): strains, rotations of points, coordinates. A march would keep their errors for ever.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.system.arrays import ends_of
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.starts.instant import TURN, Flat, Instant, Motion, term_angles
from kedfem.dynamics.system.starts.internal_forces import own, put_momenta, store_internal_state
from kedfem.dynamics.system.state import History, State, copied
from kedfem.motion.rigid import RigidMotion

VECTOR_FIELDS = (
    "u", "v", "a", "F", "f", "damped", "momentum", "seen", "Q", "angle", "strain", "direction", "turn", "port_force",
    "z", "e", "term_angles", "bearing", "multiplier",
)  # fmt: skip
BLOW, SHORTEST = 0.05, 8.0  # of the period, and steps at least: what a blow lasts, and excites
SWUNG = ("a", "port_force", "bearing", "multiplier")  # in which steps alternate, by ρ∞ less from step to step
HIDDEN = 1e-4  # of the energy: what these count
ANGLES = ("angle", "turn", "term_angles")  # which may have gone on by whole revolutions


StateArrays = Mapping[str, Any]
"""Arrays of a state by name, those that a vector is made of."""
Watch = Callable[[int], None]
"""Called with the number of periods that were marched so far."""


def state_arrays(state: State) -> StateArrays:
    """What a vector of a state is made of."""
    return {name: getattr(state, name).copy() for name in VECTOR_FIELDS}


class PeriodMap:
    """A march over one period, again and again.

    Parameters
    ----------
    start : any state of the system, where a search begins
    period : whole number of steps [s]
    length : time points whose history is held at once
    watch : called after each march
    steps : in the period; marches : periods so far; largest : largest energy of deformation in the last one, twice [J]
    """

    def __init__(self, of: Ready, start: State, motion_at: Motion, period: float, length: int) -> None:
        self.of, self.motion_at, self.linear = of, motion_at, of.c.single
        self.marches, self.largest, self.start = 0, 0.0, copied(start)
        self.watch: Watch = lambda marched: None
        self.steps = steps = round(period / of.c.h)
        t = of.c.h * np.arange(1, steps + 1)
        self._parts = [motion_at(t[k : k + length]) for k in range(0, steps, length)]
        ends = ends_of([getattr(start, name).size for name in VECTOR_FIELDS])
        self._at = {name: slice(int(ends[k]), int(ends[k + 1])) for k, name in enumerate(VECTOR_FIELDS)}
        self.period, self._omega = period, TURN / period
        self._weights: dict[str, float] = {}
        self._now = Instant(of, motion_at, 0.0)

    @property
    def speed_words(self) -> str:
        """The mean speed of a drive that rotates continuously, in words; else nothing."""
        first, last = self.motion_at(np.array([0.0, self.period])).phi
        turns = abs(float(last - first)) / TURN  # a slide that comes back has none
        return f", at {60 * turns / self.period:.6g} rpm" if turns > 0.5 else ""

    def vector(self, state: State) -> Flat:
        """A state as a vector."""
        return np.concatenate([getattr(state, name).ravel() for name in VECTOR_FIELDS])

    def state(self, x: Flat) -> State:
        """A vector as the state at the beginning of the period."""
        like = copied(self.start)
        for name in VECTOR_FIELDS:
            getattr(like, name)[...] = x[self._at[name]].reshape(getattr(like, name).shape)
        for name in ("time", "pairs", "products", "last", "counts"):
            getattr(like, name)[...] = 0.0
        return like

    def __call__(self, x: Flat, blow: Sequence[Float[np.ndarray, "n d"]] | None = None) -> Flat:
        """The vector after a period.

        Parameters
        ----------
        blow : forces on all links, world components [N], that swell up and down at the beginning of the period

        Raises
        ------
        ConvergenceError
        """
        self.largest, self.marches = 0.0, self.marches + 1
        state = self.start
        for state, found in self._marched(x, blow):  # noqa: B007 - the last one counts
            self.largest = max(self.largest, 2 * float(found.energy.sum(axis=1).max()))
        self.watch(self.marches)
        return self.vector(state)

    def histories(self, x: Flat) -> Iterator[tuple[RigidMotion, History]]:
        """Rigid motion and states over the period, part by part."""
        for part, (_, found) in zip(self._parts, self._marched(x), strict=True):
            yield part, found

    def _marched(
        self, x: Flat, blow: Sequence[Float[np.ndarray, "n d"]] | None = None
    ) -> Iterator[tuple[State, History]]:
        state, done = self.state(x), 0
        between = None if self.linear else self.motion_at
        for part in self._parts:
            loads = None if blow is None else self._struck(part, blow, done)
            state, found = march(self.of, state, part, between, loads=loads)
            done += len(part.t)
            yield state, found

    def _struck(
        self, part: RigidMotion, blow: Sequence[Float[np.ndarray, "n d"]], done: int
    ) -> list[Float[np.ndarray, "T n d"]]:
        over = max(BLOW * self.steps, SHORTEST)
        pulse = np.where((k := done + 1 + np.arange(len(part.t))) < over, np.sin(np.pi * k / over) ** 2, 0.0)
        every = zip(forcings(self.of.system.model, part), blow, strict=True)
        return [each.F + pulse[:, None, None] * more for each, more in every]

    def change(self, after: Flat, before: Flat) -> Flat:
        """The difference of two vectors; angles that have gone on by whole revolutions are the same."""
        out = np.asarray(after - before)
        for name in ANGLES:
            here = self._at[name]
            out[here] -= TURN * np.round(out[here] / TURN)
        return out

    def possible(self, x: Flat) -> Flat:
        """A vector whose displacements were added up, with what follows from them."""
        if self.linear:
            return x
        state, was, now = self.state(x), self.state(x), self._now
        for k, each in enumerate(now.internal_states(state.u, state.v)):
            store_internal_state(self.of, k, each, state)
        state.f[:], state.damped[:], state.strain[1:] = was.f, was.damped, was.strain[1:]
        state.seen[1:] = was.seen[1:]
        z = now.interface(state.u)
        state.z[0, now.always.number] = z
        state.e[0] = now.coordinates(np.stack([z, 0 * z, 0 * z]))[0]
        state.term_angles[:] = term_angles(now, z)
        return self.vector(state)

    def complete(self, state: State) -> None:
        """Give a difference of states of a linear system what follows from its displacements, rates, accelerations."""
        for k, each in enumerate(self._now.internal_states(state.u, state.v)):
            store_internal_state(self.of, k, each, state)
        put_momenta(self.of, state)

    def weighed(self, like: Flat) -> None:
        """Count accelerations and forces too, as far as the method's own swing in them is not damped away in a period.

        By HIDDEN of the energy that a vector has, where they are as large as there.
        """
        self._weights = {}
        energy = self.size(like) ** 2
        for name in SWUNG:
            here = like[self._at[name]]
            if (most := float(here @ here)) > 0.0:
                self._weights[name] = HIDDEN * energy / most

    def products(self, basis: Sequence[Flat], x: Flat) -> Flat:
        """u K u₁ + ω² u M u₁ + v M v₁ of vectors with another, and what is `weighed` [J]; links are undeformed."""
        dual = self._energy(x)
        dual += [(self._at[name], weight * x[self._at[name]]) for name, weight in self._weights.items()]
        return np.array([sum(y[here] @ each for here, each in dual) for y in basis])

    def size(self, x: Flat) -> float:
        """√ of twice the energy of a vector [J^½]."""
        return float(np.sqrt(max(sum(x[here] @ each for here, each in self._energy(x)), 0.0)))

    def whole(self, x: Flat) -> float:
        """√ of the product of a vector with itself [J^½]."""
        return float(np.sqrt(max(self.products([x], x)[0], 0.0)))

    def _energy(self, x: Flat) -> list[tuple[slice, Flat]]:
        u, _, Mu, Mv = self._moving(x)
        return [(self._at["u"], self._forced(u) + self._omega**2 * Mu), (self._at["v"], Mv)]

    def frequency(self, *shapes: Flat) -> float:
        """At which a vibration of these shapes swings, from its energies [Hz]."""
        moving = [self._moving(x) for x in shapes]
        strained = sum(float(u @ self._forced(u)) for u, _, _, _ in moving)
        moved = sum(float(u @ Mu) for u, _, Mu, _ in moving)
        return float(np.sqrt(max(strained, 0.0) / moved) / TURN) if moved > 0.0 else 0.0

    def _forced(self, u: Flat) -> Flat:
        """R K0 Rᵀ u of all bodies, R at the beginning of the period."""
        still = self._now.always.static
        every = (still.sprung(k, R, u[own(self.of, k)]) for k, R in enumerate(self._now.R))
        return np.concatenate(list(every))

    def _moving(self, x: Flat) -> tuple[Flat, Flat, Flat, Flat]:
        """u, v, M u, M v; coordinates of dense bodies have unit mass."""
        u, v = x[self._at["u"]], x[self._at["v"]]
        momentum = x[self._at["momentum"]].reshape(3, -1)
        Mu, Mv, bodies = u.copy(), v.copy(), self.of.bodies
        for k in np.flatnonzero(bodies.dense == 0):
            here = slice(int(bodies.at[k]), int(bodies.at[k + 1]))
            Mu[here], Mv[here] = momentum[:2, here]
        return u, v, Mu, Mv
