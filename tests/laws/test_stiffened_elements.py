"""Geometric stiffening by the forces of springs and motors: beams under tension and compression, other frames, turns.

A cantilever under a pull N at its tip, towards a point on its axis at the distance ℓ from there, has
EI w'''' − N w'' = ρA ω² w and EI w''' − N w' = N w/ℓ at the tip; a force F across it deflects the tip by w, with
F/w = N k/(k L − tanh k L) + N/ℓ, k² = N/EI.
"""

from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.modes.frozen import Frozen
from kedfem.dynamics.modes.stiffened import Stiffened, frozen_linkage
from kedfem.dynamics.rigid_elements import rigid_elements
from kedfem.dynamics.system.build import system_of
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from
from tests.laws.test_stiffened import AXES, UNIT, Raw, arm
from tests.laws.test_stiffened_joints import assert_stresses_turn, fast
from tests.moving import bar, channels, ran
from tests.partners import axis_of, chain
from tests.verification.stiffening import HEIGHT, LENGTH, RUBBER

EI = RUBBER.youngs_modulus * HEIGHT**4 / 12
#: kind of link and its direction
ARMS = [("planar beam", "z"), ("plane", "z"), *((kind, turn) for kind in ("spatial beam", "solid") for turn in AXES)]
DEAR = [x if x[1] == "oblique" or x[0] == "planar beam" else pytest.param(*x, marks=pytest.mark.long) for x in ARMS]
PULLS = (1.5, -1.2)  # N L²/EI; a column on its foot buckles at −2.47


def pulled(kind: str, turn: str, pull: float, apart: float, **analysis: Any) -> Raw:
    """An arm at rest whose tip is pulled along its axis, towards a point at a distance of so many lengths."""
    raw = arm(kind, 1e-9, turn)
    along = Rotation.from_rotvec(AXES[turn]).as_matrix()[:, 0][: 2 if kind in ("planar beam", "plane") else 3]
    ends = [{"link": "arm", "at": (LENGTH * along).tolist()},
            {"link": "ground", "at": ((1 + apart) * LENGTH * along).tolist()}]  # fmt: skip
    raw["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": 1e-9, "preload": pull * EI / LENGTH**2}}
    raw["output"] = {"probes": {"tip": {"quantity": "displacement", "link": "arm", "at": ends[0]["at"]}}}
    raw["analysis"] |= analysis
    return raw


def pulled_frequency(n: float, apart: float) -> float:
    """The first ω √(ρA L⁴/EI) of the cantilever."""

    def determinant(w: float) -> float:
        r = np.sqrt(n**2 + 4 * w**2)
        a, b = np.sqrt((r + n) / 2), np.sqrt((r - n) / 2)
        C, S, c, s = np.cosh(a), np.sinh(a), np.cos(b), np.sin(b)
        value, slope = (C - c, S - a / b * s), (a * S + b * s, a * (C - c))
        second = (a**2 * C + b**2 * c, a**2 * S + a * b * s)
        third = (a**3 * S - b**3 * s, a**3 * C + a * b**2 * c)
        shear = [third[i] - n * slope[i] - n / apart * value[i] for i in (0, 1)]
        return float(second[0] * shear[1] - second[1] * shear[0])

    return float(brentq(determinant, 0.5, 8.0))


@pytest.mark.parametrize("pull", PULLS)
@pytest.mark.parametrize(("kind", "turn"), DEAR)
def test_a_pulled_cantilever_has_the_frequency_of_a_beam_column(kind: str, turn: str, pull: float) -> None:
    scene = scene_from(pulled(kind, turn, pull, 2.0))
    ready, t = meshed(scene), np.zeros(1)
    motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(scene, t))
    system = system_of(scene, ready.linkage, ready.path)
    solver = frozen_linkage(scene, system, ready.linkage, ready.path, 2, False)
    assert isinstance(solver, Stiffened)
    found = solver.at(motion).omega[0] / UNIT
    assert_allclose(found, pulled_frequency(pull, 2.0), rtol=4e-3)  # shear takes 0.15 to 0.3 %
    loose = Frozen(system, 1).at(motion).omega[0] / UNIT
    assert abs(found / loose - 1) > 0.3


HOW = ("start", "static", "quasi-static", "plucked")


@pytest.mark.parametrize("pull", PULLS)
@pytest.mark.parametrize(
    ("kind", "turn", "how"),
    [(*x, how) if x in (("planar beam", "z"), ("solid", "oblique")) else pytest.param(*x, how, marks=pytest.mark.long)
     for x in ARMS for how in HOW],
)  # fmt: skip
def test_a_pulled_cantilever_has_the_deflection_of_a_beam_column(kind: str, turn: str, how: str, pull: float) -> None:
    """Under a load: where a march begins, which stays there, and in static and quasi-static positions; and where forces
    let it go."""
    step = 0.01 / UNIT
    raw = pulled(kind, turn, pull, 40.0, initial="quasi-static", end_time=20 * step, step=step)
    for key in ("revolutions", "steps_per_revolution"):
        del raw["analysis"][key]
    R, at = Rotation.from_rotvec(AXES[turn]).as_matrix(), raw["output"]["probes"]["tip"]["at"]
    force = 1e-6 * EI / LENGTH**2
    vector = (force * R[: len(at), 1]).tolist()
    if how == "plucked":
        raw["analysis"]["initial_deflection"] = {"f": {"link": "arm", "at": at, "force": vector}}
    else:
        raw["loads"] = {"f": {"kind": "force", "link": "arm", "at": at, "vector": vector}}
    if how in ("static", "quasi-static"):
        del raw["analysis"]["initial"]
        raw["analysis"]["kind"] = how
    w = channels(*ran(raw))["probes/tip/displacement"][:, 1]
    N, kL = pull * EI / LENGTH**2, np.sqrt(complex(pull))
    stiffness = (N / LENGTH * kL / (kL - np.tanh(kL))).real + N / (40 * LENGTH)
    assert_allclose(w[0], force / stiffness, rtol=4e-3)  # shear adds 0.1 to 0.3 %
    if how == "plucked":
        assert w[-1] < 0.99 * w[0]
    else:
        assert np.ptp(w) < 1e-3 * w[0]


