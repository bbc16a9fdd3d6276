"""How the elastic motion begins: at rest, quasi-static, from loads that are let go, or in its steady state."""

from dataclasses import replace

import numpy as np

from kedfem.dynamics.joints.first_rows import FIRST, INSTANTS
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.coarse import coarse_model
from kedfem.dynamics.rigid_body import instants, rows_at_start
from kedfem.dynamics.stepping.solvers import block_length, dampers_count, steps_of
from kedfem.dynamics.stepping.start import Deflected, initial_rates, initial_states, quasi_static
from kedfem.dynamics.stepping.state import LinkState
from kedfem.dynamics.stiffening import Stiffening
from kedfem.dynamics.system.march import Motion
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.period.search import periodic
from kedfem.dynamics.system.starts.initial_states import from_links
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.state import State
from kedfem.dynamics.system.steps import Steps
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene, path_parameter, time_grid


def motion_of(scene: Scene, linkage: Linkage, along: Path) -> Motion:
    """The rigid-body motion at given times."""
    return lambda t: rigid_motion(linkage, along, t, path_parameter(scene, t))


def started(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> State:
    """How the elastic motion begins: at rest, quasi-static, or with the steady state of the solver's own steps.

    Raises
    ------
    SolveError
        If no quasi-static deflection is found, or no steady state.
    """
    start = _begun(scene, linkage, along, model, solver)
    if scene.analysis.kind != "steady":
        return start

    over = period_map(scene, linkage, along, model, solver, solver.search.start(start))
    small = coarse_map(scene, linkage, along, model) if over.linear else None
    solver.steady = periodic(over, scene.analysis.stability, solver.watch, solver.search.closed, small)
    solver.over = None if solver.corotational else over
    return solver.steady.state


def coarse_map(scene: Scene, linkage: Linkage, along: Path, model: Model) -> PeriodMap | None:
    """The map of the steps of the model with its large links reduced; None if it has none."""
    small = coarse_model(scene, linkage, along, model)
    if small is None:
        return None
    solver = steps_of(scene, small)
    start = _begun(scene, linkage, along, small, solver)
    return period_map(scene, linkage, along, small, solver, start)


def period_map(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps, start: State
) -> PeriodMap:
    """The map of a solver's steps over the period of a steady motion."""
    motion_at = motion_of(scene, linkage, along)
    return PeriodMap(solver.ready, start, motion_at, time_grid(scene).end, block_length(model))


def _begun(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> State:
    """As `started`, of a motion that begins as it is told to; of a steady one the search for it begins there."""
    motion_at = motion_of(scene, linkage, along)
    if _in_nodal_rows(scene, model, solver):
        states = first_states(scene, linkage, along, model, solver.stiffening)
        return from_links(Instant(solver.ready, motion_at, 0.0), states)
    return solver.start(motion_at, initial_rates(scene, linkage, model))


def _in_nodal_rows(scene: Scene, model: Model, solver: Steps) -> bool:
    """Whether nodal rows know all that acts at the start: they keep more digits of slender links, and cost less."""
    elements = scene.springs or scene.motors or scene.limits or scene.analysis.initial_deflection
    if solver.corotational or elements or not (solver.ready.c.single or solver.stiffening is not None):
        return False
    # they lose digits of links a million times as stiff as others
    stiff = bool(model.rows) and any(link.rigid for link in model.links)
    return scene.analysis.initial == "rest" or not (dampers_count(model) or stiff)


def first_states(
    scene: Scene, linkage: Linkage, along: Path, model: Model,
    stresses: Stiffening | None = None,
) -> list[LinkState]:  # fmt: skip
    """States at t = 0: at rest, or quasi-static with its rate, of fourth order, from five instants."""
    at_rest = scene.analysis.initial == "rest"
    grid = time_grid(scene)
    h = min(grid.step, grid.end / (INSTANTS - 1))
    t = h * np.arange(1 if at_rest else INSTANTS)
    motion = rigid_motion(linkage, along, t, path_parameter(scene, t))
    moments = instants(model, motion, stresses)
    if at_rest:
        start = [Deflected(0 * v, v, 0 * v) for v in initial_rates(scene, linkage, model)]
        rows = rows_at_start(scene, linkage, along, model)
        return initial_states(model.links, model.joints, moments[0].at, model.damping, start, rows)
    u = quasi_static(model.links, model.joints, moments)
    g = [[x @ now.R for x, now in zip(us, each.at, strict=True)] for us, each in zip(u, moments, strict=True)]
    rates = ([np.tensordot(FIRST, each, 1) / h for each in zip(*x, strict=True)] for x in (u, g))
    start = [Deflected(*x) for x in zip(u[0], *rates, strict=True)]
    if moments[0].turnings is not None:
        start = [
            replace(x, stressed=k(now)) for x, k, now in zip(start, moments[0].turnings, g[0], strict=True)
        ]
    rows = rows_at_start(scene, linkage, along, model)
    return initial_states(model.links, model.joints, moments[0].at, model.damping, start, rows)
