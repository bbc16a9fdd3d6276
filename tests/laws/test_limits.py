"""Limits of joints: a body that bounces on a stop, pushes against it, in all directions, against closed forms.

Of a mass m at speed v against k s + c s', which never pulls, with ω² = k/m and ζ = c/(2 m ω) < 1:
s = v/ω_d e^(−ζωt) sin ω_d t until k s + c s' = 0, where s'' = 0, at ω_d t = 2 acos ζ: still beyond the stop, and there
s' = −v exp(−2 ζ acos ζ / √(1 − ζ²)).
(Were it to stay on the stop until s = 0, it would be pulled and leave at exp(−π ζ / √(1 − ζ²)).)
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cells import Cell, scene_of
from tests.moving import bar, beam_in_space
from tests.runs import Ran, ran

Raw = dict[str, Any]
OBLIQUE = np.array([0.48, -0.6, 0.64])
AXES = {"x": np.eye(3)[0], "y": np.eye(3)[1], "z": np.eye(3)[2], "oblique": OBLIQUE}
STEEL, ROUND = 7850.0, np.pi * 0.02**2 / 4


@dataclass(frozen=True)
class Bounce:
    """What a stop does to a mass, or a moment of inertia, that meets it at a speed."""

    mass: float
    speed: float
    stiffness: float
    zeta: float

    @property
    def omega(self) -> float:
        return float(np.sqrt(self.stiffness / self.mass))

    @property
    def damping(self) -> float:
        return 2 * self.zeta * self.mass * self.omega

    @property
    def contact(self) -> float:
        """How long it is pushed [s]."""
        return float(2 * np.arccos(self.zeta) / np.sqrt(1 - self.zeta**2) / self.omega)

    @property
    def restitution(self) -> float:
        return float(np.exp(-2 * self.zeta * np.arccos(self.zeta) / np.sqrt(1 - self.zeta**2)))

    @property
    def peak(self) -> float:
        """Its largest push: at once, or where k s' + c s'' = 0."""
        root, angle = np.sqrt(1 - self.zeta**2), np.arccos(self.zeta)
        turned = max(
            3 * angle - np.pi, 0.0
        )  # s'' goes with sin(ω_d t − 2 acos ζ), its rate with sin(ω_d t − 3 acos ζ)
        falls = np.exp(-self.zeta / root * turned)
        return float(self.mass * self.speed * self.omega / root * falls * np.sin(2 * angle - turned))


def undriven(links: Raw, joint: Raw, limit: Raw, speed: float, end: float, count: int) -> Ran:
    analysis = {
        "end_time": end,
        "step": end / count,
        "rho_inf": 0.8,
        "accuracy": "quick",
        "initial_speeds": {"J": speed},
    }
    return ran(
        {
            "links": links,
            "joints": {"J": joint},
            "limits": {"stop": {"joint": "J", **limit}},
            "analysis": analysis,
        }
    )


def limit_of(kind: str, bounce: Bounce, gap: float, side: int) -> Raw:
    ends = {"upper" if side > 0 else "lower": side * gap}
    return {"kind": kind, "stiffness": bounce.stiffness, "damping": bounce.damping, **ends}


GAP = 1e-3  # m, rad


def slid(bounce: Bounce, axis: str, side: int, count: int) -> Ran:
    """A short rod along an axis, which slides on the ground and meets a stop, until it is back where it was."""
    n = AXES[axis]
    joint = {"kind": "prismatic", "links": ["rod", "ground"], "at": (0.02 * n).tolist(), "axis": n.tolist()}
    links = {"rod": beam_in_space((0, 0, 0), 0.04 * n, 1, np.cross(n, [0.3, 0.5, 0.9]))}
    end = GAP / bounce.speed + bounce.contact + 0.5 * GAP / bounce.speed
    return undriven(links, joint, limit_of("travel", bounce, GAP, side), side * bounce.speed, end, count)


