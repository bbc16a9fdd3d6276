"""The elastic motion step by step: M δ'' + C δ' + K δ = P − M R0'', [KED, eq. (20)]."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from kedfem.dynamics.history import Block, LinkHistory, Snapshot, history
from kedfem.dynamics.joints.constraint_matrices import joint_rows
from kedfem.dynamics.joints.first_rows import FIRST, INSTANTS
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.coarse import coarse_model
from kedfem.dynamics.nominal import POINTS, forcings, instants, motions, rows_at_start
from kedfem.dynamics.segment import CONVERGED, FREE
from kedfem.dynamics.stepping.literal import LiteralSteps
from kedfem.dynamics.stepping.marks import Mark
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.start import Deflected, initial_rates, initial_states, quasi_static
from kedfem.dynamics.stepping.state import LinkState
from kedfem.dynamics.stiffening import Stiffening, stiffening
from kedfem.dynamics.system.arrays import State
from kedfem.dynamics.system.corotational import CorotationalSteps
from kedfem.dynamics.system.march import HALVINGS, ConvergenceError, Motion
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.period.search import periodic, residual_of
from kedfem.dynamics.system.starts.deflected import NoBalanceError, static
from kedfem.dynamics.system.starts.deflected import quasi_static as deflection_in_motion
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.starts.start import from_links
from kedfem.dynamics.system.steps import SystemSteps, nominal_system
from kedfem.errors import SolveError
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import Scene, corotational, path_parameter, time_grid, without_vibration

BLOCK_BYTES = 64_000_000
BEYOND = 1e9  # m: a displacement that has grown past that is no more finite than inf

ByLink = LiteralSteps | SystemSteps
Steps = ByLink | CorotationalSteps
Start = list[LinkState] | State
STIFFENED = 'stiffening is not a small term; take frames = "co-rotational"'


def steps_of(scene: Scene, model: Model) -> Steps:
    """The solver that the scene asks for, its matrices factored.

    Raises
    ------
    SolveError
        If an effective matrix is not positive definite.
    MeshError
        If a force element finds no coupling surface on its link that tells how it turns.
    """
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    if corotational(scene):
        return CorotationalSteps(scene, model, scheme, FREE if scene.driven is None else CONVERGED)
    literal = scene.analysis.solver == "monolithic"
    stresses = stiffening(model) if scene.analysis.stiffening else None
    elements = scene.springs or scene.motors or scene.limits
    if elements or scene.analysis.initial_deflection or _dampers_count(model) or not literal:
        return SystemSteps(scene, nominal_system(scene, model, stresses), model, scheme, literal)
    return LiteralSteps(model.links, model.joints, scheme, model.damping, stresses)


def _dampers_count(model: Model) -> bool:
    """Whether quasi-static starts feel dampers of bushings: beside rigid cross-section nodes they would lose digits."""
    hubs = any(link.kind == "spatial_beam" and link.full is None for link in model.links)
    return not hubs and any(row.damping.any() for row in model.rows)


def transient(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps,
    start: Start | Mark | None = None,
) -> Iterator[Block]:  # fmt: skip
    """All time points of the analysis, [KED, eq. (20)], block after block; nothing is kept.

    Parameters
    ----------
    start : the state at t = 0, that of `started` if not given; or the mark of a march, which goes on from the beginning
        of its block; it is set anew at every block

    Raises
    ------
    SolveError
        If a displacement is not finite: with step, time and drive angle.
    """
    mark = start if isinstance(start, Mark) else Mark(start=start)
    since = mark.step
    if without_vibration(scene):
        yield from _positions(scene, linkage, along, model, solver, mark)
        return
    if isinstance(solver, CorotationalSteps):
        yield from _corotational(scene, linkage, along, model, solver, mark)
        return
    stresses = solver.stiffening
    state: Any = mark.state
    if state is None:
        states = started(scene, linkage, along, model, solver) if mark.start is None else mark.start
        drawn = rigid_motion(linkage, along, np.zeros(1), path_parameter(scene, np.zeros(1)))
        yield Block(0, drawn, _first(model, solver, states, drawn))
        state = begun(scene, linkage, along, model, solver, states)
    length = block_length(model)

    motion_at = _motion(scene, linkage, along)
    for first, motion in motions(scene, linkage, along, since):
        for k in range(0, len(motion.t), length):
            if first + k < since:
                continue
            mark.set(first + k, state, solver)
            part = motion.part(k, k + length)
            forcing = forcings(model, part)
            if not isinstance(solver, SystemSteps):
                links, state = solver.advance(state, forcing, joint_rows(model.rows, part))
                yield from _finite(Block(first + k, part, links))
                continue
            try:
                links, state = solver.advance(state, forcing, part, motion_at)
            except ConvergenceError as failed:
                if failed.taken:
                    done = part.part(0, failed.taken)
                    yield Block(
                        first + k, done, solver.handed_on(failed.history, forcings(model, done), done)
                    )
                advice = "give it more elements" if stresses is None else STIFFENED
                raise SolveError(_stuck(first + k + failed.taken, part, failed, advice)) from None
            yield from _finite(Block(first + k, part, links))
    _marched(solver, state)


def _corotational(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: CorotationalSteps, mark: Mark
) -> Iterator[Block]:
    """All time points of a system with co-rotational frames; see `transient`."""

    motion_at = _motion(scene, linkage, along)
    state, since, length = mark.state, mark.step, block_length(model)
    if state is None:
        begins = started(scene, linkage, along, model, solver) if mark.start is None else mark.start
        if not isinstance(begins, State):
            raise ValueError("a march must begin with a state of the system, got states of links")
        state = begins
        drawn = motion_at(np.zeros(1))
        links, exerted = solver.first(state, forcings(model, drawn), motion_at)
        yield Block(0, drawn, links, exerted=exerted)
    for first, motion in motions(scene, linkage, along, since):
        for k in range(0, len(motion.t), length):
            if first + k < since:
                continue
            mark.set(first + k, state, solver)
            part = motion.part(k, k + length)
            forcing = forcings(model, part)
            try:
                links, exerted, state = solver.advance(state, forcing, part, motion_at)
            except ConvergenceError as failed:
                if failed.taken:
                    links, exerted = solver.handed_on(failed.history, forcing, part)
                    yield Block(first + k, part.part(0, failed.taken), links, exerted=exerted)
                advice, tried = _finer(model, failed), f", not even in {2**HALVINGS} parts"
                raise SolveError(_stuck(first + k + failed.taken, part, failed, advice, tried)) from None
            yield from _finite(Block(first + k, part, links, exerted=exerted))


def _positions(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps, mark: Mark
) -> Iterator[Block]:
    """All positions of a static or quasi-static analysis, each with the deflection at which all forces balance."""
    if isinstance(solver, LiteralSteps):
        raise ValueError("a balance must be that of a system, got the monolithic solver's")
    grid, motion_at, of, state = time_grid(scene), _motion(scene, linkage, along), solver.ready, mark.state
    shared = Instant(of, motion_at, 0.0)
    for k in range(mark.step, grid.steps + 1):
        mark.set(k, state, solver)
        t = k * grid.step
        motion = motion_at(np.array([t]))
        forcing = forcings(model, motion)
        try:
            if scene.analysis.kind == "static":
                state = static(of, motion_at, t, near=state, like=shared)
            else:
                state = deflection_in_motion(of, motion_at, time=t, near=state, like=shared)
        except NoBalanceError:
            raise SolveError(_unbalanced(scene, motion)) from None
        if isinstance(solver, CorotationalSteps):
            links, exerted = solver.first(state, forcing, motion_at, shared)
        else:
            links, exerted = solver.first(state, forcing, motion), None
        yield from _finite(Block(k, motion, links, exerted=exerted))


def _unbalanced(scene: Scene, motion: RigidMotion) -> str:
    """What to do about a position without a balance of forces."""
    kind = scene.analysis.kind
    advice = (
        "a link that nothing holds, a load beyond buckling, or links that rotate too far under their loads for the "
        "balance to be found: hold them by joints, springs or a drive, let loads grow in smaller steps over time, or "
        "take kind = 'transient' with damping"
        if kind == "static"
        else "a drive near a natural frequency, or a linkage near a dead point, where small loads move it far: take a "
        "slower drive, stiffer links, another position or kind = 'steady'"
    )
    return (
        f"analysis.kind: all forces must balance at each position of a {kind} analysis, got no balance at "
        f"t = {motion.t[0]:.6g} s, drive angle {np.degrees(motion.phi[0]):.6g} deg; {advice}"
    )


def _motion(scene: Scene, linkage: Linkage, along: Path) -> Motion:
    """The rigid-body motion at given times."""
    return lambda t: rigid_motion(linkage, along, t, path_parameter(scene, t))


def started(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> Start:
    """How the elastic motion begins: at rest, quasi-static, or with the steady state of the solver's own steps.

    Raises
    ------
    SolveError
        If no quasi-static deflection is found, or no steady state.
    """
    start = _begun(scene, linkage, along, model, solver)
    if scene.analysis.kind != "steady":
        return start
    if isinstance(solver, LiteralSteps) or not isinstance(start, State):
        raise ValueError("a steady state must be that of a system, got the monolithic solver's")

    over = period_map(scene, linkage, along, model, solver, solver.search.start(start))
    small = coarse_map(scene, linkage, along, model) if over.linear else None
    solver.steady = periodic(over, scene.analysis.stability, solver.watch, solver.search.closed, small)
    if isinstance(solver, SystemSteps):
        solver.over = over
    return solver.steady.state


def _marched(solver: Steps, last: Any) -> None:
    """What a period leaves of a steady state, from the state with which the recorded one ends."""
    if isinstance(solver, SystemSteps) and solver.steady is not None and solver.over is not None:
        over, steady = solver.over, solver.steady
        left = residual_of(over, over.vector(steady.state), over.vector(last), steady.scale)
        solver.steady = replace(steady, residual=max(left, steady.residual))


def coarse_map(scene: Scene, linkage: Linkage, along: Path, model: Model) -> PeriodMap | None:
    """The map of the steps of the model with its large links reduced; None if it has none."""
    small = coarse_model(scene, linkage, along, model)
    if small is None:
        return None
    solver = steps_of(scene, small)
    start = _begun(scene, linkage, along, small, solver)
    if isinstance(solver, LiteralSteps) or not isinstance(start, State):
        raise ValueError("a steady state must be that of a system, got the monolithic solver's")
    return period_map(scene, linkage, along, small, solver, start)


def period_map(
    scene: Scene,
    linkage: Linkage,
    along: Path,
    model: Model,
    solver: SystemSteps | CorotationalSteps,
    start: State,
) -> PeriodMap:
    """The map of a solver's steps over the period of a steady motion."""
    motion_at = _motion(scene, linkage, along)
    return PeriodMap(solver.ready, start, motion_at, time_grid(scene).end, block_length(model))


