"""Motors, springs and loads that turn with links, on quasi-static starts of co-rotational frames beside the system's.

As δ is linear in the few forces Q, Newton's method finds them: Q = law(δ(Q)), its slope from the links' answers to unit
forces, kept from instant to instant and mended by Broyden's formula (Broyden, 1965).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.action import TURN, Action, elastic_vectors, kernel_table, nominal_vectors
from kedfem.dynamics.state import Nodal, NodalOf, Nominal
from kedfem.errors import SolveError
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion

SWEEPS = 30
ANEW = 8  # sweeps after which the slope is found anew
SETTLED = 1e-11  # change of a force, of its largest value so far
ROUNDING = 1e-14
NUDGE = 1e-7  # displacement for slopes, of the links' size

Vectors = Float[np.ndarray, "A 2 2 3"]
Each = Float[np.ndarray, " A"]
Law = Callable[[Sequence[NodalOf], Sequence[NodalOf]], "Found"]
State = tuple[Sequence[NodalOf], Sequence[NodalOf]]
Answer = Callable[[Sequence[Nodal]], State]
Deflection = Callable[[int, Sequence[Nodal]], list[NodalOf]]


@dataclass(frozen=True, slots=True)
class Found:
    """What laws ask for: forces Q, their directions ∂q/∂x on the ends, and the coordinates q."""

    Q: Each
    directions: Vectors
    q: Each


class Forces:
    """Actions at a time, from their ends' positions and rates; turns are counted on from time to time."""

    def __init__(self, every: Sequence[Action], links: Sequence[Link], h: float) -> None:
        self.every, self.links, self.table = every, links, kernel_table(every)
        self._unit = kernel_table(
            [replace(x, stiffness=0.0, damping=0.0, over=0, at=(0.0,), value=(1.0,)) for x in every]
        )
        self.turned = np.zeros(len(every))
        self.size = max(link.size for link in links)
        per = np.array([1.0 if x.kind == TURN else self.size for x in every])
        self.rounding = ROUNDING * per * np.array([x.stiffness + x.damping / h for x in every])

    def nominal(self, motion: RigidMotion) -> tuple[Float[np.ndarray, "T A 2 2 3"], ...]:
        """Positions and rates of all ends of links that do not deform."""
        found = [[nominal_vectors(end, motion) for end in action.ends] for action in self.every]
        x, v = (np.array([[end[i] for end in ends] for ends in found]) for i in (0, 1))
        return np.moveaxis(x, 2, 0), np.moveaxis(v, 2, 0)

    def law(self, t: float, x: Vectors, v: Vectors) -> Law:
        """(δ, δ') of all links → what their positions ask for, x and v being those of links that do not deform."""
        from kedfem.dynamics.actions_kernel import evaluate

        def found(u: Sequence[NodalOf], rates: Sequence[NodalOf]) -> Found:
            at, moving = x + self._seen(u), v + self._seen(rates)
            (forces, directions), (values, units) = np.zeros((2, *x.shape)), np.zeros((2, len(x), 4))
            evaluate(t, at, moving, self.turned, self.table, forces, values)
            evaluate(t, at, moving, self.turned, self._unit, directions, units)
            return Found(values[:, 2], directions, values[:, 0])

        return found

    def _seen(self, u: Sequence[NodalOf]) -> Vectors:
        """What the ends have of the displacements of their links."""
        out = np.zeros((len(self.every), 2, 2, 3))
        for each, action in zip(out, self.every, strict=True):
            for moved, end in zip(each, action.ends, strict=True):
                if end.k >= 0:
                    moved[:] = elastic_vectors(end, u[end.k][None])[0]
        return out

    def borne(self, Q: Each, directions: Vectors) -> list[Nodal]:
        """What forces on the ends are on the rows (n, d) of all links."""
        out = [np.zeros((link.n, link.d)) for link in self.links]
        for force, each, action in zip(Q, directions, self.every, strict=True):
            for f, end in zip(each, action.ends, strict=True):
                if end.k >= 0:
                    rows = out[end.k]
                    rows += force * end.weights.T @ (f[: len(end.weights)] * end.mask)[:, : rows.shape[1]]
        return out

    def slope(self, law: Law, now: Found, answer: Answer, base: State) -> Float[np.ndarray, "A A"]:
        """∂law/∂Q: what a unit of each force changes of all.

        Parameters
        ----------
        answer : δ and δ' under more forces on the rows; base: those without
        """
        out = np.zeros((len(self.every),) * 2)
        for i, unit in enumerate(np.eye(len(self.every))):
            moved = answer(self.borne(unit, now.directions))
            change = [[a - b for a, b in zip(x, y, strict=True)] for x, y in zip(moved, base, strict=True)]
            most = max(float(np.abs(x).max(initial=0.0)) for x in change[0])
            part = NUDGE * self.size / (most or 1.0)
            u, v = (
                [b + part * c for b, c in zip(y, x, strict=True)] for x, y in zip(change, base, strict=True)
            )
            out[:, i] = (law(u, v).Q - now.Q) / part
        return out


