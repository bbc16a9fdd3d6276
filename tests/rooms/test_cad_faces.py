"""The sides of elements on the faces of a solid, and groups of them in mesh files."""

import math
from pathlib import Path
from types import ModuleType
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.mesh.cad.faces import with_faces
from kedfem.mesh.cad.model import solid_model
from kedfem.mesh.cad.sides import boundary_sides, side_normals
from kedfem.mesh.cad.solids import Solid
from kedfem.mesh.elements.hexahedra import Face, SolidMesh
from kedfem.mesh.files.raw import from_meshio
from kedfem.mesh.files.read import mesh_from_file
from kedfem.scene.records.shapes import Cad
from tests.rooms.cad_files import FORMATS, KEYS, MM, parts_in, written


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return parts_in(tmp_path_factory.mktemp("cad"))


def subdivided(gmsh: ModuleType, size: float, folder: Path) -> SolidMesh:
    """The solid in the model as 27-node hexahedra with curved sides: any mesh will do."""
    for key, value in (("MeshSizeMax", size), ("SubdivisionAlgorithm", 2), ("ElementOrder", 2)):
        gmsh.option.setNumber(f"Mesh.{key}", value)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(folder / "mesh.msh"))
    return mesh_from_file("mesh", folder / "mesh.msh", 1.0)


def meshed(folder: Path, path: Path, size: float) -> tuple[Solid, SolidMesh]:
    with solid_model(KEYS, path, "rod", Cad(file=path.name)) as (gmsh, solid):
        return solid, with_faces(gmsh, solid, subdivided(gmsh, size, folder))


def area(mesh: SolidMesh, face: Face) -> float:
    return float(side_normals(mesh.points, face.sides)[2].sum())


class TestSides:
    @pytest.mark.parametrize("ending", FORMATS)
    def test_each_is_on_one_face_and_faces_are_covered(self, parts, tmp_path, ending):
        solid, mesh = meshed(tmp_path, parts / f"lever.{ending}", 4 * MM)
        sides = [tuple(sorted(side)) for face in mesh.faces for side in face.sides.tolist()]
        assert len(sides) == len(set(sides)) == len(boundary_sides(mesh.cells))
        for face, wanted in zip(mesh.faces, solid.faces, strict=True):
            assert face.name == wanted.name
            assert_allclose(area(mesh, face), wanted.area, rtol=0.05)  # chords instead of arcs

    def test_nodes_are_on_their_face(self, parts, tmp_path):
        _, mesh = meshed(tmp_path, parts / "lever.step", 4 * MM)
        for face in mesh.faces:
            off = mesh.points[np.unique(face.sides)] - face.centre
            if face.kind == "plane":
                assert_allclose(off @ face.direction, 0, atol=1e-9)
            elif face.kind == "cylinder":
                assert_allclose(np.linalg.norm(np.cross(off, face.direction), axis=1), face.radius, atol=1e-9)

    def test_of_a_plane_split_in_two(self, tmp_path):
        def draw(occ: Any) -> None:
            box = occ.addBox(0, 0, 0, 20, 10, 5)
            occ.fragment([(3, box)], [(2, occ.addDisk(5, 5, 5, 3, 3))])

        written(tmp_path, "split", draw, ("step",))
        solid, mesh = meshed(tmp_path, tmp_path / "split.step", 2 * MM)
        top = [face for face in mesh.faces if face.direction[2] > 0.5]
        wanted = sorted([math.pi * 9 * MM**2, (200 - math.pi * 9) * MM**2])
        assert_allclose(sorted(area(mesh, face) for face in top), wanted, rtol=0.05)
        assert len(solid.faces) == 7

    def test_of_a_bore_in_two_halves_are_one_face(self, tmp_path):
        def draw(occ: Any) -> None:
            box = occ.addBox(0, 0, 0, 20, 10, 5)
            halves = [occ.addCylinder(5, 5, -1, 0, 0, 9, 2, angle=math.pi) for _ in (0, 1)]
            occ.rotate([(3, halves[1])], 5, 5, 0, 0, 0, 1, math.pi)
            occ.cut([(3, box)], [(3, half) for half in halves])

        written(tmp_path, "halves", draw, ("step",))
        solid, mesh = meshed(tmp_path, tmp_path / "halves.step", 2 * MM)
        assert [face.kind for face in solid.faces].count("cylinder") == 2
        (bore,) = [face for face in mesh.faces if face.kind == "cylinder"]
        assert bore.inward
        assert_allclose(bore.centre, [0.005, 0.005, 0.0025], atol=1e-9)
        assert_allclose(area(mesh, bore), 2 * math.pi * 2 * 5 * MM**2, rtol=0.05)

    def test_of_a_clevis_stay_two_bores(self, tmp_path):
        def draw(occ: Any) -> None:
            block, gap = occ.addBox(0, 0, 0, 20, 10, 12), occ.addBox(-1, -1, 4, 15, 12, 4)
            fork, _ = occ.cut([(3, block)], [(3, gap)])
            occ.cut(fork, [(3, occ.addCylinder(5, 5, -1, 0, 0, 20, 2))])

        written(tmp_path, "clevis", draw, ("step",))
        _, mesh = meshed(tmp_path, tmp_path / "clevis.step", 3 * MM)
        assert sorted(round(f.centre[2], 9) for f in mesh.faces if f.inward) == [0.002, 0.01]

    def test_of_rounded_edges(self, tmp_path):
        def draw(occ: Any) -> None:
            box = occ.addBox(0, 0, 0, 20, 10, 8)
            occ.synchronize()
            occ.fillet([box], list(range(1, 13)), [1.5])

        written(tmp_path, "fillets", draw, ("step",))
        solid, mesh = meshed(tmp_path, tmp_path / "fillets.step", 2 * MM)
        assert {(f.kind, f.inward) for f in solid.faces} == {("plane", False), ("cylinder", False), ("sphere", False)}
        assert sum(len(face.sides) for face in mesh.faces) == len(boundary_sides(mesh.cells))
        assert len(mesh.faces) == len(solid.faces) == 26


