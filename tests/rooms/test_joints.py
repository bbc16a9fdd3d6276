"""Joints between elastic links: what they hold, what they release, whatever the direction of the scene."""

import gc
import tracemalloc
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.results.recording import recording, rows
from kedfem.scene import scene_from

from .test_dynamics import four_bar, run, slider_crank


def histories(raw: dict[str, Any]) -> dict[str, np.ndarray]:
    """All channels of a scene over time."""
    scene = scene_from(raw)
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    recorded = recording(scene, model)
    taken = [rows(recorded, s) for s in transient(scene, joined, along, model, steps_of(scene, model))]
    return {name: np.concatenate([row[name] for row in taken]) for name in taken[0]}


def arm(kind: str, pieces: int) -> dict[str, Any]:
    """A 0.6 m arm that swings up and down, of one bar or of bars welded end to end; the middle is always a node."""
    x = np.linspace(0, 0.6, pieces + 1)
    names = [f"piece{k}" for k in range(pieces)]
    elements: Any = 12 // pieces if kind == "beam" else [12 // pieces, 2, 1]
    links = {
        name: {
            "model": kind,
            "material": "steel",
            "shape": {"kind": "bar", "between": [[a, 0], [b, 0]], "width": 0.03, "thickness": 0.02},
            "mesh": {"elements": elements},
        }
        for name, a, b in zip(names, x, x[1:], strict=False)
    }
    welds = {
        f"weld{k}": {"kind": "weld", "links": [names[k], names[k + 1]], "at": [x[k + 1], 0]} for k in range(pieces - 1)
    }
    return {
        "links": links,
        "joints": {"A": {"kind": "revolute", "links": ["ground", names[0]], "at": [0, 0]}, **welds},
        "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": 1, "rise": 0.05}},
        "damping": {"beta": 1e-4},
        "analysis": {"end_time": 0.08, "step": 2e-4},
        "output": {"probes": {"tip": {"link": names[-1], "at": [0.6, 0], "quantity": "displacement"}}},
    }


@pytest.mark.parametrize(("kind", "tolerance"), [("beam", 1e-9), ("solid", 4e-3)])
def test_welded_pieces_are_one_piece(kind: str, tolerance: float) -> None:
    one, two = histories(arm(kind, 1)), histories(arm(kind, 2))
    tip = one["probes/tip/displacement"]
    # beams share nodes: the same system; solids share the faces' mean and gradient, so the cut is a little softer
    assert_allclose(two["probes/tip/displacement"], tip, rtol=0, atol=tolerance * np.abs(tip).max())
    torque = one["drive/torque"]
    assert_allclose(two["drive/torque"], torque, rtol=0, atol=2 * tolerance * np.abs(torque).max())


def solid_slider_crank(piston: dict[str, Any]) -> dict[str, Any]:
    raw = slider_crank("rigid")
    plate = {"kind": "plate_link", "width": 0.02, "thickness": 0.02, "eye_diameter": 0.04, "bore_diameter": 0.02}
    for name, ends in (("crank", ["A", "B"]), ("rod", ["B", "C"])):
        raw["links"][name] = {
            "material": "steel", "shape": {**plate, "between": ends}, "mesh": {"elements_across": 1},
        }  # fmt: skip
    raw["links"]["piston"] = piston
    raw["analysis"]["steps_per_revolution"] = 120
    return raw


def test_a_solid_slider_is_a_rigid_one_but_for_its_softness() -> None:
    block = {"kind": "extrusion", "thickness": 0.04, "outline": [], "holes": []}
    c = float(np.sqrt(0.3**2 - 0.08**2))
    block["outline"] = [[c - 0.03, -0.03], [c + 0.03, -0.03], [c + 0.03, 0.03], [c - 0.03, 0.03]]
    block["holes"] = [{"at": [c, 0], "diameter": 0.02}]
    solid = solid_slider_crank({"material": "steel", "shape": block})
    solid["joints"]["guide"]["at"] = [c, 0.03]
    mass = 7850 * (0.06 * 0.06 - np.pi * 0.01**2) * 0.04  # steel as built in
    density = scene_from(solid).materials["steel"].density
    rigid = solid_slider_crank({"model": "rigid", "mass": mass * density / 7850})
    a, b = histories(solid), histories(rigid)
    for name in ("drive/torque", "joints/C/force"):
        peak = np.abs(b[name]).max()
        # 5 %: the block bends and is guided on one side; its mass of 1 kg decides the forces
        assert_allclose(a[name][10:], b[name][10:], rtol=0, atol=0.05 * peak)
    assert np.abs(a["joints/guide/force"][:, 0]).max() < 1e-9 * np.abs(a["joints/guide/force"]).max()


