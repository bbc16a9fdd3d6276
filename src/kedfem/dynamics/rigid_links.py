"""Rigid links of a model: reduced to {1, x, y, z}, and so stiff that their deformation is negligible."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.scheme import stable_rotation
from kedfem.dynamics.stepping.step_limit import StepLimit
from kedfem.errors import Fault, SceneError
from kedfem.links.bodies import with_body, with_mass
from kedfem.links.record import Link
from kedfem.links.reduced import RIGID, overall_length, rigid, rigid_body_functions, wave_frequency
from kedfem.links.surfaces.coupling_surfaces import rigid_link_surface
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import (
    AngleLimit,
    Scene,
    TorsionSpring,
    driven_travel,
    path_parameter,
    pieces,
    time_grid,
    without_vibration,
)

LIGHT = 1e-3  # second moment of a planar beam's mass beside inertia of its sections, below which this is spread over it
COMPACT = 1e-7  # of mass times length²: second moments, below which forces would be off by more than 1e-4
LAMINA = 1e-8  # of second moments of mass: a sheet of a millimetre by a metre has 1e-6
INSTANTS = 400  # at which rotations are looked up: a tenth of what the smallest models take to make
MOUNTED = 3e3  # times the frequency on the mounts: a link's own strain is 1e-7 of deflections, rounding up to 4e-7


def made_rigid(
    scene: Scene, links: Mapping[str, Link], linkage: Linkage, along: Path | None, thicken: bool = False
) -> tuple[dict[str, Link], dict[str, StepLimit]]:
    """Links, of which the rigid ones are made far stiffer than the elastic ones, whatever their material.

    Also the step limits of those whose stiffness a step bounds.

    Without elastic links they are stiff in comparison with their mounts: on soft mounts rounding would leave few digits.

    Parameters
    ----------
    along : the linkage's path over the drive's range; without it links with co-rotational frames may turn far in a step
    thicken : whether a mass that lies in a plane gets next to no thickness, which bars between points need no more of
    """
    made = {key for key, link in links.items() if scene.links[link.name].model == "rigid"}
    elastic = [link for key, link in links.items() if key not in made]
    out, limits, soft = dict(links), {}, _mounts(scene)
    limited = [key for key in made if links[key].fit is not None or links[key].anywhere]
    in_steps = bool(limited) and not without_vibration(scene)
    turning = _angular_speeds(scene, linkage, along) if in_steps else {}
    for key in made:
        link = _spread(_thickened(links[key]) if thicken else links[key])
        _with_extent(link)
        highest = RIGID * max(map(wave_frequency, elastic or [links[key]]))
        if not elastic and any(soft):
            highest = min(highest, MOUNTED * _mounted(link, *soft))
        if key in limited:
            if in_steps:
                stable, h = stable_rotation(scene.analysis.rho_inf, stiff=True), time_grid(scene).step
                turns = 0.0 if link.fit is None else turning.get(link.name, np.inf)
                limits[key] = StepLimit(highest, turns, stable, h, h)
                highest = limits[key].frequency
            else:
                highest = min(highest, _beside(link, elastic))
        out[key] = rigid(link, highest)
    return out, limits


def for_steps(model: Model, h: float, longest: float | None = None) -> Model:
    """The model with its rigid links as stiff as steps of h allow; `longest` as in `StepLimit`."""
    links, limits = list(model.links), list(model.step_limits)
    for k, limit in enumerate(limits):
        if limit is not None:
            limits[k] = now = limit.in_steps(h, longest)
            if now.frequency != limit.frequency:
                links[k] = replace(links[k], K0=links[k].K0 * (now.frequency / limit.frequency) ** 2)
    if all(link is old for link, old in zip(links, model.links, strict=True)):
        return model
    return replace(model, links=tuple(links), step_limits=tuple(limits))


def _angular_speeds(scene: Scene, linkage: Linkage, along: Path | None) -> dict[str, float]:
    """Largest angular speeds of links that drives move [rad/s]."""
    if along is None or linkage.drive is None:
        return {}
    t = np.linspace(0.0, time_grid(scene).end, INSTANTS)
    motion = rigid_motion(linkage, along, t, path_parameter(scene, t))
    omega = np.linalg.norm(motion.omega, axis=2).max(axis=0)
    moved = np.linalg.norm(motion.v, axis=2).max(axis=0) + omega > 0.0
    return {name: float(w) for name, w, each in zip(linkage.bodies, omega, moved, strict=True) if each}


def _beside(link: Link, elastic: Sequence[Link]) -> float:
    """The frequency at which a link is RIGID² times as stiff as elastic ones, however heavy it is beside them [rad/s].

    A heavy one at RIGID times their frequency would be stiffer by its mass: rounding of its strain would move it on soft
    mounts.
    """
    if not elastic:
        return np.inf
    stiffest = max(wave_frequency(each) ** 2 * float(each.one @ each.m1[:, 0]) for each in elastic)
    lightest = min(float(link.one @ link.m1[:, 0]), float(_second_moments(link)[0]) / overall_length(link) ** 2)
    return float(RIGID * np.sqrt(stiffest / lightest))


def _thickened(link: Link) -> Link:
    """A link whose mass lies in a plane, with 2e-8 of its largest second moment added along all directions."""
    second = _second_moments(link)
    if second[0] >= 2 * LAMINA * second[-1] or link.d < 3 or link.kind == "beam":
        return link
    centre = link.centre
    return with_body(link, rigid_link_surface(link, centre), 0.0, centre, 2 * LAMINA * second[-1] * np.eye(3))


def _spread(link: Link) -> Link:
    """A planar beam that is light beside a body on it, with part of the body's inertia spread over its line.

    The stiffness of its modes is in proportion to their mass: with very little mass it would deform.
    """
    if link.kind != "beam":
        return link
    turning = float(link.one @ (link.mass[2] @ link.one))
    if _second_moments(link).sum() > LIGHT * turning:
        return link
    Y = np.linalg.pinv(rigid_body_functions(link))[1:]  # nothing on what moves as a whole
    share = min(turning / 2, float(link.one @ link.m1[:, 0]) * overall_length(link) ** 2 / 12)
    xy = sp.csr_array(link.mass[0] + share / len(Y) * (Y.T @ Y))
    return with_mass(link, (xy, xy, sp.csr_array(link.mass[2] * (1 - share / turning))))


def _second_moments(link: Link) -> Float[np.ndarray, " e"]:
    """Of its mass about the centre, the least first [kg m²]."""
    F = rigid_body_functions(link)
    A = F.T @ np.asarray(link.mass[0] @ F)
    return np.asarray(np.linalg.eigvalsh(A[1:, 1:] - np.outer(A[0, 1:], A[0, 1:]) / A[0, 0]))


def _with_extent(link: Link) -> None:
    """Refuse a rigid link whose mass has no extent along one of its directions, or nearly none at all.

    Its functions in that direction would be undetermined; and as its stiffness is in proportion to its mass, it would
    deform.

    Raises
    ------
    SceneError
        If the least second moment of its mass about the centre is nothing beside the largest, or the largest beside its
        length.
    """
    second = _second_moments(link)
    if second[-1] < COMPACT * float(link.m1[:, 0] @ link.one) * overall_length(link) ** 2:
        wanted = (
            "a rigid link must have mass in more than one place, got nearly all of it in one (a point mass on a link of "
            "next to no mass): give the link a denser material, or the body some inertia"
        )
        raise SceneError([Fault(("links", link.name), wanted)])
    if second[0] < LAMINA * second[-1]:
        wanted = (
            "a rigid link must have mass along all its directions, got one whose mass lies in a plane (such as a body "
            "with Ixx + Iyy = Izz on a link of next to no mass): give the body some thickness"
        )
        raise SceneError([Fault(("links", link.name), wanted)])


def _mounts(scene: Scene) -> tuple[float, float]:
    """The largest stiffness of anything soft beside links [N/m], and about an axis [N m/rad]; zero without any."""
    along, about = [0.0], [0.0]
    for joint in scene.joints.values():
        if joint.bushing is not None:
            along += joint.bushing.stiffness or ()
            about += joint.bushing.rotational_stiffness or ()
    for spring in scene.springs.values():
        stiffness = max(spring.stiffness_factor.value) * spring.stiffness
        if spring.curve is not None and spring.curve.over not in {"time", "speed"}:
            stiffness += pieces(spring.curve).steepest
        (about if isinstance(spring, TorsionSpring) else along).append(stiffness)
    for limit in scene.limits.values():
        (about if isinstance(limit, AngleLimit) else along).append(limit.stiffness)
    for name, drive in scene.all_drives.items():
        slides = driven_travel(scene, name)
        (along if slides else about).append(drive.shaft_stiffness or 0.0)
    return max(along), max(about)


def _mounted(link: Link, along: float, about: float) -> float:
    """The highest frequency at which a link would swing alone on one of such mounts [rad/s]."""
    mass, second = float(link.one @ link.m1[:, 0]), _second_moments(link)
    least = float(second[:2].sum())  # about the axis with most mass near it
    return float(np.sqrt(along / mass + (along * overall_length(link) ** 2 + about) / least))
