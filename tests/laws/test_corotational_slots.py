"""Pins in slots of links with co-rotational frames: where they are follows from the links as they bend and turn."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from kedfem.errors import SolveError
from tests.moving import bar, channels, ran, state, turned
from tests.spatial_joints import slotted
from tests.systems import against_oracle, begun

Raw = dict[str, Any]
G, SECTION, RHO = 9.81, 0.03 * 0.02, 7850.0  # m/s², of `bar` [m²], of steel [kg/m³]
LOW, HIGH, START = 0.0, 0.6, 0.2  # ends of the arm, and where the bead begins [m]


def bead_on_an_arm(model: str = "rigid", torque: float = 0.0, stiffness: float = 0.0, **analysis: Any) -> Raw:
    """An arm about A, let go when it is level, and a bead that slides along it: a rod whose middle is the pin.

    Parameters
    ----------
    torque : of a motor at A [N m]; stiffness : of a spring from A to the bead, at rest at first [N/m]
    """
    more: Raw = {}
    if torque:
        more["motors"] = {"m": {"joint": "A", "torque": {"over": "time", "at": [0.0], "value": [torque]}}}
    if stiffness:
        ends = [{"link": "bead", "at": [START, 0]}, {"link": "ground", "at": [0, 0]}]
        more["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": stiffness}}
    return {
        "links": {"bead": bar("beam", (START, -0.02), (START, 0.02), 2), "arm": bar(model, (LOW, 0), (HIGH, 0), 8)},
        "joints": {
            "A": {"kind": "revolute", "links": ["arm", "ground"], "at": [0, 0]},
            "S": {"kind": "slot", "links": ["bead", "arm"], "at": [START, 0], "axis": "x"},
        },
        "gravity": [0, -G],
        "analysis": {"end_time": 0.3, "step": 1e-3, "rho_inf": 0.8, "initial": "quasi-static", **analysis},
        "output": {"probes": {"pin": {"link": "bead", "at": [START, 0], "quantity": "travel"}}},
        **more,
    }


def falling(t: np.ndarray, torque: float = 0.0, stiffness: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The bead's path (T, 2), the arm's angle and the force across it on the bead: Lagrange's equations of r and φ."""
    m, M, L = RHO * SECTION * 0.04, RHO * SECTION * (HIGH - LOW), HIGH - LOW
    d = (HIGH + LOW) / 2
    J = M * ((L**2 + 0.03**2) / 12 + d**2)

    def second(r: Any, r1: Any, phi: Any, phi1: Any) -> tuple[Any, Any]:
        pull = stiffness / m * (r - START)
        moment = torque - (M * d + m * r) * G * np.cos(phi) - 2 * m * r * r1 * phi1
        return r * phi1**2 - G * np.sin(phi) - pull, moment / (J + m * r**2)

    def rate(_: float, y: np.ndarray) -> list[float]:
        r2, phi2 = second(*y)
        return [y[1], r2, y[3], phi2]

    r, r1, phi, phi1 = solve_ivp(rate, (0, t[-1]), [START, 0, 0, 0], t_eval=t, rtol=1e-11, atol=1e-13).y
    _, phi2 = second(r, r1, phi, phi1)
    across = m * (r * phi2 + 2 * r1 * phi1 + G * np.cos(phi))
    return np.stack([r * np.cos(phi) - START, r * np.sin(phi)], axis=1), phi, across


#: torque and stiffness; what the path [m], angles, forces and energy may be off by, each of its peak but the path: errors
#: of a step of the second order, a sixteenth of a turn per 20 steps with the motor
ACTING = {
    "gravity": ((0.0, 0.0), (1e-5, 2e-5, 2e-4, 3e-5)),
    "a motor past half a revolution": ((40.0, 2000.0), (3e-4, 3e-4, 2e-3, 1e-3)),
}


@pytest.mark.parametrize("acting", ACTING)
@pytest.mark.parametrize("model", ["rigid", "beam", pytest.param("plane", marks=pytest.mark.long)])
def test_a_bead_slides_along_an_arm_as_by_lagranges_equations(model: str, acting: str) -> None:
    """Its path, the arm's angle, the force between them, which is across the arm and has no moment, and the energy."""
    (torque, stiffness), (place, turn, force, energy) = ACTING[acting]
    got = channels(*ran(bead_on_an_arm(model, torque, stiffness)))
    path, phi, across = falling(1e-3 * np.arange(301), torque, stiffness)
    assert_allclose(got["probes/pin/travel"][:, :2], path, atol=place)
    assert_allclose(got["joints/A/angle"][:, 0], phi, atol=turn * np.abs(phi).max())
    square = np.column_stack([-np.sin(phi), np.cos(phi), 0 * phi])
    assert_allclose(got["joints/S/force"], across[:, None] * square, atol=force * np.abs(across).max())
    assert np.abs(got["joints/S/moment"]).max() < 1e-12
    assert np.abs(got["energy/residual"]).max() < energy * np.abs(got["energy/kinetic"]).max()


