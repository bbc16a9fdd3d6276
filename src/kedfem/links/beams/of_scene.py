"""Beams of a scene: their sections, and their axes with nodes at joints and bodies."""

import math
from itertools import pairwise

import numpy as np

from kedfem.arrays import Float
from kedfem.links.beams.beam import beam_link, node_places
from kedfem.links.beams.beam_axis import Axis, smooth_axis, straight_axis
from kedfem.links.beams.section import scene_section
from kedfem.links.beams.spatial_beam import spatial_beam_link
from kedfem.links.record import Link
from kedfem.scene import Bar, LinkScene, PointMass, Polyline, RectangleSection, Scene, SectionShape

FEWEST = 4  # nodes along a slot
SAME = 1e-6  # of a segment's length: points closer together coincide


def scene_beam(scene: Scene, name: str, spatial: frozenset[str]) -> Link:
    """A beam of a scene; `spatial`: names of those in space."""
    link = scene.links[name]
    shape, material = _line(link), scene.materials[str(link.material)]
    if isinstance(shape, Polyline):
        of_section: SectionShape = shape.of_section
    else:
        of_section = RectangleSection(width=shape.width, thickness=shape.thickness)
    section = scene_section(of_section, link.shear_coefficient, material.poisson_ratio)
    if name in spatial:
        return spatial_beam_link(name, scene_axis(scene, name), section, material)
    points = beam_points(scene, name, spatial=False)
    return beam_link(name, points, section, material, segment_elements(scene, name), beam_nodes(link))


def scene_axis(scene: Scene, name: str) -> Axis:
    """The axis of a beam in space."""
    link = scene.links[name]
    shape = _line(link)
    smooth, up = (shape.smooth, shape.up) if isinstance(shape, Polyline) else (False, shape.upward)
    elements = segment_elements(scene, name)
    make = smooth_axis if smooth else straight_axis
    points = beam_points(scene, name, spatial=True)
    return make(points, elements, beam_nodes(link), None if up is None else np.array(up))


def beam_points(scene: Scene, name: str, spatial: bool) -> Float[np.ndarray, "p 3"]:
    """The corners of a beam, and joints and bodies between them, where segments begin and end.

    Joints and bodies at a node need no corner, except bodies with inertia on a beam in space.
    """
    link = scene.links[name]
    shape = _line(link)
    points = np.array(shape.between if isinstance(shape, Bar) else shape.points)
    if isinstance(shape, Polyline) and shape.smooth:
        return points
    joints = (x for x in scene.joints.values() if name in x.links)
    held = [x.on(name) for x in joints if x.kind != "slot" or name != x.links[1]]  # a pin is anywhere along its slot
    light = [x.at for x in scene.bodies.values() if x.link == name and isinstance(x, PointMass)]
    heavy = [x.at for x in scene.bodies.values() if x.link == name and not isinstance(x, PointMass)]
    elements = segment_elements(scene, name)
    nodes = node_places(elements, beam_nodes(link)) / elements
    out = [points[:1]]
    for P, Q in pairwise(points):
        length = float(np.linalg.norm(Q - P))
        inside, corners = [], []
        for at, corner in [*((x, False) for x in (*held, *light)), *((x, spatial) for x in heavy)]:
            f = float((np.asarray(at) - P) @ (Q - P)) / length**2
            beside = float(np.linalg.norm(P + f * (Q - P) - at))
            if beside <= SAME * length and SAME < f < 1.0 - SAME:
                inside.append(f)
                corners.append(corner or np.abs(nodes - f).min() > SAME)
        apart = [f for k, f in enumerate(sorted(inside)) if k == 0 or f - sorted(inside)[k - 1] > SAME]
        apart = apart if any(corners) else []  # one new corner moves all nodes of the segment
        out += [P + np.array(apart)[:, None] * (Q - P), Q[None]]
    return np.concatenate(out)


def segment_elements(scene: Scene, name: str) -> int:
    """Number of elements of each segment of a beam, 1 if not given; for a bar with a slot enough for its stations."""
    link = scene.links[name]
    given = link.mesh.elements if isinstance(link.mesh.elements, int) else 1
    slotted = any(x.kind == "slot" and x.links[1] == name for x in scene.joints.values())
    if not slotted or not isinstance(link.shape, Bar):
        return given
    return max(given, math.ceil((FEWEST - 1) / (beam_nodes(link) - 1)))


def beam_nodes(link: LinkScene) -> int:
    """Nodes of each element of a beam: the number in its name."""
    return int(str(link.element).removeprefix("beam"))


def _line(link: LinkScene) -> Bar | Polyline:
    if not isinstance(link.shape, Bar | Polyline):
        raise TypeError("a beam must be a bar or a polyline")  # refused by the scene already
    return link.shape
