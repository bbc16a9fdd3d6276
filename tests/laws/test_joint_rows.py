"""What every kind of joint must do, on beams in space and solids: hold, let free, bear what is in balance."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import Prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.constraint_joints import needs_constraints
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import GROUND
from tests.joint_checks import (
    LENGTH,
    bodies,
    free_twists,
    held_twists,
    port_wrench,
    shared_gap,
    sides,
    surface_motion,
    twist,
    unbalanced,
)
from tests.moving import bar, channels, ran, state, turned
from tests.spatial_joints import BEAMS, SLIDERS, SOLIDS, as_mesh_files, bushed

EVERY: dict[str, Callable[[], dict[str, Any]]] = {**BEAMS, **SOLIDS}
#: of forces and deflections. A hub of a beam in space is 1e6 times as stiff as its link is heavy, which costs six digits
#: of sixteen, and adds up over 40 steps; solids lose two less, and rigid links,
#: stiffer still, two more
# of beams in space 5e-8 in statics; the start's rates are differences of fourth order, with 2.7 times the noise of second
ROUNDING = {"beams": 3e-7, "solids": 1e-9, "rigid": 1e-5}
UNDAMPED: dict[str, Any] = {"stiffness": 1e6, "rotational_stiffness": 2e3}


@cache
def run_of(kind: str) -> tuple[Prepared, list[Block]]:
    return ran((EVERY | SLIDERS)[kind]())


def moved(seed: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return Rotation.random(random_state=random).as_matrix(), random.normal(size=3)


def rounding(kind: str) -> float:
    return ROUNDING["rigid" if "rigid" in kind else "beams"]


def assert_the_same(kind: str, one: Any, other: Any, R: np.ndarray, digits: float) -> None:
    """Link-frame deflections of all links, forces, moments and torques of all joints, drives and gears, turned back."""
    (ready, blocks), (_, again) = one, other
    links = [k for k, link in enumerate(ready.model.links) if not link.rigid]  # whose functions lie as they do
    size = max((np.abs(state(blocks, k, "g")).max() for k in links), default=0.0)  # all may be rigid
    for k in links:
        # of the functions of a beam in space some are slopes, whose values turn with their own directions
        g, back = (state(blocks, k, "g"), R[: ready.model.links[k].d, : ready.model.links[k].d])  # of a plane link two
        assert_allclose(state(again, k, "g") @ back, g, atol=digits * size)
    here, there = channels(*one), channels(*other)
    # what statics determines of rigid links depends on which axes of the world their redundant directions lie along
    elastic = [name for name in here if "/rigid_" not in name]
    loads = [name for name in elastic if name.split("/")[0] in {"joints", "drive", "gears"}]
    hinged = sum(joint.kind != "weld" for joint in ready.scene.joints.values())
    # a slider's guide: statics may not show its force; nor, of rigid links alone, what a slot bears across the plane
    assert len(loads) >= 2 * hinged - 1 - (kind == "slot" and not links)
    force = max(np.abs(here[name]).max() for name in loads if name.endswith("force"))
    for unit, arm in ((("force",), 1.0), (("moment", "torque"), LENGTH)):  # moments out of a plane are rounding
        these = [name for name in loads if name.endswith(unit)]
        most = max([force * arm, *(np.abs(here[name]).max() for name in these)])
        for name in these:
            back = there[name] @ R if there[name].shape[1] == 3 else there[name]
            assert_allclose(back, here[name], atol=digits * most, err_msg=name)


@pytest.mark.parametrize("kind", list(BEAMS | SLIDERS))
def test_no_answer_depends_on_how_the_scene_lies(kind: str) -> None:
    R, shift = moved(len(kind))
    assert_the_same(kind, run_of(kind), ran(turned((BEAMS | SLIDERS)[kind](), R, shift)), R, rounding(kind))


@pytest.mark.parametrize("turn", [1, 2], ids=["z to x", "z to y"])
@pytest.mark.parametrize("kind", list(BEAMS | SLIDERS))
def test_no_answer_depends_on_which_axis_of_the_world_a_joint_lies_along(kind: str, turn: int) -> None:
    """x, y and z change places: what is along an axis of the world, exactly, must be no special case."""
    R = np.roll(np.eye(3), turn, axis=0)
    raw = shortened((BEAMS | SLIDERS)[kind](), 0.002)
    assert_the_same(kind, ran(raw), ran(turned(raw, R)), R, rounding(kind))


@pytest.mark.parametrize("model", ["beam", "plane", "solid"])
def test_the_force_on_a_slider_without_a_shape_is_the_same_in_all_directions_of_a_plane(model: str) -> None:
    """Along x, y and askew: a ram pushes a planar beam, a plane link, a solid; of which a bar lies as it likes."""
    force = []
    for angle in (0.0, np.pi / 2, 0.7):
        c, s = np.cos(angle), np.sin(angle)
        ends = [[0.2 * c, 0.2 * s], [0.2 * c - 0.2 * s, 0.2 * s + 0.2 * c]]
        links = {"ram": {"model": "rigid", "mass": 0.5}, "rod": bar(model, [0.0, 0.0], ends[0], 2)}
        joints: dict[str, Any] = {
            "A": {"kind": "prismatic", "links": ["ram", "ground"], "at": [0.0, 0.0], "axis": [c, s, 0.0]},
            "P": {"kind": "revolute", "links": ["ram", "rod"], "at": [0.0, 0.0]},
            "Q": {"kind": "revolute", "links": ["rod", "arm"], "at": ends[0]},
            "G": {"kind": "revolute", "links": ["arm", "ground"], "at": ends[1]},
        }
        links["arm"] = bar(model, ends[0], ends[1], 2)
        drive = {"joint": "A", "motion": {"kind": "cycloidal", "travel": 0.03, "rise": 0.03}}
        analysis = {"end_time": 0.003, "step": 5e-4, "rho_inf": 0.8, "initial": "quasi-static"}
        one = ran({"links": links, "joints": joints, "drive": drive, "analysis": analysis})
        force.append(channels(*one)["drive/force"])
    assert np.abs(force[0]).max() > 1.0  # N: half a kilogram, and the rod, at 200 m/s²
    for other in force[1:]:
        assert_allclose(other, force[0], atol=1e-8 * np.abs(force[0]).max())


@pytest.mark.parametrize("kind", ["cylindrical, bores", pytest.param("prismatic, bores", marks=pytest.mark.long)])
def test_no_answer_of_solids_depends_on_how_the_scene_lies(kind: str, tmp_path: Path) -> None:
    """All solids in mesh files, which may lie as they like; bores are found there."""
    R, shift = moved(3)
    drawn = run_of(kind)[0].model.links
    other = ran(as_mesh_files(turned(SOLIDS[kind](), R, shift), drawn, tmp_path, R, shift))
    assert_the_same(kind, run_of(kind), other, R, ROUNDING["solids"])


@pytest.mark.parametrize("kind", list(EVERY))
def test_forces_and_moments_balance_inertia_and_loads_of_every_link(kind: str) -> None:
    """Joints, gears, gravity, rigid and elastic inertia: nothing is left, at no link and no step.

    Beside rigid cross-section nodes of beams in space rounding leaves up to 7e-9, with other processors' kernels 1.03e-8;
    beside bushings, whose forces are a quarter as large at the same rounding, 1.5e-8 to 3.3e-8.
    """
    force, moment = unbalanced(*run_of(kind))
    rounding = 1e-7 if kind == "bushings" else 3e-8 if kind in BEAMS else 1e-9
    assert max(force, moment) < rounding


@pytest.mark.parametrize("kind", list(EVERY))
def test_what_joints_let_free_is_free(kind: str) -> None:
    """Port forces, summed up, do no work along what a joint's kind releases; which does move, as turns and slides."""
    ready, blocks = run_of(kind)
    at, geared = bodies(ready, blocks), {name for gear in ready.scene.gears.values() for name in gear.joints}
    for name, joint in ready.scene.joints.items():
        free = free_twists(ready, at, name)
        if name in geared or not free.shape[1]:
            continue
        on = [link for link in joint.links if link != GROUND]
        for link in on:
            wrench = port_wrench(ready, blocks, name, link)
            work = np.einsum("tfk,tk->tf", free, wrench)
            assert np.abs(work).max() < (1e-8 if kind in BEAMS else 1e-10) * np.abs(wrench).max()


