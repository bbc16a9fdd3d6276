"""Joints as shared port points: W u = B z with constant scalar weights W and a constant selection B.

Weights commute with rotation, so joints hold for displacement, velocity and acceleration at once.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.seats import Seat, holds, joint_seat, port_weights
from kedfem.motion.linkage import GROUND, unit
from kedfem.motion.rows import perpendiculars
from kedfem.scene import Joint, Scene


@dataclass(frozen=True, slots=True)
class Attachment:
    """One link's share in the joints.

    nodes, weights : (b,) and (p, b): scalar port weights W of the nodes that carry any
    points : (p, 3) port points, reference position [m]
    joints : (p,) name of each port's joint
    keep : (q,) which of the flattened (p, 3) components are held; closed under the link's rotation
    B : (q, k) held components, in world axes, from the interface unknowns z
    """

    nodes: Int[np.ndarray, " b"]
    weights: Float[np.ndarray, "p b"]
    points: Float[np.ndarray, "p 3"]
    joints: tuple[str, ...]
    keep: Int[np.ndarray, " q"]
    B: Float[np.ndarray, "q k"]


@dataclass
class _Ports:
    """Ports of one link while they are collected."""

    weights: list[np.ndarray] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    keep: list[int] = field(default_factory=list)
    selection: list[tuple[int, np.ndarray]] = field(
        default_factory=list
    )  # first unknown, (components, unknowns)

    def add(
        self,
        weights: np.ndarray,
        point: np.ndarray,
        joint: str,
        held: list[int],
        first: int,
        block: np.ndarray,
    ) -> None:
        self.keep.extend(3 * len(self.weights) + c for c in held)
        self.weights.append(weights)
        self.points.append(point)
        self.joints.append(joint)
        self.selection.append((first, block))

    def attachment(self, link: Link, unknowns: int) -> Attachment:
        if not self.weights:
            none = np.zeros(0, int)
            return Attachment(none, np.zeros((0, 0)), np.zeros((0, 3)), (), none, np.zeros((0, unknowns)))
        B = np.zeros((len(self.keep), unknowns))
        row = 0
        for first, block in self.selection:
            B[row : row + block.shape[0], first : first + block.shape[1]] = block
            row += block.shape[0]
        W = np.array(self.weights)
        nodes = np.flatnonzero(W.any(axis=0))
        return Attachment(
            nodes, W[:, nodes], np.array(self.points), tuple(self.joints), np.array(self.keep), B
        )


def attachments(scene: Scene, links: dict[str, Link]) -> dict[str, Attachment]:
    """All joints of a scene as attachments of its elastic links.

    Raises
    ------
    MeshError
        If a joint finds no bore, face or node on one of its links.
    """
    ports = {name: _Ports() for name in links}
    sliders = {name: axis for name in scene.links if (axis := slider_axis(scene, name)) is not None}
    first_of: dict[str, int] = {name: k for k, name in enumerate(sliders)}
    unknowns = len(sliders)
    for name, joint in scene.joints.items():
        held = [link for link in joint.links if link in links]
        seats = {link: seat_of(scene, name, links[link]) for link in held}
        others = [link for link in joint.links if link not in links]
        points = port_points(scene, name, joint, seats, links) if held else np.zeros((0, 3))
        for point in points:
            components = _components(scene, name, joint, links[held[0]])
            first, block, new = _target(joint, others, sliders, first_of, unknowns, components)
            for link in held:
                weights = port_weights(seats[link], point[None, :])[0]
                ports[link].add(weights, point, name, components, first, block)
            unknowns += new
    return {name: ports[name].attachment(links[name], unknowns) for name in links}


def slider_axis(scene: Scene, name: str) -> Float[np.ndarray, "3"] | None:
    """Direction in which a rigid slider can move; None if the link is not one."""
    if scene.links[name].fidelity != "rigid":
        return None
    joint = next(j for j in scene.joints.values() if j.kind == "prismatic" and name in j.links)
    return unit(joint.axis or (0.0, 0.0, 1.0))


def seat_of(scene: Scene, name: str, link: Link) -> Seat:
    """The seat of a joint on a link."""
    joint = scene.joints[name]
    axis = None if joint.axis is None or joint.kind == "prismatic" else unit(joint.axis)
    return joint_seat(link, f"joints.{name}", np.asarray(joint.at), axis)


def port_points(
    scene: Scene, name: str, joint: Joint, seats: dict[str, Seat], links: dict[str, Link]
) -> Float[np.ndarray, "p 3"]:
    """Points of a joint that its links share: 1 spherical, 2 revolute, 3 where turning is held too.

    Raises
    ------
    MeshError
        If a flat seat cannot hold a point outside its plane.
    """
    at = np.asarray(joint.at)
    if any(links[link].kind == "beam" for link in seats) or joint.kind == "spherical":
        return at[None, :]
    seat = next(iter(seats.values()))
    driven = scene.drive is not None and scene.drive.joint == name
    if joint.kind == "revolute":
        axis = unit(joint.axis or (0.0, 0.0, 1.0))
        half = np.mean([np.sqrt(3) * _spread_along(s, axis) for s in seats.values()]) / 2
        centre = at + np.mean([(s.origin - at) @ axis for s in seats.values()]) * axis
        across = _widest_across(seat, axis)
        directions = [axis, across] if driven else [axis]
        points = [centre + half * axis, centre - half * axis]
        points += [centre + 2 * float(_spread_along(seat, across)) * across] if driven else []
    else:
        e1, e2 = seat.directions[:2]
        directions = [e1, e2]
        points = [seat.origin + seat.spread[0] * e1 * c + seat.spread[1] * e2 * s
                  for c, s in ((1, 0), (-0.5, 0.9), (-0.5, -0.9))]  # fmt: skip
    for link, s in seats.items():
        if not all(holds(s, d) for d in directions):
            raise MeshError(
                f"joints.{name}: must sit on a bore of link '{link}', or on a flat face that contains its axis, "
                "got a flat face across the axis: give the link a bore about the joint's axis"
            )
    return np.array(points)


def _spread_along(seat: Seat, axis: Float[np.ndarray, "3"]) -> float:
    return float(np.linalg.norm((seat.directions @ axis) * seat.spread))


def _widest_across(seat: Seat, axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    candidates = [np.asarray(d - (d @ axis) * axis) for d in seat.directions]
    widest = max(candidates, key=lambda d: _spread_along(seat, d))
    return widest / np.linalg.norm(widest) if np.linalg.norm(widest) > 1e-9 else perpendiculars(axis)[0]


def _components(scene: Scene, name: str, joint: Joint, link: Link) -> list[int]:
    """Which of a port's three components the joint holds: of a beam (u, v, ψ) a pin leaves ψ free."""
    driven = scene.drive is not None and scene.drive.joint == name
    if link.kind == "solid" or joint.kind in {"weld", "prismatic"} or driven:
        return [0, 1, 2]
    return [0, 1]


def _target(joint: Joint, others: list[str], sliders: dict[str, np.ndarray], first_of: dict[str, int],
            unknowns: int, components: list[int]) -> tuple[int, np.ndarray, int]:  # fmt: skip
    """First unknown, (components, unknowns) block and number of new unknowns of one port point."""
    if not others:
        return unknowns, np.eye(len(components)), len(components)
    if others[0] != GROUND:
        slider = others[0]
        return first_of[slider], sliders[slider][components, None], 0
    if joint.kind == "prismatic":
        return unknowns, unit(joint.axis or (0.0, 0.0, 1.0))[components, None], 1
    return unknowns, np.zeros((len(components), 0)), 0
