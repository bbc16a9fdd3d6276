"""Plane links in every room: meshes of all plates, joints of all kinds, loads, bodies, results, pictures."""

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed
from kedfem.analysis import analyse
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.model import Model
from kedfem.errors import KedfemError, MeshError
from kedfem.links.build import bare_links
from kedfem.links.surfaces.coupling_surfaces import joint_surface
from kedfem.mesh import QuadMesh, SolidMesh, link_mesh, mesh_quality, plane_mesh
from kedfem.motion.linkage import linkage
from kedfem.output.fields import DISPLACEMENT, STRESS, VON_MISES, LinkField
from kedfem.output.picture import write_picture
from kedfem.output.rendering import lifted
from kedfem.output.vtu import write_frame
from kedfem.scene import LinkScene, scene_from
from kedfem.tables import check_tables
from tests.frames import frames
from tests.runs import quick

from .test_dynamics import four_bar, run, slider_crank
from .test_joints import arm, histories

ROOT = Path(__file__).parents[2]
U = {
    "kind": "extrusion",
    "thickness": 0.02,
    "outline": [[0, 0], [0.2, 0], {"via": [0.25, 0.05], "to": [0.2, 0.1]}, [0, 0.1]],
    "holes": [{"at": [0.2, 0.05], "diameter": 0.04}],
}
SHAPES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "bar": ({"kind": "bar", "between": [[1, 2], [1, 3]], "width": 0.1, "thickness": 0.03}, {}),
    "plate_link": (
        {"kind": "plate_link", "between": [[1, 2, 0.5], [2, 2, 0.5]], "width": 0.1, "thickness": 0.05,
         "eye_diameter": 0.2, "bore_diameter": 0.1, "offset": 0.02}, {"elements_across": 1},
    ),
    "extrusion": (U, {"size": 0.025}),
    "part": ({"kind": "part", "file": "piston.toml", "between": [[1, 2, 0.5], [1, 2.04, 0.5]]}, {}),
}  # fmt: skip


def both(kind: str, **link: Any) -> tuple[QuadMesh, SolidMesh]:
    shape, mesh = SHAPES[kind]
    folder = ROOT / "geometry"
    plane = LinkScene(shape=shape, mesh=mesh, model="plane", **link)
    solid = LinkScene(shape=shape, mesh=mesh, element="hex27")
    return plane_mesh("any", plane, folder), link_mesh("any", solid, folder)


# -- meshes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", SHAPES)
def test_a_plane_mesh_is_the_middle_of_the_solids(kind: str) -> None:
    flat, solid = both(kind)
    middle = solid.points[solid.cells[:, 20:]].mean(axis=1)[:, 2]  # of hexahedra one layer thick
    assert_allclose(flat.points[:, 2], middle[0], atol=1e-14)
    assert flat.thickness == pytest.approx(np.ptp(solid.points[:, 2]), rel=1e-12)
    assert len(flat.cells) == len(solid.cells)
    level = solid.points[np.abs(solid.points[:, 2] - middle[0]) < 1e-9]
    assert len(level) == len(flat.points)
    assert_allclose(flat.points[np.lexsort(flat.points.T)], level[np.lexsort(level.T)], atol=1e-12)


@pytest.mark.parametrize("kind", SHAPES)
def test_quality_of_a_plane_mesh_is_that_of_the_solids(kind: str) -> None:
    flat, solid = (mesh_quality(mesh) for mesh in both(kind))
    assert_allclose(flat.scaled_jacobian, solid.scaled_jacobian, atol=1e-9)
    if kind != "bar":  # whose elements are all alike
        assert_allclose(flat.centre, solid.centre, atol=1e-9)


def test_the_gate_holds_for_plane_meshes() -> None:
    with pytest.raises(MeshError, match=r"links.any: scaled Jacobian must be at least 0.99 everywhere, got 0\."):
        both("plate_link", min_quality=0.99)


def test_a_plane_mesh_cannot_be_written_to() -> None:
    flat, _ = both("bar")
    with pytest.raises(ValueError, match="read-only"):
        flat.points[0] = 0


def test_shapes_without_a_plate_are_no_plane_links(tmp_path: Path) -> None:
    link = LinkScene(shape={"kind": "mesh", "file": "any.vtu"}, model="plane")
    message = "links.any.shape: must be bar, plate_link, extrusion, part, mesh or cad, got mesh"
    with pytest.raises(MeshError, match=message.replace(".", r"\.")):
        plane_mesh("any", link, tmp_path)


