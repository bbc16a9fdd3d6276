"""Selection of the facets of a meshed link for a joint: faces by name, else those about its point and axis."""

from collections.abc import Iterable, Sequence
from typing import Any
from weakref import WeakKeyDictionary
from zlib import crc32

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.links.record import Link, read_only
from kedfem.links.surfaces.candidates import round_candidates
from kedfem.links.surfaces.missing import in_link_plane, missing_surface, several_surfaces
from kedfem.links.surfaces.round_surfaces import RoundSurface, ball, nearest_round_surfaces, round_surfaces
from kedfem.links.surfaces.surface import CYLINDER_TOLERANCE, flat_face

Facets = Int[np.ndarray, " f"]

_FOUND: WeakKeyDictionary[Any, dict[tuple[object, ...], Facets]] = WeakKeyDictionary()


def named_facets(link: Link, where: str, faces: Sequence[str]) -> Facets:
    """Facets of faces by their names.

    Raises
    ------
    MeshError
        If the link has no face of such a name, or as a segment no part of it.
    """
    known = {each.face.name: each.facets for each in link.faces}
    for name in faces:
        if name not in known:
            own = [each.face.name for each in link.faces if not each.face.chosen]
            none = "none (a part from CAD, or a mesh file with groups, has some)"
            got = f"got {name!r}; it has {', '.join(map(repr, own)) or none}"
            raise MeshError(f"{where}.faces: must name faces of link '{link.name}', {got}")
    facets = np.unique(np.concatenate([known[name] for name in faces]))
    if not len(facets):
        got = f"got {', '.join(map(repr, faces))}"
        raise MeshError(f"{where}.faces: must name faces of link '{link.name}' that have elements, {got}")
    return facets


def selected_facets(link: Link, where: str, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"] | None) -> Facets:
    """Facets of a joint about its point and axis, as of `_selected_facets`, cached for each mesh.

    They are needed some dozen times in a run, for every model of choices and estimates.
    """
    about = link.axes if axis is None else axis
    given = (point, about, link.X)
    key = link.kind, axis is None, *(crc32(np.ascontiguousarray(x, float).tobytes()) for x in given)
    before = _FOUND.setdefault(link.basis, {})
    if key not in before:
        before[key] = _selected_facets(link, where, point, axis)
        read_only(before[key])
    return before[key]


def _selected_facets(
    link: Link, where: str, point: Float[np.ndarray, "3"], axis: Float[np.ndarray, "3"] | None
) -> Facets:
    """A ball if no axis is given; else a bore about the axis (or one of the link's), a journal, a flat face.

    MeshError if there is none, or several that cannot be distinguished.
    """
    seen = in_link_plane(link, point)
    if axis is None and link.d == 3 and len(found := ball(link, point)):
        return found
    axes = np.eye(3)[2:] if link.kind == "plane" else link.axes.T if axis is None else (axis,)
    about = [round_surfaces(link, seen, each) for each in axes]
    if axis is None and link.d == 3 and not any(each.inward for found in about for each in found):
        own = (
            each for each in round_candidates(link) if each.cylindrical
        )  # bores and journals with axes through the point
        through = (x.direction for x in own if x.axis_distance(seen) <= CYLINDER_TOLERANCE * x.radius)
        about += [round_surfaces(link, seen, each) for each in through]
    if bores := _first([[each for each in found if each.inward] for found in about]):
        return _one_pin(link, where, seen, bores)
    journals = _first([[each for each in found if not each.inward] for found in about])
    if any(each.gap < -each.level or link.d == 2 for each in journals):
        return _one_pin(link, where, seen, journals)
    if len(face := flat_face(link, seen)):
        return face
    if journals:
        return _one_pin(link, where, seen, journals)
    raise MeshError(missing_surface(link, where, point, axis))


def _first(several: Iterable[list[RoundSurface]]) -> list[RoundSurface]:
    """The first list that is not empty."""
    return next((found for found in several if found), [])


def _one_pin(link: Link, where: str, point: Float[np.ndarray, "3"], found: list[RoundSurface]) -> Facets:
    """Facets of the surface of a joint, or of several of one radius, which one pin fits; MeshError if radii differ."""
    chosen = nearest_round_surfaces(found, link.d == 2)
    size = [each.radius for each in chosen]
    if max(size) - min(size) > CYLINDER_TOLERANCE * max(size):
        raise MeshError(several_surfaces(link, where, point, chosen))
    return np.concatenate([each.facets for each in chosen])
