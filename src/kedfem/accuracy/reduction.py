"""Links reduced as far as a tolerance allows, with an estimate of the reduction error.

The estimate: the residual of the reduced run in the full equation, at some moments, is answered by static deflections of
the full linkage; these are added to the modes, and the run is repeated. What changes, times a factor found on full
runs, is the estimate: the residual measured in the norm dual to the energy's, integrated over time. If it is above the
tolerance, the richer modes are kept and the same is done again.

Scenes that differ in the speed of their drive and in damping alone can share one reduction (`shared_modes`): modes are
found at the fastest, and those added that the estimate asks for at the slowest; the larger estimate of both counts.

Of links with co-rotational frames each segment is reduced, with modes that rigid-body frames give; the runs that estimate
the error have co-rotational frames. Of the residual in their frames only what moments do in turning these is left out.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.longer_steps import differs_alike, doubled
from kedfem.accuracy.prepared import Prepared, damped_as, key, last_of, meshed, moving, training_motion
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
from kedfem.links.record import Link
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.scene import Scene, time_grid, without_vibration
from kedfem.store import kept

Stage = Callable[[str], None]

ROUNDS = 4  # of enriching
MOMENTS = 16  # of a run where its residual is taken, evenly over it
CLOSER = 0.25  # a round's share of the last one's tolerance, of segments, at most
ADDED = 8  # modes that a round adds to a link, at most
MINUTE = 60  # unknowns of a link that cannot gain from a reduction
CAUTION = 1.6  # the richer run errs too: with this the estimate is 0.35 to 1.65 of the true error in 44 runs
FIRST = 0.1  # of the tolerance: what the first modes leave out of the training deflections' energy norm
SEGMENT = 0.1  # of the tolerance: the same of segments; stress errs by more, and another round costs more than modes

Functions = list[Float[np.ndarray, "_ _"] | None]


@dataclass(frozen=True, slots=True)
class Reduction:
    """A prepared scene with reduced links.

    ready : its model reduced
    estimate : relative error of every channel that counts, compared with the unreduced links
    tolerance : that was asked for
    """

    ready: Prepared
    estimate: dict[str, float]
    tolerance: float


def prepared(
    scene: Scene, stage: Stage = lambda name: None, ends: Sequence[Scene] = (),
    known: Mapping[str, Link] | None = None,
) -> tuple[Prepared, Reduction | None]:  # fmt: skip
    """Everything of a scene that does not depend on a time step, with links reduced as the scene says.

    Parameters
    ----------
    ends : scenes that share their modes with this one, as `alike` says; none: it has its own
    known : links that are made already, by name: of this scene, or of all that share modes
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
    found = last_of(" ".join(map(key, ends)), lambda: found_for(*ends))
    ready = Prepared(scene, *moving(scene), damped_as(scene, found.ready.model))
    found = replace(found, ready=ready)
    return found.ready, found


Stored = tuple[Linkage, Path, Model, dict[str, float]]


def _packed(reduction: Reduction) -> Stored | None:
    """A reduction in the form that is kept between runs; None if links are left unreduced."""
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
    """Reduce some links of a prepared scene, as far as a tolerance allows.

    Links that are not chosen but large are reduced too while the error is estimated, and left unreduced at the end.

    Parameters
    ----------
    chosen : names of links
    tolerance : relative error that the reduction may cause in probes, joint forces and the drive's torque [-]
    counts : number of modes of links that have it given
    others : scenes that are `alike`, and for which the modes must serve too
    """
    stage("modes")
    parts = static_parts(full.model, full.linkage.mobility > 0)
    needed = {link.name for link in full.model.links if link.name in chosen or link.unknowns > SMALL}
    needed &= reducible(full.model)
    if not needed:
        return Reduction(full, {}, tolerance)
    found = bases(full.model, training_motion(full), parts, needed)
    given = counts or {}

    def first(share: float) -> Functions:
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
    """A prepared scene for the estimate of the reduction error: with vibration, short, in long steps where it may be."""
    scene = full.scene if without_vibration(full.scene) else with_analysis(full.scene, kind="transient")
    short = replace(full, scene=shortened(scene))
    return replace(short, scene=doubled(short.scene)) if differs_alike(short) else short


