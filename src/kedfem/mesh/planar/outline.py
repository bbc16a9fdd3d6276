"""Plane outlines of plates: straight and circular edges around an area, round holes in it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.scene.records.outlines import Arc, Profile

_STRAIGHT = (np.nan, np.nan)


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed plane outline and round holes inside it; checked by the scene, taken on trust here.

    corners : (k, 2) ends of the edges in order [m]; edge i runs from corner i to corner i+1, the last one back to the
        first
    via : (k, 2) a point between the ends of each circular edge [m]; nan where the edge is straight
    centres : (h, 2) centres of the holes [m]
    radii : (h,) radii of the holes [m]
    """

    corners: Float[np.ndarray, "k 2"]
    via: Float[np.ndarray, "k 2"]
    centres: Float[np.ndarray, "h 2"]
    radii: Float[np.ndarray, " h"]


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


def turned_outline(outline: Outline, origin: Float[np.ndarray, "2"], axis: Float[np.ndarray, "2"]) -> Outline:
    """The outline in a frame at `origin` [m] whose x runs along `axis`."""
    x = axis / np.linalg.norm(axis)
    to_frame = np.array([[x[0], -x[1]], [x[1], x[0]]])
    corners, via, centres = (
        (points - origin) @ to_frame for points in (outline.corners, outline.via, outline.centres)
    )
    return Outline(corners, via, centres, outline.radii)
