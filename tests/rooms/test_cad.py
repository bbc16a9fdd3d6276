"""Solids from CAD files: the same in all formats, their units, what each face is."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.links.build import part_meshes, solid_mesh
from kedfem.mesh.cad.model import solid_model
from kedfem.mesh.cad.solids import Solid
from kedfem.mesh.session import gmsh_model
from kedfem.scene import read_scene
from kedfem.scene.records.shapes import Cad
from tests.rooms.cad_files import FORMATS, KEYS, MM, VOLUME, edited, parts_in, read, refused, written


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return parts_in(tmp_path_factory.mktemp("cad"))


def told(solid: Solid) -> list[tuple[Any, ...]]:
    """What is known of the faces, in an order that no file's order changes."""
    return sorted(
        (face.kind, face.inward, *np.round(np.nan_to_num(np.array(numbers)), 9))
        for face in solid.faces
        if (numbers := [*face.centre, *np.abs(face.direction), face.radius, face.area, face.length])
    )


class TestFormats:
    @pytest.mark.parametrize("ending", FORMATS)
    def test_same_volume_and_box(self, parts, ending):
        solid = read(parts / f"lever.{ending}")
        assert_allclose(solid.volume, VOLUME * MM**3, rtol=1e-9)
        assert_allclose([*solid.low, *solid.high], np.array([0, 0, 0, 60, 20, 14]) * MM, atol=1e-8)

    @pytest.mark.parametrize("ending", FORMATS[1:])
    def test_same_faces(self, parts, ending):
        for mine, wanted in zip(told(read(parts / f"lever.{ending}")), told(read(parts / "lever.step")), strict=True):
            assert mine[:2] == wanted[:2]
            assert_allclose(mine[2:], wanted[2:], atol=2e-9)

    def test_faces_are_what_was_drawn(self, parts):
        faces = read(parts / "lever.step").faces
        round_ones = {(round(face.radius / MM, 9), face.inward) for face in faces if face.kind == "cylinder"}
        assert round_ones == {(8, False), (4, True), (3, True)}
        bore = next(face for face in faces if face.radius > 3.5e-3 and face.inward)
        assert_allclose(bore.centre, np.array([50, 10, 7]) * MM, atol=1e-12)
        assert_allclose(np.abs(bore.direction), [0, 0, 1], atol=1e-9)
        assert_allclose([bore.length, bore.area], [14 * MM, 2 * math.pi * 4 * 14 * MM**2], rtol=1e-9)
        normals = {tuple(np.round(face.direction).astype(int)) for face in faces if face.kind == "plane"}
        assert normals == {(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)}

    def test_nothing_is_printed(self, parts, capfd):
        for ending in FORMATS:
            read(parts / f"lever.{ending}")
        assert capfd.readouterr() == ("", "")

    def test_settings_of_gmsh_are_as_before(self, parts):
        with gmsh_model() as gmsh:
            read(parts / "lever.igs")
            kept = [gmsh.option.getNumber(f"Geometry.{key}") for key in ("OCCScaling", "OCCSewFaces", "Tolerance")]
            assert kept == [1, 0, 1e-8]
            assert gmsh.model.getEntities() == []