def deflection(ready: Prepared, blocks: list[Block]) -> float:
    return max(float(np.abs(state(blocks, k, "u")).max()) for k in range(len(ready.model.links)))


@pytest.mark.parametrize("kind", [kind for kind in EVERY if kind != "bushings"])
def test_what_joints_hold_is_held(kind: str) -> None:
    """Relative displacement and turn of coupling surfaces, from their ports, along all that a joint's kind does not leave
    free."""
    ready, blocks = run_of(kind)
    at, size = bodies(ready, blocks), deflection(ready, blocks)
    for name, joint in ready.scene.joints.items():
        if not needs_constraints(ready.scene, name):
            assert np.abs(shared_gap(ready, blocks, name)).max() < 1e-10 * size
            continue
        i, j = sides(joint)
        apart = twist(ready, blocks, name, i) - twist(ready, blocks, name, j)
        free = free_twists(ready, at, name)
        assert np.abs(np.einsum("thk,tk->th", held_twists(free), apart)).max() < 1e-10 * size
        if free.shape[1]:
            assert np.abs(np.einsum("tfk,tk->tf", free, apart)).max() > 1e-4 * size


def test_gears_tie_the_turns_of_their_wheels_and_a_rack() -> None:
    """Wheel A, on a shaft that gives, leads B and the rack in proportion, also where they swing."""
    ready, blocks = run_of("gears, rack")
    at, size = bodies(ready, blocks), deflection(ready, blocks)

    def motion(name: str, gear: str) -> np.ndarray:
        joint = ready.scene.joints[name]
        i, j = sides(joint)
        _, u, turn = surface_motion(ready, blocks, f"gears.{gear}", i)
        z = at.of(j)[1] @ joint_axis(joint)
        return np.asarray(np.einsum("tk,tk->t", z, u if joint.kind == "prismatic" else turn))

    assert np.abs(motion("A", "bevel")).max() > 1e-3 * size / LENGTH
    assert_allclose(motion("B", "bevel"), -1.5 * motion("A", "bevel"), atol=1e-10 * size / LENGTH)
    assert_allclose(motion("J", "rack"), 0.08 * motion("B", "rack"), atol=1e-10 * size)


