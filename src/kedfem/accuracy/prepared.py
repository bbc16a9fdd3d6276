"""A scene with everything that does not need a time step."""

from collections.abc import Callable
from dataclasses import dataclass

from kedfem.dynamics.model import Model, elastic_model
from kedfem.dynamics.nominal import drive_range
from kedfem.motion.initial import initial_twists
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import Path, path
from kedfem.scene import Scene


@dataclass(frozen=True, slots=True)
class Prepared:
    """A scene, its rigid motion over the drive's range, and its elastic model."""

    scene: Scene
    linkage: Linkage
    path: Path
    model: Model


def meshed(scene: Scene, stage: Callable[[str], None] = lambda name: None) -> Prepared:
    """Rigid path and elastic model of a scene with all its links unreduced; nothing is solved.

    Raises
    ------
    MotionError, MeshError, SceneError
    """
    stage("motion")
    joined, along = moving(scene)
    stage("mesh and matrices")
    return Prepared(scene, joined, along, elastic_model(scene, joined, along=along))


def moving(scene: Scene) -> tuple[Linkage, Path]:
    """The linkage of a scene, and its rigid motion over the drive's range; the speeds at the start are possible.

    Raises
    ------
    MotionError
    """
    joined = linkage(scene)
    initial_twists(scene, joined)
    return joined, path(joined, *drive_range(scene))
