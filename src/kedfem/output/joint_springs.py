"""Shapes of a joint's springs in pictures: coils along slides, windings about hinges."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.joint_equations import coordinate_axis, ordered
from kedfem.output.springs import WIDTH, Shape, spring_shape, winding_shape
from kedfem.scene import Joint, LineSpring, Scene, SpringEnd, TorsionSpring

# in sizes of the mechanism: length of a coil along a slide in the reference position, largest radius inside a coil,
# and length along a hinge's axis from which a link is taken as a shaft
ALONG, ROUND, SHAFT = 0.2, 0.03, 0.25
MARGIN = 1.2  # length of such a coil over the travel to the limit that compresses it

Points = Float[np.ndarray, "n 3"]


@dataclass(frozen=True, slots=True)
class DrawnSpring:
    """A spring or damper between two points.

    ends : the points at which it is attached
    shape : its shape by :func:`spring_shape`
    """

    ends: tuple[SpringEnd, SpringEnd]
    shape: Shape

    @property
    def line(self) -> Float[np.ndarray, "3"]:
        """Vector from the first end to the second in the reference position [m]."""
        return np.subtract(self.ends[1].at, self.ends[0].at)


@dataclass(frozen=True, slots=True)
class DrawnWinding:
    """A spring or damper about a hinge, which rotates with one of its links.

    link, at : that link, and the joint's point
    shape : its shape around that point, in the reference position
    """

    link: str
    at: tuple[float, float, float]
    shape: Shape


def line_springs(scene: Scene, X: Mapping[str, Points], size: float) -> dict[str, DrawnSpring]:
    """Springs between two points and along slides, by name.

    Parameters
    ----------
    X : points of the drawn links in the reference position, by name [m]
    size : of the mechanism [m]
    """
    out = {}
    for name, spring in scene.springs.items():
        if isinstance(spring, TorsionSpring):
            continue
        ends, inner = (spring.between, 0.0) if spring.between else _along(scene, spring, X, size)
        between = spring.model_copy(update={"between": ends})
        out[name] = DrawnSpring(ends, spring_shape(between, size, inner))
    return out


def _along(
    scene: Scene, spring: LineSpring, X: Mapping[str, Points], size: float
) -> tuple[tuple[SpringEnd, SpringEnd], float]:
    """Ends of a spring along a slide, and the radius of what is inside it [m].

    One end is on the moving link (of a slot that with the pin) at the joint. The other end is on the other link, on the
    side from which a compressed spring would push as this one does.
    """
    joint = scene.joints[spring.joint or ""]
    link, other = ordered(joint)
    side = 1.0 if spring.free < 0.0 else -1.0
    stops = [x.range for x in scene.limits.values() if x.kind == "travel" and x.joint == spring.joint]
    lengths = [MARGIN * max(side * end for end in each) for each in stops]
    length = max([ALONG * size, *(each for each in lengths if np.isfinite(each))])
    axis = coordinate_axis(joint, along=spring.along)
    far = np.asarray(joint.at) + side * length * axis
    ends = SpringEnd(link=link, at=joint.at), SpringEnd(link=other, at=(far[0], far[1], far[2]))
    _, inner = _around(joint, axis, X, *sorted((0.0, side * length)))
    return ends, inner if inner < ROUND * size else 0.0


def hinge_springs(scene: Scene, X: Mapping[str, Points], size: float) -> dict[str, DrawnWinding]:
    """Springs about hinges, by name; parameters as of :func:`line_springs`."""
    out = {}
    for name, spring in scene.springs.items():
        if isinstance(spring, TorsionSpring):
            joint, radius, most = scene.joints[spring.joint], WIDTH * size, SHAFT * size
            axis = coordinate_axis(joint, spring.about)
            reach, _ = _around(joint, axis, X, -most, most, within=1.5 * radius)
            if reach == most:
                reach = ROUND * size
                inner = _around(joint, axis, X, -reach, reach)[1]
                radius = max(radius, MARGIN * inner if inner < reach else 0.0)
            shape = winding_shape(radius, reach + 0.4 * radius, axis)
            out[name] = DrawnWinding(ordered(joint, spring.about)[0], joint.at, shape)
    return out


def _around(
    joint: Joint, axis: Float[np.ndarray, "3"], X: Mapping[str, Points], low: float, high: float, within: float = np.inf
) -> tuple[float, float]:
    """Reach of a joint's links along an axis, and across it between two places on the axis, from the joint's point [m].

    Parameters
    ----------
    axis : (3,) unit vector
    low, high : the places; points beyond them are moved to them for the first result, and ignored for the second [m]
    within : largest distance from the axis of points for the first result, unless the nearest is farther [m]
    """
    points = np.concatenate([np.asarray(joint.at)[None], *(X[name] for name in joint.links if name in X)])
    arms = points - np.asarray(joint.at)
    along = arms @ axis
    across = np.linalg.norm(arms - along[:, None] * axis, axis=1)
    near = across <= max(within, across[1:].min(initial=np.inf) * 1.5 if len(across) > 1 else 0.0)
    reach = np.abs(along.clip(low, high)[near]).max()
    return float(reach), float(across[(along >= low) & (along <= high)].max())