# -- joints -------------------------------------------------------------------------------------------------


def plane_arm(pieces: int) -> dict[str, Any]:
    raw = arm("plane", pieces)
    for link in raw["links"].values():
        link["mesh"]["elements"] = link["mesh"]["elements"][:2]
    return raw


def test_welded_pieces_are_one_piece() -> None:
    one, two = histories(plane_arm(1)), histories(plane_arm(2))
    for name in ("probes/tip/displacement", "drive/torque"):
        # pieces share the mean and the turn of their faces, so the cut is a little softer
        assert_allclose(two[name], one[name], rtol=0, atol=4e-3 * np.abs(one[name]).max())


@pytest.mark.parametrize(("kind", "sizes"), [("plane", (2, 4)), ("solid", (2, 4))])
def test_a_driven_bore_is_as_stiff_whatever_its_mesh(kind: str, sizes: tuple[int, int]) -> None:
    """The principal directions of a circle are rounding's choice (here 90° apart), and must have no influence."""
    found, across = [], []
    for size in sizes:
        raw = four_bar("plate", steps_per_revolution=24, revolutions=1 / 24, initial="quasi-static")
        raw["drive"]["motion"]["speed"] = "60 rpm"
        raw["links"]["crank"] |= {"model": kind, "mesh": {"elements_across": size}}
        for name in ("coupler", "rocker"):
            raw["links"][name] |= {"model": "plane", "mesh": {"elements_across": 2}}
        raw["output"] = {"probes": {"B": {"link": "crank", "at": [0.3048 * 0.4, 0.3048 * 0.4 * 3**0.5],
                                          "quantity": "displacement"}}}  # fmt: skip
        link = bare_links(scene_from(raw))["crank"]
        surface = joint_surface(link, "A", np.zeros(3), np.array([0.0, 0, 1]))
        across.append(surface.directions[0 if kind == "plane" else 1] @ link.axes[:, 0])
        found.append(histories(raw)["probes/B/displacement"][0])
    assert abs(abs(across[0]) - abs(across[1])) > 0.9
    # the mesh's own error; held along one direction only, the eye's compliance changed it by 40 %
    assert_allclose(found[0], found[1], rtol=0, atol=0.01 * np.abs(found[1]).max())


def mixed(*models: str, **analysis: Any) -> dict[str, Any]:
    """The four-bar of plates with a kind per link; beams are as wide as the waist."""
    raw = four_bar("plate", steps_per_revolution=60, revolutions=0.5, initial="quasi-static", **analysis)
    raw["drive"]["motion"]["speed"] = "60 rpm"
    for link, kind in zip(raw["links"].values(), models, strict=True):
        link["model"] = kind
        if kind == "beam":
            bar = {"kind": "bar", "between": link["shape"]["between"], "width": 0.0254, "thickness": 0.0254}
            link |= {"shape": bar, "mesh": {"elements": 2}}
    return raw


@pytest.mark.parametrize("kinds", [("plane", "beam", "solid"), ("solid", "plane", "beam"), ("beam", "solid", "plane")])
def test_plane_links_beams_and_solids_share_a_scene(kinds: tuple[str, ...]) -> None:
    """Hinges close between rows of two and of three components; condensed is monolithic; pins stay upright."""
    model, _, fast = run(mixed(*kinds))
    _, _, slow = run(mixed(*kinds, solver="monolithic"))
    peak = max(np.abs(s.u).max() for snapshot in slow for s in snapshot.states)
    for a, b in zip(fast, slow, strict=True):
        for s, r in zip(a.states, b.states, strict=True):
            assert_allclose(s.u, r.u, rtol=0, atol=5e-8 * peak)
    for name, pair in (("B", (0, 1)), ("C", (1, 2))):
        for snapshot in fast[::10]:
            moved = [pin(model, snapshot.states[k].u, k, name) for k in pair]
            assert_allclose(moved[0][:2], moved[1][:2], rtol=0, atol=1e-10 * peak)
            assert all(abs(m[2]) < 1e-10 * peak for m in moved if len(m) == 3)


def pin(model: Model, u: np.ndarray, k: int, name: str) -> np.ndarray:
    """Displacement of a joint on a link: the mean of its ports, of a beam without its turn."""
    joint = model.joints[k]
    here = [i for i, which in enumerate(joint.joints) if which == name]
    moved = (joint.weights[here] @ u[joint.nodes]).mean(axis=0)
    return np.asarray(moved[:2] if model.links[k].kind == "beam" else moved)


