"""Tetrahedra: hexahedra divided into them, gmsh's own of any solid, folded ones mended, files of them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import meshio
import numpy as np
import pytest
from geometry.catalogue import written
from geometry.make import empty_model
from geometry.step_files import write_step
from numpy.testing import assert_allclose

from kedfem.errors import MeshError
from kedfem.links.build import bare_link
from kedfem.links.solid import solid_basis
from kedfem.mesh import SolidMesh, link_mesh, mesh_quality, part_mesh
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.sides import owned_sides
from kedfem.mesh.cad.solids import OtherMethodError, Sizing
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.elements.hexahedra import extruded, quadratic, rectangle_quads, without_unused_nodes
from kedfem.mesh.elements.shape_functions import TET10
from kedfem.mesh.elements.tetrahedra import FORMS, tetrahedral, unfolded
from kedfem.mesh.files.read import mesh_from_file
from kedfem.mesh.session import gmsh_model
from kedfem.mesh.swept.blends import swept_without_blends
from kedfem.scene import Cad, link_from, scene_from
from tests.laws.strategies import ring

FLOAT = 1e-12  # of a volume: a few hundred terms


def volume(mesh: SolidMesh) -> float:
    return float(solid_basis(mesh).dx.sum())


@pytest.fixture
def gmsh() -> Iterator[ModuleType]:
    with gmsh_model() as gmsh:
        yield gmsh


class TestDivided:
    def test_a_block_keeps_its_nodes_and_volume(self) -> None:
        """Six in each hexahedron, on no other nodes than hex27 has, sides of neighbours the same."""
        hexahedra = extruded(*rectangle_quads(3.0, 2.0, 3, 2), 1.0, 2)
        mesh = tetrahedral(hexahedra)
        assert len(mesh.cells) == 6 * len(hexahedra.cells)
        assert {tuple(x) for x in mesh.points.tolist()} <= {tuple(x) for x in hexahedra.points.tolist()}
        assert len(owned_sides(mesh.cells)[0]) == 2 * len(owned_sides(hexahedra.cells)[0])
        assert volume(mesh) == pytest.approx(6.0, rel=FLOAT)
        assert mesh_quality(mesh).least > 0.3

    def test_a_ring_keeps_its_bore(self) -> None:
        """Parabolas through three points of an arc of 2π/16: 6e-5 of a circle's area off at most, both forms alike."""
        hexahedra, mesh = ring(27, around=16), ring(10, around=16)
        assert valid_everywhere(mesh.points, mesh.cells).all()
        assert volume(mesh) == pytest.approx(volume(hexahedra), rel=1e-4)

    def test_of_hexahedra_with_fewer_nodes_is_that_of_their_27(self) -> None:
        few = FORMS["hex20"](extruded(*rectangle_quads(1.0, 1.0, 1, 1), 1.0, 1))
        assert_allclose(tetrahedral(few).points, tetrahedral(quadratic(few)).points)

    def test_tetrahedra_stay_in_every_form(self) -> None:
        mesh = tetrahedral(extruded(*rectangle_quads(1.0, 1.0, 1, 1), 1.0, 1))
        straight = without_unused_nodes(replace(mesh, cells=mesh.cells[:, :4]))
        for form in FORMS.values():
            assert form(mesh) is mesh
            assert_allclose(form(straight).points[: len(mesh.points)].sum(), mesh.points.sum())

    def test_scaled_jacobian_of_a_regular_one_is_1(self) -> None:
        corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])[[0, 1, 3, 2]]
        mesh = tetrahedral(SolidMesh(corners, np.arange(4)[None]))
        assert mesh_quality(mesh).least == pytest.approx(1.0, rel=FLOAT)


class TestMended:
    def test_folded_ones_are_straightened_as_far_as_needed(self) -> None:
        """A middle of an edge moved beyond the other side: valid again, and corners where they were."""
        points, cells = TET10.copy(), np.arange(10)[None]
        points[4] = [0.5, 0.6, 0.6]
        assert not valid_everywhere(points, cells).all()
        mended = unfolded(points, cells, 0.03)
        assert mended is not None
        assert valid_everywhere(mended, cells).all()
        assert_allclose(mended[:4], points[:4])

    def test_flat_ones_are_not(self) -> None:
        assert unfolded(TET10 * [1, 1, 0.0], np.arange(10)[None], 0.03) is None


#: Easy ones of the catalogue, a tiny edge, and a part whose grid of looks met the edge of a hole.
SOME = ("casting", "ball_seat", "bent_bar", "chamfered_bushing", "hook")
#: The rest of a representative ten, slower.
MORE = ("lever_with_rounded_edges", "ribbed_bell_crank", "rod_end_with_thread", "forged_rocker", "i_section_rod")


@pytest.mark.parametrize("name", [*SOME[:2], *(pytest.param(n, marks=pytest.mark.long) for n in (*SOME[2:], *MORE))])
def test_parts_of_the_catalogue_are_meshed(name: str, tmp_path: Path) -> None:
    """None refused, det J > 0 all over, at most 45,000 unknowns, volume within 0.5 % of CAD."""
    file, exact = written(name, tmp_path)
    given = {"shape": {"kind": "cad", "file": file.name}, "material": "steel"}
    mesh = part_mesh(link_from(given), tmp_path)
    assert valid_everywhere(mesh.points, mesh.cells).all()
    assert 3 * len(mesh.points) <= 45_000
    assert volume(mesh) == pytest.approx(exact, rel=5e-3)


