"""Changed copies of a scene: other models, sizes, modes, steps."""

import math
from collections.abc import Mapping
from typing import Any, Literal

from kedfem.errors import MotionError
from kedfem.scene import (
    Bar,
    Cad,
    Extrusion,
    LinkScene,
    MeshFile,
    Part,
    PlateLink,
    Ramp,
    Scene,
    revolution_steps,
    time_grid,
)

TRIAL_STEPS = 20_000  # most steps of a trial run; only the beginning of a longer analysis is run
TURNS = 2  # revolutions of a trial run
Family = Literal["solid", "plane", "beam", "rigid"]
CHOSEN = {"element", "mesh", "model", "reduction"}


def with_links(scene: Scene, links: Mapping[str, LinkScene]) -> Scene:
    """The scene with some links replaced."""
    return scene.model_copy(update={"links": {**scene.links, **links}})


def with_analysis(scene: Scene, **keys: Any) -> Scene:
    """The scene with some keys of its analysis replaced."""
    return scene.model_copy(update={"analysis": scene.analysis.model_copy(update=keys)})


def moved(scene: Scene) -> Scene:
    """The scene as a transient analysis, in which the drive moves its links over time.

    Raises
    ------
    MotionError
        The scene has no drive.
    """
    if scene.driven is None:
        raise MotionError(
            "drive: is required for kinematics, got none: without one the linkage rests in the reference position "
            "(kedfem run moves it by its forces)"
        )
    if scene.analysis.kind != "static":
        return scene
    grid = time_grid(scene)
    return with_analysis(scene, kind="transient", end_time=grid.end, step=grid.step,
                         revolutions=None, steps_per_revolution=None)  # fmt: skip


def with_steps(scene: Scene, steps: int) -> Scene:
    """The scene with a number of equal steps over the same time."""
    return with_analysis(scene, step=time_grid(scene).end / steps, steps_per_revolution=None)


def shortened(scene: Scene) -> Scene:
    """The beginning of an analysis that is too long for trials: TURNS revolutions of a drive, after its run-up."""
    grid, turn = time_grid(scene), revolution_steps(scene)
    span = grid.end
    if turn is not None:
        rises = scene.motion.time if isinstance(scene.motion, Ramp) else 0.0
        span = min(span, rises + TURNS * turn * grid.step)
    span = min(span, TRIAL_STEPS * grid.step)
    if span >= grid.end * (1 - 1e-9):
        return scene
    return with_analysis(scene, end_time=span, revolutions=None, step=grid.step, steps_per_revolution=None)


def of_family(link: LinkScene, family: Family, reduced: bool = False) -> LinkScene:
    """The link as a model of another family, with the default element and mesh of that family."""
    gone = CHOSEN if family in {"plane", "solid"} else CHOSEN | {"segments"}
    given = {key: getattr(link, key) for key in link.model_fields_set - gone}
    reduction = "modal" if reduced and family != "rigid" else "none"
    other = LinkScene.model_validate({**given, "model": family, "reduction": reduction})
    return other if link.mesh.fillet_angle is None else filleted(other, link.mesh.fillet_angle)


def filleted(link: LinkScene, angle: float) -> LinkScene:
    """The link with an angle of elements along fillets [rad]; a mesh that it leaves open stays open."""
    changed = link.model_copy(update={"mesh": link.mesh.model_copy(update={"fillet_angle": angle})})
    if "mesh" not in link.model_fields_set:
        changed.model_fields_set.discard("mesh")
    return changed


def families(link: LinkScene) -> tuple[Family, ...]:
    """The families that a link's shape allows, cheapest first; none for a slider without a shape."""
    match link.shape:
        case None:
            return ()
        case Bar():
            return ("rigid", "beam", "plane", "solid")
        case PlateLink() | Extrusion() | Part():
            return ("rigid", "plane", "solid")
        case MeshFile() | Cad():
            return ("rigid", "solid")
        case _:
            return ("rigid", "beam")


def refined(link: LinkScene, factor: float) -> LinkScene:
    """The link with elements smaller by a factor, never fewer; rigid links and meshes from files are unchanged."""
    mesh = link.mesh
    if link.model == "rigid" or isinstance(link.shape, MeshFile | None):
        return link
    if mesh.elements is not None:
        several = mesh.elements if isinstance(mesh.elements, tuple) else (mesh.elements,)
        finer = tuple(_more(count, factor) for count in several)
        changed: dict[str, Any] = {"elements": finer if isinstance(mesh.elements, tuple) else finer[0]}
    else:
        changed = {"layers": _more(mesh.layers, factor)} if link.family == "solid" else {}
        if mesh.size is not None:
            changed["size"] = mesh.size / factor
        elif mesh.unknowns is not None:
            changed["unknowns"] = _more(mesh.unknowns, factor ** (2 if link.family == "plane" else 3))
        else:
            changed["elements_across"] = _more(mesh.elements_across or 2, factor)
    return link.model_copy(update={"mesh": mesh.model_copy(update=changed)})


def refinable(link: LinkScene) -> bool:
    """Whether a link's mesh can be made finer."""
    return refined(link, 2.0) != link


def _more(count: int, factor: float) -> int:
    return max(1, math.ceil(count * factor - 1e-9))
