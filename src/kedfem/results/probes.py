"""Probes: what points of links do. Elastic and total motion, deflection of a link in its own frame, stress."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model, on_segment
from kedfem.errors import SceneError
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link, in_space
from kedfem.links.recovery import von_mises
from kedfem.motion.constraints import cross
from kedfem.motion.linkage import Linkage, linkage
from kedfem.results.recorded import Recorded, Rows
from kedfem.results.records import Channel
from kedfem.scene import ForceLoad, Probe, Scene, TorqueLoad

XYZ = ("x", "y", "z")
STRESS = ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises")
ELASTIC = {"displacement": "u", "velocity": "v", "acceleration": "a"}
UNITS = {"velocity": "m/s", "acceleration": "m/s^2", "total_velocity": "m/s", "total_acceleration": "m/s^2"}
ON_AXIS = 1e-6  # of a planar beam's size: farther beside its axis its state tells no displacement

Drawn = Float[np.ndarray, "3"]


@dataclass(frozen=True, slots=True)
class Followed:
    """A point of a link, as a run knows it.

    body, X : number of its link in the linkage, the point as drawn [m]
    elastic : δ, δ' or δ'' there by their letter, world components (T, 3)
    axes : (3, 3) of the link, as drawn
    planar : whether the link moves in a plane
    """

    body: int
    X: Drawn
    elastic: Callable[[Block, str], Rows]
    axes: Float[np.ndarray, "3 3"]
    planar: bool = False

    def position(self, block: Block) -> Rows:
        """R' = R + f, [KED, eqs. (2)(3)] [m]."""
        motion = block.motion
        return np.asarray(motion.p[:, self.body] + motion.R[:, self.body] @ self.X + self.elastic(block, "u"))

    def velocity(self, block: Block) -> Rows:
        """Of both motions together [m/s]."""
        motion, b = block.motion, self.body
        return np.asarray(
            motion.v[:, b] + cross(motion.omega[:, b], motion.R[:, b] @ self.X) + self.elastic(block, "v")
        )

    def acceleration(self, block: Block) -> Rows:
        """Of both motions together [m/s²]."""
        motion, b = block.motion, self.body
        return np.asarray(motion.p2[:, b] + motion.R2[:, b] @ self.X + self.elastic(block, "a"))


def probe_channels(scene: Scene, model: Model, linked: Linkage | None = None) -> list[Recorded]:
    """The channels of all probes.

    Parameters
    ----------
    linked : the scene's linkage, where that is at hand

    Raises
    ------
    SceneError
        If a point is not in its link.
    """
    if not scene.output.probes:
        return []
    linked = linked or linkage(scene)
    return [_channel(scene, model, linked, name, probe) for name, probe in scene.output.probes.items()]


def _channel(scene: Scene, model: Model, linked: Linkage, name: str, probe: Probe) -> Recorded:
    where = f"output.probes.{name}.at"
    if probe.quantity == "stress":
        return _stress(scene, model, where, name, probe)
    point = _followed(model, linked, where, probe.link, np.asarray(probe.at))
    if probe.quantity == "deflection":
        values, text = _deflection(scene, model, linked, name, probe, point)
    else:
        values, text = _motion(probe, point), _words(linked, probe)
    columns = XYZ[:2] if point.planar else XYZ
    unit, place = UNITS.get(probe.quantity, "m"), _place(probe.link, point.X)
    channel = Channel(f"probes/{name}/{probe.quantity}", columns, unit, str(probe.frame), f"{text} {place}")
    return Recorded(channel, lambda block: values(block)[:, : len(columns)])


def _place(link: str, X: Drawn) -> str:
    return f"of link {link} at ({', '.join(f'{round(x, 9) + 0.0:.6g}' for x in X)}) m as drawn"


def _words(linked: Linkage, probe: Probe) -> str:
    """What a probe of motion measures, and from where."""
    match probe.quantity:
        case "position":
            return "position"
        case "travel":
            return "displacement from the reference position"
        case "total_velocity" | "total_acceleration":
            return f"{probe.quantity.removeprefix('total_')}, rigid and elastic,"
        case quantity if linked.mobility:
            return f"{quantity}, from the rigid motion with the free motions held as drawn,"
        case quantity:
            return f"elastic {quantity}"


def _motion(probe: Probe, point: Followed) -> Callable[[Block], Rows]:
    """The values of a probe of elastic or total motion."""
    match probe.quantity:
        case "position":
            return point.position
        case "travel":
            return lambda block: point.position(block) - point.X
        case "total_velocity":
            return point.velocity
        case "total_acceleration":
            return point.acceleration
    field, turned = ELASTIC[probe.quantity], probe.frame == "link"

    def elastic(block: Block) -> Rows:
        x = point.elastic(block, field)
        if turned:
            x = (x[:, None] @ block.motion.R[:, point.body])[:, 0] @ point.axes
        return np.asarray(x)

    return elastic


