"""Meshes for natural frequencies, judged by comparison with a finer mesh."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol, TypeVar

import numpy as np

from kedfem.accuracy.choices import elastic
from kedfem.accuracy.error_budget import UNKNOWNS, percent
from kedfem.accuracy.prepared import moving
from kedfem.accuracy.variants import families, of_family, refinable, refined, with_links
from kedfem.arrays import Float
from kedfem.dynamics.modes.frozen import Frozen
from kedfem.dynamics.modes.stiffened import Stiffened, frozen_linkage
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.record import System
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import MeshFile, Scene, path_parameter

FACTOR, LITTLE = 1.5, 1.2  # factor by which elements become smaller: the usual and the least one
ORDER = 2.0  # of convergence of a frequency with linear elements, the lowest
LEFT = 1 / (FACTOR**ORDER - 1)  # error that smaller elements leave, over the change that they cause
STALLED = 0.8  # least reduction of the error by finer open links; otherwise other links cause it
USUAL = 0.01  # allowed error of parts, and of scenes with accuracy = "quick"
FEW = 6  # modes that a warning lists


class Solved(Protocol):
    """A solved model: its lowest frequencies (f,) [Hz], and its number of unknowns."""

    @property
    def frequencies(self) -> Float[np.ndarray, " f"]: ...  # noqa: D102

    @property
    def unknowns(self) -> int: ...  # noqa: D102


T = TypeVar("T", bound=Solved)
Finer = Callable[[T, float], T]
Release = Callable[[Scene], Scene]


def resolved(made: T, finer: Finer[T], chosen: Finer[T] | None, allowed: float) -> tuple[T, Float[np.ndarray, " f"]]:
    """The model, with smaller elements where these are left open, until the error of the frequencies is allowed.

    Two meshes show the error of the coarser one, since frequencies converge at least with ORDER (Strang and Fix, An
    Analysis of the Finite Element Method, 6.3), though more slowly at re-entrant edges. Elements become smaller up to
    UNKNOWNS.

    Parameters
    ----------
    finer : function that makes all elements of the model smaller by a factor
    chosen : the same for those that are left open; None if none is
    allowed : relative error of frequencies [-]

    Returns
    -------
    The model, and (f,) estimated relative errors; NaN where they are unknown.
    """
    before, errors = np.inf, np.full(len(made.frequencies), np.nan)
    while (UNKNOWNS / made.unknowns) ** (1 / 3) >= LITTLE:
        better = finer(made, FACTOR)
        both = min(len(made.frequencies), len(better.frequencies))
        change = np.abs(made.frequencies[:both] / better.frequencies[:both] - 1)
        lacking = len(made.frequencies) < len(better.frequencies)
        worst = np.inf if lacking else (1 + LEFT) * change.max(initial=0.0)
        if worst <= allowed or chosen is None or worst > STALLED * before < np.inf:
            return made, (1 + LEFT) * change
        made, before = better if chosen is finer else chosen(made, FACTOR), worst
        known = chosen is finer and not lacking
        errors = LEFT * change if known else np.full(len(made.frequencies), np.nan)
        if known and errors.max(initial=0.0) <= allowed:
            break
    return made, errors


def unsimplified(scene: Scene) -> Scene:
    """The scene whose links of open model have the most detailed one that their shape allows.

    A rigid or plane model that suffices for a motion lacks vibrations.
    """
    auto = {name: link for name, link in scene.links.items() if link.model == "auto"}
    return with_links(scene, {name: of_family(link, families(link)[-1]) for name, link in auto.items()})


@dataclass(frozen=True, slots=True)
class FrozenLinkage:
    """A scene's linkage and system, the solver of its modes, and its motion and frequencies at a position [Hz]."""

    scene: Scene
    linkage: Linkage
    along: Path
    system: System
    solver: Frozen | Stiffened
    motion: RigidMotion
    frequencies: Float[np.ndarray, " f"]

    @property
    def unknowns(self) -> int:
        """Unknowns of all links, those shared at joints counted for each."""
        return int(self.system.model.unknowns)


