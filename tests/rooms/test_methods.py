"""Parts from CAD as links: the order of methods, where they go, how fine, what is kept between runs."""

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import MeshError, SceneError
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.part_candidates import face_kind
from kedfem.mesh import SolidMesh, link_mesh, mesh_quality, methods, part_mesh
from kedfem.mesh.cad.solids import Solid
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.mesh.isolated import LONGEST, PART, in_own_process
from kedfem.scene import LinkScene, Material, link_from, scene_from
from tests.works import busy, busy_and_counted, busy_in, loud

GEOMETRY = Path(__file__).parents[2] / "geometry"
CUBE = Solid(1, "cube", 1.0, np.zeros(3), np.ones(3), ())


def link(file: str = "crank.step", mesh: dict[str, Any] | None = None, **shape: Any) -> LinkScene:
    given = {"kind": "cad", "file": file, **shape}
    return link_from({"shape": given, "material": "steel", "mesh": mesh or {}})


def made(file: str = "crank.step", mesh: dict[str, Any] | None = None, **shape: Any) -> SolidMesh:
    return part_mesh(link(file, mesh, **shape), GEOMETRY)


def volume_and_centre(mesh: SolidMesh) -> tuple[float, np.ndarray]:
    material = Material(density=1.0, youngs_modulus=1.0, poisson_ratio=0.3)
    record = solid_link("part", mesh, material, np.eye(3))
    m1 = record.m1[:, 0]
    return float(m1.sum()), np.asarray(m1 @ record.X / m1.sum())


#: Radii [mm] of the bores, ball seats and balls that geometry/README.md lists.
ROUND = {
    "ball_ended_rod": [2.5, 12, 12],
    "bell_crank": [6, 7, 10],
    "bent_rocker": [6, 7, 12.5],
    "clevis": [4.5, 8, 8],
    "connecting_rod": [10, 15],
    "crank": [12],
    "piston": [10, 10, 34.5, 90],  # the last two: its hollow and the bowl in its crown
    "slider": [10, 10],
    "slotted_link": [9],
    "wishbone": [12, 12, 15],
}


