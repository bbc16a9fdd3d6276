"""Springs, dampers and motors on links with rigid-body frames: for small forces the answer of co-rotational frames."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.results.audit import Account
from kedfem.results.recording import recording
from kedfem.scene import scene_from
from tests import scenes
from tests.momentum import momentum

E, RHO = 2.1e11, 7850.0
LINE = {"kind": "spring", "between": [{"link": "coupler", "at": "C"}, {"link": "ground", "at": [0.1, 0.4]}]}


def four_bar(frames: str, model: str = "beam", steps: int = 180, **rest: Any) -> dict[str, Any]:
    """A slow four-bar of steel, a quarter of a revolution."""
    analysis = {"revolutions": 0.25, "steps_per_revolution": steps, "frames": frames, "initial": "quasi-static"}
    mesh = {"elements": 2} if model == "beam" else {}
    kind = {"model": "solid", "reduction": "modal"} if model == "reduced" else {"model": model}
    shape = {"kind": "bar", "width": 0.02, "thickness": 0.01}
    return scenes.four_bar(
        (0.1, 0.3, 0.25, 0.3),
        {"material": "m", "mesh": mesh, "shape": shape, **kind},
        scenes.constant_speed("60 rpm"),
        materials={"m": scenes.material(RHO, E)},
        analysis={**analysis, **rest.pop("analysis", {})},
        **rest,
    )


def run(raw: dict[str, Any]) -> tuple[Prepared, list[Block]]:
    ready, _ = prepared(scene_from(raw))
    solver = steps_of(ready.scene, ready.model)
    return ready, list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))


def places(raw: dict[str, Any]) -> dict[tuple[Any, ...], np.ndarray]:
    """Displacement over time of all nodes, by link and place: segments or not."""
    ready, blocks = run(raw)
    found = {}
    for k, link in enumerate(ready.model.links):
        u = np.concatenate([block.links[k].u for block in blocks])
        found |= {(link.name, *np.round(x, 9)): u[:, j, :2] for j, x in enumerate(link.X)}
    return found


def apart(a: dict[tuple[Any, ...], np.ndarray], b: dict[tuple[Any, ...], np.ndarray]) -> float:
    assert b.keys() <= a.keys()
    return max(float(np.abs(a[key] - b[key]).max()) for key in b)


def largest(a: dict[tuple[Any, ...], np.ndarray]) -> float:
    return max(float(np.abs(x).max()) for x in a.values())


def line(load: float) -> dict[str, Any]:
    """A spring with damper and a torsion spring whose forces are all in proportion to a load."""
    return {
        "s": {**LINE, "stiffness": 10 * load, "damping": 0.1 * load, "preload": load},
        "t": {"kind": "torsion", "joint": "D", "stiffness": 0.1 * load, "damping": 1e-3 * load, "preload": 0.01 * load},
    }


def test_the_difference_to_frames_that_follow_falls_with_the_square_of_the_load() -> None:
    found = []
    for load in (400.0, 200.0):
        corotational, rigid_body = (
            places(four_bar(frames, springs=line(load))) for frames in ("co-rotational", "rigid-body")
        )
        assert apart(corotational, rigid_body) < 2e-3 * largest(rigid_body)
        found.append(apart(corotational, rigid_body))
    assert found[0] / found[1] == pytest.approx(4.0, rel=0.05)


@pytest.mark.parametrize("initial", ["rest", "quasi-static"])
@pytest.mark.parametrize("rho_inf", [1.0, 0.8])
def test_the_monolithic_solver_finds_the_same(initial: str, rho_inf: float) -> None:
    """It assembles and factors all of it at every step."""
    analysis = {"initial": initial, "rho_inf": rho_inf}
    condensed = four_bar("rigid-body", springs=line(200.0), analysis=analysis, steps=40)
    monolithic = four_bar("rigid-body", springs=line(200.0), analysis={**analysis, "solver": "monolithic"}, steps=40)
    ready, _ = prepared(scene_from(monolithic))
    solver = steps_of(ready.scene, ready.model)
    assert solver.monolithic is not None
    one, other = places(condensed), places(monolithic)
    assert apart(one, other) < 1e-9 * largest(one)


def channel(ready: Prepared, blocks: list[Block], name: str) -> np.ndarray:
    """One recorded channel over time."""
    (found,) = (x for x in recording(ready.scene, ready.model) if x.channel.name == name)
    return np.concatenate([found.rows(block)[:, 0] for block in blocks])


def tied(k: float, **analysis: Any) -> dict[str, Any]:
    """A spring between the ends of the coupler."""
    ends = [{"link": "coupler", "at": "C"}, {"link": "coupler", "at": "B"}]
    tie = {"kind": "spring", "between": ends, "stiffness": k}
    pull = {**LINE, "stiffness": 1e3, "preload": 1e3}
    return four_bar("rigid-body", springs={"s": pull, "tie": tie}, steps=90, analysis=analysis)


@pytest.mark.long
def test_a_spring_may_be_far_stiffer_than_the_links() -> None:
    """One of 1e12 N/m keeps the ends of the coupler, E A / L = 1.4e8 N/m, apart in the reference position."""
    soft, stiff = (np.ptp(channel(*run(tied(k)), "springs/tie/length")) for k in (1.0, 1e12))
    assert 0 < stiff < 1e-3 * soft
    one, other = places(tied(1e12)), places(tied(1e12, solver="monolithic"))
    assert apart(one, other) < 1e-7 * largest(one)


def test_the_same_law_drives_a_motor() -> None:
    """Over the speed of its joint, elastic part and all; constant ones are loads on both links."""
    curve = {"over": "speed", "at": [-10, 10], "value": [5, -5]}
    for torque in (curve, 2.0, {"over": "angle", "at": [-1, 1], "value": [3, -3]}):
        corotational, rigid_body = (
            places(four_bar(frames, motors={"m": {"joint": "C", "torque": torque}}))
            for frames in ("co-rotational", "rigid-body")
        )
        assert apart(corotational, rigid_body) < 1e-3 * largest(rigid_body)


@pytest.mark.parametrize("model", ["plane", pytest.param("solid", marks=pytest.mark.long)])
def test_meshed_links_bear_springs_too(model: str) -> None:
    corotational, rigid_body = (
        places(four_bar(frames, model, springs=line(50.0), steps=72)) for frames in ("co-rotational", "rigid-body")
    )
    assert apart(corotational, rigid_body) < 1e-3 * largest(rigid_body)


def test_without_a_force_a_spring_changes_nothing() -> None:
    slack = {"s": {**LINE, "stiffness": 1e-9, "preload": 0.0}}
    rest = {"initial": "rest"}
    plain, held = (places(four_bar("rigid-body", analysis=rest, **each)) for each in ({}, {"springs": slack}))
    assert apart(plain, held) < 1e-9 * largest(plain)


def balance(raw: dict[str, Any]) -> tuple[float, float]:
    """The residual of the energy, and the work of the loads."""
    ready, blocks = run(raw)
    account = Account(ready.model)
    work = [account.rows(block)["work"][-1, 0] for block in blocks]
    return account.balance.energy, work[-1]


def test_the_energy_left_over_falls_with_the_square_of_the_step() -> None:
    (long, work), (short, same) = (balance(four_bar("rigid-body", springs=line(200.0), steps=n)) for n in (360, 720))
    assert long / short == pytest.approx(4.0, rel=0.3)
    assert work == pytest.approx(same, rel=1e-3)


def test_the_work_is_that_which_springs_store() -> None:
    """Of a spring without damper: the energy ½ k (l − l0)² that it had more at first."""
    spring = {"s": {**LINE, "stiffness": 2000.0, "preload": 50.0}}
    ready, blocks = run(four_bar("rigid-body", springs=spring, steps=720))
    account = Account(ready.model)
    work = np.concatenate([account.rows(block)["work"][:, 0] for block in blocks])
    force, length = (channel(ready, blocks, f"springs/s/{x}") for x in ("force", "length"))
    start = np.linalg.norm(np.subtract(ready.scene.joints["C"].at[:2], [0.1, 0.4]))
    assert_allclose(force, 2000.0 * (length - start) + 50.0, rtol=1e-9)
    stored = force**2 / 2 / 2000.0
    assert_allclose(work, stored[0] - stored, atol=1e-4 * np.ptp(stored))


def torn(**analysis: Any) -> dict[str, Any]:
    """A spring of 1e9 N/m that holds the coupler's end where it was drawn, while the crank goes round."""
    springs = {"s": {**LINE, "stiffness": 1e9}}
    return four_bar("rigid-body", springs=springs, analysis={"initial": "rest", **analysis}, steps=20)


