"""Which surface a joint, body or load finds on a link."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from numpy.testing import assert_allclose

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.errors import KedfemError, MeshError
from kedfem.links.build import bare_link, bare_links
from kedfem.links.record import Link
from kedfem.links.reduced import reduced, rigid_body_functions
from kedfem.links.segments import segmented
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.candidates import candidates
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, face_surface, joint_surface, surface_weights
from kedfem.links.surfaces.round_surfaces import round_surfaces
from kedfem.mesh import SolidMesh
from kedfem.motion.linkage import linkage
from kedfem.scene import scene_from

from ..laws.strategies import LAW, MATERIAL, Motion, motions, rotated
from ..turned import ball_on_neck, ball_seat, turned, with_face
from .test_dynamics import slider_crank


def link_of(shape: dict[str, Any], **mesh: Any) -> Any:
    """A single driven link of a shape, meshed."""
    raw = {
        "links": {"part": {"material": "steel", "shape": shape, "mesh": mesh}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "part"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }
    return bare_links(scene_from(raw))["part"]


PLATE = {"kind": "plate_link", "between": [[0, 0], [0.2, 0]], "width": 0.03, "thickness": 0.02, "bore_diameter": 0.01}


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_a_bore_is_found_whole_with_or_without_an_axis(layers: int) -> None:
    link = link_of(PLATE, elements_across=1, layers=layers)
    with_axis = joint_surface(link, "joints.A", np.zeros(3), np.array([0.0, 0, 1]))
    without = joint_surface(link, "joints.A", np.zeros(3), None)
    assert set(without.facets) == set(with_axis.facets)
    assert_allclose(with_axis.origin, 0, atol=1e-7)  # the middle of the bore; a quadratic circle is off by 1e-5
    assert_allclose(with_axis.spread.max(), 0.02 / np.sqrt(12), rtol=1e-6)  # uniform over its length


def test_a_bore_far_along_its_axis_is_not_the_joints() -> None:
    link = link_of(PLATE | {"offset": 0.5}, elements_across=1)
    with pytest.raises(KedfemError, match=r"^joints.A: must sit on a bore or a flat face of link 'part' at \(0, 0, 0\)"):
        joint_surface(link, "joints.A", np.zeros(3), np.array([0.0, 0, 1]))


def test_a_flat_coupling_surface_is_one_face_not_all_in_its_plane() -> None:
    """A U with two feet in one plane: the joint's foot alone carries it."""
    u = [[0, 0], [0.02, 0], [0.02, 0.08], [0.08, 0.08], [0.08, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]
    link = link_of({"kind": "extrusion", "thickness": 0.02, "outline": u}, size=0.02)
    surface = face_surface(link, "loads.push.at", np.array([0.01, 0, 0]))
    assert_allclose(surface.origin, [0.01, 0, 0], atol=1e-9)


def test_the_middle_of_a_block_is_no_ball_seat() -> None:
    block = [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]
    link = link_of({"kind": "extrusion", "thickness": 0.1, "outline": block}, size=0.1)
    with pytest.raises(KedfemError, match="must sit on"):
        joint_surface(link, "joints.A", np.array([0.05, 0.05, 0]), None)


def test_a_body_is_carried_by_its_own_links_hinge() -> None:
    """A guide at the same point, declared first and of another link, does not lend the body its axis."""
    raw = slider_crank("rigid")
    plate = {"kind": "plate_link", "width": 0.02, "thickness": 0.02, "bore_diameter": 0.01}
    for name, ends in (("crank", ["A", "B"]), ("rod", ["B", "C"])):
        raw["links"][name] = {"material": "steel", "shape": {**plate, "between": ends}, "mesh": {"elements_across": 1}}
    raw["joints"] = {"guide": raw["joints"].pop("guide"), **raw["joints"]}
    raw["bodies"] = {"lump": {"kind": "point_mass", "link": "rod", "at": "C", "mass": 0.5}}
    scene = scene_from(raw)
    model = elastic_model(scene, linkage(scene))
    assert {link.name for link in model.links} == {"crank", "rod", "piston"}


@pytest.mark.parametrize("kind", ["solid", "plane"])
def test_a_node_of_a_domed_face_stands_for_the_whole_face(kind: str) -> None:
    """Where facets of a curved face meet, each lies in its own corners' plane; none of them is a flat face."""
    dome = {"via": [0.105, 0.03], "to": [0.1, 0.06]}
    shape = {"kind": "extrusion", "thickness": 0.02, "outline": [[0, 0], [0.1, 0], dome, [0, 0.06]]}
    raw = {
        "links": {"part": {"model": kind, "material": "steel", "shape": shape, "mesh": {"size": 0.01}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "part"], "at": [0, 0.03]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }
    link = bare_links(scene_from(raw))["part"]
    top = np.array([0.105, 0.03, 0.0])
    assert np.linalg.norm(link.X - top, axis=1).min() < 1e-9
    area = surface_weights(link, face_surface(link, "loads.push.at", top)).sum()
    # an arc of chord 0.06 and height 0.005: r = 0.0925, half angle arcsin(0.03 / r)
    assert_allclose(area, 2 * 0.0925 * np.arcsin(0.03 / 0.0925) * 0.02, rtol=1e-6)


@pytest.mark.parametrize("across", [1, 2, 3, 4, 5, 7])
@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2, 2.5, 4.0])
def test_a_bars_end_is_held_as_a_whole_however_many_elements_it_has(across: int, angle: float) -> None:
    """The corners of the middle one of an odd number of facets are as far from the axis; it is no bore all the same."""
    end = np.array([0.76 * np.cos(angle), 0.76 * np.sin(angle), 0.0])
    raw = {
        "links": {"bar": {"material": "steel", "mesh": {"elements": [4, across, 1]}, "shape": {
            "kind": "bar", "between": [[0, 0], list(end[:2])], "width": 0.0254, "thickness": 0.0254}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "bar"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }  # fmt: skip
    link = bare_link(scene_from(raw), "bar")
    for point in (np.zeros(3), end):
        surface = joint_surface(link, "joints.A", point, np.array([0.0, 0.0, 1.0]))
        assert surface.facets is not None
        assert len(surface.facets) == across


# -- what a joint finds -------------------------------------------------------------------------------------

Z = np.array([0.0, 0.0, 1.0])
SHAFT = [(0.0, 0.01, 0.0, 0.006), (0.01, 0.02, 0.0, 0.01), (0.02, 0.03, 0.0, 0.006)]
CLEVIS = [(0.0, 0.005, 0.005, 0.012), (0.005, 0.01, 0.01, 0.012), (0.01, 0.015, 0.005, 0.012)]
STEPPED = [(0.0, 0.01, 0.005, 0.012), (0.01, 0.015, 0.009, 0.012)]


def made(mesh: SolidMesh, motion: Motion | None = None) -> Link:
    return solid_link("part", mesh if motion is None else rotated(mesh, motion), MATERIAL, np.eye(3))


def surface_at(link: Link, z: float, faces: Sequence[str] = ()) -> CouplingSurface:
    return joint_surface(link, "joints.A", np.array([0.0, 0.0, z]), Z, faces)


def refusal(link: Link, at: Sequence[float], axis: np.ndarray | None = Z, faces: Sequence[str] = ()) -> str:
    with pytest.raises(MeshError) as found:
        joint_surface(link, "joints.A", np.array(at, dtype=float), axis, faces)
    return str(found.value)


@pytest.mark.parametrize("nodes", [8, 10, 20, 27])
@pytest.mark.parametrize(
    ("z", "radius", "middle"), [(0.005, 0.006, 0.005), (0.012, 0.01, 0.015), (0.025, 0.006, 0.025), (0.034, 0.006, 0.025)]
)
def test_a_shaft_is_held_by_the_journal_that_the_joint_is_in_or_next_to(
    nodes: int, z: float, radius: float, middle: float
) -> None:
    surface = surface_at(made(turned(SHAFT, nodes)), z)
    assert_allclose(surface.origin, [0, 0, middle], atol=1e-7)
    # of a circle r/√2, of the 16-gon of hex8 r √((2 + cos 22.5°)/6)
    wanted = {8: np.sqrt((2 + np.cos(np.pi / 8)) / 6)}.get(nodes, np.sqrt(0.5)) * radius
    assert_allclose(surface.spread[:2], wanted, rtol=2e-3)  # its sides are not quite equal


@pytest.mark.parametrize("z", [0.0, 0.0075, 0.012])
def test_a_clevis_is_held_by_both_its_lugs_and_not_by_what_is_between(z: float) -> None:
    surface = surface_at(made(turned(CLEVIS)), z)
    assert_allclose(surface.origin, [0, 0, 0.0075], atol=1e-7)
    # uniform over 15 mm without the middle third
    assert_allclose(surface.spread[0], 0.015 * np.sqrt((1 - 1 / 27) / (1 - 1 / 3) / 12), rtol=1e-6)


def test_a_stepped_bore_is_held_where_the_joint_is_and_nowhere_on_the_step() -> None:
    link = made(turned(STEPPED))
    assert_allclose(surface_at(link, 0.003).origin[2], 0.005, atol=1e-7)
    assert_allclose(surface_at(link, 0.012).origin[2], 0.0125, atol=1e-7)
    assert_allclose(surface_at(link, 0.016).origin[2], 0.0125, atol=1e-7)
    assert refusal(link, [0, 0, 0.01]) == (
        "joints.A: must sit on one bore or journal of link 'part' at (0, 0, 0.01), got 2 that are as near: "
        "bore of radius 5 mm, -10 mm to 0 mm along it, bore of radius 9 mm, 0 mm to 5 mm along it; "
        "give the joint a point within one of them along the axis, or name its face in faces"
    )


def test_the_narrowest_of_bores_within_each_other_is_held() -> None:
    """A wheel: its hub's bore, not the inside of its rim, which is about the axis too."""
    wheel = [(0.0, 0.01, 0.005, 0.01), (0.0, 0.004, 0.01, 0.02), (0.0, 0.01, 0.02, 0.025)]
    surface = surface_at(made(turned(wheel)), 0.007)
    assert_allclose(surface.spread[2], 0.01 / np.sqrt(12), rtol=1e-6)
    assert_allclose(surface.spread[0], 0.005 / np.sqrt(2), rtol=1e-3)


def test_a_face_at_a_shafts_end_is_held_by_joints_without_an_axis() -> None:
    link = made(turned(SHAFT))
    assert joint_surface(link, "joints.A", np.zeros(3), None).spread[2] == 0.0
    assert joint_surface(link, "joints.A", np.array([0, 0, 0.005]), None).spread[2] > 0


@pytest.mark.parametrize("nodes", [8, 10, 20, 27])
@pytest.mark.parametrize(("mesh", "sides"), [(ball_on_neck, 92), (ball_seat, 45)])
def test_a_ball_with_a_neck_and_an_open_seat_are_held_about_their_centres(
    nodes: int, mesh: Callable[[float, int], SolidMesh], sides: int
) -> None:
    link = made(mesh(0.01, nodes))
    surface = joint_surface(link, "joints.A", np.zeros(3), None)
    assert surface.facets is not None
    assert len(surface.facets) == (2 * sides if nodes == 10 else sides)
    assert_allclose(np.linalg.norm(surface.origin + 0), abs(surface.origin[0]), atol=1e-6)


@LAW
@given(motions)
def test_a_bore_in_any_direction_is_found_without_its_axis(motion: Motion) -> None:
    link = made(turned(STEPPED), motion)
    middle = motion.moved(np.array([[0.0, 0.0, 0.005]]))[0]
    surface = joint_surface(link, "joints.A", middle, None)
    assert_allclose(surface.origin, middle, atol=1e-6)


# -- faces by name ------------------------------------------------------------------------------------------


def with_names(nodes: int = 20) -> SolidMesh:
    mesh = turned(STEPPED, nodes)
    for name, r, low in (("narrow", 0.005, 0.0), ("wide", 0.009, 0.01)):
        mesh = with_face(mesh, name, lambda x, r=r, low=low: (abs(np.hypot(x[:, 0], x[:, 1]) - r) < 1e-9)
                         & (x[:, 2] >= low))  # fmt: skip
    return mesh


@pytest.mark.parametrize("nodes", [8, 10, 20, 27])
def test_faces_that_are_named_make_the_coupling_surface_wherever_the_joint_is(nodes: int) -> None:
    link = made(with_names(nodes))
    assert_allclose(surface_at(link, 0.0, ["wide"]).origin, [0, 0, 0.0125], atol=1e-7)
    narrow, both = surface_at(link, 0.5, ["narrow"]), surface_at(link, 0.0, ["narrow", "wide"])
    assert_allclose(narrow.origin, surface_at(link, 0.003).origin, atol=1e-12)
    assert both.facets is not None
    assert len(both.facets) == (64 if nodes == 10 else 32)
    Q = np.column_stack([rigid_body_functions(link), np.sin(90 * link.X[:, 0])])
    small = reduced(link, Q)
    assert_allclose(surface_at(small, 0.5, ["narrow"]).fit, narrow.fit @ small.Q, atol=1e-9 * np.abs(narrow.fit).max())


def test_segments_keep_the_names_of_their_faces() -> None:
    link = made(with_names())
    ends = np.array([[0, 0, 0.0], [0, 0, 0.015]])
    cut = segmented(link, MATERIAL, 2, ends, [])
    there = [[len(face.facets) for face in part.faces] for part in cut.parts]
    assert [[face.face.name for face in part.faces] for part in cut.parts] == [["narrow", "wide"]] * 2
    assert np.sum(there, axis=0).tolist() == [16, 16]
    low, high = cut.parts
    assert_allclose(surface_at(high, 0, ["wide"]).origin, [0, 0, 0.0125], atol=1e-7)
    assert "have elements, got 'wide'" in refusal(low, [0, 0, 0], faces=["wide"])


def test_names_that_a_link_does_not_have_are_answered_with_those_it_has() -> None:
    assert refusal(made(with_names()), [0, 0, 0], faces=["pin"]) == (
        "joints.A.faces: must name faces of link 'part', got 'pin'; it has 'narrow', 'wide'"
    )
    assert refusal(made(turned(STEPPED)), [0, 0, 0], faces=["pin"]).endswith(
        "it has none (a part from CAD, or a mesh file with groups, has some)"
    )


def test_a_scene_names_the_faces_of_a_joint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Through the model, for a flywheel at the joint as well."""
    monkeypatch.setattr("kedfem.mesh.link.link_mesh", lambda *_: with_names())
    raw = {
        "links": {"part": {"material": "steel", "shape": {"kind": "mesh", "file": "any"}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "part"], "at": [0, 0, 0.003],
                         "faces": {"part": "wide"}}},
        "bodies": {"wheel": {"kind": "flywheel", "link": "part", "at": [0, 0, 0.003], "inertia": 1e-6}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }  # fmt: skip
    (tmp_path / "any").touch()
    scene = scene_from(raw, tmp_path)
    model = elastic_model(scene, linkage(scene))
    held = model.links[0].X[model.joints[0].nodes]
    assert_allclose(np.hypot(held[:, 0], held[:, 1]), 0.009, rtol=1e-9)
    bare = bare_links(scene)["part"]
    rows = np.unique(abs(model.links[0].mass[0] - bare.mass[0]).tocoo().coords[0])
    heavy = abs(model.links[0].mass[0] - bare.mass[0]).max()
    assert heavy > 0
    assert_allclose(np.hypot(bare.X[rows, 0], bare.X[rows, 1]), 0.009, rtol=1e-9)


def test_faces_are_found_however_nodes_are_numbered() -> None:
    mesh = with_names()
    order = np.random.default_rng(2).permutation(len(mesh.points))  # new number of each node
    points = np.empty_like(mesh.points)
    points[order] = mesh.points
    faces = tuple(replace(face, sides=order[face.sides]) for face in mesh.faces)
    link = made(SolidMesh(points, order[mesh.cells], faces))
    assert [len(face.facets) for face in link.faces] == [16, 16]
    assert_allclose(surface_at(link, 0.0, ["wide"]).origin, [0, 0, 0.0125], atol=1e-7)


# -- what is said where there is none -----------------------------------------------------------------------


@pytest.mark.parametrize("sides", range(3, 13))
def test_a_prism_of_few_sides_is_no_journal_and_its_hole_no_bore(sides: int) -> None:
    """Corners at one distance from the axis do not make a cylinder; seven flat facets around are one that is coarse."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    plane = 0.01 * np.concatenate([2 * ring, ring])
    j = np.arange(sides)
    quads = np.column_stack([j, (j + 1) % sides, sides + (j + 1) % sides, sides + j])[:, ::-1]
    points = np.column_stack([np.tile(plane, (2, 1)), np.repeat([0.0, 0.01], len(plane))])
    link = made(SolidMesh(points, np.column_stack([quads, quads + len(plane)])))
    found = round_surfaces(link, np.zeros(3), np.array([0.0, 0, 1]))
    assert sorted(each.inward for each in found) == ([] if sides < 7 else [False, True])


def test_an_axis_askew_is_told_with_its_angle() -> None:
    tilt = np.array([0.0, np.sin(np.radians(3.2)), np.cos(np.radians(3.2))])
    told = refusal(made(turned(STEPPED)), [0, 0, 0.004], tilt)
    assert "a bore of radius 5 mm passes here, but its axis is 3.2 deg off: it is (0, 0, 1)" in told


def test_a_point_beside_the_axis_is_told_with_its_distance() -> None:
    told = refusal(made(turned(STEPPED)), [0, 0.0003, 0.004])
    assert "a bore of radius 5 mm is here, but its axis is 0.3 mm beside the point" in told


@pytest.mark.parametrize(("scale", "word", "wanted"), [(1e3, "smaller", "0.001"), (1e-3, "larger", "1000")])
def test_units_off_by_1000_are_noticed(scale: float, word: str, wanted: str) -> None:
    mesh = turned([(z + 0.2, w + 0.2, a, b) for z, w, a, b in STEPPED])
    told = refusal(made(replace(mesh, points=scale * mesh.points)), [0, 0, 0.205])
    assert f"the part seems to be in other units: 1000 times {word} it would fit (scale = {wanted})" in told


def test_a_part_elsewhere_is_not_blamed_on_units() -> None:
    assert "units" not in refusal(made(turned(STEPPED)), [0.3, 0, 0.2])
    assert "units" not in refusal(made(turned(STEPPED)), [0, 0, 0.5])  # along its axis


def test_what_a_link_offers_is_listed_nearest_first_and_not_without_end() -> None:
    told = refusal(made(turned(CLEVIS)), [0.05, 0, 0.012])
    offered, advice = told.split("; it has ")[1].split("; ")
    assert advice == "move the joint to one of these, or give the link a bore there"
    assert offered == (
        "bore of radius 5 mm about (0, 0, 1) at (0, 0, 0.0125) 50 mm away, "
        "journal of radius 12 mm about (0, 0, 1) at (0, 0, 0.0075) 50 mm away, "
        "bore of radius 10 mm about (0, 0, 1) at (0, 0, 0.0075) 50.04 mm away, and 1 more"
    )
    many = turned([(0.002 * k, 0.002 * (k + 1), 0.0, 0.005 + 0.001 * (k % 2)) for k in range(11)])
    told = refusal(made(many), [0.05, 0, 0.0])
    assert told.count("journal of radius") == 3
    assert ", and 8 more; move" in told


def test_candidates_with_names_are_told_by_them() -> None:
    told = refusal(made(with_names()), [0.05, 0, 0])
    assert "its nearest face is the face 'wide' at (" in told


@pytest.mark.parametrize("nodes", [8, 10, 20, 27])
def test_a_bore_with_rounded_mouths_is_told_by_its_cylinder(nodes: int) -> None:
    """Layers of 2 mm; those at the ends flare out by 0.8 mm, smoothly."""
    mesh = turned([(0.002 * k, 0.002 * (k + 1), 0.005, 0.012) for k in range(7)], nodes)
    x = mesh.points.copy()
    r = np.hypot(x[:, 0], x[:, 1])
    mouth = np.clip((np.abs(x[:, 2] - 0.007) - 0.005) / 0.002, 0, 1) ** 2
    x[:, :2] *= (1 + 0.0008 * mouth * (0.012 - r) / 0.007 / r)[:, None]
    link = made(replace(mesh, points=x))
    (bore,) = [each for each in candidates(link) if each.kind == "bore"]
    assert_allclose(bore.radius, 0.005, rtol=1e-6)
    assert_allclose(np.abs(bore.direction), Z, atol=1e-9)
    assert_allclose(bore.length, 0.01, rtol=1e-6)
    assert_allclose(joint_surface(link, "joints.A", np.array([0, 0, 0.007]), None).origin, [0, 0, 0.007], atol=1e-7)


@pytest.mark.parametrize("nodes", [8, 10, 20, 27])
def test_candidates_are_as_the_part_was_made(nodes: int) -> None:
    ball = [each for each in candidates(made(ball_on_neck(0.01, nodes))) if each.kind != "plane face"]
    assert [each.kind for each in ball] == ["ball"]
    assert_allclose(ball[0].radius, 0.01, rtol=1e-6)
    surface = [each for each in candidates(made(ball_seat(0.01, nodes))) if each.kind != "plane face"]
    assert [(each.kind, round(each.radius, 9)) for each in surface] == [("ball seat", 0.01)]
