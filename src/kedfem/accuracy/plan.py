"""The cheapest model of a scene that is near enough: `analysis.accuracy`.

Everything is found by short trial runs of the scene itself, with reduced links: the step by halving it, the mesh by
making it finer, segments of links with frames that follow by taking more, simpler links by putting them in. What the
scene states stays; what it leaves open is chosen.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

from kedfem.accuracy.cache import key
from kedfem.accuracy.segments import open_segments, with_segments
from kedfem.accuracy.stability import fewest_steps
from kedfem.accuracy.trials import Stage, Trials
from kedfem.accuracy.variants import (
    families,
    of_family,
    refinable,
    refined,
    with_analysis,
    with_links,
    with_steps,
)
from kedfem.errors import KedfemError, SceneError
from kedfem.scene import LinkScene, Scene, time_grid
from kedfem.store import itself, kept

STEP, MESH, MODEL, REDUCTION = 0.3, 0.4, 0.2, 0.1  # shares of the error asked for
SEGMENTS = 0.2  # of the mesh's share, where links with frames that follow leave their number open
FINER = (1.0, 1.5, 2.0, 3.0, 4.0)  # meshes tried
MESH_ORDER = (
    2.0  # at which probes are taken to converge with the mesh: stresses at rounded corners do no better
)
STEP_ORDER = 2.0
LEAST_ORDER = 0.7  # at which an error must fall with the step, or no step will do
MOST_STEPS = 200_000  # of the analysis
TRIES = 6  # steps tried


@dataclass(frozen=True, slots=True)
class Share:
    """One part of the error: what of, how much (relative, worst channel), how much was allowed."""

    what: str
    error: float
    allowed: float


@dataclass(frozen=True, slots=True)
class Plan:
    """What was chosen for a scene with `analysis.accuracy`, and why.

    scene : the scene with everything chosen
    asked : the accuracy
    finer : of the usual meshes, by which factor elements are smaller
    shares : parts of the error; the reduction's is what it may cause
    notes : what was tried, left out, and what limits the accuracy
    """

    scene: Scene
    asked: float
    finer: float
    shares: tuple[Share, ...]
    notes: tuple[str, ...]

    @property
    def error(self) -> float:
        """Estimated error of the run, all shares together."""
        return sum(share.error for share in self.shares)

    @property
    def reached(self) -> bool:
        """Whether the estimate is within what was asked for."""
        return self.error <= self.asked


def planned(scene: Scene, stage: Stage = lambda name: None) -> Plan:
    """Choose fidelities, mesh sizes, functions and step of a scene with `analysis.accuracy`.

    Raises
    ------
    MotionError, MeshError, SceneError, SolveError
        If the scene cannot be run even as it stands.
    """
    asked = scene.analysis.accuracy
    if asked is None:
        raise ValueError("the scene asks for no accuracy")
    plan: Plan = kept("plan", key(scene), partial(_planned, scene, asked, stage), itself, itself)
    return plan


def _planned(scene: Scene, asked: float, stage: Stage) -> Plan:
    search = Trials(asked, stage)
    stage("plan: step")
    left_open = [name for name, link in scene.links.items() if link.fidelity == "auto"]
    scene, step = _with_step(search, _opened(scene, left_open))
    stage("plan: mesh")
    cut = SEGMENTS if open_segments(scene) else 0.0  # of the mesh's share
    scene, mesh, finer = _with_mesh(search, scene, (MESH - cut) * max(asked, step / STEP))
    segments = 0.0
    if cut:
        stage("plan: segments")
        scene, segments = with_segments(search, scene, SEGMENTS * max(asked, step / STEP))
    stage("plan: simpler links")
    scene, model = _with_simpler_links(search, scene, left_open, (MESH - cut + MODEL) * asked - mesh)
    scene = with_analysis(scene, reduction=REDUCTION * asked, accuracy=None)
    reduced = any(link.reduced for link in scene.links.values())
    shares = (
        Share("time step", step, STEP * asked), Share("mesh", mesh, (MESH - cut) * asked),
        *([Share("segments", segments, SEGMENTS * asked)] if cut else []),
        Share("simpler links", model, max(MODEL, MESH - cut + MODEL - mesh / asked) * asked),
        Share("reduction", REDUCTION * asked if reduced else 0.0, REDUCTION * asked),
    )  # fmt: skip
    plan = Plan(scene, asked, finer, shares, ())
    return replace(plan, notes=(*search.notes, *_limits(plan)))


def _limits(plan: Plan) -> Iterator[str]:
    if not plan.reached:
        limit = max(plan.shares, key=lambda share: share.error / share.allowed)
        yield (
            f"the accuracy of {100 * plan.asked:.3g} % could not be reached: {limit.what} limits it, "
            f"{100 * plan.error:.2g} % is expected"
        )


def _opened(scene: Scene, left_open: list[str]) -> Scene:
    """Links that leave their fidelity open as the best that their shape allows, reduced."""
    links = {
        name: _remeshed(
            scene.links[name], of_family(scene.links[name], families(scene.links[name])[-1], True)
        )
        for name in left_open
    }
    return with_links(scene, links)


def _remeshed(link: LinkScene, other: LinkScene) -> LinkScene:
    """Another fidelity of a link with the mesh that the link states, if it does."""
    keep: dict[str, Any] = {
        key: getattr(link, key) for key in ("mesh", "element") if key in link.model_fields_set
    }
    return other.model_copy(update=keep)


def _with_step(search: Trials, scene: Scene) -> tuple[Scene, float]:
    """The scene with the largest step whose error is within its share, and that error."""
    allowed = STEP * search.asked
    given = {"step", "steps_per_turn"} & scene.analysis.model_fields_set
    fewest = max(20, math.ceil(steady if (steady := fewest_steps(scene)) < math.inf else 0.0))
    steps, order, before = max(time_grid(scene).steps, 0 if given else fewest), STEP_ORDER, (0, math.inf)
    for _ in range(TRIES):
        now, half = with_steps(scene, steps), with_steps(scene, 2 * steps)
        error = search.difference(now, half) / (1 - 2**-order)
        if given:
            if error > allowed:
                search.notes.append(f"the scene states its step; its error is about {error:.2g}")
            return scene, error
        if before[0] and steps > before[0] and error > 0.0:
            order = min(STEP_ORDER, math.log(before[1] / error) / math.log(steps / before[0]))
        wanted = (error / (0.8 * allowed)) ** (1 / max(order, LEAST_ORDER))
        if error <= allowed and (wanted > 0.5 or steps == fewest):
            return now, error
        if order < LEAST_ORDER or steps * min(wanted, 8.0) > MOST_STEPS:
            search.notes.append(_unresolved(steps, error))
            return now, error
        before = (steps, error)
        steps = max(fewest, math.ceil(steps * min(max(wanted, 0.25), 8.0)))
    search.notes.append(_unresolved(before[0], error))
    return with_steps(scene, before[0]), error


def _unresolved(steps: int, error: float) -> str:
    return (
        f"the error of the time step stays at {error:.2g} with {steps} steps: the motion excites vibration beyond them "
        "(a start from rest at full speed, a load put on at once?); a smoother start or damping would help"
    )


def _with_mesh(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float, float]:
    """The scene with the coarsest mesh whose error is allowed, that error, and by what it is finer.

    Where the step's error is beyond its share the mesh need not be better.
    """
    open_links = [
        name for name, link in scene.links.items() if "mesh" not in link.model_fields_set and refinable(link)
    ]
    if not open_links:
        search.notes.append("the scene states all meshes; their error was not looked at")
        return scene, 0.0, 1.0
    meshes = _distinct([(factor, _finer(scene, open_links, factor)) for factor in FINER])
    error = math.inf
    for (factor, now), (next_factor, finer) in pairwise(meshes):
        try:
            change = search.difference(now, finer)
        except KedfemError as fault:
            search.notes.append(f"a finer mesh could not be tried: {str(fault).splitlines()[0]}")
            return now, error, factor
        beyond = change / ((next_factor / factor) ** MESH_ORDER - 1)
        error = change + beyond
        if error <= allowed:
            return now, error, factor
        if beyond <= allowed:
            return finer, beyond, next_factor
        error = beyond
    search.notes.append(f"the finest mesh tried still leaves an error of {error:.2g}")
    return meshes[-1][1], error, meshes[-1][0]


def _distinct(meshes: list[tuple[float, Scene]]) -> list[tuple[float, Scene]]:
    """Without those that are like the one before: few elements become more by whole numbers only."""
    pairs = zip(meshes, [None, *meshes], strict=False)
    return [now for now, before in pairs if before is None or now[1].links != before[1].links]


def _finer(scene: Scene, names: list[str], factor: float) -> Scene:
    return with_links(scene, {name: refined(scene.links[name], factor) for name in names})


def _with_simpler_links(
    search: Trials, scene: Scene, left_open: list[str], allowed: float
) -> tuple[Scene, float]:
    """The scene with links made rigid, beams or plane as far as that changes little, and by how much it does.

    Allowed is what the mesh left of both shares: a simpler link is compared with the one on that mesh.
    """
    reference, error = scene, 0.0
    for name in left_open:
        for simpler in _simpler(scene.links[name], search.asked):
            trial = with_links(scene, {name: simpler})
            try:
                change = search.difference(trial, reference)
            except SceneError:  # such a model makes no sense, as one without any elastic link
                continue
            except KedfemError as fault:
                search.notes.append(f"{name}: not {simpler.fidelity}, {str(fault).splitlines()[0]}")
                continue
            verdict = "taken" if change <= allowed else "left out"
            search.notes.append(f"{name}: as {_noun(simpler)} the results change by {change:.2g}, {verdict}")
            if change <= allowed:
                scene, error = trial, change
                break
    return scene, error


def _simpler(link: LinkScene, asked: float) -> Iterator[LinkScene]:
    """Simpler fidelities of a link, simplest first."""
    for family in families(link)[:-1]:
        other = of_family(link, family, reduced=True)
        if family == "beam":
            other = refined(other, math.ceil(4 / math.sqrt(asked)))
        yield other if family in {"rigid", "beam"} else refined(other, 2.0)


def _noun(link: LinkScene) -> str:
    return {"rigid": "a rigid link", "beam": "a beam", "plane": "a plane link"}.get(link.fidelity, "a solid")
