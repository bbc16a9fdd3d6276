"""Limits of joints: a body that bounces on a stop, pushes against it, in all directions, against closed forms.

Of a mass m at speed v against k s + c s', which never pulls, with ω² = k/m and ζ = c/(2 m ω) < 1:
s = v/ω_d e^(−ζωt) sin ω_d t until k s + c s' = 0, where s'' = 0, at ω_d t = 2 acos ζ: still beyond the stop, and there
s' = −v exp(−2 ζ acos ζ / √(1 − ζ²)).
(Were it to stay on the stop until s = 0, it would be pulled and leave at exp(−π ζ / √(1 − ζ²)).)
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kedfem.dynamics.system import march as system_march
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.starts import impacts
from tests import scenes
from tests.cells import Cell, scene_of
from tests.moving import bar, beam_in_space
from tests.partners import chain
from tests.runs import Ran, ran
from tests.systems import begun, by_oracle, marched, rows, stiffened

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
        turned = max(3 * angle - np.pi, 0.0)  # s'' goes with sin(ω_d t − 2 acos ζ), its rate with sin(ω_d t − 3 acos ζ)
        falls = np.exp(-self.zeta / root * turned)
        return float(self.mass * self.speed * self.omega / root * falls * np.sin(2 * angle - turned))


def undriven(links: Raw, joint: Raw, limit: Raw, speed: float, end: float, count: int) -> Ran:
    analysis = {"end_time": end, "step": end / count, "rho_inf": 0.8, "accuracy": "quick", "initial_speeds": {"J": speed}}
    return ran(
        {"links": links, "joints": {"J": joint}, "limits": {"stop": {"joint": "J", **limit}}, "analysis": analysis}
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


SIDES = [(axis, 1 if n % 2 else -1) for n, axis in enumerate(AXES)]
OTHER_SIDES = [pytest.param(axis, -side, marks=pytest.mark.long) for axis, side in SIDES]


@pytest.mark.parametrize(("axis", "side"), SIDES + OTHER_SIDES)
def test_a_slide_bounces_as_the_closed_form(axis: str, side: int) -> None:
    bounced(slid(ON_SLIDE, axis, side, 300), ON_SLIDE, side, 0.01)


@pytest.mark.parametrize(("axis", "side"), SIDES + OTHER_SIDES)
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
    limit = {"kind": "travel", "joint": "J", "lower": "-1 mm", "upper": "1 mm", "stiffness": 1e5, "damping": 150.0}
    run = ran({
        "links": {"block": bar("beam", (0, 0), (0.04, 0), 1)}, "joints": {"J": joint}, "limits": {"stop": limit},
        "motors": {"m": {"joint": "J", "force": side * 50.0}},
        "analysis": {"end_time": 0.05, "step": 1e-4, "rho_inf": 0.8, "accuracy": "quick"},
    })  # fmt: skip
    assert_allclose(channel(run, "place")[-1], side * (1e-3 + 50 / 1e5), rtol=1e-4)
    assert_allclose(channel(run, "effort")[-1], -side * 50.0, rtol=1e-3)


QUICK = ("beam", "rigid", "large")
KINDS: dict[str, Raw] = {
    "beam": bar("beam", (0, 0), (0.04, 0), 1), "plane": bar("plane", (0, 0), (0.04, 0), 3),
    "solid": bar("solid", (0, 0), (0.04, 0), 2), "rigid": bar("rigid", (0, 0), (0.04, 0)),
    "reduced": bar("solid", (0, 0), (0.04, 0), 4, reduction=6),
    "large": {**bar("solid", (0, 0), (0.04, 0)), "mesh": {"elements": [4, 3, 2]}},
}  # fmt: skip


@pytest.mark.parametrize("kind", [x if x in QUICK else pytest.param(x, marks=pytest.mark.long) for x in KINDS])
def test_links_of_all_kinds_bounce_as_the_closed_form(kind: str) -> None:
    """On a slide at a side of theirs: they give way a little there."""
    bounce, side = Bounce(STEEL * 6e-4 * 0.04, 1.0, 1e5, 0.2), 0.0 if kind == "beam" else 0.015
    joint = {"kind": "prismatic", "links": ["block", "ground"], "at": [0.02, side], "axis": "x"}
    end = 1.5 * GAP / bounce.speed + bounce.contact
    run = undriven({"block": KINDS[kind]}, joint, limit_of("travel", bounce, GAP, 1), 1.0, end, 300)
    assert (kind == "large") == (not run.solver.ready.bodies.dense.all())
    bounced(run, bounce, 1, 0.01)


@pytest.mark.parametrize("zeta", [0.0, 0.2, 0.6])
def test_a_bounce_is_of_second_order_in_the_step(zeta: float) -> None:
    """Where the push begins at once too: steps are divided there. Undivided the finest is off by 1e-3 at ζ = 0.2."""
    bounce, errors = Bounce(MASS, 1.0, 1e5, zeta), []
    for count in (50, 100, 200, 400):
        run = slid(bounce, "x", 1, count)
        place = channel(run, "place")
        errors.append(abs((place[-3] - place[-1]) / (2 * run.t[1]) - bounce.restitution))
    assert errors[-1] < 2e-5, errors
    assert np.log2(errors[0] / errors[-1]) / 3 > 1.7, errors


def fallen(count: int, **stops: Raw) -> Ran:
    """An arm that falls onto stops about its hinge, and bounces once or twice."""
    arm = {"kind": "bar", "between": [[0, 0], [0.3, 0]], "width": 0.02, "thickness": 0.01}
    links = {"arm": {"model": "beam", "material": "steel", "shape": arm, "mesh": {"elements": 4}}}
    return ran({
        "gravity": [0, -9.81, 0], "links": links, "limits": stops, "damping": {"beta": 2e-5},
        "joints": {"J": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "analysis": {"end_time": 0.5, "step": 0.5 / count, "rho_inf": 0.8, "accuracy": "quick"},
    })  # fmt: skip


def about_J(stiffness: float, damping: float, lower: float = -0.35) -> Raw:
    return {"kind": "angle", "joint": "J", "lower": lower, "stiffness": stiffness, "damping": damping}


def test_an_elastic_arm_that_bounces_again_and_again_moves_at_second_order() -> None:
    counts = (1000, 2000, 4000, 8000, 16000)
    found = [channel(fallen(n, stop=about_J(2000.0, 0.5)), "place")[:: n // 1000] for n in counts]
    apart = [float(np.abs(a - b).max()) for a, b in pairwise(found)]
    assert apart[-1] < 1e-4, apart
    assert np.log2(apart[0] / apart[-1]) / 3 > 1.6, apart


def test_two_stops_that_are_met_together_are_one_of_both() -> None:
    one = fallen(1000, stop=about_J(2000.0, 1.2))
    two = fallen(1000, stop=about_J(1500.0, 0.9), other=about_J(500.0, 0.3))
    assert_allclose(channel(two, "place"), channel(one, "place"), atol=1e-9)
    finer = fallen(4000, stop=about_J(2000.0, 1.2))
    shifted = fallen(4000, stop=about_J(1500.0, 0.9), other=about_J(500.0, 0.3, -0.35001))  # met in one step
    assert_allclose(channel(shifted, "place"), channel(finer, "place"), atol=5e-4)


def slider_crank(frames: str) -> Ran:
    """A slow crank that moves a slider against a stop."""

    def shape(a: float, b: float) -> Raw:
        return {"kind": "bar", "between": [[a, 0], [b, 0]], "width": 0.02, "thickness": 0.01}

    def beam(a: float, b: float) -> Raw:
        return {"model": "beam", "material": "steel", "shape": shape(a, b), "mesh": {"elements": 3}}

    hinges = {"A": ("ground", "crank", 0.0), "B": ("crank", "rod", 0.1), "C": ("rod", "shoe", 0.4)}
    joints: Raw = {name: {"kind": "revolute", "links": [i, j], "at": [x, 0]} for name, (i, j, x) in hinges.items()}
    joints["S"] = {"kind": "prismatic", "links": ["ground", "shoe"], "at": [0.4, 0], "axis": "x"}
    return ran({
        "links": {"crank": beam(0, 0.1), "rod": beam(0.1, 0.4), "shoe": {"model": "rigid", "mass": 0.5}},
        "joints": joints, "damping": {"beta": 1e-4},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": np.pi}},
        "limits": {"stop": {"kind": "travel", "joint": "S", "lower": -0.1, "stiffness": 2e4, "damping": 200.0}},
        "analysis": {"end_time": 1.0, "step": 1e-3, "initial": "quasi-static", "rho_inf": 0.8, "frames": frames,
                     "accuracy": "quick"},
    })  # fmt: skip


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_driven_slider_is_pushed_as_the_drive_moves_it(frames: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """k s + c s' of the rigid slider-crank: links give way by 2e-4 of s; it is met half way, at once with c s' = 60 N."""
    met_at, times = impacts.met_at, []
    monkeypatch.setattr(system_march, "met_at", lambda *x: (times.append(x[1].time[0] + x[3]), met_at(*x))[1])
    run = slider_crank(frames)
    phi = np.pi * run.t
    root = np.sqrt(0.3**2 - (0.1 * np.sin(phi)) ** 2)
    s = 0.1 * np.cos(phi) + root - 0.4 + 0.1
    rate = np.pi * (-0.1 * np.sin(phi) - 0.01 * np.sin(phi) * np.cos(phi) / root)
    wanted = np.where(s < 0, np.maximum(-2e4 * s - 200.0 * rate, 0.0), 0.0)
    assert_allclose(channel(run, "effort"), wanted, atol=0.01 * wanted.max())
    assert len(times) == 1
    assert s[round(times[0] / 1e-3)] < 0 < s[round(times[0] / 1e-3) - 1]


def test_a_march_that_stops_divide_goes_on_from_a_stored_state_bit_for_bit() -> None:
    raw = {
        "links": {"block": bar("beam", (0, 0), (0.04, 0), 1)},
        "joints": {"J": {"kind": "prismatic", "links": ["block", "ground"], "at": [0.02, 0], "axis": "x"}},
        "limits": {"stop": {"kind": "travel", "joint": "J", "upper": 1e-5, "stiffness": 1e5, "damping": 100.0}},
        "analysis": {"end_time": 0.01, "step": 1e-4, "rho_inf": 0.8, "initial_speeds": {"J": 1.0}},
    }
    of = begun(raw)
    whole, history = march(of.ready, of.state, of.steps(12), of.motion)
    half, _ = march(of.ready, of.state, of.steps(6), of.motion)
    rest, later = march(of.ready, half, of.steps(6, first=7), of.motion)
    for x, y in zip(rest, whole, strict=True):
        assert_array_equal(x, y)
    assert_array_equal(later.u, history.u[6:])
    assert history.multiplier.min() < 0.0


TURNS = ("revolute", "cylindrical", "screw")
CELLS = [
    Cell(joint, frames, driven, links)
    for links in ("planar beams", "plane on the ground", "on the ground", "beams in space", "solid on the ground")
    for joint in ("revolute", "prismatic", "cylindrical", "screw")
    for frames in ("rigid-body", "co-rotational")
    for driven in (True, False)
    if driven or frames == "co-rotational"
]


TWO = ("planar beams", "on the ground", "beams in space")


@dataclass(frozen=True)
class Met:
    """A cell's scene, and where a limit of J is met between the first and second step, and with which speed."""

    raw: Raw
    place: str
    force: str
    end: float
    speed: float

    @staticmethod
    def of(cell: Cell) -> "Met":
        raw, turns = scene_of(cell), cell.joint in TURNS
        place, force = ("angle", "torque") if turns else ("travel", "force")
        raw["analysis"]["accuracy"] = "quick"
        free = ran({**raw, "motors": {"m": {"joint": "J", force: 0.0}}})
        e = free.channel(f"motors/m/{place}")[:, 0]
        return Met(raw, place, force, 0.5 * float(e[1] + e[2]), float(e[2] - e[1]) / raw["analysis"]["step"])

    def stop(self, stiffness: float, damping: float = 0.0) -> Raw:
        side = "upper" if self.end > 0 else "lower"
        return {"kind": self.place, "joint": "J", side: self.end, "stiffness": stiffness, "damping": damping}

    def moved(self, **more: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Displacements of all links; coordinate, and force of the first element."""
        run = ran({**self.raw, **more})
        name = next(f"{section}/{key}" for section, each in more.items() for key in each)
        u = np.concatenate([run.state(k, "u").ravel() for k in range(len(run.ready.model.links))])
        return u, run.channel(f"{name}/{self.place}")[:, 0], run.channel(f"{name}/{self.force}")[:, 0]


def refused(cell: Cell) -> bool:
    """By the table: slides between links, whose direction turns, with rigid-body frames."""
    between = not cell.links.endswith("on the ground")
    return cell.joint == "prismatic" and cell.frames == "rigid-body" and between


CHEAP = [cell for cell in CELLS if cell.drawn and not refused(cell) and cell.links == "planar beams"]
OTHERS = [cell for cell in CELLS if cell.drawn and not refused(cell) and cell.links != "planar beams"]


def as_a_curve(cell: Cell) -> None:
    """A limit without damping is a motor with the same force over the coordinate, to rounding."""
    met, k = Met.of(cell), 1e4
    at, sign = [met.end - 1.0, met.end, met.end + 1.0], np.sign(met.end)
    curve = {"over": met.place, "at": at, "value": [0.0, 0.0, -k] if sign > 0 else [k, 0.0, 0.0]}
    u, e, f = met.moved(limits={"stop": met.stop(k)})
    wanted = met.moved(motors={"m": {"joint": "J", met.force: curve}})
    assert f[1] == 0.0
    assert f[2] * sign < 0
    assert_allclose(u, wanted[0], atol=1e-8 * np.abs(u).max())
    assert_allclose(e, wanted[1], atol=1e-8 * np.abs(e).max())
    assert_allclose(f, wanted[2], atol=1e-6 * np.abs(f).max())


def as_two(cell: Cell) -> None:
    """Two stops with damping, met in a divided step, are one with the sum of their constants."""
    met = Met.of(cell)
    c = 1.0 / abs(met.speed)
    one = met.moved(limits={"stop": met.stop(1e4, c)})
    two = met.moved(limits={"stop": met.stop(7.5e3, 0.75 * c), "other": met.stop(2.5e3, 0.25 * c)})
    assert one[2][2] * np.sign(met.end) < 0
    assert_allclose(two[0], one[0], atol=1e-7 * np.abs(one[0]).max())
    assert_allclose(two[2], 0.75 * one[2], atol=1e-4 * np.abs(one[2]).max())


@pytest.mark.parametrize("cell", CHEAP, ids=str)
def test_a_limit_is_its_curve_of_force(cell: Cell) -> None:
    as_a_curve(cell)


@pytest.mark.long
@pytest.mark.parametrize("cell", OTHERS, ids=str)
def test_a_limit_is_its_curve_of_force_on_all_links(cell: Cell) -> None:
    as_a_curve(cell)


@pytest.mark.long
@pytest.mark.parametrize("cell", [x for x in CHEAP + OTHERS if x.links in TWO], ids=str)
def test_two_limits_are_one_on_all_links(cell: Cell) -> None:
    as_two(cell)


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "screw"])
def test_stops_are_met_as_by_the_oracle_where_the_motion_stiffens_links(kind: str) -> None:
    """Pushed on both sides, with stiffening of the forces of the rigid-body motion, to which stops add nothing."""
    raw = chain(kind, ("beam", "beam"))
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": 3.0}
    raw["analysis"] |= {"stiffening": True}
    slides = kind == "prismatic"
    raw["limits"] = {"s": {
        "kind": "travel" if slides else "angle", "joint": "J", "lower": -1e-5, "upper": 1e-5,
        "stiffness": 2e5 if slides else 4e3, "damping": 3.0,
    }}  # fmt: skip
    of = begun(raw)
    wanted, plain = (by_oracle(each, 8)[0] for each in (stiffened(of), of))
    got = rows(of.ready, marched(stiffened(of), 8)[1].u)
    peak = np.abs(wanted).max()
    assert_allclose(got, wanted, rtol=0, atol=1e-8 * peak)
    assert np.abs(plain - wanted).max() > 1e-5 * peak  # what stiffening changes
    free = begun(raw | {"limits": {}})
    assert np.abs(rows(free.ready, marched(free, 8)[1].u) - wanted).max() > 0.05 * peak


def test_a_stop_that_is_met_at_the_end_of_a_step_leaves_the_next_what_it_can_take() -> None:
    """After 0.998 of a step: the rest of it ended with accelerations 1,000 times as large, h² a / 2 = 0.9 rad, so that
    iterations of the next steps found a linkage folded the other way, or none; with some processors' kernels."""
    of = begun(
        {
            **scenes.four_bar((0.1, 0.3, 0.25, 0.3), scenes.bar(model="beam"), scenes.constant_speed("300 rpm")),
            "limits": {"s": {"kind": "angle", "joint": "D", "upper": "5 deg", "stiffness": 2e3, "damping": 0.5}},
            "damping": {"beta": 1e-6},
            "analysis": {"revolutions": 3, "steps_per_revolution": 120, "rho_inf": 0.95, "frames": "co-rotational"},
        }
    )
    state, history = march(of.ready, of.state, of.steps(126), of.motion)
    assert history.e[-2, 0] < np.deg2rad(5.0) < history.e[-1, 0]
    assert 10.0 < state.e[1, 0] < 11.0
    assert np.abs(state.e[2]).max() < 2e3  # rad/s², 687; 6.7e5
