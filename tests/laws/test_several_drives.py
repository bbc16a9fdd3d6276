"""Several drives on one joint: as a joint for each in a row, as the oracle, as the balance of a rigid body by hand."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.scene import Scene, drive_angle
from tests.moving import channels, ran, state
from tests.rooms.test_cross_checks import compared
from tests.several_drives import AXES, HERE, OUT, SEVERAL, across, at_once, in_a_row

NEAR = {"rigid-body": 1e-8, "co-rotational": 1e-7}  # of the peak: these iterate, to 1e-9 of the largest force
LINKS = ("beam", "rigid", "solid")
#: every axis with one kind of link, every kind of link and frames along one axis
CASES = [
    *((link, "oblique", "rigid-body") for link in LINKS),
    *(("beam", to, "rigid-body") for to in "xyz"),
    *(pytest.param(link, "oblique", "co-rotational", marks=pytest.mark.long) for link in LINKS),
    *(pytest.param("beam", to, "co-rotational", marks=pytest.mark.long) for to in "xyz"),
    *(pytest.param(link, to, "rigid-body", marks=pytest.mark.long) for link in ("rigid", "solid") for to in "xyz"),
]
Raw = dict[str, Any]
MASS, CENTRE, SIX = 2.0, (0.15, 0.06, 0.09), (0.03, 0.05, 0.04, 0.004, 0.006, -0.002)  # Ixx, Iyy, Izz, Ixy, Iyz, Izx
INERTIA = np.array([[0.03, 0.004, -0.002], [0.004, 0.05, 0.006], [-0.002, 0.006, 0.04]])


def same(one: dict[str, np.ndarray], other: dict[str, np.ndarray], near: float) -> None:
    """All channels in common, within a part of each one's peak; of forces and energies of the largest of a kind."""
    shared = one.keys() & other.keys()
    size = {name: np.abs(one[name]).max() for name in shared}
    for name in shared:
        alike = [size[x] for x in shared if x.rsplit("/", 1)[-1] == name.rsplit("/", 1)[-1] and x[:4] == name[:4]]
        whole = size["energy/kinetic"] if name.startswith("energy/") else max(alike)
        assert_allclose(one[name], other[name], rtol=0, atol=near * max(whole, size[name]), err_msg=name)


@pytest.mark.parametrize("kind", SEVERAL)
@pytest.mark.parametrize(("link", "to", "frames"), CASES)
def test_they_are_those_of_joints_in_a_row(kind: str, link: str, to: str, frames: str) -> None:
    """Each on a joint of its own, with links without mass between these: efforts, motion and energies."""
    (one, blocks), (row, others) = (ran(raw(kind, link, to, frames=frames)) for raw in (at_once, in_a_row))
    found, wanted = channels(one, blocks), channels(row, others)
    efforts = {name.replace("drive/", "drive/J."): x for name, x in wanted.items() if name.startswith("drive/")}
    assert len([name for name in found if name in efforts and "rigid" not in name]) == len(SEVERAL[kind])
    energies = {name: x for name, x in wanted.items() if name.startswith("energy/")}
    same(found, efforts | energies, NEAR[frames])
    u, v = (state(x, 0, "u") for x in (blocks, others))
    size = 1e-6 * np.linalg.norm(np.subtract(OUT, HERE)) if link == "rigid" else np.abs(v).max()  # it is off by 1e-9 m
    assert_allclose(u, v, rtol=0, atol=NEAR[frames] * size)


@pytest.mark.parametrize("kind", SEVERAL)
@pytest.mark.parametrize(
    ("link", "to", "frames", "on"),
    [
        ("beam", "oblique", "rigid-body", "base"), ("beam", "oblique", "rigid-body", "crank"),
        *((link, to, "rigid-body", "ground") for link, to in (("beam", "x"), ("solid", "y"), ("rigid", "z"))),
        *(pytest.param(link, "oblique", "co-rotational", on, marks=pytest.mark.long)
          for link, on in (("beam", "ground"), ("solid", "base"), ("beam", "crank"), ("solid", "crank"))),
    ],
)  # fmt: skip
def test_they_are_those_of_the_oracle(kind: str, link: str, to: str, frames: str, on: str) -> None:
    """On the ground, on a part of it that moves, and on a beam that a further drive turns.

    Of a rigid link on a beam, as stiff as rounding lets it be, both differ by 1e-6 as with one drive on a hinge.
    """
    raw = at_once(kind, link, to, on, frames=frames)
    oracle = {**raw, "analysis": {**raw["analysis"], "solver": "monolithic"}}
    found, wanted = channels(*ran(raw)), channels(*ran(oracle))
    assert len([name for name in wanted if name.startswith("drive/J.") and "rigid" not in name]) == len(SEVERAL[kind])
    same(found, wanted, NEAR[frames])


