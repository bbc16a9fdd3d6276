"""Error estimates of a run, from runs of the same linkage with other steps and other meshes.

Small models are run again as they are. Large links are replaced by a companion with a few modes, whose steps take a
fraction of the time. Differences between two steps or two meshes are taken in every channel (`accuracy.histories`).

* **Step** of a single level: the run's step against one twice as long, as with levels in time
  (`accuracy.step_estimate`); strong numerical damping against weak (`accuracy.damping`).
* **Positions** that the scene leaves open: largest values that may lie between them (`accuracy.positions`).
* **Mesh of beams**: twice the elements, with the same step.
* **Rounding**: residual forces of a link's matrices in its rigid motion (`accuracy.rounding`).
* **Meshes of solid and plane links**: their indicator η (`links.indicator`). Compliance errs by about 2 η², so the
  companion is run with links softer by that much; stress also errs by a part of η itself.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from kedfem.accuracy.damping import damped_errors, damping_remedy
from kedfem.accuracy.error_budget import Budget, Share, by_kind, joined
from kedfem.accuracy.geometric import GeometricError, bent, geometric_warning
from kedfem.accuracy.histories import Histories, counted, extent, histories
from kedfem.accuracy.longer_steps import can_double, differs_alike, doubled, in_steps
from kedfem.accuracy.mesh_estimate import COMPANION_MODES, link_errors, mesh_share, plain_mesh_share
from kedfem.accuracy.positions import fewer_positions, positions_share
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import Reduction, first_reduced
from kedfem.accuracy.resolution import StepError, step_error
from kedfem.accuracy.rigid_link_compliance import RigidLinkCompliance
from kedfem.accuracy.rounding import Rounding
from kedfem.accuracy.step_estimate import SINGLE, single_errors
from kedfem.accuracy.variants import with_analysis
from kedfem.dynamics.history import Block
from kedfem.dynamics.matrices.dense import SMALL
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.steps import Steps
from kedfem.errors import KedfemError
from kedfem.links.indicator import Indicator, indicator
from kedfem.results.recording import recording
from kedfem.scene import ForceLoad, Scene, states_step, time_grid, without_vibration

# unknowns of a model above which no companion is made: its modes cost as much as hundreds of steps
LARGE = 100_000
SPAN = 6000  # most steps of a companion's run; only the beginning of a longer analysis is run
CHEAP = 2e7  # steps times unknowns that take seconds, so that small models may have more steps than SPAN
SLOW = 1000  # most steps without a compiled loop


@dataclass
class PeakStrainStates:
    """The state of each meshed link with the highest strain energy so far, for the estimate of its mesh error."""

    model: Model
    energy: dict[int, float]
    states: dict[int, np.ndarray]
    REMEMBERED: ClassVar = ("energy", "states")

    def __init__(self, model: Model) -> None:
        self.model, self.energy, self.states = model, {}, {}

    def add(self, block: Block) -> None:
        """Evaluate the steps of a block."""
        for k, (link, history) in enumerate(zip(self.model.links, block.links, strict=True)):
            if link.meshed and not link.rigid:
                worst = int(history.strain.argmax())
                if history.strain[worst] > self.energy.get(k, 0.0):
                    self.energy[k], self.states[k] = float(history.strain[worst]), history.g[worst].copy()

    @cached_property
    def indicators(self) -> dict[int, Indicator]:
        """The indicator of each meshed link or segment, by its number, after all steps."""
        return {k: indicator(self.model.links[k], g) for k, g in self.states.items()}


@dataclass
class ErrorMonitor:
    """Monitor of a run's errors as it steps: peak strain states, geometric error, local errors of steps, rounding."""

    strained: PeakStrainStates
    geometric: GeometricError
    running: StepError
    rounding: Rounding
    compliance: RigidLinkCompliance
    steps: bool = True
    """whether there are time steps, not independent static positions"""
    REMEMBERED: ClassVar = ("strained", "geometric", "running", "rounding", "compliance")

    def add(self, block: Block) -> None:
        """Evaluate the steps of a block."""
        self.strained.add(block)
        self.geometric.add(block)
        if self.steps:
            self.running.add(block)
            self.compliance.add(block)
        self.rounding.add(block)