def test_a_mixed_four_bar_behaves_as_its_solid_twin() -> None:
    a, b = histories(mixed("plane", "solid", "plane")), histories(mixed("solid", "solid", "solid"))
    for name in ("joints/A/force", "joints/B/force", "joints/C/force", "drive/torque", "energy/strain"):
        # plane stress against 25 mm of thickness: 0.3 % of the energy
        assert_allclose(a[name], b[name], rtol=0, atol=5e-3 * np.abs(b[name]).max())
    assert_allclose(a["drive/rigid_torque"], b["drive/rigid_torque"], rtol=1e-11)


def engine(kind: str) -> dict[str, Any]:
    """The example's crank, connecting rod and piston: parts, a guide along a side, a gas force on the crown."""
    raw = tomllib.loads((ROOT / "examples/slider_crank_solids/scene.toml").read_text("utf-8"))
    raw["analysis"] |= {"revolutions": 0.5, "steps_per_revolution": 180}
    for link in raw["links"].values():
        link["model"] = kind
        link["shape"]["file"] = str(ROOT / "geometry" / Path(link["shape"]["file"]).name)
    return raw


@pytest.mark.long
def test_a_guided_piston_under_gas_is_that_of_solids() -> None:
    a, b = histories(engine("plane")), histories(engine("solid"))
    for name in ("probes/rod_edge/stress", "joints/A/force", "joints/guide/force", "drive/torque"):
        # plane stress against 20 mm of thickness
        assert_allclose(a[name], b[name], rtol=0, atol=8e-3 * np.abs(b[name]).max())
    # surface and inertia loads have the same resultants
    assert_allclose(a["drive/rigid_torque"], b["drive/rigid_torque"], rtol=1e-9, atol=1e-9)
    assert not a["probes/rod_edge/stress"][:, [2, 4, 5]].any()


def test_a_guide_holds_turning() -> None:
    """A plane block guided on one side keeps its edge along the guide, to rounding."""
    model, _, snapshots = run(engine("plane"))
    piston = next(k for k, link in enumerate(model.links) if link.name == "piston")
    joint = model.joints[piston]
    guide = [i for i, name in enumerate(joint.joints) if name == "guide"]
    assert len(guide) == 2
    moved = joint.weights[guide] @ snapshots[-1].states[piston].u[joint.nodes]
    assert np.abs(moved[:, 1]).max() < 1e-10 * np.abs(moved[:, 0]).max()


def test_a_guide_across_its_edge_is_refused() -> None:
    raw = engine("plane")
    lower = np.array([-0.026, 0.0275])  # on the end of the skirt, which is across the guide
    raw["points"]["K"] = {"from": "C", "distance": np.hypot(*lower), "angle": np.arctan2(*lower[::-1])}
    raw["joints"]["guide"]["at"] = "K"
    with pytest.raises(KedfemError, match=r"joints.guide: must sit on a bore of link 'piston', or on an edge along"):
        run(raw)


def test_a_rigid_slider_rides_on_a_plane_rod() -> None:
    """As on a solid rod, and its mass as a point mass on the bore."""
    plate = {"kind": "plate_link", "width": 0.02, "thickness": 0.006, "eye_diameter": 0.04, "bore_diameter": 0.02}

    def scene(kind: str, piston: str) -> dict[str, Any]:
        raw = slider_crank(piston)
        raw["analysis"]["steps_per_revolution"] = 120
        for name, ends in (("crank", ["A", "B"]), ("rod", ["B", "C"])):
            shape = {**plate, "between": ends}
            raw["links"][name] = {"material": "steel", "shape": shape, "mesh": {"elements_across": 1}}
            raw["links"][name]["model"] = kind
        return raw

    plane, solid = histories(scene("plane", "rigid")), histories(scene("solid", "rigid"))
    for name in ("joints/C/force", "joints/guide/force", "drive/torque"):
        assert_allclose(plane[name], solid[name], rtol=0, atol=2e-3 * np.abs(solid[name]).max())
    bodily = histories(scene("plane", "on the rod"))
    assert_allclose(bodily["drive/torque"], plane["drive/torque"], rtol=0, atol=1e-8)


