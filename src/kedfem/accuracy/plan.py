"""The cheapest model of a scene with a required accuracy: `analysis.accuracy`.

Everything is chosen by short trial runs of the scene itself with reduced links: frames from the bending of links, beams
by comparison with fine ones, the step from the differences between levels in time, meshes of solid and plane links from
their indicator, segments of links with co-rotational frames and simpler models of links by comparison. What the scene
states is kept; what it leaves open is chosen.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from kedfem.accuracy.choices import (
    beams_only,
    chosen_beams,
    chosen_frames,
    chosen_step,
    frames_allowed,
    open_beams,
    open_frames,
    open_step,
    with_beams,
)
from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.meshes import (
    chosen_meshes,
    open_meshes,
    open_modes,
    open_segments,
    with_fillets,
    with_mesh,
    with_modes,
    with_segments,
    with_simpler_links,
)
from kedfem.accuracy.prepared import Prepared, key, with_models
from kedfem.accuracy.reduction import Reduction, prepared
from kedfem.accuracy.trials import Stage, Trials
from kedfem.accuracy.variants import families, of_family, with_analysis, with_links
from kedfem.links.record import Link
from kedfem.scene import LinkScene, Scene, percentage, refuse_unsupported
from kedfem.store import itself, kept

STEP, MESH, MODEL, REDUCTION = 0.3, 0.4, 0.2, 0.1  # shares of the required accuracy
SEGMENTS = 0.2  # part of the mesh's share for segments, if links leave their number open
VAIN = 0.1  # error of the step above which finer meshes are useless
ROUGH = "beam5", 2  # elements of beams in the first search for the step of a motion without a drive


@dataclass(frozen=True, slots=True)
class Share:
    """One part of the error: its source, its size in the worst channel [-], and the size allowed [-]."""

    what: str
    error: float
    allowed: float


@dataclass(frozen=True, slots=True)
class Plan:
    """The choices for a scene with `analysis.accuracy`, with their reasons.

    scene : the scene with everything chosen
    asked : the required accuracy [-]
    finer : factor by which elements are smaller than those of default meshes
    shares : parts of the error; that of the reduction is the allowed one
    notes : trials, omissions, and limits of the accuracy
    links : links of the trials that the scene has too; not kept between runs
    """

    scene: Scene
    asked: float
    finer: float
    shares: tuple[Share, ...]
    notes: tuple[str, ...]
    links: Mapping[str, Link] = field(default_factory=dict, compare=False, repr=False)

    @property
    def error(self) -> float:
        """Estimated error of the run, the sum of all shares."""
        return sum(share.error for share in self.shares)

    @property
    def reached(self) -> bool:
        """Whether the estimate is within the required accuracy."""
        return self.error <= self.asked


def plan_for(scene: Scene, stage: Stage = lambda name: None) -> Plan | None:
    """The plan of a scene that leaves something open; None if it does not, or if accuracy = "quick".

    For solid and plane links that move freely only the step and the fineness of fillets are chosen: they cannot be
    reduced, and each trial costs as much as a run. A steady motion has the plan of the transient motion over its period.

    Raises
    ------
    MotionError, MeshError, SceneError, SolveError
        The scene cannot be run even as it is.
    """
    if scene.analysis.accuracy == "quick" or not anything_open(scene):
        return None
    if scene.analysis.kind == "steady":
        plan = plan_for(with_analysis(scene, kind="transient"), stage)
        return plan and replace(plan, scene=with_analysis(plan.scene, kind="steady"))
    finer = with_fillets(scene, scene.analysis.accuracy)
    if not scene.driven_joints and not beams_only(scene) and not open_step(scene):
        if finer is scene:
            return None
        return Plan(with_analysis(finer, accuracy="quick"), scene.analysis.accuracy, 1.0, (), ())
    return planned(finer, stage)


def ready_to_step(
    scene: Scene, stage: Stage = lambda name: None, ends: Sequence[Scene] = ()
) -> tuple[Plan | None, Prepared, Reduction | None]:
    """A scene prepared for a run: its plan, its model, and its reduction (`accuracy.reduction.prepared`).

    Raises
    ------
    KedfemError
        As `plan_for` and `prepared`; at once if nothing constrains links that are to be in static balance.
    """
    refuse_unsupported(scene)
    plan = plan_for(scene, stage)
    ready, reduction = prepared(plan.scene if plan else scene, stage, ends, plan.links if plan else None)
    return plan, ready, reduction


def anything_open(scene: Scene) -> bool:
    """Whether a scene leaves anything open that an accuracy chooses."""
    auto = any(link.model == "auto" for link in scene.links.values())
    return auto or any(f(scene) for f in (open_frames, open_beams, open_meshes, open_step, open_segments))


def planned(scene: Scene, stage: Stage = lambda name: None) -> Plan:
    """Choose models, mesh sizes, modes, frames and step of a scene with `analysis.accuracy`."""
    asked = scene.analysis.accuracy
    if asked == "quick":
        raise ValueError("the scene asks for no accuracy")
    search = Trials(asked, stage)

    def made() -> Plan:
        plan = found_plan(search, scene)
        return replace(plan, links=search.links_of(plan.scene))

    plan: Plan = kept("plan", key(scene), made, lambda plan: replace(plan, links={}), itself)
    return replace(plan, scene=with_models(scene, plan.scene))  # a kept plan may have other outputs


def found_plan(search: Trials, scene: Scene) -> Plan:
    """The plan of a scene by trial runs; no kept plan is used."""
    asked, stage = search.asked, search.stage
    if not scene.driven_joints and not beams_only(scene):
        return _step_alone(search, scene)
    left_open = [name for name, link in scene.links.items() if link.model == "auto"]
    unreduced = open_modes(scene)
    scene = _opened(scene, left_open)
    shares: list[Share] = []
    stage("plan: frames")
    scene, frames = chosen_frames(search, scene)
    if frames:
        shares.append(Share("frames", frames, frames_allowed(search, scene)))
    if not (left_open or open_beams(scene) or open_meshes(scene)):
        search.notes.append("the scene states all meshes; the run reports their error")
        if not open_step(scene) and not open_segments(scene):
            scene = with_analysis(scene, accuracy="quick")
            return Plan(scene, asked, 1.0, tuple(shares), tuple(search.notes))
    stage("plan: beams")
    free, analysis = open_step(scene) and not scene.driven_joints, scene.analysis
    if free and open_beams(scene):  # beams are compared in a step chosen for a rough model
        coarse = with_beams(scene, open_beams(scene), ROUGH)
        rough, _ = chosen_step(Trials(asked, stage), coarse, MESH / 2 * asked)
        scene = with_analysis(scene, step=rough.analysis.step)
    scene, beams = chosen_beams(search, scene, MESH / 2 * asked)
    scene = scene.model_copy(update={"analysis": analysis}) if free else scene
    stage("plan: step")
    scene, step = chosen_step(search, scene, STEP * asked)
    stage("plan: mesh")
    cut = SEGMENTS if open_segments(scene) else 0.0  # of the mesh's share
    loose = max(asked, step / STEP)
    scene, mesh, finer = with_mesh(search, scene, left_open, (MESH - cut) * loose)
    scene, meshes = chosen_meshes(search, scene, MESH * (asked if step < VAIN else loose), left_open)
    segments = 0.0
    if cut:
        stage("plan: segments")
        scene, segments = with_segments(search, scene, SEGMENTS * loose)
    stage("plan: simpler links")
    scene, model = with_simpler_links(search, scene, left_open, (MESH - cut + MODEL) * asked - mesh)
    scene = with_modes(search, scene, unreduced)
    if "reduction_tolerance" not in scene.analysis.model_fields_set:
        scene = with_analysis(scene, reduction_tolerance=REDUCTION * asked)
    scene = with_analysis(scene, accuracy="quick")
    reduced = any(link.reduced for link in scene.links.values())
    mesh += beams + meshes
    shares += [
        Share("time step", step, STEP * asked), Share("mesh", mesh, (MESH - cut) * asked),
        *([Share("segments", segments, SEGMENTS * asked)] if cut else []),
        Share("simpler links", model, max(MODEL, MESH - cut + MODEL - mesh / asked) * asked),
        Share("reduction", scene.analysis.reduction_tolerance if reduced else 0.0, REDUCTION * asked),
    ]  # fmt: skip
    plan = Plan(scene, asked, finer, tuple(shares), ())
    return replace(plan, notes=(*search.notes, *_limits(plan)))


def _step_alone(search: Trials, scene: Scene) -> Plan:
    """The plan of solid and plane links that move freely: only the step is chosen."""
    search.stage("plan: step")
    chosen, step = chosen_step(search, scene, STEP * search.asked)
    share = Share("time step", step, STEP * search.asked)
    plan = Plan(with_analysis(chosen, accuracy="quick"), search.asked, 1.0, (share,), ())
    return replace(plan, notes=(*search.notes, *_limits(plan)))


def _limits(plan: Plan) -> Iterator[str]:
    if not plan.reached:
        limit = max(plan.shares, key=lambda share: share.error)
        yield (
            f"the accuracy of {percentage(plan.asked, 3)} could not be reached: {limit.what} limits it, "
            f"{percent(plan.error) if plan.error > 2 * plan.asked else percentage(plan.error, 3)} is expected"
        )


def _opened(scene: Scene, left_open: list[str]) -> Scene:
    """The scene whose links of open model have the most detailed model of their shape, reduced."""
    named = {name: scene.links[name] for name in left_open}
    best = {name: _remeshed(link, of_family(link, families(link)[-1], True)) for name, link in named.items()}
    return with_links(scene, best)


def _remeshed(link: LinkScene, other: LinkScene) -> LinkScene:
    """Another model of a link, with the mesh that the link states, if any."""
    stated = link.model_fields_set & {"mesh", "element"}
    return other.model_copy(update={key: getattr(link, key) for key in stated})
