"""Co-rotational frames in runs: large bodies as small ones, and joints by constraint equations in them."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import kedfem.dynamics.stepping.solvers as runs
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.stepping.solvers import FREE, steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system import layout
from kedfem.dynamics.system.steps import Steps
from kedfem.results.audit import Account
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.recording import recording
from kedfem.scene import scene_from
from tests.laws.test_capabilities import as_a_run
from tests.moving import bar, cardan, geared, inverted, turned, two_drives
from tests.rooms.test_force_elements_on_links import four_bar
from tests.spatial_joints import BEAMS
from tests.systems import against_oracle, begun

Raw = dict[str, Any]
Channels = dict[str, np.ndarray]
REST = {"initial": "rest"}


def channels(raw: Raw, solver_of: Any = steps_of) -> tuple[Steps, Channels, float]:
    """All that a run records, over time; how far drives' efforts and their work are apart, of the energy."""
    ready, _ = prepared(scene_from(raw))
    solver = solver_of(ready.scene, ready.model)
    account = Account(ready.model)
    every = recording(ready.scene, ready.model, account, along=ready.path)
    checks = CrossChecks(ready.scene, ready.linkage, [x.channel for x in every], account)
    out: dict[str, list[np.ndarray]] = {x.channel.name: [] for x in every}
    for block in transient(ready.scene, ready.linkage, ready.path, ready.model, solver):
        rows = {x.channel.name: x.rows(block) for x in every}
        checks.add(block, rows)
        for name, x in rows.items():
            out[name].append(x)
    return solver, {name: np.concatenate(x) for name, x in out.items()}, checks.unworked


def alike(got: Channels, wanted: Channels, within: float) -> None:
    """Of the largest value of all channels of the same kind."""
    assert got.keys() == wanted.keys()
    kinds = {name: (name.partition("/")[0], name.rpartition("/")[2] * ("energy" not in name)) for name in wanted}
    for name, x in wanted.items():
        size = max(np.abs(y).max() for like, y in wanted.items() if kinds[like] == kinds[name])
        assert np.abs(got[name] - x).max() <= within * size, name


def first_alone(every: Mapping[str, Any]) -> list[Any]:
    """The first of some cases, and the others where long ones run."""
    return [pytest.param(name, marks=[pytest.mark.long] * bool(k)) for k, name in enumerate(every)]


MESHED = {
    "plane links": lambda: four_bar("co-rotational", "plane", steps=36, analysis=REST),
    "damped, rho_inf 0.8": lambda: four_bar(
        "co-rotational", "plane", steps=36, damping={"beta": 1e-5, "alpha": 1.0}, analysis={**REST, "rho_inf": 0.8}
    ),
    "quasi-static solids": lambda: four_bar("co-rotational", "solid", steps=36),
    "a sliding block": lambda: with_analysis(inverted("plane"), revolutions=0.02, frames="co-rotational"),
}  # fmt: skip


def with_analysis(raw: Raw, **more: Any) -> Raw:
    return {**raw, "analysis": {**raw["analysis"], **more}}


@pytest.mark.parametrize("name", first_alone(MESHED))
def test_bodies_with_sparse_factors_move_as_those_with_dense_matrices(name: str, monkeypatch: Any) -> None:
    """All that is recorded; both to the tolerance of scenes without a drive."""
    monkeypatch.setattr(runs, "CONVERGED", FREE)
    _, dense, _ = channels(MESHED[name]())
    monkeypatch.setattr(layout, "SMALL", 0)
    solver, sparse, _ = channels(MESHED[name]())
    assert solver.corotational
    assert not any(solver.ready.bodies.dense)
    alike(sparse, dense, 1e-7)


def stiffer(raw: Raw, times: float) -> Raw:
    """Links that bend so much less, and shafts that give so much less."""
    steel = {"density": 7850, "youngs_modulus": 2.1e11 * times, "poisson_ratio": 0.3}
    links = {k: {**x, "material": "m"} if "material" in x else x for k, x in raw["links"].items()}
    raw = {**raw, "materials": {"m": steel}, "links": links}
    shaft = raw.get("drive", {}).get("shaft_stiffness")
    return raw if shaft is None else {**raw, "drive": {**raw["drive"], "shaft_stiffness": times * shaft}}


