"""Records of links from a scene: shape → mesh → functions → constant matrices, with attached bodies.

A MeshError reports a link that cannot be meshed with the required quality.
"""

from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.links.beams.beam import chord_axes, directions, line_axes
from kedfem.links.beams.beam_segments import beam_segments, space_segments
from kedfem.links.beams.of_scene import scene_axis, scene_beam
from kedfem.links.plane import plane_link
from kedfem.links.record import Link
from kedfem.links.segments import Interval, Segments, along, corotational, max_slices, segmented
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.chosen_faces import with_chosen_faces
from kedfem.links.surfaces.coupling_surfaces import joint_surface
from kedfem.mesh import SolidMesh, side_by_side
from kedfem.scene import (
    Bar,
    Cad,
    LinkScene,
    Material,
    MeshFile,
    Part,
    PlateLink,
    Polyline,
    Scene,
    link_frames,
    spatial_beams,
)

# of a solid or plane link with co-rotational frames, where none are given: their error falls with the square of their
# number and is 1 to 2 % of the peak stress of links that bend by 2 % of their length (docs/theory/links.md)
SEGMENTS = 6


def bare_links(scene: Scene, known: Mapping[str, Link] | None = None) -> dict[str, Link]:
    """Records of all links that have a shape, without attached bodies; rigid ones still elastic.

    Parameters
    ----------
    known : records that exist already, by name
    """
    made = known or {}
    names = [name for name, link in scene.links.items() if link.shape is not None]
    spatial, meshes = spatial_beams(scene), part_meshes(scene, [name for name in names if name not in made])
    return {name: made[name] if name in made else bare_link(scene, name, spatial, meshes.get(name)) for name in names}


def part_meshes(scene: Scene, names: Iterable[str]) -> dict[str, SolidMesh]:
    """Meshes of the solid links that are parts from CAD or mesh files, made in parallel."""
    solids = (name for name in names if scene.links[name].family == "solid")
    parts = (name for name in solids if isinstance(scene.links[name].shape, Cad | MeshFile))
    return side_by_side({name: partial(solid_mesh, scene, name) for name in parts})


def solid_mesh(scene: Scene, name: str) -> SolidMesh:
    """The mesh of a solid link."""
    from kedfem.mesh import link_mesh

    return link_mesh(name, scene.links[name], scene.folder, attachment_places(scene, name))


def link_axes(link: LinkScene) -> Float[np.ndarray, "3 3"]:
    """Link axes as columns, in the reference position: x along shapes that have a direction, else the world's axes."""
    match link.shape:
        case Bar(between=(a, b)) as bar:
            return directions(np.subtract(b, a), np.array(bar.upward)).T
        case PlateLink(between=(a, b)) | Part(between=(a, b)):
            return line_axes(np.asarray(a), np.asarray(b))
        case Cad(origin=a, towards=b, z=z) | MeshFile(origin=a, towards=b, z=z) if b is not None:
            return chord_axes(np.array([a, b]), None if z is None else np.array(z))
        case Polyline(points=points, up=up):
            return chord_axes(np.asarray(points), None if up is None else np.array(up))
        case _:
            return np.eye(3)


def bare_link(scene: Scene, name: str, spatial: frozenset[str] | None = None, mesh: SolidMesh | None = None) -> Link:
    """The record of one link that has a shape, without attached bodies.

    Parameters
    ----------
    spatial : the beams of the scene that move in space, if known
    mesh : of a solid link, if it exists already
    """
    link = scene.links[name]
    material = scene.materials[str(link.material)]
    if link.family == "solid":
        made = mesh or solid_mesh(scene, name)
        return with_chosen_faces(scene, solid_link(name, made, material, link_axes(link)))
    if link.family == "plane":
        from kedfem.mesh import plane_mesh

        flat = plane_mesh(name, link, scene.folder, attachment_places(scene, name))
        return plane_link(name, flat, material, link_axes(link))
    return scene_beam(scene, name, spatial_beams(scene) if spatial is None else spatial)