def swung(bounce: Bounce, axis: str, side: int, count: int) -> Ran:
    """A rod across the axis of a hinge at its end, which meets a stop."""
    n = AXES[axis]
    along = np.cross(n, [0.3, 0.5, 0.9])
    along /= np.linalg.norm(along)
    joint = {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}
    links = {"rod": beam_in_space((0, 0, 0), 0.2 * along, 2, n)}
    end = GAP / bounce.speed + bounce.contact + 0.5 * GAP / bounce.speed
    return undriven(links, joint, limit_of("angle", bounce, GAP, side), side * bounce.speed, end, count)


MASS, INERTIA = STEEL * ROUND * 0.04, STEEL * ROUND * (0.2**3 / 3 + 0.2 * 0.02**2 / 16)
ON_SLIDE = Bounce(MASS, 1.0, 1e5, 0.2)
ON_HINGE = Bounce(INERTIA, 2.0, 100.0, 0.2)  # slow beside its bending, 1.3 kHz


def channel(run: Ran, name: str) -> np.ndarray:
    kind = "travel" if run.ready.scene.limits["stop"].kind == "travel" else "angle"
    effort = "force" if kind == "travel" else "torque"
    return run.channel(f"limits/stop/{kind if name == 'place' else effort}")[:, 0]


def bounced(run: Ran, bounce: Bounce, side: int, within: float) -> None:
    """Speed after, time of contact, largest push and energy are those of the closed form; the push never pulls."""
    t, place, push = run.t, side * channel(run, "place"), -side * channel(run, "effort")
    h = t[1]
    after = -(place[-1] - place[-5]) / (4 * h)
    assert_allclose(after, bounce.restitution * bounce.speed, rtol=within)
    assert push.min() >= 0.0
    assert not push[place < GAP].any()
    assert_allclose(np.count_nonzero(push) * h, bounce.contact, rtol=within, atol=1.5 * h)
    assert_allclose(push.max(), bounce.peak, rtol=within)
    lost = run.kinetic_energy[0] + run.strain_energy[0] - run.kinetic_energy[-1] - run.strain_energy[-1]
    wanted = 0.5 * bounce.mass * bounce.speed**2 * (1 - bounce.restitution**2)
    assert_allclose(lost, wanted, rtol=2 * within)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("axis", AXES)
def test_a_slide_bounces_as_the_closed_form(axis: str, side: int) -> None:
    bounced(slid(ON_SLIDE, axis, side, 300), ON_SLIDE, side, 0.01)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("axis", AXES)
def test_a_hinge_bounces_as_the_closed_form(axis: str, side: int) -> None:
    bounced(swung(ON_HINGE, axis, side, 300), ON_HINGE, side, 0.01)


def test_a_plane_pendulum_bounces_between_both_its_stops_and_loses_nothing_without_damping() -> None:
    """Its period between stops at ±a is 2 (2 a/v + π/ω)."""
    bounce = Bounce(STEEL * 6e-4 * (0.2**3 / 3 + 0.2 * 0.03**2 / 12), 2.0, 400.0, 0.0)
    period = 2 * (2 * GAP / 2.0 + np.pi / bounce.omega)
    joint = {"kind": "revolute", "links": ["ground", "rod"], "at": [0, 0]}
    limit = {"kind": "angle", "lower": -GAP, "upper": GAP, "stiffness": 400.0}
    run = undriven({"rod": bar("beam", (0, 0), (0.2, 0), 2)}, joint, limit, 2.0, 2 * period, 1000)
    place, push = channel(run, "place"), channel(run, "effort")
    assert_allclose(place[[500, 1000]], 0.0, atol=0.02 * place.max())
    assert_allclose([push.min(), push.max()], [-bounce.peak, bounce.peak], rtol=0.01)
    assert_allclose(run.kinetic_energy[-1] + run.strain_energy[-1], run.kinetic_energy[0], rtol=2e-3)


