"""Scene links made into records: shape → mesh → functions → constant matrices, attached bodies included."""

import numpy as np
from jaxtyping import Float

from kedfem.links.beam import beam_link, line_axes
from kedfem.links.beam_axis import smooth_axis, straight_axis
from kedfem.links.plane import plane_link
from kedfem.links.record import Link
from kedfem.links.section import scene_section
from kedfem.links.solid import solid_link
from kedfem.links.spatial_beam import spatial_beam_link
from kedfem.mesh import link_mesh, plane_mesh
from kedfem.scene import (
    Bar,
    LinkScene,
    Material,
    Part,
    PlateLink,
    Polyline,
    RectangleSection,
    Scene,
    spatial_beams,
)


def bare_links(scene: Scene) -> dict[str, Link]:
    """Records of all links that have a shape, without attached bodies; rigid ones still elastic.

    Raises
    ------
    MeshError
        If a link cannot be meshed well enough.
    """
    return {name: bare_link(scene, name) for name, link in scene.links.items() if link.shape is not None}


def link_axes(link: LinkScene) -> Float[np.ndarray, "3 3"]:
    """Link axes as columns, in the reference position: x along shapes that have a direction, else the world's axes."""
    match link.shape:
        case Bar(between=(a, b)) | PlateLink(between=(a, b)) | Part(between=(a, b)):
            return line_axes(np.asarray(a), np.asarray(b))
        case Polyline(points=points):
            return line_axes(np.asarray(points[0]), np.asarray(points[-1]))
        case _:
            return np.eye(3)


def bare_link(scene: Scene, name: str) -> Link:
    """The record of one link that has a shape, without attached bodies.

    Raises
    ------
    MeshError
        If it cannot be meshed well enough.
    """
    link = scene.links[name]
    material = scene.materials[str(link.material)]
    if link.family == "solid":
        return solid_link(name, link_mesh(name, link, scene.folder), material, link_axes(link))
    if link.family == "plane":
        return plane_link(name, plane_mesh(name, link, scene.folder), material, link_axes(link))
    return _beam(name, link, material, name in spatial_beams(scene))


def _beam(name: str, link: LinkScene, material: Material, spatial: bool) -> Link:
    shape = link.shape
    if not isinstance(shape, Bar | Polyline):
        raise TypeError(f"links.{name}: a beam is a bar or a polyline")  # refused by the scene already
    of_section = shape.of_section if isinstance(shape, Polyline) else _of_bar(shape)
    section = scene_section(of_section, link.shear_coefficient, material.poisson_ratio)
    points = np.array(shape.between if isinstance(shape, Bar) else shape.points)
    elements = link.mesh.elements if isinstance(link.mesh.elements, int) else 1
    nodes = 3 if link.element == "beam3" else 2
    if not spatial:
        return beam_link(name, points, section, material, elements, nodes)
    smooth, up = (shape.smooth, shape.up) if isinstance(shape, Polyline) else (False, None)
    axis = (smooth_axis if smooth else straight_axis)(
        points, elements, nodes, None if up is None else np.array(up)
    )
    return spatial_beam_link(name, axis, section, material)


def _of_bar(bar: Bar) -> RectangleSection:
    return RectangleSection(width=bar.width, thickness=bar.thickness)
