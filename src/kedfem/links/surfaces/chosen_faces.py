"""Faces of a link that joints choose by their properties, found before the link is reduced or divided."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.links.record import Link, LinkFace
from kedfem.links.surfaces.candidates import Candidate, distance, surfaces
from kedfem.links.surfaces.missing import length, shown
from kedfem.links.surfaces.surface import PLANE_TOLERANCE, middle_facet
from kedfem.mesh.elements.hexahedra import Face
from kedfem.scene import ChosenFace, Scene

MOST = 8  # surfaces in a message

# of the diameter: nodes of mesh files and dimensions in scenes are rounded
SAME_DIAMETER = 5e-3
SAME_DIRECTION = np.cos(np.radians(0.1))  # a draft of half a degree is another face
CLEARLY = 1.25  # least ratio of the distances of the second and the nearest face

Vector = Float[np.ndarray, "3"]


def with_chosen_faces(scene: Scene, link: Link) -> Link:
    """The link with the faces that the scene's joints choose on it by their properties, named after these.

    Parameters
    ----------
    link : an undivided solid; each of its segments has the part of a face that is on it

    Raises
    ------
    MeshError
        A joint chooses a face that the link does not have, or that is not unique.
    """
    found: dict[str, LinkFace] = {}
    offered: list[Candidate] | None = None
    for name, joint in scene.joints.items():
        for choice in joint.chosen_faces(link.name):
            offered = surfaces(link) if offered is None else offered
            near = np.asarray(joint.on(link.name) if choice.near is None else choice.near)
            where = f"joints.{name}.faces.{link.name}"
            found[choice.label] = _face(link, choice, chosen_surface(link, where, choice, near, offered))
    return replace(link, faces=(*link.faces, *found.values())) if found else link


def chosen_surface(link: Link, where: str, choice: ChosenFace, near: Vector, offered: Sequence[Candidate]) -> Candidate:
    """The one surface of a link with the properties of a choice.

    Parameters
    ----------
    near : point of the choice, else the joint's, by which the message sorts surfaces [m]

    Raises
    ------
    MeshError
        There is none, or several of which none is clearly the nearest; the message lists them.
    """
    far = {id(each): distance(link, each, near) for each in offered}
    ordered = sorted(offered, key=lambda each: far[id(each)])
    meant = [each for each in ordered if matches(each, choice)]
    if len(meant) == 1:
        return meant[0]
    slack = PLANE_TOLERANCE * link.size
    if len(meant) > 1 and choice.near is not None:
        first, second = (far[id(each)] for each in meant[:2])
        if second > CLEARLY * first + slack:
            return meant[0]
    alike = [each for each in ordered if each.form == choice.form]
    offered = meant or alike or [each for each in ordered if each.form != "other"]
    those = ", ".join(f"{each.kind} {choice_text(link, each)} {length(far[id(each)])} away" for each in offered[:MOST])
    more = f", and {len(offered) - MOST} more" if len(offered) > MOST else ""
    if meant:
        wanted, got = f"mean one face of link '{link.name}'", f"{len(meant)} such faces"
        advice = "choose one by `near`, a point on it, or give several as a list"
    else:
        wanted, got = f"be a face of link '{link.name}'", f"{choice.label}, of which it has none"
        advice = "give a diameter and a direction that the part has"
    those = those or "nothing round or plane"
    raise MeshError(f"{where}: must {wanted}, got {got}; nearest first: {those}{more}; {advice}")


def matches(each: Candidate, choice: ChosenFace) -> bool:
    """Whether a surface is of the form, size and direction of a choice."""
    if each.form != choice.form:
        return False
    direction = choice.plane if choice.form == "plane" else choice.axis
    if direction is not None and abs(float(each.direction @ np.asarray(direction))) < SAME_DIRECTION:
        return False
    diameter = {"cylinder": choice.cylinder, "sphere": choice.sphere}.get(choice.form)
    return diameter is None or abs(2 * each.radius - diameter) <= SAME_DIAMETER * diameter


def choice_text(link: Link, each: Candidate) -> str:
    """The choice of a surface as a scene states it."""
    diameter = 2 * each.radius
    axis = tuple(np.round(each.direction, 9))
    match each.form:
        case "plane":
            choice = ChosenFace(plane=axis, near=_on(link, each))
        case "cylinder":
            choice = ChosenFace(cylinder=diameter, axis=axis, near=_on(link, each))
        case "sphere":
            choice = ChosenFace(sphere=diameter, near=_on(link, each))
        case _:
            return shown(each.centre)
    return choice.label


def _on(link: Link, each: Candidate) -> tuple[float, float, float]:
    """A point of a surface, near its middle [m]."""
    x, y, z = middle_facet(link, each.facets, each.centre).tolist()
    return x, y, z


def _face(link: Link, choice: ChosenFace, each: Candidate) -> LinkFace:
    """The surface as a face of the link with the choice as its name."""
    kind = choice.form
    sides = link.basis.mesh.facets[:, each.facets].T
    inward = each.kind in {"bore", "ball seat"}
    face = Face(choice.label, kind, each.centre, each.direction, each.radius, inward, sides, chosen=True)  # type: ignore[arg-type]
    return LinkFace(face, each.facets)
