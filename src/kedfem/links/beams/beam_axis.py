"""The axis of a beam in space: stations with the section's directions, along straight segments or a smooth curve."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.links.beams.beam import directions, is_closed, line_cells, node_places


@dataclass(frozen=True, slots=True)
class Axis:
    """Stations of an axis: its nodes; a node at a corner has one station for each segment that meets there.

    frame : (s, 4, 3) position [m], tangent, directions of the section's y and z
    node : (s,) number of each station's node, ascending; the last of a closed line is the first again
    cells : (e, m) stations of each element, ends first
    rigid_node : (k,) whether a node has a full affine field, as at ends and corners
    up : direction to which the section's z is as close as possible; None: as `line_axes` chooses
    """

    frame: Float[np.ndarray, "s 4 3"]
    node: Int[np.ndarray, " s"]
    cells: Int[np.ndarray, "e m"]
    rigid_node: Bool[np.ndarray, " k"]
    up: Float[np.ndarray, "3"] | None = None


def straight_axis(points: Float[np.ndarray, "p 3"], elements: int, nodes: int, up: Float[np.ndarray, "3"] | None) -> Axis:
    """Straight segments between points, each with directions of its own.

    Parameters
    ----------
    elements : per segment
    nodes : per element
    up : direction to which the section's z is as close as possible; None: as `line_axes` chooses
    """
    steps = elements * (nodes - 1)
    along = node_places(elements, nodes)[:, None] / elements
    segments = []
    for P, Q in pairwise(points):
        frame = np.empty((steps + 1, 4, 3))
        frame[:, 0] = P + along * (Q - P)
        frame[:, 1:] = directions(Q - P, up)
        segments.append(frame)
    count = len(segments)
    node = (steps * np.arange(count)[:, None] + np.arange(steps + 1)).ravel()
    first = ((steps + 1) * np.arange(count)[:, None] + (nodes - 1) * np.arange(elements)).ravel()
    many = count * steps + (not is_closed(points))
    rigid_node = np.arange(many) % steps == 0
    return Axis(np.concatenate(segments), node % many, line_cells(first, nodes), rigid_node, up)


def smooth_axis(points: Float[np.ndarray, "p 3"], elements: int, nodes: int, up: Float[np.ndarray, "3"] | None) -> Axis:
    """A cubic spline through points; the section's directions are transported along it without rotation about it.

    Parameters
    ----------
    elements : between neighbouring points
    nodes : per element
    up : direction to which the section's z at the first point is as close as possible; None: as `line_axes` chooses
    """
    chord = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(chord, points)
    steps = elements * (nodes - 1)
    number = np.arange((len(points) - 1) * steps + 1)
    s = np.interp(node_places((len(points) - 1) * elements, nodes) / elements, np.arange(len(points)), chord)
    frame = np.empty((len(s), 4, 3))
    frame[:, 0] = curve(s)
    tangent = curve(s, 1)
    frame[:, 1] = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    frame[0, 1:] = directions(frame[0, 1], up)
    for k in range(1, len(s)):
        frame[k, 2] = transported(frame[k - 1, 2], frame[k - 1, 1], frame[k, 1])
        frame[k, 3] = np.cross(frame[k, 1], frame[k, 2])
    return Axis(frame, number, line_cells(number[: -1 : nodes - 1], nodes), number % steps == 0, up)


def transported(
    v: Float[np.ndarray, "3"], before: Float[np.ndarray, "3"], after: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"]:
    """A direction after parallel transport: the smallest rotation that takes one tangent into the next."""
    turned = v - (v @ after) / (1 + before @ after) * (before + after)
    turned -= (turned @ after) * after
    return np.asarray(turned / np.linalg.norm(turned))