class TestForms:
    @pytest.mark.parametrize("ending", FORMATS)
    def test_sphere_cone_and_torus(self, tmp_path, ending):
        def draw(occ: Any) -> None:
            ball, surface = occ.addSphere(0, 0, 0, 9), occ.addSphere(0, 0, 9, 3)
            occ.cut([(3, ball)], [(3, surface)])

        written(tmp_path, "ball", draw, (ending,))
        found = {(f.kind, round(f.radius / MM, 6), f.inward) for f in read(tmp_path / f"ball.{ending}").faces}
        assert found == {("sphere", 9, False), ("sphere", 3, True)}

    def test_cone_and_torus_are_other(self, tmp_path):
        written(tmp_path, "cone", lambda occ: occ.addCone(0, 0, 0, 0, 0, 9, 5, 3), ("step",))
        written(tmp_path, "torus", lambda occ: occ.addTorus(0, 0, 0, 9, 2), ("step",))
        assert sorted(face.kind for face in read(tmp_path / "cone.step").faces) == ["other", "plane", "plane"]
        assert [face.kind for face in read(tmp_path / "torus.step").faces] == ["other"]

    def test_box_is_tight_around_fillets(self, tmp_path):
        def draw(occ: Any) -> None:
            plate, boss = occ.addBox(0, 0, 0, 60, 20, 10), occ.addCylinder(30, 10, 5, 0, 0, 30, 8)
            ((_, whole),), _ = occ.fuse([(3, plate)], [(3, boss)])
            occ.fillet([whole], self.round_edges(occ), [1.5])

        written(tmp_path, "fillet", draw, ("step",))
        solid = read(tmp_path / "fillet.step")
        assert_allclose([*solid.low, *solid.high], np.array([0, 0, 0, 60, 20, 35]) * MM, atol=1e-9)
        assert "other" in {face.kind for face in solid.faces}

    def round_edges(self, occ: Any) -> list[int]:
        import gmsh

        occ.synchronize()
        return [tag for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"]

    def test_small_part_is_read_and_cut(self, tmp_path):
        def draw(occ: Any) -> None:
            plate, bore = occ.addBox(0, 0, 0, 2, 1, 0.3), occ.addCylinder(1, 0.5, 0, 0, 0, 1, 0.1)
            occ.cut([(3, plate)], [(3, bore)])

        written(tmp_path, "small", draw, ("step",))
        path = tmp_path / "small.step"
        with solid_model(KEYS, path, "rod", Cad(file=path.name)) as (gmsh, solid):
            assert [round(f.radius, 12) for f in solid.faces if f.kind == "cylinder"] == [1e-4]
            occ = gmsh.model.occ
            knife = occ.addRectangle(-1e-3, -1e-3, 1e-4, 4e-3, 3e-3)
            halves, _ = occ.fragment([(3, solid.tag)], [(2, knife)])
            volumes = [occ.getMass(3, tag) for dim, tag in halves if dim == 3]
        area = (2 - math.pi * 0.01) * MM**2
        assert_allclose(sorted(volumes), [0.1 * MM * area, 0.2 * MM * area], rtol=1e-9)


METRE, INCH = "SI_UNIT($,.METRE.)", "CONVERSION_BASED_UNIT('INCH',#90001) LENGTH_UNIT() NAMED_UNIT(#90002)"
MILLIMETRE = "LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.)"


class TestUnits:
    def in_unit(self, parts: Path, unit: str) -> Path:
        extra = (
            "#90001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#90003);\n"
            "#90002 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
            f"#90003 = ( {MILLIMETRE} );\nENDSEC;\nEND-ISO"
        )
        changes = [(MILLIMETRE, unit)] + ([("ENDSEC;\nEND-ISO", extra)] if unit == INCH else [])
        return edited(parts / "lever.step", *changes, name="unit")

    @pytest.mark.parametrize(
        ("unit", "metres"), [(MILLIMETRE, MM), (MILLIMETRE.replace("SI_UNIT(.MILLI.,.METRE.)", METRE), 1), (INCH, 0.0254)]
    )
    def test_of_a_step_file(self, parts, unit, metres):
        path = self.in_unit(parts, unit)
        assert_allclose(read(path).volume, VOLUME * metres**3, rtol=1e-9)
        assert_allclose(read(path, scale=0.01).volume, VOLUME * 0.01**3, rtol=1e-9)  # the scene overrides

    @pytest.mark.parametrize(
        ("flag", "metres"), [("2,2HMM", MM), ("1,2HIN", 0.0254), ("10,2HCM", 0.01), ("3,2HCM", 0.01)]
    )
    def test_of_an_iges_file(self, parts, flag, metres):
        path = self.in_iges_unit(parts / "lever.igs", flag)
        if flag[0] != "3":
            assert_allclose(read(path).volume, VOLUME * metres**3, rtol=1e-9)
        assert_allclose(read(path, scale=0.01).volume, VOLUME * 0.01**3, rtol=1e-9)

    def test_of_an_iges_file_in_metres(self, tmp_path):
        def draw(occ: Any) -> None:
            block, bore = (occ.addBox(0, 0, 0, 0.06, 0.02, 0.01), occ.addCylinder(0.01, 0.01, 0, 0, 0, 1, 0.004))
            occ.cut([(3, block)], [(3, bore)])

        written(tmp_path, "block", draw, ("igs",))
        path = self.in_iges_unit(tmp_path / "block.igs", "6,1HM")
        assert_allclose(read(path).volume, (12e-4 - math.pi * 16e-6) * 0.01, rtol=1e-9)

    def in_iges_unit(self, source: Path, flag: str) -> Path:
        text = source.read_text()
        line = next(line for line in text.splitlines() if ",2,2HMM," in line)
        changed = line[:72].rstrip().replace(",2,2HMM,", f",{flag},")
        assert len(changed) <= 72
        return edited(source, (line, changed.ljust(72) + line[72:]), name="unit")

    def test_of_faces_that_do_not_enclose_the_volume(self, parts):
        path = self.in_iges_unit(parts / "lever.igs", "6,1HM")  # 60 m, closed to 1e-7: OpenCASCADE is off
        assert re.fullmatch(
            r"links.rod.shape.file: must be a solid whose faces enclose its volume, got [\d.]+ \[m³\] within the "
            r"faces and 9360.4 for the solid 'unit' in FILE; export it again, as STEP if you can",
            refused(path),
        )

    def test_of_a_brep_file(self, parts):
        assert_allclose(read(parts / "lever.brep", scale=0.01).volume, VOLUME * 0.01**3, rtol=1e-9)

    def test_that_a_file_does_not_say(self, parts):
        path = edited(parts / "lever.step", (".MILLI.,.METRE.", ".MILLI.,.GRAM."), name="none")
        assert refused(path, scale=0.01) == (
            "links.rod.shape.file: must say its unit of length once for `scale` to replace it, got none or "
            "several in FILE"
        )

    @pytest.mark.parametrize(
        ("ending", "scale", "got"),
        [("step", 1e-8, "9.57e-07"), ("igs", 1e-8, "9.57e-07"), ("brep", 20, "1.3e+03")],  # 64.8 units and 2e-7 m around
    )
    def test_that_no_part_can_have(self, parts, ending, scale, got):
        message = refused(parts / f"lever.{ending}", scale=scale)
        assert message.startswith("links.rod.shape.file: must hold a part between 1e-05 and 1000 [m] across, got ")
        assert message.endswith("in FILE; set `scale`, the metres per unit of the file")
        assert got in message


def test_parts_are_meshed_side_by_side_as_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", "off")
    scene = read_scene(Path(__file__).parents[2] / "examples" / "connecting_rod" / "scene.toml")
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    found = part_meshes(scene, ["crank", "slider"])
    assert list(found) == ["crank", "slider"]
    for name, mesh in found.items():
        alone = solid_mesh(scene, name)
        # 2e-12 m seen, by sums in another order
        assert_allclose(mesh.points, alone.points, rtol=0, atol=1e-10)
        assert np.array_equal(mesh.cells, alone.cells)
        assert mesh.method == alone.method
