"""Loads P of the general equation: every one is a constant pattern of the link times a factor over time.

[KED, eqs. (15)(16)]: body, surface and concentrated forces, all through Nᵀ.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.places import on_part
from kedfem.errors import SceneError
from kedfem.links.record import Link, as_rows
from kedfem.links.recovery import point_rows
from kedfem.links.seats import face_seat, is_flat, same_face, surface_weights
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import BodyLoad, ForceLoad, Load, Scene, SurfaceLoad, load_factor


@dataclass(frozen=True, slots=True)
class Pattern:
    """Nodal forces of one load on one link.

    forces : (n, d) at factor one, reference components [N]
    follows : turns with the link
    factor : times (t,) → factors (t,)
    """

    forces: Float[np.ndarray, "n d"]
    follows: bool
    factor: Callable[[Float[np.ndarray, " t"]], Float[np.ndarray, " t"]]


def patterns(scene: Scene, links: Mapping[str, Link]) -> dict[str, tuple[Pattern, ...]]:
    """All loads P on links or their segments, by key, [KED, eqs. (15)(16)], gravity first.

    Raises
    ------
    MeshError, SceneError
        If a point or face is not on the link.
    """
    out: dict[str, list[Pattern]] = {key: [] for key in links}
    if any(scene.gravity):
        for key, link in links.items():
            out[key].append(Pattern(link.m1 * as_rows(link, np.asarray(scene.gravity)), False, np.ones_like))
    for name, load in scene.loads.items():
        for key, weights in _weights(f"loads.{name}", load, links).items():
            forces = np.outer(weights, as_rows(links[key], np.asarray(load.vector)))
            out[key].append(Pattern(forces, load.frame == "link", partial(load_factor, load.factor)))
    return {key: tuple(found) for key, found in out.items()}


def slider_pattern(link: Link, load: ForceLoad, weights: Float[np.ndarray, " n"]) -> Pattern:
    """A force on a rigid slider, which never turns, through the weights of its point on the carrier."""
    forces = np.outer(weights, as_rows(link, np.asarray(load.vector)))
    return Pattern(forces, False, partial(load_factor, load.factor))


def _weights(where: str, load: Load, links: Mapping[str, Link]) -> dict[str, Float[np.ndarray, " n"]]:
    """Which segments of its link a load acts on, and how much of it each function takes."""
    parts = {key: link for key, link in links.items() if link.name == load.link}
    match load:
        case ForceLoad() if parts:
            key, weights = on_part(
                parts, load.link, np.asarray(load.at), lambda x: _point_weights(where, load, x)
            )
            return {key: weights}
        case BodyLoad():
            return {key: link.volume for key, link in parts.items()}
        case SurfaceLoad() if parts:
            return _surface_weights(where, load, parts)
        case _:
            return {}


def _point_weights(where: str, load: ForceLoad, link: Link) -> Float[np.ndarray, " n"]:
    rows = point_rows(link, f"{where}.at", np.asarray(load.at))
    beside = float(np.linalg.norm(rows.X - load.at))
    if link.kind == "beam" and beside > 1e-6 * link.size:
        raise SceneError(
            f"{where}.at: must lie on the axis of beam '{link.name}', got {beside:.3g} m beside it"
        )
    return rows.value


def _surface_weights(
    where: str, load: SurfaceLoad, parts: Mapping[str, Link]
) -> dict[str, Float[np.ndarray, " n"]]:
    """A plane face may run over several segments: all of it that each has; a curved one is on one segment."""
    at = np.asarray(load.at)
    for link in parts.values():
        if not link.meshed:
            raise SceneError(
                f"{where}: a surface force needs a solid or a plane link, got the beam '{link.name}'"
            )
    key, seat = on_part(parts, load.link, at, lambda x: face_seat(x, f"{where}.at", at))
    found = {key: seat}
    for other in parts.keys() - {key} if is_flat(seat) else ():
        if (same := same_face(parts[other], seat)) is not None:
            found[other] = same
    return {key: surface_weights(parts[key], seat) for key, seat in found.items()}


def nominal_acceleration(link: Link, motion: RigidMotion, body: int) -> Float[np.ndarray, "T d"]:
    """p'' of a link over time; of a planar beam (x'', y'', θ'')."""
    if link.kind == "beam":
        return np.concatenate([motion.p2[:, body, :2], motion.alpha[:, body, 2:]], axis=1)
    return motion.p2[:, body, : link.d]


def applied(
    link: Link,
    loads: tuple[Pattern, ...],
    motion: RigidMotion,
    body: int,
) -> Float[np.ndarray, "T n d"]:
    """P − M R0'' over time, world components, [KED, eqs. (17)(18)]: R0'' = 1 ⊗ p'' + X R''ᵀ.

    Parameters
    ----------
    body : the link's number in the motion
    """
    F = link.mX @ -motion.R2[:, body, : link.d].transpose(0, 2, 1)
    F -= link.m1 * nominal_acceleration(link, motion, body)[:, None]
    R = motion.R[:, body, : link.d, : link.d].transpose(0, 2, 1)
    for load in loads:
        factor = load.factor(motion.t)
        if factor.any():
            F += factor[:, None, None] * (load.forces @ R if load.follows else load.forces)
    return np.asarray(F)