def _followed(model: Model, linked: Linkage, where: str, name: str, at: Drawn) -> Followed:
    """A point of a link: elastic, rigid, prescribed by a drive, or a slider without a shape, which moves with a pin."""
    prescribed = next((x for x in model.carried if x.link.name == name), None)
    if prescribed is not None:
        link = prescribed.link
        return Followed(prescribed.body, at, _at_rest, link.axes, link.planar)
    slider = next((x for x in model.sliders if x.name == name), None)
    if slider is not None:
        moved = _read(slider.carrier, model.links[slider.carrier], slider.weights)
        planar = model.links[slider.carrier].planar
        return Followed(linked.bodies.index(name), at, moved, np.eye(3), planar)
    if all(link.name != name for link in model.links):
        raise SceneError(f"{where.removesuffix('.at')}.link: must name a link with a shape, got {name!r}")
    k, (value, X) = on_segment(model, name, at, lambda link: _value(link, where, at))
    link = model.links[k]
    return Followed(model.bodies[k], X, _read(k, link, value), link.axes, link.planar)


def _at_rest(block: Block, field: str) -> Rows:
    """The elastic motion of a rigid link that a drive prescribes."""
    del field
    return np.zeros((len(block), 3))


def _read(k: int, link: Link, value: Float[np.ndarray, " n"]) -> Callable[[Block, str], Rows]:
    """What link k's state means where its functions have given values."""
    nodes = np.flatnonzero(value)
    weights = value[nodes]

    def read(block: Block, field: str) -> Rows:
        return in_space(link, np.tensordot(getattr(block.links[k], field)[:, nodes], weights, (1, 0)))

    return read


def _value(link: Link, where: str, at: Drawn) -> tuple[Float[np.ndarray, " n"], Drawn]:
    """Values of a link's functions at a point, and the point itself; of a rigid link wherever it is."""
    if link.rigid:
        known = np.column_stack([link.one, link.X[:, :2] if link.planar else link.X])
        wanted = np.array([1.0, *at[: known.shape[1] - 1]])
        value = np.linalg.lstsq(known.T, wanted, rcond=1e-12)[0]
        X = np.array([*(value @ known)[1:], at[2]])[:3]
    else:
        found = point_rows(link, where, at)
        value, X = found.value, found.X
    beside = float(np.linalg.norm(X - at))
    if link.kind == "beam" and beside > ON_AXIS * link.size:
        got = f"got {beside:.3g} m beside it"
        raise SceneError(f"{where}: must lie on the axis of planar beam '{link.name}' for a motion, {got}")
    return value, X


def _deflection(
    scene: Scene, model: Model, linked: Linkage, name: str, probe: Probe, point: Followed
) -> tuple[Callable[[Block], Rows], str]:
    """Of a point in a frame that goes with its link: its chord, or its mean rigid motion, if it has no two joints."""
    chord = probe.chord or _farthest(scene, probe.link)
    frame = _mean_motion(model, probe.link)
    axes = point.axes if probe.frame == "link" else None
    if chord is None:

        def from_mean(block: Block) -> Rows:
            x, X, R = frame(block)
            return _seen(point.position(block) - x, R, point.X - X, axes)

        return from_mean, "deflection from the link's mean rigid motion,"
    where = f"output.probes.{name}.chord"
    first, second = (
        _followed(model, linked, f"{where}[{i}]", probe.link, np.asarray(P)) for i, P in enumerate(chord)
    )
    drawn = second.X - first.X

    def from_chord(block: Block) -> Rows:
        start = first.position(block)
        R = _along(frame(block)[2], drawn, second.position(block) - start)
        return _seen(point.position(block) - start, R, point.X - first.X, axes)

    ends = " to ".join(f"({', '.join(f'{round(x, 9) + 0.0:.6g}' for x in P.X)})" for P in (first, second))
    return from_chord, f"deflection from the chord {ends},"


def _farthest(scene: Scene, link: str) -> tuple[Drawn, Drawn] | None:
    """The two joints of a link that are farthest apart; None if it has no two at different points."""
    points = [np.asarray(joint.on(link)) for joint in scene.joints.values() if link in joint.links]
    pairs = [(P, Q) for i, P in enumerate(points) for Q in points[i + 1 :] if np.linalg.norm(P - Q) > 0]
    return max(pairs, key=lambda pair: float(np.linalg.norm(pair[1] - pair[0])), default=None)


