"""Shapes and files that cannot be meshed: each fault is named with what was wanted and what was got."""

import re
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import MeshError
from kedfem.mesh import SolidMesh, checked_mesh, link_mesh, session
from kedfem.mesh.elements.shape_functions import HEX8
from kedfem.mesh.files.raw import RawMesh
from kedfem.mesh.layered import outlines
from kedfem.mesh.session import gmsh_model
from kedfem.scene import LinkScene
from kedfem.scene.records.outlines import crossing_at

BAR = {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.1, "thickness": 0.1}
PLATE = {"kind": "plate_link", "between": [[0, 0], [0.2, 0]], "width": 0.04, "thickness": 0.01, "bore_diameter": 0.02}
SQUARE = {"kind": "extrusion", "outline": [[0, 0], [1, 0], [1, 1], [0, 1]], "thickness": 0.1}
CUBE = (HEX8 + 1) / 2
CORNERS = np.arange(8)[None]


def refused(shape: dict | None, folder: Path = Path(), **link: object) -> str:
    """The message of the MeshError that a link's mesh ends in."""
    with pytest.raises(MeshError) as caught:
        link_mesh("arm", LinkScene(shape=shape, **link), folder)
    return str(caught.value)


def part(folder: Path, text: str, between: tuple = ((0, 0), (1, 0))) -> str:
    (folder / "plate.toml").write_text(text, encoding="utf-8")
    return refused({"kind": "part", "file": "plate.toml", "between": between}, folder)


def mesh_file(folder: Path, points: np.ndarray, cells: list, name: str = "arm.vtu") -> str:
    meshio.Mesh(points, cells).write(folder / name)
    return refused({"kind": "mesh", "file": name}, folder)