@pytest.mark.parametrize("model", ["rigid", "beam"])
def test_a_pin_that_slides_off_its_line_is_told(model: str) -> None:
    """When: as the bead's path reaches the end of the arm, to the step."""
    t = np.linspace(0, 0.5, 501)
    path = falling(t)[0]
    gone = t[np.argmax(np.hypot(path[:, 0] + START, path[:, 1]) > HIGH)]
    wanted = r"joints\.S: the pin must stay on link 'arm', which reaches from -0\.2 to 0\.4 m .* slides off it at t = "
    with pytest.raises(SolveError, match=wanted) as told:
        ran(bead_on_an_arm(model, end_time=0.5, step=2e-3))
    assert float(str(told.value).split("t = ")[1].split(" s")[0]) == pytest.approx(gone, abs=2.1e-3)


def test_a_balance_beyond_the_end_of_a_line_is_told() -> None:
    """A carriage without a drive: 100 N on a spring of 100 N/m take the pin past the cantilever's end."""
    raw = {key: x for key, x in cantilever(10.0, kind="static").items() if key not in {"drive", "output"}}
    ends = [{"link": "cart", "at": [HERE[0], 0.4]}, {"link": "ground", "at": [-1.0, 0.4]}]
    raw["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": 100.0}}
    raw["loads"]["G"] = {"kind": "force", "link": "cart", "at": [HERE[0], 0.4], "vector": [100.0, 0]}
    with pytest.raises(SolveError, match=r"joints\.S: the pin must stay on link 'beam'.* slides off it at t = 0 s"):
        ran(raw)


E, NU, INERTIA = 210e9, 0.3, 0.02 * 0.03**3 / 12  # Pa, -, m⁴: steel, `bar`
HERE = 0.2 + 0.1 * np.arange(7)  # where the pin is [m], at positions 10 s apart


def cantilever(P: float, model: str = "beam", elements: int = 16, **analysis: Any) -> Raw:
    """A cantilever of 1 m on which a rod presses, guided upright by a carriage that takes it along slowly."""
    x = HERE[0]
    beam = bar(model, (0, 0), (1, 0), elements) | ({"segments": 8} if model == "plane" else {})
    return {
        "links": {
            "beam": beam,
            "cart": bar("beam", (x, 0.2), (x, 0.4), 1),
            "rod": bar("beam", (x, 0), (x, 0.3), 1),
        },
        "joints": {
            "W": {"kind": "weld", "links": ["ground", "beam"], "at": [0, 0]},
            "A": {"kind": "prismatic", "links": ["cart", "ground"], "at": [x, 0.4], "axis": "x"},
            "V": {"kind": "prismatic", "links": ["rod", "cart"], "at": [x, 0.3], "axis": "y"},
            "S": {"kind": "slot", "links": ["rod", "beam"], "at": [x, 0], "axis": "x"},
        },
        "loads": {"F": {"kind": "force", "link": "rod", "at": [x, 0], "vector": [0, -P]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 0.01}},
        "analysis": {
            "kind": "quasi-static",
            "end_time": 60.0,
            "step": 10.0,
            "frames": "co-rotational",
            **analysis,
        },
        "output": {"probes": {
            "pin": {"link": "rod", "at": [x, 0], "quantity": "displacement", "frame": "world"},
            "tip": {"link": "beam", "at": [1, 0], "quantity": "displacement", "frame": "world"},
        }},
    }  # fmt: skip


def deflections(raw: Raw) -> tuple[np.ndarray, np.ndarray]:
    """Of pin and tip (T, 2), and the force on the pin (T, 3)."""
    got = channels(*ran(raw))
    both = [got[f"probes/{name}/displacement"][:, 1] for name in ("pin", "tip")]
    return np.stack(both, axis=1), got["joints/S/force"]


