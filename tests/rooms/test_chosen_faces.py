"""Faces that joints choose by what they are: found whole, or refused with what the link has, nearest first."""

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.joints.places import part_surface, surface_of
from kedfem.errors import MeshError
from kedfem.links.build import bare_links
from kedfem.links.record import Link
from kedfem.links.reduced import reduced, rigid_body_functions
from kedfem.links.segments import segmented
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.candidates import surfaces
from kedfem.links.surfaces.chosen_faces import choice_text, chosen_surface, distance, matches
from kedfem.mesh import SolidMesh
from kedfem.motion.closed import STILL, RigidDisplacement, closed_scene
from kedfem.motion.linkage import linkage
from kedfem.scene import ChosenFace, Material, Scene, scene_from

from ..turned import ball_on_neck, ball_seat, turned
from .cad_files import lever, written

STEEL = Material(density=7850, youngs_modulus=2.1e11, poisson_ratio=0.3)
# a sleeve: bores of diameter 10 and 8 mm after each other, journals of 20 and 30 mm around them
SLEEVE = [(0.0, 0.01, 0.005, 0.01), (0.01, 0.02, 0.004, 0.015)]


def made(mesh: SolidMesh) -> Link:
    return solid_link("part", mesh, STEEL, np.eye(3))


def scene_with(tmp_path: Path, faces: Any, at: Any = (0, 0, 0.005), axis: str = "z", **link: Any) -> Scene:
    (tmp_path / "any").touch()
    raw = {
        "points": {"B": [0, 0, 0.015]},
        "links": {"part": {"material": "steel", "shape": {"kind": "mesh", "file": "any"}, **link}},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "part"], "at": at, "axis": axis, "faces": {"part": faces}}
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }
    return scene_from(raw, tmp_path)


