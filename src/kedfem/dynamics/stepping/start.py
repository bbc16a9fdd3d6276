"""Initial states of the elastic motion: at rest, quasi-static, released from initial forces, or steady."""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.coarse import coarse_model
from kedfem.dynamics.stepping.solvers import block_length, steps_of
from kedfem.dynamics.stepping.state import Nodal
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.period.search import periodic
from kedfem.dynamics.system.ready import Motion
from kedfem.dynamics.system.state import State
from kedfem.dynamics.system.steps import Steps
from kedfem.links.record import Link
from kedfem.motion.initial import initial_twists
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene, path_parameter, time_grid
from kedfem.vectors import cross


def motion_of(scene: Scene, linkage: Linkage, along: Path) -> Motion:
    """The rigid-body motion at given times."""
    return lambda t: rigid_motion(linkage, along, t, path_parameter(scene, t))


def started(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> State:
    """The initial state of the elastic motion: at rest, quasi-static, or the steady state of the solver's steps.

    Raises
    ------
    SolveError
        If no quasi-static deflection is found, or no steady state.
    """
    start = begun(scene, linkage, along, model, solver)
    if scene.analysis.kind != "steady":
        return start

    over = period_map(scene, linkage, along, model, solver, solver.search.start(start))
    over.watch = solver.watch
    small = coarse_map(scene, linkage, along, model) if over.linear else None
    solver.steady = periodic(over, scene.analysis.stability, solver.search.closed, small)
    solver.over = None if solver.corotational else over
    return solver.steady.state


def coarse_map(scene: Scene, linkage: Linkage, along: Path, model: Model) -> PeriodMap | None:
    """The map of the steps of the model with its large links reduced; None if it has none."""
    small = coarse_model(scene, linkage, along, model)
    if small is None:
        return None
    solver = steps_of(scene, small)
    start = begun(scene, linkage, along, small, solver)
    return period_map(scene, linkage, along, small, solver, start)


def period_map(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps, start: State) -> PeriodMap:
    """The map of a solver's steps over the period of a steady motion."""
    motion_at = motion_of(scene, linkage, along)
    return PeriodMap(solver.ready, start, motion_at, time_grid(scene).end, block_length(model))


def begun(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> State:
    """The initial state that the scene asks for, as `started`; the search for a steady motion begins there."""
    return solver.start(motion_of(scene, linkage, along), initial_rates(scene, linkage, along, model))


def initial_rates(scene: Scene, linkage: Linkage, along: Path, model: Model) -> list[Nodal]:
    """δ' (n, d) of all links at the start, from the speeds that the scene asks for: rigid motions that the joints allow,
    beside the rigid-body motion.

    Raises
    ------
    MotionError
        If the joints do not allow these speeds together.
    """
    v, omega = initial_twists(scene, linkage, along)
    R = motion_of(scene, linkage, along)(np.zeros(1)).R[0]
    return [rigid_rates(link, R[k], v[k], omega[k]) for link, k in zip(model.links, model.bodies, strict=True)]


def rigid_rates(
    link: Link, R: Float[np.ndarray, "3 3"], v: Float[np.ndarray, "3"], omega: Float[np.ndarray, "3"]
) -> Nodal:
    """Rates of the state of a link rotated by R: velocity v of its reference origin [m/s], angular velocity ω [rad/s]."""
    rates = np.outer(link.one, v) + cross(omega[None], link.X @ R.T)
    if link.kind == "beam":
        rates[:, 2] = omega[2] * link.one
    return np.asarray(rates[:, : link.d])
