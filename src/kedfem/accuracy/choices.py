"""What an accuracy chooses by trial runs: frames, elements of beams, the step, meshes of solid and plane links."""

import math
from collections.abc import Mapping, Sequence

from kedfem.accuracy.estimates import ORDERS, Strained, believed, link_errors, mesh_errors, observed_order
from kedfem.accuracy.geometric import GeometricError
from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.stability import fewest_steps
from kedfem.accuracy.trials import TRIAL_STEPS, Trials, shortened
from kedfem.accuracy.variants import refinable, refined, with_analysis, with_links, with_steps
from kedfem.errors import KedfemError
from kedfem.scene import LinkScene, MeshFile, Scene, scene_from, spatial_beams, time_grid

FOLLOWED = (
    0.5  # of the accuracy: nominal frames that err by more give way to frames that follow, in scenes of beams
)
DEARER = 1.5  # the same where solid or plane links would follow too: it costs them more, and the estimate is cautious
ELEMENTS = (
    ("beam3", 1),
    ("beam5", 1),
    ("beam5", 2),
    ("beam5", 3),
    ("beam5", 4),
    ("beam5", 6),
)  # tried, coarsest first
COUNTS = 1, 2, 3, 4, 6, 8, 12, 16, 24  # tried of an element that the scene states
FINEST = 2  # times the elements of the last one tried: the reference of beams
FEWEST = 20  # steps of an analysis
MOST_STEPS = 200_000  # of the analysis
TRIES = 5  # steps tried
SHORTER, PATIENCE = 2.0, 2  # by which steps are made shorter that do not resolve what vibrates, and how often
CLOSE = 0.15  # of the steps: as many more are not worth another trial
SAFE = 0.8  # of an allowed error that a step is chosen for
LEAST_ORDER = 0.7  # at which an error must fall with the step, or no step will do
MESH_ORDER = 2.0  # at which the error of a mesh falls; at edges that point inwards it does worse
FACTOR = 2.0  # by which elements are made smaller at most in one go
UNKNOWNS = 60_000  # of a model, beyond which no mesh is made finer unasked


def open_frames(scene: Scene) -> bool:
    """Whether the scene leaves its frames open."""
    stated = "frames" in scene.analysis.model_fields_set or scene.analysis.stiffening
    return not stated and all(link.frames is None for link in scene.links.values())


def open_step(scene: Scene) -> bool:
    """Whether it leaves its step open."""
    return scene.analysis.step is None and scene.analysis.steps_per_turn is None


def open_beams(scene: Scene) -> list[str]:
    """Names of the elastic beams whose elements it leaves open."""
    return [
        name
        for name, link in scene.links.items()
        if _elastic(link, "beam") and "mesh" not in link.model_fields_set
    ]


def open_meshes(scene: Scene) -> list[str]:
    """Names of the elastic solid and plane links whose mesh it leaves open."""
    return [
        name for name, link in scene.links.items()
        if (_elastic(link, "solid") or _elastic(link, "plane")) and "mesh" not in link.model_fields_set
        and not isinstance(link.shape, MeshFile)
    ]  # fmt: skip


def _elastic(link: LinkScene, family: str) -> bool:
    return link.shape is not None and link.fidelity not in {"rigid", "auto"} and link.family == family


