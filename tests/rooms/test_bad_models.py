"""Faults that only the meshed links reveal: coupling surfaces, probes, loads and bodies, each with its message."""

import re
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.errors import KedfemError, SceneError, SolveError
from kedfem.motion.linkage import linkage
from kedfem.results.recording import recording
from kedfem.scene import scene_from
from tests import scenes
from tests.scenes import bar, constant_speed

from .test_dynamics import four_bar


def arm(model: str = "solid") -> dict[str, Any]:
    """One bar, 0.5 m along x, hinged at its left end face."""
    elements = [4, 1, 1] if model == "solid" else 2
    link = bar(model=model, mesh={"elements": elements})
    return scenes.arm(link, constant_speed(10), analysis={"revolutions": 0.1})


def fault(raw: dict[str, Any]) -> str:
    scene = scene_from(raw)
    with pytest.raises(KedfemError) as found:
        recording(scene, elastic_model(scene, linkage(scene)))
    return str(found.value)


@pytest.mark.parametrize("model", ["solid", "beam"])
def test_joint_that_does_not_touch_its_link(model: str) -> None:
    raw = arm(model)
    raw["joints"]["A"]["at"] = [-0.1, 0]
    what = "a bore or a flat face of" if model == "solid" else "a node of"
    nearest = "(0, 0, -0.01), 0.1005 m" if model == "solid" else "(0, 0, 0), 0.1 m"  # hex20: none within the end
    first, *offered, advice = fault(raw).split("; ")
    assert first == (
        f"joints.A: must sit on {what} link 'arm' at (-0.1, 0, 0), got none there (nearest node {nearest} away)"
    )
    if model == "solid":  # no bore, so the nearest face of six
        assert offered == ["its nearest face is the plane face facing (-1, 0, 0) at (0, 0, 0), 0.1 m away"]
        assert advice.startswith("move the joint onto the link, or give the link a bore")
    else:
        assert offered == []
        assert advice == "move the joint onto the beam, or give the beam a point there"


def test_joint_beside_the_bore_of_a_plate() -> None:
    raw = four_bar("plate")
    raw["points"]["D"] = [0.9144, 0, 0]
    raw["joints"]["D"]["at"] = [0.9144, 0.004]
    raw["bodies"] = {}
    assert fault(raw).startswith("joints.D: must sit on a bore or a flat face of link 'rocker' at (0.9144, 0.004, 0)")


def test_hinge_across_a_flat_face() -> None:
    raw = arm()
    raw["joints"]["A"]["axis"] = "x"
    assert fault(raw) == (
        "joints.A: must sit on a bore of link 'arm', or on a flat face that contains its axis, "
        "got a flat face across the axis, which determines no second point of it: give the link a bore there, or "
        'weld the face to a link of model = "rigid" that has the joint'
    )


MATERIAL = ": take a point of its material, "


@pytest.mark.parametrize("quantity", ["stress", "displacement"])
@pytest.mark.parametrize("model", ["solid", "beam"])
def test_probe_outside_its_link(model: str, quantity: str) -> None:
    raw = arm(model)
    raw["output"] = {"probes": {"tip": {"link": "arm", "at": [0.5, 0.05], "quantity": quantity}}}
    at = "output.probes.tip.at: must lie in link 'arm', got (0.5, 0.05, 0), 0.04 m outside it"
    bore = ", or for a motion the centre of a bore with a joint" * (model == "solid")
    near = "(0.5, 0.01, 0) is the nearest" if model == "solid" else "its axis is nearest at (0.5, 0, 0)"
    assert fault(raw) == at + MATERIAL + near + bore


def test_force_outside_its_link() -> None:
    raw = arm()
    raw["loads"] = {"push": {"kind": "force", "link": "arm", "at": [0.6, 0], "vector": [0, 1]}}
    assert (
        fault(raw)
        == "loads.push.at: must lie in link 'arm', got (0.6, 0, 0), 0.1 m outside it"
        + MATERIAL
        + "(0.5, 0, 0) is the nearest"
    )


def test_force_beside_a_beams_axis() -> None:
    raw = arm("beam")
    raw["loads"] = {"push": {"kind": "force", "link": "arm", "at": [0.5, 0.01], "vector": [1, 0]}}
    assert fault(raw) == "loads.push.at: must lie on the axis of beam 'arm', got 0.01 m beside it"


def test_displacement_beside_a_beams_axis() -> None:
    raw = arm("beam")
    raw["output"] = {"probes": {"tip": {"link": "arm", "at": [0.5, 0.01], "quantity": "velocity"}}}
    assert re.match(r"output\.probes\.tip\.at: .*axis of planar beam 'arm'.*0\.01 m beside it", fault(raw))


def test_surface_force_on_no_face() -> None:
    raw = arm()
    raw["loads"] = {"push": {"kind": "surface", "link": "arm", "at": [0.25, 0], "vector": [0, 1]}}
    assert fault(raw).startswith("loads.push.at: must sit on a bore or a flat face of link 'arm' at (0.25, 0, 0)")


def test_body_on_no_coupling_surface() -> None:
    raw = arm()
    raw["bodies"] = {"lump": {"kind": "point_mass", "link": "arm", "at": [0.25, 0.5], "mass": 1}}
    outside = "bodies.lump.at: must lie in link 'arm', got (0.25, 0.5, 0), 0.49 m outside it"
    assert fault(raw) == outside + MATERIAL + "(0.25, 0.01, 0) is the nearest"


def body() -> dict[str, Any]:
    inertia = [1e-3, 1e-3, 1e-3, 0, 0, 0]
    return {"kind": "rigid_body", "link": "arm", "at": [0.5, 0], "mass": 1, "inertia": inertia, "centre": [0.5, 0]}


def test_full_inertia_on_a_flat_face() -> None:
    raw = arm()
    raw["bodies"] = {"tool": body()}
    assert fault(raw) == ("bodies.tool.at: a rigid body with full inertia must sit on a bore, got a flat face of 'arm'")


def test_body_beside_a_beams_node() -> None:
    raw = arm("beam")
    raw["bodies"] = {"tool": body() | {"centre": [0.5, 0.1]}}
    raw["links"]["arm"]["beam"] = "planar"
    place = r"^bodies\.tool\.centre: must be its point \(0\.5, 0, 0\) for the planar beam 'arm'"
    with pytest.raises(SceneError, match=place):
        scene_from(raw)


def test_matrix_that_is_not_positive_definite() -> None:
    with pytest.raises(SolveError, match=r"^links.arm: effective matrix must be positive definite, got a pivot ≤ 0"):
        Cholesky(sp.csr_array(np.diag([1.0, -1.0])), "links.arm")


@pytest.mark.parametrize("at", [[1, 0.5], [1, 1], [0.5, 0], [0.99, 0.3]])
def test_a_probe_on_any_leg_of_a_bent_beam(at: list[float]) -> None:
    raw = arm("beam")
    raw["links"]["arm"]["shape"] = {
        "kind": "polyline", "points": [[0, 0], [1, 0], [1, 1]], "width": 0.04, "thickness": 0.02,
    }  # fmt: skip
    raw["output"] = {"probes": {"p": {"link": "arm", "at": at, "quantity": "stress"}}}
    scene = scene_from(raw)
    assert recording(scene, elastic_model(scene, linkage(scene)))[0].channel.name == "probes/p/stress"
