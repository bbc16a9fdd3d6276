"""Solids swept about axes, or along lines and arcs: against OpenCASCADE's volumes, anywhere, with coupling surfaces."""

from collections.abc import Callable
from math import atan2, cos, pi, sin
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from kedfem.links.solid import solid_basis, solid_link
from kedfem.links.surfaces.part_candidates import face_kind
from kedfem.mesh import SolidMesh, mesh_quality, part_mesh
from kedfem.mesh.cad.faces import with_faces
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.solids import OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.session import gmsh_model
from kedfem.mesh.swept.core import disc
from kedfem.mesh.swept.path import path_mesh
from kedfem.mesh.swept.revolved import revolved_mesh
from kedfem.mesh.tetrahedral import tetrahedral_mesh
from kedfem.mesh.unknowns import nearest_mesh
from kedfem.scene import Material, link_from
from kedfem.scene.records.shapes import Cad
from tests.verification.linear import frequencies

STEEL = Material(density=7850.0, youngs_modulus=2.1e11, poisson_ratio=0.3)
Outline = list[tuple[float, float]]


def turned(occ: Any, outline: Outline, angle: float = 2 * pi) -> None:
    """An outline (x, r) [mm] turned about x."""
    points = [occ.addPoint(x, r, 0) for x, r in outline]
    lines = [occ.addLine(points[k - 1], points[k]) for k in range(len(points))]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    occ.revolve([(2, face)], 0, 0, 0, 1, 0, 0, angle)
    occ.remove([(2, face)], recursive=True)


PULLEY = [(-8, 8), (8, 8), (8, 14), (4, 14), (4, 24), (9, 24), (9, 32)]
PULLEY += [(0, 25), (-9, 32), (-9, 24), (-4, 24), (-4, 14), (-8, 14)]
SHAFT = [(0, 0), (60, 0), (60, 6), (58, 8), (40, 8), (36, 12), (20, 12), (20, 10), (1, 10), (0, 9)]
POINTED = [(0, 0), (30, 0), (20, 8), (0, 8)]
CAVITY = [(0, 0), (10, 0), (12, 4), (18, 5), (20, 0), (40, 0), (40, 9), (0, 9)]


def elbow(occ: Any) -> None:
    ring = occ.addDisk(30, 0, 0, 8, 8, zAxis=[0, 1, 0])
    hole = occ.addDisk(30, 0, 0, 5, 5, zAxis=[0, 1, 0])
    cut, _ = occ.cut([(2, ring)], [(2, hole)])
    occ.revolve(cut, 0, 0, 0, 0, 0, 1, 1.9)
    occ.remove(cut, recursive=True)