@pytest.mark.long
@pytest.mark.parametrize("part", ROUND)
def test_parts_mesh_unattended_with_their_bores_found(part: str) -> None:
    mesh = made(f"{part}.step")
    assert mesh.tetrahedra or mesh_quality(mesh).least >= 0.3
    assert valid_everywhere(mesh.points, mesh.cells).all()
    assert 3 * len(mesh.points) < (45_000 if mesh.tetrahedra else 70_000)
    surfaces = [face for face in mesh.faces if face_kind(mesh, face) in {"bore", "ball seat", "ball"}]
    assert_allclose(sorted(1e3 * face.radius for face in surfaces), ROUND[part], rtol=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(("unknowns", "most"), [(3000, 20_000), (6000, 12_000)])
def test_a_coarse_mesh_is_found_where_settings_of_gmsh_fail(unknowns: int, most: int) -> None:
    """The arm's eyes leave no flat element only down to some size; gmsh finds overlapping facets at coarser ones."""
    mesh = made("wishbone.step", {"unknowns": unknowns})
    assert 3 * len(mesh.points) < most
    assert mesh_quality(mesh).least > methods.FLAT
    assert f"the nearest found to the {unknowns:,} unknowns asked for" in mesh.method
    assert valid_everywhere(mesh.points, mesh.cells).all()


class TestLadder:
    def test_the_best_way_that_the_part_allows_is_taken_and_told(self) -> None:
        assert "swept along z" in made().method
        assert mesh_quality(made()).least > 0.3

    def test_a_part_that_is_no_layers_is_filled_another_way_and_the_reason_told(self) -> None:
        mesh = made("ball_ended_rod.step")
        assert "tetrahedra" in mesh.method
        assert (
            "no layers along one direction, as the ball of radius 12 mm near (150, 0, 0) mm (face 14) is" in mesh.method
        )
        assert mesh.cell_type == "tetra10"
        assert valid_everywhere(mesh.points, mesh.cells).all()

    def test_a_part_that_no_way_fills_is_refused_with_the_reasons(self) -> None:
        def refused(*_: Any) -> SolidMesh:
            raise methods.OtherMethodError("is not what this way wants")

        message = r"^crank.step: must be a solid .* got none: is not what this way wants; is not what this way .*; take"
        with pytest.raises(MeshError, match=message):
            methods.best_mesh("crank.step", math, CUBE, methods.Sizing(), methods=(refused, refused))

    def test_the_better_of_two_poor_meshes_is_taken(self) -> None:
        poor, poorer = sheared(0.97, "first"), sheared(0.99, "second")
        assert mesh_quality(poorer).least < mesh_quality(poor).least < methods.ENOUGH
        for order in ([poor, poorer], [poorer, poor]):
            both = tuple(lambda *_, mesh=mesh: mesh for mesh in order)
            taken = methods.best_mesh("crank.step", math, CUBE, methods.Sizing(), methods=both)
            assert taken.method.startswith("first")
            assert ("worst scaled Jacobian" in taken.method) == (order[0] is poorer)


def sheared(by: float, way: str) -> SolidMesh:
    """One hexahedron, sheared so far that its quality is √(1 − by²)."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    points = np.array([(x, y, z) for z in (-1, 1) for x, y in corners], dtype=float)
    points[:, :2] = points[:, :2] @ np.array([[1, 0], [by, np.sqrt(1 - by**2)]])
    return SolidMesh(points, np.arange(8)[None], method=way)


class TestApart:
    """OpenCASCADE and gmsh break down and hang on some parts: neither may take kedfem with them."""

    def test_what_hangs_is_given_up(self) -> None:
        with pytest.raises(
            MeshError, match=r"^rod.step: must be a part .* work on, got none within 1 s of processor time; mend or"
        ):
            in_own_process("rod.step", PART, 1, busy, 60)

    def test_what_breaks_down_is_refused_and_the_next_works(self) -> None:
        with pytest.raises(MeshError, match=r"^rod.step: must be a part .* work on, got one at which they broke down"):
            in_own_process("rod.step", PART, LONGEST, os._exit, 3)
        assert in_own_process("rod.step", PART, LONGEST, math.sqrt, 4.0) == 2.0

    def test_what_it_writes_stays_there(self, capfd: pytest.CaptureFixture[str]) -> None:
        assert in_own_process("rod.step", PART, LONGEST, loud) == 36
        assert capfd.readouterr() == ("", "")

    def test_what_takes_too_much_memory_is_given_up_and_the_next_works(self) -> None:
        with pytest.raises(MeshError, match=r"^rod.step: .*, got one for which they need more than 6 GB of memory; mend"):
            in_own_process("rod.step", PART, LONGEST, np.ones, int(1e9))
        assert in_own_process("rod.step", PART, LONGEST, math.sqrt, 4.0) == 2.0

    def test_errors_come_through_and_the_next_work_has_a_new_process(self) -> None:
        before = in_own_process("rod.step", PART, LONGEST, os.getpid)
        assert in_own_process("rod.step", PART, LONGEST, os.getpid) == before
        with pytest.raises(ValueError, match="math domain"):
            in_own_process("rod.step", PART, LONGEST, math.sqrt, -1.0)
        assert in_own_process("rod.step", PART, LONGEST, os.getpid) != before

    def test_what_only_a_used_process_does_not_end_is_done_by_a_new_one(self) -> None:
        used = in_own_process("rod.step", PART, LONGEST, os.getpid)
        assert in_own_process("rod.step", PART, 1, busy_in, used) != used

    @pytest.mark.parametrize("tries", [1, 2])
    def test_what_no_process_ends_is_tried_once_more_where_the_first_was_used(self, tries: int, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match="math domain"):
            in_own_process("rod.step", PART, LONGEST, math.sqrt, -1.0)  # its process is ended
        if tries == 2:
            in_own_process("rod.step", PART, LONGEST, os.getpid)
        with pytest.raises(MeshError, match="got none within 1 s of processor time"):
            in_own_process("rod.step", PART, 1, busy_and_counted, tmp_path / "tries")
        assert len((tmp_path / "tries").read_text()) == tries


class TestStiffness:
    @pytest.mark.parametrize("file", ["crank.step", pytest.param("ball_ended_rod.step", marks=pytest.mark.long)])
    def test_rigid_motions_strain_nothing(self, file: str) -> None:
        """K0 u = 0 for the twelve fields 1, x, y, z along each axis that are rigid: [KED, App. A], to rounding."""
        record = solid_link("part", made(file), Material(density=1, youngs_modulus=1, poisson_ratio=0.3), np.eye(3))
        r, e = record.X - record.X.mean(axis=0), np.eye(3)
        rigid = [np.tile(a, (record.n, 1)) for a in e] + [np.cross(a, r) / np.abs(r).max() for a in e]
        for u in rigid:
            assert np.abs(record.K0 @ u.ravel()).max() < 1e-12 * np.abs(record.K0).max() * np.sqrt(record.n)


class TestPlacing:
    def test_a_part_goes_where_the_scene_has_it(self) -> None:
        """The crank's centre of mass lies on its own x axis."""
        _, here = volume_and_centre(made())
        _, there = volume_and_centre(made(origin=[1, 2, 3], towards=[1, 5, 3]))
        assert_allclose(there, [1 - here[1], 2 + here[0], 3 + here[2]], atol=1e-9)

    def test_the_z_axis_goes_as_near_to_a_direction_as_the_x_axis_allows(self) -> None:
        axes = methods.file_axes(link(towards=[1, 0, 0], z=[5, 1, 0]).shape)  # type: ignore[arg-type]
        assert_allclose(axes, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)

    def test_the_faces_move_with_the_part(self) -> None:
        (bore,) = [f for f in made(origin=[1, 2, 3]).faces if f.kind == "cylinder" and abs(f.radius - 0.012) < 1e-6]
        assert bore.inward
        assert_allclose(bore.centre[:2], [1, 2], atol=1e-6)
        assert_allclose(abs(bore.direction), [0, 0, 1], atol=1e-6)

    def test_a_scale_says_what_a_unit_is(self) -> None:
        assert_allclose(volume_and_centre(made(scale=0.002))[0], 8 * volume_and_centre(made(scale=0.001))[0], rtol=1e-6)


class TestSizes:
    def test_smaller_elements_are_more(self) -> None:
        counts = [len(made(mesh={"size": size}).cells) for size in (0.012, 0.006)]
        assert 2 < counts[1] / counts[0] < 10

    def test_about_as_many_unknowns_as_asked_for(self) -> None:
        for wanted in (15_000, 40_000):
            assert 0.75 < 3 * len(made(mesh={"unknowns": wanted}).points) / wanted < 1.33

    def test_fewer_unknowns_than_the_shape_allows_are_told(self) -> None:
        assert made(mesh={"unknowns": 500}).method.endswith("; the nearest found to the 500 unknowns asked for")

    def test_layers_are_the_least_through_each_slab(self) -> None:
        assert len(made(mesh={"layers": 3}).cells) > 1.5 * len(made().cells)

    def test_a_size_larger_than_the_part_is_refused(self) -> None:
        with pytest.raises(MeshError, match=r"crank.step: must be larger than its mesh.size 1 \[m\], got 0\.1"):
            made(mesh={"size": 1.0})


class TestKept:
    def test_a_mesh_is_made_once(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path))
        first = made()

        def meshes(*_: object) -> None:
            raise RuntimeError("meshed")

        monkeypatch.setattr(methods, "in_own_process", meshes)
        again = made()
        assert np.array_equal(again.points, first.points)
        assert again.method == first.method
        with pytest.raises(RuntimeError, match="meshed"):
            made(mesh={"size": 0.01})

    def test_a_damaged_entry_is_made_again(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path))
        first = made()
        for file in tmp_path.rglob("*.pkl"):
            content = bytearray(file.read_bytes())
            content[len(content) // 2] ^= 1
            file.write_bytes(content)
        assert np.array_equal(made().points, first.points)

    def test_another_content_of_the_file_is_another_mesh(self, tmp_path: Path) -> None:
        file = tmp_path / "part.step"
        file.write_bytes((GEOMETRY / "crank.step").read_bytes())
        before = part_mesh(link("part.step"), tmp_path)
        file.write_bytes((GEOMETRY / "slotted_link.step").read_bytes())
        assert len(part_mesh(link("part.step"), tmp_path).cells) != len(before.cells)


class TestScene:
    RAW: dict[str, Any] = {  # noqa: RUF012
        "analysis": {"end_time": 0.01, "step": 1e-3},
        "links": {"crank": {"material": "steel", "shape": {"file": "crank.step"}}},
    }

    def test_the_ending_of_a_file_says_what_it_is(self) -> None:
        scene = scene_from(self.RAW, GEOMETRY)
        assert scene.links["crank"].shape == link().shape
        again = scene_from(scene.model_dump(mode="json", by_alias=True, exclude_none=True), GEOMETRY)
        assert again.links == scene.links

    def test_a_solid_of_an_assembly_is_found_by_the_links_name(self) -> None:
        raw = self.RAW | {"links": {"rod": {"material": "steel", "shape": {"file": "engine.step"}}}}
        mesh = link_mesh("rod", scene_from(raw, GEOMETRY).links["rod"], GEOMETRY)
        alone = made("connecting_rod.step")
        assert_allclose(volume_and_centre(mesh)[0], volume_and_centre(alone)[0], rtol=1e-4)

    @pytest.mark.parametrize(
        ("change", "message"),
        [
            ({"shape": {"file": "none.step"}}, r"links.crank.shape.file: must be a CAD file, got nothing at .*none.step"),
            ({"shape": {"file": "none.msh"}}, r"links.crank.shape.file: must be a mesh file, got nothing at .*none.msh"),
            ({"shape": {"file": "none.toml"}}, r"links.crank.shape.between: is required"),
            ({"shape": {"file": "crank.step", "sloid": "a"}}, r"links.crank.shape.sloid: unknown key, .* 'solid'"),
            ({"shape": {"file": "crank.step", "scale": "=2*x"}}, r"links.crank.shape.scale: must be an expression"),
            ({"shape": {"file": 3}}, r"links.crank.shape.kind: is required, one of .*, got nothing"),
            ({"mesh": {"unknowns": 500, "size": 0.003}}, r"links.crank.mesh.unknowns: cannot be combined "
            r"with size, got both"),
            ({"mesh": {"elements": [4, 2, 1]}}, r"links.crank.mesh.elements: must be left out for a cad"),
            ({"mesh": {"unknowns": 5}}, r"links.crank.mesh.unknowns: must be at least 100, got 5"),
            ({"model": "plane"}, r"links.crank.shape.kind: must be one of .* for a plane link, got 'cad'"),
            ({"model": "beam"}, r"links.crank.shape.kind: must be one of .* for a beam, got 'cad'"),
        ],
    )  # fmt: skip
    def test_bad_keys_have_their_message(self, change: dict[str, Any], message: str) -> None:
        raw = self.RAW | {"links": {"crank": self.RAW["links"]["crank"] | change}}
        with pytest.raises(SceneError, match=message):
            scene_from(raw, GEOMETRY)

    def test_unknowns_are_not_for_bars(self) -> None:
        shape = {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.1, "thickness": 0.1}
        raw = self.RAW | {"links": {"arm": {"material": "steel", "shape": shape, "mesh": {"unknowns": 500}}}}
        wanted = "for a part from CAD, an extrusion, a part or a plate link only, got one for a bar"
        with pytest.raises(SceneError, match=f"links.arm.mesh.unknowns: must be given {wanted}"):
            scene_from(raw, GEOMETRY)
