"""Which surface a joint, body or load finds on a link."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.model import elastic_model
from kedfem.errors import KedfemError
from kedfem.links.build import bare_link, bare_links
from kedfem.links.seats import face_seat, joint_seat, surface_weights
from kedfem.motion.linkage import linkage
from kedfem.scene import scene_from

from .test_dynamics import slider_crank


def link_of(shape: dict[str, Any], **mesh: Any) -> Any:
    """A single driven link of a shape, meshed."""
    raw = {
        "links": {"part": {"material": "steel", "shape": shape, "mesh": mesh}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "part"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"turns": 1},
    }
    return bare_links(scene_from(raw))["part"]


PLATE = {
    "kind": "plate_link",
    "between": [[0, 0], [0.2, 0]],
    "width": 0.03,
    "thickness": 0.02,
    "bore_diameter": 0.01,
}


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_a_bore_is_found_whole_with_or_without_an_axis(layers: int) -> None:
    link = link_of(PLATE, elements_across=1, layers=layers)
    with_axis = joint_seat(link, "joints.A", np.zeros(3), np.array([0.0, 0, 1]))
    without = joint_seat(link, "joints.A", np.zeros(3), None)
    assert set(without.facets) == set(with_axis.facets)
    assert_allclose(
        with_axis.origin, 0, atol=1e-7
    )  # the middle of the bore; a quadratic circle is off by 1e-5
    assert_allclose(with_axis.spread.max(), 0.02 / np.sqrt(12), rtol=1e-6)  # uniform over its length


def test_a_bore_far_along_its_axis_is_not_the_joints() -> None:
    link = link_of(PLATE | {"offset": 0.5}, elements_across=1)
    with pytest.raises(
        KedfemError, match=r"^joints.A: must sit on a bore or a flat face of link 'part' at \(0, 0, 0\)"
    ):
        joint_seat(link, "joints.A", np.zeros(3), np.array([0.0, 0, 1]))


def test_a_flat_seat_is_one_face_not_all_in_its_plane() -> None:
    """A U with two feet in one plane: the joint's foot alone carries it."""
    u = [[0, 0], [0.02, 0], [0.02, 0.08], [0.08, 0.08], [0.08, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]
    link = link_of({"kind": "extrusion", "thickness": 0.02, "outline": u}, size=0.02)
    seat = face_seat(link, "loads.push.at", np.array([0.01, 0, 0]))
    assert_allclose(seat.origin, [0.01, 0, 0], atol=1e-9)


def test_the_middle_of_a_block_is_no_ball_seat() -> None:
    block = [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]
    link = link_of({"kind": "extrusion", "thickness": 0.1, "outline": block}, size=0.1)
    with pytest.raises(KedfemError, match="must sit on"):
        joint_seat(link, "joints.A", np.array([0.05, 0.05, 0]), None)


def test_a_body_is_carried_by_its_own_links_hinge() -> None:
    """A guide at the same point, declared first and of another link, does not lend the body its axis."""
    raw = slider_crank("rigid")
    plate = {"kind": "plate_link", "width": 0.02, "thickness": 0.02, "bore_diameter": 0.01}
    for name, ends in (("crank", ["A", "B"]), ("rod", ["B", "C"])):
        raw["links"][name] = {
            "material": "steel",
            "shape": {**plate, "between": ends},
            "mesh": {"elements_across": 1},
        }
    raw["joints"] = {"guide": raw["joints"].pop("guide"), **raw["joints"]}
    raw["bodies"] = {"lump": {"kind": "point_mass", "link": "rod", "at": "C", "mass": 0.5}}
    scene = scene_from(raw)
    model = elastic_model(scene, linkage(scene))
    assert {link.name for link in model.links} == {"crank", "rod"}


@pytest.mark.parametrize("fidelity", ["solid", "plane"])
def test_a_node_of_a_domed_face_stands_for_the_whole_face(fidelity: str) -> None:
    """Where facets of a curved face meet, each lies in its own corners' plane; none of them is a flat face."""
    dome = {"via": [0.105, 0.03], "to": [0.1, 0.06]}
    shape = {"kind": "extrusion", "thickness": 0.02, "outline": [[0, 0], [0.1, 0], dome, [0, 0.06]]}
    raw = {
        "links": {
            "part": {"fidelity": fidelity, "material": "steel", "shape": shape, "mesh": {"size": 0.01}}
        },
        "joints": {"A": {"kind": "revolute", "links": ["ground", "part"], "at": [0, 0.03]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"turns": 1},
    }
    link = bare_links(scene_from(raw))["part"]
    top = np.array([0.105, 0.03, 0.0])
    assert np.linalg.norm(link.X - top, axis=1).min() < 1e-9
    area = surface_weights(link, face_seat(link, "loads.push.at", top)).sum()
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
        "analysis": {"turns": 1},
    }  # fmt: skip
    link = bare_link(scene_from(raw), "bar")
    for point in (np.zeros(3), end):
        seat = joint_seat(link, "joints.A", point, np.array([0.0, 0.0, 1.0]))
        assert seat.facets is not None
        assert len(seat.facets) == across
