"""Points of links over a run: position, velocity, acceleration and elastic state."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.places import on_part
from kedfem.dynamics.model import Model
from kedfem.errors import SceneError
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link, in_space
from kedfem.motion.linkage import Linkage
from kedfem.results.recorded import Rows

HELD = 1e-6  # of a link's size: a point that near to a joint's point is that point
Point = Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class LinkPoint:
    """A point of a link in a run.

    body, X : number of its link in the linkage, the point in the reference position [m]
    elastic : δ, δ' or δ'' there by their letter, world components (T, 3)
    axes : (3, 3) of the link, in the reference position
    planar : whether the link moves in a plane
    """

    body: int
    X: Point
    elastic: Callable[[Block, str], Rows]
    axes: Float[np.ndarray, "3 3"]
    planar: bool = False

    def position(self, block: Block) -> Rows:
        """R' = R + f, [KED, eqs. (2)(3)] [m]."""
        return np.asarray(block.motion.position(self.body, self.X) + self.elastic(block, "u"))

    def velocity(self, block: Block) -> Rows:
        """Velocity of rigid and elastic motion together [m/s]."""
        return np.asarray(block.motion.velocity(self.body, self.X) + self.elastic(block, "v"))

    def acceleration(self, block: Block) -> Rows:
        """Acceleration of rigid and elastic motion together [m/s²]."""
        return np.asarray(block.motion.acceleration(self.body, self.X) + self.elastic(block, "a"))


def link_point(model: Model, linked: Linkage, where: str, name: str, at: Point) -> LinkPoint:
    """A point of a link: elastic, rigid or prescribed by a drive."""
    prescribed = next((x for x in model.prescribed if x.link.name == name), None)
    if prescribed is not None:
        link = prescribed.link
        return LinkPoint(prescribed.body, at, lambda block, _: np.zeros((len(block), 3)), link.axes, link.planar)
    if all(link.name != name for link in model.links):
        raise SceneError(f"{where.removesuffix('.at')}.link: must name a link with a shape, got {name!r}")
    try:
        k, (value, X) = on_part(dict(enumerate(model.links)), name, at, lambda link: _value(link, where, at))
    except SceneError:
        held = _held(model, name, at)
        if held is None:
            raise
        k, value, X = *held, at
    link = model.links[k]
    return LinkPoint(model.bodies[k], X, _read(k, link, value), link.axes, link.planar)


def _held(model: Model, name: str, at: Point) -> tuple[int, Float[np.ndarray, " n"]] | None:
    """The link or segment with a joint's coupling surface about a point, and weights of its functions in the mean motion
    there; None without such a joint."""
    for k, (link, joint) in enumerate(zip(model.links, model.joints, strict=True)):
        for each in dict.fromkeys(joint.joints) if link.name == name else ():
            ports = np.flatnonzero(np.array(joint.joints) == each)
            known = np.column_stack([np.ones(len(ports)), joint.points[ports] / link.size])
            wanted = np.array([1.0, *at / link.size])
            share = np.linalg.lstsq(known.T, wanted, rcond=HELD)[0]
            if np.abs(share @ known - wanted).max() <= HELD and share.min() >= -HELD:  # between the ports
                value = np.zeros(link.n)
                value[joint.nodes] = share @ joint.weights[ports]
                return k, value
    return None


def _read(k: int, link: Link, value: Float[np.ndarray, " n"]) -> Callable[[Block, str], Rows]:
    """The state of link k at a point with given values of its functions."""
    nodes = np.flatnonzero(value)
    weights = value[nodes]

    def read(block: Block, field: str) -> Rows:
        return in_space(link, np.tensordot(getattr(block.links[k], field)[:, nodes], weights, (1, 0)))

    return read


def _value(link: Link, where: str, at: Point) -> tuple[Float[np.ndarray, " n"], Point]:
    """Values of a link's functions at a point, and the point itself; of a rigid link wherever it is."""
    if link.rigid:
        known = np.column_stack([link.one, link.X[:, :2] if link.planar else link.X])
        wanted = np.array([1.0, *at[: known.shape[1] - 1]])
        value = np.linalg.lstsq(known.T, wanted, rcond=1e-12)[0]
        X = np.array([*(value @ known)[1:], at[2]])[:3]
    else:
        found = point_rows(link, where, at)
        value, X = found.value, found.X
    require_on_axis(link, where, at, X, "planar beam", " for a motion")
    return value, X


def seen_from(x: Rows, R: Float[np.ndarray, "T 3 3"], X: Point, axes: Float[np.ndarray, "3 3"] | None) -> Rows:
    """Difference of x from the rigid X, in axes that rotate with the frame, or in the world's."""
    if axes is None:
        return np.asarray(x - R @ X)
    return np.asarray(((x[:, None] @ R)[:, 0] - X) @ axes)
