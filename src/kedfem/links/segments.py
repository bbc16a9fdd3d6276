"""Links divided into segments with co-rotational frames, for large deflections; each segment is a link, too.

The segments of a beam are its elements, those of a solid or plane link slices of its mesh. Neighbours share the ports of
the cut between them: of a beam its node, of a meshed link the affine field that best fits the cut, so that both sides may
warp differently.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.links.plane import plane_link
from kedfem.links.record import Link
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.coupling_surfaces import facet_surface, port_weights
from kedfem.links.surfaces.surface import boundary
from kedfem.mesh import QuadMesh, SolidMesh
from kedfem.mesh.elements.hexahedra import Face
from kedfem.scene import Material

SMOOTHINGS = 5  # passes in which tetrahedra join the slice of most neighbours; a few would alternate for ever
SAME = 1e-9  # of a link's size: nodes and facets at the same place
LEANS = np.radians(10)  # between a surface and the direction of the link: facets of a cylinder along it lean by less
TRIED = 64  # places for cuts along a link
NEAR = 0.4  # of a segment's length: largest displacement of a cut to where the link is prismatic
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Cut:
    """Ports that two segments share.

    segments : their numbers
    points : (k, 3) in the reference position [m]
    weights : (k, n) of each segment
    facets : of each segment of a meshed link
    prismatic : whether the link is prismatic around the cut: it transmits an affine field, and stresses near it are those
        of the undivided link
    """

    segments: tuple[int, int]
    points: Float[np.ndarray, "k 3"]
    weights: tuple[Float[np.ndarray, "k _"], Float[np.ndarray, "k _"]]
    facets: tuple[Int[np.ndarray, " f"], ...] = ()
    prismatic: bool = True


@dataclass(frozen=True, slots=True)
class Segments:
    """A link divided into segments.

    parts, cuts : segments in order along the link, and the cuts between them
    functions : of a meshed link, numbers of each segment's functions in the undivided link
    """

    parts: tuple[Link, ...]
    cuts: tuple[Cut, ...] = ()
    functions: tuple[Int[np.ndarray, " _"], ...] = ()


def corotational(link: Link) -> Link:
    """The link with a co-rotational frame: its mean rotation, which best fits its shape, weighted by mass.

    The link is without attached bodies: a heavy one would determine the frame.
    """
    return replace(link, fit=link.mX - np.outer(link.m1[:, 0], link.centre))


def segmented(
    link: Link, material: Material, count: int, ends: Float[np.ndarray, "p 3"], whole: Sequence[Interval]
) -> Segments:
    """A solid or plane link divided into slices across the line between the two of its joints that are farthest apart.

    Parameters
    ----------
    link : without attached bodies
    count : number of slices
    ends : joints of the link, in the reference position [m]
    whole : ranges along that line which no cut may divide: bores and other coupling surfaces [m]

    Raises
    ------
    MeshError
        If the mesh has fewer layers of elements.
    """
    if count == 1:
        return Segments((corotational(link),), functions=(np.arange(link.n),))
    e = along(link, ends)
    s = link.X[link.cells] @ e  # (e, m)
    places, prismatic = _places(count, ends @ e if len(ends) > 1 else s, whole, _Shape(link, e))
    slice_of = _smoothed(link, np.searchsorted(places, s.mean(axis=1)), count)
    found = [np.flatnonzero(slice_of == k) for k in range(count)]
    parts = [_slice(link, material, elements) for elements in found if len(elements)]
    cuts = [_cut(a, b, e, k, prismatic[k]) for k, ((a, _), (b, _)) in enumerate(pairwise(parts))]
    if len(parts) < count or None in cuts:
        fewer = sum(cut is not None for cut in cuts) + 1
        raise MeshError(
            f"links.{link.name}.segments: must be at most {min(fewer, count - 1)} for this mesh, whose elements cannot "
            f"be divided into more slices across the link, got {count}; take a finer mesh"
        )
    kept = tuple(cut for cut in cuts if cut)
    own = (replace(corotational(part), cuts=_facets_on(kept, k)) for k, (part, _) in enumerate(parts))
    return Segments(tuple(own), kept, tuple(n for _, n in parts))


def _facets_on(cuts: Sequence[Cut], number: int) -> Int[np.ndarray, " c"]:
    """Facets of a segment at its cuts."""
    sides = [cut.facets[cut.segments.index(number)] for cut in cuts if number in cut.segments]
    return np.unique(np.concatenate(sides, dtype=np.int64))


def along(link: Link, ends: Float[np.ndarray, "p 3"]) -> Float[np.ndarray, "3"]:
    """Unit normal of a link's cuts: between the two joints farthest apart, else along its axis of least inertia."""
    if len(ends) > 1:
        distance = np.linalg.norm(ends[:, None] - ends, axis=2)
        a, b = np.unravel_index(distance.argmax(), distance.shape)
        if distance[a, b] > 0.1 * link.size:
            return np.asarray((ends[b] - ends[a]) / distance[a, b])
    e = longest_axis(link)
    away = (link.centre - ends).sum(axis=0) @ e
    return np.asarray(e * np.sign(away if abs(away) > SAME * link.size else e[np.abs(e).argmax()]))