class TestGroups:
    def test_of_a_mesh_file_are_faces(self, parts, tmp_path):
        path = parts / "lever.step"
        with solid_model(KEYS, path, "rod", Cad(file=path.name)) as (gmsh, solid):
            for i, face in enumerate(solid.faces):
                gmsh.model.addPhysicalGroup(2, [face.tag], i + 1, name="" if i == 0 else f"my {face.tag}")
            gmsh.model.addPhysicalGroup(2, [face.tag for face in solid.faces[:3]], 50, name="three")
            gmsh.model.addPhysicalGroup(3, [solid.tag], name="body")
            mesh = subdivided(gmsh, 3 * MM, tmp_path)
        found = {face.name: face for face in mesh.faces}
        assert "group 1" in found
        for face in solid.faces[1:]:
            mine = found[f"my {face.tag}"]
            assert (mine.kind, mine.inward) == (face.kind, face.inward)
            assert_allclose(mine.radius, face.radius, rtol=1e-5)
            assert_allclose(np.abs(mine.direction), np.abs(face.direction), atol=1e-6)

    def test_of_another_format(self, tmp_path):
        points = np.array([(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
        cells = [("hexahedron", [list(range(8))]), ("quad", [[4, 5, 6, 7], [0, 1, 2, 3]])]
        sets = {"above": [np.array([], dtype=int), np.array([0])], "both": [np.array([0]), np.array([0, 1])]}
        path = tmp_path / "cube.vtk"
        path.touch()
        raw = from_meshio(meshio.Mesh(points, cells, cell_sets=sets))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("kedfem.mesh.files.read.raw_of_file", lambda *_: raw)
            above, both = mesh_from_file("mesh", path, 2.0).faces
        assert (above.name, above.kind, both.name, both.kind) == ("above", "plane", "both", "other")
        assert_allclose([above.centre, above.direction], [[1, 1, 2], [0, 0, 1]], atol=1e-12)
