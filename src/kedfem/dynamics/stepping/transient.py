"""The elastic motion step by step: M δ'' + C δ' + K δ = P − M R0'', [KED, eq. (20)]."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from kedfem.dynamics.history import Block, LinkHistory, Snapshot, history
from kedfem.dynamics.joints.constraint_matrices import joint_rows
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.stepping.first_state import Start, begun, motion_of, started
from kedfem.dynamics.stepping.marks import Mark
from kedfem.dynamics.stepping.monolithic import MonolithicSteps
from kedfem.dynamics.stepping.solvers import ByLink, Steps, block_length
from kedfem.dynamics.system.corotational import CorotationalSteps
from kedfem.dynamics.system.march import HALVINGS, ConvergenceError
from kedfem.dynamics.system.period.search import residual_of
from kedfem.dynamics.system.starts.balanced import NoBalanceError
from kedfem.dynamics.system.starts.deflected import quasi_static as deflection_in_motion
from kedfem.dynamics.system.starts.deflected import static
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.state import State
from kedfem.dynamics.system.steps import SystemSteps
from kedfem.errors import SolveError
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import Scene, path_parameter, time_grid, without_vibration

BEYOND = 1e9  # m: a displacement that has grown past that is no more finite than inf
STIFFENED = 'stiffening is not a small term; take frames = "co-rotational"'


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

    motion_at = motion_of(scene, linkage, along)
    for first, motion in motions(scene, linkage, along, since):
        for k in range(0, len(motion.t), length):
            if first + k < since:
                continue
            mark.set(first + k, state, solver)
            part = motion.part(k, k + length)
            forcing = forcings(model, part)
            if not isinstance(solver, SystemSteps):
                links, state = solver.advance(state, forcing, joint_rows(model.rows, part))
                yield from _finite(linkage, Block(first + k, part, links))
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
                raise SolveError(_stuck(linkage, first + k + failed.taken, part, failed, advice)) from None
            yield from _finite(linkage, Block(first + k, part, links))
    _marched(solver, state)


def _corotational(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: CorotationalSteps, mark: Mark
) -> Iterator[Block]:
    """All time points of a system with co-rotational frames; see `transient`."""

    motion_at = motion_of(scene, linkage, along)
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
                raise SolveError(
                    _stuck(linkage, first + k + failed.taken, part, failed, advice, tried)
                ) from None
            yield from _finite(linkage, Block(first + k, part, links, exerted=exerted))


def _positions(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps, mark: Mark
) -> Iterator[Block]:
    """All positions of a static or quasi-static analysis, each with the deflection at which all forces balance."""
    if isinstance(solver, MonolithicSteps):
        raise ValueError("a balance must be that of a system, got the monolithic solver's")
    grid, motion_at, of, state = time_grid(scene), motion_of(scene, linkage, along), solver.ready, mark.state
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
        except NoBalanceError as failed:
            raise SolveError(_unbalanced(scene, _moment(linkage, motion, 0), failed.moves)) from None
        if isinstance(solver, CorotationalSteps):
            links, exerted = solver.first(state, forcing, motion_at, shared)
        else:
            links, exerted = solver.first(state, forcing, motion), None
        yield from _finite(linkage, Block(k, motion, links, exerted=exerted))


def _unbalanced(scene: Scene, moment: str, moves: str) -> str:
    """What to do about a position without a balance of forces."""
    kind = scene.analysis.kind
    advice = (
        "a link that nothing holds, a load beyond buckling, or links that rotate too far under their loads for the "
        "balance to be found: hold them by joints, springs or a drive, take positions nearer to each other, as each is "
        "found from the one before, let loads grow in smaller steps over time, or take kind = 'transient' with damping"
        if kind == "static"
        else "a drive near a natural frequency, or a linkage near a dead point, where small loads move it far: take a "
        "slower drive, stiffer links, another position or kind = 'steady'"
    )
    return (
        f"analysis.kind: all forces must balance at each position of a {kind} analysis, got no balance at "
        f"{moment}; {moves}{'; ' * bool(moves)}{advice}"
    )


def _marched(solver: Steps, last: Any) -> None:
    """What a period leaves of a steady state, from the state with which the recorded one ends."""
    if isinstance(solver, SystemSteps) and solver.steady is not None and solver.over is not None:
        over, steady = solver.over, solver.steady
        left = residual_of(over, over.vector(steady.state), over.vector(last), steady.scale)
        solver.steady = replace(steady, residual=max(left, steady.residual))


def _first(model: Model, solver: ByLink, states: Start, drawn: RigidMotion) -> list[LinkHistory]:
    """The first time point of all links, as their frames see it."""
    if isinstance(solver, SystemSteps) and isinstance(states, State):
        return solver.first(states, forcings(model, drawn), drawn)
    if isinstance(states, State):
        raise ValueError("the start of links must be their states, got a system's")
    return [history([state]) for state in states]


def _stuck(
    linkage: Linkage, step: int, part: RigidMotion, failed: ConvergenceError, advice: str, tried: str = ""
) -> str:
    """What to do about a step whose iterations do not converge."""
    moves = f"link '{failed.moves}'" if failed.moves else "a joint or force element"
    return (
        f"analysis: the iterations of a step must converge, got none that do at step {step}, "
        f"{_moment(linkage, part, failed.taken)}{tried}; {moves} moves most from iteration to iteration: "
        f"{advice}, take a smaller step, or more numerical damping (rho_inf)"
    )


def _finer(model: Model, failed: ConvergenceError) -> str:
    """What helps a link with co-rotational frames."""
    beams = {link.name for link in model.links if link.kind == "spatial_beam"}
    needed = " (beams in space: shorter than some 100 radii of gyration where they bend much)"
    return "give it more elements or segments" + needed * (failed.moves in beams)


def snapshots(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> Iterator[Snapshot]:
    """All time points of `transient`, one by one."""
    for block in transient(scene, linkage, along, model, solver):
        yield from (block.at(k) for k in range(len(block)))


def _moment(linkage: Linkage, motion: RigidMotion, k: int) -> str:
    """A time point in words, with the angle or travel of the drive if there is one."""
    if len(linkage.drives) != 1:
        return f"t = {motion.t[k]:.6g} s"
    x = float(motion.phi[k])
    turn = f"drive angle {np.degrees(x):.6g} deg"
    return (
        f"t = {motion.t[k]:.6g} s, {turn if linkage.drives.turning[0] else f'drive travel {1e3 * x:.6g} mm'}"
    )


def _finite(linkage: Linkage, block: Block) -> Iterator[Block]:
    """The block, up to where a displacement is not finite any more, or beyond all measure."""
    fine = np.all([np.abs(link.g).max(axis=(1, 2)) < BEYOND for link in block.links], axis=0)
    k = len(block) if fine.all() else int(fine.argmin())
    if k:
        yield block.part(0, k)
    if k < len(block):
        raise SolveError(
            f"analysis: the elastic motion must stay finite, got none at step {block.step + k}, "
            f"{_moment(linkage, block.motion, k)}"
        )
