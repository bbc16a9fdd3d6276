"""The energy and momentum of a run: every kind of link, second order in the step, and what known laws say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import prepared
from kedfem.analysis import analyse
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.results.audit import Account, balance_warning
from kedfem.results.balance import Balance
from kedfem.scene import read_scene, scene_from
from kedfem.tables import run_tables
from kedfem.tables.run import balance_table
from tests import scenes
from tests.momentum import Momentum, momentum
from tests.runs import quick
from tests.scenes import bar, material

EXAMPLES = Path(__file__).parents[2] / "examples"
L, SIDE, E, RHO = 0.5, 0.02, 2.1e11, 7850.0  # an arm [m] of steel
MASS = RHO * SIDE**2 * L
BEAM = {"model": "beam", "mesh": {"elements": 4}}


def blocks(ready: Prepared) -> list[Block]:
    solver = steps_of(ready.scene, ready.model)
    return list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))


def audited(raw: dict[str, Any]) -> tuple[Balance, dict[str, np.ndarray]]:
    """The balance, and all energies over time."""
    balance, energies, _ = audited_too(raw)
    return balance, energies


def audited_too(raw: dict[str, Any]) -> tuple[Balance, dict[str, np.ndarray], Momentum]:
    """The same, and momentum by the oracle."""
    ready, _ = prepared(scene_from(raw))
    account, run = Account(ready.model), blocks(ready)
    rows = [account.rows(block) for block in run]
    energies = {name: np.concatenate([x[name] for x in rows]) for name in rows[0]}
    return account.balance, energies, momentum(ready.model, run)


def example(name: str, steps: int, links: dict[str, Any] | None = None, **analysis: Any) -> dict[str, Any]:
    """A quarter of a revolution of an example."""
    raw = scenes.example(name)
    raw["analysis"] = {"revolutions": 0.25, "steps_per_revolution": steps, "initial": "quasi-static", **analysis}
    for link in raw["links"].values():
        link.update(links or {})
    return raw


def arm(link: dict[str, Any], motion: dict[str, Any], **rest: Any) -> dict[str, Any]:
    return scenes.arm(bar(L, SIDE, SIDE, **link), motion, materials={"steel": material(RHO, E)}, **rest)


KINDS: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "beams": ("four_bar_beams", {}, {}),
    "monolithic": ("four_bar_beams", {}, {"solver": "monolithic"}),
    "from rest": ("four_bar_beams", {"mesh": {"elements": 2}}, {"initial": "rest"}),
    "spatial beams": ("four_bar_beams", {"beam": "spatial"}, {}),
    "beams that are followed": ("four_bar_beams", {"mesh": {"elements": 2}}, {"frames": "co-rotational"}),
    "planes": ("four_bar_beams", {"model": "plane"}, {}),
    "planes that are followed": ("four_bar_beams", {"model": "plane", "segments": 2}, {"frames": "co-rotational"}),
    "reduced planes": ("four_bar_beams", {"model": "plane", "reduction": "modal"}, {}),
    "solids": ("four_bar_solids", {"mesh": {"size": 0.05}}, {}),
    "reduced solids": ("four_bar_solids", {"reduction": "modal"}, {}),
}


DAILY = {"beams", "from rest", "spatial beams", "beams that are followed", "planes", "solids"}


@pytest.mark.parametrize("kind", [pytest.param(x, marks=() if x in DAILY else pytest.mark.long) for x in KINDS])
def test_what_the_steps_leave_over_falls_with_the_square_of_the_step(kind: str) -> None:
    name, links, analysis = KINDS[kind]
    found = [audited_too(example(name, steps, links, **analysis)) for steps in (360, 720)]
    (energy, _, long), (half, _, short) = found
    for one, other in ((energy.energy, half.energy), (long.linear, short.linear), (long.angular, short.angular)):
        assert 3.7 < one / other < 4.3  # second order: 4
        assert other < 2e-3
    for one, other in ((energy.neglected, half.neglected), (long.turned, short.turned)):
        assert_allclose(one, other, rtol=0.02)  # is of the equation, not of the steps


def test_a_link_that_the_drive_carries_is_counted_too() -> None:
    """A stiff crank, carried along by the drive or elastic: the same energies; gravity's work is that of the weights."""
    found = {}
    for crank in ("rigid", "beam"):
        raw = example("four_bar_beams", 720)
        raw["drive"]["motion"]["speed"] = "60 rpm"
        raw["gravity"] = [0, -9.81, 0]
        raw["links"]["crank"]["model"] = crank
        balance, found[crank], kept = audited_too(raw)
        assert max(balance.energy, kept.linear, kept.angular) < 1e-4
    ready, _ = prepared(scene_from(raw))
    motion = blocks(ready)[-1].motion
    weights = 0.0
    for link, body in zip(ready.model.links, ready.model.bodies, strict=True):
        m, first = link.one @ link.m1[:, 0], link.mX.T @ link.one
        drawn, now = first[1], m * motion.p[-1, body, 1] + motion.R[-1, body, 1] @ first
        weights -= 9.81 * (now - drawn)
    for energies in found.values():
        assert_allclose(energies["work"][-1, 0], weights, rtol=2e-3)  # links sag a little
    for name in ("kinetic", "work"):
        assert_allclose(found["rigid"][name], found["beam"][name], atol=5e-3 * np.abs(found["beam"][name]).max())


