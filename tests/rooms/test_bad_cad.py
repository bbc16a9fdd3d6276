"""CAD files and solids that are refused, and what is said."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kedfem.errors import MeshError
from kedfem.mesh import mesh_quality
from kedfem.mesh.cad.model import solid_model
from kedfem.mesh.cad.solids import OtherMethodError
from kedfem.mesh.elements.hexahedra import SolidMesh
from kedfem.mesh.methods import healed, made_mesh
from kedfem.scene import Cad, link_from
from tests import bad_cad
from tests.rooms.cad_files import FORMATS, KEYS, MM, parts_in, read, refused, written


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return parts_in(tmp_path_factory.mktemp("cad"))


class TestBadFile:
    def test_that_is_not_there(self, tmp_path):
        assert refused(tmp_path / "rod.step") == (
            "links.rod.shape.file: must be a CAD file (.step, .stp, .iges, .igs, .brep, .brp), got nothing at FILE"
        )

    def test_that_is_a_folder(self, tmp_path):
        (tmp_path / "rod.step").mkdir()
        assert refused(tmp_path / "rod.step").endswith("got a folder at FILE")

    def test_with_another_ending(self, tmp_path):
        (tmp_path / "rod.sldprt").write_text("x")
        assert refused(tmp_path / "rod.sldprt").endswith("(.step, .stp, .iges, .igs, .brep, .brp), got FILE")

    def test_that_is_empty(self, tmp_path):
        (tmp_path / "rod.step").write_text(" \n")
        assert refused(tmp_path / "rod.step").endswith("got an empty file at FILE")

    def test_that_must_not_be_read(self, parts, monkeypatch):
        def denied(_: Path) -> bytes:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(Path, "read_bytes", denied)
        assert refused(parts / "lever.step") == (
            "links.rod.shape.file: must be a file that can be read, got FILE: Permission denied"
        )

    @pytest.mark.parametrize(("ending", "form"), [("step", "STEP"), ("igs", "IGES"), ("brep", "BREP")])
    def test_that_is_something_else(self, tmp_path, ending, form):
        path = tmp_path / f"rod.{ending}"
        path.write_text("Dear Sir or Madam\n")
        assert refused(path) == f"links.rod.shape.file: must hold {form}, as its ending says, got another text in FILE"

    @pytest.mark.parametrize("share", [0.5, 0.8, 0.95])
    @pytest.mark.parametrize(("ending", "form"), [("step", "STEP"), ("igs", "IGES"), ("brep", "BREP")])
    def test_that_breaks_off(self, parts, ending, form, share):
        text = (parts / f"lever.{ending}").read_text()
        path = parts / f"broken.{ending}"
        path.write_text(text[: int(share * len(text))])
        assert refused(path) == f"links.rod.shape.file: must be a whole file of {form}, got one that breaks off: FILE"

    def test_with_a_gap_inside(self, parts):
        text = (parts / "lever.step").read_text()
        path = parts / "gap.step"
        path.write_text(text[: len(text) // 2] + "\nENDSEC;\nEND-ISO-10303-21;\n")
        message = refused(path)
        assert message.startswith("links.rod.shape.file: must be a file that OpenCASCADE can read as STEP, got FILE: ")

    @pytest.mark.parametrize("ending", FORMATS)
    def test_with_open_faces(self, tmp_path, ending):
        written(tmp_path, "sheet", lambda occ: occ.addRectangle(0, 0, 0, 10, 10), (ending,))
        assert refused(tmp_path / f"sheet.{ending}") == (
            "links.rod.shape.file: must hold a solid, got faces that do not close (1 of them, 4 free edges, one at "
            "(5, 0, 0) mm) in FILE; close them, or export the part as a solid"
        )

    def test_with_curves_alone(self, tmp_path):
        written(tmp_path, "ring", lambda occ: occ.addCircle(0, 0, 0, 10), ("step",))
        assert refused(tmp_path / "ring.step").endswith("must hold a solid, got 1 curves and no faces in FILE")


def prism(*corners: tuple[float, float]) -> Callable[[Any], None]:
    def draw(occ: Any) -> None:
        points = [occ.addPoint(x, y, 0) for x, y in corners]
        lines = [occ.addLine(P, Q) for P, Q in zip(points, points[1:] + points[:1], strict=True)]
        occ.extrude([(2, occ.addPlaneSurface([occ.addWire(lines)]))], 0, 0, 5)

    return draw


class TestBadSolid:
    def test_that_cuts_itself(self, tmp_path):
        corners = (0, 0), (40, 0), (40, 30), (30, 30), (30, -10), (20, -10), (20, 20), (0, 20)
        written(tmp_path, "cut", prism(*corners), ("step",))
        message = refused(tmp_path / "cut.step")
        assert message.startswith(
            "links.rod.shape.file: must be a closed solid that does not intersect itself, got a plane face facing "
        )
        assert message.endswith(" mm; mend the part in CAD")

    def test_without_volume(self, tmp_path):
        written(tmp_path, "bow", prism((0, 0), (40, 0), (0, 30), (40, 30)), ("step",))
        message = refused(tmp_path / "bow.step")
        assert "must hold a solid of positive volume [m³], got " in message
        assert message.endswith("its faces may be turned inwards or lie on each other: mend the part in CAD")


class TestMended:
    """What OpenCASCADE's mending closes is taken, and told; what it does not is refused as before."""

    @pytest.mark.parametrize(("width", "said"), [(0.005, ""), (0.02, "0.064"), (0.05, "0.064")])
    def test_faces_with_a_gap_are_sewn(self, tmp_path, width, said):
        solid = read(bad_cad.gap(tmp_path, width))
        # sewing may leave the top or take the sides to it
        assert 60 * 20 * 10 * MM**3 * (1 - 1e-9) <= solid.volume <= 60 * 20 * (10 + width) * MM**3 * (1 + 1e-9)
        assert solid.mended == (said and f"faces up to {said} mm apart sewn")
        assert len(solid.faces) == 6

    def test_a_gap_above_a_thousandth_of_the_size_is_refused(self, tmp_path):
        assert "faces that do not close (6 of them, 8 free edges" in refused(bad_cad.gap(tmp_path, 0.2))

    def test_the_meshs_line_tells_the_mending(self, tmp_path):
        path = bad_cad.gap(tmp_path, 0.02)
        link = link_from({"shape": {"kind": "cad", "file": path.name}, "material": "steel"})
        mesh = made_mesh(KEYS, "rod", link, Cad(file=path.name), path)
        assert mesh.method.endswith("; faces up to 0.064 mm apart sewn")

    def test_a_step_of_half_a_micrometre_does_not_stop_a_part(self, tmp_path):
        path = bad_cad.sliver(tmp_path)
        link = link_from({"shape": {"kind": "cad", "file": path.name}, "material": "steel"})
        mesh = made_mesh(KEYS, "rod", link, Cad(file=path.name), path)
        assert 3 * len(mesh.points) < 45_000
        assert mesh_quality(mesh).least > 0  # flat beside the step, not folded


