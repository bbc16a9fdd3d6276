"""Hard cases of whole mechanisms: closed forms, kedfem's monolithic solver, or a like mechanism show what is right."""

from typing import Any

import numpy as np

from kedfem.accuracy.histories import Histories, histories
from kedfem.accuracy.prepared import meshed
from kedfem.motion.linkage import linkage
from kedfem.scene import scene_from
from tests.linkages import Z, body, cardan, four_bar, linkage_scene, motion_at, place, turned
from tests.moving import inverted
from tests.rooms.test_dynamics import four_bar as elastic_four_bar

from .cases import Outcome, Right, case, refused

UP = np.array(Z)
Joints = dict[str, tuple[Any, ...]]


def run(raw: dict[str, Any]) -> Histories:
    """All channels of a scene."""
    return histories(meshed(scene_from(raw)))


def apart(one: Histories, other: Histories, name: str) -> float:
    """Largest difference of a channel, of its largest value."""
    x, y = (found.channels[name][1] for found in (one, other))
    return float(np.abs(x - y).max() / np.abs(y).max())


def largest(found: Histories, name: str) -> float:
    """Largest value of a channel."""
    return float(np.abs(found.channels[name][1]).max())


@case("Parallelogram through its change points")
def change_points() -> list[Outcome]:
    """Crank and rocker of one length, coupler and frame likewise: at 0° and 180° all links lie in a line, where it may go
    on as a parallelogram or crossed over. A second coupler a quarter of a revolution on, as on a locomotive, leaves one
    way.
    """
    single = four_bar(0.3, 0.9, 0.3, 0.9, np.radians(60))
    t = np.linspace(np.radians(-59), np.radians(119), 90)
    scene = linkage_scene(single)
    between = motion_at(scene, t)
    coupler = np.abs(between.R[:, body(scene, "coupler")] - np.eye(3)).max()
    wheels = coupled_wheels()
    revolutions = np.linspace(0, 4 * np.pi, 721)
    doubled = linkage_scene(wheels)
    found = motion_at(doubled, revolutions)
    off = turned(found, body(doubled, "rocker"), UP) - revolutions
    return [
        refused("one coupler, through them", lambda: motion_at(scene, np.linspace(0, 2.2, 90)), "in two ways"),
        Right("one coupler, up to 1° before them: the coupler's turn", float(coupler), 1e-12),
        Right("two couplers, two revolutions: the wheels turn alike [rad]", float(np.abs(off).max()), 1e-12),
    ]


def coupled_wheels() -> Joints:
    """Two wheels with two coupling rods, a quarter of a revolution apart."""
    joints: Joints = dict(four_bar(0.3, 0.9, 0.3, 0.9, np.radians(60)))
    across = 0.3 * np.array([np.cos(np.radians(150)), np.sin(np.radians(150)), 0.0])
    joints["E"] = ("revolute", "crank", "rod", across, Z)
    joints["F"] = ("revolute", "rod", "rocker", across + np.array([0.9, 0.0, 0.0]), Z)
    return joints


@case("Within 0.1° of a dead point")
def near_dead_point() -> list[Outcome]:
    """A four-bar whose coupler and rocker come to 0.1° of one line: the smallest singular value falls to 1e-3, the rocker
    turns round within a degree of the crank, and rounding errors grow by the square.
    """
    b, c, d, bend = 0.6, 0.5, 0.8, np.radians(0.1)
    a = float(np.sqrt(b**2 + c**2 + 2 * b * c * np.cos(bend)) - d)  # the diagonal at 180° leaves this triangle
    t = np.linspace(0, 2 * np.pi, 1441)
    scene = linkage_scene(four_bar(a, b, c, d, 0.6))
    got = turned(motion_at(scene, t), body(scene, "rocker"), UP)
    x, y = a * np.cos(0.6 + t) - d, a * np.sin(0.6 + t)
    s = np.hypot(x, y)
    wanted = np.unwrap(np.arctan2(y, x) - np.arccos(np.clip((c**2 + s**2 - b**2) / (2 * c * s), -1, 1)))
    error = np.abs((got - got[0]) - (wanted - wanted[0])).max()
    beyond = linkage_scene(four_bar(a + 0.001, b, c, d, 0.6))
    return [
        Right("passing it: the rocker's angle [rad]", float(error), 1e-8),
        refused("1 mm longer: the crank cannot turn", lambda: motion_at(beyond, t), "it locks (dead point)"),
    ]