def _same(Q: Functions, share: float) -> Functions:
    """The given modes, for any share of a tolerance."""
    return Q


def reducible(model: Model) -> set[str]:
    """Names of the links that can be reduced: not beams with co-rotational frames, which are elements of few
    functions."""
    return {link.name for link in model.links if link.fit is None or link.meshed}


def _count(link: Link, basis: Basis, tolerance: float) -> int:
    """Initial number of modes for a tolerance; those of segments are sorted by their purpose."""
    return basis.count(FIRST * tolerance if link.fit is None else tolerance)


def first_reduced(
    full: Prepared, tolerance: float, known: Sequence[Float[np.ndarray, "_ _"] | None] | None = None
) -> Prepared:
    """All large links of a prepared scene reduced about as far as a tolerance allows, on known modes if there are any.

    None is where the drive leaves motions free; the error is not examined.
    """
    links = full.model.links
    if full.linkage.mobility or all(link.unknowns <= SMALL and link.full is None for link in links):
        return full
    model = full.model if known is None else reduced_model(full.model, known)
    left = {link.name for link in model.links if link.unknowns > MINUTE and link.full is None}
    left &= reducible(model)
    if not left:
        return replace(full, model=model)
    small = reduced_at(model, training_motion(full), left, lambda link, basis: _count(link, basis, tolerance))
    return replace(full, model=small)


def _settled(
    full: Prepared, parts: Sequence[Substructure], first: Callable[[float], Functions], tolerance: float,
    chosen: Collection[str], fixed: Collection[str],
) -> tuple[Functions, dict[str, float]]:  # fmt: skip
    """Modes whose estimated error is below the tolerance, or the last ones, and the estimate.

    Parameters
    ----------
    first : modes to begin with, for a share of the tolerance
    fixed : names of links whose number of modes is given
    """
    moments = set(np.linspace(1, time_grid(full.scene).steps, MOMENTS).astype(int).tolist())
    share = 1.0
    Q = first(share)
    small, run = _run(full, Q, moments)
    for k in range(ROUNDS + 1):
        more = _enriched(full, parts, small, run.kept)
        richer, better = _run(full, more, moments)
        estimate = {name: CAUTION * error for name, error in relative_errors(run, better).items()}
        if worst(estimate) <= tolerance or set(chosen) <= set(fixed) or k == ROUNDS:
            break
        share *= min(CLOSER, tolerance / worst(estimate))
        segments = _closer(full.model, Q, first(share), more)
        both = zip(full.model.links, Q, segments, strict=True)
        Q = [old if link.name in fixed else new for link, old, new in both]
        unchanged = all(new is tried for new, tried in zip(Q, more, strict=True))
        small, run = (richer, better) if unchanged else _run(full, Q, moments)
    return Q, estimate


def _closer(model: Model, now: Functions, next_ones: Functions, richer: Functions) -> Functions:
    """The next modes of segments, which are few, as long as there are any; else those of the larger run."""
    lengths = [[0 if Q is None else Q.shape[1] for Q in each] for each in (now, next_ones)]
    more = lengths[0] != lengths[1]
    every = zip(model.links, next_ones, richer, strict=True)
    return [some if more and link.fit is not None else other for link, some, other in every]


def _run(full: Prepared, Q: Functions, moments: Collection[int]) -> tuple[Prepared, Histories]:
    """The model on given modes, and its run."""
    small = replace(full, model=reduced_model(full.model, Q))
    return small, histories(small, moments)


def _enriched(full: Prepared, parts: Sequence[Substructure], small: Prepared, kept: Sequence[Snapshot]) -> Functions:
    """Modes with the responses to the residual at some instants added."""
    answers = residual_deflections(full.model, parts, small.model, kept)
    links = zip(full.model.links, small.model.links, zip(*answers, strict=True), strict=True)
    return [None if link is whole else enriched(link, each, ADDED) for whole, link, each in links]
