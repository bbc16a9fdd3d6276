"""The elastic motion step by step: M δ'' + C δ' + K δ = P − M R0'', [KED, eq. (20)]."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import forcings, motions
from kedfem.dynamics.stepping.marks import Mark
from kedfem.dynamics.stepping.solvers import block_length
from kedfem.dynamics.stepping.start import motion_of, started
from kedfem.dynamics.system.march import HALVINGS, ConvergenceError, LeftLineError
from kedfem.dynamics.system.period.search import residual_of
from kedfem.dynamics.system.starts.deflected import quasi_static_position, static
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.starts.modified_newton import NoBalanceError
from kedfem.dynamics.system.starts.stability import UNSTABLE, stability
from kedfem.dynamics.system.steps import Steps
from kedfem.errors import SolveError
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene, time_grid, without_vibration

LOOKED_AT = 8  # positions of an analysis whose balance is examined for stability
BEYOND = 1e9  # m: a displacement that has grown past that is no more finite than inf
STIFFENED = 'stiffening is not a small term; take frames = "co-rotational"'


def transient(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps, mark: Mark | None = None
) -> Iterator[Block]:
    """All time points of the analysis, [KED, eq. (20)], block after block; nothing is kept.

    Parameters
    ----------
    mark : of a march that goes on from the beginning of its block; it is set anew at every block

    Raises
    ------
    SolveError
        If a displacement is not finite: with step, time and drive angle.
    """
    mark = mark or Mark()
    since = mark.step
    if without_vibration(scene):
        yield from _positions(scene, linkage, along, model, solver, mark)
        return
    motion_at, state, length = motion_of(scene, linkage, along), mark.state, block_length(model)
    if state is None:
        state = started(scene, linkage, along, model, solver) if mark.start is None else mark.start
        reference = motion_at(np.zeros(1))
        links, multipliers = solver.first(state, forcings(model, reference), motion_at)
        yield Block(0, reference, links, multipliers=multipliers)
    for first, motion in motions(scene, linkage, along, since):
        for k in range(0, len(motion.t), length):
            if first + k < since:
                continue
            mark.set(first + k, state, solver)
            part = motion.part(k, k + length)
            forcing = forcings(model, part)
            try:
                links, multipliers, state = solver.advance(state, forcing, part, motion_at)
            except ConvergenceError as failed:
                if failed.taken:
                    links, multipliers = solver.handed_on(failed.history, forcing, part)
                    yield Block(first + k, part.part(0, failed.taken), links, multipliers=multipliers)
                if isinstance(failed, LeftLineError):
                    raise SolveError(failed.said) from None
                at = instant_in_words(linkage, part, failed.taken)
                raise SolveError(_stuck(first + k + failed.taken, at, failed, solver)) from None
            yield from finite_part(linkage, Block(first + k, part, links, multipliers=multipliers))
    _marched(solver, state)


def _positions(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps, mark: Mark) -> Iterator[Block]:
    """All positions of a static or quasi-static analysis, each with the deflection at which all forces balance."""
    grid, motion_at, of, state = time_grid(scene), motion_of(scene, linkage, along), solver.ready, mark.state
    shared = Instant(of, motion_at, 0.0)
    at_rest, bent = scene.analysis.kind == "static", not of.c.single or of.stressed is not None
    looked_at = {grid.steps - grid.steps * k // LOOKED_AT for k in range(LOOKED_AT)} if bent else set()
    for k in range(mark.step, grid.steps + 1):
        mark.set(k, state, solver)
        t = k * grid.step
        motion = motion_at(np.array([t]))
        forcing = forcings(model, motion)
        try:
            if at_rest:
                state = static(of, motion_at, t, near=state, like=shared)
            else:
                state = quasi_static_position(of, motion_at, t, near=state, like=shared)
        except NoBalanceError as failed:
            raise SolveError(_unbalanced(scene, instant_in_words(linkage, motion, 0), failed.moves)) from None
        if k in looked_at and (found := stability(of, motion_at, state, at_rest, shared)) and found.least < UNSTABLE:
            solver.unstable.append(f"{instant_in_words(linkage, motion, 0)} (link '{found.moves}')")
        links, multipliers = solver.first(state, forcing, motion_at, shared)
        yield from finite_part(linkage, Block(k, motion, links, multipliers=multipliers))


def _unbalanced(scene: Scene, moment: str, moves: str) -> str:
    """Advice for a position without a balance of forces."""
    kind = scene.analysis.kind
    advice = (
        "a link that nothing constrains, a load beyond buckling, or links that rotate too far under their loads for the "
        "balance to be found: constrain them by joints, springs or a drive, take positions nearer to each other, as each "
        "is found from the one before, let loads grow in smaller steps over time, or take kind = 'transient' with damping"
        if kind == "static"
        else "a drive near a natural frequency, or a linkage near a dead point, where small loads move it far: take a "
        "slower drive, stiffer links, another position or kind = 'steady'"
    )
    return (
        f"analysis.kind: all forces must balance at each position of a {kind} analysis, got no balance at "
        f"{moment}; {moves}{'; ' * bool(moves)}{advice}"
    )


def _marched(solver: Steps, last: Any) -> None:
    """The residual of a steady state after one more period, from the state with which the recorded one ends."""
    if solver.steady is not None and solver.over is not None:
        over, steady = solver.over, solver.steady
        left = residual_of(over, over.vector(steady.state), over.vector(last), steady.scale)
        solver.steady = replace(steady, residual=max(left, steady.residual))


def _stuck(step: int, at: str, failed: ConvergenceError, solver: Steps) -> str:
    """Advice for a step whose iterations do not converge; `at` is its time in words."""
    advice, tried = "give it more elements", ""
    moves = f"link '{failed.moves}'" if failed.moves else "a joint or force element"
    if solver.stiffening is not None:
        advice = STIFFENED
    if solver.corotational:
        advice, tried = _finer(solver.model, failed), f", not even in {2**HALVINGS} parts"
    return (
        f"analysis: the iterations of each step must converge, got no convergence at step {step}, "
        f"{at}{tried}; {moves} moves most from iteration to iteration: "
        f"{advice}, take a smaller step, or more numerical damping (rho_inf)"
    )


def _finer(model: Model, failed: ConvergenceError) -> str:
    """Advice for a link with co-rotational frames."""
    beams = {link.name for link in model.links if link.kind == "spatial_beam"}
    needed = " (beams in space: shorter than some 100 radii of gyration where they bend much)"
    return "give it more elements or segments" + needed * (failed.moves in beams)


def instant_in_words(linkage: Linkage, motion: RigidMotion, k: int) -> str:
    """A time point in words, with the angle or travel of the drive if there is one."""
    if len(linkage.drives) != 1:
        return f"t = {motion.t[k]:.6g} s"
    x = float(motion.phi[k])
    turn = f"drive angle {np.degrees(x):.6g} deg"
    return f"t = {motion.t[k]:.6g} s, {turn if linkage.drives.turning[0] else f'drive travel {1e3 * x:.6g} mm'}"


def finite_part(linkage: Linkage, block: Block) -> Iterator[Block]:
    """The block, up to where a displacement is not finite any more, or beyond all measure."""
    ends = [(link.g.max(axis=(1, 2)), link.g.min(axis=(1, 2))) for link in block.links]
    fine = np.all([(high < BEYOND) & (low > -BEYOND) for high, low in ends], axis=0)
    k = len(block) if fine.all() else int(fine.argmin())
    if k:
        yield block.part(0, k)
    if k < len(block):
        raise SolveError(
            f"analysis: the elastic motion must stay finite, got none at step {block.step + k}, "
            f"{instant_in_words(linkage, block.motion, k)}"
        )
