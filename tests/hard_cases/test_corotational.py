"""Co-rotational frames where it is difficult: docs/theory/errors.md (Hard cases) lists what these cases find."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.resolution import stability_warning
from kedfem.analysis import analyse
from kedfem.dynamics.stepping.solvers import eased_warning, steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.errors import SolveError
from kedfem.links.record import mass_times
from kedfem.results import read_results
from kedfem.scene import scene_from
from tests.runs import quick, ran
from tests.verification.large_deflection import history

ALLOY = {"density": 2700.0, "youngs_modulus": 7e10, "shear_modulus": 2.7e10}
HINGE = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}


def bar(a: list[float], b: list[float], size: tuple[float, float], elements: int) -> dict[str, Any]:
    """A planar beam of elements with five nodes; height in the plane and thickness across it."""
    shape = {"kind": "bar", "between": [a, b], "width": size[0], "thickness": size[1]}
    return {"material": "m", "model": "beam", "element": "beam5", "shape": shape, "mesh": {"elements": elements}}


def driven(motion: dict[str, Any], arm: dict[str, Any], material: dict[str, Any], **analysis: Any) -> dict[str, Any]:
    return {
        "materials": {"m": material},
        "links": {"arm": arm},
        "joints": {"A": HINGE},
        "drive": {"joint": "A", "motion": motion},
        "analysis": {"frames": "co-rotational", "rho_inf": 0.9, "initial": "rest", **analysis},
    }


# -- against geometrically exact beams, see tests/exact/cases.py --------------------------------------------


@pytest.mark.long
def test_a_shallow_arch_snaps_through() -> None:
    """Two bars 0.5 m long that rise by 20 mm, 1 kg at the apex, 500 N put on at once: down to −38 mm."""
    size = (0.02, 0.01)
    made = ran({
        "materials": {"m": ALLOY},
        "links": {"a": bar([-0.5, 0], [0, 0.02], size, 2), "b": bar([0, 0.02], [0.5, 0], size, 2)},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "a"], "at": [-0.5, 0]},
            "B": {"kind": "revolute", "links": ["a", "b"], "at": [0, 0.02]},
            "C": {"kind": "revolute", "links": ["b", "ground"], "at": [0.5, 0]},
        },
        "bodies": {"apex": {"kind": "point_mass", "link": "a", "at": [0, 0.02], "mass": 1.0}},
        "loads": {"F": {"kind": "force", "link": "a", "at": [0, 0.02], "vector": [0, -500]}},
        "analysis": {"end_time": 0.06, "step": 5e-5, "rho_inf": 0.9},
    })  # fmt: skip
    y = made.position("a", [0, 0.02])[:, 1:2]
    assert y.min() < -0.02
    assert history("snap_through").difference(made.t, y).max() < 2e-4


def test_a_free_slider_crank_passes_its_dead_points() -> None:
    """A force on the slider, a flywheel on the crank, which nobody drives; links of 1 mm that bend by a centimetre."""
    end, size = float(np.sqrt(0.3**2 - 0.1**2)), (0.001, 0.02)
    made = ran({
        "materials": {"m": {"density": 7800, "youngs_modulus": 2.1e11, "shear_modulus": 8e10}},
        "links": {
            "crank": bar([0, 0], [0, 0.1], size, 4),
            "rod": bar([0, 0.1], [end, 0], size, 4),
            "slider": {"model": "rigid", "mass": 0.05},
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0]},
            "B": {"kind": "revolute", "links": ["crank", "rod"], "at": [0, 0.1]},
            "C": {"kind": "revolute", "links": ["rod", "slider"], "at": [end, 0]},
            "S": {"kind": "prismatic", "links": ["slider", "ground"], "at": [end, 0], "axis": "x"},
        },
        "bodies": {"wheel": {"kind": "flywheel", "link": "crank", "at": [0, 0], "inertia": 5e-3}},
        "loads": {"F": {"kind": "force", "link": "slider", "at": [end, 0], "vector": [-4, 0]}},
        "damping": {"beta": 1e-5},
        "analysis": {"end_time": 0.5, "step": 1.25e-4, "rho_inf": 0.9, "initial_speeds": {"A": -30}},
    })  # fmt: skip
    first = next(k for k, link in enumerate(made.ready.model.links) if link.name == "crank")
    angle = made.state(first, "u")[:, 0, 2]
    values = np.column_stack([
        angle, made.position("crank", [0, 0.1])[:, :2], made.position("rod", [end, 0])[:, 0]
    ])  # fmt: skip
    assert np.ptp(angle) > 4 * np.pi  # twice round: four dead points
    assert history("dead_point").difference(made.t, values).max() < 4e-3


@pytest.mark.long
def test_a_thin_link_whips() -> None:
    """Half a turn in 0.5 s of 1 m × 2 mm of plastic: the tip lags by more than a quarter turn."""
    motion = {"kind": "cycloidal", "angle": np.pi, "rise": 0.5}
    plastic = {"density": 1150, "youngs_modulus": 2e9, "shear_modulus": 7.5e8}
    raw = driven(motion, bar([0, 0], [1, 0], (0.002, 0.01), 8), plastic, end_time=1.0, step=1e-3)
    made = ran(raw | {"damping": {"beta": 2e-4}})
    assert history("whip").difference(made.t, made.position("arm", [1, 0])[:, :2]).max() < 5e-4


def test_a_drive_stops_suddenly() -> None:
    """An arm at 15 rad/s stopped within 5 ms: the tip swings on."""
    t1, T, t = 0.02, 0.005, np.concatenate([np.linspace(0, 0.02, 41), np.linspace(0.02, 0.35, 26401)[1:]])
    t = t[(t < 0.026) | (np.arange(len(t)) % 40 == 0)]
    x = np.clip((t - t1) / T, 0, 1)
    angle = 15 * np.minimum(t, t1) + 15 * T / 2 * (x + np.sin(np.pi * x) / np.pi)
    motion = {"kind": "curve", "time": list(t), "value": list(angle)}
    made = ran(driven(motion, bar([0, 0], [1, 0], (0.02, 0.01), 4), ALLOY, end_time=0.3, step=1e-4))
    assert history("sudden_stop").difference(made.t, made.position("arm", [1, 0])[:, :2]).max() < 2e-3


# -- long runs ----------------------------------------------------------------------------------------------


def flight_energy(rho_inf: float, steps: int, h: float = 2e-4) -> np.ndarray:
    """Energy at every 256th step of a rod thrown spinning at 40 rad/s, bent by a pulse on one end, of that after it."""
    shape = {"kind": "bar", "between": [[0, 0], [0.5, 0]], "width": 0.004, "thickness": 0.01}
    scene = scene_from({
        "materials": {"m": ALLOY},
        "links": {"rod": {"material": "m", "model": "beam", "shape": shape, "mesh": {"elements": 2}}},
        "loads": {"F": {"kind": "force", "link": "rod", "at": [0, 0], "vector": [0, 5],
                        "factor": {"time": [0, 0.01, 0.02], "value": [0, 1, 0]}}},
        "analysis": {"end_time": steps * h, "step": h, "rho_inf": rho_inf,
                     "initial_motions": {"rod": {"at": [0.25, 0], "angular_velocity": [0, 0, 40]}}},
    })  # fmt: skip
    ready = meshed(scene)
    out = []
    for block in transient(scene, ready.linkage, ready.path, ready.model, steps_of(scene, ready.model)):
        moving = sum(
            0.5 * float(np.vdot(x.v[-1], mass_times(link.mass, x.v[-1])))
            for link, x in zip(ready.model.links, block.links, strict=True)
        )
        out.append(moving + sum(float(x.strain[-1]) for x in block.links))
    return np.array(out[2:]) / out[2]


@pytest.mark.parametrize("rho_inf", [0.95, 0.8, 1.0])
def test_free_flight_of_a_hundred_thousand_steps_does_not_gain_energy(rho_inf: float) -> None:
    energy = flight_energy(rho_inf, 100_000)
    assert energy.max() < 1 + 1e-3
    assert energy.min() > 1 - 1e-3


# -- steps that do not settle -------------------------------------------------------------------------------


def struck(step: float, elements: int, end: float) -> dict[str, Any]:
    """A thin strip in the air, one end of which is struck."""
    return {
        "materials": {"m": ALLOY},
        "links": {"strip": bar([0, 0], [1, 0], (0.001, 0.01), elements)},
        "loads": {"F": {"kind": "force", "link": "strip", "at": [0, 0], "vector": [3, 6]}},
        "analysis": {"end_time": end, "step": step, "rho_inf": 0.9},
    }


def test_steps_that_do_not_settle_are_taken_in_parts() -> None:
    """Steps of 1 ms of a strip struck on one end: nearly each in parts, and near to what steps of 0.1 ms find.

    In up to 32 parts; of 2 ms one in ten runs needs more than the 64 allowed, by rounding alone."""
    coarse, fine = ran(struck(1e-3, 2, 0.06)), ran(struck(1e-4, 2, 0.06))
    ends = [made.position("strip", [x, 0])[:, :2] for made in (coarse, fine) for x in (0, 1)]
    way = np.ptp(ends[2], axis=0).max()
    assert any("were divided, which excites vibration" in text for text in eased_warning([coarse.solver]))
    assert eased_warning([ran({**struck(1e-3, 2, 0.01), "loads": {}}).solver]) == ()
    for rough, exact in zip(ends[:2], ends[2:], strict=True):
        assert np.abs(rough - exact[::10]).max() < 0.02 * way


def test_a_step_that_cannot_be_saved_says_where_and_keeps_what_was_done(tmp_path: Path) -> None:
    raw = struck(4e-3, 4, 0.2) | {
        "output": {"folder": str(tmp_path), "plots": False, "picture": False, "animation": False}
    }
    message = (
        r"^analysis: the iterations of each step must converge, got no convergence at step (\d+), t = .* s, "
        r"not even in 64 parts; link 'strip' moves most .*: give it more elements or segments, take a "
        r"smaller step, or more numerical damping \(rho_inf\)$"
    )
    with pytest.raises(SolveError, match=message) as said:
        analyse(scene_from(quick(raw)))
    step = int(str(said.value).split("at step ")[1].split(",")[0])
    kept = read_results(tmp_path / "results.h5")
    assert len(kept.time) == step > 0
    assert np.isfinite(kept.time).all()


@pytest.mark.parametrize(("rho_inf", "said"), [(0.95, "grows in links that rotate"), (0.8, "")])
def test_links_that_turn_too_far_in_a_step_are_warned_of(rho_inf: float, said: str) -> None:
    """0.15 rad a step: more than 1 − ρ∞ lets what no step resolves grow, without any damping."""
    motion = {"kind": "ramp", "speed": 15.0, "time": 1.0}
    raw = driven(motion, bar([0, 0], [1, 0], (0.02, 0.01), 2), ALLOY, end_time=4.0, step=0.01)
    raw["analysis"]["rho_inf"] = rho_inf
    raw["links"]["arm"] |= {"element": "beam3"}
    warned = stability_warning(scene_from(raw))
    assert bool(warned) == bool(said)
    assert all(said in text and "co-rotational frames" in text for text in warned)
