"""The public march of a system: from any state, over any stretch of its rigid-body motion, to the state at its end."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.dense import rows_of, work_over_time
from kedfem.dynamics.rigid_body import forcing_of, forcings
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.system.arrays import Bodies, Coefficients, Constraints, Ends
from kedfem.dynamics.system.ends import left_line, line_weights
from kedfem.dynamics.system.forces.stresses import NO_TERMS, Stressed, stressed
from kedfem.dynamics.system.forces.turning_loads import turning
from kedfem.dynamics.system.layout import TOLERANCE, as_arrays, coefficients, factored
from kedfem.dynamics.system.record import System, is_affine, stiffness_factors, without_unknowns
from kedfem.dynamics.system.sparse import Part, solver
from kedfem.dynamics.system.state import Driving, History, State, copied, empty_history, empty_trial, room
from kedfem.errors import SolveError
from kedfem.motion.rigid import RigidMotion

MET, LEFT = -2, -3  # of `step_kernel`
HALVINGS = 6  # a step is taken in up to 2⁶ parts
Motion = Callable[[Float[np.ndarray, " T"]], RigidMotion]
"""Rigid-body motion at given times."""


@dataclass(frozen=True, slots=True)
class Ready:
    """A system made ready for steps of one length: all bodies factored once, everything as flat arrays.

    stressed : stress stiffness on the coordinates, if geometric stiffening counts
    halves : the same for steps half as long, once these have been needed
    """

    system: System
    scheme: Scheme
    c: Coefficients
    parts: list[Part]
    bodies: Bodies
    ends: Ends
    constraints: Constraints
    stressed: Stressed | None = None
    halves: list["Ready"] = field(default_factory=list)


class ConvergenceError(SolveError):
    """Iterations of a step that do not converge, even if the step is divided.

    state, history : what was reached before that step
    taken : steps before it
    moves : the body that changes most from one iteration to the next; empty: a constraint or force law does
    """

    def __init__(self, t: float, state: State, history: History, taken: int, moves: str) -> None:
        name = f"link '{moves}'" if moves else "a joint or force element"
        super().__init__(
            f"analysis: the iterations of a step must converge, got none that do at t = {t:.6g} s; {name} moves most "
            "from one to the next: take a smaller step, or more numerical damping (rho_inf)"
        )
        self.state, self.history, self.taken, self.moves = state, history, taken, moves


class LeftLineError(ConvergenceError):
    """A step at whose end a pin is beyond the line of its slot; `said` says which."""

    def __init__(self, said: str, state: State, history: History, taken: int) -> None:
        SolveError.__init__(self, said)
        self.said, self.state, self.history, self.taken, self.moves = said, state, history, taken, ""


def ready(system: System, scheme: Scheme, tolerance: float = TOLERANCE) -> Ready:
    """Factor all bodies of a system for a scheme."""
    model = system.model
    linear = all(without_unknowns(system, each) or is_affine(system, each) for each in system.constraints)
    single = linear and all(link.fit is None for link in model.links) and system.stiffening is None
    c = coefficients(scheme, model.damping, model.links, single, tolerance)
    parts = factored(model.links, model.joints, c)
    modes = None if system.stiffening is None else stressed(system.stiffening, parts)
    return Ready(system, scheme, c, parts, *as_arrays(system, parts), modes)


Loads = Sequence[Float[np.ndarray, "T _ _"]]
"""P − M R0'' of all bodies over time, world components."""


def driving(of: Ready, motion: RigidMotion, loads: Loads | None = None) -> Driving:
    """The rigid-body motion and loads on all coordinates over the times of a motion.

    Parameters
    ----------
    loads : if they are there already
    """
    model = of.system.model
    forcing = forcings(model, motion) if loads is None else forcing_of(model, motion, loads)
    F = [work_over_time(part, x.F).reshape(len(motion.t), -1) for part, x in zip(of.parts, forcing, strict=True)]
    drives = motion.drives if motion.drives.shape[1] else np.zeros((len(motion.t), 1))
    stations = [line_weights(end, motion) for end in of.system.ends if end.line is not None]
    weights = np.concatenate([np.zeros((len(motion.t), 0)), *stations], axis=1)
    varied = [getattr(each.law, "factor", None) for each in of.system.constraints]
    springs = stiffness_factors(varied, motion.t, motion.phi)
    rows = (motion.t, motion.R, motion.p, motion.v, motion.omega, drives, np.concatenate(F, axis=1), amounts(of, motion))
    terms = NO_TERMS if of.stressed is None else of.stressed.over(forcing, motion)
    # other strides would be compiled for anew
    return Driving(*(np.ascontiguousarray(x) for x in (*rows, weights, springs, *terms)))


def amounts(of: Ready, motion: RigidMotion) -> Float[np.ndarray, "T w"]:
    """Amounts of the loads that turn with bodies over time."""
    every = [load.factor(motion.t, motion.phi) for _, load in turning(of.system.model.loads)]
    return np.stack(every, axis=1) if every else np.zeros((len(motion.t), 0))


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
        from kedfem.dynamics.system.starts.impacts import divided  # which marches

        return divided(of, state, last, between, halvings)
    if not of.halves:
        of.halves.append(shortened(of, of.scheme.h / 2))
    finer = of.halves[0]
    return march(finer, state, between(last - finer.c.h * np.array([1.0, 0.0])), between, halvings - 1)


def shortened(of: Ready, h: float) -> Ready:
    """The same for steps of another length."""
    made = ready(of.system, replace(of.scheme, h=h), of.c.tolerance)
    return replace(made, constraints=of.constraints)


def displacements(of: Ready, k: int, x: Float[np.ndarray, "T N"]) -> Float[np.ndarray, "T n d"]:
    """Rows of body k's state, or of its rates, over time from the coordinates of all bodies."""
    link, bodies = of.system.model.links[k], of.bodies
    own = x[:, bodies.at[k] : bodies.at[k + 1]].reshape(len(x), link.d, link.n)
    return rows_of(link, of.parts[k], own)
