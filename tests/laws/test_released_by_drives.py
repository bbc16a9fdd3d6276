"""Drives of one coordinate of a joint whose other motions are free: as chains of massless hinges and slides."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from kedfem.scene.records.loads import inertia_tensor
from tests.runs import ran

END, STEP = 0.3, 1e-3
GRAVITY = [1.0, -2.0, -9.81]
BODY = {"model": "rigid", "mass": 2.0, "centre": [0.1, 0.05, -0.08], "inertia": [0.2, 0.25, 0.3, 0.01, 0.02, -0.03]}
Raw = dict[str, Any]


def scene(joints: Raw, drive: Raw, springs: Raw, travels: bool) -> Raw:
    """A body under gravity and springs, its drive swinging from rest on: by 80 mm or 2 rad."""
    motion = {"kind": "harmonic", "frequency": 2.0, "phase": "-90 deg", **({"travel": 0.04} if travels else {"angle": 1})}
    return {
        "gravity": GRAVITY, "links": {"body": BODY},
        "joints": {name: {"at": [0, 0, 0], **joint} for name, joint in joints.items()},
        "springs": springs, "drive": {**drive, "motion": motion},
        "analysis": {"end_time": END, "step": STEP, "rho_inf": 0.8, "frames": "co-rotational", "accuracy": "quick"},
    }  # fmt: skip


def torsion(joint: str, **more: Any) -> Raw:
    return {"kind": "torsion", "joint": joint, "stiffness": 4.0, "damping": 0.02, **more}


def slide(joint: str, **more: Any) -> Raw:
    return {"kind": "spring", "joint": joint, "stiffness": 300.0, "damping": 1.0, **more}


def one(kind: str, drive: Raw, springs: Raw, **more: Any) -> Raw:
    """The joint with all its coordinates."""
    travels = "along" in drive or "travel" in drive.values() or kind == "slot"
    joints = {"J": {"kind": kind, "links": ["body", "ground"], **more}}
    return scene(joints, {"joint": "J", **drive}, springs, travels)


Hop = tuple[str, list[float], float, float]  # kind, axis, stiffness, damping


def hinges_and_slides(hops: list[Hop], driven: int) -> tuple[np.ndarray, np.ndarray]:
    """Places of the body's centre and efforts of the drive at the time points of the scene.

    Newton and Euler's equations on the free coordinates q of massless hinges and slides from the ground on, all at the
    origin: M q'' = Q - J' (w x p), the rates of J by differences.
    """
    inertia, mass = inertia_tensor(BODY["inertia"]), BODY["mass"]
    k, c = (np.array([hop[n] for hop in hops]) for n in (2, 3))
    free = [n for n in range(len(hops)) if n != driven]

    def pose(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        R, p, columns = np.eye(3), np.zeros(3), []
        for (kind, axis, *_), x in zip(hops, q, strict=True):
            columns.append((kind, R @ axis, p.copy()))
            if kind == "prismatic":
                p = p + R @ axis * x
            else:
                R = R @ Rotation.from_rotvec(x * np.array(axis)).as_matrix()
        centre = p + R @ BODY["centre"]
        J = [np.r_[a, 0, 0, 0] if kind == "prismatic" else np.r_[np.cross(a, centre - at), a] for kind, a, at in columns]
        return R, centre, np.array(J).T

    def moving(t: float, y: np.ndarray) -> tuple[np.ndarray, float]:
        amplitude, w = (0.04 if hops[driven][0] == "prismatic" else 1.0), 4 * np.pi
        q, rate, more = np.zeros((3, len(hops)))
        q[free], rate[free] = np.split(y, 2)
        q[driven], rate[driven] = amplitude * (1 - np.cos(w * t)), amplitude * w * np.sin(w * t)
        more[driven] = amplitude * w**2 * np.cos(w * t)
        (R, _, J), h = pose(q), 1e-5
        bias = (pose(q + h * rate)[2] - pose(q - h * rate)[2]) / (2 * h) @ rate
        M = np.zeros((6, 6))
        M[:3, :3], M[3:, 3:] = mass * np.eye(3), R @ inertia @ R.T
        omega = (J @ rate)[3:]
        rest = M @ bias - np.r_[mass * np.array(GRAVITY), -np.cross(omega, M[3:, 3:] @ omega)]
        A, b = J.T @ M @ J, J.T @ rest + k * q + c * rate
        more[free] = np.linalg.solve(A[np.ix_(free, free)], -(b + A @ more)[free])
        return np.r_[rate[free], more[free]], float((A @ more + b)[driven])

    t = np.arange(round(END / STEP) + 1) * STEP
    found = solve_ivp(lambda t, y: moving(t, y)[0], (0, END), np.zeros(2 * len(free)), t_eval=t, rtol=1e-9, atol=1e-11)
    amplitude = 0.04 if hops[driven][0] == "prismatic" else 1.0
    centres = []
    for now, y in zip(t, found.y.T, strict=True):
        q = np.zeros(len(hops))
        q[free], q[driven] = y[: len(free)], amplitude * (1 - np.cos(4 * np.pi * now))
        centres.append(pose(q)[1])
    return np.array(centres), np.array([moving(now, y)[1] for now, y in zip(t, found.y.T, strict=True)])


X, Y, Z = np.eye(3).tolist()
SLIDE, TURN = (300.0, 1.0), (4.0, 0.02)
CASES = {
    "cylindrical, travel": (
        one("cylindrical", {"coordinate": "travel"}, {"a": torsion("J")}, axis="z"),
        [("prismatic", Z, 0, 0), ("revolute", Z, *TURN)], 0,
    ),
    "cylindrical, angle": (
        one("cylindrical", {"coordinate": "angle"}, {"a": slide("J")}, axis="z"),
        [("prismatic", Z, *SLIDE), ("revolute", Z, 0, 0)], 1,
    ),
    "planar, travel": (
        one("planar", {"along": "x"}, {"a": slide("J", along="y"), "b": torsion("J")}, axis="z"),
        [("prismatic", X, 0, 0), ("prismatic", Y, *SLIDE), ("revolute", Z, *TURN)], 0,
    ),
    "planar, angle": (
        one("planar", {}, {"a": slide("J", along="y"), "b": slide("J", along="x")}, axis="z"),
        [("prismatic", X, *SLIDE), ("prismatic", Y, *SLIDE), ("revolute", Z, 0, 0)], 2,
    ),
    "universal, about the ground's axis": (
        one("universal", {"about": "ground"}, {"a": torsion("J", about="body")}, axes=["y", "x"]),
        [("revolute", X, 0, 0), ("revolute", Y, *TURN)], 0,
    ),
    "universal, about the body's axis": (
        one("universal", {"about": "body"}, {"a": torsion("J", about="ground")}, axes=["y", "x"]),
        [("revolute", X, *TURN), ("revolute", [0, -1, 0], 0, 0)], 1,
    ),
    "slot": (
        one("slot", {}, {}, axis="x"),
        [("prismatic", X, 0, 0), ("revolute", Z, 0, 0), ("revolute", Y, 0, 0), ("revolute", X, 0, 0)], 0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_drive_of_one_coordinate_leaves_the_others_to_forces(name: str) -> None:
    """The drive's effort, too, once what the start excites has gone: its reaction to springs, gravity and inertia.

    About the body's own axis a universal joint's angle is that of the ground against the body.
    """
    raw, hops, driven = CASES[name]
    run, (wanted, effort) = ran(raw), hinges_and_slides(hops, driven)
    moved = np.abs(wanted - BODY["centre"]).max()
    assert moved > 0.02
    assert_allclose(run.position("body", BODY["centre"]), wanted, atol=1e-3 * moved)  # of steps of 1 ms
    kind = "force" if hops[driven][0] == "prismatic" else "torque"
    assert_allclose(run.channel(f"drive/{kind}")[100:, 0], effort[100:], atol=1e-2 * np.abs(effort).max())


@pytest.mark.parametrize("step", [0.01, 0.1])
def test_positions_of_a_driven_joint_balance_its_free_motion(step: float) -> None:
    """However far apart they are: the weight's moment about the ground's axis is that of the spring, which is stiffer."""
    raw, _, _ = CASES["universal, about the body's axis"]
    run = ran({**raw, "analysis": {**raw["analysis"], "kind": "static", "step": step}})
    weight = BODY["mass"] * np.array(GRAVITY)

    def moment(turn: float, driven: float) -> float:
        R = Rotation.from_rotvec([turn, 0, 0]) * Rotation.from_rotvec([0, driven, 0])
        return float(np.cross(R.apply(BODY["centre"]), weight)[0] - 4.0 * turn)

    wanted = [brentq(moment, -3, 3, args=(np.cos(4 * np.pi * t) - 1,)) for t in run.t]
    assert_allclose(run.channel("springs/a/angle")[:, 0], wanted, atol=1e-6)  # rigid links give 1e-7
