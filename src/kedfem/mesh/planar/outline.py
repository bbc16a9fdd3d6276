"""Plane outlines of plates: straight and circular edges around an area, round holes in it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.scene.outlines import Arc, Profile

_STRAIGHT = (np.nan, np.nan)


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed plane outline and round holes inside it; checked by the scene, taken on trust here.

    Attributes
    ----------
    corners : (k, 2) [m]
        Ends of the edges in order; edge i runs from corner i to corner i+1, the last one back to the first.
    via : (k, 2) [m]
        A point between the ends of each circular edge; nan where the edge is straight.
    centres : (h, 2) [m]
        Centres of the holes.
    radii : (h,) [m]
        Radii of the holes.
    """

    corners: Float[np.ndarray, "k 2"]
    via: Float[np.ndarray, "k 2"]
    centres: Float[np.ndarray, "h 2"]
    radii: Float[np.ndarray, " h"]


@dataclass(frozen=True, slots=True)
class Circles:
    """The circles that edges lie on; straight edges have radius nan and turn 0.

    Attributes
    ----------
    centres : (k, 2) [m]
        Centres of the circles.
    radii : (k,) [m]
        Radii of the circles.
    turns : (k,) [rad]
        Angle from the start to the end of the edge, anticlockwise positive.
    lengths : (k,) [m]
        Lengths of the edges, straight ones too.
    """

    centres: Float[np.ndarray, "k 2"]
    radii: Float[np.ndarray, " k"]
    turns: Float[np.ndarray, " k"]
    lengths: Float[np.ndarray, " k"]


def profile_outline(profile: Profile) -> Outline:
    """The outline that a profile of the scene draws, in its own x and y."""
    ends = [item.to if isinstance(item, Arc) else item for item in profile.outline]
    via = [item.via[:2] if isinstance(item, Arc) else _STRAIGHT for item in profile.outline]
    corners = np.array([end[:2] for end in ends])
    edges = np.array(via[1:] + via[:1])  # an arc leads to its corner: it is the edge that starts one before
    if np.allclose(corners[0], corners[-1], rtol=0, atol=1e-9 * np.ptp(corners)):
        corners, edges = corners[:-1], edges[:-1]
    return Outline(
        corners,
        edges,
        np.array([hole.at[:2] for hole in profile.holes]).reshape(-1, 2),
        np.array([hole.diameter / 2 for hole in profile.holes]),
    )


def edge_circles(outline: Outline) -> Circles:
    """The circle through start, via and end of each edge."""
    start, end, via = outline.corners, np.roll(outline.corners, -1, axis=0), outline.via
    p, q = start - via, end - via
    square = np.stack([(p * p).sum(axis=1), (q * q).sum(axis=1)])
    twice_area = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
    offset = np.stack([q[:, 1] * square[0] - p[:, 1] * square[1], p[:, 0] * square[1] - q[:, 0] * square[0]])
    centres = via + (offset / (2 * twice_area)).T
    radii = np.linalg.norm(start - centres, axis=1)
    first, last = start - centres, end - centres
    turns = np.arctan2(first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0], (first * last).sum(axis=1))
    turns = np.where(twice_area < 0, turns % (2 * np.pi), -(-turns % (2 * np.pi)))
    lengths = np.where(np.isnan(radii), np.linalg.norm(end - start, axis=1), abs(turns) * radii)
    return Circles(centres, radii, np.nan_to_num(turns), lengths)


def outline_area(outline: Outline) -> float:
    """Area inside the outline less its holes [m²]: the polygon of the corners and the arcs' segments."""
    arcs = edge_circles(outline)
    start, end = outline.corners, np.roll(outline.corners, -1, axis=0)
    polygon = (start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]).sum() / 2
    segments = np.nansum(arcs.radii**2 * (arcs.turns - np.sin(arcs.turns))) / 2
    return float(abs(polygon + segments) - np.pi * (outline.radii**2).sum())


def smallest_width(outline: Outline) -> float:
    """The width that elements are counted across [m], the least of two.

    That of a strip with the same area and length of edge, and twice the least wall beside a hole.
    """
    perimeter = edge_circles(outline).lengths.sum() + 2 * np.pi * outline.radii.sum()
    walls = hole_walls(outline)
    return float(min([2 * outline_area(outline) / perimeter, *(2 * walls)]))


def hole_walls(outline: Outline) -> Float[np.ndarray, " h"]:
    """Least material beside each hole [m]: to the outline, and half of that to the next hole."""
    between = np.linalg.norm(outline.centres[:, None] - outline.centres, axis=2)
    between -= outline.radii[:, None] + outline.radii
    np.fill_diagonal(between, np.inf)
    edges = edge_distances(outline, outline.centres).min(axis=1, initial=np.inf)
    return np.asarray(np.minimum(edges - outline.radii, between.min(axis=1, initial=np.inf) / 2))


def edge_distances(outline: Outline, points: Float[np.ndarray, "p 2"]) -> Float[np.ndarray, "p k"]:
    """Distances of points from each edge of the outline [m]."""
    arcs = edge_circles(outline)
    start, along = outline.corners, np.roll(outline.corners, -1, axis=0) - outline.corners
    away = points[:, None] - start
    foot = np.clip((away * along).sum(axis=2) / (along * along).sum(axis=1), 0, 1)
    straight = np.linalg.norm(away - foot[..., None] * along, axis=2)
    ends = np.minimum(np.linalg.norm(away, axis=2), np.linalg.norm(away - along, axis=2))
    arm, first = points[:, None] - arcs.centres, start - arcs.centres
    angle = np.arctan2(first[:, 0] * arm[..., 1] - first[:, 1] * arm[..., 0], (first * arm).sum(axis=2))
    on_arc = (np.sign(arcs.turns) * angle) % (2 * np.pi) <= abs(arcs.turns)
    to_circle = abs(np.linalg.norm(arm, axis=2) - arcs.radii)
    return np.asarray(np.where(np.isnan(arcs.radii), straight, np.where(on_arc, to_circle, ends)))


def scaled_outline(outline: Outline, factor: float) -> Outline:
    """The outline with all lengths multiplied by a factor."""
    return Outline(
        outline.corners * factor, outline.via * factor, outline.centres * factor, outline.radii * factor
    )


def turned_outline(outline: Outline, origin: Float[np.ndarray, "2"], axis: Float[np.ndarray, "2"]) -> Outline:
    """The outline in a frame at `origin` [m] whose x runs along `axis`."""
    x = axis / np.linalg.norm(axis)
    to_frame = np.array([[x[0], -x[1]], [x[1], x[0]]])
    corners, via, centres = (
        (points - origin) @ to_frame for points in (outline.corners, outline.via, outline.centres)
    )
    return Outline(corners, via, centres, outline.radii)