@pytest.fixture
def sleeve(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kedfem.mesh.link.link_mesh", lambda *_: turned(SLEEVE))


def held(scene: Scene) -> np.ndarray:
    model = elastic_model(scene, linkage(scene))
    return model.links[0].X[model.joints[0].nodes]


@pytest.mark.usefixtures("sleeve")
@pytest.mark.parametrize(
    ("faces", "radius", "low", "high"),
    [
        ({"cylinder": "8 mm"}, 0.004, 0.01, 0.02),
        ({"cylinder": "30 mm", "axis": "z"}, 0.015, 0.01, 0.02),
        ([{"cylinder": 0.01, "near": "B"}], 0.005, 0.0, 0.01),
        ({"plane": [0, 0, -1], "near": [0.007, 0, 0.0001]}, None, 0.0, 0.0),
        ({"plane": "z", "near": [0, 0.013, 0.0205]}, None, 0.02, 0.02),
    ],
)
def test_a_joint_is_held_by_the_face_that_is_meant(
    tmp_path: Path, faces: Any, radius: float | None, low: float, high: float
) -> None:
    """Through the scene and the model, wherever the joint is."""
    flat = "plane" in faces
    X = held(scene_with(tmp_path, faces, at=(0, 0, low if flat else 0.005), axis="x" if flat else "z"))
    assert_allclose([X[:, 2].min(), X[:, 2].max()], [low, high], atol=1e-9)
    if radius is not None:
        assert_allclose(np.hypot(X[:, 0], X[:, 1]), radius, rtol=1e-6)


@pytest.mark.usefixtures("sleeve")
def test_choices_and_names_of_several_faces_make_one_coupling_surface(tmp_path: Path) -> None:
    X = held(scene_with(tmp_path, [{"cylinder": "8 mm"}, {"cylinder": "10 mm"}]))
    assert_allclose(sorted(set(np.round(np.hypot(X[:, 0], X[:, 1]), 7))), [0.004, 0.005])


@pytest.mark.usefixtures("sleeve")
def test_segments_and_reduced_links_know_the_choice_that_was_made_on_the_whole(tmp_path: Path) -> None:
    """The 8 mm bore is in one segment alone: no other is taken for it on the segment where the joint is."""
    scene = scene_with(tmp_path, {"cylinder": "8 mm"}, at=(0, 0, 0.002))
    whole = bare_links(scene)["part"]
    cut = segmented(whole, STEEL, 2, np.array([[0, 0, 0.0], [0, 0, 0.02]]), [])
    assert len(cut.parts) == 2
    links = {f"part {i}": each for i, each in enumerate(cut.parts)}
    key, surface = part_surface(scene, "A", links, "part")
    assert_allclose(surface.origin, [0, 0, 0.015], atol=1e-7)
    X = links[key].X[links[key].basis.mesh.facets[:, surface.facets]]
    assert_allclose(np.hypot(X[..., 0], X[..., 1]), 0.004, rtol=1e-6)
    small = reduced(whole, np.column_stack([rigid_body_functions(whole), np.sin(90 * whole.X[:, 0])]))
    assert_allclose(surface_of(scene, "A", small).origin, surface.origin, atol=1e-7)
    (face,) = whole.faces
    assert face.face.chosen
    assert face.face.name == '{ cylinder = "8 mm" }'
    assert_allclose(face.face.radius, 0.004, rtol=1e-6)


@pytest.mark.parametrize("mesh", [turned(SLEEVE), turned(SLEEVE, 10), ball_on_neck(0.01), ball_seat(0.01)], ids=str)
def test_what_is_offered_chooses_itself_when_it_is_copied_back(mesh: SolidMesh) -> None:
    link = made(mesh)
    offered = surfaces(link)
    assert len(offered) >= 2
    for each in offered:
        text = choice_text(link, each)
        choice = ChosenFace.model_validate(tomllib.loads(f"x = {text}")["x"])
        assert choice.near is not None
        assert chosen_surface(link, "here", choice, np.array(choice.near), offered) is each


def test_a_part_from_cad_has_all_its_faces_to_choose_from(tmp_path: Path) -> None:
    """Half cylinders too, by diameter; the plane that is nearest."""
    written(tmp_path, "lever", lever, ("step",))
    raw = {
        "links": {"arm": {"material": "steel", "shape": {"file": "lever.step"}, "element": "hex20"}},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "arm"], "at": "0 mm", "faces": {"arm": {"cylinder": "8 mm"}}}
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }  # fmt: skip
    raw["joints"]["A"]["at"] = [0.05, 0.01, 0.004]
    link = bare_links(scene_from(raw, tmp_path))["arm"]
    bore = link.faces[-1].face
    assert (bore.kind, bore.inward, bore.name) == ("cylinder", True, '{ cylinder = "8 mm" }')
    assert_allclose(bore.centre, [0.05, 0.01, 0.007], atol=1e-7)
    offered = surfaces(link)
    boss = ChosenFace(cylinder="16 mm", near=(0.058, 0.01, 0.01))
    assert chosen_surface(link, "here", boss, np.array(boss.near), offered).kind == "journal"


def test_the_distance_to_a_face_is_that_to_its_nearest_place() -> None:
    link = made(turned([(0.0, 0.002, 0.0, 0.02)]))  # a disc, 2 mm thick, elements of many times that
    top, bottom = (next(x for x in surfaces(link) if x.form == "plane" and x.direction[2] * z > 0.9) for z in (1, -1))
    for r, a in ((0.0, 0.0), (0.003, 1.0), (0.013, 2.0), (0.019, 4.0)):
        point = np.array([r * math.cos(a), r * math.sin(a), 0.0025])
        assert_allclose([distance(link, x, point) for x in (top, bottom)], [0.0005, 0.0025], rtol=1e-9)
    # beside it: Pythagoras over the rim, whose chords are within 3 % of the circle
    beside = distance(link, top, np.array([0.05, 0, 0.042]))
    assert_allclose(beside, math.hypot(0.03, 0.04), rtol=2e-2)


def refusal(link: Link, **choice: Any) -> str:
    chosen = ChosenFace(**choice)
    near = np.array(chosen.near or (0.0, 0.0, 0.0))
    with pytest.raises(MeshError) as caught:
        chosen_surface(link, "joints.A.faces.part", chosen, near, surfaces(link))
    return str(caught.value)