def test_forces_that_tear_the_links_apart_are_solved() -> None:
    """The spring hardly gives, where E A / L of the links is 1.4e8 N/m, and all forces are in balance."""
    stiff, soft = torn(), torn()
    soft["springs"]["s"]["stiffness"] = 1.0
    ready, blocks = run(stiff)
    length, free = (np.ptp(channel(*run(raw), "springs/s/length")) for raw in (stiff, soft))
    assert 0 < length < 0.05 * free
    kept = momentum(ready.model, blocks)
    assert kept.linear < 1e-5
    assert kept.angular < 1e-4


def test_forces_that_tear_the_links_apart_are_solved_by_the_oracle_too() -> None:
    """But for the last of five steps, in which both find a deflection as large as the links, one of two."""
    one, other = ({key: u[:5] for key, u in places(torn(**solver)).items()} for solver in ({}, {"solver": "monolithic"}))
    assert apart(one, other) < 1e-8 * largest(one)


def slider_crank(steps: int = 180, **spring: float) -> dict[str, Any]:
    """A spring along the slide of a slider-crank."""
    along = {"kind": "spring", "joint": "S", "stiffness": 1000.0, "preload": 20.0, **spring}
    raw = four_bar("rigid-body", springs={"p": along}, steps=steps)
    bar, rod = {"kind": "bar", "width": 0.02, "thickness": 0.01}, {"material": "m", "model": "beam"}
    raw["links"] = {
        "crank": {**rod, "shape": {**bar, "between": [[0, 0], [0.1, 0]]}},
        "rod": {**rod, "shape": {**bar, "between": [[0.1, 0], [0.4, 0]]}},
        "shoe": {"model": "rigid", "mass": 0.2},
    }
    raw["joints"] = {
        "A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0]},
        "B": {"kind": "revolute", "links": ["crank", "rod"], "at": [0.1, 0]},
        "C": {"kind": "spherical", "links": ["rod", "shoe"], "at": [0.4, 0]},
        "S": {"kind": "prismatic", "links": ["shoe", "ground"], "at": [0.4, 0], "axis": "x"},
    }
    return raw


def test_a_spring_along_a_slide_pulls_its_link_back() -> None:
    """−k q − F0 on the shoe of a slider-crank, whose travel is that of the rigid-body motion but for a little."""
    raw = slider_crank()
    force, travel = (channel(*run(raw), f"springs/p/{x}") for x in ("force", "travel"))
    phi = np.pi / 180 * 2 * np.arange(len(travel))
    drawn = 0.1 * np.cos(phi) + np.sqrt(0.3**2 - (0.1 * np.sin(phi)) ** 2) - 0.4
    assert_allclose(travel, drawn, atol=5e-5)  # the crank bends
    assert_allclose(force, -1000.0 * travel - 20.0, rtol=1e-9)
    raw["analysis"]["frames"] = "co-rotational"
    assert_allclose(channel(*run(raw), "springs/p/force"), force, atol=1e-4)