def attachment_places(scene: Scene, name: str) -> tuple[tuple[tuple[float, float, float], ...], tuple[str, ...]]:
    """Places of joints, bodies, loads, springs and probes on a link [m], and the names of its faces in joints."""
    joints = [joint for joint in scene.joints.values() if name in joint.links]
    ends = [end for spring in scene.springs.values() for end in getattr(spring, "between", None) or ()]
    singles = (*scene.loads.values(), *scene.bodies.values(), *scene.output.probes.values(), *ends)
    here = [getattr(each, "at", None) for each in singles if each.link == name]
    places = [at for at in here if at is not None]
    nears = [face.near for joint in joints for face in joint.chosen_faces(name) if face.near is not None]
    points = {tuple(float(x) for x in at) for at in [*(joint.at for joint in joints), *places, *nears]}
    named = {face for joint in joints for face in joint.face_names(name)}
    return tuple(sorted(points)), tuple(sorted(named))  # type: ignore[arg-type]


def link_segments(scene: Scene, name: str, link: Link) -> Segments:
    """A link for the dynamics: whole with a rigid-body frame, else divided into segments with co-rotational frames.

    Parameters
    ----------
    link : its record, without attached bodies
    """
    given = scene.links[name]
    if link_frames(scene, name) == "rigid-body":
        return Segments((link,))
    if given.model == "rigid" or link.full is not None:
        return Segments((corotational(link),))
    material = scene.materials[str(given.material)]
    match link.kind:
        case "beam":
            return beam_segments(link, material)
        case "spatial_beam":
            return space_segments(link, scene_axis(scene, name), material)
        case _:
            ends = _ends(scene, name, link)
            whole = _undivided(scene, name, link, along(link, ends))
            if given.segments is not None:
                return segmented(link, material, given.segments, ends, whole)
            return _usual_segments(link, material, ends, whole)


def _ends(scene: Scene, name: str, link: Link) -> Float[np.ndarray, "p 3"]:
    """Joints of a link in the reference position [m]; of a slot's line both ends on the link."""
    out = []
    for joint in scene.joints.values():
        at = np.asarray(joint.at)
        if joint.kind == "slot" and joint.links[1] == name:
            axis = np.asarray(joint.axis) / np.linalg.norm(np.asarray(joint.axis))
            s = (link.X - at) @ axis
            out += [at + s.min() * axis, at + s.max() * axis]
        elif name in joint.links:
            out.append(at)
    return np.array(out).reshape(-1, 3)


def max_segments(scene: Scene, name: str) -> int:
    """The largest number of segments of a solid or plane link: shorter than wide they would soften it."""
    link = bare_link(scene, name)
    return max_slices(link.X, along(link, _ends(scene, name, link)))


def _usual_segments(link: Link, material: Material, ends: Float[np.ndarray, "p 3"], whole: list[Interval]) -> Segments:
    """SEGMENTS of a link, or as many as its mesh can be divided into, none shorter than the link is wide."""
    for count in range(min(SEGMENTS, max_slices(link.X, along(link, ends))), 1, -1):
        try:
            return segmented(link, material, count, ends, whole)
        except MeshError:
            continue
    return segmented(link, material, 1, ends, whole)


def _undivided(scene: Scene, name: str, link: Link, e: Float[np.ndarray, "3"]) -> list[Interval]:
    """Ranges along a direction of the elements at a link's joints, which no cut may divide."""
    out = []
    places = [
        (joint.at, joint.axis if joint.kind != "prismatic" else None, joint.face_names(name))
        for joint in scene.joints.values()
        if name in joint.links and not (joint.kind == "slot" and joint.links[1] == name)  # a line is cut
    ]
    for at, axis, faces in places:
        about = None if axis is None else np.asarray(axis) / np.linalg.norm(axis)
        try:
            surface = joint_surface(link, f"links.{name}", np.asarray(at), about, faces)
        except MeshError:
            continue  # reported where the joint is made
        if surface.facets is not None:
            s = link.X[link.cells[link.basis.mesh.f2t[0, surface.facets]]] @ e
            out.append((float(s.min()), float(s.max())))
    return out