def longest_axis(link: Link) -> Float[np.ndarray, "3"]:
    """Axis of least inertia of a meshed link, a unit vector of either sign."""
    X = link.X - np.outer(link.one, link.centre)
    return np.asarray(np.linalg.eigh(X.T @ (link.mass[0] @ X))[1][:, -1])


class _Shape:
    """Where a link is prismatic along a direction: no surface but its ends leans by more than LEANS."""

    def __init__(self, link: Link, e: Float[np.ndarray, "3"]) -> None:
        _, corners, normals = boundary(link)
        self.s, along = link.X @ e, corners @ e
        across = link.X - np.outer(self.s, e)
        self.across = across - across.mean(axis=0)
        rounding = SAME * link.size
        end = (along.max(axis=1) < self.s.min() + rounding) | (along.min(axis=1) > self.s.max() - rounding)
        leaning = (np.abs(normals @ e) > np.sin(LEANS)) & ~end
        self.low, self.high = along[leaning].min(axis=1), along[leaning].max(axis=1)

    def prismatic(self, place: float) -> bool:
        """Whether it is around a place, within half of its width: fields that are not affine decay over that length."""
        reach = np.ptp(self.s) / TRIED
        here = self.across[np.abs(self.s - place) < reach]
        half = np.linalg.norm(here - here.mean(axis=0), axis=1).max() if len(here) else 0.0
        return not ((self.low < place + half) & (self.high > place - half)).any()


def max_slices(X: Float[np.ndarray, "n 3"], e: Float[np.ndarray, "3"]) -> int:
    """The largest number of slices across a direction, none shorter than a link with nodes X [m] is wide."""
    s = X @ e
    across = X - np.outer(s, e)
    widest = np.linalg.svd(across - across.mean(axis=0), full_matrices=False)[2][0]
    return max(1, int(np.ptp(s) / np.ptp(across @ widest) + 1e-9))


def _places(
    count: int, s: Float[np.ndarray, "..."], whole: Sequence[Interval], shape: _Shape
) -> tuple[Float[np.ndarray, " c"], list[bool]]:
    """Places of cuts, and whether the link is prismatic at each.

    They are equally spaced, but moved to where the link is prismatic if that is near, and out of undivided ranges.
    """
    places = np.linspace(s.min(), s.max(), count + 1)[1:-1]
    tried = np.linspace(s.min(), s.max(), TRIED + 1)[1:-1]
    free = [x for x in tried if shape.prismatic(x) and not any(low < x < high for low, high in whole)]
    prismatic = [shape.prismatic(x) for x in places]
    for k, place in enumerate(places):
        held = any(low < place < high for low, high in whole)
        near = min(free, key=lambda x: abs(x - place), default=np.inf)
        if (held or not prismatic[k]) and abs(near - place) < NEAR * np.ptp(s) / count:
            places[k], prismatic[k] = near, True
    for low, high in whole:
        inside = (places > low) & (places < high)
        places[inside] = np.where(places[inside] - low < high - places[inside], low, high)
    return places, prismatic