def frozen(
    scene: Scene, modes: int, at: float, release: Release | None = None
) -> tuple[FrozenLinkage, Float[np.ndarray, " f"], tuple[str, ...]]:
    """A scene's unreduced linkage; meshes that are left open resolve its lowest vibrations.

    Parameters
    ----------
    modes : number of modes
    at : time of the position at which errors are estimated [s]
    release : function that frees the driven joints of a scene; None if drives hold them

    Returns
    -------
    The linkage; (f,) estimated relative errors, NaN where they are unknown, none if no mesh can be finer; warnings.
    """
    scene, allowed = unsimplified(scene), allowed_error(scene)
    names = [name for name, link in scene.links.items() if elastic(link, "solid", "plane", "beam") and refinable(link)]
    quick = scene.analysis.accuracy == "quick"
    left_open = [name for name in names if not quick and "mesh" not in scene.links[name].model_fields_set]

    def finer(made: FrozenLinkage, factor: float, names: Sequence[str] = names) -> FrozenLinkage:
        links = {name: refined(made.scene.links[name], factor) for name in names}
        return _frozen(with_links(made.scene, links), modes, at, release)

    made, errors = _frozen(scene, modes, at, release), np.zeros(0)
    if names:
        chosen = finer if left_open == names else partial(finer, names=left_open)
        made, errors = resolved(made, finer, chosen if left_open else None, allowed)
    return made, errors, (*mesh_warning(errors, allowed, remedy(scene)), *file_warning(scene))


def _frozen(scene: Scene, modes: int, at: float, release: Release | None) -> FrozenLinkage:
    linkage, along = moving(scene)
    system = system_of(release(scene) if release else scene, linkage, along)
    solver = frozen_linkage(scene, system, linkage, along, modes, release is not None)
    t = np.array([at])
    motion = rigid_motion(linkage, along, t, path_parameter(scene, t))
    return FrozenLinkage(scene, linkage, along, system, solver, motion, solver.at(motion).frequencies)


def allowed_error(scene: Scene) -> float:
    """The error of frequencies that the scene's accuracy allows [-]."""
    return USUAL if scene.analysis.accuracy == "quick" else float(scene.analysis.accuracy)


def remedy(scene: Scene) -> str:
    """Advice for more exact frequencies of a scene."""
    stated = any("mesh" in link.model_fields_set for link in scene.links.values())
    if scene.analysis.accuracy == "quick" and not stated:
        return 'leave analysis.accuracy = "quick" out'
    return "leave links.NAME.mesh out, or make it finer"


def mesh_warning(errors: Float[np.ndarray, " f"], allowed: float, remedy: str) -> tuple[str, ...]:
    """A warning if the meshes do not resolve frequencies, or if the error is unknown."""
    if np.isnan(errors).any():
        why = f"models of more than {UNKNOWNS:,} unknowns are not refined to estimate it"
        return (f"frequencies: their error by the mesh is not known, as {why}: compare with another mesh",)
    beyond = np.flatnonzero(errors > allowed)
    if not len(beyond):
        return ()
    least, most = percent(errors[beyond].min()), percent(errors.max())
    listed = [str(k + 1) for k in beyond]
    modes = ", ".join(listed) if len(listed) <= FEW else f"{listed[0]} to {listed[-1]}"
    return (
        f"frequencies: meshes must be fine enough for {percent(allowed)}, got estimated errors of {least} to {most} "
        f"(modes {modes}): {remedy}, or ask for fewer --modes",
    )


def error_words(errors: Float[np.ndarray, " f"]) -> str:
    """The errors for a table, in words; empty if they are unknown."""
    known = errors.size and not np.isnan(errors).any()
    return f"error by the mesh, estimated: {percent(errors.max())} at most" if known else ""


def file_warning(scene: Scene) -> tuple[str, ...]:
    """A warning if links have meshes from files, which cannot be refined."""
    names = [name for name, link in scene.links.items() if link.model != "rigid" and isinstance(link.shape, MeshFile)]
    return (f"frequencies: errors by the meshes from files are not known: links {', '.join(names)}",) if names else ()
