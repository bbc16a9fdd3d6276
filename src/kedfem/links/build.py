"""Scene links made into records: shape → mesh → functions → constant matrices, attached bodies included."""

import numpy as np
from jaxtyping import Float

from kedfem.links.beam import beam_link, line_axes
from kedfem.links.plane import plane_link
from kedfem.links.record import Link, Section
from kedfem.links.solid import solid_link
from kedfem.mesh import link_mesh, plane_mesh
from kedfem.scene import Bar, LinkScene, Part, PlateLink, Polyline, Scene


def bare_links(scene: Scene) -> dict[str, Link]:
    """Records of all links that have a shape, without attached bodies; rigid ones still elastic.

    Raises
    ------
    MeshError
        If a link cannot be meshed well enough.
    """
    return {name: bare_link(scene, name) for name, link in scene.links.items() if link.shape is not None}


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
    shape = link.shape
    if not isinstance(shape, Bar | Polyline):
        raise TypeError(f"links.{name}: a beam is a bar or a polyline")  # refused by the scene already
    points = np.array(shape.between if isinstance(shape, Bar) else shape.points)
    section = Section(shape.width, shape.thickness, link.shear_coefficient)
    elements = link.mesh.elements
    nodes = 3 if link.element == "beam3" else 2
    return beam_link(name, points, section, material, elements if isinstance(elements, int) else 1, nodes)


def link_axes(link: LinkScene) -> Float[np.ndarray, "3 3"]:
    """Link axes as columns, in the reference position: x along shapes that have a direction, else the world's axes."""
    match link.shape:
        case Bar(between=(a, b)) | PlateLink(between=(a, b)) | Part(between=(a, b)):
            return line_axes(np.asarray(a), np.asarray(b))
        case Polyline(points=points):
            return line_axes(np.asarray(points[0]), np.asarray(points[-1]))
        case _:
            return np.eye(3)