@case("Cardan joint between shafts almost parallel, and almost at right angles")
def cardan_joints() -> list[Outcome]:
    """tan φ2 = tan φ1 / cos β for a fork drawn in the plane of the shafts. Parallel shafts leave one of the joint's
    equations without effect; at 90° it cannot turn.
    """
    outcomes: list[Outcome] = []
    t = np.linspace(0, 2 * np.pi, 361)
    for angle, tolerance in ((0.0, 1e-12), (1e-3, 1e-12), (60.0, 1e-12), (89.0, 1e-9)):
        beta = np.radians(angle)
        scene = linkage_scene(cardan(beta))
        out = np.array([np.cos(beta), np.sin(beta), 0.0])
        got = turned(motion_at(scene, t), body(scene, "shaft2"), out)
        wanted = np.unwrap(np.arctan2(np.sin(t), np.cos(t) * np.cos(beta)))
        error = float(np.abs(got - wanted).max())
        outcomes.append(Right(f"shafts at {angle:g}°, one revolution: the output's angle [rad]", error, tolerance))
    square = linkage_scene(cardan(np.radians(90.0)))
    return [*outcomes, refused("shafts at 90°", lambda: motion_at(square, t), "joints.")]


@case("Redundant joints everywhere")
def redundant() -> list[Outcome]:
    """A parallelogram with a second coupler, every hinge drawn twice along its axis: the motion is that of the first."""
    plain = four_bar(0.3, 0.9, 0.3, 0.9, np.radians(60))
    many: Joints = dict(coupled_wheels())
    for name, (kind, one, other, at, axis) in tuple(many.items()):
        many[f"{name}2"] = (kind, one, other, at + 0.1 * UP, axis)
    t = np.linspace(0, 1.8, 91)
    scenes = [linkage_scene(joints) for joints in (many, plain)]
    got, wanted = (place(motion_at(scene, t), body(scene, "coupler"), np.array([0.5, 0.4, 0.0]))[2] for scene in scenes)
    count = len(linkage(scenes[0]).redundant)
    return [
        Right("accelerations of the coupler [m/s²]", float(np.abs(got - wanted).max()), 1e-10),
        Right("joints named as redundant: all but a tree's, short of", float(max(0, 6 - count)), 0.0),
    ]


@case("Mass ratio of a million between neighbours")
def mass_ratio() -> list[Outcome]:
    """[KED]'s four-bar with a coupler a million times as light, or as heavy, as its neighbours; 60 rpm, one revolution.
    The monolithic solver, which factors the whole assembled system at each step, shows what is right.
    """
    outcomes: list[Outcome] = []
    for factor in (1e-6, 1e6):
        raw = elastic_four_bar("beam", revolutions=1, steps_per_revolution=180, rho_inf=0.9)
        raw["drive"]["motion"]["speed"] = "60 rpm"
        raw["materials"]["other"] = {**raw["materials"]["alloy"], "density": 2796 * factor}
        raw["links"]["coupler"]["material"] = "other"
        fast, monolithic = (
            run({**raw, "analysis": {**raw["analysis"], "solver": x}}) for x in ("condensed", "monolithic")
        )
        what = f"coupler's density × {factor:g}: torque, fast against monolithic steps"
        outcomes.append(Right(what, apart(fast, monolithic, "drive/torque"), 1e-6))
    return outcomes