def test_bushings_give_in_proportion_along_what_the_joint_holds_and_nowhere_else() -> None:
    """Force −k times displacement, moment −k times turn, of the coupling surfaces against each other."""
    raw = bushed()
    for joint in raw["joints"].values():
        if "bushing" in joint:
            joint["bushing"] = {key: UNDAMPED[key] for key in UNDAMPED if key in joint["bushing"]}
    ready, blocks = ran(raw)
    at = bodies(ready, blocks)
    for name in ("P", "J", "G"):
        i, j = sides(ready.scene.joints[name])
        held = held_twists(free_twists(ready, at, name))
        apart = twist(ready, blocks, name, i) - twist(ready, blocks, name, j)
        k = np.repeat([UNDAMPED["stiffness"], UNDAMPED["rotational_stiffness"] / LENGTH**2], 3)
        e = np.einsum("thk,tk->th", held, apart)
        wanted = -k * np.einsum("thk,th->tk", held, e)
        got = port_wrench(ready, blocks, name, i)
        assert_allclose(got, wanted, atol=1e-7 * np.abs(wanted).max())


def shortened(raw: dict[str, Any], end: float) -> dict[str, Any]:
    return {**raw, "analysis": {**raw["analysis"], "end_time": end}}


@pytest.mark.parametrize("kind", [pytest.param(x, marks=pytest.mark.long if "bores" in x else ()) for x in EVERY])
def test_the_monolithic_steps_agree(kind: str) -> None:
    """Assembled at every step, with bordered rows and no condensation: displacements, rates, joint forces and torques."""
    raw = shortened(EVERY[kind](), 0.01 if kind in BEAMS else 0.002)
    literal = {**raw, "analysis": {**raw["analysis"], "solver": "monolithic"}}
    (ready, wanted), (_, got) = ran(literal), ran(raw)
    links = range(len(ready.model.links))
    digits = 1e-7 if kind in BEAMS else 1e-8  # solids hardly move in four steps
    for name in ("u", "v"):
        size = max(np.abs(state(wanted, k, name)).max() for k in links)
        for k in links:
            assert_allclose(state(got, k, name), state(wanted, k, name), atol=digits * size)
    one, other = channels(ready, got), channels(ready, wanted)
    for what in ("force", "moment", "torque"):
        these = [name for name in one if name.endswith(f"/{what}")]
        size = max((np.abs(other[name]).max() for name in these), default=0.0)
        for name in these:
            assert_allclose(one[name], other[name], atol=digits * size, err_msg=name)
