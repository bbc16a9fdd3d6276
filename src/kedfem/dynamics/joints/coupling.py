"""Joints as shared port points: W u = B z with constant scalar weights W and a constant selection B.

Weights commute with rotation, so joints hold for displacement, velocity and acceleration at once. Joints whose directions
vary in time have port points of each link's own, and is enforced by constraint equations over these (`row_joints`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment, SharedCut, used_columns
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, Side, needs_rows
from kedfem.dynamics.joints.constraint_ports import (
    LinkageLayout,
    Own,
    can_be_bars,
    element_joint,
    gear_joint,
    rigid_points,
    row_joint,
)
from kedfem.dynamics.joints.independent import independent
from kedfem.dynamics.joints.places import part_surface, slider_axis
from kedfem.dynamics.joints.port_points import port_points
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, port_weights
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import Joint, Scene

ACROSS = 0.2  # of what points of a slide lie apart sideways: along it less is no lever that holds a rotation


@dataclass
class _Ports:
    """Ports of one link while they are collected."""

    link: Link
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
        self.keep.extend(self.link.d * len(self.weights) + c for c in held)
        self.weights.append(weights)
        self.points.append(point)
        self.joints.append(joint)
        self.selection.append((first, block))

    def attachment(self) -> Attachment:
        """Without what the interface unknowns are to its components."""
        q, d = len(self.keep), self.link.d
        W = np.array(self.weights) if self.weights else np.zeros((0, 0))
        nodes = np.flatnonzero(W.any(axis=0))
        points = np.array(self.points) if self.points else np.zeros((0, 3))
        keep = np.array(self.keep, int)
        none = np.zeros(0, int)
        return Attachment(nodes, W[:, nodes], d, points, tuple(self.joints), keep, none, np.zeros((q, 0)), 0)

    def selected(self, unknowns: int) -> sp.csr_array:
        """Held components from all interface unknowns."""
        B = sp.lil_array((len(self.keep), unknowns))
        row = 0
        for first, block in self.selection:
            B[row : row + block.shape[0], first : first + block.shape[1]] = block
            row += block.shape[0]
        return sp.csr_array(B)


@dataclass(frozen=True, slots=True)
class Joined:
    """All joints of a scene: what each link has of them, and those enforced by constraint equations."""

    attachments: dict[str, Attachment]
    rows: tuple[ConstraintJoint, ...]


def joined(
    scene: Scene, links: dict[str, Link], cuts: Sequence[SharedCut], layout: LinkageLayout, elements: bool = False,
    bars: bool = False,
) -> Joined:  # fmt: skip
    """All joints of a scene, and cuts between segments, as attachments of its elastic links.

    Parameters
    ----------
    links : elastic links, or their segments, by a key of each
    elements : whether springs, motors and limits get interface points, as joints without rows
    bars : whether rigid links get points between which distances are kept

    Raises
    ------
    MeshError
        If a joint finds no bore, face or node on one of its links.
    """
    ports = {name: _Ports(link) for name, link in links.items()}
    sliders = {name: axis for name in scene.links if (axis := slider_axis(scene, name)) is not None}
    first_of: dict[str, int] = {name: k for k, name in enumerate(sliders)}
    unknowns = len(sliders)
    rows: list[tuple[ConstraintJoint, list[Own | None]]] = []
    columns: list[list[int]] = []  # of each side's own unknowns
    held_by_rows = [row_joint(scene, name, links, layout) for name in scene.joints if needs_rows(scene, name)]
    geared = [gear_joint(scene, name, links, layout) for name in scene.gears]
    acting = [
        element_joint(scene, f"{kind}.{name}", element, links, layout)
        for kind, every in (("springs", scene.springs), ("motors", scene.motors), ("limits", scene.limits))
        for name, element in (every.items() if elements else ())
    ]
    stiff = [rigid_points(link, key, layout) for key, link in links.items() if bars and can_be_bars(link)]
    for row, own in [*held_by_rows, *geared, *acting, *stiff]:
        if all(each is None for each in own):
            continue
        for each in own:
            columns.append(_own_columns(ports, row.name, each, first_of, unknowns))
            unknowns += len(columns[-1]) if each is not None and each.key else 0
        rows.append((row, own))
    for name, joint in scene.joints.items():
        if needs_rows(scene, name):
            continue
        elastic = {link.name for link in links.values()}
        surfaces = dict(part_surface(scene, name, links, link) for link in joint.links if link in elastic)
        held = list(surfaces)
        others = [link for link in joint.links if link not in elastic]
        if len({links[link].planar for link in held}) == 2:
            unknowns += _mixed(scene, name, {link: (ports[link], surfaces[link]) for link in held}, unknowns)
            continue
        points = port_points(scene, name, joint, surfaces, links) if held else np.zeros((0, 3))
        across, travel = _lies_across(joint, points), unknowns
        for k, point in enumerate(points):
            components = _components(scene, name, joint, [links[link] for link in held])
            first, block, new = _target(joint, others, sliders, first_of, unknowns, components)
            if across and k and new:  # one travel for all, so that the surface cannot tilt
                first, new = travel, 0
            for link in held:
                weights = port_weights(surfaces[link], point[None, :])[0]
                ports[link].add(weights, point, name, components, first, block)
            unknowns += new
    for cut in cuts:
        for point, *weights in zip(cut.points, *cut.weights, strict=True):
            for key, row_ in zip(cut.keys, weights, strict=True):
                d = ports[key].link.d
                ports[key].add(row_, point, "", list(range(d)), unknowns, np.eye(d))
            unknowns += d
    every = [ports[name].attachment() for name in links]
    sides = list(zip((side for _, both in rows for side in both), columns, strict=True))
    bear = [k for side, here in sides if side is not None and not side.slider for k in here]
    riding = [k for side, here in sides if side is not None and side.slider for k in here]
    found, Z = independent(every, [ports[name].selected(unknowns) for name in links], bear, riding)
    return Joined(dict(zip(links, found, strict=True)), tuple(_on(rows, columns, Z)))


def _own_columns(
    ports: dict[str, _Ports], name: str, own: Own | None, first_of: dict[str, int], unknowns: int
) -> list[int]:
    """The unknowns of one side of a joint enforced by constraint equations: all components of its ports; a slider's own
    travel."""
    if own is None:
        return []
    if own.slider:
        return [first_of[own.slider]]
    d = ports[own.key].link.d
    for k, (weights, point) in enumerate(zip(own.weights, own.points, strict=True)):
        ports[own.keys[k] if own.keys else own.key].add(
            weights, point, name, list(range(d)), unknowns + d * k, np.eye(d)
        )
    return list(range(unknowns, unknowns + d * len(own.points)))


def _on(
    rows: Sequence[tuple[ConstraintJoint, list[Own | None]]], columns: Sequence[list[int]], Z: sp.csr_array
) -> Iterator[ConstraintJoint]:
    """Joints with rows on the interface unknowns, as these turned out."""
    of_side = iter(columns)

    def on(row: ConstraintJoint, own: Iterator[Own | None]) -> ConstraintJoint:
        sides = [
            None if side is None or each is None else _seeing(side, each, Z[here])
            for side, each, here in zip(row.sides, own, of_side, strict=False)
        ]
        return replace(
            row, sides=(sides[0], sides[1]), plus=tuple((c, on(other, own)) for c, other in row.plus)
        )

    for row, own in rows:
        yield on(row, iter(own))


def _seeing(side: Side, own: Own, Z: sp.csr_array) -> Side:
    """A side whose ports know the interface unknowns, from its own unknowns: a slider's along its axis."""
    columns, onto = used_columns(Z if own.axis is None else sp.csr_array(own.axis[:, None]) @ Z)
    return replace(side, onto=onto.reshape(*side.surface.shape[::2], len(columns)), columns=columns)


