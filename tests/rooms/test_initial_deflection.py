"""Forces that are let go at the start: what they have deflected swings freely."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import KedfemError
from tests.laws.test_follower_loads import ASKEW, arm
from tests.laws.test_limits import AXES
from tests.moving import beam_in_space, channels, ran, state

Raw = dict[str, Any]
FORCE, LENGTH = 40.0, 0.5
BENDING = {
    **dict.fromkeys(("beam", "solid"), 2.1e11 * 0.02**4 / 12),
    "spatial beam": 2.1e11 * np.pi * 0.02**4 / 64,
}  # E I [N m²]
MASS = {**dict.fromkeys(("beam", "solid"), 7850 * 0.02**2), "spatial beam": 7850 * np.pi * 0.02**2 / 4}  # a metre [kg/m]


def plucked(kind: str, R: np.ndarray, held: str, frames: str) -> Raw:
    """A clamped arm whose tip is let go, the force along R e_y; a weld holds it, or a drive that hardly turns."""
    tip, force = R @ [LENGTH, 0, 0], R @ [0, FORCE, 0]
    k = 3 if kind != "beam" else 2
    go = {"link": "arm", "at": tip[:k].tolist(), "force": force[:k].tolist()}
    raw: Raw = {
        "links": {"arm": arm(kind, R, 6)},
        "joints": {"A": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0, 0]}},
        "analysis": {"end_time": 0.02, "step": 1e-4, "rho_inf": 0.9, "initial_deflection": {"tip": go}},
    }
    if held == "drive":
        raw["joints"]["A"] |= {"kind": "revolute", "axis": R[:, 2].tolist()}
        raw["drive"] = {"joint": "A", "motion": {"kind": "cycloidal", "angle": 1e-9, "rise": 1.0}}
        raw["analysis"] |= {"initial": "quasi-static", "frames": frames}
    return raw


CASES = [
    ("beam", np.eye(3), "weld", "co-rotational"), ("beam", np.eye(3), "drive", "rigid-body"),
    ("spatial beam", ASKEW, "weld", "co-rotational"), ("spatial beam", ASKEW, "drive", "rigid-body"),
    ("spatial beam", np.eye(3), "drive", "co-rotational"),
    ("solid", ASKEW, "drive", "co-rotational"),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "R", "held", "frames"), CASES)
def test_a_plucked_cantilever_swings_with_its_first_frequency(kind: str, R: Any, held: str, frames: str) -> None:
    """From F L³/(3 E I), at rest, through zero after a quarter of the first period; 97 % of it is the first mode."""
    ready, blocks = ran(plucked(kind, R, held, frames))
    links = ready.model.links
    last = max(range(len(links)), key=lambda k: float((links[k].nodes @ R)[:, 0].max()))
    at = np.flatnonzero(links[last].one)[int((links[last].nodes @ R)[:, 0].argmax())]
    moved = state(blocks, last, "u")[:, at] @ (R[:, 1] if kind != "beam" else [0, 1, 0])
    assert_allclose(moved[0], FORCE * LENGTH**3 / (3 * BENDING[kind]), rtol=5e-3)
    assert np.abs(state(blocks, last, "v")[0]).max() < 1e-6
    energy = sum(float(state(blocks, k, "strain")[0]) for k in range(len(links)))
    assert_allclose(energy, FORCE * moved[0] / 2, rtol=1e-3)
    omega = (1.8751 / LENGTH) ** 2 * np.sqrt(BENDING[kind] / MASS[kind])
    t = np.concatenate([block.motion.t for block in blocks])
    assert_allclose(moved, moved[0] * np.cos(omega * t), atol=0.1 * moved[0])


@pytest.mark.parametrize("axis", AXES)
def test_a_plucked_rigid_rod_swings_on_its_spring(axis: str) -> None:
    """From k θ = F L cos θ about its end, with its first frequency."""
    n, stiffness, force = AXES[axis], 200.0, 4.0
    d = np.cross(n, [0.3, 0.5, 0.9])
    end = LENGTH * d / np.linalg.norm(d)
    rod = {**beam_in_space((0, 0, 0), end, 2, n), "model": "rigid"}
    del rod["beam"]
    ready, blocks = ran({
        "gravity": [0, 0, 0], "links": {"rod": rod},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "rod"], "at": [0, 0, 0], "axis": n.tolist()}},
        "springs": {"S": {"kind": "torsion", "joint": "A", "stiffness": stiffness}},
        "analysis": {"end_time": 0.15, "step": 2e-4, "rho_inf": 0.95, "initial_deflection": {"tip": {
            "link": "rod", "at": end.tolist(), "force": (force * np.cross(n, end) / LENGTH).tolist()}}},
    })  # fmt: skip
    theta = channels(ready, blocks)["springs/S/angle"][:, 0]
    assert_allclose(stiffness * theta[0], force * LENGTH * np.cos(theta[0]), rtol=1e-7)
    mass = 7850 * np.pi * 0.02**2 / 4 * LENGTH
    omega = np.sqrt(stiffness / (mass * (LENGTH**2 / 3 + 0.02**2 / 16)))
    t = np.concatenate([block.motion.t for block in blocks])
    assert_allclose(theta, theta[0] * np.cos(omega * t), atol=2e-3 * theta[0])
    assert omega * t[-1] > 2 * np.pi


REFUSED = [
    ({"initial": "rest"}, "drive", "initial: must be 'quasi-static' with an initial deflection and a drive"),
    ({"initial_speeds": {"A": 1.0}}, "drive", "initial_deflection: must not be combined with initial speeds and motions"),
    ({"initial_deflection": {"tip": {"link": "rod", "at": [0, 0], "force": [0, 1]}}}, "weld",
     "initial_deflection.tip.link: must name a link, got 'rod', known: arm"),
    ({"initial_deflection": {"tip": {"link": "arm", "at": [0.6, 0], "force": [0, 1]}}}, "weld", "tip.at: must"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "held", "said"), REFUSED, ids=[str(k) for k in range(len(REFUSED))])
def test_what_cannot_be_let_go_is_refused(given: Raw, held: str, said: str) -> None:
    raw = plucked("beam", np.eye(3), held, "rigid-body")
    raw["analysis"] |= given
    with pytest.raises(KedfemError) as caught:
        ran(raw)
    assert said in str(caught.value)