def _begun(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> Start:
    """As `started`, of a motion that begins as it is told to; of a steady one the search for it begins there."""
    motion_at = _motion(scene, linkage, along)
    if isinstance(solver, CorotationalSteps):
        return solver.begin(motion_at)
    if not isinstance(solver, SystemSteps):
        return first_states(scene, linkage, along, model, solver.stiffening)
    at_rest = scene.analysis.initial == "rest"
    pulled = scene.springs or scene.motors or scene.limits
    plain = (solver.ready.c.single and not pulled) or solver.stiffening is not None
    damped = _dampers_count(model)
    # nodal rows lose digits of links a million times as stiff as others
    stiff = bool(model.rows) and any(link.rigid for link in model.links) and solver.stiffening is None
    if plain and (at_rest or not (damped or stiff)) and not scene.analysis.initial_deflection:
        states = first_states(scene, linkage, along, model, solver.stiffening)
        return from_links(Instant(solver.ready, motion_at, 0.0), states)
    return solver.start(at_rest, motion_at, initial_rates(scene, linkage, model) if at_rest else [])


def begun(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: ByLink, states: Start) -> Any:
    """A solver's state at the first time point."""
    if isinstance(states, State) or isinstance(solver, SystemSteps):
        return states
    if not model.rows:
        return solver.begin(states)
    rows = rows_at_start(scene, linkage, along, model)
    return solver.begin(states, None if rows is None else rows.state(model.joints, states))


def _first(model: Model, solver: ByLink, states: Start, drawn: RigidMotion) -> list[LinkHistory]:
    """The first time point of all links, as their frames see it."""
    if isinstance(solver, SystemSteps) and isinstance(states, State):
        return solver.first(states, forcings(model, drawn), drawn)
    if isinstance(states, State):
        raise ValueError("the start of links must be their states, got a system's")
    return [history([state]) for state in states]


def _stuck(step: int, part: RigidMotion, failed: ConvergenceError, advice: str, tried: str = "") -> str:
    """What to do about a step whose iterations do not converge."""
    k = failed.taken
    moves = f"link '{failed.moves}'" if failed.moves else "a joint or force element"
    return (
        f"analysis: the iterations of a step must converge, got none that do at step {step}, t = {part.t[k]:.6g} s, "
        f"drive angle {np.degrees(part.phi[k]):.6g} deg{tried}; {moves} moves most from iteration to iteration: "
        f"{advice}, take a smaller step, or more numerical damping (rho_inf)"
    )


def _finer(model: Model, failed: ConvergenceError) -> str:
    """What helps a link with co-rotational frames."""
    beams = {link.name for link in model.links if link.kind == "spatial_beam"}
    needed = " (beams in space: shorter than some 100 radii of gyration where they bend much)"
    return "give it more elements or segments" + needed * (failed.moves in beams)


def eased_warning(solvers: Sequence[Steps]) -> tuple[str, ...]:
    """A warning where iterations of steps were taken as converged at an eased tolerance."""
    eased = sum(each.eased for each in solvers if isinstance(each, CorotationalSteps))
    if not eased:
        return ()
    return (
        f"the iterations of {eased} steps with co-rotational frames converged to a hundred times the tolerance only "
        "(stiff springs or hubs): take a smaller step to see whether results change",
    )


def snapshots(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> Iterator[Snapshot]:
    """All time points of `transient`, one by one."""
    for block in transient(scene, linkage, along, model, solver):
        yield from (block.at(k) for k in range(len(block)))


def block_length(model: Model) -> int:
    """Time points whose states are kept together: as many as take BLOCK_BYTES, at most POINTS."""
    return max(1, min(POINTS, BLOCK_BYTES // (9 * 8 * model.unknowns)))


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


def _finite(block: Block) -> Iterator[Block]:
    """The block, up to where a displacement is not finite any more, or beyond all measure."""
    fine = np.all([np.abs(link.g).max(axis=(1, 2)) < BEYOND for link in block.links], axis=0)
    k = len(block) if fine.all() else int(fine.argmin())
    if k:
        yield block.part(0, k)
    if k < len(block):
        raise SolveError(
            f"analysis: the elastic motion must stay finite, got none at step {block.step + k}, "
            f"t = {block.motion.t[k]:.6g} s, drive angle {np.degrees(block.motion.phi[k]):.6g} deg"
        )
