"""Starts and positions of mechanisms whose drive moves a road alone: bodies on springs find their own place."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import motion_of
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import Motion
from kedfem.dynamics.system.starts.deflected import static
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.starts.internal_forces import own, rows
from kedfem.dynamics.system.starts.modified_newton import NoBalanceError
from kedfem.dynamics.system.steps import Steps
from kedfem.scene import scene_from
from tests.moving import channels, ran

Raw = dict[str, Any]
ASKEW = Rotation.from_rotvec([0.5, -0.8, 0.3]).as_matrix()
POINTS = {
    "L": [0, 0.35, 0.25], "LB": [0, 0.72, 0.23], "U": [0, 0.42, 0.5], "UB": [0, 0.69, 0.52], "W": [0, 0.78, 0.31],
    "P": [0, 0.78, 0], "T": [0, 0.46, 0.72], "S": [0, 0.535, 0.24], "B": [0, 0.3, 0.55],
}  # fmt: skip


def corner(R: np.ndarray, strut: float = 6300.0, damping: float = 3e3, **analysis: Any) -> Raw:
    """One corner of a car with a double wishbone: a body on a slide, two arms of beams, an upright, a road that moves.

    Parameters
    ----------
    R : how the whole is turned
    strut : its preload [N]
    """
    x, z = R[:, 0].tolist(), R[:, 2].tolist()
    rubber = {"stiffness": ["16 kN/mm"] * 3, "damping": "2 kN*s/m"}

    def arm(a: str, b: str) -> Raw:
        section = {"kind": "tube", "diameter": 0.038, "wall": 0.004}
        shape = {"kind": "polyline", "points": [a, "S", b] if a == "L" else [a, b], "section": section}
        return {"model": "beam", "material": "steel", "shape": shape, "mesh": {"elements": 1}}

    def hinge(a: str, b: str, at: str, **more: Any) -> Raw:
        return {"kind": "revolute", "links": [a, b], "at": at, "axis": x, **more}

    def body(mass: float, at: str) -> Raw:
        return {"model": "rigid", "mass": mass, "centre": at, "inertia": [mass / 20] * 3 + [0] * 3}

    return {
        "gravity": (-9.81 * R[:, 2]).tolist(),
        "points": {name: (R @ at).tolist() for name, at in POINTS.items()},
        "links": {
            "body": body(350, "B"), "upright": body(35, "W"), "road": {"model": "rigid"},
            "lower": arm("L", "LB"), "upper": arm("U", "UB"),
        },
        "joints": {
            "heave": {"kind": "prismatic", "links": ["body", "ground"], "at": "B", "axis": z},
            "bump": {"kind": "prismatic", "links": ["road", "ground"], "at": "P", "axis": z},
            "lower_inner": hinge("lower", "body", "L", bushing=rubber),
            "upper_inner": hinge("upper", "body", "U", bushing=rubber),
            "lower_ball": hinge("lower", "upright", "LB"),
            "upper_ball": {"kind": "spherical", "links": ["upper", "upright"], "at": "UB"},
        },
        "springs": {
            "strut": {
                "kind": "spring", "between": [{"link": "lower", "at": "S"}, {"link": "body", "at": "T"}],
                "stiffness": 45e3, "damping": damping, "preload": -strut,
            },
            "tyre": {
                "kind": "spring", "between": [{"link": "road", "at": "P"}, {"link": "upright", "at": "W"}],
                "stiffness": 2e5, "damping": damping, "preload": -3823.0,
            },
        },
        "drive": {
            "joint": "bump",
            "motion": {"kind": "cycloidal", "travel": 0.05, "rise": 1e5, "return_time": 1e5, "dwell_after": 1.0},
        },
        "analysis": {
            "end_time": 1.0, "step": 2e-3, "accuracy": "quick", "frames": "co-rotational", **analysis,
        },
    }  # fmt: skip


def made(raw: Raw) -> tuple[Steps, Motion]:
    scene = scene_from(raw)
    ready = meshed(scene)
    solver = steps_of(scene, ready.model)
    assert solver.corotational
    return solver, motion_of(scene, ready.linkage, ready.path)


def travel(solver: Steps, u: np.ndarray, name: str) -> np.ndarray:
    """Displacement of a body's centre of mass."""
    for k, link in enumerate(solver.ready.system.model.links):
        if link.name == name:
            moved = rows(solver.ready, k, u[own(solver.ready, k)])
            return np.asarray(link.m1[:, 0] @ moved / (link.one @ link.m1[:, 0]))
    raise KeyError(name)