@pytest.mark.parametrize("kind", SEVERAL)
@pytest.mark.parametrize("frames", ["rigid-body", pytest.param("co-rotational", marks=pytest.mark.long)])
def test_their_power_is_the_change_of_energy_and_the_other_work(kind: str, frames: str) -> None:
    raw = at_once(kind, "beam", "oblique", "crank", frames=frames, step=2.5e-4, end_time=0.02)
    checks, _ = compared(*ran(raw))
    assert checks.worked
    assert checks.unworked < (1e-6 if frames == "rigid-body" else 2e-4)  # as of a drive on each kind of joint


def about(n: Any, angle: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotations by angles about a unit vector: 1 + sin N + (1 − cos) N²."""
    N = np.cross(np.eye(3), n)
    s, c = (f(angle)[:, None, None] for f in (np.sin, np.cos))
    return np.asarray(np.eye(3) + s * N + (1 - c) * (N @ N))


def by_hand(kind: str, scene: Scene, to: str, times: np.ndarray) -> dict[str, np.ndarray]:
    """Efforts of all drives on a rigid body without gravity, from its balance alone: m a, and J α + ω × J ω."""
    n, e1 = np.array(AXES[to]), np.array(across(AXES[to])[0])
    law = {name: drive_angle(scene.drives[name].motion, times) for name in SEVERAL[kind]}
    if kind == "universal":
        (p, p1, p2), (q, q1, q2) = law["first"], (-x for x in law["second"])  # the ground's arm against the link's
        first = about(n, p)
        b = first @ e1
        R = first @ about(e1, q)
        w = p1[:, None] * n + q1[:, None] * b
        alpha = p2[:, None] * n + q2[:, None] * b + p1[:, None] * q1[:, None] * np.cross(n, b)
        s2 = np.zeros_like(w)
    else:
        q, q1, q2 = law["turn"]
        R, w, alpha = about(n, q), q1[:, None] * n, q2[:, None] * n
        if kind == "cylindrical":
            s2 = law["push"][2][:, None] * n
        else:  # d1 · s = q1, d2 · s = q2, at right angles or not
            d = np.array([scene.drives[name].along for name in ("one", "two")])
            s2 = np.stack([law["one"][2], law["two"][2]], axis=1) @ np.linalg.pinv(d).T
    r, J = R @ np.subtract(CENTRE, HERE), R @ INERTIA @ np.swapaxes(R, 1, 2)
    F = MASS * (s2 + np.cross(alpha, r) + np.cross(w, np.cross(w, r)))
    M = (J @ alpha[..., None])[..., 0] + np.cross(w, (J @ w[..., None])[..., 0]) + np.cross(r, F)
    if kind == "universal":
        return {"first": M @ n, "second": -(M * b).sum(axis=1)}
    if kind == "cylindrical":
        return {"turn": M @ n, "push": F @ n}
    return {"turn": M @ n, **dict(zip(("one", "two"), (F @ np.linalg.pinv(d)).T, strict=True))}


@pytest.mark.parametrize("frames", ["rigid-body", pytest.param("co-rotational", marks=pytest.mark.long)])
@pytest.mark.parametrize("to", AXES)
@pytest.mark.parametrize("kind", [*SEVERAL, "askew"])
def test_they_turn_and_push_a_rigid_body_as_its_balance_asks(kind: str, to: str, frames: str) -> None:
    """T = I a and F = m a along a cylindrical joint; of travels in a plane at right angles, and askew (60 degrees)."""
    askew, kind = kind == "askew", "planar" if kind == "askew" else kind
    raw = at_once(kind, "rigid", to, frames=frames)
    raw["links"]["arm"] = {"model": "rigid", "mass": MASS, "centre": list(CENTRE), "inertia": list(SIX)}
    del raw["gravity"]
    if askew:
        a, b = (np.array(x) for x in across(AXES[to]))
        raw["drives"]["two"]["along"] = (0.5 * a + np.sqrt(0.75) * b).tolist()
    ready, blocks = ran(raw)
    found = channels(ready, blocks)
    t = np.concatenate([block.motion.t for block in blocks])
    for name, wanted in by_hand(kind, ready.scene, to, t).items():
        what = "force" if name in {"push", "one", "two"} else "torque"
        assert np.abs(wanted).max() > 1.0
        for rigid, near in (("rigid_", 1e-11), ("", 1e-7)):  # paths close to 1e-12; steps have rounding of stiff bodies
            got = found[f"drive/J.{name}/{rigid}{what}"][:, 0]
            assert_allclose(got, wanted, rtol=0, atol=near * np.abs(wanted).max(), err_msg=name)
    if kind == "cylindrical":  # by the formula that the name says, about the axis through the joint
        n, turn, push = np.array(AXES[to]), *(ready.scene.drives[name].motion for name in ("turn", "push"))
        off = np.cross(n, np.subtract(CENTRE, HERE))
        inertia = n @ INERTIA @ n + MASS * off @ off
        T, F = (found[f"drive/J.{name}"][:, 0] for name in ("turn/rigid_torque", "push/rigid_force"))
        assert_allclose(T, inertia * drive_angle(turn, t)[2], rtol=0, atol=1e-11 * np.abs(T).max())
        assert_allclose(F, MASS * drive_angle(push, t)[2], rtol=0, atol=1e-11 * np.abs(F).max())