def test_gravity_forces_and_pressure_have_their_resultants() -> None:
    raw = four_bar("plane", gravity=None)
    raw["analysis"].pop("gravity")
    raw["gravity"] = [0, -9.81, 0]
    raw["bodies"]["mass"] = {"kind": "point_mass", "link": "coupler", "at": "B", "mass": 3.0}
    raw["links"]["bar"] = {
        "model": "plane", "material": "steel", "mesh": {"elements": [4, 2]},
        "shape": {"kind": "bar", "between": ["D", [1.4144, 0]], "width": 0.05, "thickness": 0.02},
    }  # fmt: skip
    raw["joints"]["W"] = {"kind": "weld", "links": ["ground", "bar"], "at": "D"}
    raw["loads"] = {
        "push": {"kind": "surface", "link": "bar", "at": [1.4144, 0], "vector": ["2 MPa", 0]},
        "tip": {"kind": "force", "link": "bar", "at": [1.4144, 0.025], "vector": [3, 4]},
        "all": {"kind": "body", "link": "bar", "vector": [0, 100]},
    }
    scene = scene_from(raw)
    model = elastic_model(scene, linkage(scene))
    links = {link.name: (link, loads) for link, loads in zip(model.links, model.loads, strict=True)}
    bar, (gravity, push, tip, body) = links["bar"]
    density = scene.materials["steel"].density
    assert_allclose(gravity.forces.sum(axis=0), [0, -9.81 * density * 0.5 * 0.05 * 0.02], rtol=1e-12, atol=1e-12)
    assert_allclose(push.forces.sum(axis=0), [2e6 * 0.05 * 0.02, 0], rtol=1e-12)
    assert_allclose(tip.forces.sum(axis=0), [3, 4], rtol=1e-12)
    assert_allclose(body.forces.sum(axis=0), [0, 100 * 0.5 * 0.05 * 0.02], rtol=1e-12, atol=1e-12)
    assert_allclose(bar.X[:, 0] @ push.forces[:, 0], 1.4144 * 2000, rtol=1e-12)  # on the end, not elsewhere
    coupler = links["coupler"][0]
    bare = bare_links(scene)["coupler"]
    assert coupler.m1[:, 0].sum() - bare.m1[:, 0].sum() == pytest.approx(3.0, rel=1e-12)


def test_turning_the_whole_scene_turns_the_answer_and_offset_plates_are_only_drawn_there() -> None:
    raw, turned = four_bar("plane", revolutions=0.2), four_bar("plane", revolutions=0.2)
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turned["points"] |= {
        "D": [0.9144 * c, 0.9144 * s],
        "B": {"from": "A", "distance": 0.3048, "angle": np.pi / 3 + angle},
    }
    turned["links"]["coupler"]["shape"] |= {"offset": 0.0254}
    for each, gravity in ((raw, [0.0, -9.81, 0.0]), (turned, (R @ [0, -9.81, 0]).tolist())):
        each["gravity"] = gravity
    assert (bare_links(scene_from(turned))["coupler"].X[:, 2] == 0.0254).all()
    a, b = histories(raw), histories(turned)
    for name in ("joints/A/force", "joints/A/moment", "joints/B/force", "joints/D/force", "drive/torque"):
        wanted = a[name] @ R.T if a[name].shape[1] == 3 else a[name]
        assert_allclose(b[name], wanted, rtol=0, atol=1e-6 * np.abs(a[name]).max())
    assert_allclose(b["energy/strain"], a["energy/strain"], rtol=1e-6, atol=1e-9 * a["energy/strain"].max())


# -- results ------------------------------------------------------------------------------------------------


def test_torque_of_stiff_plane_links_is_the_virtual_work_of_the_rigid_linkage() -> None:
    found = {}
    for factor in (1, 16):
        raw = four_bar("plane", steps_per_revolution=120, revolutions=0.5, initial="quasi-static", rho_inf=0.8)
        raw["drive"]["motion"]["speed"] = "60 rpm"
        for key in ("youngs_modulus", "shear_modulus"):
            raw["materials"]["alloy"][key] *= factor
        h = histories(raw)
        torque, rigid = h["drive/torque"], h["drive/rigid_torque"]
        found[factor] = float(np.sqrt(np.mean((torque - rigid) ** 2) / np.mean(rigid**2)))
    assert found[1] < 2e-3
    assert found[16] == pytest.approx(found[1] / 16, rel=0.1)  # bending follows 1 / E


