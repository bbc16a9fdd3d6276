"""Any solid by tetrahedra cut into hexahedra: exact cuts, nodes on the CAD model, relaxation, whole parts, refusals."""

from collections.abc import Callable, Iterator
from types import ModuleType

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kedfem.mesh import HexMesh, checked_mesh, mesh_quality
from kedfem.mesh.cad.solids import CadFace, OtherWayError, Sizing, Solid
from kedfem.mesh.cut.centring import centred
from kedfem.mesh.cut.subdivided import subdivided_mesh, tetrahedron_size
from kedfem.mesh.cut.tetrahedra import (
    EDGES,
    Tetrahedra,
    barycentric_nodes,
    hexahedron_corners,
    subdivision,
    tetrahedron_functions,
)
from kedfem.mesh.cut.unfolding import unfolded
from kedfem.mesh.cut.unfolding_kernel import distortion
from kedfem.mesh.hexahedra import HEX8, HEX27, extruded, rectangle_quads, shape_functions, shape_gradients
from kedfem.mesh.session import gmsh_model

MM = 1e-3
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


@pytest.fixture
def gmsh() -> Iterator[ModuleType]:
    with gmsh_model() as gmsh:
        yield gmsh


def solid_of(gmsh: ModuleType, tag: int) -> Solid:
    """The record of a solid drawn here; of its faces only what way 3 needs."""
    gmsh.model.occ.synchronize()
    mass, nan = gmsh.model.occ.getMass, np.full(3, np.nan)
    tags = [face for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False)]
    faces = tuple(
        CadFace(face, f"face {face}", "other", nan, nan, np.nan, False, mass(2, face), np.nan)
        for face in tags
    )
    box = np.array(gmsh.model.getBoundingBox(3, tag))
    return Solid(tag, "part", mass(3, tag), box[:3], box[3:], faces)


def ball_ended_rod(gmsh: ModuleType, unit: float = MM) -> Solid:
    """A rod with a ball at either end, a cross bore through one of them."""
    occ = gmsh.model.occ
    rod = occ.addCylinder(0, 0, 0, 80 * unit, 0, 0, 6 * unit)
    balls = [occ.addSphere(0, 0, 0, 11 * unit), occ.addSphere(80 * unit, 0, 0, 9 * unit)]
    whole = occ.fuse([(3, rod)], [(3, ball) for ball in balls])[0]
    bore = occ.addCylinder(80 * unit, 0, -20 * unit, 0, 0, 40 * unit, 4 * unit)
    return solid_of(gmsh, occ.cut(whole, [(3, bore)])[0][0][1])


def clevis(gmsh: ModuleType) -> Solid:
    """A shank, a fork with round ends and its bore."""
    occ = gmsh.model.occ
    shank = occ.addCylinder(-60 * MM, 0, 0, 50 * MM, 0, 0, 9 * MM)
    box = occ.addBox(-15 * MM, -14 * MM, -14 * MM, 30 * MM, 28 * MM, 28 * MM)
    end = occ.addCylinder(15 * MM, 0, -14 * MM, 0, 0, 28 * MM, 14 * MM)
    whole = occ.fuse([(3, shank)], [(3, box), (3, end)])[0]
    slot = occ.addBox(-5 * MM, -20 * MM, -5 * MM, 60 * MM, 40 * MM, 10 * MM)
    bore = occ.addCylinder(15 * MM, 0, -20 * MM, 0, 0, 40 * MM, 6 * MM)
    return solid_of(gmsh, occ.cut(whole, [(3, slot), (3, bore)])[0][0][1])


def elbow(gmsh: ModuleType) -> Solid:
    """A bent tube with a wall of 3 mm."""
    occ = gmsh.model.occ
    places = [(0, 0), (60, 0), (60, 30), (90, 30), (90, 80)]
    p = [occ.addPoint(x * MM, y * MM, 0) for x, y in places]
    wire = occ.addWire([occ.addLine(p[0], p[1]), occ.addCircleArc(p[1], p[2], p[3]), occ.addLine(p[3], p[4])])
    across = {"zAxis": [1, 0, 0], "xAxis": [0, 1, 0]}
    disks = [occ.addDisk(0, 0, 0, r * MM, r * MM, **across) for r in (10, 7)]
    ring = occ.cut([(2, disks[0])], [(2, disks[1])])[0]
    pipe = occ.addPipe(ring, wire, "Frenet")
    occ.remove(ring)
    return solid_of(gmsh, pipe[0][1])


