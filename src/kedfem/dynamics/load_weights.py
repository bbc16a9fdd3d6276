"""Nodal weights of the point or surface of a link on which a load acts."""

from collections.abc import Mapping

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.places import on_part
from kedfem.errors import SceneError
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, face_surface, is_flat, same_face, surface_weights
from kedfem.scene import BodyLoad, ForceLoad, PressureLoad, SurfaceLoad

Vector = Float[np.ndarray, "3"]


def load_weights(
    where: str, load: ForceLoad | BodyLoad | SurfaceLoad, parts: Mapping[str, Link]
) -> dict[str, Float[np.ndarray, " n"]]:
    """The segments of its link on which a load acts, and its weights on their functions."""
    if not parts:
        return {}
    match load:
        case ForceLoad():
            return dict([at_point(where, load.link, np.asarray(load.at), parts)])
        case BodyLoad():
            return {key: link.volume for key, link in parts.items()}
        case SurfaceLoad():
            return {key: surface_weights(parts[key], surface) for key, surface in face(where, load, parts).items()}


def at_point(where: str, name: str, at: Vector, parts: Mapping[str, Link]) -> tuple[str, Float[np.ndarray, " n"]]:
    """The segment of a link on which a point force acts, and its weights on the functions."""
    return on_part(parts, name, at, lambda link: point_weights(where, link, at))


def point_weights(where: str, link: Link, at: Vector) -> Float[np.ndarray, " n"]:
    """Weights of a point force on a link; on beams it must be on the axis."""
    rows = point_rows(link, f"{where}.at", at)
    require_on_axis(link, f"{where}.at", at, rows.X)
    return rows.value


def face(where: str, load: SurfaceLoad | PressureLoad, parts: Mapping[str, Link]) -> dict[str, CouplingSurface]:
    """A plane face may run over several segments: all of it that each has; a curved one is on one segment."""
    at = np.asarray(load.at)
    for link in parts.values():
        if not link.meshed:
            raise SceneError(f"{where}: a {load.kind} needs a solid or a plane link, got the beam '{link.name}'")
    key, surface = on_part(parts, load.link, at, lambda x: face_surface(x, f"{where}.at", at))
    found = {key: surface}
    for other in parts.keys() - {key} if is_flat(surface) else ():
        if (same := same_face(parts[other], surface)) is not None:
            found[other] = same
    return found