def _seen(x: Rows, R: Float[np.ndarray, "T 3 3"], X: Drawn, axes: Float[np.ndarray, "3 3"] | None) -> Rows:
    """What x differs by from the rigid X, in axes that turn with the frame, or in the world's."""
    if axes is None:
        return np.asarray(x - R @ X)
    return np.asarray(((x[:, None] @ R)[:, 0] - X) @ axes)


def _along(R: Float[np.ndarray, "T 3 3"], drawn: Drawn, now: Rows) -> Float[np.ndarray, "T 3 3"]:
    """The orientations nearest to R that take a drawn chord to the direction that it has now."""
    a = R @ (drawn / np.linalg.norm(drawn))
    b = now / np.linalg.norm(now, axis=1)[:, None]
    half = a + b
    half /= np.linalg.norm(half, axis=1)[:, None]
    eye = np.eye(3)
    flip = 2 * half[:, :, None] * half[:, None, :] - eye  # half a turn about the middle of both
    turn = 2 * a[:, :, None] * a[:, None, :] - eye  # after half a turn about the first: the least turn
    return np.asarray(flip @ turn @ R)


def _mean_motion(
    model: Model, name: str
) -> Callable[[Block], tuple[Rows, Drawn, Float[np.ndarray, "T 3 3"]]]:
    """The rigid motion of least mean square distance, by mass: centre now and as drawn, orientation."""
    here = [(k, link, model.bodies[k]) for k, link in enumerate(model.links) if link.name == name]
    mass = sum(float(link.one @ link.m1[:, 0]) for _, link, _ in here)
    X = np.sum([link.one @ link.mX for _, link, _ in here], axis=0) / mass
    fits = [link.mX - np.outer(link.m1[:, 0], X) for _, link, _ in here]

    def moved(block: Block) -> tuple[Rows, Drawn, Float[np.ndarray, "T 3 3"]]:
        x, B = np.zeros((len(block), 3)), np.zeros((len(block), 3, 3))
        for (k, link, body), fit in zip(here, fits, strict=True):
            motion, u = block.motion, in_space(link, block.links[k].u)
            p, R = motion.p[:, body], motion.R[:, body]
            x += p * float(link.one @ link.m1[:, 0]) + R @ (link.one @ link.mX)
            x += np.tensordot(u, link.m1[:, 0], (1, 0))
            B += p[:, :, None] * (link.one @ fit) + R @ (link.X.T @ fit)
            B += np.einsum("tai,aj->tij", u, fit)
        return x / mass, X, _rotation(B, here[0][1].planar)

    return moved


def _rotation(B: Float[np.ndarray, "T 3 3"], planar: bool) -> Float[np.ndarray, "T 3 3"]:
    """The rotations nearest to matrices, of planar links about z."""
    if planar:
        angle = np.arctan2(B[:, 1, 0] - B[:, 0, 1], B[:, 0, 0] + B[:, 1, 1])
        out = np.tile(np.eye(3), (len(B), 1, 1))
        out[:, 0, 0] = out[:, 1, 1] = np.cos(angle)
        out[:, 1, 0] = np.sin(angle)
        out[:, 0, 1] = -out[:, 1, 0]
        return out
    U, _, Vt = np.linalg.svd(B)
    U[:, :, 2] *= np.linalg.det(U @ Vt)[:, None]
    return np.asarray(U @ Vt)


def _stress(scene: Scene, model: Model, where: str, name: str, probe: Probe) -> Recorded:
    drawn, kinks = np.asarray(probe.at), _kinks(scene, probe.link)
    k, at = on_segment(model, probe.link, drawn, lambda link: point_rows(link, where, drawn, kinks))
    dofs, dense = _compact(at.stress)

    def stress(block: Block) -> Rows:
        g = block.links[k].g
        s = g.reshape(len(g), -1)[:, dofs] @ dense.T
        return np.column_stack([s, von_mises(s)])

    text = f"stress {_place(probe.link, at.X)}"
    return Recorded(Channel(f"probes/{name}/stress", STRESS, "Pa", "link", text), stress)


def _kinks(scene: Scene, link: str) -> Float[np.ndarray, "_ 3"]:
    """Where single forces act on a link: its joints, bodies and loads at a point [m]."""
    joints = [joint.at for joint in scene.joints.values() if link in joint.links]
    bodies = [body.at for body in scene.bodies.values() if body.link == link]
    single = [x for x in scene.loads.values() if isinstance(x, ForceLoad | TorqueLoad) and x.link == link]
    forces = [load.at for load in single if load.at is not None]
    return np.array([*joints, *bodies, *forces]).reshape(-1, 3)


def _compact(matrix: sp.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """The columns that a matrix uses, and the matrix on them, dense."""
    columns = np.unique(matrix.indices)
    return columns, matrix[:, columns].toarray()
