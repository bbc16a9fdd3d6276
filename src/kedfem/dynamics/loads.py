"""Loads P of the general equation: constant patterns on the link, times factors over time.

[KED, eqs. (15)(16)]: body, line, surface and point forces by Nᵀ; couples by the rotation of a coupling surface.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.places import on_part, surface_of
from kedfem.dynamics.load_weights import Vector, at_point, line_forces, load_weights, point_weights, pressed
from kedfem.errors import MeshError, SceneError
from kedfem.links.record import Link, as_rows
from kedfem.links.surfaces.coupling_surfaces import joint_surface, surface_couples
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import (
    BodyLoad,
    ForceLoad,
    LineLoad,
    Load,
    PressureLoad,
    Scene,
    SurfaceLoad,
    TorqueLoad,
    factor_law,
    factor_table,
    factors,
    load_factor,
    path_parameter,
    time_grid,
)

MISSED = 0.05  # of a load's integral over time; a jump between two steps is less
FINER, MOST = 16, 400_000  # points in a step, and in all, at which factors over an angle are examined

Times = Float[np.ndarray, " t"]


@dataclass(frozen=True, slots=True)
class Pattern:
    """Nodal forces of one load on one link.

    forces : (n, d) at factor one, reference components [N]
    follows : rotates with the link
    factor : times (t,) and angles of the drive (t,) → factors (t,)
    share : unit vectors of the link in the reference position and of the world: the factor times their cosine, once the
        link has rotated
    own : turns as the link itself does, which no rigid-body orientation shows: `system.forces.follower_loads`
    load : its name in the scene; of gravity none
    """

    forces: Float[np.ndarray, "n d"]
    follows: bool
    factor: Callable[[Times, Times], Times]
    share: tuple[Vector, Vector] | None = None
    own: bool = False
    load: str = ""


def patterns(scene: Scene, links: Mapping[str, Link], prescribed: bool = False) -> dict[str, tuple[Pattern, ...]]:
    """All loads P on links or their segments, by key, [KED, eqs. (15)(16)], gravity first.

    Parameters
    ----------
    prescribed : the links only move as given, whatever their frames are

    Raises
    ------
    MeshError, SceneError
        If a point or face is not on the link.
    """
    out: dict[str, list[Pattern]] = {key: [] for key in links}
    if any(scene.gravity):
        for key, link in links.items():
            out[key].append(Pattern(link.m1 * as_rows(link, np.asarray(scene.gravity)), False, _always))
    for name, load in scene.loads.items():
        for key, found in _load_patterns(scene, f"loads.{name}", load, links).items():
            own = links[key].fit is not None and not prescribed
            out[key] += [replace(x, own=own and _follows(links[key], x), load=name) for x in found]
    return {key: tuple(found) for key, found in out.items()}


def _follows(link: Link, pattern: Pattern) -> bool:
    """Whether a load depends on the rotation of its link: a torque on ψ of a planar beam does not."""
    return pattern.follows and bool(pattern.forces[:, : 2 if link.kind == "beam" else 3].any())


def coarse_steps(scene: Scene) -> tuple[str, ...]:
    """A warning for each load or spring whose factor changes between two time steps without effect on them."""
    grid, out = time_grid(scene), []
    steps = grid.step * np.arange(grid.steps + 1)
    phi = path_parameter(scene, steps)[0] if scene.driven else np.zeros_like(steps)
    for where, factor in factors(scene):
        sampled = load_factor(factor, steps, phi)
        if factor.over == "time":
            fine = np.array(factor_table(factor, grid.end)[0])
            fine = fine[(fine > 0) & (fine < grid.end)]
        else:
            fine = grid.step / FINER * np.arange(min(FINER * grid.steps, MOST) + 1)
        t = np.union1d(steps, fine)
        angle = path_parameter(scene, t)[0] if scene.driven else np.zeros_like(t)
        value = load_factor(factor, t, angle)
        missed = np.trapezoid(np.abs(value - np.interp(t, steps, sampled)), t)
        if missed > MISSED * np.trapezoid(np.abs(value), t):
            out.append(
                f"{where.rpartition('.')[0]}: its table is finer than the time step of {grid.step:.3g} s: "
                f"its integral over the steps is off by {100 * missed / np.trapezoid(np.abs(value), t):.0f} %; "
                "take a smaller step"
            )
    return tuple(out)


def _always(t: Times, phi: Times) -> Times:
    return np.ones_like(t)


def _load_patterns(scene: Scene, where: str, load: Load, links: Mapping[str, Link]) -> dict[str, list[Pattern]]:
    """The patterns of a load on each segment of its link."""
    parts = {key: link for key, link in links.items() if link.name == load.link}
    factor = factor_law(load.factor)
    match load:
        case TorqueLoad() if parts:
            return _torque(scene, where, load, parts)
        case PressureLoad() if parts:
            return {key: [Pattern(load.pressure * x, True, factor)] for key, x in pressed(where, load, parts).items()}
        case LineLoad() if parts:
            forces = line_forces(scene, where, load, parts)
            return {key: [Pattern(x, load.frame == "link", factor)] for key, x in forces.items()}
        case ForceLoad() | BodyLoad() | SurfaceLoad():
            follows, vector = load.frame == "link", np.asarray(load.vector)
            return {
                key: [Pattern(np.outer(w, as_rows(links[key], vector)), follows, factor)]
                for key, w in load_weights(where, load, parts).items()
            }
        case _:
            return {}


def _torque(scene: Scene, where: str, load: TorqueLoad, parts: Mapping[str, Link]) -> dict[str, list[Pattern]]:
    """A couple on the segment of its coupling surface; of fixed direction m it is Σ (m · R e_k) of that about R e_k."""
    m, factor = np.asarray(load.vector), factor_law(load.factor)
    at = np.asarray(scene.joints[load.joint].at if load.joint is not None else load.at)
    key, couples = on_part(parts, load.link, at, lambda link: _couples(scene, where, load, link, at))
    if load.frame == "link" or parts[key].planar:
        return {key: [Pattern(np.tensordot(m, couples, 1), True, factor)]}
    about = [(one, axis) for one, axis in zip(couples, np.eye(3), strict=True)]
    return {key: [Pattern(one, True, factor, (axis, m)) for one, axis in about]}


def _couples(scene: Scene, where: str, load: TorqueLoad, link: Link, at: Vector) -> Float[np.ndarray, "3 n d"]:
    """Forces of unit couples about x, y and z on a link's coupling surface."""
    if link.kind == "beam":
        out = np.zeros((3, link.n, 3))
        out[2, :, 2] = point_weights(where, link, at)
        return out
    if load.joint is not None:
        return surface_couples(link, surface_of(scene, load.joint, link), where)
    axis = np.asarray(load.vector) / (np.linalg.norm(load.vector) or 1.0)
    try:
        surface = joint_surface(link, f"{where}.at", at, axis if np.any(axis) else None)
    except MeshError:
        surface = joint_surface(link, f"{where}.at", at, None)  # a bore or journal across the torque
    return surface_couples(link, surface, where)