def test_what_is_ambiguous_is_refused_with_those_that_are_meant_nearest_first() -> None:
    link = made(turned([(0.0, 0.01, 0.005, 0.01), (0.01, 0.02, 0.005, 0.015)]))
    text = refusal(link, plane="z")
    assert text.startswith("joints.A.faces.part: must mean one face of link 'part', got 3 such faces; nearest first: ")
    away = [float(x) for x in re.findall(r"([\d.]+) mm away", text)]
    assert len(away) == 3
    assert away == sorted(away)
    assert_allclose(away[0], 5.0, rtol=0.03)  # the ring at z = 0, from its axis; within 3 % by chords
    assert "plane = [0, 0, -1], near = [" in text
    between = refusal(link, plane="z", near=(0.0075, 0.0, 0.005))  # 5 and 5.6 mm from two
    assert "got 3 such faces" in between
    assert chosen_surface(link, "x", ChosenFace(plane="z", near=(0.0075, 0, 0.019)), np.array([0.0075, 0, 0.019]),
                          surfaces(link)).centre[2] == pytest.approx(0.02)  # fmt: skip


def test_what_is_missing_is_refused_with_what_there_is_of_that_form() -> None:
    link = made(turned(SLEEVE))
    text = refusal(link, cylinder="12 mm", near=(0.0, 0.0, 0.02))
    assert 'got { cylinder = "12 mm", near = [0, 0, 0.02] }, of which it has none; nearest first: bore' in text
    found = re.findall(r'(bore|journal) \{ cylinder = "([\d.]+) mm"', text)
    assert found == [("bore", "8"), ("bore", "10"), ("journal", "20"), ("journal", "30")]
    assert "axis" in refusal(link, cylinder="8 mm", axis="x")
    assert "plane = [" in refusal(link, sphere="8 mm")  # no ball: whatever there is


@pytest.mark.parametrize(
    ("faces", "message"),
    [
        ({"near": [0, 0]}, r"joints.A.faces.part: must say what the face is by one of plane, cylinder, sphere, got none"),
        ({"plane": "z", "cylinder": 1}, r"joints.A.faces.part: must say .* got plane and cylinder"),
        ({"plane": "z", "axis": "z"}, r"joints.A.faces.part.axis: must be combined with cylinder, got it alone"),
        ({"cylinder": "-8 mm"}, r"joints.A.faces.part.cylinder: must be positive \[m\], got '-8 mm'"),
        ([{"cylinder": 1, "close": "B"}], r"joints.A.faces.part\[0\].close: unknown key, known: plane, cyl"),
        ({"sphere": 1, "near": "C"}, r"joints.A.faces.part.near: must name a point, got 'C'"),
        ([], r"joints.A.faces.part: must be a face's name, a table that says what it is, or a list of these, got \[\]"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_choice_is_refused(tmp_path: Path, faces: Any, message: str) -> None:
    from kedfem.errors import SceneError

    with pytest.raises(SceneError, match=message):
        scene_with(tmp_path, faces)


def test_a_choice_goes_with_its_link_when_joints_are_closed(tmp_path: Path) -> None:
    scene = scene_with(tmp_path, {"cylinder": "8 mm", "axis": "x", "near": [0.1, 0, 0]})
    turn = RigidDisplacement(np.zeros(3), np.array([0.0, 0.0, 0.001]), np.array([0.0, 0.0, math.pi / 2]))
    (face,) = closed_scene(scene, {"part": turn, "ground": STILL}).joints["A"].chosen_faces("part")
    assert_allclose(face.axis, [0, 1, 0], atol=1e-12)
    assert_allclose(face.near, [0, 0.1, 0.001], atol=1e-12)
    assert face.cylinder == 0.008


def test_diameters_and_directions_have_their_tolerance() -> None:
    link = made(turned(SLEEVE))
    (bore,) = [x for x in surfaces(link) if x.form == "cylinder" and abs(x.radius - 0.004) < 1e-5]
    assert matches(bore, ChosenFace(cylinder="8.03 mm"))
    assert not matches(bore, ChosenFace(cylinder="8.05 mm"))
    assert matches(bore, ChosenFace(cylinder="8 mm", axis=(0, 0.0015, -1)))
    assert not matches(bore, ChosenFace(cylinder="8 mm", axis=(0, 0.003, -1)))
