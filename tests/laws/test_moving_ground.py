"""Moving parts of the ground, rigid links without a shape that drives alone move: closed forms, inertia loads."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline

from kedfem.accuracy.damping import mass_damping_warning
from kedfem.accuracy.prepared import meshed
from kedfem.analysis import Run, analyse
from kedfem.errors import KedfemError
from kedfem.results import Results
from kedfem.scene import Polynomial, drive_angle, scene_from
from tests.laws.test_limits import AXES
from tests.laws.test_mechanisms import rod_between_balls
from tests.mechanisms import as_lists
from tests.moving import beam_in_space
from tests.partners import joint

Raw = dict[str, Any]
Vector = np.ndarray
M, K, C, G = 2.0, 2000.0, 8.0, 9.81  # of the block, its spring and damper; free fall
GROUND_MASS = 3.0
ALONG = np.array([0.05, 0, 0])
QUIET = {"plots": False, "picture": False, "animation": False}
EVERY = pytest.mark.parametrize(
    "axis", [pytest.param(axis, id=name, marks=[pytest.mark.long] if name in "yz" else []) for name, axis in AXES.items()]
)


def run(raw: Raw, folder: Path, **probes: Raw) -> Results:
    quick = {"accuracy": "quick", **raw["analysis"]}
    return analyse(scene_from({**raw, "analysis": quick, "output": {**QUIET, "probes": probes}}, folder)).results


def sprung(axis: Vector, motion: Raw, **analysis: Any) -> Raw:
    """A block on a guide along an axis, on a spring of a ground that moves along it."""
    at = 0.3 * axis
    shape = {"kind": "bar", "between": [at - ALONG, at + ALONG], "width": 0.1, "thickness": 0.1}
    return {
        "materials": {"m": {"density": M / 1e-3, "youngs_modulus": 2e11, "poisson_ratio": 0.3}},
        "links": {
            "road": {"model": "rigid", "mass": GROUND_MASS},
            "block": {"model": "rigid", "material": "m", "shape": shape},
        },
        "joints": {
            "lift": {"kind": "prismatic", "links": ["ground", "road"], "at": [0, 0, 0], "axis": axis},
            "guide": {
                "kind": "prismatic", "links": ["block", "ground"], "at": at - ALONG, "axis": axis,
            },
        },
        "springs": {
            "tyre": {
                "kind": "spring", "stiffness": K, "damping": C,
                "between": [{"link": "road", "at": [0, 0, 0]}, {"link": "block", "at": at}],
            }
        },
        "drive": {"joint": "lift", "motion": motion},
        "analysis": {"frames": "co-rotational", **analysis},
    }  # fmt: skip


def along(found: Results, axis: Vector, name: str = "block") -> Vector:
    return np.asarray(found.channels[f"probes/{name}/travel"][1] @ axis)


def travel(link: str, at: Any = (0, 0, 0)) -> Raw:
    return {"link": link, "at": at, "quantity": "travel"}


@EVERY
def test_a_swinging_ground_moves_a_block_by_its_transmissibility(axis: Vector, tmp_path: Path) -> None:
    """X/Y = (k + i c ω)/(k − m ω² + i c ω) about −m g/k; the drive bears spring, damper and its own mass."""
    f, Y = 4.0, 0.01
    raw = sprung(axis, {"kind": "harmonic", "travel": Y, "frequency": f, "phase": 0.4}, step=1 / (400 * f), kind="steady")
    found = run({**raw, "gravity": -G * axis}, tmp_path, block=travel("block", 0.3 * axis), road=travel("road"))
    w, y = 2 * np.pi * f, Y * np.exp(0.4j)
    x = y * (K + 1j * C * w) / (K - M * w**2 + 1j * C * w)
    force = M * -(w**2) * x + GROUND_MASS * -(w**2) * y
    turns = np.exp(1j * w * found.time)
    assert_allclose(along(found, axis, "road"), (y * turns - y).imag, atol=1e-12)
    assert_allclose(along(found, axis), (x * turns - y).imag - M * G / K, atol=3e-4 * abs(x))
    weight = (M + GROUND_MASS) * G
    tolerance = 5e-4 * abs(force)
    assert_allclose(found.channels["drive/force"][1][:, 0], (force * turns).imag + weight, atol=tolerance)


def test_a_half_sine_shock_moves_a_block_as_its_closed_form_says(tmp_path: Path) -> None:
    """Of y'' = a sin(π t/T) until T: with r = π/(ω T), x − y = −a/(ω² (1 − r²)) (sin π t/T − r sin ω t) until then."""
    T, a, axis = 0.1, 50.0, AXES["oblique"]
    t = np.linspace(0, T, 801)
    y = a * T / np.pi * (t - T / np.pi * np.sin(np.pi * t / T))
    motion = {"kind": "curve", "time": t, "value": y}
    raw = sprung(axis, motion, end_time=T, step=2.5e-4)
    raw["springs"]["tyre"]["damping"] = 0.0
    found = run(raw, tmp_path, block=travel("block", 0.3 * axis), road=travel("road"))
    w = np.sqrt(K / M)
    r = np.pi / (w * T)
    z = -a / (w**2 * (1 - r**2)) * (np.sin(np.pi * found.time / T) - r * np.sin(w * found.time))
    assert_allclose(along(found, axis) - along(found, axis, "road"), z, atol=2e-4 * np.abs(z).max())


def test_damping_by_mass_of_what_moves_freely_is_told_with_what_it_takes(tmp_path: Path) -> None:
    """The block loses α ∫ m v² dt, of the largest energy exchanged, and 1 − exp(−α T) of its speed were it alone."""
    axis, alpha, T = AXES["oblique"], 3.0, 0.5
    motion = {"kind": "harmonic", "travel": 0.01, "frequency": 4.0}
    raw = sprung(axis, motion, end_time=T, step=1e-3, accuracy="quick")
    raw["output"] = {**QUIET, "probes": {"block": travel("block", 0.3 * axis)}}

    def told(damping: Raw) -> tuple[Run, list[str]]:
        done = analyse(scene_from({**raw, "damping": damping}, tmp_path))
        return done, [text for text in done.warnings if text.startswith("damping: alpha")]

    done, warnings = told({"alpha": alpha, "beta": 1e-5})
    assert done.balance is not None
    rows = {name: x for name, (_, x) in done.results.channels.items()}
    t = done.results.time
    v = CubicSpline(t, along(done.results, axis))(t, 1)
    taken = alpha * M * trapezoid(v**2, t)
    change = rows["energy/kinetic"] - rows["energy/kinetic"][0] + rows["energy/strain"] - rows["energy/strain"][0]
    exchanged = max(
        np.abs(x).max() for x in (change, rows["energy/strain"], rows["energy/work"], rows["energy/dissipated"])
    )
    assert done.balance.mass_damping == pytest.approx(taken / exchanged, rel=1e-3)
    (said,) = warnings
    assert f"they lose {100 * (1 - np.exp(-alpha * T)):.2g} % of their speed in the 0.5 s" in said
    assert f"it took {100 * taken / exchanged:.2g} % of the largest energy exchanged" in said
    assert "take beta = 1e-05 [s] alone" in said
    assert "links block as" in said
    ready = meshed(scene_from({**raw, "damping": {"alpha": alpha}}))
    (beforehand,) = mass_damping_warning(ready)  # of a check
    assert "it took" not in beforehand
    spinning = meshed(scene_from({**rod_between_balls(), "damping": {"alpha": alpha}}))
    assert spinning.linkage.mobility == 1
    assert mass_damping_warning(spinning) == ()
    assert not told({"beta": 1e-5})[1]
    assert not told({"alpha": 0.01})[1]  # takes half a percent of a speed


@EVERY
def test_a_static_analysis_lifts_a_block_with_its_ground(axis: Vector, tmp_path: Path) -> None:
    """x = y − m g/k, and the drive bears both weights."""
    rise = {"kind": "cycloidal", "travel": 0.2, "rise": 1.0}
    raw = sprung(axis, rise, kind="static", end_time=1.0, step=0.25)
    found = run({**raw, "gravity": -G * axis}, tmp_path, block=travel("block", 0.3 * axis), road=travel("road"))
    assert_allclose(along(found, axis), along(found, axis, "road") - M * G / K, atol=1e-9)
    assert_allclose(found.channels["drive/force"][1][:, 0], (M + GROUND_MASS) * G, rtol=1e-8)


RISE = {"kind": "polynomial", "order": 7, "rise": 0.05, "return_time": 0.04}
STEPS, END = 200, 0.1


def shaken(raw: Raw, axis: Vector, height: float) -> Raw:
    """The same scene on a ground that moves as a whole: all its joints with the ground are with a moving one."""
    joints = {
        name: {**joint, "links": ["table" if x == "ground" else x for x in joint["links"]]}
        for name, joint in raw["joints"].items()
    }
    shake = {"kind": "prismatic", "links": ["ground", "table"], "at": [0, 0, 0], "axis": axis}
    table = {"joint": "shake", "motion": {**RISE, "travel": height}}
    drives = {"own": raw["drive"], "shake": table} if "drive" in raw else {"shake": table}
    rest = {key: value for key, value in raw.items() if key != "drive"}
    links = {**raw["links"], "table": {"model": "rigid"}}
    return {**rest, "links": links, "joints": {**joints, "shake": shake}, "drives": drives}


def pushed(raw: Raw, axis: Vector, height: float) -> Raw:
    """The same scene at rest under body loads −ρ a(t), given at all time points; a drive that rests if it had none."""
    t = np.linspace(0, END, STEPS + 1)
    a = drive_angle(Polynomial(**RISE, travel=height), t)[2]
    factor = {"time": t, "value": a}
    loads = {name: {"kind": "body", "link": name, "vector": -7850.0 * axis, "factor": factor} for name in raw["links"]}
    return {**(raw if "drive" in raw else shaken(raw, axis, 1e-12)), "loads": loads}


def cantilever() -> Raw:
    """Welded at one end, on a ball at a third of its length."""
    line = {"kind": "polyline", "points": [[0, 0, 0], [0.1, 0, 0], [0.3, 0.05, 0.1]]}
    section = {"kind": "rectangle", "width": 0.006, "thickness": 0.004}
    beam = {"model": "beam", "material": "steel", "shape": {**line, "section": section}, "mesh": {"elements": 4}}
    return {
        "links": {"beam": beam},
        "joints": {
            "foot": {"kind": "weld", "links": ["ground", "beam"], "at": [0, 0, 0]},
            "ball": {"kind": "spherical", "links": ["beam", "ground"], "at": [0.1, 0, 0]},
        },
    }


def four_bar() -> Raw:
    A, B, C_, D = [0, 0], [0.03, 0.05], [0.2, 0.12], [0.22, 0]
    bar = {"model": "beam", "material": "steel", "mesh": {"elements": 3}}
    ends = {"crank": (A, B), "coupler": (B, C_), "rocker": (C_, D)}
    names = [["crank", "ground"], ["crank", "coupler"], ["coupler", "rocker"], ["rocker", "ground"]]
    return {
        "links": {
            name: {**bar, "shape": {"kind": "bar", "between": list(both), "width": 0.006, "thickness": 0.006}}
            for name, both in ends.items()
        },
        "joints": {
            letter: {"kind": "revolute", "links": names[k], "at": at}
            for k, (letter, at) in enumerate(zip("ABCD", (A, B, C_, D), strict=True))
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 20.0}},
    }


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize(
    ("raw", "link", "at", "axis"),
    [
        (cantilever(), "beam", [0.3, 0.05, 0.1], AXES["oblique"]),
        (four_bar(), "coupler", [0.2, 0.12], np.array([0.6, 0.8, 0])),
    ],
    ids=["cantilever", "four-bar"],
)  # fmt: skip
def test_a_ground_that_moves_as_a_whole_is_inertia_loads(
    raw: Raw, link: str, at: Any, axis: Vector, frames: str, tmp_path: Path
) -> None:
    """Seen from a ground that accelerates by a, all masses bear −m a: motions and forces are the same."""
    analysis = {"end_time": END, "step": END / STEPS, "frames": frames}
    height, ground = 0.02, travel("table")
    tip = {"link": link, "at": at, "quantity": "travel"}
    moved = run({**shaken(raw, axis, height), "analysis": analysis}, tmp_path, tip=tip, table=ground)
    still = run({**pushed(raw, axis, height), "analysis": analysis}, tmp_path, tip=tip)
    x, y, shift = (found.channels[f"probes/{name}/travel"][1] for found, name in
                   ((moved, "tip"), (still, "tip"), (moved, "table")))  # fmt: skip
    shift = shift[:, : x.shape[1]]
    assert_allclose(x - shift, y, atol=1e-7 * np.abs(shift).max())
    for name in raw["joints"]:
        forces = [found.channels[f"joints/{name}/force"][1] for found in (moved, still)]
        assert_allclose(*forces, atol=1e-6 * np.abs(forces[1]).max())


KINDS = ("revolute", "spherical", "universal", "prismatic", "cylindrical", "screw", "planar", "weld")


@pytest.mark.parametrize("kind", [pytest.param(x, marks=[] if x == "prismatic" else pytest.mark.long) for x in KINDS])
def test_a_steady_acceleration_of_the_ground_is_a_gravity(kind: str, tmp_path: Path) -> None:
    """−a beside it, on a beam in space that any joint holds: the forces are the same, its travel but for the ground's."""
    a, end, axis, step = 50.0, 4e-3, AXES["oblique"], 2e-4
    tip = np.array([0.1, 0.05, 0.02])
    raw: Raw = {
        "links": {"beam": beam_in_space([0, 0, 0], tip.tolist(), 1)},
        "joints": {"A": as_lists(joint(kind, ("beam", "ground"), np.zeros(3), np.array([0.3, 0.5, -0.8])))},
        "analysis": {"end_time": end, "step": step, "rho_inf": 0.8, "initial": "rest", "frames": "co-rotational"},
    }
    moved = shaken(raw, axis, 0.0)
    moved["drives"]["shake"]["motion"] = {"kind": "ramp", "shape": "linear", "speed": 2 * a * end, "time": 2 * end}
    at = {"tip": travel("beam", tip.tolist())}
    shaking, still = run(moved, tmp_path, **at), run({**raw, "gravity": (-a * axis).tolist()}, tmp_path, **at)
    shift = np.multiply.outer(0.5 * a * still.time**2, axis)
    x, y = (found.channels["probes/tip/travel"][1] for found in (shaking, still))
    assert_allclose(x - shift, y, atol=1e-6 * np.abs(y).max())
    for name in ("joints/A/force", "joints/A/moment"):
        one, other = (found.channels[name][1] for found in (shaking, still))
        assert_allclose(one, other, atol=max(1e-6 * np.abs(other).max(), 1e-12))