class TestHealing:
    """Tiny edges and faces that are healed away where tetrahedra fail, on a part that cannot lose all of them."""

    WISHBONE = Path(__file__).parents[2] / "geometry" / "wishbone.step"

    def test_ends_where_a_face_cannot_be_closed_any_more(self):
        with solid_model(KEYS, self.WISHBONE, "rod", Cad(file="wishbone.step")) as (gmsh, solid):
            shares = [words for _, words in healed(gmsh, "rod", solid, 50 * MM)]
        assert shares == ["edges and faces below 1.5 mm healed away"]

    def test_says_why_the_part_itself_has_no_mesh(self, monkeypatch):
        def fails(*_: object) -> SolidMesh:
            raise MeshError("rod: must be a solid that can be meshed, got none: of overlapping facets")

        def unfit(*_: object) -> SolidMesh:
            raise OtherMethodError("healed no better")

        monkeypatch.setattr("kedfem.mesh.methods.best_mesh", fails)
        monkeypatch.setattr("kedfem.mesh.methods.tetrahedral_mesh", unfit)
        link, shape = link_from({"shape": {"file": "wishbone.step"}}), Cad(file="wishbone.step")
        with pytest.raises(MeshError, match="of overlapping facets"):
            made_mesh(KEYS, "rod", link, shape, self.WISHBONE)
