"""Choices by trial runs for a required accuracy: frames, elements of beams, the step."""

import math
from collections.abc import Sequence
from dataclasses import replace

from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.free_step import free_step
from kedfem.accuracy.geometric import GeometricError
from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.resolution import fewest_steps
from kedfem.accuracy.step_estimate import IN_STEP, LEAST_ORDER, StepChoice, StepEstimate, cheapest, single_level
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import TRIAL_STEPS, shortened, with_analysis, with_links, with_steps
from kedfem.dynamics.stepping.levels import most_levels
from kedfem.errors import KedfemError
from kedfem.scene import LinkScene, Scene, revolution_steps, scene_from, states_step, time_grid, without_vibration

FRAMES_BEAMS = 0.5  # of the accuracy: error of rigid-body frames above which scenes of beams get co-rotational ones
FRAMES_OTHERS = 1.5  # the same with solid or plane links, for which these cost more; the estimate is cautious too
ELEMENTS = ("beam3", 1), *(("beam5", count) for count in (1, 2, 3, 4, 6))  # tried in turn, coarsest first
COUNTS = 1, 2, 3, 4, 6, 8, 12, 16, 24  # numbers of elements tried if the scene states their kind
FINEST = 2  # elements of the reference over those of the last one tried
FEWEST = 50  # least number of time points of an analysis
ROWS = 180  # least number of time points of a revolution, for curves and animations
# levels of a trial, which show whether errors fall with the step; ratio of its coarsest step to its finest
TRIED, COARSER = 3, 4
LEAST = 12  # least number of steps of the coarsest level of a trial
MOST_STEPS = 200_000  # of the analysis
TRIES = 5  # most trials of a step
CHEAP = 2e7  # steps times unknowns that take seconds
SHORTER, PATIENCE = 2.0, 2  # factor by which steps become shorter if vibration is not resolved, and how often
LEAP = 4  # most factor of the steps from one trial to the next, as predictions of a coarse trial are uncertain
CLOSE = 0.15  # share of additional steps below which no further trial is made


def open_frames(scene: Scene) -> bool:
    """Whether the scene leaves its frames open; without a drive they are always co-rotational."""
    if not scene.driven_joints:
        return False
    stated = "frames" in scene.analysis.model_fields_set or scene.analysis.stiffening
    return not stated and all(link.frames is None for link in scene.links.values())


def open_step(scene: Scene) -> bool:
    """Whether the scene leaves its step open; independent static positions have none."""
    return not states_step(scene) and not without_vibration(scene)


def open_beams(scene: Scene) -> list[str]:
    """Names of the elastic beams whose elements the scene leaves open."""
    links = scene.links.items()
    return [n for n, link in links if elastic(link, "beam") and "mesh" not in link.model_fields_set]


def beams_only(scene: Scene) -> bool:
    """Whether all links with a shape are beams or rigid."""
    return all(link.category in {"beam", "rigid"} for link in scene.links.values() if link.shape)


def elastic(link: LinkScene, *families: str) -> bool:
    """Whether a link is stated to be elastic and belongs to one of some families."""
    return link.shape is not None and link.model not in {"rigid", "auto"} and link.family in families


