"""Deflection of a point from a line between two others, and the mean rigid motion of a link."""

from collections.abc import Callable

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.links.record import in_space
from kedfem.motion.linkage import Linkage
from kedfem.motion.released_motions import components
from kedfem.results.link_points import LinkPoint, Point, link_point, seen_from
from kedfem.results.recorded import Rows
from kedfem.scene import Probe, Scene
from kedfem.vectors import nearest_rotations


def deflection(
    scene: Scene, model: Model, linked: Linkage, name: str, probe: Probe, point: LinkPoint
) -> tuple[Callable[[Block], Rows], str]:
    """Deflection of a point in the frame of its link: the chord, or the mean rigid motion if it has no two joints."""
    chord = probe.chord or _farthest(scene, probe.link)
    frame = _mean_motion(model, probe.link)
    axes = point.axes if probe.frame == "link" else None
    if chord is None:

        def from_mean(block: Block) -> Rows:
            x, X, R = frame(block)
            return seen_from(point.position(block) - x, R, point.X - X, axes)

        return from_mean, "deflection from the link's mean rigid motion,"
    where = f"output.probes.{name}.chord"
    drawn_ends = [(f"{where}[{i}]", np.asarray(P)) for i, P in enumerate(chord)]
    first, second = (link_point(model, linked, at, probe.link, P) for at, P in drawn_ends)
    drawn = second.X - first.X

    def from_chord(block: Block) -> Rows:
        start = first.position(block)
        R = _along(frame(block)[2], drawn, second.position(block) - start)
        return seen_from(point.position(block) - start, R, point.X - first.X, axes)

    ends = " to ".join(components(P.X, form=".6g") for P in (first, second))
    return from_chord, f"deflection from the chord {ends},"


def _farthest(scene: Scene, link: str) -> tuple[Point, Point] | None:
    """The two joints of a link that are farthest apart; None if it has no two at different points."""
    points = [np.asarray(joint.on(link)) for joint in scene.joints.values() if link in joint.links]
    pairs = [(P, Q) for i, P in enumerate(points) for Q in points[i + 1 :] if np.linalg.norm(P - Q) > 0]
    return max(pairs, key=lambda pair: float(np.linalg.norm(pair[1] - pair[0])), default=None)


def _along(R: Float[np.ndarray, "T 3 3"], drawn: Point, now: Rows) -> Float[np.ndarray, "T 3 3"]:
    """The orientations nearest to R that take a chord from its reference direction to its present one."""
    a = R @ (drawn / np.linalg.norm(drawn))
    b = now / np.linalg.norm(now, axis=1)[:, None]
    half = a + b
    half /= np.linalg.norm(half, axis=1)[:, None]
    eye = np.eye(3)
    flip = 2 * half[:, :, None] * half[:, None, :] - eye  # half a revolution about the middle of both
    turn = 2 * a[:, :, None] * a[:, None, :] - eye  # after half a revolution about the first: the least turn
    return np.asarray(flip @ turn @ R)


def _mean_motion(model: Model, name: str) -> Callable[[Block], tuple[Rows, Point, Float[np.ndarray, "T 3 3"]]]:
    """The rigid motion of least mean square distance, by mass: centre now and in the reference position, orientation."""
    here = [(k, link, model.bodies[k]) for k, link in enumerate(model.links) if link.name == name]
    mass = sum(float(link.one @ link.m1[:, 0]) for _, link, _ in here)
    X = np.sum([link.one @ link.mX for _, link, _ in here], axis=0) / mass
    fits = [link.mX - np.outer(link.m1[:, 0], X) for _, link, _ in here]

    def moved(block: Block) -> tuple[Rows, Point, Float[np.ndarray, "T 3 3"]]:
        x, B = np.zeros((len(block), 3)), np.zeros((len(block), 3, 3))
        for (k, link, body), fit in zip(here, fits, strict=True):
            motion, u = block.motion, in_space(link, block.links[k].u)
            p, R = motion.p[:, body], motion.R[:, body]
            x += p * float(link.one @ link.m1[:, 0]) + R @ (link.one @ link.mX)
            x += np.tensordot(u, link.m1[:, 0], (1, 0))
            B += p[:, :, None] * (link.one @ fit) + R @ (link.X.T @ fit)
            B += np.einsum("tai,aj->tij", u, fit)
        return x / mass, X, nearest_rotations(B, here[0][1].planar)

    return moved