def error_monitor(ready: Prepared, solvers: Sequence[Steps] = ()) -> ErrorMonitor:
    """A monitor of a prepared scene's steps; without solvers, rounding is estimated from the links alone."""
    scene, model = ready.scene, ready.model
    geometric = GeometricError(model, scene.analysis.stiffening, bool(scene.limits))
    rounding, steps = Rounding.of(model, solvers), not without_vibration(scene)
    return ErrorMonitor(
        PeakStrainStates(model), geometric, step_error(ready), rounding, RigidLinkCompliance(model), steps
    )


def companion(ready: Prepared) -> Prepared | None:
    """A model whose runs cost little compared with those of a prepared scene; None if the scene is too large."""
    return None if ready.model.unknowns > LARGE else first_reduced(ready, COMPANION_MODES)


def budget(
    ready: Prepared, seen: ErrorMonitor, reduction: Reduction | None, ran: Histories | None = None,
    step: Mapping[str, float] | None = None,
) -> Budget:  # fmt: skip
    """Estimated errors of a run.

    Parameters
    ----------
    seen : the monitor of the run's steps
    ran : the run's own channels if it has all time points; else only the state of its steady motion, if any
    step : error of the step in each channel, if the run itself estimates it
    """
    found = seen.strained.indicators
    eta = link_errors(ready.model, found)
    kinds = channel_kinds(ready)
    small = companion(ready)
    limits = list(_limits(ready, found))
    modes = by_kind(reduction.estimate) if reduction else {}
    reduced = Share("reduction", modes) if modes else None
    shares = [reduced, frames_share(seen.geometric, kinds), seen.rounding.share(kinds)]
    if small is None:
        local = dict.fromkeys(kinds, SINGLE * seen.running.total)
        if "displacement" in local:
            local["displacement"] += seen.compliance.relative
        marched = Share("step", local if step is None else by_kind(step))
        shares += [marched if seen.steps else None, plain_mesh_share(eta, kinds)]
        return Budget(joined(shares), tuple(limits), eta)
    own = ran is not None and small.model is ready.model and len(ran.time) > 1
    small = replace(small, scene=beginning(small.scene, small.model))
    known, zeros = dict(step or {}), set[str]()
    try:
        near = ran.begun if ran is not None and small.model is ready.model else None
        base = replace(ran, size=extent(ready.model)) if ran is not None and own else histories(small, near=near)
        sizes = counted(base)
        counts = by_kind(sizes)
        here = [kind for kind in kinds if kind in counts]
        shares[1:] = [frames_share(seen.geometric, here), seen.rounding.share(here)]
        longer = None
        if seen.steps:
            if not known:
                known, longer = step_errors(small, base, zeros)
            step_share, known = _step_share(small, base, known, zeros)
            shares.append(step_share)
        else:
            if not states_step(ready.scene):  # positions that the scene states have no such error
                shares.append(positions_share(base, sizes))
            some, base = fewer_positions(small.scene, base)
            small = replace(small, scene=some)
        if longer is not None and not longer.divided and differs_alike(small):
            small, base = replace(small, scene=doubled(small.scene)), longer
        shares.append(mesh_share(small, base, eta, zeros))
        limits += _zeros(sizes, zeros)
    except KedfemError as fault:
        limits.append(f"step and mesh: a run for comparison failed ({str(fault).splitlines()[0]})")
    return Budget(joined(shares), tuple(limits), eta, known)


def channel_kinds(ready: Prepared) -> tuple[str, ...]:
    """Kinds of channels that a scene has."""
    every = recording(ready.scene, ready.model, linked=ready.linkage)
    return tuple(by_kind({each.channel.name: 0.0 for each in every}))