@pytest.fixture(scope="module")
def start() -> tuple[Steps, Motion, np.ndarray]:
    solver, motion = made(corner(np.eye(3), initial="quasi-static"))
    return solver, motion, solver.start(motion, []).u


def test_a_start_is_where_a_damped_march_from_rest_settles() -> None:
    """Of all bodies, 1e-4 of the largest displacement; dampers near critical damping leave e^-16 after three seconds."""
    raw = corner(np.eye(3), damping=1.5e4, initial="quasi-static", step=5e-3)
    solver, motion = made(raw)
    wanted = solver.start(motion, []).u
    at_rest, _ = made({**raw, "analysis": {**raw["analysis"], "initial": "rest"}})
    times = at_rest.ready.c.h * np.arange(1, 601)
    last, _ = march(at_rest.ready, at_rest.start(motion, []), motion(times), motion)
    assert_allclose(last.u, wanted, atol=1e-4 * np.abs(wanted).max())


def test_the_tyre_bears_all_weight(start: tuple[Steps, Motion, np.ndarray]) -> None:
    """Its force along its line, and the weight: equilibrium along the slides that nothing drives, to 1e-6."""
    solver, _, u = start
    line = np.array([0, 0, 0.31]) + travel(solver, u, "upright")
    force = 3823.0 - 2e5 * (np.linalg.norm(line) - 0.31)
    weight = 9.81 * sum(float(link.one @ link.m1[:, 0]) for link in solver.ready.system.model.links)
    road = sum(float(x.one @ x.m1[:, 0]) for x in solver.ready.system.model.links if x.name == "road")
    assert force * line[2] / np.linalg.norm(line) == pytest.approx(weight - 9.81 * road, rel=1e-6)


def test_a_start_turns_with_the_scene(start: tuple[Steps, Motion, np.ndarray]) -> None:
    """Axes of beams' sections and of hinges are found from the scene: 1e-6, what iterations leave."""
    solver, _, u = start
    askew, motion = made(corner(ASKEW, initial="quasi-static"))
    found = askew.start(motion, []).u
    for name in ("body", "upright", "upper"):
        there = travel(solver, u, name)
        assert_allclose(ASKEW.T @ travel(askew, found, name), there, atol=1e-6 * np.abs(u).max())


def test_positions_of_a_static_analysis_are_its_starts(start: tuple[Steps, Motion, np.ndarray]) -> None:
    """Rigid links of steps and of positions differ in stiffness: 1e-4 of what they move by."""
    solver, _, u = start
    still, motion = made(corner(np.eye(3), kind="static", step=0.5))
    found = static(still.ready, motion).u
    for name in ("body", "upright"):
        there = travel(solver, u, name)
        assert_allclose(travel(still, found, name), there, atol=1e-4 * np.abs(there).max())


def test_a_balance_is_found_whatever_the_strut_bears() -> None:
    """Soft against large preloads: the last changes of one in thirty were rounding, and were taken for no balance."""
    heaves = []
    struts = np.linspace(6280.0, 6320.0, 5)
    for strut in [*struts, 6318.967447730371]:
        still, motion = made(corner(np.eye(3), strut=float(strut), kind="static"))
        heaves.append(travel(still, static(still.ready, motion).u, "body")[2])
    fitted = np.polyval(np.polyfit(struts, heaves[:-1], 2), [*struts, 6318.967447730371])
    assert_allclose(heaves, fitted, rtol=1e-6)


