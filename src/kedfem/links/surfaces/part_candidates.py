"""Candidate surfaces for joints on a single part, and the faces that a joint at each of them selects."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.links.record import Link, LinkFace
from kedfem.links.solid import link_faces, solid_basis, vtk_cells
from kedfem.links.surfaces.facet_selection import selected_facets
from kedfem.links.surfaces.round_surfaces import CLOSED
from kedfem.links.surfaces.surface import flat_face, middle_facet, surface_quadrature
from kedfem.mesh import SolidMesh
from kedfem.mesh.elements.hexahedra import CELL_TYPES, Face

KINDS = ("bore", "journal", "ball seat", "ball", "part of a bore", "part of a journal", "plane")
BLENDS = ("fillet", "rounded")  # words of faces that are not for joints
MOST = 40  # of a part with hundreds of plane faces the largest
MOSTLY = 0.5  # of a face's sides: a larger share selected is that face


@dataclass(frozen=True, slots=True)
class PartCandidate:
    """A face for a joint, by its number in the table and the picture.

    kind : one of KINDS
    at : (3,) middle of its axis, its centre, or of a plane the point on it nearest to its centroid [m]
    found : numbers of all faces that a joint at `at`, about the axis of a round face, selects
    area : [m²]
    """

    number: int
    face: Face
    kind: str
    at: Float[np.ndarray, "3"]
    found: tuple[int, ...]
    area: float

    @property
    def finds(self) -> str:
        """Faces that a joint there selects, in words: this one, it with others, others instead, or none."""
        others = ", ".join(str(each) for each in self.found if each != self.number)
        if self.number in self.found:
            return f"it with {others}" if others else "it"
        return f"{others} instead" if others else "by faces only"


def part_candidates(mesh: SolidMesh) -> list[PartCandidate]:
    """The faces of a meshed part for joints, round ones first, those of a kind by area."""
    link = _surface_of(mesh)
    rows = []
    for each in link.faces:
        kind = face_kind(mesh, each.face)
        if kind in KINDS and len(each.facets):
            rows.append((KINDS.index(kind), -float(surface_quadrature(link, each.facets).dA.sum()), each))
    rows = sorted(rows, key=lambda row: row[:2])[:MOST]
    listed, out = [each for _, _, each in rows], []
    for number, (k, area, each) in enumerate(rows, start=1):
        found = _found(link, KINDS[k], each, listed)
        out.append(PartCandidate(number, each.face, KINDS[k], _point(link, each), found, -area))
    return out


def face_kind(mesh: SolidMesh, face: Face) -> str:
    """The kind of a face for a joint: bores and journals are closed cylinders; of blends their description."""
    if face.words.startswith(BLENDS) or face.kind == "other":
        return face.words or "other"
    if face.kind != "cylinder":
        return ("ball seat" if face.inward else "ball") if face.kind == "sphere" else "plane"
    r = mesh.points[face.sides].mean(axis=1) - face.centre
    r -= np.outer(r @ face.direction, face.direction)
    part = "part of a " if np.linalg.norm(r.mean(axis=0)) > CLOSED * face.radius else ""
    return part + ("bore" if face.inward else "journal")


def _surface_of(mesh: SolidMesh) -> Link:
    """A link of a mesh without mass and stiffness, to select faces."""
    basis = solid_basis(mesh)
    X = np.ascontiguousarray(basis.doflocs.T)
    nothing = np.zeros(len(X))
    return Link(
        name="part", kind="solid", X=X, one=nothing + 1, cells=vtk_cells(basis), axes=np.eye(3),
        cell_type=CELL_TYPES[len(basis.element_dofs)], mass=(None,) * 3, K0=None, m1=np.zeros_like(X),
        mX=np.zeros_like(X), volume=nothing, E=0.0, lame=(0.0, 0.0), basis=basis, faces=link_faces(basis, mesh),
    )  # fmt: skip


def _point(link: Link, each: LinkFace) -> Float[np.ndarray, "3"]:
    """The point for a joint on a face [m]."""
    centre = each.face.centre
    return centre if each.face.kind != "plane" else middle_facet(link, each.facets, centre)


def _found(link: Link, kind: str, each: LinkFace, listed: Sequence[LinkFace]) -> tuple[int, ...]:
    """Numbers of the faces that a joint on a face selects."""
    point = _point(link, each)
    axis = each.face.direction if each.face.kind == "cylinder" else None
    facets: Int[np.ndarray, " f"]
    try:
        facets = flat_face(link, point) if kind == "plane" else selected_facets(link, "part", point, axis)
    except MeshError:
        return ()
    shares = (np.isin(other.facets, facets).mean() for other in listed)
    return tuple(number for number, share in enumerate(shares, start=1) if share > MOSTLY)
