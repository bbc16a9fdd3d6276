"""A scene prepared for its time steps: links, matrices and rigid-body motion, shared between similar scenes.

Plans and reductions are kept between runs under its `key`. Scenes that differ only in damping and in the speed of their
drive share the modes of their links.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import chain
from math import copysign
from typing import Any, TypeVar

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.system.period.map import StateArrays
from kedfem.links.record import Link
from kedfem.motion.initial import initial_twists
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import Path, path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import (
    ConstantSpeed,
    Ramp,
    Scene,
    corotational_links,
    drive_angle,
    geometry_files,
    path_parameter,
    rayleigh,
    revolution_steps,
    time_grid,
)
from kedfem.store import contents

BESIDE = ("title", "fatigue", "output")
"""Tables of a scene on which no plan and no reduced model depends, except for probes of the output."""
INSTANTS = 16  # at which loads and motion are evaluated for the modes

T = TypeVar("T")


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
    """Rigid-body path and elastic model of a scene with all links unreduced; nothing is solved.

    Parameters
    ----------
    known : existing links, by name; the others are meshed
    """
    stage("motion")
    joined, along = moving(scene)
    stage("mesh and matrices")
    return Prepared(scene, joined, along, elastic_model(scene, joined, known, along))


def moving(scene: Scene) -> tuple[Linkage, Path]:
    """The linkage of a scene, with consistent speeds at the start, and its rigid motion over the drive's range."""
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    initial_twists(scene, joined, along)
    return joined, along


def with_models(scene: Scene, of: Scene) -> Scene:
    """A scene with everything from another one of the same `key`, but its own title, fatigue, output and folder."""
    every = {name: getattr(of, name) for name in Scene.model_fields if name not in BESIDE}
    return scene.model_copy(update=every)


def key(scene: Scene) -> str:
    """A digest of all on which a plan or a reduced model of a scene depends, with the contents of its files."""
    described = scene.model_dump(mode="json", exclude={*BESIDE})
    described["probes"] = scene.output.model_dump(mode="json")["probes"]
    digest = sha256(json.dumps(described).encode())
    digest.update(contents(chain.from_iterable(geometry_files(scene).values())))
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Data of similar scenes that a run reuses.

    ends : assembled scenes with which reduced links are shared (`accuracy.reduction.prepared`)
    near : the state at the beginning of the steady motion of one of them, from which the search starts
    """

    ends: Sequence[Scene] = ()
    near: StateArrays | None = None


ALONE = Neighbours()
_LAST: dict[str, Any] = {}
"""The reduction that scenes of this process share, by its key; at most one."""


def alike(scene: Scene) -> str | None:
    """The digest of scenes that can share reduced links; None for a scene that can share them with no other.

    It covers everything except for the damping and the speed of a drive with constant or ramped speed. Scenes with
    co-rotational frames cannot share, because their rigid links depend on the step.
    """
    if scene.drive is None or not any(link.reduced for link in scene.links.values()):
        return None
    if corotational_links(scene) or not isinstance(scene.drive.motion, ConstantSpeed | Ramp):
        return None
    motion = scene.drive.motion.model_copy(update={"speed": copysign(1.0, scene.drive.motion.speed)})
    drive = scene.drive.model_copy(update={"motion": motion})
    return key(scene.model_copy(update={"drive": drive, "damping": None}))


def shared_reduction(name: str, made: Callable[[], T]) -> T:
    """The reduction of this process under a key; only the last one is kept."""
    if name not in _LAST:
        _LAST.clear()
        _LAST[name] = made()
    found: T = _LAST[name]
    return found


def damped_as(scene: Scene, model: Model) -> Model:
    """A model with the damping of a scene."""
    return replace(model, damping=Rayleigh(*rayleigh(scene.damping)))


def training_motion(full: Prepared) -> RigidMotion:
    """Rigid-body motion at the instants from which modes are computed: over the whole time, denser at the end."""
    scene, grid = full.scene, time_grid(full.scene)
    per_turn = revolution_steps(scene)
    half = INSTANTS // 2
    t = grid.end * (np.arange(half) + 0.5) / half
    if per_turn is not None:
        turn = min(per_turn * grid.step, grid.end)
        t = np.concatenate([t, grid.end - turn * np.arange(INSTANTS - half) / (INSTANTS - half)])
    released = [0.0] if scene.analysis.initial_deflection else []
    t = np.unique(np.concatenate([released, t, _loaded(full, grid.step * np.arange(grid.steps + 1))]))
    return rigid_motion(full.linkage, full.path, t, path_parameter(scene, t))


def _loaded(full: Prepared, t: Float[np.ndarray, " T"]) -> Float[np.ndarray, " l"]:
    """The time at which each load is greatest, so that short loads are not missed."""
    phi = drive_angle(full.scene.motion, t)[0]
    factors = [np.abs(load.factor(t, phi)) for loads in full.model.loads for load in loads]
    return np.array([t[f.argmax()] for f in factors if np.ptp(f) > 0.0])
