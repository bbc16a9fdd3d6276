"""Shapes of springs and dampers: coils and cylinders between two ends, windings about hinges."""

import math

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.newton import cross_matrix
from kedfem.scene import LineSpring

WIDTH = 0.012  # radius of a coil, in sizes of the mechanism
SLENDER = 0.15  # largest ratio of that radius to the distance of the ends in the reference position
WIRE = 0.2  # radius of the wire, in radii of the coil
TURNS, AROUND, STRAIGHT = 6, 12, 0.15  # turns, points on each, share of the straight part at each end
RIM = 5  # points around a wire
# places along a damper in lengths, and radii there in radii of the coil
DAMPER = np.array([[0, 0.2], [0.3, 0.2], [0.3, 0.65], [0.65, 0.65], [0.65, 0.12], [1, 0.12]])
SIDES = 12
# about a hinge: least and most turns, pitch in radii, turns of the spirals at both ends
WINDINGS, PITCH, CLOSING = (3, 12), 1.2, 1.5

Shape = tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e 4"]]


def spring_shape(spring: LineSpring, size: float, inner: float = 0.0) -> Shape:
    """Points and quadrilaterals of a spring's surface.

    Parameters
    ----------
    size : of the mechanism [m]
    inner : least inner radius of the coil [m]

    Returns
    -------
    points : (n, 3) x and y across [m], z from the first end (0) to the second (1) [-]
    cells : (e, 4) quadrilaterals
    """
    length = math.dist(*(end.at for end in spring.between)) if spring.between else 0.0
    radius = min(WIDTH * size, SLENDER * length) if length else WIDTH * size
    radius = max(radius, inner / (1 - 2 * WIRE))
    parts, force = [], spring.force
    if spring.stiffness or force is not None:
        parts.append(_coil(radius, length or radius / SLENDER))
    if spring.damping or (force is not None and force.over == "speed"):
        parts.append(_damper(radius))
    first = np.cumsum([0, *(len(points) for points, _ in parts)])
    cells = [of + n for (_, of), n in zip(parts, first, strict=False)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(cells)


def stretched(
    points: Float[np.ndarray, "n 3"], drawn: Float[np.ndarray, "3"], ends: Float[np.ndarray, "2 3"]
) -> Float[np.ndarray, "n 3"]:
    """Points of :func:`spring_shape` between two ends.

    Parameters
    ----------
    drawn : (3,) vector from the first end to the second in the reference position [m], from which the coil is rotated
    ends : (2, 3) the ends [m]
    """
    a, b = ends
    z = _direction(drawn, np.array([0.0, 0.0, 1.0]))
    x, y = perpendiculars(z)
    turn = _least_rotation(z, _direction(b - a, z))
    return np.asarray(a + points[:, 2:] * (b - a) + points[:, :2] @ np.array([turn @ x, turn @ y]))


def _direction(d: Float[np.ndarray, "3"], otherwise: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    length = float(np.linalg.norm(d))
    return d / length if length else otherwise


def _least_rotation(z: Float[np.ndarray, "3"], d: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The smallest rotation that takes one unit vector to another."""
    c, v = float(z @ d), np.cross(z, d)
    if c < -1.0 + 1e-9:  # opposite: half a turn about any axis across
        e = perpendiculars(z)[0]
        return 2 * np.outer(e, e) - np.eye(3)
    V = cross_matrix(v)
    return np.asarray(np.eye(3) + V + V @ V / (1.0 + c))


def winding_shape(radius: float, half: float, axis: Float[np.ndarray, "3"]) -> Shape:
    """A spring about a hinge, around its point: a wire that winds along the axis, with a spiral at either end.

    Parameters
    ----------
    radius : of its middle line [m]
    half : half of its length along the axis [m]
    axis : (3,) unit vector
    """
    count, turns = int(AROUND * CLOSING), int(np.clip(2 * half / (PITCH * radius), *WINDINGS))
    grows, whole = np.linspace(0.2, 1, count, endpoint=False), np.ones(AROUND * turns + 1)
    r = radius * np.concatenate([grows, whole, grows[::-1]])
    z = half * np.concatenate([-np.ones(count), np.linspace(-1, 1, len(whole)), np.ones(count)])
    turn = 2 * np.pi * np.arange(len(r)) / AROUND
    x, y = perpendiculars(axis)
    points, cells = _wire(np.column_stack([r * np.cos(turn), r * np.sin(turn), z]), WIRE * radius)
    return points @ np.array([x, y, axis]), cells


def _coil(radius: float, length: float) -> Shape:
    """A wire that winds about the z axis, with its ends on the axis."""
    r, wire = radius * (1 - WIRE), WIRE * radius
    t = np.linspace(0, 1, TURNS * AROUND + 1)
    turn = 2 * np.pi * TURNS * t
    winding = np.column_stack([r * np.cos(turn), r * np.sin(turn), STRAIGHT + (1 - 2 * STRAIGHT) * t])
    start, end = [[0, 0, 0], [0, 0, STRAIGHT]], [[0, 0, 1 - STRAIGHT], [0, 0, 1]]
    points, cells = _wire(np.concatenate([start, winding, end]) * [1, 1, length], wire)
    return points / [1, 1, length], cells


def _wire(line: Float[np.ndarray, "w 3"], wire: float) -> Shape:
    """The surface of a wire of radius `wire` [m] about a line that winds about z and ends on or near z."""
    along = np.gradient(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    outwards, far = line * [1, 1, 0], np.linalg.norm(line[:, :2], axis=1)
    outwards[far == 0] = [1, 0, 0]
    across = outwards - (outwards * along).sum(axis=1, keepdims=True) * along
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    angle = 2 * np.pi * np.arange(RIM) / RIM
    rim = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * np.cross(along, across)[:, None]
    return (line[:, None] + wire * rim).reshape(-1, 3), _sides(len(line), RIM)


def _damper(radius: float) -> Shape:
    """A cylinder with its rod, about the z axis."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    rims = [np.column_stack([radius * r * ring, np.full(SIDES, z)]) for z, r in DAMPER]
    return np.concatenate(rims), _sides(len(DAMPER), SIDES)


def _sides(rims: int, corners: int) -> Int[np.ndarray, "e 4"]:
    """Quadrilaterals between rims of `corners` points."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(rims - 1), np.arange(corners), indexing="ij"))
    a, b = i * corners + j, i * corners + (j + 1) % corners
    return np.column_stack([a, b, b + corners, a + corners])
