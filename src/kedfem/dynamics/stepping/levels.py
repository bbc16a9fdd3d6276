"""Extrapolation levels: the same motion in steps of h, h/2 (and h/4), combined state by state at common times.

The error of a step of generalised-α has an expansion in powers of h, c₂ h² + c₃ h³ + c₄ h⁴ …
(docs/theory/time-integration.md). Only numerical damping contributes to c₃,
which is proportional to ((1 − ρ∞)/(1 + ρ∞))³ and 2e-5 at the default ρ∞ = 0.95. So

    two levels    (4 x_{h/2} − x_h)/3                                    order 4, with little numerical damping
    three levels  (r E_{h/2} − E_h)/(r − 1), E_h = (4 x_{h/2} − x_h)/3   r = 16: order 6; r = 8: order 4, without h³

Smooth functions of the state keep the order, and linear relations stay exact: positions, rates, loads, internal forces,
joint forces. δ'' of the method belongs to an instant (α_f − α_m) h before the end of the step;
the acceleration of the balance M a = P − M R0'' − f + Wᵀ λ follows from it by the method's own recursion,

    (1 − α_f) a₁ + α_f a₀ = (1 − α_m) δ₁'' + α_m δ₀''

so that accelerations and joint forces of the combined state are in balance as the levels' are.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block, joined, multipliers_together
from kedfem.dynamics.model import Model, factor_bytes
from kedfem.dynamics.rigid_links import for_steps
from kedfem.dynamics.stepping.combined import Combination, level_weights
from kedfem.dynamics.stepping.marks import Mark, Marks
from kedfem.dynamics.stepping.scheme import Scheme, generalised_alpha
from kedfem.dynamics.stepping.solvers import block_length, steps_of
from kedfem.dynamics.stepping.start import started
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.steps import Steps
from kedfem.errors import SolveError
from kedfem.mesh.memory_forecast import free_memory, memory, unknowns_that_fit
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import joined as motions_joined
from kedfem.scene import Scene, time_grid

MOST = 3


def level_scenes(scene: Scene) -> list[Scene]:
    """The scene with its own step, half of it, and so on, as many as it has levels."""
    grid, analysis = time_grid(scene), scene.analysis
    out = [scene]
    for k in range(1, analysis.extrapolation_levels or 1):
        keys = {"step": grid.step / 2**k, "end_time": grid.end, "extrapolation_levels": 1}
        keys |= dict.fromkeys(("revolutions", "steps_per_revolution"))
        out.append(scene.model_copy(update={"analysis": analysis.model_copy(update=keys)}))
    return out


def most_levels(model: Model) -> int:
    """How many levels' factors fit in this machine's memory, at most 3; of links so large that none would, 1."""
    return max(1, min(MOST, int(memory() / max(factor_bytes(model), 1.0))))


def level_steps(scene: Scene, model: Model) -> list[Steps]:
    """The solver of each level, coarsest first, its matrices factored.

    Raises
    ------
    SolveError
        If the factors of all levels do not fit in memory, or an effective matrix is not positive definite.
    """
    need = factor_bytes(model)
    if need > (free := free_memory()):
        fits = unknowns_that_fit(model.unknowns, need, free)
        raise SolveError(
            f"links: must have factors that fit in the free memory of {free / 1e9:.3g} GB, got {model.unknowns:,} "
            f"unknowns in all, whose factors take about {need / 1e9:.3g} GB; take larger elements: {fits:,.0f} would fit"
        )
    levels, fit = scene.analysis.extrapolation_levels or 1, most_levels(model)
    if levels > max(fit, 1):
        most = "1" if fit == 1 else f"at most {fit}"
        raise SolveError(
            f"analysis.extrapolation_levels: must be {most} with {model.unknowns:,} unknowns: each level "
            "has matrices of its own, "
            f"and {levels} sets of them do not fit in {memory() / 1e9:.3g} GB of memory, got {levels}"
        )
    longest = time_grid(scene).step
    return [steps_of(each, for_steps(model, time_grid(each).step, longest)) for each in level_scenes(scene)]


def leveled(
    scene: Scene, linkage: Linkage, along: Path, model: Model, solvers: Sequence[Steps],
    fine: bool | Marks = False,
) -> Iterator[Block]:  # fmt: skip
    """All time points of the analysis, combined of all levels, block after block; see `transient`.

    Parameters
    ----------
    solvers : of `level_steps`; with one of them this is `transient`
    fine : whether to hand on too, before each block, all time points of the finest level since the block before,
        numbered in its steps and flagged as `fine`: combined states at common times, and between them its own, corrected
        by the interpolated corrections there. For what follows peaks; rows belong to the analysis's own time points.
        Or marks of a march that hands them on: it goes on after what it has handed on, and sets them before each block

    Raises
    ------
    SolveError
        As `transient`, by the first level that fails; what all of them have is handed on before.
    """
    marks = fine if isinstance(fine, Marks) else Marks.of(len(solvers), kept=False)
    for each, mark in zip(solvers, marks.levels, strict=True):
        each.eased, each.steady, each.unstable = mark.eased, mark.steady, [*mark.unstable]
    if len(solvers) == 1:
        since = marks.done
        for block in transient(scene, linkage, along, model, solvers[0], marks.levels[0]):
            marks.done = block.step + len(block)
            if marks.done > since:
                yield block.part(max(0, since - block.step), len(block))
        return
    scenes, done, steady = level_scenes(scene), marks.done, scene.analysis.kind == "steady"
    begins = any(mark.state is None for mark in marks.levels)
    start = started(scenes[-1], linkage, along, model, solvers[-1]) if begins else None
    for mark, own, solver in zip(marks.levels, scenes, solvers, strict=True):
        apart = begins and (steady or any(model.step_limits)) and solver is not solvers[-1]
        mark.start = started(own, linkage, along, model, solver) if apart else start
    schemes = [generalised_alpha(time_grid(each).step, each.analysis.rho_inf) for each in scenes]
    streams = [
        _Stream(transient(each, linkage, along, model, solver, mark), scheme, mark)
        for each, solver, scheme, mark in zip(scenes, solvers, schemes, marks.levels, strict=True)
    ]
    for k, stream in enumerate(streams):
        stream.skip((done - 1) * 2**k + 1 if done else 0)
    weights = level_weights(len(solvers), scene.analysis.rho_inf)
    combination = Combination(model, weights, marks.corrections)
    length = max(1, block_length(model) // 2 ** (len(solvers) - 1))
    steps = time_grid(scene).steps
    while done <= steps:
        count = 1 if done == 0 else min(length, steps + 1 - done)
        strides = [2**k if done else 1 for k in range(len(streams))]
        taken = [stream.taken(count * stride) for stream, stride in zip(streams, strides, strict=True)]
        here = min(0 if x is None else len(x) // stride for x, stride in zip(taken, strides, strict=True))
        if here:
            blocks = [x.part(0, here * s) for x, s in zip(taken, strides, strict=True) if x is not None]
            marks.done = done + here
            for block in combination.blocks(done, blocks, strides, bool(fine)):
                marks.corrections = combination.corrections
                yield block
        for stream in streams:
            if stream.failed is not None and here < count:
                raise stream.failed
        done += count


@dataclass
class _Stream:
    """One level: its time points in portions as asked for, with accelerations from the balance."""

    blocks: Iterator[Block]
    scheme: Scheme
    mark: Mark
    failed: SolveError | None = None
    _rest: Block | None = None
    _last: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._last = list(self.mark.last)

    def skip(self, to: int) -> None:
        """Leave out the time points before one."""
        block = self._next() if to else None
        while block is not None and block.step + len(block) <= to:
            block = self._next()
        self._rest = block and block.part(max(0, to - block.step), len(block))

    def taken(self, count: int) -> Block | None:
        """The next time points; fewer where the level has failed, None without any."""
        parts: list[Block] = []
        while count:
            if self._rest is None:
                self._rest = self._next()
                if self._rest is None:
                    break
            block = self._rest
            part = block.part(0, min(count, len(block)))
            self._rest = block.part(count, len(block)) if count < len(block) else None
            count -= len(part)
            parts.append(part)
        if len(parts) < 2:
            return parts[0] if parts else None
        motion = motions_joined([x.motion for x in parts])
        multipliers = multipliers_together([x.multipliers for x in parts], np.concatenate)
        return Block(parts[0].step, motion, joined([list(x.links) for x in parts]), multipliers=multipliers)

    def _next(self) -> Block | None:
        if self.failed is not None:
            return None
        self.mark.last = list(self._last)
        try:
            block = next(self.blocks)
        except SolveError as error:
            self.failed = error
            return None
        return self._balanced(block)

    def _balanced(self, block: Block) -> Block:
        """The block with the accelerations of its balance in place of the method's own δ''."""
        if not self.scheme.alpha_f:
            return block
        if not self._last:
            self._last = [(link.a[-1], link.a[-1]) for link in block.links]
            return block
        links = []
        for k, (link, (before, balance)) in enumerate(zip(block.links, self._last, strict=True)):
            a = balanced(self.scheme, before, balance, link.a)
            self._last[k] = link.a[-1], a[-1]
            links.append(replace(link, a=a))
        return replace(block, links=links)


def in_balance(scene: Scene, blocks: Iterator[Block]) -> Iterator[Block]:
    """Blocks of a single march from its start, with accelerations of the balance in place of the method's own δ''."""
    stream = _Stream(iter(()), generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf), Mark())
    for block in blocks:
        yield stream._balanced(block)


def balanced(
    scheme: Scheme, before: Float[np.ndarray, "n d"], balance: Float[np.ndarray, "n d"],
    own: Float[np.ndarray, "T n d"],
) -> Float[np.ndarray, "T n d"]:  # fmt: skip
    """Accelerations that the balance asks for at the ends of T steps, from the method's own δ''.

    Parameters
    ----------
    before, balance : δ'' and the acceleration of the balance at the beginning of the first step
    own : δ'' at the ends
    """
    from scipy.signal import lfilter

    c_m, c_f = 1 - scheme.alpha_m, 1 - scheme.alpha_f
    begin = (scheme.alpha_m * before - scheme.alpha_f * balance) / c_f
    out, _ = lfilter([c_m / c_f, scheme.alpha_m / c_f], [1.0, scheme.alpha_f / c_f], own, axis=0, zi=begin[None])
    return np.asarray(out)