def beginning(scene: Scene, model: Model) -> Scene:
    """The beginning of an analysis that is too long to be repeated; for a steady motion its period."""
    if scene.analysis.kind == "steady":
        return with_analysis(scene, stability=False)
    grid = time_grid(scene)
    elements = scene.springs or scene.limits
    compiled = all(link.unknowns <= SMALL for link in model.links) and not model.rows and not elements
    most = max(SPAN, int(CHEAP / max(model.unknowns, 1))) if compiled else SLOW
    return scene if grid.steps <= most else in_steps(scene, grid.step, most)


def frames_share(geometric: GeometricError, kinds: Sequence[str]) -> Share | None:
    """The error of rigid-body frames; None if all are co-rotational."""
    if all(link.fit is not None for link in geometric.model.links):
        return None
    warned = geometric_warning(geometric)
    remedy = warned[0].rsplit("; ", 1)[-1] if warned else ""
    how = bent(geometric)
    errors = {kind: geometric.estimate if kind == "stress" else geometric.worst for kind in kinds}
    return Share("frames", errors, f"{how}; {remedy}" if remedy else "")


def step_errors(
    ready: Prepared, base: Histories, zeros: set[str] | None = None
) -> tuple[dict[str, float], Histories | None]:
    """Step error of each channel of a run with a single level, and the run in steps twice as long.

    The error is the difference from a run in steps twice as long or, if these would be too long, half as long; there is
    no second result then.

    Parameters
    ----------
    zeros : set to which the names of channels that are zero beside others are added
    """
    longer, grid = can_double(ready), time_grid(ready.scene)
    finer = with_analysis(in_steps(ready.scene, 0.5 * grid.step, 2 * grid.steps), extrapolation_levels=1)
    other = histories(replace(ready, scene=doubled(ready.scene) if longer else finer), near=base.begun)
    fine, coarse = (base, other) if longer else (other, base)
    return single_errors(fine, coarse, bool(ready.scene.limits), zeros)[0 if longer else 1], other if longer else None


def _step_share(
    ready: Prepared, base: Histories, marched: Mapping[str, float], zeros: set[str]
) -> tuple[Share, dict[str, float]]:
    """The share of the step, and channel → its error, from what levels or marches show and from numerical damping."""
    sizes, damped = counted(base), damped_errors(ready, base, zeros)
    every = {name: max(error, damped.get(name, 0.0)) for name, error in (damped | dict(marched)).items()}
    shown = {name: error for name, error in every.items() if name in sizes}
    return Share("step", by_kind(shown), damping_remedy(ready.scene, marched, damped)), every


def _zeros(sizes: Collection[str], zeros: Collection[str]) -> list[str]:
    """Sentences on channels that are zero beside others, which tell to what their errors are relative."""
    return [
        f"{name} by itself: it is zero but for the accuracy of others; its error is relative to the largest in its unit"
        for name in sizes if name in zeros
    ]  # fmt: skip


def _limits(ready: Prepared, found: Mapping[int, Indicator]) -> list[str]:
    """Descriptions of places where stress grows with every refinement of the mesh."""
    scene, out, grows = ready.scene, [], "it grows as elements shrink"
    at_edges = dict.fromkeys(ready.model.links[k].name for k, each in found.items() if each.singular)
    if at_edges:
        edge = "an edge that points inwards without a fillet"
        out.append(f"stress of {', '.join(at_edges)} at {edge}: {grows}")
    meshed = {link.name for link in ready.model.links if link.meshed}
    loads = scene.loads.items()
    points = [name for name, x in loads if isinstance(x, ForceLoad) and x.link in meshed and x.at is not None]
    if points:
        out.append(f"stress where {', '.join(points)} acts on a point: {grows}")
    stiff = [
        name for name, joint in scene.joints.items()
        if set(joint.links) & meshed and any(joint.stiff(link) for link in joint.links)
    ]  # fmt: skip
    if stiff:
        out.append(f"stress around joints {', '.join(stiff)} with rigid couplings: {grows}")
    return out
