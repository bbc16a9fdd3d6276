"""Messages for joints with no surface on a link, or several: the nearest candidates, likely wrong units."""

from collections.abc import Sequence
from operator import itemgetter

import numpy as np

from kedfem.arrays import Float
from kedfem.links.record import Link
from kedfem.links.surfaces.candidates import Candidate, candidates, distance
from kedfem.links.surfaces.round_surfaces import RoundSurface

MOST = 3  # bores, journals and balls in a message; of faces the nearest alone
SMALL = 0.1  # [m]: shorter lengths are reported in millimetres
STRAIGHT = 0.05  # [deg]: axes with a smaller angle between them are parallel
ASKEW = 45.0  # [deg]: axes with a larger angle are unrelated
SCALES = (1000.0, 0.001)

Vector = Float[np.ndarray, "3"]
NEAR = 0.05  # of a link's size: a joint closer to a beam's node was meant to be at it


def missing_surface(link: Link, where: str, point: Vector, axis: Vector | None = None) -> str:
    """The message that a link has no surface at a joint's point, with the nearest ones, and what to do.

    Parameters
    ----------
    axis : of the required bore
    """
    point = in_link_plane(link, point)
    nearest = link.nodes[np.linalg.norm(link.nodes - point, axis=1).argmin()]
    gap = float(np.linalg.norm(nearest - point))
    what = "a node of" if not link.meshed else "a bore or a flat face of"
    text = (
        f"{where}: must sit on {what} link '{link.name}' at {shown(point)}, "
        f"got none there (nearest node {shown(nearest)}, {length(gap)} away)"
    )
    level = 1e-6 * link.size  # of those at the same distance the narrowest first
    offered = sorted(candidates(link), key=lambda each: (round(each.distance(point) / level), each.radius))
    near = not link.meshed and gap < NEAR * link.size
    apart = f"the parts do not meet: they are given {1e3 * gap:.3g} mm apart" if near else ""
    hints = [apart, _units(link, point, axis, gap, offered), _beside(point, axis, offered)]
    hints += [_listed(link, offered, point), _advice(link, offered)]
    return "; ".join([text, *(hint for hint in hints if hint)])


def several_surfaces(link: Link, where: str, point: Vector, found: Sequence[RoundSurface]) -> str:
    """The message that a joint fits several bores or journals."""
    each = ", ".join(
        f"{'bore' if x.inward else 'journal'} of radius {length(x.radius)}, {length(x.low)} to {length(x.high)} along it"
        for x in found
    )
    return (
        f"{where}: must sit on one bore or journal of link '{link.name}' at {shown(point)}, got {len(found)} that are as "
        f"near: {each}; give the joint a point within one of them along the axis, or name its face in faces"
    )


def _units(link: Link, point: Vector, axis: Vector | None, gap: float, offered: Sequence[Candidate]) -> str | None:
    """The hint that the part has the joint's point if it is 1000 times larger or smaller."""
    low, high = link.nodes.min(axis=0), link.nodes.max(axis=0)
    room = 0.01 * link.size
    for scale in SCALES:
        if np.linalg.norm(point) < 0.1 * scale * link.size:
            continue  # near the origin a large part has many surfaces
        boxed = bool(((scale * (low - room) <= point) & (point <= scale * (high + room))).all())
        nearest_rounds = any(each.cylindrical and _fits(each, point / scale, axis) for each in offered)
        if nearest_rounds or (boxed and gap > link.size):
            word = "larger" if scale > 1 else "smaller"
            return f"the part seems to be in other units: 1000 times {word} it would fit (scale = {scale:g})"
    return None


def _fits(each: Candidate, point: Vector, axis: Vector | None) -> bool:
    straight = axis is None or abs(each.direction @ axis) > np.cos(np.radians(STRAIGHT))
    return bool(straight and each.axis_distance(point) <= 0.01 * each.radius) and each.distance(point) <= 2 * each.length


def _beside(point: Vector, axis: Vector | None, offered: Sequence[Candidate]) -> str | None:
    """The hint at a bore or journal through the point with another direction, or a little beside it."""
    if axis is None:
        return None
    here = [each for each in offered if each.cylindrical and each.distance(point) <= each.radius]
    for each in here:
        name = f"a {each.kind} of radius {length(each.radius)}{_quoted(each)}"
        off = float(np.degrees(np.arccos(min(1.0, abs(float(each.direction @ axis))))))
        if STRAIGHT < off <= ASKEW:
            return f"{name} passes here, but its axis is {off:.2g} deg off: it is {shown(each.direction)}"
        if off <= STRAIGHT:
            return f"{name} is here, but its axis is {length(each.axis_distance(point))} beside the point"
    return None


def _listed(link: Link, offered: Sequence[Candidate], point: Vector) -> str | None:
    """The nearest cylinders and balls; the nearest plane face if there are none; else another face."""
    if round_ := [each for each in offered if each.kind not in {"plane face", "face"}]:
        text = ", ".join(f"{described(each)} {length(each.distance(point))} away" for each in round_[:MOST])
        more = len(round_) - MOST
        return f"it has {text}" + (f", and {more} more" if more > 0 else "")
    for kind in ("plane face", "face"):
        if faces := [each for each in offered if each.kind == kind]:
            apart, nearest = min(((distance(link.full or link, x, point), x) for x in faces), key=itemgetter(0))
            return f"its nearest face is the {described(nearest)}, {length(apart)} away"
    return None


def _advice(link: Link, offered: Sequence[Candidate]) -> str:
    if not link.meshed:
        return "move the joint onto the beam, or give the beam a point there"
    if any(each.cylindrical for each in offered):
        return "move the joint to one of these, or give the link a bore there"
    return "move the joint onto the link, or give the link a bore (a hole of its outline) there"


def described(each: Candidate) -> str:
    """A candidate in words: ``bore 'pin' of radius 6 mm about (0, 0, 1) at (0.1, 0, 0)``."""
    text = each.kind + _quoted(each)
    if np.isfinite(each.radius):
        text += f" of radius {length(each.radius)}"
    if np.isfinite(each.direction).all():
        text += f" {'about' if each.cylindrical else 'facing'} {shown(each.direction)}"
    return f"{text} at {shown(each.centre)}"


def _quoted(each: Candidate) -> str:
    return f" '{each.name}'" if each.name else ""


def length(x: float) -> str:
    """A length in metres, in millimetres if it is small."""
    return f"{1e3 * x:.4g} mm" if abs(x) < SMALL else f"{x:.4g} m"


def shown(x: Vector) -> str:
    """A point [m] or direction."""
    return "(" + ", ".join(f"{v:.6g}" for v in np.round(x, 12) + 0.0) + ")"


def in_link_plane(link: Link, point: Vector) -> Vector:
    """The projection of a point on the plane of a plane link; of other links the point itself."""
    return np.array([*point[:2], link.X[0, 2]]) if link.kind == "plane" else point
