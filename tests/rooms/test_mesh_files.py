"""Mesh files: what each form holds comes through, sets of sides and nodes are faces, several kinds make one mesh."""

import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import MeshError
from kedfem.mesh import mesh_quality
from kedfem.mesh.cad.sides import boundary_sides
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.elements.mixed import EDGES_OF
from kedfem.mesh.elements.shape_functions import HEX20, HEX27
from kedfem.mesh.elements.tetrahedra import FORMS
from kedfem.mesh.files import read
from kedfem.mesh.files.raw import read_mesh
from kedfem.mesh.files.read import mesh_from_file
from kedfem.mesh.session import gmsh_model
from tests.works import endless, killed

from .test_mesh import volume

BRICK = 2 * 1 * 1  # of the box below


def box(path: Path, order: int = 2, hexahedra: bool = False, groups: bool = True) -> Path:
    """A box of gmsh's with named sides, in whatever form the ending says."""
    with gmsh_model() as gmsh:
        gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
        gmsh.model.occ.synchronize()
        if hexahedra:
            for _, edge in gmsh.model.getEntities(1):
                gmsh.model.mesh.setTransfiniteCurve(edge, 4)
            for _, side in gmsh.model.getEntities(2):
                gmsh.model.mesh.setTransfiniteSurface(side)
                gmsh.model.mesh.setRecombine(2, side)
            gmsh.model.mesh.setTransfiniteVolume(1)
        for _, side in gmsh.model.getEntities(2) if groups else ():
            x = gmsh.model.occ.getCenterOfMass(2, side)[0]
            if abs(x - 1) > 0.5:
                gmsh.model.addPhysicalGroup(2, [side], name="left" if x < 1 else "right")
        if groups:
            gmsh.model.addPhysicalGroup(3, [1], name="body")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.6)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)  # 20 nodes, which every form can hold
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    return path


@pytest.mark.parametrize(("order", "hexahedra"), [(1, False), (2, False), (1, True), (2, True)])
@pytest.mark.parametrize("ending", ["msh", "unv", "bdf", "med", "mesh", "vtk"])
def test_every_form_gives_the_same_mesh(tmp_path: Path, ending: str, order: int, hexahedra: bool) -> None:
    path = box(tmp_path / f"box.{ending}", order, hexahedra)
    mesh = mesh_from_file("mesh", path, 0.5)
    kind = "hex" if hexahedra else "tet"
    assert mesh.cells.shape[1] in {"hex": {8, 20, 27}, "tet": {4, 10}}[kind]
    made = FORMS["hex20" if hexahedra else "tet10"](mesh)
    assert volume(made) == pytest.approx(BRICK / 8, rel=1e-9)
    assert valid_everywhere(made.points, made.cells).all()
    if ending == "bdf":
        assert all(re.fullmatch(r"surface \d+", face.name) for face in mesh.faces)
        assert [face.kind for face in mesh.faces] == ["plane", "plane"]
    if ending in {"msh", "unv", "med"}:
        assert [face.name for face in mesh.faces] == ["left", "right"]
        for face, x in zip(mesh.faces, (0.0, 1.0), strict=True):
            assert face.kind == "plane"
            assert_allclose(mesh.points[face.sides][..., 0], x, atol=1e-12)


def cut_box(kinds: str, quadratic: bool) -> meshio.Mesh:
    """The brick 2 × 1 × 1 of one hexahedron and, beside it, a hexahedron, two wedges, or pyramids and tetrahedra."""
    X = np.array([(x, y, z) for x in (0, 1, 2) for z in (0, 1) for y in (0, 1)], dtype=float)
    at = {tuple(p): i for i, p in enumerate(X.astype(int).tolist())}
    unit = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    first = [at[p] for p in unit]
    a, b, c, d, e, f, g, h = (at[x + 1, y, z] for x, y, z in unit)
    cells: dict[str, list[list[int]]] = {"hexahedron": [first]}
    match kinds:
        case "wedges":
            cells["wedge"] = [[a, b, c, e, f, g], [a, c, d, e, g, h]]
        case "pyramids":  # all from the middle; two on the far side divided into tetrahedra
            X = np.vstack([X, [1.5, 0.5, 0.5]])
            m = len(X) - 1
            cells["pyramid"] = [[a, d, h, e, m], [a, b, c, d, m], [e, h, g, f, m], [a, e, f, b, m], [d, c, g, h, m]]
            cells["tetra"] = [[b, f, g, m], [b, g, c, m]]
        case "hexahedra":
            cells["hexahedron"].append([a, b, c, d, e, f, g, h])
    raw = meshio.Mesh(X, [(kind, np.array(each)) for kind, each in cells.items()])
    return promoted(raw) if quadratic else raw