def filleted_bracket(gmsh: ModuleType) -> Solid:
    """An angle with all edges rounded by 3 mm and two bores."""
    occ = gmsh.model.occ
    foot, back = (occ.addBox(0, 0, 0, *(x * MM for x in sides)) for sides in ((80, 30, 12), (12, 30, 60)))
    whole = occ.fuse([(3, foot)], [(3, back)])[0]
    occ.synchronize()
    faces = gmsh.model.getBoundary(whole, oriented=False)
    curves = {tag for _, tag in gmsh.model.getBoundary(faces, oriented=False, combined=False)}
    whole = occ.fillet([whole[0][1]], sorted(curves), [3 * MM])
    bores = [
        occ.addCylinder(60 * MM, 15 * MM, -5 * MM, 0, 0, 30 * MM, 6 * MM),
        occ.addCylinder(-5 * MM, 15 * MM, 42 * MM, 30 * MM, 0, 0, 5 * MM),
    ]
    return solid_of(gmsh, occ.cut(whole, [(3, bore) for bore in bores])[0][0][1])


def body_integrals(mesh: HexMesh) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centre of mass and inertia about it, 4 Gauss points a direction."""
    x, w = np.polynomial.legendre.leggauss(4)
    at = np.stack(np.meshgrid(x, x, x, indexing="ij"), axis=-1).reshape(-1, 3)
    corners = mesh.points[mesh.cells]
    J = np.swapaxes(np.tensordot(corners, shape_gradients(HEX27, at), axes=(1, 1)), 1, 2)
    weights = (np.linalg.det(J) * np.einsum("i,j,k->ijk", w, w, w).ravel()).ravel()
    X = np.einsum("qa,eaj->eqj", shape_functions(HEX27, at), corners).reshape(-1, 3)
    centre = weights @ X / weights.sum()
    second = np.einsum("p,pi,pj->ij", weights, X - centre, X - centre)
    return float(weights.sum()), centre, np.trace(second) * np.eye(3) - second


class TestSubdivision:
    def curved(self) -> Tetrahedra:
        """One tetrahedron whose edges are bent at random."""
        middles = CORNERS[EDGES].mean(axis=1) + np.random.default_rng(3).uniform(-0.08, 0.08, (6, 3))
        return Tetrahedra(
            np.concatenate([CORNERS, middles]),
            np.arange(10)[None],
            {7: np.array([[2, 0, 1]])},
            {5: np.array([[3, 1]])},
        )

    def test_has_the_nodes_of_four_hexahedra_that_share_sides(self):
        mesh = subdivision(self.curved()).mesh
        assert mesh.cells.shape == (4, 27)
        assert len(mesh.points) == 4 + 6 * 3 + 4 * 7 + 15  # corners; in edges, in sides, inside

    def test_is_exactly_the_curved_tetrahedron(self):
        mesh = subdivision(self.curved()).mesh
        at = np.random.default_rng(4).uniform(-1, 1, (50, 3))
        unit = np.eye(4)
        fifteen = np.concatenate(
            [
                unit,
                unit[EDGES].mean(axis=1),
                unit[[[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].mean(axis=1),
                [unit.mean(axis=0)],
            ]
        )
        for cell, corners in zip(mesh.cells, hexahedron_corners(), strict=True):
            b = shape_functions(HEX8, at) @ fifteen[corners]
            wanted = tetrahedron_functions(b) @ self.curved().points
            assert_allclose(shape_functions(HEX27, at) @ mesh.points[cell], wanted, atol=1e-13)

    def test_is_valid_as_the_tetrahedron_is(self):
        assert mesh_quality(subdivision(self.curved()).mesh).least > 0.2

    def test_knows_the_nodes_on_faces_and_curves(self):
        straight = Tetrahedra(
            np.concatenate([CORNERS, CORNERS[EDGES].mean(axis=1)]),
            np.arange(10)[None],
            {7: np.array([[2, 0, 1]])},
            {5: np.array([[3, 1]])},
        )
        cut = subdivision(straight)
        points = cut.mesh.points
        assert_array_equal(cut.on_face[7], np.flatnonzero(abs(points[:, 2]) < 1e-12))
        assert len(cut.on_face[7]) == 3 + 3 * 3 + 7
        on_edge = (abs(points[:, 1]) < 1e-12) & (abs(points[:, 0] + points[:, 2] - 1) < 1e-12)
        assert_array_equal(cut.on_curve[5], np.flatnonzero(on_edge))
        assert len(cut.on_curve[5]) == 5

    def test_barycentric_coordinates_sum_to_one(self):
        assert_allclose(barycentric_nodes().sum(axis=2), 1, rtol=1e-14)


class TestUnfolding:
    def block(self) -> HexMesh:
        return extruded(*rectangle_quads(3.0, 3.0, 3, 3), 3.0, 3)

    def held(self, points: np.ndarray) -> Callable:
        """Nodes on the surface of the block do not move."""
        inside = (abs(points - [1.5, 0, 0]) < 1.49).all(axis=1)
        return lambda nodes, places: (places, inside[nodes][:, None, None] * np.eye(3))

    def test_follows_the_gradient_of_the_distortion(self):
        rng = np.random.default_rng(1)
        points, cells = HEX27 + rng.uniform(-0.4, 0.4, HEX27.shape), np.arange(27)[None]
        gradient, step = np.zeros_like(points), rng.normal(size=points.shape)
        distortion(points, cells, 0.1, gradient)
        up, down = (distortion(points + h * step, cells, 0.1, np.zeros_like(points)) for h in (1e-6, -1e-6))
        assert_allclose((gradient * step).sum(), (up - down) / 2e-6, rtol=1e-6)  # central difference, h²

    def test_of_a_cube_is_one_at_each_node(self):
        cells = np.arange(27)[None]
        assert_allclose(distortion(1.0 * HEX27, cells, 1e-9, np.zeros((27, 3))), 27, rtol=1e-12)

    def test_mends_inverted_elements_and_leaves_the_boundary(self):
        mesh = self.block()
        points = mesh.points.copy()
        inner = np.flatnonzero((abs(points - [1.0, -0.5, -0.5]) < 1e-9).all(axis=1))
        points[inner] += [1.2, 0.3, 0.4]
        assert mesh_quality(HexMesh(points, mesh.cells)).least < 0
        settle = self.held(mesh.points)
        mended = unfolded(points, mesh.cells, settle, 0.3)
        assert mesh_quality(HexMesh(mended, mesh.cells)).least > 0.3
        rim = np.flatnonzero(settle(np.arange(len(points)), points)[1][:, 0, 0] == 0)
        assert_array_equal(mended[rim], points[rim])

    def test_leaves_good_meshes_alone(self):
        mesh = self.block()
        assert_array_equal(unfolded(mesh.points, mesh.cells, self.held(mesh.points), 0.3), mesh.points)


class TestCentring:
    def test_puts_the_middles_of_arcs_back_unless_an_element_suffers(self):
        on_circle = lambda p: p / np.linalg.norm(p[:, :2], axis=1)[:, None] * [1, 1, np.nan]  # noqa: E731
        turn, radius = HEX27[:, 0] * np.pi / 12, np.where(HEX27[:, 1] < 0, 1.0, 1.3 + 0.15 * HEX27[:, 1])
        cells, outer = np.arange(27)[None], radius == 1.0
        points = np.stack([radius * np.sin(turn), radius * np.cos(turn), 0.2 * HEX27[:, 2]], axis=1)

        def settle(nodes: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            round_ = np.where(outer[nodes][:, None] & [True, True, False], on_circle(places), places)
            return round_, np.where(outer[nodes][:, None, None], 0.0, np.eye(3))

        slid = points.copy()
        middles = np.flatnonzero(outer & (HEX27[:, 0] == 0))
        slid[middles, 0] += 0.05
        slid, _ = settle(np.arange(27), slid)
        assert_allclose(centred(slid, cells, settle, 0.2), points, atol=1e-12)
        assert_array_equal(
            centred(slid, cells, lambda n, p: (-p, 0 * np.eye(3)[None].repeat(len(n), 0)), 0.2), slid
        )


class TestParts:
    @pytest.mark.parametrize(
        "part", [ball_ended_rod, clevis, pytest.param(elbow, marks=pytest.mark.long), filleted_bracket]
    )
    def test_good_hexahedra_with_the_exact_volume_centre_and_inertia(self, gmsh, part):
        solid = part(gmsh)
        mesh = subdivided_mesh(gmsh, solid, Sizing())
        checked_mesh("arm", mesh, 0.1)
        assert mesh.cell_type == "hexahedron27"
        assert len(np.unique(mesh.cells)) == len(mesh.points) < 130_000
        volume, centre, inertia = body_integrals(mesh)
        occ = gmsh.model.occ
        exact = occ.getMatrixOfInertia(3, solid.tag).reshape(3, 3)
        assert_allclose(volume, solid.volume, rtol=1e-4)
        assert_allclose(centre, occ.getCenterOfMass(3, solid.tag), atol=1e-4 * solid.extent)
        assert_allclose(inertia, exact, atol=1e-4 * np.linalg.norm(exact))

    def test_a_part_of_a_few_millimetres_is_meshed_as_one_ten_times_as_large(self, gmsh):
        mesh = subdivided_mesh(gmsh, ball_ended_rod(gmsh, 0.1 * MM), Sizing())
        assert mesh_quality(mesh).least > 0.1

    def test_nodes_lie_on_the_cad_surface(self, gmsh):
        occ = gmsh.model.occ
        ball = occ.cut([(3, occ.addSphere(0, 0, 0, 0.02))], [(3, occ.addCylinder(0, 0, -1, 0, 0, 2, 0.006))])
        mesh = subdivided_mesh(gmsh, solid_of(gmsh, ball[0][0][1]), Sizing())
        from_centre, from_axis = (np.linalg.norm(mesh.points[:, :d], axis=1) for d in (3, 2))
        on_ball, on_bore = abs(from_centre - 0.02) < 1e-9, abs(from_axis - 0.006) < 1e-9
        sides = mesh.cells[
            :, [[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]]
        ]
        key, count = np.unique(np.sort(sides.reshape(-1, 4), axis=1), axis=0, return_counts=True)
        outer = key[count == 1]
        assert (on_ball[outer].all(axis=1) ^ on_bore[outer].all(axis=1)).all()
        assert count.max() == 2

    def test_leaves_the_solid_and_gmsh_as_they_were(self, gmsh):
        solid = clevis(gmsh)
        entities, size = gmsh.model.getEntities(), gmsh.option.getNumber("Mesh.MeshSizeMax")
        subdivided_mesh(gmsh, solid, Sizing())
        assert gmsh.model.getEntities() == entities
        assert gmsh.option.getNumber("Mesh.MeshSizeMax") == size

    def test_says_how_it_was_made(self, gmsh):
        mesh = subdivided_mesh(gmsh, clevis(gmsh), Sizing())
        count = len(mesh.cells) // 4
        assert mesh.way.startswith(f"each of {count} tetrahedra in four hexahedra; gmsh ")
        assert mesh.way.endswith(", optimised")


class TestSizes:
    def box(self, gmsh: ModuleType, *sides: float) -> Solid:
        return solid_of(gmsh, gmsh.model.occ.addBox(0, 0, 0, *sides))

    def test_are_two_edges_of_hexahedra(self, gmsh):
        solid = self.box(gmsh, 0.1, 0.05, 0.02)
        assert tetrahedron_size(solid, Sizing(size=0.004)) == 0.008
        assert_allclose(tetrahedron_size(solid, Sizing(across=4)), tetrahedron_size(solid, Sizing()) / 2)

    def test_of_a_plate_come_from_its_thickness(self, gmsh):
        solid = self.box(gmsh, 0.1, 0.1, 0.02)
        width = 2 * solid.volume / solid.area  # 0.0143: the edges of the plate count too
        assert_allclose(tetrahedron_size(solid, Sizing(across=2)), width, rtol=1e-12)

    def test_smaller_ones_make_more_elements(self, gmsh):
        solid = self.box(gmsh, 0.04, 0.03, 0.02)
        coarse, fine = (len(subdivided_mesh(gmsh, solid, Sizing(size=h)).cells) for h in (0.005, 0.0035))
        assert fine > 1.5 * coarse

    def test_that_take_too_many_tetrahedra_are_refused(self, gmsh):
        with pytest.raises(OtherWayError, match=r"it takes \d+ tetrahedra, at most 30000 are affordable"):
            subdivided_mesh(gmsh, self.box(gmsh, 0.1, 0.1, 0.1), Sizing(size=0.0013))


class TestRefusals:
    def test_what_gmsh_says_is_told(self, gmsh, monkeypatch):
        solid = clevis(gmsh)

        def fails(dim: int) -> None:
            raise Exception("Invalid boundary mesh (overlapping facets) on surface 3 surface 7")

        monkeypatch.setattr(gmsh.model.mesh, "generate", fails)
        with pytest.raises(OtherWayError) as caught:
            subdivided_mesh(gmsh, solid, Sizing())
        assert str(caught.value) == (
            "gmsh makes no tetrahedra of it: Invalid boundary mesh (overlapping facets) on surface 3 surface 7"
        )

    def test_elements_that_stay_inverted_are_not_let_through(self, gmsh, monkeypatch):
        from kedfem.mesh.cut import subdivided

        def inverted(points: np.ndarray, cells: np.ndarray, *_: object) -> np.ndarray:
            changed = points.copy()
            changed[cells[0, 6]] = points[cells[0, 0]] - 0.5 * (points[cells[0, 6]] - points[cells[0, 0]])
            return changed

        monkeypatch.setattr(subdivided, "unfolded", inverted)
        solid = solid_of(gmsh, gmsh.model.occ.addBox(0, 0, 0, 0.04, 0.03, 0.02))
        with pytest.raises(OtherWayError, match=r"elements stay inverted: scaled Jacobian -0\.\d+ at \(0\.0"):
            subdivided_mesh(gmsh, solid, Sizing(size=0.01))