def pipe(occ: Any, corners: list[tuple[float, float, float]], bend: float, inner: float = 0.0) -> None:
    """A round bar of radius 5 along lines with bends between, or a pipe."""
    P = np.array(corners)
    along = np.diff(P, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    curves, last = [], occ.addPoint(*P[0])
    for corner, before, after in zip(P[1:-1], along[:-1], along[1:], strict=True):
        half = np.arccos(before @ after) / 2
        centre = corner + bend / np.cos(half) * (after - before) / np.linalg.norm(after - before)
        ends = [occ.addPoint(*(corner + s * bend * np.tan(half) * d)) for s, d in ((-1, before), (1, after))]
        curves += [occ.addLine(last, ends[0]), occ.addCircleArc(ends[0], occ.addPoint(*centre), ends[1])]
        last = ends[1]
    curves.append(occ.addLine(last, occ.addPoint(*P[-1])))
    wire = occ.addWire(curves)
    tags = []
    for radius in (5.0, inner) if inner else (5.0,):
        face = occ.addDisk(*P[0], radius, radius, zAxis=list(along[0]))
        tags += [tag for dim, tag in occ.addPipe([(2, face)], wire) if dim == 3]
        occ.remove([(2, face)], recursive=True)
    if inner:
        occ.cut([(3, tags[0])], [(3, tags[1])])
    occ.remove(occ.getEntities(1), recursive=True)


CORNERS = [(0.0, 0.0, 0.0), (40.0, 0.0, 0.0), (40.0, 50.0, 0.0), (70.0, 60.0, 30.0)]


def capped_ball(occ: Any) -> None:
    ball, tool = occ.addSphere(0, 0, 0, 10), occ.addBox(-20, -20, 7, 40, 40, 40)
    occ.cut([(3, ball)], [(3, tool)])


#: What is drawn, and the radii [mm] of the bores, journals and balls on it.
PARTS: dict[str, tuple[Callable[[Any], None], list[float]]] = {
    "pulley": (lambda occ: turned(occ, PULLEY), [8, 14, 14, 24, 24]),
    "shaft": (lambda occ: turned(occ, SHAFT), [8, 10, 12]),
    "pointed": (lambda occ: turned(occ, POINTED), [8]),
    "cavity": (lambda occ: turned(occ, CAVITY), [9]),
    "ball": (lambda occ: occ.addSphere(0, 0, 0, 10), [10]),
    "capped ball": (capped_ball, [10]),
    "half a pulley": (lambda occ: turned(occ, PULLEY, pi), []),
    "elbow": (elbow, []),
    "bent bar": (lambda occ: pipe(occ, CORNERS, 12.0), [5, 5, 5]),
    "bent pipe": (lambda occ: pipe(occ, CORNERS, 12.0, 3.5), [3.5, 3.5, 3.5, 5, 5, 5]),
}
ALONG_PATHS = ("half a pulley", "elbow", "bent bar", "bent pipe")


def drawn(folder: Path, draw: Callable[[Any], None], oblique: bool = False) -> tuple[Path, float]:
    """The file of a part and its volume [m³]."""
    with gmsh_model() as gmsh:
        occ = gmsh.model.occ
        draw(occ)
        if oblique:
            occ.rotate(occ.getEntities(3), 3, -5, 2, 0.3, -0.5, 0.8, 1.1)
            occ.translate(occ.getEntities(3), 70, 20, -40)
        occ.synchronize()
        gmsh.write(str(folder / "part.brep"))
        return folder / "part.brep", 1e-9 * sum(occ.getMass(3, tag) for _, tag in occ.getEntities(3))


Method = Callable[[ModuleType, Solid, Sizing], SolidMesh]


def swept(file: Path, sizing: Sizing = Sizing(), method: Method = revolved_mesh) -> SolidMesh:  # noqa: B008
    """The mesh of a part's file, its faces known."""
    with solid_model(CadKeys("part", "solid"), file, "part", Cad(file=file.name)) as (gmsh, solid):
        return with_faces(gmsh, solid, method(gmsh, solid, sizing))


def volume(mesh: SolidMesh) -> float:
    return float(solid_basis(mesh).dx.sum())


CHEAP = ("shaft", "elbow")


@pytest.mark.parametrize(
    "name", [*CHEAP, *(pytest.param(name, marks=pytest.mark.long) for name in PARTS if name not in CHEAP)]
)
def test_parts_are_swept_in_any_place(name: str, tmp_path: Path) -> None:
    """det J > 0 all over, no wedges, volume within 5e-4 of CAD, each face found; turned by any angle the same mesh."""
    draw, radii = PARTS[name]
    method = path_mesh if name in ALONG_PATHS else revolved_mesh
    meshes = []
    for oblique in (False, True):
        file, exact = drawn(tmp_path, draw, oblique)
        mesh = swept(file, method=method)
        assert valid_everywhere(mesh.points, mesh.cells).all()
        assert mesh_quality(mesh).least > 0.3
        assert volume(mesh) == pytest.approx(exact, rel=5e-4)  # parabolas at 30° lose 1.5e-4 of a circle
        surfaces = [f for f in mesh.faces if face_kind(mesh, f) in {"bore", "journal", "ball", "ball seat"}]
        assert_allclose(sorted(1e3 * face.radius for face in surfaces), radii, rtol=1e-6)
        meshes.append(mesh)
    assert len(meshes[0].points) == pytest.approx(len(meshes[1].points), rel=0.1)  # gmsh rounds otherwise
    assert volume(meshes[0]) == pytest.approx(volume(meshes[1]), rel=1e-4)


@pytest.mark.long
def test_shafts_and_bushings_of_random_steps_are_swept(tmp_path: Path) -> None:
    """Cylinders and cones one behind the other, hollow or solid, with a centre hole or not: none is refused."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        x = np.cumsum(np.append(0.0, rng.uniform(3, 25, 4)))
        ends = [(r, r if rng.random() < 0.6 else rng.uniform(6, 20)) for r in rng.uniform(6, 20, 4)]
        outline = [(x[k + j], r) for k, pair in enumerate(ends) for j, r in enumerate(pair)]
        drilled = [(x[-1], 3.0), (x[-1] - 2, 3.0), (x[-1] - 3, 0.0), (0.0, 0.0)]
        inner = [drilled, [(x[-1], 4.0), (0.0, rng.uniform(1, 5))], [(x[-1], 0.0), (0.0, 0.0)]][seed % 3]
        file, exact = drawn(tmp_path, lambda occ, all_=outline + inner: turned(occ, all_), bool(seed % 2))
        mesh = swept(file)
        assert valid_everywhere(mesh.points, mesh.cells).all()
        assert mesh_quality(mesh).least > 0.2
        assert volume(mesh) == pytest.approx(exact, rel=5e-4)


def test_the_surface_is_the_parts_own(tmp_path: Path) -> None:
    """Nodes on a bore and a journal have its radius to rounding, at corners, sides and middles."""
    mesh = swept(drawn(tmp_path, PARTS["pulley"][0])[0])
    radii = np.linalg.norm(mesh.points[:, 1:], axis=1)
    for face in mesh.faces:
        if face.kind == "cylinder":
            assert_allclose(radii[face.sides], face.radius, rtol=1e-9)
    assert radii.min() == pytest.approx(8e-3, rel=1e-9)
    assert radii.max() == pytest.approx(32e-3, rel=1e-9)


@pytest.mark.parametrize("around", [8, 12, 16, 20, 32])
def test_a_core_has_a_disc_without_sharp_angles(around: int) -> None:
    points, cells = disc(around)
    assert scaled_jacobian(points, cells).min() > 0.75
    on = np.linalg.norm(points, axis=1) > 1 - 1e-9
    assert_allclose(np.sort([atan2(y, x) % (2 * pi) for x, y in points[on]]), np.arange(2 * around) * pi / around)


@pytest.mark.long
@pytest.mark.parametrize(("name", "size"), [("shaft", 2.2e-3), ("bent bar", 2.8e-3), ("pulley", 2.0e-3)])
def test_frequencies_are_those_of_fine_tetrahedra(name: str, size: float, tmp_path: Path) -> None:
    """First six of the free part, at default sizes, within 0.5 %."""
    file, _ = drawn(tmp_path, PARTS[name][0])
    with solid_model(CadKeys("part", "solid"), file, "part", Cad(file=file.name)) as (gmsh, solid):
        method = path_mesh if name in ALONG_PATHS else revolved_mesh
        meshes = method(gmsh, solid, Sizing()), tetrahedral_mesh(gmsh, solid, Sizing(size=size))
    links = [solid_link("part", mesh, STEEL, np.eye(3)) for mesh in meshes]
    found, fine = (frequencies(link, sp.eye_array(3 * link.n, format="csr"), 12, 5e3)[6:] for link in links)
    assert_allclose(found, fine, rtol=5e-3)


@pytest.mark.parametrize(
    ("outline", "wanted"),
    [(PULLEY, 15_000), *(pytest.param(*each, marks=pytest.mark.long) for each in ((PULLEY, 60_000), (SHAFT, 30_000)))],
)
def test_about_as_many_unknowns_as_asked_for(outline: Outline, wanted: int, tmp_path: Path) -> None:
    drawn(tmp_path, lambda occ: turned(occ, outline))
    given = {"shape": {"kind": "cad", "file": "part.brep"}, "material": "steel", "mesh": {"unknowns": wanted}}
    mesh = part_mesh(link_from(given), tmp_path)
    assert "swept about" in mesh.method
    assert 1 / 1.3 < 3 * len(mesh.points) / wanted < 1.3


def test_what_is_no_solid_of_revolution_is_refused_with_the_face(tmp_path: Path) -> None:
    def keyed(occ: Any) -> None:
        shaft, key = occ.addCylinder(0, 0, 0, 40, 0, 0, 10), occ.addBox(5, -2, 7, 20, 4, 9)
        occ.cut([(3, shaft)], [(3, key)])

    message = r"no solid of revolution, as the plane face .* near .* is not one of revolution about x"
    with pytest.raises(OtherMethodError, match=message):
        swept(drawn(tmp_path, keyed)[0])
    with pytest.raises(OtherMethodError, match="no solid of revolution, as no face is a surface of revolution"):
        swept(drawn(tmp_path, lambda occ: occ.addBox(0, 0, 0, 1, 2, 3))[0])


def test_what_no_plane_end_sweeps_is_refused(tmp_path: Path) -> None:
    """A bar with a bore across it; one with a step; a part of a turn that touches its axis."""

    def bored(occ: Any) -> None:
        occ.cut([(3, occ.addCylinder(0, 0, 0, 40, 0, 0, 5))], [(3, occ.addCylinder(10, -9, 0, 0, 18, 0, 2))])

    def stepped(occ: Any) -> None:
        occ.fuse([(3, occ.addCylinder(0, 0, 0, 40, 0, 0, 5))], [(3, occ.addBox(10, -6, -6, 5, 12, 12))])

    for draw in (bored, stepped, lambda occ: turned(occ, SHAFT, 2.0)):
        with pytest.raises(OtherMethodError, match="no plane end sweeps it along lines and arcs to another end"):
            swept(drawn(tmp_path, draw)[0], method=path_mesh)


def test_ends_are_those_of_the_part_not_of_what_is_missing(tmp_path: Path) -> None:
    """The centre of volume of a part of a torus: R (1 + r²/4R²) sin(α/2) / (α/2) from its axis, half way round."""
    R, r = 20.0, 3.0
    for angle in (0.8, 5.5):
        file, _ = drawn(tmp_path, lambda occ, a=angle: occ.addTorus(0, 0, 0, R, r, angle=a))
        basis = solid_basis(swept(file, Sizing(size=3e-3), path_mesh))
        x = np.asarray(basis.default_parameters()["x"])
        centre = 1e3 * (x * basis.dx).sum(axis=(1, 2)) / basis.dx.sum()
        far = R * (1 + r**2 / (4 * R**2)) * sin(angle / 2) / (angle / 2)
        assert_allclose(centre, [far * cos(angle / 2), far * sin(angle / 2), 0], atol=2e-3)


@pytest.mark.parametrize(
    ("power", "starts"), [(0.5, (0.3, 1.0)), (1.0, (0.05, 0.5, 1.9, 5.0)), (1.5, (0.05, 0.5, 1.9, 5.0))]
)
def test_the_search_for_a_number_of_unknowns_passes_over_sizes_that_change_nothing(
    power: float, starts: tuple[float, ...]
) -> None:
    """As where layers are whole numbers: unknowns jump, and some sizes give the same; their power is 1."""
    tried: list[float] = []

    def mesh_of(size: float) -> tuple[float, int]:
        tried.append(size)
        return size, 1000 * max(round(8 / size), 2) // 2 * 2

    for wanted in (2_500, 4_100, 15_000, 40_000):
        for start in starts:
            tried.clear()
            size, note = nearest_mesh(wanted, start, 4.0, power, mesh_of)
            assert not note
            assert 1 / 1.3 < mesh_of(size)[1] / wanted < 1.3
            assert len(tried) <= 7
    tried.clear()
    size, note = nearest_mesh(500, 1.0, 4.0, power, mesh_of)
    assert size == 4.0  # the largest, and no more are made of it
    assert tried.count(4.0) == 1
    assert "nearest found to the 500" in note
