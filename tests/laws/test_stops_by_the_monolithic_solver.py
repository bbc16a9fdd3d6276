"""Steps in which stops with damping are met and left, divided, as by the oracle, which divides them with code of its own.

Driven chains whose crank swings and takes a joint past a limit and back, and bodies that nothing drives, which turn or
slide far from where they are drawn before they bounce: all kinds of links, along z, x and askew.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.arrays import Bool
from tests.cells import IN_A_PLANE, WITHIN, Cell, executed, scene_of
from tests.laws.test_joint_partners import TURNS
from tests.moving import turned
from tests.partners import partner
from tests.systems import Begun, begun, by_oracle, marched, rows

Raw = dict[str, Any]
STEEL, LENGTH, SIDE = 7850.0, 0.2, 0.02
SWING, FLIGHT, BOUNCE = (
    12,
    140,
    18,
)  # steps of a swing of the crank, within which a stop is met, in which it is met and left
JOINTS = {"revolute": ("angle", 200.0, 1.0), "prismatic": ("travel", 1e4, 20.0)}
AXES = {"z": np.eye(3)[2], "x": np.eye(3)[0], "askew": np.array([0.48, -0.6, 0.64])}


def pushing(of: Begun) -> Bool[np.ndarray, " r"]:
    """Which constraint is the limit."""
    return np.array([x.name.startswith("limits") for x in of.ready.system.constraints])


def as_by_the_oracle(of: Begun, count: int, within: float, first: int = 1) -> None:
    """Displacements, and the push of a stop that begins after the first step and ends before the last."""
    history = marched(of, count, divided=True, first=first)[1]
    push = history.multiplier @ pushing(of)
    met = np.flatnonzero(push)
    assert 0 < met[0] <= met[-1] < count - 1
    u, multipliers = by_oracle(of, count, divided=True, first=first)
    assert_allclose(rows(of.ready, history.u), u, rtol=0, atol=within * np.abs(u).max())
    assert_allclose(push, multipliers @ pushing(of), rtol=0, atol=1e3 * within * np.abs(push).max())


def swung(cell: Cell, axis: str) -> Raw:
    """A chain whose crank swings, joint J along an axis, with a stop half way."""
    raw = scene_of(cell)
    J = raw["joints"]["J"]
    raw = turned(raw, TURNS[cell.plane][axis](np.array(J.get("axis", [0.0, 0.0, 1.0]))))
    raw["drive"]["motion"] = {"kind": "harmonic", "frequency": 1 / (SWING * 5e-3), "phase": "-90 deg", "angle": 0.1}
    raw["analysis"] |= {"step": 5e-3, "end_time": SWING * 5e-3}
    kind, k, c = JOINTS[cell.joint]
    stop = {"kind": kind, "joint": "J", "stiffness": k, "damping": c}
    free = begun(raw | {"limits": {"s": {"upper": 10.0, **stop}}})
    e = marched(free, SWING)[1].e @ pushing(free)
    end = 0.5 * float(e[np.abs(e).argmax()])
    return raw | {"limits": {"s": {"upper" if end > 0 else "lower": end, **stop}}}


CELLS = [
    (Cell(joint, frames, True, links), axis)
    for links in ("planar beams", "plane links", "planar rigid", "beams in space", "solids", "rigid")
    for joint in JOINTS
    for frames in (("rigid-body", "co-rotational") if links in IN_A_PLANE else ("rigid-body",))  # others: cells, bounces
    for axis in (("x", "askew") if links in IN_A_PLANE else ("z", "x", "askew"))
    if not (links in IN_A_PLANE and joint == "revolute" and axis == "x")  # about z, whatever the plane is turned by
]  # fmt: skip
FREE = [
    (kind, joint, axis)
    for kind in ("planar beam", "plane", "beam", "solid", "rigid")
    for joint in JOINTS
    for axis in (("z" if joint == "revolute" else "x",) if kind in {"planar beam", "plane"} else AXES)
    if (kind, joint) != ("rigid", "prismatic")  # whose forces in flight are rounding beside its stiffness, to the oracle
]


def marks(cases: list[Any], quick: Any) -> list[Any]:
    """The others are long."""
    return [pytest.param(*x, marks=[] if quick(*x) else pytest.mark.long, id=", ".join(map(str, x))) for x in cases]


@pytest.mark.parametrize(("cell", "axis"), marks(CELLS, lambda cell, axis: cell.links == "planar beams"))
def test_a_stop_that_a_drive_takes_a_joint_past_and_back(cell: Cell, axis: str) -> None:
    as_by_the_oracle(begun(swung(cell, axis)), SWING, cell.within)


@pytest.mark.parametrize(("kind", "joint", "axis"), marks(FREE, lambda kind, joint, axis: kind == "planar beam"))
def test_a_body_bounces_far_from_where_it_is_drawn(kind: str, joint: str, axis: str) -> None:
    """After some 100 steps, 1 rad about a hinge; the oracle takes those beside the stop."""
    n, step, turns = AXES[axis], 1e-3, joint == "revolute"
    along = np.cross(n, AXES["x"] if axis == "z" else [0.9, 0.3, 0.5]) if turns else n
    end = LENGTH * along / np.linalg.norm(along)
    speed = (0.01 if turns else 5e-4) / step
    place = [LENGTH / 2, 0.015, 0.0] if kind == "plane" and not turns else [0.0, 0.0, 0.0]
    mass = STEEL * SIDE**2 * LENGTH * (LENGTH**2 / 3 if turns else 1.0)
    omega = np.pi / (12 * step)
    raw: Raw = {
        "links": {"rod": partner(kind, [0.0, 0.0, 0.0], end.tolist(), n if turns else np.cross(n, [0.3, 0.5, 0.9]))},
        "joints": {"J": {"kind": joint, "links": ["rod", "ground"], "at": place, "axis": n.tolist()}},
        "limits": {"s": {"kind": JOINTS[joint][0], "joint": "J", "upper": 100.4 * speed * step,
                         "stiffness": mass * omega**2, "damping": 0.4 * mass * omega}},
        "analysis": {"end_time": 1.0, "step": step, "rho_inf": 0.8, "initial_speeds": {"J": speed}},
        "gravity": [2.0, -9.0, 0.0 if kind in {"planar beam", "plane"} else 3.0],
    }  # fmt: skip
    of = begun(raw)
    before = int(np.flatnonzero(marched(of, FLIGHT, divided=True)[1].multiplier @ pushing(of))[0]) - 1
    near = replace(of, state=marched(of, before)[0])
    as_by_the_oracle(near, BOUNCE, WITHIN["co-rotational"], before + 1)


def test_the_oracle_finds_rates_of_fast_coordinates() -> None:
    """Of a damped spring that turns by 1 to 3 rad a step; differences over four times as long are 8.7e-7 off."""
    cell = Cell("revolute", "rigid-body", True, "solid and beam", "spring on the joint")
    assert executed(cell)[1] < 2e-8