@pytest.mark.long
def test_hexahedra_at_any_price_are_gmshs_subdivision(tmp_path: Path) -> None:
    with empty_model() as occ:
        occ.intersect([(3, occ.addSphere(0, 0, 0, 10))], [(3, occ.addBox(0, 0, 0, 20, 20, 20))])
        occ.synchronize()
        write_step(tmp_path / "ball.step", ["ball"])
    shape = {"kind": "cad", "file": "ball.step"}
    given = {"shape": shape, "material": "steel", "mesh": {"kind": "hexahedra", "size": "5 mm"}, "min_quality": 0.0}
    mesh = part_mesh(link_from(given), tmp_path)
    assert mesh.cell_type == "hexahedron27"
    assert "gmsh's subdivision" in mesh.method
    with pytest.raises(MeshError, match=r"scaled Jacobian must be at least 0\.9 everywhere"):
        part_mesh(link_from(given | {"min_quality": 0.9}), tmp_path)


class TestBlends:
    """Small convex rounds and chamfers go where a part can be swept then; concave ones on request; told in `way`."""

    def made(self, name: str, folder: Path, ignore: float | None = None, **sizing: Any) -> SolidMesh:
        file, _ = written(name, folder)
        with solid_model(CadKeys("file", "solid"), file, name, Cad(file=file.name)) as (gmsh, solid):
            mesh = swept_without_blends(gmsh, solid, Sizing(defeature_size=ignore, **sizing))
            off = volume(mesh) / solid.volume - 1
        told = float(mesh.method.partition("), ")[2].partition(" % of the volume")[0])
        assert told == pytest.approx(100 * off, abs=0.01)  # parabolas for arcs
        return mesh

    def test_chamfers_of_bores_go_by_themselves(self, tmp_path: Path) -> None:
        """4 chamfers of 1 mm, of π (2 r + 2/3 mm) mm²/2 each over 27,658 mm³: 0.29 %; names of faces stay."""
        mesh = self.made("plate_with_chamfered_bores", tmp_path)
        assert mesh.cell_type == "hexahedron27"
        assert "left out: 4 blends below 1.57 mm (face 2, face 7, face 11, face 12), +0.29 %" in mesh.method
        bores = [face for face in mesh.faces if face.kind == "cylinder"]
        assert_allclose([face.radius for face in bores], [6e-3, 6e-3], rtol=1e-6)
        with pytest.raises(OtherMethodError, match="more than small blends"):
            self.made("plate_with_chamfered_bores", tmp_path, kept_points=((0.02 + 0.0065, 0.015, 0.0005),))
        with pytest.raises(OtherMethodError, match="more than small blends"):
            self.made("plate_with_chamfered_bores", tmp_path, kept_faces=("face 7",))
        with pytest.raises(OtherMethodError, match="more than small blends"):
            self.made("plate_with_chamfered_bores", tmp_path, ignore=0.5e-3)

    def test_concave_fillets_go_on_request(self, tmp_path: Path) -> None:
        with pytest.raises(OtherMethodError, match="a concave fillet prevents layers"):
            self.made("crank_with_counterweight", tmp_path)
        assert "left out: 1 blend below 2 mm" in self.made("crank_with_counterweight", tmp_path, 2e-3).method

    def test_a_load_on_a_chamfer_keeps_it(self, tmp_path: Path) -> None:
        written("plate_with_chamfered_bores", tmp_path)
        for x, kind in ((0.1, "hexahedron27"), (0.0735, "tetra10")):
            raw = {
                "links": {"arm": {"material": "steel", "shape": {"file": "plate_with_chamfered_bores.step"}}},
                "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0.02, 0.015, 0.005]}},
                "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}},
                "loads": {"p": {"kind": "force", "link": "arm", "at": [x, 0.015, 0.0], "vector": [0, 1, 0]}},
                "analysis": {"end_time": 0.1, "step": 0.01},
            }
            assert bare_link(scene_from(raw, tmp_path), "arm").cell_type == kind


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("ending", ["msh", "inp", "vtu"])
def test_files_of_tetrahedra_are_links(gmsh: ModuleType, tmp_path: Path, order: int, ending: str) -> None:
    """Written by gmsh in its own order of nodes; physical groups of triangles are faces."""
    gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    low = next(tag for _, tag in gmsh.model.getEntities(2) if gmsh.model.occ.getCenterOfMass(2, tag)[0] < 1e-6)
    gmsh.model.addPhysicalGroup(2, [low], name="wall")
    gmsh.model.addPhysicalGroup(3, [1], name="body")
    gmsh.model.mesh.generate(3)
    gmsh.write(str(tmp_path / "box.msh"))
    file = tmp_path / f"box.{ending}"
    if ending != "msh":
        meshio.write(file, meshio.read(tmp_path / "box.msh"))
    mesh = mesh_from_file("mesh", file, 1.0)
    link = link_from({"shape": {"kind": "mesh", "file": file.name}, "material": "steel"})
    made = link_mesh("box", link, tmp_path)
    assert made.cell_type == "tetra10"
    assert volume(made) == pytest.approx(2.0, rel=1e-9)
    if ending == "msh":
        (wall,) = mesh.faces
        assert (wall.name, wall.kind) == ("wall", "plane")
        assert_allclose(wall.direction, [-1, 0, 0], atol=1e-9)
