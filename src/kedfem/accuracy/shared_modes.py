"""Scenes that differ in the speed of their drive and in damping alone, and whose links have the same modes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from kedfem.accuracy.prepared import Prepared, key, moving
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.system.period.map import Carried
from kedfem.scene import ConstantSpeed, Ramp, Scene, corotational_links, rayleigh

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Neighbours:
    """What a run takes over from runs of scenes that differ little.

    ends : assembled scenes with which reduced links are shared (`accuracy.reduction.prepared`)
    near : the state with which the steady motion of one of them begins, to look for this one's from there
    """

    ends: Sequence[Scene] = ()
    near: Carried | None = None


ALONE = Neighbours()
_LAST: dict[str, Any] = {}
"""The last reduction that scenes of this process share."""


def alike(scene: Scene) -> str | None:
    """What scenes have in common whose reduced links may be the same; None of one that shares them with none.

    It is all but the damping and the speed of a drive that turns steadily, or comes to. Rigid links with co-rotational
    frames depend on the step.
    """
    if scene.drive is None or not any(link.reduced for link in scene.links.values()):
        return None
    if corotational_links(scene) or not isinstance(scene.drive.motion, ConstantSpeed | Ramp):
        return None
    motion = scene.drive.motion.model_copy(update={"speed": 1.0})
    drive = scene.drive.model_copy(update={"motion": motion})
    return key(scene.model_copy(update={"drive": drive, "damping": None}))


def last_of(name: str, made: Callable[[], T]) -> T:
    """What this process has under a name, the last one alone."""
    if name not in _LAST:
        _LAST.clear()
        _LAST[name] = made()
    found: T = _LAST[name]
    return found


def as_alike(scene: Scene, model: Model) -> Prepared:
    """A scene prepared with the model of another that is `alike`."""
    return Prepared(scene, *moving(scene), damped_as(scene, model))


def damped_as(scene: Scene, model: Model) -> Model:
    """A model with the damping of a scene."""
    return replace(model, damping=Rayleigh(*rayleigh(scene.damping)))