def shorter(raw: Raw) -> Raw:
    """Half of the time."""
    return with_analysis(raw, **{k: x / 2 for k, x in raw["analysis"].items() if k in {"revolutions", "end_time"}})


def off_its_surface(raw: Raw) -> Raw:
    """The slide's first link is the arm, whose face has its middle 30 mm from the joint's point."""
    slide = {**raw["joints"]["S"], "links": ["arm", "block"]}
    return {**raw, "joints": {**raw["joints"], "S": slide}}


DRIVEN = {
    **{kind: make for kind, make in BEAMS.items() if kind != "bushings"},
    "sliding block": inverted,
    "sliding block of plane links": lambda: off_its_surface(with_analysis(inverted("plane"), revolutions=0.02)),
    "shaft of universal joints": cardan,
    "gears": geared,
    "two drives": two_drives,
}
SOON = {"screw", "sliding block of plane links", "gears"}


@pytest.mark.parametrize("kind", [pytest.param(x, marks=[] if x in SOON else pytest.mark.long) for x in DRIVEN])
def test_joints_by_constraint_equations_bear_in_stiff_links_what_they_do_in_rigid_body_frames(kind: str) -> None:
    """Joint forces, drives, gears, energies: the rest falls with compliance. Efforts do the work."""
    raw = with_analysis(stiffer(shorter(DRIVEN[kind]()), 100.0), rho_inf=0.8)
    _, wanted, _ = channels(raw)
    solver, got, unworked = channels(with_analysis(raw, frames="co-rotational"))
    assert solver.corotational
    alike({k: x for k, x in got.items() if not k.startswith("energy/")},
          {k: x for k, x in wanted.items() if not k.startswith("energy/")}, 0.01)  # fmt: skip
    exchanged = np.abs(got["energy/work"]).max() + np.abs(got["energy/kinetic"]).max()
    assert np.abs(got["energy/residual"]).max() < 3e-3 * exchanged
    assert unworked < 1e-3


def test_the_effort_of_a_drive_is_its_work_where_links_bend() -> None:
    """A crank and an arm on which a block slides, half a revolution: ∫ T dφ is the work of supports, bent arm and all."""
    raw = with_analysis(inverted(), frames="co-rotational", revolutions=0.5, steps_per_revolution=480, rho_inf=0.8)
    _, got, unworked = channels(raw)
    assert np.abs(got["energy/work"][:, 1]).max() > 5.0  # J
    assert unworked < 1e-5


def test_gears_hold_without_a_drive() -> None:
    """Two arms geared 1 : −1, 1 N m on the first: T t²/2 over both inertias, m (L²/3 + w²/12) each; as far back."""
    links = {"one": bar("beam", (0, 0), (0.3, 0), 1), "two": bar("beam", (0.5, 0), (0.8, 0), 1)}
    joints = {
        name: {"kind": "revolute", "links": ["ground", link], "at": [x, 0]}
        for name, link, x in (("A", "one", 0.0), ("B", "two", 0.5))
    }
    raw: Raw = {
        "links": links, "joints": joints, "gears": {"g": {"joints": ["A", "B"], "ratio": -1.0}},
        "motors": {"m": {"joint": "A", "torque": 1.0}}, "analysis": {"end_time": 0.1, "step": 1e-3, "rho_inf": 0.8},
    }  # fmt: skip
    _, got, _ = channels(raw)
    inertia = 2 * 7850 * 0.03 * 0.02 * 0.3 * (0.3**2 / 3 + 0.03**2 / 12)
    one, two = (got[f"joints/{name}/angle"][-1, 0] for name in "AB")
    assert one == pytest.approx(0.5 * 0.1**2 / inertia, rel=5e-4)
    assert two == pytest.approx(-one, rel=5e-4)
    torque = got["gears/g/torque"][50:, 0]  # half of the motor's goes into the second arm
    assert np.abs(torque).mean() == pytest.approx(0.5, rel=0.02)
    assert np.abs(got["energy/residual"]).max() < 1e-3 * np.abs(got["energy/work"]).max()