def solved(
    forces: Forces,
    law: Law,
    answer: Answer,
    begin: Found,
    slope: Float[np.ndarray, "A A"] | None,
    least: Each,
) -> tuple[Found, list[Nodal], Float[np.ndarray, "A A"]] | None:
    """Forces that links ask for under just these forces, what they are on the rows, and the slope; None if not found.

    Parameters
    ----------
    answer : forces on the rows → δ and δ' of all links; asked last for the forces that are found
    begin : forces to begin with
    least : changes that are settled
    """
    Q, directions, step, before = begin.Q, begin.directions, None, None
    for sweep in range(SWEEPS):
        rows = forces.borne(Q, directions)
        state = answer(rows)
        now = law(*state)
        left = now.Q - Q
        if not np.isfinite(left).all():
            return None
        if slope is None or sweep % ANEW == ANEW - 1:
            slope = forces.slope(law, now, partial(_beside, answer, rows), state)
            answer(rows)
        elif step is not None and before is not None and step.any():
            slope = slope + np.outer(left - before - (slope @ step - step), step) / (step @ step)
        A = np.eye(len(Q)) - slope
        step, before = np.linalg.solve(A, left), left
        turned = np.abs(Q) * np.abs(now.directions - directions).reshape(len(Q), -1).max(axis=1)
        enough = np.maximum(
            np.maximum(least, SETTLED * np.abs(now.Q)), forces.rounding / np.maximum(1.0, np.abs(np.diag(A)))
        )
        if (np.maximum(np.abs(step), turned) <= enough).all():
            return Found(Q, directions, now.q), rows, slope
        Q, directions = Q + step, now.directions
    return None


def _beside(answer: Answer, rows: Sequence[Nodal], more: Sequence[Nodal]) -> State:
    return answer([x + y for x, y in zip(rows, more, strict=True)])


def loaded(at: Sequence[Nominal], rows: Sequence[Nodal]) -> list[Nominal]:
    """Nominal orientation and load of all links, with more forces."""
    return [replace(now, F=now.F + x) for now, x in zip(at, rows, strict=True)]


def _still(deflection: Deflection, k: int, still: Sequence[Nodal], rows: Sequence[Nodal]) -> State:
    return deflection(k, rows), still


def still_forces(forces: Forces, motion: RigidMotion, deflection: Deflection) -> list[list[Nodal]]:
    """Forces of actions on the rows of all links that deflect quasi-statically under them, at each time point.

    The rate of the deflection is not seen by dampers and curves over speed.

    Parameters
    ----------
    deflection : of all links at a time point under more forces

    Raises
    ------
    SolveError
        If the sweeps do not settle.
    """
    x, v = forces.nominal(motion)
    still, out, slope = [np.zeros((link.n, link.d)) for link in forces.links], [], None
    for k, t in enumerate(motion.t):
        law = forces.law(float(t), x[k], v[k])
        begin = law(still, still)
        found = solved(
            forces, law, partial(_still, deflection, k, still), begin, slope, np.zeros(len(begin.Q))
        )
        if found is None:
            raise SolveError(
                "analysis.initial: must be a deflection under springs and motors that can be found, got none: "
                'take initial = "rest"'
            )
        _, rows, slope = found
        out.append(rows)
    return out
