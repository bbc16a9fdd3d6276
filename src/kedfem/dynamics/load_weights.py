"""Nodal weights of the point or surface of a link on which a load acts."""

from collections.abc import Mapping

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.places import on_part
from kedfem.errors import SceneError
from kedfem.links.beams.line_weights import axis_weights, side_forces
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link, as_rows
from kedfem.links.surfaces.coupling_surfaces import (
    CouplingSurface,
    face_normals,
    face_surface,
    is_flat,
    port_weights,
    rigid_link_surface,
    same_face,
    surface_weights,
)
from kedfem.scene import Bar, BodyLoad, ForceLoad, LineLoad, PressureLoad, Scene, SurfaceLoad
from kedfem.scene.records.materials import LINE

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


def line_forces(
    scene: Scene, where: str, load: LineLoad, parts: Mapping[str, Link]
) -> dict[str, Float[np.ndarray, "n _"]]:
    """Nodal forces of a load along a line, reference components [N]; of segments that it is on."""
    given = scene.links[load.link]
    start, end = np.asarray(load.vector), np.asarray(load.end_vector or load.vector)
    key, link = next(iter(parts.items()))
    if given.model != "rigid" or link.kind == "beam" or (given.rigid_line and not str(given.material).startswith(LINE)):
        weights = axis_weights(parts, f"{where}.between", load.between)
    else:  # anywhere on a rigid body
        if (ends := load.between or (given.shape.between if isinstance(given.shape, Bar) else None)) is None:
            raise SceneError(f"{where}.between: must be given on a rigid link without an axis, got nothing")
        P, Q = np.array(ends)
        f = (1 + np.polynomial.legendre.leggauss(2)[0]) / 2  # of moments, which are quadratic in f
        of = port_weights(rigid_link_surface(link, P), P + f[:, None] * (Q - P)) * np.linalg.norm(Q - P) / 2
        weights = {key: of.T @ np.stack([1 - f, f], axis=1)}
    return {
        at: np.outer(w[:, 0], as_rows(parts[at], start)) + np.outer(w[:, 1], as_rows(parts[at], end))
        for at, w in weights.items()
    }


def pressed(where: str, load: PressureLoad, parts: Mapping[str, Link]) -> dict[str, Float[np.ndarray, "n _"]]:
    """Nodal forces of a unit pressure, reference components [N/Pa]; of segments that it is on."""
    if next(iter(parts.values())).meshed:
        return {key: -face_normals(parts[key], surface) for key, surface in face(where, load, parts).items()}
    return side_forces(parts, f"{where}.at", np.asarray(load.at))


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