def _mixed(scene: Scene, name: str, held: dict[str, tuple[_Ports, CouplingSurface]], first: int) -> int:
    """A joint between a planar link and one in space, which stays upright, as a point of it beside the plane goes with
    the one in it: a hinge by the ends of its pin, two new unknowns; a weld by two for each point of the planar link.
    """
    joint, welds = scene.joints[name], scene.joints[name].kind == "weld"
    if not welds and joint.kind not in {"revolute", "spherical"}:
        kinds = " and ".join(f"'{link}' ({ports.link.kind})" for link, (ports, _) in held.items())
        raise MeshError(
            f"joints.{name}: must be a hinge or a weld between a planar link and one in space, "
            f"got a {joint.kind} joint of {kinds}"
        )
    links = {link: ports.link for link, (ports, _) in held.items()}
    surfaces = {link: held[link][1] for link in sorted(held, key=lambda each: not links[each].planar)}
    unknowns = 0
    for link, (ports, surface) in held.items():
        points = port_points(scene, name, joint, surfaces if welds else {link: surface}, links)
        of_point = 2 * np.arange(len(points)) if welds else np.zeros(len(points), int)
        unknowns = max(unknowns, 2 + int(of_point.max()))
        components = [[0, 1] if ports.link.planar else [0, 1, 2]] * len(points)
        if welds and not ports.link.planar:  # whose thickness may change
            points, of_point = (
                np.vstack([points, points[0] + [0.0, 0.0, ports.link.size]]),
                np.append(of_point, 0),
            )
            components.append([0, 1])
        for point, column, held_ in zip(points, of_point, components, strict=True):
            weights = port_weights(surface, point[None, :])[0]
            ports.add(weights, point, name, held_, first + int(column), np.eye(3)[held_, :2])
    return unknowns


def _components(scene: Scene, name: str, joint: Joint, held: list[Link]) -> list[int]:
    """Which of a port's components the joint holds: of a beam (u, v, ψ) a pin leaves ψ free."""
    turning = name in scene.driven_joints or joint.kind in {"weld", "prismatic"}
    if not any(link.planar for link in held):
        return [0, 1, 2]
    if not turning or all(link.kind == "plane" for link in held):
        return [0, 1]
    if any(link.kind == "plane" for link in held):
        kinds = " and ".join(f"'{link.name}' ({link.kind})" for link in held)
        raise MeshError(
            f"joints.{name}: must be a hinge between a beam and a plane link, got a {joint.kind} of {kinds}"
        )
    return [0, 1, 2]


def _lies_across(joint: Joint, points: Float[np.ndarray, "p 3"]) -> bool:
    """Whether the points of a slide lie across its direction: what holds them sideways would not hold their rotation."""
    if joint.kind != "prismatic" or len(points) < 2:
        return False
    axis, away = joint_axis(joint), points - points.mean(axis=0)
    along = away @ axis
    return bool(np.abs(along).max() < ACROSS * np.linalg.norm(away - np.outer(along, axis), axis=1).max())


def _target(joint: Joint, others: list[str], sliders: dict[str, np.ndarray], first_of: dict[str, int],
            unknowns: int, components: list[int]) -> tuple[int, np.ndarray, int]:  # fmt: skip
    """First unknown, (components, unknowns) block and number of new unknowns of one port point."""
    if not others:
        return unknowns, np.eye(len(components)), len(components)
    if others[0] in sliders:
        slider = others[0]
        return first_of[slider], sliders[slider][components, None], 0
    if joint.kind == "prismatic":
        return unknowns, joint_axis(joint)[components, None], 1
    return unknowns, np.zeros((len(components), 0)), 0