def chosen_frames(search: Trials, scene: Scene) -> tuple[Scene, float]:
    """The scene with frames that follow where links bend too far for nominal ones, and the error of these else."""
    if not open_frames(scene):
        return scene, 0.0
    trial = shortened(with_beams(scene, open_beams(scene), ELEMENTS[2]))
    if open_step(scene):
        trial = with_steps(trial, max(time_grid(trial).steps // 2, math.ceil(_least(trial)), FEWEST))
    ready = search.ready(trial)
    geometric = GeometricError(ready.model)
    histories(ready, look=geometric.add)
    error = geometric.estimate
    beams = all(
        link.family == "beam" or link.fidelity == "rigid" for link in scene.links.values() if link.shape
    )
    if error <= (FOLLOWED if beams else DEARER) * search.asked:
        return scene, error
    if any(_elastic(scene.links[name], "beam") for name in spatial_beams(scene)):
        search.notes.append(
            "frames that follow would be needed; for beams in space they are not chosen unasked"
        )
        return scene, error
    following = with_analysis(scene, frames="following")
    try:
        scene_from(following.model_dump(mode="json"))
        search.run(with_steps(shortened(with_beams(following, open_beams(scene), ELEMENTS[2])), _few(trial)))
    except KedfemError as fault:
        said = str(fault).splitlines()[0]
        search.notes.append(f"frames that follow would be needed, but cannot be taken: {said}")
        return scene, error
    search.notes.append(f"nominal frames would be off by {100 * min(error, 1.0):.2g} %: frames follow")
    return following, 0.0


def _few(scene: Scene) -> int:
    return time_grid(scene).steps


def _least(scene: Scene) -> float:
    least = fewest_steps(scene)
    return least if least < math.inf else 0.0


def with_beams(scene: Scene, names: Sequence[str], choice: tuple[str, int]) -> Scene:
    """The scene with so many elements of a kind in some beams; an element that a beam states stays."""
    links = {}
    for name in names:
        link = scene.links[name]
        mesh = link.mesh.model_copy(update={"elements": choice[1]})
        kept = link.element if "element" in link.model_fields_set else choice[0]
        links[name] = link.model_copy(update={"element": kept, "mesh": mesh})
    return with_links(scene, links)


def chosen_beams(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the fewest elements in its open beams whose error is allowed, and that error: against a fine one."""
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
            search.notes.append(f"finer beams could not be tried: {str(fault).splitlines()[0]}")
            break
        for choice in tried:
            now = with_beams(scene, names, choice)
            try:
                error = worst(relative_errors(search.run(now), reference))
            except KedfemError:  # too coarse for frames that follow
                continue
            if error <= allowed:
                return now, error
    search.notes.append(f"the finest beams tried still leave an error of {error:.2g}")
    return with_beams(scene, names, choices[-1]), error


def chosen_step(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the largest step whose error is allowed, and that error.

    Three steps, each half of the last, show the order at which each channel's error falls; the next one tried is where it
    would be allowed. Channels whose order shows that they hold vibration that is not resolved are given PATIENCE shorter
    steps; then they are told, and the others choose.
    """
    trial = shortened(scene)
    whole = time_grid(scene).end / time_grid(trial).end
    fewest = 4 * math.ceil(max(FEWEST, _least(trial)) / 4)
    steps = max(4 * math.ceil(time_grid(trial).steps / 4), fewest)
    found = _errors(search, trial, steps)
    if not open_step(scene):
        if _worst(found) > allowed:
            search.notes.append(f"the scene states its step; its error is about {_worst(found):.2g}")
        return scene, _worst(found)
    patience = PATIENCE
    for _ in range(TRIES):
        slow = {name for name, (error, p) in found.items() if p < LEAST_ORDER and error > allowed}
        factors = [
            (e / (SAFE * allowed)) ** (1 / max(p, LEAST_ORDER))
            for n, (e, p) in found.items()
            if n not in slow
        ]
        factor = max(factors, default=0.0)
        if slow and patience:
            factor, patience = max(factor, SHORTER), patience - 1
        wanted = max(fewest, 4 * math.ceil(steps * min(max(factor, 0.125), 8.0) / 4))
        if (
            0.5 * steps <= wanted <= steps * (1 + CLOSE)
            or wanted * whole > MOST_STEPS
            or wanted > TRIAL_STEPS
        ):
            break
        steps = wanted
        found = _errors(search, trial, steps)
    error = _worst(found)
    if error > allowed:
        channels = [name for name, (e, _) in found.items() if e > allowed]
        search.notes.append(_unresolved(round(steps * whole), error, channels))
    return with_analysis(scene, step=time_grid(trial).end / steps, steps_per_turn=None), error


def _worst(found: Mapping[str, tuple[float, float]]) -> float:
    return max((error for error, _ in found.values()), default=0.0)


def _errors(search: Trials, trial: Scene, steps: int) -> dict[str, tuple[float, float]]:
    """Channel → error of so many steps, a multiple of four, and its order: against half and a quarter of them."""
    if steps // 4 < max(_least(trial), 8):
        now, half = (search.run(with_steps(trial, count)) for count in (steps, 2 * steps))
        return {
            name: (error / (1 - 2 ** -ORDERS[1]), ORDERS[1])
            for name, error in relative_errors(now, half).items()
        }
    now, half, quarter = (search.run(with_steps(trial, steps // k)) for k in (1, 2, 4))
    near, far = relative_errors(half, now), relative_errors(quarter, half)
    out = {}
    for name, error in near.items():
        p = observed_order(far.get(name, 0.0), error)
        out[name] = error / (2 ** believed(p) - 1), p
    return out


def _unresolved(steps: int, error: float, channels: Sequence[str]) -> str:
    names = ", ".join(channels[:3]) + (" and others" if len(channels) > 3 else "")
    return (
        f"the error of the time step stays at {error:.2g} with {steps} steps in {names}: the motion excites vibration "
        "beyond them (a start from rest at full speed, a load put on at once?); a smoother start or damping would help"
    )


def chosen_meshes(search: Trials, scene: Scene, allowed: float, auto: Sequence[str]) -> tuple[Scene, float]:
    """The scene with finer meshes of its open solid and plane links where their indicator asks for it, and the error.

    One trial run on the usual meshes: elements are made smaller by what its error is beyond the allowed one.
    """
    names = [name for name in open_meshes(scene) if name not in auto and refinable(scene.links[name])]
    if not names:
        return scene, 0.0
    ready = search.ready(shortened(scene))
    strained = Strained(ready.model)
    base = histories(ready, look=strained.add)
    found = strained.indicators
    eta = link_errors(ready.model, found)
    error = worst(mesh_errors(ready, base, {name: eta[name] for name in names if name in eta}))
    if error <= allowed:
        return scene, error
    factor = min((error / allowed) ** (1 / MESH_ORDER), FACTOR)
    worst_links = [name for name in names if eta.get(name, 0.0) >= 0.3 * max(eta.values())]
    unknowns = sum((link.full or link).unknowns for link in ready.model.links)
    if unknowns * factor**3 > UNKNOWNS:
        search.notes.append(
            f"finer meshes would be needed, and have too many unknowns: their error is about {error:.2g}"
        )
        return scene, error
    finer = with_links(scene, {name: refined(scene.links[name], factor) for name in worst_links})
    return finer, error / factor**MESH_ORDER


def distinct(meshes: list[tuple[float, Scene]]) -> list[tuple[float, Scene]]:
    """Without those that are like the one before: few elements become more by whole numbers only."""
    pairs = zip(meshes, [None, *meshes], strict=False)
    return [now for now, before in pairs if before is None or now[1].links != before[1].links]
