"""Time integration of a system from any state over any part of its rigid-body motion, to the state at its end."""

from collections.abc import Callable
from dataclasses import replace
from typing import cast

import numpy as np

from kedfem.dynamics.system.ends import left_line
from kedfem.dynamics.system.ready import Loads, Motion, Ready, driving, shortened
from kedfem.dynamics.system.sparse import solver
from kedfem.dynamics.system.starts.impacts import apart_from, met_at, pushed, without
from kedfem.dynamics.system.state import Driving, History, State, copied, empty_history, empty_trial, room
from kedfem.errors import SolveError
from kedfem.motion.rigid import RigidMotion

MET, LEFT = -2, -3  # of `step_kernel`
HALVINGS = 6  # a step is taken in up to 2⁶ parts
NEAR = 1e-2  # of a step: a stop that is met so near to its beginning or end is met there


class ConvergenceError(SolveError):
    """Iterations of a step that do not converge, even if the step is divided.

    state, history : what was reached before that step
    taken : steps before it
    moves : the body that changes most from one iteration to the next; empty: a constraint or force law does
    """

    def __init__(self, t: float, state: State, history: History, taken: int, moves: str) -> None:
        name = f"link '{moves}'" if moves else "a joint or force element"
        super().__init__(
            f"analysis: the iterations of each step must converge, got no convergence at t = {t:.6g} s; {name} moves "
            "most from one to the next: take a smaller step, or more numerical damping (rho_inf)"
        )
        self.state, self.history, self.taken, self.moves = state, history, taken, moves


class LeftLineError(ConvergenceError):
    """A step at whose end a pin is beyond the line of its slot; `said` says which."""

    def __init__(self, said: str, state: State, history: History, taken: int) -> None:
        SolveError.__init__(self, said)
        self.said, self.state, self.history, self.taken, self.moves = said, state, history, taken, ""


def march(
    of: Ready, state: State, motion: RigidMotion, between: Motion | None = None, halvings: int = HALVINGS,
    loads: Loads | None = None,
) -> tuple[State, History]:  # fmt: skip
    """All steps to the times of a motion, one after the other; the state that is given stays as it is.

    Parameters
    ----------
    motion : at the ends of the steps
    between : rigid-body motion at any times: a step whose iterations do not converge is then taken in 2, 4, 8, … parts,
        one in which a stop with damping is met in two
    loads : see `driving`

    Raises
    ------
    ConvergenceError
        If the iterations of a step do not: with its time, the body that moves most, and all that came before.
    LeftLineError
        If a pin slides beyond the line of its slot.
    """
    from kedfem.dynamics.system.reference import by_address

    constraints = of.constraints
    if between is None or not halvings:
        constraints = constraints._replace(jumps=np.zeros_like(constraints.jumps))
    none = not len(constraints.law)  # what they need is not compiled then
    related = (None, None) if none else (of.ends, constraints)
    state, along, T, done = copied(state), driving(of, motion, loads), len(motion.t), 0
    history = empty_history(T, of.bodies, of.constraints, along.F)
    trial, work = empty_trial(of.bodies, of.ends, constraints, state), room(of.bodies)
    solved, marched = solver(of.parts, of.bodies.at, trial), compiled_steps(of)
    constant, rooms = [by_address(x) for x in (of.c, of.bodies, *related)], [by_address(x) for x in (trial, work)]
    while done < T:
        left = _since(along, done), History(*(x[done:] for x in history))
        with solved.watched():
            now, rows = by_address(left[0]), by_address(left[1])
            taken, worst = marched(*constant, now, by_address(state), *rooms, rows, solved)
        solved.check()
        done += int(taken)
        if done < T:
            last, before = float(motion.t[done]), History(*(x[:done] for x in history))
            if worst <= LEFT:
                line = int(of.ends.line[LEFT - worst])
                raise LeftLineError(left_line(of.system, line, last), state, before, done)
            if between is None or not halvings:
                moves = of.system.names[worst] if worst >= 0 else ""
                raise ConvergenceError(last, state, before, done, moves)
            try:
                state, parts = _in_parts(of, state, last, between, halvings, worst == MET)
            except LeftLineError as failed:
                raise LeftLineError(failed.said, state, before, done) from None
            except ConvergenceError as failed:
                raise ConvergenceError(last, state, before, done, failed.moves) from None
            for row, found in zip(history, parts, strict=True):
                row[done : done + 1] = found[-1:]  # none of what only sparse bodies have
            done += 1
    return state, history


def _since(along: Driving, done: int) -> Driving:
    """What is left of a motion after some of its times."""
    tables = {name: getattr(along, name) for name in ("terms_at", "entries_at", "entries")}
    return Driving(*(x[done:] for x in along))._replace(**tables)


def compiled_steps(of: Ready) -> Callable[..., tuple[int, int]]:
    """The compiled steps that a system needs: imported, and compiled, when they are."""
    if of.c.single:
        from kedfem.dynamics.system.linear_kernel import marched_linear

        return cast("Callable[..., tuple[int, int]]", marched_linear)
    from kedfem.dynamics.system.step_kernel import marched

    return cast("Callable[..., tuple[int, int]]", marched)


def _in_parts(of: Ready, state: State, last: float, between: Motion, halvings: int, met: bool) -> tuple[State, History]:
    """One step in two, each of these in two again where it must be; where a stop is met if that is why."""
    if met:
        return _divided_at_stop(of, state, last, between, halvings)
    if not of.halves:
        of.halves.append(shortened(of, of.scheme.h / 2))
    finer = of.halves[0]
    return march(finer, state, between(last - finer.c.h * np.array([1.0, 0.0])), between, halvings - 1)


def _divided_at_stop(of: Ready, state: State, last: float, between: Motion, halvings: int) -> tuple[State, History]:
    """One step in which a stop with damping is met, in two parts; shorter ones would end with accelerations that predict
    nothing of the next step.

    Parameters
    ----------
    last : end of the step [s]
    between : rigid-body motion at any times
    halvings : how often parts may be divided
    """
    begins = float(state.time[0])
    h = last - begins
    apart = apart_from(of.constraints, state.e[0]) & (state.multiplier == 0.0)
    free = replace(of, constraints=without(of.constraints, apart), halves=[])
    alone, reached = march(free, state, between(np.array([last])), between, halvings - 1)
    share = np.where(apart, met_at(of.constraints, state, reached, h), np.inf)
    first = float(share.min())
    if not np.isfinite(first):  # another force brings it there, such as that of a stop which is met in the same step
        return march(of, state, between(np.array([last])), between, 0)
    met = share <= first + NEAR
    if first >= 1 - NEAR:
        return pushed(of, alone, between, met), reached
    if first > NEAR:
        to = np.array([begins + first * h])
        state, _ = march(shortened(free, first * h), state, between(to), between, halvings - 1)
        h *= 1 - first
    rest = shortened(of, h)
    state = pushed(rest, state, between, met)
    return march(rest, state, between(np.array([last])), between, halvings - 1)