def test_without_a_drive_the_same_whichever_way_the_scene_is_turned() -> None:
    """Beams in space with a cross, let go under gravity: forces of all joints, and the account of energy."""
    raw = BEAMS["universal"]()
    raw = {key: x for key, x in raw.items() if key != "drive"}
    analysis = {"end_time": 0.01, "step": 5e-4, "rho_inf": 0.8}
    R = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    _, one, _ = channels({**raw, "analysis": analysis})
    _, other, _ = channels(turned({**raw, "analysis": analysis}, R, (0.3, -0.2, 0.1)))
    forces = [name for name in one if name.endswith("/force")]
    assert len(forces) >= 3
    for name in forces:
        size = np.abs(one[name]).max()
        assert np.abs(one[name] @ R.T - other[name]).max() < 1e-6 * size, name
    assert np.abs(one["energy/residual"]).max() < 3e-3 * np.abs(one["energy/kinetic"]).max()


ON_SLIDE: dict[str, Raw] = {
    "motor over travel": {
        "motors": {"m": {"joint": "S", "force": {"over": "travel", "at": [-1, 1], "value": [1e3, -1e3]}}}
    },
    "spring and damper": {
        "springs": {"s": {"kind": "spring", "joint": "S", "stiffness": 2e4, "damping": 50.0, "preload": 300.0}}
    },
}


@pytest.mark.parametrize("acting", first_alone(ON_SLIDE))
def test_motors_and_springs_along_a_slide_that_turns(acting: str) -> None:
    """A block on an arm about 0.4 m from its pivot: the drive's torque is that of rigid links, the work as counted."""
    raw = with_analysis(stiffer(inverted(), 100.0), frames="co-rotational", rho_inf=0.8)
    _, got, unworked = channels({**raw, **ON_SLIDE[acting]})
    torque, rigid = got["drive/torque"], got["drive/rigid_torque"]
    plain = channels(raw)[1]["drive/rigid_torque"]
    assert np.abs(rigid - plain).max() > 0.5 * np.abs(rigid).max()  # N m, of the slide's force
    assert np.abs(torque - rigid).max() < 0.01 * np.abs(rigid).max()
    assert unworked < 1e-3
    (travel,) = (x[:, 0] for name, x in got.items() if name.endswith("/travel"))
    phi = np.linspace(0, np.pi / 2, len(travel))
    drawn = np.hypot(0.1 * np.sin(phi), 0.3 + 0.1 * np.cos(phi)) - 0.4
    assert np.abs(np.abs(travel) - np.abs(drawn)).max() < 1e-4


@pytest.mark.long
def test_a_torque_about_a_cylindrical_joint_is_between_its_links() -> None:
    """Between crank and rod of a loop in space: as much from the drive as inverse dynamics says, in both frames."""
    raw = with_analysis(stiffer(shorter(BEAMS["cylindrical"]()), 100.0), rho_inf=0.8)
    (name,) = (key for key, joint in raw["joints"].items() if joint["kind"] == "cylindrical")
    for frames in ("rigid-body", "co-rotational"):
        acting = {"motors": {"m": {"joint": name, "torque": 40.0}}}
        _, got, unworked = channels({**with_analysis(raw, frames=frames), **acting})
        rigid = got["drive/rigid_torque"]
        assert np.abs(got["drive/torque"] - rigid).max() < 0.02 * np.abs(rigid).max()
        assert unworked < 1e-3


def test_loads_that_turn_stand_beside_joints_by_constraint_equations() -> None:
    """As by the oracle, with a block that slides on the loaded arm."""
    load = {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, 100.0], "frame": "link"}
    raw = with_analysis(inverted(), frames="co-rotational", initial="rest", rho_inf=0.8) | {"loads": {"P": load}}
    assert against_oracle(as_a_run(begun(raw))) < 1e-7