def test_a_start_that_is_not_found_is_refused_in_words_and_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """A strut that bears nothing where it is drawn: arms fold. 60, 120 and 30 iterations at most, few gradients each."""
    counted, gradients = [0], Instant.gradients

    def counting(now: Instant, z: np.ndarray) -> np.ndarray:
        counted[0] += 1
        return gradients(now, z)

    monkeypatch.setattr(Instant, "gradients", counting)
    solver, motion = made(corner(np.eye(3), strut=-5e4, initial="quasi-static"))
    with pytest.raises(NoBalanceError, match=r"link '\w+' moves most from iteration to iteration.*take initial"):
        solver.start(motion, [])
    assert counted[0] < 60 + (120 + 30) * 50


STEADY = {"kind": "constant_speed", "speed": 9.0}
SETTING_OUT = {"kind": "harmonic", "angle": 0.6, "frequency": 1.5, "phase": -np.pi / 2}
RIM, ARM, MASS = 0.2, 0.15, 0.2


def turntable(Q: np.ndarray, arm: Raw, motion: Raw) -> Raw:
    """An arm on a hinge at the rim of a table that turns about Q's z; a spring that pulls it aside."""
    hinge = {"kind": "revolute", "axis": Q[:, 2].tolist()}
    return {
        "links": {"table": {"model": "rigid"}, "arm": arm},
        "joints": {
            "O": {**hinge, "links": ["table", "ground"], "at": [0, 0, 0]},
            "P": {**hinge, "links": ["arm", "table"], "at": (RIM * Q[:, 0]).tolist()},
        },
        "springs": {"s": {"kind": "torsion", "joint": "P", "stiffness": 20.0, "free_angle": 0.12}},
        "drive": {"joint": "O", "motion": motion},
        "analysis": {
            "end_time": 2e-3, "step": 1e-3, "accuracy": "quick", "frames": "co-rotational", "initial": "quasi-static",
        },
    }  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "Q", "motion"),
    [
        ("bar", np.eye(3), STEADY), ("bar", ASKEW, SETTING_OUT), ("polyline", np.eye(3), SETTING_OUT),
        ("polyline", np.eye(3)[:, [1, 2, 0]], STEADY), ("numbers", ASKEW, STEADY), ("numbers", np.eye(3), SETTING_OUT),
    ],
    ids=["bar", "bar, oblique", "planar line", "line about x", "numbers, oblique", "numbers"],
)  # fmt: skip
def test_a_rigid_link_that_a_spring_has_turned_begins_with_what_its_hinge_bears(
    kind: str, Q: np.ndarray, motion: Raw
) -> None:
    """F = m a of its centre where the spring has turned it to, by (α× + ω²) of the table, at the start and a step later:
    what moves by 4e-4 m in the step changes a force by 3e-3 of it."""
    ends = [(RIM * Q[:, 0]).tolist(), ((RIM + 2 * ARM) * Q[:, 0]).tolist()]
    shape: Raw = {"kind": kind, "width": 0.02, "thickness": 0.02}
    shape |= {"between": ends} if kind == "bar" else {"points": ends}
    arm: Raw = {"model": "rigid", "material": "steel", "shape": shape}
    mass = 7850 * 0.02**2 * 2 * ARM
    if kind == "numbers":
        centre, mass = ((RIM + ARM) * Q[:, 0]).tolist(), MASS
        arm = {"model": "rigid", "mass": MASS, "centre": centre, "inertia": [0.003] * 3 + [0.0] * 3}
    found = channels(*ran(turntable(Q, arm, motion)))
    q = float(found["springs/s/angle"].ravel()[0])
    assert abs(q) > 0.03
    omega, alpha = (9.0, 0.0) if motion is STEADY else (0.0, 0.6 * (3 * np.pi) ** 2)
    e = RIM * Q[:, 0] + ARM * (np.cos(q) * Q[:, 0] + np.sin(q) * Q[:, 1])
    force = mass * (alpha * np.cross(Q[:, 2], e) - omega**2 * e)
    size = float(np.linalg.norm(force))
    assert_allclose(found["joints/P/force"][0], force, atol=3e-4 * size)
    turned = Rotation.from_rotvec(omega * 1e-3 * Q[:, 2]).apply(force)
    assert_allclose(found["joints/P/force"][1], turned, atol=3e-3 * size)