def test_probes_read_two_components_and_plane_stress() -> None:
    raw = four_bar("plane", steps_per_revolution=60, revolutions=0.2, initial="quasi-static")
    raw["points"]["N"] = {"between": ["B", "C"], "fraction": 0.5}
    ask = {"link": "coupler", "at": "N"}
    raw["output"] = {"probes": {
        "d": {**ask, "quantity": "displacement", "frame": "world"}, "l": {**ask, "quantity": "displacement"},
        "s": {**ask, "quantity": "stress"},
    }}  # fmt: skip
    h = histories(raw)
    world, link, stress = (h[f"probes/{name}"] for name in ("d/displacement", "l/displacement", "s/stress"))
    assert world.shape[1] == link.shape[1] == 2
    assert_allclose(np.linalg.norm(link, axis=1), np.linalg.norm(world, axis=1), rtol=1e-12)
    assert not stress[:, [2, 4, 5]].any()
    xx, yy, xy = stress[:, [0, 1, 3]].T
    assert_allclose(stress[:, 6] ** 2, xx**2 - xx * yy + yy**2 + 3 * xy**2, rtol=1e-12)


def test_a_run_writes_quadrilaterals_and_the_check_names_them(tmp_path: Path) -> None:
    raw = four_bar("plane", steps_per_revolution=24)
    raw["output"] = {"folder": str(tmp_path), "animation": {"frames_per_revolution": 2}, "plots": False}
    scene = scene_from(quick(raw))
    done = analyse(scene)
    assert done.peak is not None
    mesh = frames(tmp_path)[-1]
    assert set(mesh.celltypes) == {28, 29}  # of 9 nodes; bodies are balls of hexahedra
    links = np.isfinite(mesh.point_data[VON_MISES])  # bodies have no fields
    assert not mesh.point_data[DISPLACEMENT][links, 2].any()
    assert not mesh.point_data[STRESS][links][:, [2, 4, 5]].any()
    assert mesh.point_data[VON_MISES][links].max() > 0
    assert (tmp_path / "worst.png").stat().st_size > 10_000
    ready = meshed(scene)
    columns = check_tables(ready, None, None)[0].columns
    kind, elements, unknowns, quality = (list(columns[i].cells) for i in (1, 2, 3, 5))
    assert kind == ["quad9"] * 3
    assert elements == [str(len(link.cells)) for link in ready.model.links]
    assert unknowns == [str(2 * link.n) for link in ready.model.links]
    assert all(0.3 < float(q) <= 1 for q in quality)


def test_vtk_takes_9_nodes_in_our_order(tmp_path: Path) -> None:
    """The area of a quarter of a ring from one element, by VTK's own quadrature of the quadratic cell."""
    import pyvista

    flat, _ = both("extrusion")
    stress = np.zeros((len(flat.points), 6))
    field = LinkField("u", "quad9", flat.cells, flat.points, 0 * flat.points, stress, stress[:, 0], stress[:, :2])
    vtu = tmp_path / "frame.vtu"
    write_frame(vtu, 0.0, [field])
    grid = pyvista.read(vtu)
    assert set(grid.celltypes) == {28}  # VTK_BIQUADRATIC_QUAD
    surface = grid.extract_surface(nonlinear_subdivision=4, algorithm="dataset_surface")
    area = 0.2 * 0.1 + np.pi * 0.05**2 / 2 - np.pi * 0.02**2
    assert surface.triangulate().area == pytest.approx(area, rel=2e-3)  # chords; straight sides: 4 % off
    write_picture(vtu, tmp_path / "picture.png", "one plate")


def test_plane_links_in_one_plane_are_drawn_one_above_the_other(tmp_path: Path) -> None:
    """By a thousandth of the diagonal, and only in the picture; without that their faces flicker where they overlap."""
    import pyvista

    flat, _ = both("bar")
    stress = np.zeros((len(flat.points), 6))
    one = LinkField("one", "quad9", flat.cells, flat.points, 0 * flat.points, stress, stress[:, 0], stress[:, :2])
    vtu = tmp_path / "frame.vtu"
    write_frame(vtu, 0.0, [one, replace(one, name="two")])
    grid = pyvista.read(vtu)
    z = lifted(grid).points[:, 2].reshape(2, -1)
    assert_allclose(z[0], 0, atol=1e-15)
    assert_allclose(z[1], 1e-3 * grid.length, rtol=1e-6)
    assert not grid.points[:, 2].any()