@case("Stiffness ratio of a million between neighbours")
def stiffness_ratio() -> list[Outcome]:
    """[KED]'s four-bar with a coupler a million times as stiff as its neighbours: it moves as a rigid link does."""
    raw = elastic_four_bar("beam", revolutions=1, steps_per_revolution=720, rho_inf=0.9, initial="quasi-static")
    raw["damping"] = {"alpha": 0.5}
    raw["drive"]["motion"]["speed"] = "60 rpm"
    raw["materials"]["stiff"] = {"density": 2796, "youngs_modulus": 7.031e16, "shear_modulus": 2.712e16}
    raw["links"]["coupler"]["material"] = "stiff"
    fast = run(raw)
    monolithic = run({**raw, "analysis": {**raw["analysis"], "solver": "monolithic"}})
    shape = raw["links"]["coupler"]["shape"]
    raw["links"]["coupler"] = {"model": "rigid", "material": "stiff", "shape": shape}
    rigid = run(raw)
    return [
        Right("torque, fast against monolithic steps", apart(fast, monolithic, "drive/torque"), 1e-5),
        Right("torque against that with a rigid coupler", apart(fast, rigid, "drive/torque"), 1e-4),
    ]


@case("A slot whose direction varies in time", long=True)
def turning_rows() -> list[Outcome]:
    """An index-3 constraint: a pin slides along an elastic arm that it turns, 100,000 undamped steps. What one step
    cannot resolve must neither grow nor swing from step to step in the joint's force.
    """
    outcomes: list[Outcome] = []
    for rho_inf in (0.5, 0.95):
        raw = inverted("beam", "slot", revolutions=278, steps_per_revolution=360, rho_inf=rho_inf)
        force = run(raw).channels["joints/S/force"][1][1:].reshape(278, 360, -1)
        size = float(np.abs(force[9]).max())
        grown = float(np.abs(force[-1]).max()) / size - 1
        swing = np.abs(np.diff(force[-1], n=4, axis=0)).max() / 16 / size  # of ±1 from step to step: 1
        outcomes += [
            Right(f"ρ∞ = {rho_inf}: the force in revolution 278 above that in revolution 10", abs(grown), 1e-4),
            Right(f"ρ∞ = {rho_inf}: its swing from step to step", float(swing), 1e-5),
        ]
    raw = inverted("beam", "slot", rho_inf=1.0)
    return [*outcomes, refused("ρ∞ = 1", lambda: scene_from(raw), "analysis.rho_inf")]


@case("Ten thousand revolutions", long=True)
def many_turns() -> list[Outcome]:
    """The linkage must not drift off its joints, nor the elastic motion off its cycle."""
    lengths, last = (0.3048, 0.9144, 0.762, 0.9144), 20000 * np.pi
    t = np.concatenate([[0.0], last - np.linspace(2 * np.pi, 0, 721)])
    scene = linkage_scene(four_bar(*lengths, 1.0), end_time=last)
    got = turned_once(motion_at(scene, t), body(scene, "rocker"))
    phase = 1.0 + np.mod(t, 2 * np.pi)
    x, y = 0.3048 * np.cos(phase) - 0.9144, 0.3048 * np.sin(phase)
    s = np.hypot(x, y)
    wanted = np.arctan2(y, x) - np.arccos((0.762**2 + s**2 - 0.9144**2) / (2 * 0.762 * s))
    drift = np.angle(np.exp(1j * ((got - got[0]) - (wanted - wanted[0]))))
    raw = elastic_four_bar("beam", revolutions=10_000, steps_per_revolution=60, rho_inf=0.8)
    raw["drive"]["motion"]["speed"] = "60 rpm"
    raw["damping"] = {"alpha": 0.0, "beta": 1e-4}
    torque = run(raw).channels["drive/torque"][1][1:, 0].reshape(10_000, 60)
    change = float(np.abs(torque[-1] - torque[99]).max() / np.abs(torque[99]).max())
    return [
        Right("rocker's angle in the last revolution, from the closed form [rad]", float(np.abs(drift).max()), 2e-11),
        Right("drive's torque in revolution 10,000 against revolution 100", change, 1e-9),
    ]


def turned_once(motion: Any, number: int) -> np.ndarray:
    """Angle about z within a revolution."""
    return np.asarray(np.arctan2(motion.R[:, number, 1, 0], motion.R[:, number, 0, 0]))