def _smoothed(link: Link, slice_of: Int[np.ndarray, " e"], count: int) -> Int[np.ndarray, " e"]:
    """Slices of elements, tetrahedra moved to the slice of most of their neighbours; hexahedra are in layers already."""
    if link.cell_type != "tetra10":
        return slice_of
    left, right = link.basis.mesh.f2t[:, link.basis.mesh.f2t[1] >= 0]
    for _ in range(SMOOTHINGS):
        beside = np.zeros((len(slice_of), count), dtype=int)
        np.add.at(beside, (left, slice_of[right]), 1)
        np.add.at(beside, (right, slice_of[left]), 1)
        own = np.take_along_axis(beside, slice_of[:, None], axis=1)[:, 0]
        moved = np.where(beside.max(axis=1) > own, beside.argmax(axis=1), slice_of)
        if (moved == slice_of).all():
            break
        slice_of = moved
    return slice_of


def _slice(link: Link, material: Material, elements: Int[np.ndarray, " e"]) -> tuple[Link, Int[np.ndarray, " n"]]:
    """A link of some elements of another, and numbers of its functions in that."""
    from scipy.spatial import cKDTree

    used, cells = np.unique(link.cells[elements], return_inverse=True)
    cells = cells.reshape(len(elements), -1)
    if link.kind == "plane":
        part = plane_link(link.name, QuadMesh(link.X[used], cells, link.thickness), material, link.axes)
    else:
        faces = _slice_faces(link, elements, used)
        part = solid_link(link.name, SolidMesh(link.X[used], cells, faces, link.method), material, link.axes)
    # the function space has numbers of its own
    distance, same = cKDTree(link.X).query(part.X)
    if distance.max() > SAME * link.size:
        got = "got some that it does not have"
        raise MeshError(f"links.{link.name}.segments: must keep the nodes of the link, {got}")
    return part, same


def _slice_faces(link: Link, elements: Int[np.ndarray, " e"], used: Int[np.ndarray, " n"]) -> tuple[Face, ...]:
    """Named faces of a link, with their sides on some of its elements, if any."""
    mesh, faces = link.basis.mesh, []
    for each in link.faces:
        here = each.facets[np.isin(mesh.f2t[0, each.facets], elements)]
        faces.append(replace(each.face, sides=np.searchsorted(used, mesh.facets[:, here].T)))
    return tuple(faces)


def _cut(a: Link, b: Link, e: Float[np.ndarray, "3"], number: int, prismatic: bool) -> Cut | None:
    """The cut between two slices, with ports at its centre and beside it; None if they share no facets."""
    from scipy.spatial import cKDTree

    middles = [_facet_middles(part) for part in (a, b)]
    distance, nearest = cKDTree(middles[1]).query(middles[0])
    here = np.flatnonzero(distance <= SAME * max(a.size, b.size))
    if not len(here):
        return None
    one, other = (part.basis.mesh.boundary_facets()[sides] for part, sides in ((a, here), (b, nearest[here])))
    surfaces = facet_surface(a, one, e), facet_surface(b, other, e)
    first = surfaces[0]
    off = first.spread[: a.d - 1, None] * first.directions[: a.d - 1]
    points = first.origin + np.concatenate([np.zeros((1, 3)), off])
    weights = (port_weights(surfaces[0], points), port_weights(surfaces[1], points))
    return Cut((number, number + 1), weights[0] @ a.X, weights, (one, other), prismatic)


def _facet_middles(part: Link) -> Float[np.ndarray, "f d"]:
    mesh = part.basis.mesh
    return np.asarray(mesh.p[:, mesh.facets[:, mesh.boundary_facets()]].mean(axis=1).T)