def test_grounds_on_grounds_bear_centrifugal_and_coriolis_forces(tmp_path: Path) -> None:
    """A mass that slides out on a turntable about any axis: m (r'' − r ω²) along, torque m r² α + 2 m r r' ω."""
    m, axis, out = 4.0, np.array([2.0, 1.0, 2.0]) / 3, np.array([1.0, -2.0, 0.0]) / np.sqrt(5)
    bar = {"kind": "bar", "between": [[0, 0, 0], [0.1, 0, 0]], "width": 0.02, "thickness": 0.02}
    raw = {
        "links": {
            "turntable": {"model": "rigid"}, "sledge": {"model": "rigid", "mass": m},
            "stub": {"model": "beam", "material": "steel", "shape": bar},
        },
        "joints": {
            "turn": {"kind": "revolute", "links": ["ground", "turntable"], "at": [0.5, 0, 0], "axis": axis},
            "way": {"kind": "prismatic", "links": ["sledge", "turntable"], "at": [0.5, 0, 0] + 0.2 * out, "axis": out},
            "foot": {"kind": "weld", "links": ["ground", "stub"], "at": [0, 0, 0]},
        },
        "drives": {
            "turn": {"joint": "turn", "motion": {"kind": "harmonic", "angle": 2.0, "frequency": 1.5}},
            "out": {"joint": "way", "motion": {"kind": "harmonic", "travel": 0.1, "frequency": 2.0, "phase": 1.0}},
        },
        "analysis": {"end_time": 0.5, "step": 0.01},
    }  # fmt: skip
    found = run(raw, tmp_path)
    w, v = 2 * np.pi * 1.5, 2 * np.pi * 2.0
    t = found.time
    r, r1, r2 = (
        0.2 + 0.1 * (np.sin(v * t + 1) - np.sin(1)),
        0.1 * v * np.cos(v * t + 1),
        -0.1 * v**2 * np.sin(v * t + 1),
    )
    omega, alpha = 2 * w * np.cos(w * t), -2 * w**2 * np.sin(w * t)
    force = m * (r2 - r * omega**2)
    torque = m * r**2 * alpha + 2 * m * r * r1 * omega
    for kind in ("", "rigid_"):
        assert_allclose(found.channels[f"drive/way/{kind}force"][1][:, 0], force, atol=1e-9 * np.abs(force).max())
        assert_allclose(found.channels[f"drive/turn/{kind}torque"][1][:, 0], torque, atol=1e-9 * np.abs(torque).max())


def test_what_no_drive_moves_alone_is_no_ground(tmp_path: Path) -> None:
    """A rigid link without a shape that another joint holds too, or whose joint is no drive's."""
    raw = sprung(AXES["y"], {"kind": "cycloidal", "travel": 0.1, "rise": 1.0}, end_time=1.0, step=0.1)
    held = {**raw["joints"], "other": {"kind": "revolute", "links": ["road", "ground"], "at": [1, 0, 0]}}
    idle = {**raw["joints"], "lift": {"kind": "revolute", "links": ["ground", "road"], "at": [0, 0, 0]}}
    for joints, drive in ((held, raw["drive"]), (idle, {**raw["drive"], "joint": "guide"})):
        with pytest.raises(KedfemError, match=r"links\.road|joints\.lift"):
            analyse(scene_from({**raw, "joints": joints, "drive": drive, "output": QUIET}, tmp_path))
    assert not any(tmp_path.iterdir())
