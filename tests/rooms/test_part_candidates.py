"""Candidate surfaces of a part for joints, and the names of its faces."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from kedfem.links.surfaces.part_candidates import part_candidates
from kedfem.mesh import SolidMesh
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.solids import CadFace
from kedfem.mesh.cad.words import direction_in_words, face_form, face_in_words, with_faces_in_words
from kedfem.scene import Cad

from ..turned import ball_on_neck, turned
from .cad_files import lever, written
from .test_coupling_surfaces import with_face


def with_rounds(mesh: SolidMesh, *rounds: tuple[str, float, float, float]) -> SolidMesh:
    for name, r, low, high in rounds:
        mesh = with_face(mesh, name, lambda x, r=r, low=low, high=high:
                         (abs(np.hypot(x[:, 0], x[:, 1]) - r) < 1e-9) & (x[:, 2] >= low) & (x[:, 2] <= high))  # fmt: skip
        middle, inward = np.array([0.0, 0.0, (low + high) / 2]), "rim" not in name
        *others, face = mesh.faces
        known = replace(face, kind="cylinder", centre=middle, direction=np.eye(3)[2], radius=r, inward=inward)
        mesh = replace(mesh, faces=(*others, known))
    return mesh


def test_what_a_joint_finds_is_told_of_each_coupling_surface() -> None:
    """A stepped sleeve: its journals are beside its bores, where a joint goes into the bore."""
    sleeve = turned([(0.0, 0.01, 0.005, 0.01), (0.01, 0.02, 0.004, 0.015)])
    rounds = [("wide bore", 0.005, 0, 0.01), ("bore", 0.004, 0.01, 0.02), ("rim", 0.015, 0.01, 0.02)]
    found = {each.face.name: each for each in part_candidates(with_rounds(sleeve, *rounds))}
    assert [each.kind for each in found.values()] == ["bore", "bore", "journal"]
    assert [each.number for each in found.values()] == [1, 2, 3]
    assert [found[name].finds for name in ("wide bore", "bore")] == ["it", "it"]
    assert found["rim"].finds == f"{found['bore'].number} instead"
    assert direction_in_words(found["bore"].face.direction) == "z"


def test_both_lugs_of_a_clevis_are_found_from_either() -> None:
    clevis = turned([(0.0, 0.004, 0.005, 0.02), (0.004, 0.012, 0.015, 0.02), (0.012, 0.016, 0.005, 0.02)])
    lugs = with_rounds(clevis, ("low", 0.005, 0, 0.004), ("high", 0.005, 0.012, 0.016))
    assert sorted(each.finds for each in part_candidates(lugs)) == ["it with 1", "it with 2"]


def test_a_part_without_faces_offers_none_by_name() -> None:
    assert part_candidates(ball_on_neck(0.01)) == []


def forms(tmp_path: Path, draw: Callable[[Any], Any]) -> list[str]:
    written(tmp_path, "part", draw, ("step",))
    keys = CadKeys("part", "--solid")
    with solid_model(keys, tmp_path / "part.step", "part", Cad(file="part.step")) as (_, solid):
        return [face_form(face) for face in solid.faces]


def test_faces_are_called_what_a_designer_calls_them(tmp_path: Path) -> None:
    def angle(occ: Any) -> None:
        """An angle whose inner edge is filleted, a rounded outer one, a countersunk bore."""
        whole, _ = occ.fuse([(3, occ.addBox(0, 0, 0, 40, 20, 8))], [(3, occ.addBox(0, 0, 0, 8, 20, 40))])
        drill = occ.addCylinder(30, 10, -1, 0, 0, 20, 3)
        sink = occ.addCone(30, 10, 6, 0, 0, 2, 3, 5)
        part, _ = occ.cut(whole, [(3, drill), (3, sink)])
        occ.synchronize()
        import gmsh

        edges = {}
        for _, tag in gmsh.model.getEntities(1):
            x, _, z = occ.getCenterOfMass(1, tag)
            edges[round(x, 3), round(z, 3)] = tag
        occ.fillet([part[0][1]], [edges[8.0, 8.0], edges[0.0, 0.0]], [2.0, 3.0])

    found = forms(tmp_path, angle)
    assert "fillet of radius 2 mm along y" in found
    assert "rounded edge of radius 3 mm along y" in found
    assert "bore of radius 3 mm along z" in found
    assert "conical face (chamfer, draft or countersink)" in found
    assert "plane face facing -x" in found
    assert len(found) == 12


def test_a_rounded_rim_is_a_fillet_of_its_own_radius(tmp_path: Path) -> None:
    def disc(occ: Any) -> None:
        tag = occ.addCylinder(0, 0, 0, 0, 0, 10, 20)
        occ.synchronize()
        import gmsh

        rim = next(
            e for _, e in gmsh.model.getEntities(1)
            if gmsh.model.getType(1, e) == "Circle" and occ.getCenterOfMass(1, e)[2] > 9
        )  # fmt: skip
        occ.fillet([tag], [rim], [2.5])

    assert "fillet of radius 2.5 mm" in forms(tmp_path, disc)


def test_the_corner_of_a_rounded_block_is_a_corner_and_a_dome_is_part_of_a_ball(tmp_path: Path) -> None:
    def block(occ: Any) -> None:
        """A block with rounded edges, the dome of a ball of 40 mm on it."""
        occ.addBox(0, 0, 0, 30, 30, 10)
        occ.synchronize()
        import gmsh

        rounds = occ.fillet([1], [tag for _, tag in gmsh.model.getEntities(1)], [3.0])
        lens, _ = occ.intersect([(3, occ.addSphere(15, 15, -25, 40))], [(3, occ.addCylinder(15, 15, 5, 0, 0, 20, 8))])
        occ.fuse(rounds, lens)

    found = forms(tmp_path, block)
    assert found.count("rounded corner of radius 3 mm") == 8
    assert "part of a ball of radius 40 mm" in found


def test_what_gmsh_says_of_surfaces_is_told_in_words(tmp_path: Path) -> None:
    written(tmp_path, "part", lever, ("step",))
    with solid_model(CadKeys("p", "s"), tmp_path / "part.step", "part", Cad(file="part.step")) as (_, solid):
        bore = next(face for face in solid.faces if face.kind == "cylinder" and face.inward)
        said = with_faces_in_words(f"Unable to recover the edge on surface {bore.tag} (on 99)", solid.faces)
        assert said == f"Unable to recover the edge on {face_in_words(bore)} (on 99)"
        assert "bore of radius" in said
        assert " mm (face " in said
        twice = with_faces_in_words(f"Overlapping facets on surface {bore.tag} surface {bore.tag}", solid.faces)
        assert twice == f"Overlapping facets on {face_in_words(bore)}"
        blind = with_faces_in_words("PLC Error", solid.faces, [bore.tag])
        assert blind == f"PLC Error at the {face_in_words(bore)}"
        assert with_faces_in_words("No elements", solid.faces) == "No elements"


@pytest.mark.parametrize(("tiny", "shown"), [(-6.51e-19, "0"), (1e-12, "0"), (1.5e-6, "0.0015")])
def test_places_are_told_without_the_noise_of_rounding(tiny: float, shown: str) -> None:
    from kedfem.mesh.places import in_mm

    assert in_mm((0.03, tiny, 0.02)) == f"(30, {shown}, 20) mm"


@pytest.mark.parametrize("kind", ["cylinder", "sphere"])
def test_a_face_without_extent_has_a_name(kind: Literal["cylinder", "sphere"]) -> None:
    """What OpenCASCADE makes of a damaged file: it is named in the sentence that refuses it."""
    for radius, length in ((0.0, 0.01), (0.003, 0.0)):
        face = CadFace(7, "face 7", kind, np.zeros(3), np.eye(3)[2], radius, True, 1e-6, length)
        assert f"of radius {1e3 * radius:g} mm" in face_form(face)
        assert kind == "sphere" or "bore" in face_form(face)
