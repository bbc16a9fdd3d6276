"""A scene with everything that does not need a time step, and the key that what was found for it is kept under."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from hashlib import sha256

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.links.record import Link
from kedfem.motion.initial import initial_twists
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import Path, path
from kedfem.scene import Cad, MeshFile, Part, Scene
from kedfem.store import contents


@dataclass(frozen=True, slots=True)
class Prepared:
    """A scene, its rigid motion over the drive's range, and its elastic model."""

    scene: Scene
    linkage: Linkage
    path: Path
    model: Model


def meshed(
    scene: Scene, stage: Callable[[str], None] = lambda name: None, known: Mapping[str, Link] | None = None
) -> Prepared:
    """Rigid path and elastic model of a scene with all its links unreduced; nothing is solved.

    Parameters
    ----------
    known : links that are made already, by name; the others are meshed

    Raises
    ------
    MotionError, MeshError, SceneError
    """
    stage("motion")
    joined, along = moving(scene)
    stage("mesh and matrices")
    return Prepared(scene, joined, along, elastic_model(scene, joined, known, along))


def moving(scene: Scene) -> tuple[Linkage, Path]:
    """The linkage of a scene, and its rigid motion over the drive's range; the speeds at the start are possible.

    Raises
    ------
    MotionError
    """
    joined = linkage(scene)
    initial_twists(scene, joined)
    return joined, path(joined, *drive_range(scene))


def key(scene: Scene) -> str:
    """A digest of everything in a scene that a plan or a reduced model depends on, the contents of its files too."""
    described = scene.model_dump(mode="json", exclude={"title", "fatigue"})
    described["output"] = described["output"]["probes"]
    digest = sha256(json.dumps(described).encode())
    shapes = (link.shape for link in scene.links.values())
    digest.update(contents(scene.folder / x.file for x in shapes if isinstance(x, Cad | MeshFile | Part)))
    return digest.hexdigest()