def test_sliders_and_gravity_balance() -> None:
    scene = read_scene(EXAMPLES / "slider_crank_solids" / "scene.toml")
    links = {
        name: link if link.shape is None else link.model_copy(update={"reduction": "modal"})
        for name, link in scene.links.items()
    }
    ready, _ = prepared(scene.model_copy(update={"links": links}))
    account, run = Account(ready.model), blocks(ready)[:3]
    for block in run:
        account.rows(block)
    kept = momentum(ready.model, run)
    assert max(account.balance.energy, kept.linear, kept.angular) < 1e-4


def test_a_drive_that_speeds_up_an_arm_does_the_work_of_its_kinetic_energy() -> None:
    """½ J Ω², J = m L²/3 + m h²/12 of a bar that turns about its end."""
    speed = 10.0
    motion = {"kind": "ramp", "speed": speed, "time": 0.5}
    _, energies = audited(arm(BEAM, motion, analysis={"end_time": 0.6, "step": 1e-3}))
    J = MASS * (L**2 / 3 + SIDE**2 / 12)
    assert_allclose(energies["kinetic"][-1], 0.5 * J * speed**2, rtol=1e-3)
    assert_allclose(energies["work"][-1], [0.0, 0.5 * J * speed**2], rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize("link", [BEAM, {"mesh": {"elements": [4, 1, 1]}, "reduction": "modal"}])
def test_gravity_gives_the_drive_back_what_an_arm_falls(link: dict[str, Any]) -> None:
    """m g L/2 from upright to level."""
    raw = arm(
        link, {"kind": "cycloidal", "angle": "90 deg", "rise": 1.0}, gravity=[-9.81, 0, 0],
        analysis={"end_time": 1.0, "step": 2e-3, "initial": "quasi-static"},
    )  # fmt: skip
    _, energies = audited(raw)
    fall = MASS * 9.81 * L / 2
    assert_allclose(energies["work"][-1], [fall, -fall], rtol=1e-3)


def test_damping_takes_what_a_vibrating_arm_loses() -> None:
    """A load put on at once and left: the strain energy of its sag is dissipated in the end, the load does twice that."""
    raw = arm(
        BEAM, {"kind": "constant_speed", "speed": 1e-6}, gravity=[0, -9.81, 0], damping={"alpha": 0, "beta": 2e-4},
        analysis={"end_time": 0.6, "step": 2e-4, "rho_inf": 1.0},
    )  # fmt: skip
    found, energies = audited(raw)
    sag = 0.5 * (RHO * SIDE**2 * 9.81) ** 2 * L**5 / 20 / (E * SIDE**4 / 12)  # ½ ∫ q w of Euler-Bernoulli
    assert_allclose(energies["strain"][-1], sag, rtol=5e-3)  # and shear
    assert_allclose(energies["dissipated"][-1], sag, rtol=5e-3)
    assert_allclose(energies["work"][-1, 0], 2 * sag, rtol=5e-3)
    assert found.energy < 1e-3


def test_without_the_neglected_work_the_linear_equation_does_not_balance() -> None:
    """The four-bar of [KED] at 600 rpm: K turns with the rigid-body motion, a tenth of the energy is lost on that."""
    found, energies = audited(example("four_bar_beams", 720))
    left, neglected = (np.abs(energies[x]).max() for x in ("residual", "neglected"))
    assert left < 2e-3 * neglected
    assert found.neglected > 0.05


def test_frames_that_follow_neglect_nothing() -> None:
    """But for α, whose forces the rigid-body frame holds, as with rigid-body frames."""
    raw = example("four_bar_beams", 180, frames="co-rotational")
    neglected = []
    for damping in ({"beta": 3e-5}, {"alpha": 5}):
        raw["damping"] = damping
        neglected.append(np.abs(audited(raw)[1]["neglected"]).max())
    assert neglected[0] == 0.0
    assert neglected[1] > 0.0


def test_the_account_does_not_know_how_the_time_points_come_in_blocks() -> None:
    ready, _ = prepared(scene_from(example("four_bar_beams", 360)))
    whole, parts = Account(ready.model), Account(ready.model)
    for block in blocks(ready):
        once = whole.rows(block)["residual"]
        cut = max(1, len(block) // 3)
        pieces = [block.part(0, cut), block.part(cut, len(block))] if len(block) > 1 else [block]
        twice = np.concatenate([parts.rows(piece)["residual"] for piece in pieces])
        assert_allclose(twice, once, rtol=1e-9, atol=1e-12)
        assert parts.rows(pieces[-1])["residual"] is parts.rows(pieces[-1])["residual"]
    for name in Balance.__slots__:
        assert getattr(parts.balance, name) == pytest.approx(getattr(whole.balance, name))


def test_a_run_says_what_is_left_over_and_warns_when_that_is_much(tmp_path: Path) -> None:
    raw = example("four_bar_beams", 60, initial="rest", revolutions=2)
    raw["output"] = {"folder": str(tmp_path), "animation": False, "plots": False, "picture": False}
    done = analyse(scene_from(quick(raw)))
    assert done.balance is not None
    assert done.balance.energy > 0.02
    assert any("residual of the balance" in warning for warning in done.warnings)
    table = next(x for x in run_tables(scene_from(raw), done) if "Balance" in str(x.title))
    assert table.row_count == 2
    assert done.results.channels["energy/residual"][1].shape == (121, 1)
    assert balance_warning(Balance(energy=0.003)) == ()
    assert balance_warning(Balance(energy=0.03)) != ()


@pytest.mark.parametrize(("neglected", "rows"), [(0.0, 1), (5e-59, 1), (2e-3, 2)])
def test_the_table_of_the_balance_leaves_rounding_out(neglected: float, rows: int) -> None:
    assert balance_table(Balance(1e-4, neglected)).row_count == rows
