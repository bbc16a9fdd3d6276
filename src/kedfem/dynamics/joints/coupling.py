"""Joints enforced by elimination, as shared interface points: W u = B z with constant scalar weights W and constant B.

Weights commute with rotation, so joints are closed in displacement, velocity and acceleration at once. For joints whose
directions vary in time each link has interface points of its own, with constraint equations (`constraint_joints`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.force_elements import force_elements
from kedfem.dynamics.joints.attachments import Attachment, SharedCut, used_columns
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, Side, needs_constraints
from kedfem.dynamics.joints.constraint_ports import (
    LinkageLayout,
    can_be_bars,
    constraint_joint,
    element_joint,
    gear_joint,
    rigid_points,
)
from kedfem.dynamics.joints.independent import independent
from kedfem.dynamics.joints.places import part_surface
from kedfem.dynamics.joints.port_points import port_points
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, port_weights
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import Joint, Scene

ACROSS = 0.2  # of what points of a slide lie apart sideways: along it less is no lever that holds a rotation


@dataclass(frozen=True, slots=True)
class _Port:
    """A port of one link: its point and weights, the joint's name, held components, and B of these: a block from the
    first of its unknowns on."""

    weights: Float[np.ndarray, " n"]
    point: Float[np.ndarray, "3"]
    joint: str
    held: Sequence[int]
    first: int
    block: Float[np.ndarray, "h c"]


def _attachment(link: Link, ports: Sequence[_Port]) -> Attachment:
    """An attachment before its relation to the interface unknowns is known."""
    W = np.array([port.weights for port in ports]) if ports else np.zeros((0, 0))
    nodes = np.flatnonzero(W.any(axis=0))
    points = np.array([port.point for port in ports]).reshape(-1, 3)
    keep = np.array([link.d * p + c for p, port in enumerate(ports) for c in port.held], int)
    names, none = tuple(port.joint for port in ports), np.zeros(0, int)
    return Attachment(nodes, W[:, nodes], link.d, points, names, keep, none, np.zeros((len(keep), 0)), 0)


def _selected(ports: Sequence[_Port], unknowns: int) -> sp.csr_array:
    """Held components from all interface unknowns."""
    B, row = sp.lil_array((sum(len(port.held) for port in ports), unknowns)), 0
    for port in ports:
        h, c = port.block.shape
        B[row : row + h, port.first : port.first + c] = port.block
        row += h
    return sp.csr_array(B)


@dataclass(frozen=True, slots=True)
class Joined:
    """All joints of a scene: attachments to each link, and joints enforced by constraint equations."""

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
    ports: dict[str, list[_Port]] = {name: [] for name in links}
    unknowns = 0
    enforced = [constraint_joint(scene, name, links, layout) for name in scene.joints if needs_constraints(scene, name)]
    geared = [gear_joint(scene, name, links, layout) for name in scene.gears]
    acting = [element_joint(scene, *each, links, layout) for each in (force_elements(scene) if elements else ())]
    stiff = [rigid_points(link, key, layout) for key, link in links.items() if bars and can_be_bars(link)]
    rows = [row for row in (*enforced, *geared, *acting, *stiff) if any(row.all_sides)]
    sides = [(row.name, side) for row in rows for side in row.all_sides]
    columns: dict[int, list[int]] = {}  # of each side's own unknowns: all components of its ports
    for name, side in sides:
        d = side.components
        columns[id(side)] = [*range(unknowns, unknowns + d * len(side.keys))]
        for key, weights, point in zip(side.keys, side.weights, side.points if side.keys else (), strict=True):
            ports[key].append(_Port(weights, point, name, range(d), unknowns, np.eye(d)))
            unknowns += d
    for name, joint in scene.joints.items():
        if needs_constraints(scene, name):
            continue
        elastic = {link.name for link in links.values()}
        surfaces = dict(part_surface(scene, name, links, link) for link in joint.links if link in elastic)
        held = list(surfaces)
        grounded = len(held) < 2
        if len({links[link].planar for link in held}) == 2:
            unknowns += _mixed(scene, name, surfaces, links, ports, unknowns)
            continue
        points = port_points(scene, name, joint, surfaces, links) if held else np.zeros((0, 3))
        undeformed = any(links[link].rigid or links[link].kind == "spatial_beam" for link in held)
        one_travel = undeformed or _lies_across(joint, points)
        travel = unknowns
        for k, point in enumerate(points):
            components = _components(scene, name, joint, [links[link] for link in held])
            first, (block, new) = unknowns, _target(joint, grounded, components)
            if one_travel and k and joint.kind == "prismatic":  # so that the surface cannot tilt
                first, new = travel, 0
            for link in held:
                weights = port_weights(surfaces[link], point[None, :])[0]
                ports[link].append(_Port(weights, point, name, components, first, block))
            unknowns += new
    for cut in cuts:
        for point, *weights in zip(cut.points, *cut.weights, strict=True):
            for key, row_ in zip(cut.keys, weights, strict=True):
                d = links[key].d
                ports[key].append(_Port(row_, point, "", range(d), unknowns, np.eye(d)))
            unknowns += d
    every = [_attachment(links[name], ports[name]) for name in links]
    bear = [k for _, side in sides for k in columns[id(side)]]
    found, Z = independent(every, [_selected(ports[name], unknowns) for name in links], bear)
    return Joined(dict(zip(links, found, strict=True)), tuple(_on(row, columns, Z) for row in rows))


def _on(row: ConstraintJoint, columns: Mapping[int, list[int]], Z: sp.csr_array) -> ConstraintJoint:
    """A joint by constraint equations, with the final interface unknowns."""
    one, other = (side and _seeing(side, Z[columns[id(side)]]) for side in row.sides)
    return replace(row, sides=(one, other), plus=tuple((c, _on(each, columns, Z)) for c, each in row.plus))


def _seeing(side: Side, Z: sp.csr_array) -> Side:
    """A side whose ports know the interface unknowns, from its own unknowns."""
    columns, onto = used_columns(Z)
    onto = onto.reshape(len(side.points), side.components, len(columns))
    return replace(side, onto=onto, columns=columns, weights=())


def _mixed(
    scene: Scene, name: str, surfaces: dict[str, CouplingSurface], links: dict[str, Link],
    ports: dict[str, list[_Port]], first: int,
) -> int:  # fmt: skip
    """A joint between a planar link and one in space, which stays upright, as a point of it beside the plane goes with
    the one in it: a hinge by the ends of its pin, two new unknowns; a weld by two for each point of the planar link.
    """
    joint, welds = scene.joints[name], scene.joints[name].kind == "weld"
    planar_first = {link: surfaces[link] for link in sorted(surfaces, key=lambda each: not links[each].planar)}
    unknowns = 0
    for link, surface in surfaces.items():
        points = port_points(scene, name, joint, planar_first if welds else {link: surface}, links)
        of_point = 2 * np.arange(len(points)) if welds else np.zeros(len(points), int)
        unknowns = max(unknowns, 2 + int(of_point.max()))
        components = [[0, 1] if links[link].planar else [0, 1, 2]] * len(points)
        if welds and not links[link].planar:  # whose thickness may change
            points = np.vstack([points, points[0] + [0.0, 0.0, links[link].size]])
            of_point = np.append(of_point, 0)
            components.append([0, 1])
        for point, column, held in zip(points, of_point, components, strict=True):
            weights = port_weights(surface, point[None, :])[0]
            block = np.eye(3)[held, :2]
            ports[link].append(_Port(weights, point, name, held, first + int(column), block))
    return unknowns


def _components(scene: Scene, name: str, joint: Joint, held: list[Link]) -> list[int]:
    """Components of a port that the joint constrains: of a beam's (u, v, ψ) a pin releases ψ."""
    turning = name in scene.driven_joints or joint.kind in {"weld", "prismatic"}
    if not any(link.planar for link in held):
        return [0, 1, 2]
    if not turning or all(link.kind == "plane" for link in held):
        return [0, 1]
    if any(link.kind == "plane" for link in held):
        kinds = " and ".join(f"'{link.name}' ({link.kind})" for link in held)
        raise MeshError(f"joints.{name}: must be a hinge between a beam and a plane link, got a {joint.kind} of {kinds}")
    return [0, 1, 2]


def _lies_across(joint: Joint, points: Float[np.ndarray, "p 3"]) -> bool:
    """Whether the points of a slide lie across its direction: sideways constraints then leave its rotation free."""
    if joint.kind != "prismatic" or len(points) < 2:
        return False
    axis, away = joint_axis(joint), points - points.mean(axis=0)
    along = away @ axis
    return bool(np.abs(along).max() < ACROSS * np.linalg.norm(away - np.outer(along, axis), axis=1).max())


def _target(joint: Joint, grounded: bool, components: list[int]) -> tuple[np.ndarray, int]:
    """(components, unknowns) block and number of new unknowns of one interface point."""
    if not grounded:
        return np.eye(len(components)), len(components)
    if joint.kind == "prismatic":
        return joint_axis(joint)[components, None], 1
    return np.zeros((len(components), 0)), 0