@pytest.mark.parametrize("side", [1, -1])
def test_a_motor_that_pushes_against_a_stop_is_borne_by_it(side: int) -> None:
    """It comes to rest at the limit and F/k beyond."""
    joint = {"kind": "prismatic", "links": ["ground", "block"], "at": [0.02, 0], "axis": "x"}
    limit = {
        "kind": "travel",
        "joint": "J",
        "lower": "-1 mm",
        "upper": "1 mm",
        "stiffness": 1e5,
        "damping": 150.0,
    }
    run = ran({
        "links": {"block": bar("beam", (0, 0), (0.04, 0), 1)}, "joints": {"J": joint}, "limits": {"stop": limit},
        "motors": {"m": {"joint": "J", "force": side * 50.0}},
        "analysis": {"end_time": 0.05, "step": 1e-4, "rho_inf": 0.8, "accuracy": "quick"},
    })  # fmt: skip
    assert_allclose(channel(run, "place")[-1], side * (1e-3 + 50 / 1e5), rtol=1e-4)
    assert_allclose(channel(run, "effort")[-1], -side * 50.0, rtol=1e-3)


TURNS = ("revolute", "cylindrical", "screw")
CELLS = [
    Cell(joint, frames, driven, links)
    for links in ("planar beams", "plane on the ground", "on the ground", "beams in space", "solids")
    for joint in ("revolute", "prismatic", "cylindrical", "screw")
    for frames in ("rigid-body", "co-rotational")
    for driven in (True, False)
    if driven or frames == "co-rotational"
]
CHEAP = [cell for cell in CELLS if cell.drawn and cell.links == "planar beams"]
OTHERS = [cell for cell in CELLS if cell.drawn and cell.links != "planar beams"]


def as_a_curve(cell: Cell) -> None:
    """A limit without damping is a motor with the same force over the coordinate, to rounding.

    It lies where the coordinate is between the first and second step.
    """
    raw, turns = scene_of(cell), cell.joint in TURNS
    if cell.joint == "prismatic" and cell.frames == "rigid-body" and not cell.links.endswith("on the ground"):
        return  # refused by the table
    place, force = ("angle", "torque") if turns else ("travel", "force")
    raw["analysis"]["accuracy"] = "quick"

    def moved(**more: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        run = ran({**raw, **more})
        (name,) = (f"{section}/{key}" for section, each in more.items() for key in each)
        u = np.concatenate([run.state(k, "u").ravel() for k in range(len(run.ready.model.links))])
        return u, run.channel(f"{name}/{place}")[:, 0], run.channel(f"{name}/{force}")[:, 0]

    free = moved(motors={"m": {"joint": "J", force: 0.0}})[1]
    end = 0.5 * float(free[1] + free[2])
    k = 1e4
    sign = np.sign(end)
    stop = {"kind": place, "joint": "J", "upper" if end > 0 else "lower": end, "stiffness": k}
    at = [end - 1.0, end, end + 1.0]
    curve = {"over": place, "at": at, "value": [0.0, 0.0, -k] if sign > 0 else [k, 0.0, 0.0]}
    u, e, f = moved(limits={"stop": stop})
    wanted = moved(motors={"m": {"joint": "J", force: curve}})
    assert f[1] == 0.0
    assert f[2] * sign < 0
    assert_allclose(u, wanted[0], atol=1e-8 * np.abs(u).max())
    assert_allclose(e, wanted[1], atol=1e-8 * np.abs(e).max())
    assert_allclose(f, wanted[2], atol=1e-6 * np.abs(f).max())


@pytest.mark.parametrize("cell", CHEAP, ids=str)
def test_a_limit_is_its_curve_of_force(cell: Cell) -> None:
    as_a_curve(cell)


@pytest.mark.long
@pytest.mark.parametrize("cell", OTHERS, ids=str)
def test_a_limit_is_its_curve_of_force_on_all_links(cell: Cell) -> None:
    as_a_curve(cell)