class TestMeshFile:
    def test_missing(self, tmp_path):
        message = refused({"kind": "mesh", "file": "arm.vtu"}, tmp_path)
        assert message.startswith("links.arm.shape.file: must be a mesh file (.msh, .unv, .bdf, ")
        assert message.endswith(f".exo), got nothing at {tmp_path / 'arm.vtu'}")

    def test_folder(self, tmp_path):
        message = refused({"kind": "mesh", "file": "."}, tmp_path)
        assert message.endswith(f", got a folder at {tmp_path}")

    @pytest.mark.parametrize("name", ["arm.vtu", "arm.msh", "arm.vtk", "arm.inp", "arm.xdmf", "arm.med", "arm.stl"])
    @pytest.mark.parametrize("content", [b"", b"\x00\xff\x13 no mesh at all \xfe" * 9, b"<VTKFile type='PolyData'>"])
    def test_corrupt(self, tmp_path, name, content, capfd):
        (tmp_path / name).write_bytes(content)
        message = refused({"kind": "mesh", "file": name}, tmp_path)
        assert message.startswith("links.arm.shape.file: must ")
        assert f"{tmp_path / name}" in message
        assert "Traceback" not in message
        assert capfd.readouterr() == ("", "")

    def test_cut_off(self, tmp_path):
        meshio.Mesh(CUBE, [("hexahedron", CORNERS)]).write(tmp_path / "arm.vtu")
        whole = (tmp_path / "arm.vtu").read_bytes()
        (tmp_path / "arm.vtu").write_bytes(whole[: len(whole) // 2])
        message = refused({"kind": "mesh", "file": "arm.vtu"}, tmp_path)
        assert message.startswith(
            f"links.arm.shape.file: must be a mesh file that can be read, got {tmp_path / 'arm.vtu'}: "
        )

    def test_unknown_kind_of_file(self, tmp_path):
        (tmp_path / "arm.step").write_text("ISO-10303-21;")
        message = refused({"kind": "mesh", "file": "arm.step"}, tmp_path)
        assert message.endswith(f".exo), got {tmp_path / 'arm.step'}")

    def test_other_elements(self, tmp_path):
        message = mesh_file(tmp_path, CUBE, [("quad", np.arange(4)[None])])
        assert message == (
            "links.arm.shape.file: must hold tetrahedra, hexahedra, wedges or pyramids of order 1 or 2, got no solid "
            f"elements in {tmp_path / 'arm.vtu'}"
        )

    def test_elements_of_a_higher_order(self, tmp_path):
        with gmsh_model() as gmsh:
            gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
            gmsh.model.occ.synchronize()
            gmsh.model.mesh.generate(3)
            gmsh.model.mesh.setOrder(3)
            gmsh.write(str(tmp_path / "arm.msh"))
        assert re.search(r"of order 1 or 2, got \d+ tetra20 in", refused({"kind": "mesh", "file": "arm.msh"}, tmp_path))

    @pytest.mark.parametrize("number", [np.nan, np.inf])
    def test_coordinates_that_are_no_numbers(self, tmp_path, number):
        points = CUBE.copy()
        points[5, 1] = number
        message = mesh_file(tmp_path, points, [("hexahedron", CORNERS)])
        assert message == (
            f"links.arm.shape.file: coordinates must be finite, got [1.0, {number}, 1.0] "
            f"at node 5 of {tmp_path / 'arm.vtu'}"
        )

    def test_nodes_that_are_not_there(self, tmp_path):
        message = mesh_file(tmp_path, CUBE, [("hexahedron", CORNERS + 3)])
        assert "elements must use nodes 0 to 7, got node 10 in" in message

    def test_two_coordinates(self, tmp_path, monkeypatch):
        (tmp_path / "arm.vtu").touch()
        flat = RawMesh(CUBE[:, :2], {"hexahedron": CORNERS})
        monkeypatch.setattr("kedfem.mesh.files.read.raw_of_file", lambda *_: flat)
        message = refused({"kind": "mesh", "file": "arm.vtu"}, tmp_path)
        assert "must have nodes of three coordinates, got shape (8, 2) in" in message

    def test_pieces_that_share_no_nodes(self, tmp_path):
        points = np.concatenate([CUBE, np.add(CUBE, [1, 0, 0])])  # they touch, but have nodes of their own
        message = mesh_file(tmp_path, points, [("hexahedron", np.stack([np.arange(8), np.arange(8, 16)]))])
        assert "must be one piece, got 2 pieces that share no nodes in" in message
        assert "merge nodes that lie on each other" in message

    def test_inverted_element(self, tmp_path):
        points = np.concatenate([CUBE, CUBE[[1, 2, 5, 6]] + [1, 0, 0]])
        good, bad = np.arange(8), np.array([1, 8, 9, 2, 5, 10, 11, 6])
        message = mesh_file(tmp_path, points, [("hexahedron", np.stack([good, bad[[4, 5, 6, 7, 0, 1, 2, 3]]]))])
        assert message == (
            "links.arm: elements must not be inverted or folded, got scaled Jacobian -1 in element 1 "
            "at (1500, 500, 500) mm; refine the mesh or mend the mesh file"
        )

    def test_mirrored_mesh(self, tmp_path):
        message = mesh_file(tmp_path, CUBE * [1, 1, -1], [("hexahedron", CORNERS)])
        assert message.endswith("at (500, 500, -500) mm; the order of their nodes is mirrored")

    def test_element_without_volume(self, tmp_path):
        message = mesh_file(tmp_path, CUBE * [1, 1, 0], [("hexahedron", CORNERS)])
        assert "got scaled Jacobian 0 in element 0 at (500, 500, 0) mm" in message


def test_quality_below_the_gate_names_the_element():
    points = np.concatenate([HEX8 * 1.0, HEX8[[1, 2, 5, 6]] + [2.0, 0, 0]])
    points[8:] += [0, 20, 0]  # the second element is sheared to an angle of atan(0.1)
    mesh = SolidMesh(points, np.stack([np.arange(8), [1, 8, 9, 2, 5, 10, 11, 6]]))
    with pytest.raises(MeshError) as caught:
        checked_mesh("links.rocker", mesh, 0.1)
    assert str(caught.value) == (
        "links.rocker: scaled Jacobian must be at least 0.1 everywhere, "
        "got 0.0995 in element 1 at (2000, 10000, 0) mm; refine the mesh (mesh.size, mesh.elements_across), "
        "change the shape there, or lower min_quality"
    )


def test_gate_of_the_scene_is_the_one_that_counts():
    message = refused(PLATE, min_quality=0.95)
    assert message.startswith("links.arm: scaled Jacobian must be at least 0.95 everywhere, got 0.6")


class TestSizes:
    def test_larger_than_the_link(self):
        message = refused(SQUARE, mesh={"size": 2.0})
        assert message == "links.arm.mesh.size: must be below the link's own size 1.41421 [m], got 2"

    def test_too_fine(self):
        assert refused(SQUARE, mesh={"size": 1e-4}) == (
            "links.arm.mesh.size: must give at most 2,000,000 elements, got about 100,000,000; take a coarser mesh"
        )

    def test_too_many_across_and_layers(self):
        message = refused(PLATE, mesh={"elements_across": 400, "layers": 5})
        assert "links.arm.mesh.elements_across: must give at most 2,000,000 elements, got" in message

    def test_too_many_elements_of_a_bar(self):
        message = refused(BAR, mesh={"elements": [1000, 300, 10]})
        assert message == (
            "links.arm.mesh.elements: must give at most 2,000,000 elements, got about 3,000,000; take a coarser mesh"
        )

    def test_eyes_too_close_for_a_waist(self):
        message = refused(PLATE | {"eye_diameter": 0.2})
        assert message == (
            "links.arm.shape.eye_diameter: must be at most 0.181818 [m], the distance of the bores over 1.1, "
            "for eyes wider than the waist, got 0.2"
        )


OUTLINE = "outline = [[0, 0], [1, 0], [1, 1], [0, 1]]\nthickness = 0.1\norigin = [0, 0]\nx_point = [1, 0]\n"


HOLES = OUTLINE + "holes = [{at = [0.4, 0.5], diameter = 0.3}, {at = [%g, 0.5], diameter = 0.3}]"
PART_FAULTS = [
    (OUTLINE + "colour = 3", "colour: unknown key"),
    (OUTLINE.replace("thickness = 0.1", ""), "thickness: is required [m], got nothing"),
    (OUTLINE.replace("x_point = [1, 0]", ""), "x_point: is required"),
    (OUTLINE.replace("x_point = [1, 0]", "x_point = [0, 0]"), "x_point: must differ from the origin"),
    (OUTLINE.replace("[1, 1], [0, 1]", "[0, 1], [1, 1]"), "outline: must not cross or touch itself"),
    (OUTLINE.replace("[1, 1], [0, 1]]", "]"), "outline: must be at least three points, got 2"),
    (OUTLINE.replace("[1, 1]", "{via = [1, 0.5], to = [1, 1]}"), "arcs through three points not in line"),
    (OUTLINE.replace("0.1", "-0.1"), "thickness: must be positive [m], got -0.1"),
    (HOLES % 0.9, "holes[1]: must lie inside the outline"),
    (HOLES % 0.6, "holes[1]: must not meet holes[0]"),
    ("outline = [", "must be valid TOML"),
    ("", "must hold at least one key, got an empty file"),
]


class TestPart:
    @pytest.mark.parametrize(("text", "fault"), PART_FAULTS)
    def test_with_a_fault_in_its_file(self, tmp_path, text, fault):
        message = part(tmp_path, text)
        assert message.startswith("links.arm.shape.file: ")
        assert fault in message

    def test_without_its_file(self, tmp_path):
        message = refused({"kind": "part", "file": "rod.toml", "between": [[0, 0], [1, 0]]}, tmp_path)
        assert message == f"links.arm.shape.file: {tmp_path / 'rod.toml'}: must be a file, got nothing there"

    def test_between_points_that_are_not_as_far_apart(self, tmp_path):
        assert part(tmp_path, OUTLINE, ((0, 0), (1.001, 0))) == (
            "links.arm.shape.between: must be as far apart as origin and x_point of plate.toml, 1 [m], got 1.001"
        )


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e3])
@pytest.mark.parametrize("turn", [0.0, 0.4, 2.1, 4.0])
@pytest.mark.parametrize(
    ("corners", "place"),
    [
        ([(0, 0), (2, 0), (2, 1), (0.6, 0), (0, 1)], (0.6, 0)),
        ([(0, 0), (2, 0), (1, 1), (2, 2), (0, 2), (1, 1)], (1, 1)),
        ([(0, 0), (2, 0), (2, 0), (0, 1)], (2, 0)),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], (1, 1)),
        ([(0, 0), (2, 0), (2, 1), (0.6, 1e-6), (0, 1)], None),
    ],
    ids=["a corner on a side", "two corners", "a corner twice", "crossing", "a narrow neck"],
)
def test_where_an_outline_touches_itself_is_found_in_any_direction_and_size(corners, place, turn, scale):
    """Rounding leaves a corner that is put on a side some 1e-16 of the size beside it, on either side."""
    R = scale * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    found = crossing_at(np.array(corners) @ R.T + scale)
    assert (found is None) == (place is None)
    if place is not None:
        assert_allclose(found, R @ place + scale, atol=1e-9 * scale)