def initial_forces(scene: Scene, links: Sequence[Link]) -> list[Float[np.ndarray, "n d"]]:
    """Nodal forces (n, d) on all links, or on their segments, that are released at the start, world components [N].

    Raises
    ------
    MeshError, SceneError
        If a point is not on its link, or a drive prescribes the link's motion.
    """
    out = [np.zeros((link.n, link.d)) for link in links]
    parts = {str(k): link for k, link in enumerate(links)}
    for name, force in scene.analysis.initial_deflection.items():
        where = f"analysis.initial_deflection.{name}"
        if all(link.name != force.link for link in links):
            raise SceneError(
                f"{where}.link: must name an elastic link, or a rigid one that no drive prescribes, "
                f"got '{force.link}', whose motion is prescribed"
            )
        key, weights = at_point(where, force.link, np.asarray(force.at), parts)
        out[int(key)] += np.outer(weights, as_rows(parts[key], np.asarray(force.force)))
    return out


def rigid_acceleration(link: Link, motion: RigidMotion, body: int) -> Float[np.ndarray, "T d"]:
    """p'' of a link over time; of a planar beam (x'', y'', θ'')."""
    if link.kind == "beam":
        return np.concatenate([motion.p2[:, body, :2], motion.alpha[:, body, 2:]], axis=1)
    return motion.p2[:, body, : link.d]


def amounts(load: Pattern, motion: RigidMotion, body: int) -> Float[np.ndarray, " T"]:
    """The factor of a load over time."""
    return load.factor(motion.t, motion.phi) * shares(load.share, motion, body)


def shares(share: tuple[Vector, Vector] | None, motion: RigidMotion, body: int) -> Float[np.ndarray, " T"] | float:
    """The cosine that a load's factor is multiplied by, see `Pattern`."""
    return 1.0 if share is None else np.asarray(motion.R[:, body] @ share[0] @ share[1])


def applied(link: Link, loads: tuple[Pattern, ...], motion: RigidMotion, body: int) -> Float[np.ndarray, "T n d"]:
    """P − M R0'' over time, world components, [KED, eqs. (17)(18)]: R0'' = 1 ⊗ p'' + X R''ᵀ.

    All patterns of the link are combined in one product, component first in memory.

    Parameters
    ----------
    body : the link's number in the motion
    """
    d, unit = link.d, np.eye(link.d)
    shapes, amount = [link.mX, link.m1], [-motion.R2[:, body, :d]]
    amount.append(-rigid_acceleration(link, motion, body)[:, :, None] * unit)
    for load in loads:
        factor = np.zeros(1) if load.own else amounts(load, motion, body)
        if factor.any():
            shapes.append(load.forces)
            amount.append(factor[:, None, None] * (motion.R[:, body, :d, :d] if load.follows else unit))
    F = np.concatenate(amount, axis=2).reshape(len(motion.t) * d, -1) @ np.concatenate(shapes, axis=1).T
    return np.asarray(F.reshape(len(motion.t), d, link.n).transpose(0, 2, 1))


def unit_forces(
    link: Link, loads: tuple[Pattern, ...], name: str, motion: RigidMotion, body: int
) -> Float[np.ndarray, "T n d"]:
    """What a load of the scene exerts on a link at factor one over time, world components [N]."""
    F = np.zeros((len(motion.t), link.n, link.d))
    for load in loads:
        if load.load == name:
            R = motion.R[:, body, : link.d, : link.d].transpose(0, 2, 1)
            share = np.reshape(shares(load.share, motion, body), (-1, 1, 1))
            F += share * (load.forces @ R if load.follows else load.forces)
    return F
