"""Links reduced as far as a tolerance allows, with an estimate of the reduction error.

The residual of the reduced run in the unreduced equation is evaluated at some instants; the static deflections of the
unreduced linkage under it are added to the modes, and the run is repeated. The change, times a factor measured on
unreduced runs, is the estimate: the residual in the dual of the energy norm, integrated over time. If it exceeds the
tolerance, the richer modes are kept, and the same is repeated.

Scenes that differ only in damping and in the speed of their drive can share one reduction (`shared_modes`): modes are
found for the fastest, the estimate for the slowest adds what it needs, and the larger estimate of both counts.

Links with co-rotational frames have each segment reduced, with modes from rigid-body frames; the runs that estimate the
error have co-rotational frames. Of the residual in these frames only the effect of moments on their rotation is left out.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.longer_steps import differs_alike, doubled
from kedfem.accuracy.prepared import Prepared, damped_as, key, meshed, moving, shared_reduction, training_motion
from kedfem.accuracy.variants import shortened, with_analysis
from kedfem.arrays import Float
from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.matrices.dense import SMALL
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.bases import bases, reduced_at
from kedfem.dynamics.modes.reduction import Basis, enriched, static_parts
from kedfem.dynamics.modes.residual import residual_deflections
from kedfem.dynamics.reduced_model import reduced_model, restored_model, stored_model
from kedfem.dynamics.rigid_elements import Acting, acting
from kedfem.dynamics.system.steps import with_element_points
from kedfem.links.record import Link
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.scene import Scene, time_grid, without_vibration
from kedfem.store import kept

Stage = Callable[[str], None]

ROUNDS = 4  # most enrichments
MOMENTS = 16  # instants of a run at which its residual is evaluated
CLOSER = 0.25  # most ratio of the tolerance of a round to that of the last one, for segments
ADDED = 8  # most modes that a round adds to a link
MINUTE = 60  # unknowns up to which a link cannot gain from a reduction
CAUTION = 1.6  # factor for the error of the richer run: the estimate is then 0.35 to 1.65 of the true error in 44 runs
FIRST = 0.1  # of the tolerance: energy norm of the training deflections that the first modes may leave out
SEGMENT = 0.1  # the same for segments: stress errs by more, and another round costs more than modes

Modes = list[Float[np.ndarray, "_ _"] | None]


@dataclass(frozen=True, slots=True)
class Reduction:
    """A prepared scene with reduced links.

    ready : the scene with its reduced model
    estimate : estimated relative error of every judged channel against unreduced links [-]
    tolerance : the error asked for [-]
    """

    ready: Prepared
    estimate: dict[str, float]
    tolerance: float


def prepared(
    scene: Scene, stage: Stage = lambda name: None, ends: Sequence[Scene] = (),
    known: Mapping[str, Link] | None = None,
) -> tuple[Prepared, Reduction | None]:  # fmt: skip
    """A scene prepared for its time steps, with links reduced as it states, and the reduction if there is one.

    Parameters
    ----------
    ends : the scenes with the extreme speeds among those that share modes with this one (`alike`); none if it has its own
    known : existing links by name, of this scene or of all that share modes
    """
    chosen = {name: link.modes for name, link in scene.links.items() if link.reduced}
    if not chosen:
        return meshed(scene, stage, known), None
    counts = {name: count for name, count in chosen.items() if count is not None}

    def found_for(one: Scene, *others: Scene) -> Reduction:
        tolerance = one.analysis.reduction_tolerance
        return kept(
            "reduction", " ".join(map(key, (one, *others))),
            lambda: reduced(meshed(one, stage, known), chosen, tolerance, counts, stage, others),
            _packed, lambda stored: _unpacked(stored, one),
        )  # fmt: skip

    if not ends:
        return (found := found_for(scene)).ready, found
    found = shared_reduction(" ".join(map(key, ends)), lambda: found_for(*ends))
    ready = Prepared(scene, *moving(scene), damped_as(scene, found.ready.model))
    found = replace(found, ready=ready)
    return found.ready, found


Stored = tuple[Linkage, Path, Model, dict[str, float]]


def _packed(reduction: Reduction) -> Stored | None:
    """A reduction in the form that is kept between runs; None if some links are unreduced."""
    ready, model = reduction.ready, stored_model(reduction.ready.model)
    return None if model is None else (ready.linkage, ready.path, model, reduction.estimate)


def _unpacked(stored: Stored, scene: Scene) -> Reduction:
    joined, along, model, estimate = stored
    ready = Prepared(scene, joined, along, restored_model(model))
    return Reduction(ready, estimate, scene.analysis.reduction_tolerance)


def reduced(
    full: Prepared, chosen: Collection[str], tolerance: float, counts: dict[str, int] | None = None,
    stage: Stage = lambda name: None, others: Sequence[Scene] = (),
) -> Reduction:  # fmt: skip
    """A prepared scene with some links reduced as far as a tolerance allows.

    Other large links are reduced too while the error is estimated, but unreduced in the result.

    Parameters
    ----------
    chosen : names of links
    tolerance : relative error that the reduction may cause in probes, joint forces and the drive's torque [-]
    counts : given numbers of modes, by link
    others : scenes that are `alike`, for which the modes must suffice too
    """
    stage("modes")
    parts = static_parts(full.model, full.linkage.mobility > 0)
    needed = {link.name for link in full.model.links if link.name in chosen or link.unknowns > SMALL}
    needed &= reducible(full.model)
    if not needed:
        return Reduction(full, {}, tolerance)
    found = bases(full.model, training_motion(full), parts, needed, _acting(full))
    given = counts or {}

    def first(share: float) -> Modes:
        shares = [share * (1.0 if link.fit is None else SEGMENT) for link in full.model.links]
        return [
            None if basis is None else basis.first(given.get(link.name, _count(link, basis, own * tolerance)))
            for link, basis, own in zip(full.model.links, found, shares, strict=True)
        ]

    stage("error of the reduction")
    Q, estimate = _settled(_beginning(full), parts, first, tolerance, chosen, given)
    for other in others:
        here = replace(full, scene=other, model=damped_as(other, full.model))
        Q, more = _settled(_beginning(here), parts, partial(_same, Q), tolerance, chosen, given)
        estimate = {name: max(estimate.get(name, 0.0), more.get(name, 0.0)) for name in {**estimate, **more}}
    taken = [f if link.name in chosen else None for f, link in zip(Q, full.model.links, strict=True)]
    return Reduction(replace(full, model=reduced_model(full.model, taken)), estimate, tolerance)


def _beginning(full: Prepared) -> Prepared:
    """A prepared scene for the estimate of the reduction error: with vibration, short."""
    scene = full.scene if without_vibration(full.scene) else with_analysis(full.scene, kind="transient")
    return replace(full, scene=shortened(scene))


def _same(Q: Modes, share: float) -> Modes:
    """The given modes, for any share of a tolerance."""
    return Q


def reducible(model: Model) -> set[str]:
    """Names of the links that can be reduced: all but beams with co-rotational frames, whose elements are small."""
    return {link.name for link in model.links if link.fit is None or link.meshed}


def _count(link: Link, basis: Basis, tolerance: float) -> int:
    """Initial number of modes for a tolerance; the modes of segments are sorted differently."""
    return basis.count(FIRST * tolerance if link.fit is None else tolerance)


def first_reduced(
    full: Prepared, tolerance: float, known: Sequence[Float[np.ndarray, "_ _"] | None] | None = None
) -> Prepared:
    """A prepared scene with all large links reduced about as far as a tolerance allows, on known modes if there are any.

    No link is reduced if some motions are free. The error is not estimated.
    """
    links = full.model.links
    if full.linkage.mobility or all(link.unknowns <= SMALL and link.full is None for link in links):
        return full
    model = full.model if known is None else reduced_model(full.model, known)
    left = {link.name for link in model.links if link.unknowns > MINUTE and link.full is None}
    left &= reducible(model)
    if not left:
        return replace(full, model=model)
    forces = _acting(replace(full, model=model))
    small = reduced_at(model, training_motion(full), left, lambda link, basis: _count(link, basis, tolerance), forces)
    return replace(full, model=small)


def _acting(full: Prepared) -> Acting:
    """What acts on the links of a prepared scene beside loads."""
    return acting(full.scene, full.linkage, full.path, full.model)


def _settled(full: Prepared, *given: Any) -> tuple[Modes, dict[str, float]]:
    """Modes and the estimate, as `_in_rounds`: by steps twice as long where these show the same and none is divided.

    A step that is divided, as its iterations do not converge, excites vibration that has nothing to do with the modes.
    """
    if differs_alike(full):
        Q, estimate, divided = _in_rounds(replace(full, scene=doubled(full.scene)), *given)
        if not divided:
            return Q, estimate
    return _in_rounds(full, *given)[:2]


def _in_rounds(
    full: Prepared, parts: Sequence[Substructure], first: Callable[[float], Modes], tolerance: float,
    chosen: Collection[str], fixed: Collection[str],
) -> tuple[Modes, dict[str, float], bool]:  # fmt: skip
    """Modes whose estimated error is below the tolerance, or else the last ones, the estimate, and whether any step
    was divided.

    Parameters
    ----------
    first : function from a share of the tolerance to initial modes
    fixed : names of links whose number of modes is given
    """
    moments = set(np.linspace(1, time_grid(full.scene).steps, MOMENTS).astype(int).tolist())
    share, divided = 1.0, False
    Q = first(share)
    small, run = _run(full, Q, moments)
    for k in range(ROUNDS + 1):
        more = _enriched(full, parts, small, run.kept)
        richer, better = _run(full, more, moments)
        divided = divided or run.divided or better.divided
        estimate = {name: CAUTION * error for name, error in relative_errors(run, better).items()}
        if worst(estimate) <= tolerance or set(chosen) <= set(fixed) or k == ROUNDS:
            break
        share *= min(CLOSER, tolerance / worst(estimate))
        segments = _closer(full.model, Q, first(share), more)
        both = zip(full.model.links, Q, segments, strict=True)
        Q = [old if link.name in fixed else new for link, old, new in both]
        unchanged = all(new is tried for new, tried in zip(Q, more, strict=True))
        small, run = (richer, better) if unchanged else _run(full, Q, moments)
    return Q, estimate, divided


def _closer(model: Model, now: Modes, next_ones: Modes, richer: Modes) -> Modes:
    """The next modes of segments as long as there are any, else those of the richer run."""
    lengths = [[0 if Q is None else Q.shape[1] for Q in each] for each in (now, next_ones)]
    more = lengths[0] != lengths[1]
    every = zip(model.links, next_ones, richer, strict=True)
    return [some if more and link.fit is not None else other for link, some, other in every]


def _run(full: Prepared, Q: Modes, moments: Collection[int]) -> tuple[Prepared, Histories]:
    """The model with given modes, and its run."""
    small = replace(full, model=reduced_model(full.model, Q))
    return small, histories(small, moments)


def _enriched(full: Prepared, parts: Sequence[Substructure], small: Prepared, kept: Sequence[Snapshot]) -> Modes:
    """Modes with added responses to the residual at some instants."""
    points = with_element_points(full.scene, full.linkage, full.model)
    answers = residual_deflections(full.model, parts, small.model, kept, points)
    links = zip(full.model.links, small.model.links, zip(*answers, strict=True), strict=True)
    return [None if link is whole else enriched(link, each, ADDED) for whole, link, each in links]
