"""Constructions wherever a point stands, axes by two points, bars in any direction, bodies anywhere on a link."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.errors import SceneError
from kedfem.links.build import bare_link
from kedfem.links.record import Link
from kedfem.scene import Joint, Scene, scene_from
from tests.runs import ran

DOCS = Path(__file__).parents[2] / "docs"
SIZE = {"width": 0.02, "thickness": 0.01}
A, B, C, M = [0.0, 0.0, 0.0], [0.3, 0.1, 0.0], [0.6, 0.0, 0.0], [0.15, 0.05, 0.0]
MADE = {  # the same points by constructions
    "A": {"between": ["C", "O"], "fraction": 1.0},
    "B": {"from": "A", "distance": float(np.hypot(0.3, 0.1)), "angle": float(np.arctan2(0.1, 0.3))},
    "C": {"between": ["A", {"between": ["A", [2.4, 0.0]], "fraction": 0.5}]},
    "M": {"between": ["A", "B"]},
}


def everywhere(points: dict[str, Any]) -> dict[str, Any]:
    """A scene with a point at every key that takes one."""
    a, b, c, m = (points[name] for name in "ABCM")
    beam = {"model": "beam", "material": "steel"}
    return {
        "points": {"O": A, "A": A, "B": B, "C": C},
        "links": {
            "one": {**beam, "shape": {"kind": "bar", "between": [a, b], **SIZE}},
            "two": {**beam, "shape": {"kind": "polyline", "points": [b, c], **SIZE, "up": {"from": a, "to": [0, 0, 1]}}},
            "plate": {"material": "steel", "shape": {
                "kind": "extrusion", "outline": [[0.5, -0.1], [0.7, -0.1], {"via": [0.75, 0], "to": [0.7, 0.1]},
                            [0.5, 0.1]],
                "thickness": 0.01, "holes": [{"at": c, "diameter": 0.02}]}},
            "file": {"material": "steel", "shape": {"kind": "mesh", "file": __file__, "origin": a, "towards": b}},
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "one"], "at": a, "axis": {"from": a, "to": [0, 0, 2]}},
            "B": {"kind": "spherical", "links": ["one", "two"], "at": {"one": b, "two": b}},
            "C": {"kind": "revolute", "links": ["two", "plate"], "at": c},
            "F": {"kind": "weld", "links": ["two", "file"], "at": b},
        },
        "springs": {"s": {"kind": "spring", "stiffness": 5,
                          "between": [{"link": "one", "at": m}, {"link": "ground", "at": c}]}},
        "loads": {"f": {"kind": "force", "link": "one", "at": m, "vector": [0, 1]}},
        "bodies": {
            "p": {"kind": "point_mass", "link": "one", "at": m, "mass": 1},
            "r": {"kind": "rigid_body", "link": "two", "at": b, "centre": m, "mass": 1, "inertia": [1, 1, 1, 0, 0, 0]},
        },
        "analysis": {"end_time": 1, "step": 0.1, "initial_motions": {"one": {"at": a, "velocity": [0, 0]}}},
        "output": {"probes": {"d": {"link": "one", "at": m, "quantity": "deflection", "chord": [a, b]}}},
    }  # fmt: skip


def floats(scene: Scene) -> list[float]:
    return [float(x) for x in re.findall(r"-?\d+\.\d+(?:e-?\d+)?", scene.model_dump_json())]


def test_a_construction_may_stand_wherever_a_point_does() -> None:
    plain, made = scene_from(everywhere({"A": A, "B": B, "C": C, "M": M})), scene_from(everywhere(MADE))
    assert_allclose(floats(made), floats(plain), atol=1e-12)
    assert made.joints["A"].axis == (0.0, 0.0, 1.0)
    ends = {"from": [0, 0], "to": [3, 0]}, {"from": [1, 1], "to": [1, 5]}
    cross = Joint(kind="universal", links=("a", "b"), at=(0, 0), axes=ends)
    assert cross.axes == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))


FAULTS = [
    ("joints/A/at", {"between": ["A"]}, "joints.A.at.between: ", "2"),
    ("joints/A/at", {"between": ["A", "X"]}, "joints.A.at.between[1]: ", "'X'"),
    ("loads/f/at", {"betwen": ["A", "B"]}, "loads.f.at.betwen: ", "'between'"),
    ("joints/A/at", {"from": "A", "distance": "3 kg", "angle": 0}, "joints.A.at.distance: ", "[m]"),
    ("joints/A/at", {"between": ["joints.A", "B"]}, "joints.A.at: ", "constructed"),
    ("joints/A/at", {"from": ["A", "B"], "distances": [0.01, 0.01]}, "joints.A.at: ", "must meet [m]"),
    ("joints/A/axis", {"from": "A"}, "joints.A.axis.to: ", "required"),
    ("joints/A/axis", {"from": "A", "to": "A"}, "joints.A.axis: ", "direction"),
    ("joints/A/axis", {"from": "A", "to": "B", "x": 1}, "joints.A.axis.x: ", "known: from, to"),
    ("joints/A/axis", "P", "joints.A.axis: ", "{ from = point, to = point }"),
    ("joints/B/axes", [{"from": "A", "to": "Q"}, "z"], "joints.B.axes[0].to: ", "'Q'"),
    ("links/one/shape/up", {"from": "A", "to": "B"}, "links.one.shape.up: ", "along the line"),
    ("links/one/shape/between", ["A", {"between": ["A", 5]}], "links.one.shape.between[1].between[1]: ", "construction"),
    ("loads/f/at", {"from": "C", "distance": 0.1, "angle": 0, "bla": 2}, "loads.f.at.bla: ", "known: from"),
    ("bodies/p/at", {"between": ["A", {"from": "A", "distance": 1e200, "angle": 0}]},
     "bodies.p.at.between[1].distance: ", "at most 1e+30"),
    ("springs/s/between/0/at", {"between": "AB"}, "springs.s.between[0].at.between: ", "list"),
    ("output/probes/d/at", {"between": ["A", "A"], "offset": 1}, "output.probes.d.at: ", "offset"),
    ("output/probes/d/chord", ["A", {"from": "A"}], "output.probes.d.chord[1].distance: ", "required [m]"),
]  # fmt: skip


@pytest.mark.parametrize(("path", "value", "place", "phrase"), FAULTS)
def test_a_wrong_construction_is_told_where_it_stands(path: str, value: Any, place: str, phrase: str) -> None:
    raw = everywhere(dict(zip("ABCM", "ABCO", strict=True)))
    table: Any = raw
    *above, last = path.split("/")
    for key in above:
        table = table[int(key) if key.isdigit() else key]
    table[last] = value
    with pytest.raises(SceneError) as refused:
        scene_from(raw)
    lines = [str(fault) for fault in refused.value.faults]
    assert any(line.startswith(place) and phrase in line for line in lines), lines


def record(P: Any, Q: Any, up: Any, **keys: Any) -> Link:
    shape = {"kind": "bar", "between": [list(P), list(Q)], **SIZE} | ({} if up is None else {"up": up})
    scene = scene_from({
        "links": {"bar": {"material": "steel", "shape": shape, **keys}}, "analysis": {"end_time": 1, "step": 0.1},
    })  # fmt: skip
    return bare_link(scene, "bar")


KINDS = [{"element": "hex20", "mesh": {"elements": [3, 1, 1]}}, {"model": "beam", "beam": "spatial"}]
TURNS = {
    "x": Rotation.identity(), "y": Rotation.from_euler("z", 90, degrees=True),
    "z": Rotation.from_euler("y", -90, degrees=True), "oblique": Rotation.from_rotvec([0.3, -1.1, 0.7]),
}  # fmt: skip


@pytest.mark.parametrize("keys", KINDS, ids=["solid", "beam"])
@pytest.mark.parametrize("turn", TURNS)
def test_a_bar_in_any_direction_is_the_same_bar_turned(keys: dict[str, Any], turn: str) -> None:
    R, first = TURNS[turn].as_matrix(), record([0.1, 0.2, 0.3], [0.5, 0.2, 0.3], "z", **keys)
    turned = record(R @ [0.1, 0.2, 0.3], R @ [0.5, 0.2, 0.3], list(R[:, 2]), **keys)
    assert_allclose(turned.X, first.X @ R.T, atol=1e-12)
    assert_allclose(turned.axes, R @ first.axes, atol=1e-12)
    K, T = np.asarray(first.K0.todense()), np.kron(np.eye(first.n), R)
    assert_allclose(turned.K0.todense(), T @ K @ T.T, atol=1e-9 * np.abs(K).max())


@pytest.mark.parametrize("keys", KINDS, ids=["solid", "beam"])
def test_an_upright_bar_has_its_thickness_along_x(keys: dict[str, Any]) -> None:
    given, usual = (record([0, 0, 0], [0, 0, 0.4], up, **keys) for up in ("x", None))
    assert_allclose(given.K0.todense(), usual.K0.todense(), rtol=0, atol=1e-6)
    if keys.get("element"):
        assert_allclose(np.ptp(usual.X, axis=0), [SIZE["thickness"], SIZE["width"], 0.4], atol=1e-12)
    other = record([0, 0, 0], [0, 0, 0.4], "y", **keys)
    assert np.abs(other.K0.todense() - usual.K0.todense()).max() > 1.0


def arm(body: dict[str, Any] | None, **keys: Any) -> dict[str, Any]:
    """An arm of 0.4 m on a hinge at the origin, level, that hardly turns, under gravity."""
    return {
        "gravity": [0, -10.0], "points": {"O": [0, 0], "P": [0.4, 0]},
        "links": {"arm": {"model": "beam", "material": "steel", **keys,
                          "shape": {"kind": "bar", "between": ["O", "P"], **SIZE}}},
        "joints": {"O": {"kind": "revolute", "links": ["ground", "arm"], "at": "O"}},
        "drive": {"joint": "O", "motion": {"kind": "constant_speed", "speed": 1e-6}},
        "bodies": {} if body is None else {"b": {"link": "arm", "at": [0.13, 0], **body}},
        "analysis": {"end_time": 2e-3, "step": 1e-3, "initial": "quasi-static"},
    }  # fmt: skip


POINT = {"kind": "point_mass", "mass": 3.0}
HEAVY = {"kind": "rigid_body", "mass": 3.0, "centre": [0.2, 0.05], "inertia": [0.01, 0.01, 0.01, 0, 0, 0]}
WEIGHT = 7850 * 0.4 * 0.02 * 0.01 * 10.0  # of the arm [N]


@pytest.mark.parametrize("body", [POINT, HEAVY], ids=["point mass", "rigid body"])
@pytest.mark.parametrize("keys", [{}, {"beam": "spatial"}, {"element": "beam5", "mesh": {"elements": 2}}], ids=str)
def test_a_body_anywhere_along_a_beam_weighs_where_it_is(body: dict[str, Any], keys: dict[str, Any]) -> None:
    torque = ran(arm(body, **keys)).channel("drive/torque")[0, 0]
    x = body.get("centre", [0.13])[0]
    assert torque == pytest.approx(WEIGHT * 0.2 + 30.0 * x, rel=1e-4)


def test_a_planar_beam_whose_body_is_off_its_point_moves_in_space() -> None:
    assert meshed(scene_from(arm(POINT))).model.links[0].kind == "beam"
    assert meshed(scene_from(arm(HEAVY))).model.links[0].kind == "spatial_beam"
    with pytest.raises(SceneError, match=r"bodies\.b\.centre: must be its point .* for the planar beam 'arm'"):
        scene_from(arm(HEAVY, beam="planar"))


def test_a_body_on_a_beam_is_where_a_corner_would_be() -> None:
    bar = meshed(scene_from(arm(POINT))).model.links[0]
    raw = arm(POINT)
    raw["links"]["arm"]["shape"] = {"kind": "polyline", "points": ["O", [0.13, 0], "P"], **SIZE}
    line = meshed(scene_from(raw)).model.links[0]
    assert_allclose(bar.X, line.X, atol=1e-15)
    for one, other in zip(bar.mass, line.mass, strict=True):
        assert_allclose(one.todense(), other.todense(), atol=1e-15)


@pytest.mark.parametrize("model", ["solid", "rigid"])
@pytest.mark.parametrize("body", [POINT, HEAVY], ids=["point mass", "rigid body"])
def test_a_body_anywhere_on_a_solid_has_its_mass_and_inertia(model: str, body: dict[str, Any]) -> None:
    if (model, body) == ("solid", HEAVY):
        return  # must sit on a bore
    keys = {"model": model, "mesh": {"elements": [2, 1, 1]}}
    raw = arm({**body, "at": [0.13, 0.003, 0.002]}, **keys)
    raw["joints"]["O"]["kind"] = "spherical"
    del raw["drive"]
    raw["analysis"].pop("initial")
    plain = {**raw, "bodies": {}}
    one, other = (meshed(scene_from(each)).model.links[0] for each in (raw, plain))
    centre, mass = np.array(body.get("centre", [0.13, 0.003, 0.002])), 3.0
    centre = np.append(centre, np.zeros(3 - len(centre)))
    moments = [np.asarray(x.X.T @ (x.mass[0] @ x.X)) for x in (one, other)]  # ∫ ρ x xᵀ
    added = mass * np.outer(centre, centre)
    if "inertia" in body:
        added += np.diag([0.005] * 3)  # ½ tr(I) 1 − I
    assert_allclose(moments[0] - moments[1], added, atol=1e-9)
    assert_allclose((one.one @ one.mX) - (other.one @ other.mX), mass * centre, atol=1e-9)


def test_the_example_of_the_docs_runs() -> None:
    text = (DOCS / "mechanisms.md").read_text(encoding="utf-8")
    text = text.split("## Points and axes by construction")[1]
    raw = tomllib.loads(re.findall(r"```toml\n(.*?)```", text, flags=re.DOTALL)[0])
    raw["analysis"]["end_time"] = 0.05
    done = ran(raw)
    weight = 9.81 * (sum(float(x.one @ x.m1[:, 0]) for x in done.ready.model.links))
    force = done.channel("joints/swivel/force")
    assert_allclose(force.mean(axis=0)[2], weight, rtol=0.2)  # it swings on its springy jib