@pytest.mark.parametrize("force", [(900, 0, 0), (0, 900, 0), (0, 0, 900), (300, -500, 700)])
def test_what_bears_a_slider_crank_balances_the_load_on_its_slider(force: tuple[float, float, float]) -> None:
    """Forces and moments of bearing and guide; crank beside the rod, load off the pin: six balances."""
    raw = solid_slider_crank({"model": "rigid", "mass": 1.0})
    raw["links"]["crank"]["shape"] = raw["links"]["crank"]["shape"] | {"offset": 0.03}
    c = float(np.sqrt(0.3**2 - 0.08**2))
    raw["gravity"] = [0, 0, 0]
    raw["joints"]["guide"]["at"] = [c - 0.05, 0.02, 0.01]
    at = [c + 0.04, -0.03, 0.06]
    raw["loads"] = {"push": {"kind": "force", "link": "piston", "at": at, "vector": list(force)}}
    raw["analysis"] = {"kind": "static", "steps_per_revolution": 8, "revolutions": 0.5}
    found = histories(raw)
    phi = np.pi / 2 + np.linspace(0, np.pi, len(found["joints/A/force"]))
    y = 0.08 * np.sin(phi)
    moved = np.outer(0.08 * np.cos(phi) + np.sqrt(0.3**2 - y**2) - c, [1, 0, 0])
    A, guide = (
        (found["joints/A/force"], found["joints/A/moment"]),
        (found["joints/guide/force"], found["joints/guide/moment"]),
    )
    assert_allclose(A[0] + guide[0] + force, 0 * moved, atol=1e-6 * 900)
    arms = moved + raw["joints"]["guide"]["at"]
    balance = A[1] + guide[1] + np.cross(arms, guide[0]) + np.cross(moved + at, force)
    assert_allclose(balance, 0 * moved, atol=1e-4 * 900 * 0.3)
    assert np.abs(guide[1]).max() > 10


@pytest.mark.parametrize("kind", ["beam", "bar"])
def test_turning_the_whole_scene_turns_the_answer(kind: str) -> None:
    raw, turned = four_bar(kind, revolutions=0.2), four_bar(kind, revolutions=0.2)
    angle = 0.7
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turned["points"] |= {
        "D": [0.9144 * c, 0.9144 * s],
        "B": {"from": "A", "distance": 0.3048, "angle": np.pi / 3 + angle},
    }
    for each, gravity in ((raw, [0.0, -9.81, 0.0]), (turned, (R @ [0, -9.81, 0]).tolist())):
        each["gravity"] = gravity
        each["output"] = {"probes": {"c": {"link": "rocker", "at": "C", "quantity": "displacement"}}}
    a, b = histories(raw), histories(turned)
    for name in ("joints/B/force", "joints/D/force"):
        assert_allclose(b[name], a[name] @ R.T, rtol=0, atol=1e-6 * np.abs(a[name]).max())
    # probes read link axes, which turn along
    probe = "probes/c/displacement"
    assert_allclose(b[probe], a[probe], rtol=0, atol=1e-7 * np.abs(a[probe]).max())


def test_a_ball_leaves_turning_free_and_holds_the_point() -> None:
    raw = four_bar("bar", revolutions=0.1)
    raw["joints"]["C"]["kind"] = "spherical"
    model, _, snapshots = run(raw)
    coupler, rocker = model.joints[1], model.joints[2]
    assert [coupler.joints.count(name) for name in "BC"] == [2, 1]
    end = snapshots[-1]
    a = coupler.weights[-1] @ end.states[1].u[coupler.nodes]
    b = rocker.weights[0] @ end.states[2].u[rocker.nodes]
    assert_allclose(a, b, rtol=0, atol=1e-12 * np.abs(a).max())


def test_memory_does_not_grow_with_the_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kedfem.dynamics.rigid_body.POINTS", 256)
    raw = four_bar("beam", steps_per_revolution=2000)
    scene = scene_from(raw)
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    steps = transient(scene, joined, along, model, steps_of(scene, model))
    tracemalloc.start()
    held = []
    for block in steps:
        if block.step in (513, 1793):
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert held[1] < held[0] + 100_000  # one step's states are 10 kB, so 1200 of them would show


@pytest.mark.parametrize("element", ["beam2", "beam3", "beam4"])
@pytest.mark.parametrize("beam", ["planar", "spatial"])
def test_a_bar_along_a_slot_has_nodes_for_its_stations(element: str, beam: str) -> None:
    """Four at least, where one element a segment would have two or three."""
    shape = {"kind": "bar", "between": [[0, 0], [0.6, 0]], "width": 0.02, "thickness": 0.02}
    scene = scene_from(
        {
            "links": {
                "arm": {"model": "beam", "beam": beam, "element": element, "material": "steel", "shape": shape},
                "pin": {"model": "rigid", "mass": 0.2},
            },
            "joints": {
                "A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]},
                "S": {"kind": "slot", "links": ["pin", "arm"], "at": [0.3, 0], "axis": "x"},
                "G": {"kind": "prismatic", "links": ["pin", "ground"], "at": [0.3, 0], "axis": "y"},
            },
            "drive": {"joint": "A", "motion": {"kind": "harmonic", "frequency": 2.0, "angle": 0.05}},
            "analysis": {"end_time": 0.02, "step": 0.002, "accuracy": "quick"},
        }
    )
    assert meshed(scene).model.links[0].X.shape[0] >= 4