def chosen_frames(search: Trials, scene: Scene) -> tuple[Scene, float]:
    """The scene, with co-rotational frames if rigid-body ones err too much, and the error of its frames."""
    if not open_frames(scene):
        return scene, 0.0
    trial = shortened(with_beams(scene, open_beams(scene), ELEMENTS[2]))
    if open_step(scene):
        trial = with_steps(trial, max(time_grid(trial).steps // 2, math.ceil(_least(trial)), FEWEST))
    ready = search.ready(trial)
    geometric = GeometricError(ready.model)
    histories(ready, look=geometric.add)
    error = geometric.worst
    if error <= frames_allowed(search, scene):
        return scene, error
    corotational = with_analysis(scene, frames="co-rotational")
    try:
        scene_from(corotational.model_dump(mode="json"))
        tried = with_beams(corotational, open_beams(scene), ELEMENTS[2])
        search.run(with_steps(shortened(tried), time_grid(trial).steps))
    except KedfemError as fault:
        message = str(fault).splitlines()[0]
        search.notes.append(f"co-rotational frames would be needed, but cannot be taken: {message}")
        return scene, error
    search.notes.append(f"rigid-body frames would be off by {percent(error)}: frames are co-rotational")
    return corotational, 0.0


def frames_allowed(search: Trials, scene: Scene) -> float:
    """The error of rigid-body frames above which links get co-rotational ones."""
    return (FRAMES_BEAMS if beams_only(scene) else FRAMES_OTHERS) * search.asked


def _least(scene: Scene) -> float:
    least = fewest_steps(scene)
    return least if least < math.inf else 0.0


def with_beams(scene: Scene, names: Sequence[str], choice: tuple[str, int]) -> Scene:
    """The scene with a kind and number of elements in some beams; an element that a beam states is kept."""
    links = {}
    for name in names:
        link = scene.links[name]
        mesh = link.mesh.model_copy(update={"elements": choice[1]})
        kept = link.element if "element" in link.model_fields_set else choice[0]
        links[name] = link.model_copy(update={"element": kept, "mesh": mesh})
    return with_links(scene, links)


def chosen_beams(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the fewest elements in its open beams whose error against fine beams is allowed, and that error."""
    names = open_beams(scene)
    if not names:
        return scene, 0.0
    stated = any("element" in scene.links[name].model_fields_set for name in names)
    choices = [(ELEMENTS[-1][0], count) for count in COUNTS] if stated else list(ELEMENTS)
    error = math.inf
    for tried in (choices[:5], choices[5:]):
        if not tried:
            break
        finest = tried[-1][0], FINEST * tried[-1][1]
        try:
            reference = search.run(with_beams(scene, names, finest))
        except KedfemError as fault:
            search.balances(with_beams(scene, names, choices[-1]))
            search.notes.append(f"finer beams could not be tried: {str(fault).splitlines()[0]}")
            break
        for choice in tried:
            now = with_beams(scene, names, choice)
            try:
                error = worst(relative_errors(search.run(now), reference))
            except KedfemError:  # too coarse for co-rotational frames
                continue
            if error <= allowed:
                return now, error
    if math.isfinite(error):
        search.notes.append(f"the finest beams tried still leave an error of {percent(error)}")
    return with_beams(scene, names, choices[-1]), error


def chosen_step(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the step and the levels in time that reach an allowed error with the least work, and that error.

    A trial in several levels shows their differences, from which the step with the allowed error is predicted; the next
    trial has that step. Channels whose differences do not fall with the step contain unresolved vibration. Steps are
    made shorter for them PATIENCE times; afterwards the other channels decide, unless steps that resolve the vibration
    take only seconds. What remains is reported, with the steps that would be needed. A step and levels that the scene
    states are kept.
    """
    if without_vibration(scene):
        return scene, 0.0
    trial = shortened(scene)
    if not open_step(scene):
        error = _stated_error(search, trial)
        if error > allowed:
            more = "; analysis.extrapolation_levels = 2 would make it smaller"
            remedy = "" if scene.analysis.extrapolation_levels else more
            search.notes.append(f"the scene states its step; its error is about {percent(error)}{remedy}")
        return scene, error
    if not scene.driven_joints or scene.limits:
        return free_step(search, scene, allowed)
    span, whole = time_grid(trial).end, time_grid(scene).end
    least = math.ceil(max(_least(trial), LEAST))
    longest, levels = span / max(_fewest_rows(trial), least), _possible_levels(search, scene)
    steps, patience = max(math.ceil(time_grid(trial).steps / COARSER), least), PATIENCE
    slow: set[str] = set()
    tried = steps
    for _ in range(TRIES):
        found, channels = search.step(with_analysis(with_steps(trial, steps), extrapolation_levels=TRIED))
        slow = {name for name in channels if _slow(found, name, allowed)}
        choice = cheapest(found, allowed, set(channels) - slow, levels, longest)
        finest = span / choice.h * 2 ** (choice.levels - 1)
        wanted = max(least, math.ceil(finest / COARSER * (1 - 1e-9)))
        if slow and patience:
            wanted, patience = max(wanted, math.ceil(SHORTER * steps)), patience - 1
        elif wanted <= steps * (1 + CLOSE) and choice.h <= SHORTER * found.h:
            break
        most = int(min(TRIAL_STEPS, MOST_STEPS * span / whole)) // COARSER
        wanted = min(wanted, LEAP * steps, max(most, steps))
        if wanted == steps:
            break
        steps = wanted
        tried = max(tried, steps)
    words = ""
    if slow:
        resolving, words = _resolving(search, scene, tried, allowed, levels, longest)
        slow, choice = (set(), resolving) if resolving else (slow, choice)
    left = {name: min(1.0, found.differences[name][0]) for name in slow}
    error = max([choice.error, *left.values()])
    if error > allowed:
        names = sorted(left, key=left.__getitem__, reverse=True) or _over(found, allowed)
        search.notes.append(_unresolved(math.ceil(whole / choice.h), error, names, words))
    keys = {"step": choice.h, "steps_per_revolution": None, "extrapolation_levels": choice.levels}
    return with_analysis(scene, **keys), error


def _resolving(
    search: Trials, scene: Scene, steps: int, allowed: float, levels: range, longest: float
) -> tuple[StepChoice | None, str]:
    """The step that resolves all vibration if a run with it takes seconds; else None and a description of that step.

    Parameters
    ----------
    steps : number on the coarsest level that was tried already
    """
    trial = shortened(scene)
    span, whole = time_grid(trial).end, time_grid(scene).end
    unknowns, words = search.ready(trial).model.unknowns, ""
    most = int(min(CHEAP / max(unknowns, 1), MOST_STEPS * span / whole)) // COARSER
    full = {n for n, x in scene.links.items() if "reduction" in x.model_fields_set and not x.reduced}
    run = sum((x.full or x if x.name in full else x).unknowns for x in search.ready(trial).model.links)
    wanted = LEAP * steps
    while steps < min(wanted, most):
        steps = min(wanted, LEAP * steps, most)
        found, channels = search.step(with_analysis(with_steps(trial, steps), extrapolation_levels=TRIED))
        left = max((found.errors.get(name, 0.0) for name in channels), default=0.0)
        words = f"; steps of {found.h / COARSER:.2g} s, the shortest that are tried, leave {percent(min(1.0, left))}"
        if any(_slow(found, name, allowed) for name in channels):
            wanted = LEAP * steps
            continue
        choice = cheapest(found, allowed, channels, levels, longest)
        if whole * choice.work * run > CHEAP:
            return None, f"; {percent(allowed)} would take steps of about {choice.h:.1g} s"
        wanted = math.ceil(span / choice.h * 2 ** (choice.levels - 1) / COARSER)
        if wanted <= SHORTER * steps:
            return choice, ""
    return None, words


def _fewest_rows(trial: Scene) -> int:
    """Least number of time points of a trial, so that curves and animations are smooth."""
    turn = revolution_steps(trial)
    return FEWEST if turn is None else max(FEWEST, math.ceil(ROWS * time_grid(trial).steps / turn))


def _possible_levels(search: Trials, scene: Scene) -> range:
    """Possible numbers of levels: the stated one, or as many as have factors that fit in memory."""
    stated = scene.analysis.extrapolation_levels
    if stated is not None:
        return range(stated, stated + 1)
    model = search.ready(shortened(scene)).model
    links = tuple(link if scene.links[link.name].reduced else link.full or link for link in model.links)
    return range(1, 1 + most_levels(replace(model, links=links)))


def _slow(found: StepEstimate, name: str, allowed: float) -> bool:
    """Whether a channel's error exceeds the allowed one and does not fall with the step."""
    far, near = found.differences.get(name, (0.0, 0.0))[:2]
    return far > allowed and near > far / 2**LEAST_ORDER and found.fast[name] > IN_STEP


def _over(found: StepEstimate, allowed: float) -> list[str]:
    """Channels whose levels differ by more than is allowed, the worst first."""
    differ = {name: x[0] for name, x in found.differences.items()}
    return sorted((n for n in differ if differ[n] > allowed), key=differ.__getitem__, reverse=True)


def _stated_error(search: Trials, trial: Scene) -> float:
    """The error of a step that the scene states, in the levels that it states."""
    levels = trial.analysis.extrapolation_levels or 1
    found, channels = search.step(with_analysis(trial, extrapolation_levels=max(levels, 2)))
    if levels > 1:
        return max((found.errors.get(name, 0.0) for name in channels), default=0.0)
    left = ((found.differences[n][0], found.fast[n]) for n in channels if n in found.differences)
    return max((D * single_level(q)[1] for D, q in left), default=0.0)


def _unresolved(steps: int, error: float, channels: Sequence[str], words: str) -> str:
    names = ", ".join(channels[:3]) + (" and others" if len(channels) > 3 else "")
    return (
        f"the error of the time step stays at {percent(error)} with {steps} steps in {names}{words}: the motion excites "
        "vibration beyond them (a start from rest at full speed, a load put on at once?); a smoother start or damping "
        "would help, or a shorter analysis.step of your own"
    )