class TestShape:
    def test_none(self):
        message = refused(None, model="rigid")
        assert message == "links.arm.shape: must be bar, plate_link, extrusion, part, mesh or cad, got no shape"

    def test_for_beams_only(self):
        line = {"kind": "polyline", "points": [[0, 0], [1, 0]], "width": 0.1, "thickness": 0.1}
        assert refused(line).endswith("got polyline")


class MissingLibrary:
    """Stands before all importers and fails as a shared library that does not load."""

    def find_spec(self, name: str, *_: object) -> None:
        if name == "gmsh":
            raise OSError("libGLU.so.1: cannot open shared object file: No such file or directory")


class TestGmsh:
    def test_without_its_system_libraries(self, monkeypatch):
        monkeypatch.delitem(sys.modules, "gmsh", raising=False)
        monkeypatch.setattr(sys, "meta_path", [MissingLibrary(), *sys.meta_path])
        message = refused(SQUARE)
        assert message.startswith(
            "gmsh: must find its system libraries, got: libGLU.so.1: cannot open shared object file: "
            "No such file or directory; on Debian or Ubuntu: apt-get install libglu1-mesa "
        )
        for package in ("libxrender1", "libxcursor1", "libxft2", "libxinerama1", "libgl1"):
            assert package in message

    def test_not_installed(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "gmsh", None)
        assert refused(SQUARE) == "gmsh: must be installed to mesh this shape (pip install gmsh), got none"

    def test_that_leaves_triangles(self, monkeypatch):
        monkeypatch.setattr(session, "QUAD4", -1)
        assert refused(SQUARE | {"holes": [{"at": [0.2, 0.3], "diameter": 0.1}]}) == (
            "links.arm.shape: quadrilaterals must fill the sections of its layers, got none around "
            "(0.310361, 0.373113, 0); change mesh.size or the outline"
        )

    def test_that_gives_up_says_why(self, monkeypatch):
        def failing(*_: object) -> None:
            raise Exception("Could not create wire")

        monkeypatch.setattr(outlines, "surface_of", failing)
        assert refused(SQUARE) == (
            "links.arm.shape: must be an area, got none from OpenCASCADE: Could not create wire; change the outline"
        )

    def test_is_closed_after_an_error(self):
        import gmsh

        with pytest.raises(RuntimeError, match="mine"), gmsh_model():
            raise RuntimeError("mine")
        assert not gmsh.isInitialized()