@pytest.fixture(autouse=True)
def _kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Quadratic wedges and pyramids, which meshio writes but does not hold."""
    for kind in ("wedge15", "pyramid13"):
        monkeypatch.setitem(meshio._mesh.topological_dimension, kind, 3)


def promoted(raw: meshio.Mesh) -> meshio.Mesh:
    """All but hexahedra with middles of their edges, hexahedra with 20 nodes; edges bulge by a smooth map."""
    points, known, blocks = list(raw.points), {}, []
    names = {"hexahedron": "hexahedron20", "wedge": "wedge15", "pyramid": "pyramid13", "tetra": "tetra10"}
    for block in raw.cells:
        rows = []
        for cell in block.data.tolist():
            middles = []
            for i, j in EDGES_OF[len(cell)]:
                key = tuple(sorted((cell[i], cell[j])))
                if key not in known:
                    known[key] = len(points)
                    points.append((points[key[0]] + points[key[1]]) / 2)
                middles.append(known[key])
            rows.append([*cell, *middles])
        blocks.append((names[block.type], np.array(rows)))
    return meshio.Mesh(np.array(points), blocks)


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("kinds", ["wedges", "pyramids"])
def test_cells_of_several_kinds_become_tetrahedra_that_fill_the_same(tmp_path: Path, kinds: str, quadratic: bool) -> None:
    cut_box(kinds, quadratic).write(tmp_path / "mixed.msh", file_format="gmsh22")
    mesh = mesh_from_file("mesh", tmp_path / "mixed.msh", 1.0)
    assert mesh.cell_type == "tetra10"
    assert volume(mesh) == pytest.approx(BRICK, rel=1e-12)
    assert mesh_quality(mesh).least > 0
    # conforming: nothing but the brick's own six sides, two triangles a unit square, is on the outside
    sides = mesh.points[boundary_sides(mesh.cells)[:, :3]]
    assert len(sides) == 2 * (4 * 2 + 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    assert ((high - low == 0) & ((low == 0) | (high == [2, 1, 1]))).any(axis=1).all()


def test_curved_edges_stay_where_they_are_in_the_file(tmp_path: Path) -> None:
    """A smooth map of second order: the volume of hex20 beside wedge15 is that of the parts apart."""
    raw = cut_box("wedges", True)
    bent = raw.points + 0.1 * np.column_stack([0 * raw.points[:, 0], raw.points[:, 0] ** 2, 0 * raw.points[:, 0]])
    meshio.Mesh(bent, raw.cells).write(tmp_path / "bent.msh", file_format="gmsh22")
    mesh = mesh_from_file("mesh", tmp_path / "bent.msh", 1.0)
    # the map is a shear by x²: it keeps volume, and quadratic elements have it exactly
    assert volume(mesh) == pytest.approx(BRICK, rel=1e-12)
    assert_allclose(mesh.points[:, 1].max(), 1 + 0.1 * 4, rtol=1e-12)


def test_hexahedra_of_several_orders_become_those_of_20_nodes(tmp_path: Path) -> None:
    points = np.concatenate([(HEX27 + 1) / 2, (HEX20 + 1) / 2 + [1, 0, 0]])
    merged, number = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    number = number.ravel()
    cells = [("hexahedron27", number[None, :27]), ("hexahedron20", number[None, 27:])]
    meshio.Mesh(merged, cells).write(tmp_path / "both.vtu")
    mesh = mesh_from_file("mesh", tmp_path / "both.vtu", 1.0)
    assert mesh.cells.shape == (2, 20)
    assert volume(mesh) == pytest.approx(2.0, rel=1e-12)


def test_a_side_that_tetrahedra_divide_the_other_way_is_refused(tmp_path: Path) -> None:
    raw = cut_box("hexahedra", False)
    first, second = raw.cells[0].data
    a, b, c, d, e, f, g, h = second.tolist()
    # five tetrahedra whose diagonal of the common side a d h e is d e: a is the least of the four, which says a h
    five = [[a, b, d, e], [b, c, d, g], [b, d, e, g], [b, e, f, g], [d, e, g, h]]
    meshio.Mesh(raw.points, [("hexahedron", first[None]), ("tetra", np.array(five))]).write(tmp_path / "x.vtu")
    with pytest.raises(MeshError, match=r"mesh: hexahedra, .* got 1 quadrilateral sides .* put pyramids .* in .*x.vtu"):
        mesh_from_file("mesh", tmp_path / "x.vtu", 1.0)


ABAQUS = """*HEADING
a brick of two
*NODE
{nodes}
*ELEMENT, TYPE=C3D8, ELSET=body
1, 1, 2, 3, 4, 5, 6, 7, 8
2, 2, 9, 10, 3, 6, 11, 12, 7
*ELSET, ELSET=far
2,
*NSET, NSET=wall
1, 4, 5, 8
*SURFACE, TYPE=ELEMENT, NAME=tip
far, S4
*SURFACE, NAME=top
body, S2
*SURFACE, NAME=some, TYPE=ELEMENT
1, S1
2, S1
2, S4,
"""


def test_node_sets_and_surfaces_of_abaqus_are_faces(tmp_path: Path) -> None:
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1),
              (2, 0, 0), (2, 1, 0), (2, 0, 1), (2, 1, 1)]  # fmt: skip
    nodes = "\n".join(f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(points, start=1))
    (tmp_path / "brick.inp").write_text(ABAQUS.format(nodes=nodes))
    faces = {face.name: face for face in mesh_from_file("mesh", tmp_path / "brick.inp", 1.0).faces}
    assert {name: len(face.sides) for name, face in faces.items()} == {"tip": 1, "top": 2, "wall": 1, "some": 3}
    assert_allclose(faces["tip"].direction, [1, 0, 0], atol=1e-12)
    assert_allclose(faces["top"].centre, [1, 0.5, 1], atol=1e-12)
    assert_allclose(faces["wall"].direction, [-1, 0, 0], atol=1e-12)


def test_gmshs_own_abaqus_files_are_read(tmp_path: Path) -> None:
    """Its surfaces are of plane stress elements, which meshio does not know."""
    mesh = mesh_from_file("mesh", box(tmp_path / "box.inp"), 1.0)
    assert volume(mesh) == pytest.approx(BRICK, rel=1e-9)
    assert {"left", "right"} <= {face.name for face in mesh.faces}


def test_a_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path / "cache"))
    path, calls = box(tmp_path / "box.msh"), []
    monkeypatch.setattr(read, "in_own_process", lambda *given: calls.append(given) or read_mesh(path))
    one, two = (mesh_from_file("mesh", path, scale) for scale in (1.0, 2.0))
    assert len(calls) == 1
    assert_allclose(two.points, 2 * one.points, rtol=0)
    path.write_bytes(path.read_bytes() + b"\n")
    mesh_from_file("mesh", path, 1.0)
    assert len(calls) == 2


@pytest.mark.parametrize(("reader", "words"), [(endless, "none within 1 s of processor time"), (killed, "broke down")])
def test_readers_that_hang_or_break_down_end_in_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reader: object, words: str
) -> None:
    (tmp_path / "arm.vtu").write_bytes(words.encode())
    monkeypatch.setattr(read, "READING", 1)
    monkeypatch.setattr(read, "read_mesh", reader)
    wanted = rf"^mesh: .*arm.vtu: must be a mesh file that can be read, .*{words}.*; it may be damaged"
    with pytest.raises(MeshError, match=wanted):
        mesh_from_file("mesh", tmp_path / "arm.vtu", 1.0)
