"""Geometric stiffening with joints enforced by constraint equations: stresses that these bear, whatever the direction."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import motion_of
from kedfem.dynamics.stiffening import stiffening
from kedfem.dynamics.system.starts.deflected import quasi_static, quasi_static_position
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from
from tests.laws.test_joint_partners import TURNS, named
from tests.moving import channels, inverted, ran
from tests.partners import axis_of, chain
from tests.systems import assembled_deflection, rows

Raw = dict[str, Any]
Turn = Callable[[np.ndarray], np.ndarray]
SPEED = 60.0  # rad/s of the crank: stresses then change displacements by percent
#: joint, its links, whether the drive is on it
EVERY = [
    ("prismatic", ("beam", "beam"), False), ("cylindrical", ("beam", "ground"), False),
    ("screw", ("beam", "beam"), False), ("universal", ("solid", "beam"), False), ("planar", ("beam", "beam"), False),
    ("slot", ("beam", "beam"), False),
    ("revolute", ("beam", "beam"), True), ("prismatic", ("reduced", "beam"), False),
]  # fmt: skip


def fast(raw: Raw, on: bool = True, speed: float = SPEED) -> Raw:
    raw["analysis"] |= {"frames": "rigid-body", "stiffening": on, "initial": "rest", "end_time": 3e-3, "step": 2e-4}
    raw["analysis"].pop("revolutions", None)
    joint = raw["drive"]["joint"]
    sliding = raw["joints"][joint]["kind"] == "prismatic"
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": 0.3 if sliding else speed}
    return raw


def displaced(raw: Raw) -> np.ndarray:
    """Displacements (T, n, 3) of all links side by side; ψ and rows of functions that do not move left out."""
    ready, blocks = ran(raw)
    return np.concatenate([
        np.concatenate([block.links[k].u for block in blocks]) for k, link in enumerate(ready.model.links)
        if link.d == 3 and link.kind != "beam"
    ], axis=1)  # fmt: skip


def assert_stresses_turn(made: Callable[[Turn, bool], Raw], axis: np.ndarray) -> None:
    """Displacements along x, y, z and askew are the same; and stiffening matters.

    Parameters
    ----------
    made : a scene by its rotation and whether stiffening is on
    axis : of the joint that is turned, as it is drawn without a rotation
    """
    R = {name: turn(axis) for name, turn in TURNS[False].items()}
    found = {name: displaced(made(turn, True)) @ R[name] for name, turn in TURNS[False].items()}
    peak = np.abs(found["x"]).max()
    for name in ("y", "z", "askew"):
        assert_allclose(found[name], found["x"], rtol=0, atol=2e-6 * peak)
    plain = displaced(made(TURNS[False]["x"], False)) @ R["x"]
    assert np.abs(found["x"] - plain).max() > 1e-4 * peak


@pytest.mark.parametrize("cell", EVERY, ids=named)
def test_stresses_of_constrained_joints_turn_with_the_scene(cell: tuple[str, tuple[str, str], bool]) -> None:
    kind, partners, driven = cell
    assert_stresses_turn(
        lambda turn, on: fast(chain(kind, partners, driven, False, turn), on), axis_of(kind, partners, driven)
    )


@pytest.mark.parametrize(
    "cell", [*EVERY, ("revolute", ("planar beam", "planar beam"), False), ("slot", ("plane", "plane"), False)], ids=named
)  # fmt: skip
def test_quasi_static_starts_and_positions_solve_the_assembled_equations(cell: tuple[str, tuple[str, str], bool]) -> None:
    """With what stresses of the rigid-body motion stiffen."""
    kind, partners, driven = cell
    plane = partners[0].startswith("plan")
    raw = fast(chain(kind, partners, driven, plane), speed=10.0 if plane else SPEED)
    del raw["analysis"]["initial"]
    ready = meshed(scene_from({**raw, "analysis": {**raw["analysis"], "initial": "quasi-static"}}))
    of, motion_at = (steps_of(ready.scene, ready.model).ready, motion_of(ready.scene, ready.linkage, ready.path))
    wanted = assembled_deflection(of, motion_at(np.zeros(1)))
    for found in (quasi_static(of, motion_at), quasi_static_position(of, motion_at, 0.0)):
        assert_allclose(rows(of, found.u[None])[0], wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


def stress_factors(raw: Raw) -> list[np.ndarray]:
    """s of all links at some times."""
    ready = meshed(scene_from(raw))
    t = np.linspace(0.0, 3e-3, 4)
    motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(ready.scene, t))
    return stiffening(ready.model).over(forcings(ready.model, motion), motion)


@pytest.mark.parametrize("stiffness", [1e6, 1e10])
@pytest.mark.parametrize(
    ("kind", "link", "off"),
    [("revolute", "planar beam", 1e-9), ("weld", "planar beam", 1e-9), ("spherical", "beam", 1e-6),
     ("spherical", "solid", 1e-8), ("revolute", "beam", 1e-5), ("weld", "beam", 2e-5)],
)  # fmt: skip
def test_stresses_through_a_bushing_are_those_of_the_joint(kind: str, link: str, off: float, stiffness: float) -> None:
    """What is statically determinate does not depend on how much a joint gives; nor on whether its points are shared or
    constrained, but for how moments spread over a section."""
    plane = link == "planar beam"
    raw = fast(chain(kind, (link, link), False, plane), speed=3.0 if plane else SPEED)
    wanted = stress_factors(raw)
    raw["joints"]["J"]["bushing"] = {"stiffness": stiffness}
    if kind != "spherical":
        raw["joints"]["J"]["bushing"]["rotational_stiffness"] = 1e-2 * stiffness
    largest = max(float(_work(x).max()) for x in wanted)
    assert largest > 0.0
    for found, same in zip(stress_factors(raw), wanted, strict=True):
        assert_allclose(_work(found), _work(same), rtol=0, atol=off * largest)


def _work(s: np.ndarray) -> np.ndarray:
    """Twice the strain energy of the stresses, whatever modes they are counted in."""
    return np.asarray((s**2).sum(axis=1))


def test_a_slide_between_moving_links_bears_as_inverse_dynamics_says() -> None:
    """Where links are much stiffer than their deflection matters, stiffened steps leave joint forces as they are."""
    plain, stiffened = inverted(), inverted()
    stiffened["analysis"]["stiffening"] = True
    forces = [np.concatenate([b.links[1].port_forces for b in ran(raw)[1]]) for raw in (plain, stiffened)]
    assert_allclose(forces[1], forces[0], rtol=0, atol=1e-3 * np.abs(forces[0]).max())
    assert np.abs(forces[1] - forces[0]).max() > 0.0


@pytest.mark.parametrize(("kind", "part"), [("universal", 0.15), ("screw", 0.5)])
def test_stiffening_takes_most_of_what_the_linear_equation_is_off_by(kind: str, part: float) -> None:
    """Of joint forces, from co-rotational frames, which know all of it; the error grows with the square of the speed."""
    left: list[float] = []
    for speed in (20.0, SPEED):
        forces = []
        for frames, on in (("rigid-body", False), ("rigid-body", True), ("co-rotational", False)):
            raw = fast(chain(kind, ("beam", "beam")), on, speed)
            for link in raw["links"].values():
                link["mesh"] = {"elements": 2}
            raw["analysis"] |= {"frames": frames, "initial": "quasi-static", "end_time": 0.01}
            raw["damping"] = {"beta": 1e-5}
            found = channels(*ran(raw))
            names = [name for name in found if name.startswith("joints/") and name.endswith("/force")]
            forces.append(np.concatenate([found[name] for name in names], axis=1))
        linear, stiffened = (np.abs(x - forces[2]).max() / np.abs(forces[2]).max() for x in forces[:2])
        assert stiffened < part * linear
        left.append(float(linear))
    assert 5.0 < left[1] / left[0] < 20.0  # 9 as the square
