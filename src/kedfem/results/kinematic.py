"""Channels of the rigid motion: links, points, coordinates of joints, transmission angles."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.inertias import Inertias
from kedfem.motion.coordinates import Coordinate, coordinates, unwrapped
from kedfem.motion.joint_equations import GROUND
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.released_motions import components
from kedfem.motion.rigid import RigidMotion
from kedfem.motion.transmission import Transmission, transmissions
from kedfem.results.channels import XYZ, Channel
from kedfem.results.forces.rigid import reported_link
from kedfem.results.recorded import Rows
from kedfem.scene import Scene

FLAT = 1e-9  # of the fastest rotation: smaller out-of-plane components are rounding
RATES = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
TRANSMISSION = "/transmission_angle"
TURNS = (("angular_velocity", "rad/s", "omega"), ("angular_acceleration", "rad/s^2", "alpha"))


@dataclass(slots=True)
class Kinematics:
    """All channels of a rigid motion, block after block; angles are counted on from block to block."""

    every: list[tuple[Channel, Callable[[RigidMotion], Rows]]]
    coordinates: list[Coordinate]
    transmissions: list[Transmission]
    _turning: list[str] = field(default_factory=list)
    _last: dict[str, Float[np.ndarray, " c"]] = field(default_factory=dict)

    def rows(self, motion: RigidMotion) -> dict[str, Rows]:
        """The rows of all channels; blocks in the order of time."""
        out = {}
        for channel, values in self.every:
            x = values(motion)
            if channel.name in self._turning:
                x = unwrapped(x, self._last.get(channel.name))
                self._last[channel.name] = x[-1]
            out[channel.name] = x
        return out


def kinematics_of(scene: Scene, linkage: Linkage, along: Path, inertias: Inertias) -> Kinematics:
    """The channels of a scene's rigid motion."""
    normal = plane_normal(along)
    every: list[tuple[Channel, Callable[[RigidMotion], Rows]]] = []
    for name in scene.links:
        body = linkage.bodies.index(name)
        centre = inertias.centre_of(body)
        first = next(joint.at for joint in scene.joints.values() if name in joint.links)
        at = np.asarray(first if centre is None else centre)
        what = "joint" if centre is None else "centre of mass"
        every += _point(f"links/{name}", body, at, f"of the {what} of link {name}")
        every += _orientation(name, body, normal)
    for name, joint in scene.joints.items():
        if GROUND not in joint.links:
            link = reported_link(scene, joint)
            text = f"of joint {name} on link {link}"
            every += _point(f"joints/{name}", linkage.bodies.index(link), np.asarray(joint.at), text)
    for name, probe in scene.output.probes.items():
        text = f"of probe {name} on link {probe.link}"
        every += _point(f"probes/{name}", linkage.bodies.index(probe.link), np.asarray(probe.at), text)
    joints, couplers = coordinates(scene, linkage), transmissions(scene, linkage)
    every += [coordinate_channel(each, linkage) for each in joints]
    every += [_transmission(each) for each in couplers]
    turning = [
        channel.name for channel, _ in every
        if channel.columns == ("angle",) and channel.unit == "rad" and not channel.name.endswith(TRANSMISSION)
    ]  # fmt: skip
    return Kinematics(every, joints, couplers, turning)


def plane_normal(along: Path) -> Float[np.ndarray, "3"] | None:
    """The normal of the plane in which all links move; None if they move in space."""
    v, omega = along.first
    flat = omega.reshape(-1, 3)
    size = np.linalg.norm(flat, axis=1)
    if not size.max(initial=0.0) > 0:
        return None
    n = flat[size.argmax()] / size.max()
    n = n * np.sign(n[np.abs(n).argmax()])
    turns = np.abs(flat - np.outer(flat @ n, n)).max() <= FLAT * size.max()
    return n if turns and np.abs(v @ n).max() <= FLAT * max(np.abs(v).max(), 1e-300) else None


def _point(
    key: str, body: int, at: Float[np.ndarray, "3"], text: str
) -> list[tuple[Channel, Callable[[RigidMotion], Rows]]]:
    """Position, velocity and acceleration of a point of a body, in the reference position."""

    def rows(name: str, motion: RigidMotion) -> Rows:
        return np.asarray(getattr(motion, name)(body, at))

    return [
        (Channel(f"{key}/{name}", XYZ, unit, "world", f"{name} {text}"), partial(rows, name))
        for name, unit in RATES.items()
    ]


def _orientation(
    name: str, body: int, normal: Float[np.ndarray, "3"] | None
) -> list[tuple[Channel, Callable[[RigidMotion], Rows]]]:
    """Orientation of a link and its rates: about the normal of the plane of motion, or in space."""
    text, key, turn = f"of link {name}", f"links/{name}", None
    what, frame = "rotation vector", "world"
    angles: tuple[str, ...] = XYZ
    rates: tuple[str, ...] = XYZ
    if normal is not None:
        mark = np.eye(3)[np.abs(normal).argmin()]
        turn = Coordinate("", "angle", "angle", body, 0, np.zeros(3), normal, mark - (mark @ normal) * normal)
        what, frame, angles, rates = "turn", "", ("angle",), ("rate",)
        text += f" about {components(normal)}"

    def turned(motion: RigidMotion) -> Rows:
        from scipy.spatial.transform import Rotation

        if turn is not None:
            return turn.values(motion)[:, None]
        return np.asarray(Rotation.from_matrix(motion.R[:, body]).as_rotvec())

    def rate(of: str, motion: RigidMotion) -> Rows:
        vector = getattr(motion, of)[:, body]
        return np.asarray(vector if normal is None else (vector @ normal)[:, None])

    rotation = Channel(f"{key}/rotation", angles, "rad", frame, f"{what} {text} from the reference position")
    return [(rotation, turned)] + [
        (Channel(f"{key}/{word}", rates, unit, frame, f"{word.replace('_', ' ')} {text}"), partial(rate, of))
        for word, unit, of in TURNS
    ]


def coordinate_channel(each: Coordinate, linkage: Linkage) -> tuple[Channel, Callable[[RigidMotion], Rows]]:
    """The channel of a joint's coordinate, and its values of a rigid motion."""
    one, other = linkage.bodies[each.body], linkage.bodies[each.other]
    column, unit = ("angle", "rad") if each.kind == "angle" else ("travel", "m")
    verb = "turn" if each.kind == "angle" else "travel"
    text = f"{verb} of joint {each.joint}: link {one} against {other}, from the reference position"
    if each.name.startswith("travel_"):  # of a planar joint, whose axis does not say along what
        text += f", along {components(each.axis, form='.4g')} there"
    channel = Channel(f"joints/{each.joint}/{each.name}", (column,), unit, "", text)
    return channel, lambda motion: each.values(motion)[:, None]


def transmission_key(coupler: str) -> str:
    """Name of the channel of a coupler's transmission angle."""
    return f"links/{coupler}{TRANSMISSION}"


def _transmission(each: Transmission) -> tuple[Channel, Callable[[RigidMotion], Rows]]:
    text = f"transmission angle of link {each.coupler} on {each.driven}"
    channel = Channel(transmission_key(each.coupler), ("angle",), "rad", "", text)
    return channel, lambda motion: each.angle(motion)[:, None]