def test_a_load_that_travels_along_a_cantilever_deflects_it_as_timoshenko_has_it() -> None:
    """P s³/3EI and P s²(3L − s)/6EI, both with P s/κGA, κ of a rectangle by Cowper; squares of slopes of 5e-4 more."""
    found, force = deflections(cantilever(10.0))
    G_A = E / 2 / (1 + NU) * SECTION * 10 * (1 + NU) / (12 + 11 * NU)
    pin, tip = HERE**3 / 3 / E / INERTIA, HERE**2 * (3 - HERE) / 6 / E / INERTIA
    wanted = -10.0 * (np.stack([pin, tip], axis=1) + HERE[:, None] / G_A)
    assert_allclose(found, wanted, rtol=1e-3)
    assert_allclose(np.linalg.norm(force, axis=1), 10.0, rtol=1e-6)


def test_small_loads_deflect_as_with_rigid_body_frames() -> None:
    """What is apart falls as the square of the load, of the deflection: 0.36 % at 37 mm."""
    off = []
    for P in (1500.0, 750.0):
        bent, _ = deflections(cantilever(P, elements=8, step=30.0))
        off.append(
            np.abs(bent - deflections(cantilever(P, elements=8, step=30.0, frames="rigid-body"))[0]).max()
            / np.abs(bent).max()
        )
    slopes = np.log2(np.array(off[:-1]) / off[1:])
    assert (slopes > 1.8).all()
    assert off[0] < 5e-3


@pytest.mark.long
def test_beams_and_plane_links_that_bend_far_carry_pins_alike() -> None:
    """By 75 mm of 1 m, the force leans with the beam's slope by 0.1: two models that share no stations."""
    (one, force), (other, same) = (deflections(cantilever(3000.0, *x)) for x in (("beam", 24), ("plane", 32)))
    assert np.abs(one).max() > 0.07
    assert_allclose(one, other, atol=5e-4 * np.abs(one).max())
    assert_allclose(force, same, atol=5e-4 * np.abs(force).max())
    assert force[-1, 0] == pytest.approx(0.1033 * force[-1, 1], rel=2e-2)  # P s²/2EI (1 − …) of the deflected beam


def pinned(bushing: Raw | None = None, **analysis: Any) -> Raw:
    """The crank's pin in a slot of an arm on a cross, beams in space that nothing drives, let go under gravity."""
    raw = {key: x for key, x in slotted().items() if key != "drive"}
    if bushing is not None:
        raw["joints"]["J"]["bushing"] = bushing
    steps = {"end_time": 0.02, "step": 1e-3, "rho_inf": 0.8, **analysis}
    return {**raw, "gravity": [0, 0, -G], "analysis": steps}


SOFT = {"stiffness": 1e4, "damping": 10.0}
TURNS = {
    "x onto y": [0, 0, np.pi / 2],
    "x onto z": [0, -np.pi / 2, 0],
    "y onto z": [np.pi / 2, 0, 0],
    "askew": [0.7, -0.4, 1.1],
}


@pytest.mark.parametrize("turn", [pytest.param(x, marks=[] if x == "askew" else pytest.mark.long) for x in TURNS])
@pytest.mark.parametrize("bushing", [pytest.param(None, id="hard"), pytest.param(SOFT, id="soft")])
def test_the_same_whichever_way_the_scene_is_turned(bushing: Raw | None, turn: str) -> None:
    """Deflections to 1e-8 of the peak, forces to 1e-7, as passes converge."""
    R = Rotation.from_rotvec(TURNS[turn]).as_matrix()
    one, other = ran(pinned(bushing)), ran(turned(pinned(bushing), R, (0.3, -0.2, 0.1)))
    for k, link in enumerate(one[0].model.links):
        u, v = state(one[1], k, "u"), state(other[1], k, "u")
        if link.d == 3:
            assert np.abs(u @ R.T - v).max() < 1e-8 * np.abs(u).max()
    f, g = channels(*one)["joints/J/force"], channels(*other)["joints/J/force"]
    assert_allclose(g, f @ R.T, atol=1e-7 * np.abs(f).max())


@pytest.mark.parametrize(
    "bushing",
    [
        None,
        pytest.param(SOFT, marks=pytest.mark.long),
        pytest.param({"stiffness": [1e4, 3e4, 1.0], "damping": 10.0}, marks=pytest.mark.long),
    ],
    ids=["hard", "soft", "unlike"],
)
def test_off_its_line_too_a_pin_moves_as_by_the_oracle(bushing: Raw | None) -> None:
    """By 0.4 mm on soft bushings, whose directions turn with the line: 1e-10 found."""
    raw = slotted()
    if bushing is not None:
        raw["joints"]["J"]["bushing"] = bushing
    of = begun(raw, "co-rotational", driven=False)
    assert against_oracle(of, 3 if bushing is None else 10, keeps=True) < 1e-8
