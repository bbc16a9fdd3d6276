"""Which solid of a CAD file is meant, and names of its faces."""

import re
from pathlib import Path
from typing import Any

import pytest
from numpy.testing import assert_allclose

from kedfem.mesh.cad.model import same_shape, solid_model
from kedfem.mesh.cad.text import step_bodies, step_text
from kedfem.scene.records.shapes import Cad
from tests.rooms.cad_files import FORMATS, KEYS, MM, edited, parts_in, read, refused, written


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return parts_in(tmp_path_factory.mktemp("cad"))


def named(source: Path, *products: str) -> Path:
    """A STEP file of several solids with names of products, in order."""
    text = source.read_text()
    old = re.findall(r"PRODUCT\('(Open CASCADE STEP translator [\d.]+ \d+\.\d+)'", text)
    changes = [(f"'{name}'", f"'{new}'") for name, new in zip(old, products, strict=True)]
    return edited(source, *changes, name="named")


class TestSolids:
    def test_of_the_links_name_or_the_one_asked_for(self, parts):
        path = named(parts / "boxes.step", "rod", "cap", "Kolben \\X2\\00F6\\X0\\")
        for wanted, name, height in ((None, "rod", 10), ("cap", "cap", 20), ("Kolben ö", "Kolben ö", 30)):
            solid = read(path, solid=wanted)
            assert solid.name == name
            assert_allclose(solid.volume, 100 * height * MM**3, rtol=1e-9)

    def test_others_are_gone(self, parts):
        path = parts / "boxes.brep"
        with solid_model(KEYS, path, "solid 2", Cad(file=path.name)) as (gmsh, solid):
            assert [len(gmsh.model.getEntities(dim)) for dim in range(4)] == [8, 12, 6, 1]
            assert_allclose(solid.low, [0.04, 0, 0], atol=1e-9)

    def test_glued_solids_part(self, tmp_path):
        def draw(occ: Any) -> None:
            occ.fragment([(3, occ.addBox(0, 0, 0, 1, 1, 1))], [(3, occ.addBox(1, 0, 0, 1, 1, 1))])

        written(tmp_path, "glued", draw, ("brep",))
        assert len(read(tmp_path / "glued.brep", solid="solid 2").faces) == 6

    def test_of_one_name_are_numbered(self, parts):
        path = named(parts / "boxes.step", "rod", "rod", "cap")
        assert refused(path).endswith("got FILE with: rod 1, rod 2, cap; did you mean 'rod 2'?")
        assert read(path, solid="rod 2").high[0] == pytest.approx(0.05, abs=1e-9)

    def test_that_are_bodies_of_one_product(self, parts):
        text = (parts / "boxes.step").read_text()
        names = iter(("web", "rod", "boss"))
        path = parts / "bodies.step"
        path.write_text(re.sub(r"MANIFOLD_SOLID_BREP\(''", lambda _: f"MANIFOLD_SOLID_BREP('{next(names)}'", text))
        assert_allclose(read(path).volume, 2000 * MM**3, rtol=1e-9)

    def test_none_meant(self, parts):
        assert refused(parts / "boxes.brep") == (
            "links.rod.shape.solid: is required, or a solid called 'rod' like the link, for a file with 3 "
            "solids, got FILE with: solid 1, solid 2, solid 3"
        )

    def test_another_name(self, parts):
        path = named(parts / "boxes.step", "rod", "cap", "piston")
        assert refused(path, solid="pistn") == (
            "links.rod.shape.solid: must name a solid of FILE, got 'pistn', there are: rod, cap, piston; "
            "did you mean 'piston'?"
        )

    @pytest.mark.parametrize("ending", FORMATS)
    def test_with_a_void_stays_hollow(self, tmp_path, ending):
        def draw(occ: Any) -> None:
            occ.cut([(3, occ.addBox(0, 0, 0, 10, 10, 10))], [(3, occ.addBox(3, 3, 3, 4, 4, 4))])

        written(tmp_path, "hollow", draw, (ending,))
        if ending == "igs":  # bare faces: two closed shells, which might be two parts
            assert "for a file with 2 solids" in refused(tmp_path / "hollow.igs")
        else:
            assert_allclose(read(tmp_path / f"hollow.{ending}").volume, (1000 - 64) * MM**3, rtol=1e-9)


def with_face_names(source: Path, *names: str) -> Path:
    each = iter(names)
    path = source.parent / "faces.step"
    path.write_text(re.sub(r"ADVANCED_FACE\(''", lambda _: f"ADVANCED_FACE('{next(each, '')}'", source.read_text()))
    return path


class TestFaceNames:
    def test_of_a_step_file_arrive(self, parts):
        before = read(parts / "lever.step").faces
        names = [f"{face.kind} {face.area / MM**2:.3f}" for face in before]
        faces = read(with_face_names(parts / "lever.step", *names)).faces
        assert [face.name for face in faces] == [f"{face.kind} {face.area / MM**2:.3f}" for face in faces]

    def test_of_a_solid_that_an_assembly_places(self, parts):
        path = with_face_names(parts / "boxes.step", *(f"{part} {i}" for part in "abc" for i in range(6)))
        assert [face.name for face in read(path, solid="solid 2").faces] == [f"b {i}" for i in range(6)]

    def test_that_say_nothing_are_numbers(self, parts):
        faces = read(with_face_names(parts / "lever.step", "NONE", "pin")).faces
        assert [face.name for face in faces[:3]] == ["face 1", "pin", "face 3"]

    def test_in_another_order_are_not_used(self, parts):
        step = with_face_names(parts / "lever.step", *"abcdefghij")
        body = next(step_bodies(step_text(step)))
        turned = body.corners[[2, 1, 0, *range(3, 10)]]
        assert same_shape(body.corners * 1e-3 + 5, body.corners)
        assert not same_shape(turned, body.corners)