def spring_chain(partners: tuple[str, str], law: str, turn: Any, on: bool = True) -> Raw:
    """A chain in space whose crank a preloaded spring pulls, or whose joint a torque drives."""
    raw = fast(chain("revolute", partners, False, False, turn), on, 3.0)
    crank = next(x for name, x in raw["joints"].items() if name != "A" and "crank" in x["links"])["at"]
    away = [x + y for x, y in zip(crank, turn(axis_of("revolute", partners)) @ [0.1, 0.3, 0.2], strict=True)]
    ends = [{"link": "crank", "at": crank}, {"link": "ground", "at": away}]
    if law == "spring":
        raw["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": 1e4, "preload": 2e3}}
    else:
        raw["springs"] = {"s": {"kind": "torsion", "joint": "J", "stiffness": 10.0, "preload": 20.0}}
    return raw


@pytest.mark.parametrize("law", ["spring", "torsion"])
@pytest.mark.parametrize("partners", [("beam", "beam"), ("solid", "solid")])
def test_stresses_of_springs_turn_with_the_scene(partners: tuple[str, str], law: str) -> None:
    """Along x, y, z and askew; and they matter."""
    assert_stresses_turn(partial(spring_chain, partners, law), axis_of("revolute", partners))


def swung(size: float, **analysis: Any) -> Raw:
    """A four-bar of thin beams whose rocker a spring pulls along."""
    places = {"A": (0, 0), "B": (0.1, 0), "C": (0.4, 0.3), "D": (0.4, -0.1)}
    pairs = {"crank": "AB", "coupler": "BC", "rocker": "CD"}
    links = {name: bar("beam", *(places[end] for end in ends), 4) for name, ends in pairs.items()}
    for link in links.values():
        link["shape"] |= {"width": 0.006, "thickness": 0.006}
    held = {"A": ("ground", "crank"), "B": ("crank", "coupler"), "C": ("coupler", "rocker"), "D": ("rocker", "ground")}
    joints = {name: {"kind": "revolute", "links": list(held[name]), "at": list(at)} for name, at in places.items()}
    ends = [{"link": "rocker", "at": [0.4, 0.3]}, {"link": "ground", "at": [0.45, 0.9]}]
    springs = {"s": {"kind": "spring", "between": ends, "stiffness": 400.0 * size, "preload": 600.0 * size}}
    return {
        "links": links, "joints": joints, "springs": springs, "damping": {"beta": 2e-5},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 20.0}},
        "analysis": {"end_time": 0.1, "step": 2e-4, "initial": "quasi-static", **analysis},
        "output": {"probes": {"m": {"quantity": "displacement", "link": "rocker", "at": [0.4, 0.1]}}},
    }  # fmt: skip


@pytest.mark.long
def test_stiffening_by_a_spring_takes_most_of_what_the_linear_equation_is_off_by() -> None:
    """From co-rotational frames, which know all of it: 1 to 8 % of it is left at a pull of half the buckling load and
    less, and falls with the pull."""
    left, frames = [], (("rigid-body", False), ("rigid-body", True), ("co-rotational", False))
    for size in (0.25, 1.0):
        found = [channels(*ran(swung(size, frames=each, stiffening=on))) for each, on in frames]
        for name in ("probes/m/displacement", "joints/B/force", "joints/D/force", "drive/torque"):
            linear, stiffened = (np.abs(x[name] - found[2][name]).max() for x in found[:2])
            assert stiffened < 0.12 * linear
        name = "probes/m/displacement"
        left.append(float(np.abs(found[1][name] - found[2][name]).max() / np.abs(found[2][name]).max()))
    assert left[1] < 6e-3
    assert 2.0 < left[1] / left[0] < 20.0


def test_rotations_of_hinges_are_counted_at_any_time_as_in_order() -> None:
    """Over revolutions ahead and back, with a crank that turns on and a coupler that turns back and forth."""
    raw = swung(1.0)
    raw["springs"] = {
        name: {"kind": "torsion", "joint": name, "stiffness": 2.0, "damping": 0.1} for name in ("A", "B", "D")
    }
    for speed in (20.0, -20.0):
        raw["drive"]["motion"]["speed"], raw["analysis"]["end_time"] = speed, 1.0
        scene = scene_from(raw)
        ready, t = meshed(scene), np.linspace(0.0, 1.0, 501)
        elements = rigid_elements(scene, ready.linkage, ready.path)
        assert elements is not None
        motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(scene, t))
        in_order = [m for _, _, m in elements.wrenches(motion)]
        for k in (0, 170, 333, 500):
            alone = [m[0] for _, _, m in elements.wrenches(motion.part(k, k + 1))]
            assert_allclose(alone, [m[k] for m in in_order], rtol=1e-12, atol=1e-12)
        crank = ready.linkage.bodies.index("crank")
        moment = next(m for body, _, m in elements.wrenches(motion) if body == crank)
        assert_allclose(moment[:, 2], -2.0 * motion.phi - 0.1 * speed, rtol=1e-9)
