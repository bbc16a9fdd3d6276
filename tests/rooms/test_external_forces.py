"""Pressures, torques and their factors: what statics says of them, on every kind of link."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.loads import amounts, patterns
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.errors import SceneError
from kedfem.links.record import Link, in_space
from kedfem.motion.linkage import linkage
from kedfem.motion.rigid import rigid_motion
from kedfem.results.recording import recording
from kedfem.scene import drive_angle, factor_table, load_factor, scene_from
from tests import scenes
from tests.scenes import constant_speed

L, W, T, E, NU = 0.2, 0.02, 0.01, 2.0e11, 0.3
BAR = scenes.bar(L, W, T)["shape"]
PLATE = {"kind": "plate_link", "between": [[0, 0], [L, 0]], "width": 0.04, "thickness": T, "bore_diameter": 0.02}
KINDS: dict[str, dict[str, Any]] = {
    "solid": {"shape": PLATE, "mesh": {"size": 0.01}},
    "bar": {"shape": BAR, "mesh": {"elements": [8, 1, 1]}},
    "tetrahedra": {"shape": PLATE, "mesh": {"size": 0.01}, "element": "tet10"},
    "bar of tetrahedra": {"shape": BAR, "mesh": {"elements": [8, 1, 1]}, "element": "tet10"},
    "reduced": {"shape": PLATE, "mesh": {"size": 0.01}, "reduction": 20},
    "plane": {"model": "plane", "shape": PLATE, "mesh": {"size": 0.01}},
    "edge": {"model": "plane", "shape": BAR},
    "beam": {"model": "beam", "shape": BAR, "mesh": {"elements": 4}},
    "spatial": {"model": "beam", "beam": "spatial", "shape": BAR, "mesh": {"elements": 4}},
    "rigid": {"model": "rigid", "shape": PLATE},
}
PLANAR = {"plane", "edge", "beam"}
MATERIAL = scenes.material(7850.0, E, NU)


def arm(kind: str, loads: dict[str, Any], speed: float = 1e-6, **analysis: Any) -> dict[str, Any]:
    """A cantilever on the driven hinge at the origin, standing nearly still."""
    return scenes.arm(
        {"material": "m", **KINDS[kind]},
        constant_speed(speed),
        materials={"m": MATERIAL},
        loads=loads,
        analysis={"end_time": 1e-4, "step": 1e-5, "initial": "quasi-static", **analysis},
    )


def wrench(link: Link, forces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Resultant force and moment about the origin of forces on a link's functions, in the reference position."""
    if link.kind == "beam":
        moment = (link.X[:, 0] @ forces[:, 1] - link.X[:, 1] @ forces[:, 0]) + forces[:, 2].sum()
        return np.array([*(link.one @ forces)[:2], 0.0]), np.array([0.0, 0.0, moment])
    each = in_space(link, forces)
    return link.one @ each, np.cross(link.X, each).sum(axis=0)


def at_start(raw: dict[str, Any]) -> tuple[Link, np.ndarray]:
    """The link and its deflection at the start."""
    ready, _ = prepared(scene_from(raw))
    block = next(iter(transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model))))
    return ready.model.links[0], block.links[0].u[0]


# -- torques ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "rigid"])
@pytest.mark.parametrize("frame", ["world", "link"])
def test_a_torque_is_a_couple(kind: str, frame: str) -> None:
    """No force, the moment that is asked for, wherever the link has turned."""
    m = np.array([0.0, 0.0, 3.0] if kind in PLANAR else [1.0, -2.0, 3.0])
    load = {"kind": "torque", "link": "arm", "at": [L, 0], "vector": m.tolist(), "frame": frame}
    raw = arm(kind, {"t": load}, speed=1.0, end_time=1.0, step=0.1)
    ready, _ = prepared(scene_from(raw))
    (link,), (body,), (loads,) = ready.model.links, ready.model.bodies, ready.model.loads
    t = np.array([0.0, 1.3])
    motion = rigid_motion(ready.linkage, ready.path, t, drive_angle(ready.scene.motion, t))
    for k, R in enumerate(motion.R[:, body]):
        force, moment = np.zeros(3), np.zeros(3)
        for load_ in loads:
            f, about = wrench(link, load_.forces)
            share = amounts(load_, motion, body)[k]
            force, moment = force + share * R @ f, moment + share * R @ about
        assert_allclose(force, 0, atol=1e-10)
        assert_allclose(moment, R @ m if frame == "link" else m, atol=1e-10)


@pytest.mark.parametrize("kind", ["beam", "spatial", "bar", "bar of tetrahedra"])
def test_a_torque_turns_the_end_of_a_cantilever_by_ml_over_ei(kind: str) -> None:
    """Rotation M L / E I and deflection M L² / 2 E I; a solid's drive holds the end's face instead of a section."""
    M = 2.0
    link, u = at_start(arm(kind, {"t": {"kind": "torque", "link": "arm", "at": [L, 0], "vector": [0, 0, M]}}))
    inertia = T * W**3 / 12
    end = np.isclose(link.X[:, 0], L) & np.isclose(link.one, 1) & np.isclose(link.X[:, 1], 0)
    assert_allclose(u[end, 1].mean(), M * L**2 / (2 * E * inertia), rtol=0.02 if kind.startswith("bar") else 1e-6)
    if kind == "beam":
        assert_allclose(u[end, 2], M * L / (E * inertia), rtol=1e-6)


def test_a_torque_about_its_axis_twists_a_beam() -> None:
    link, u = at_start(arm("spatial", {"t": {"kind": "torque", "link": "arm", "at": [L, 0], "vector": [2.0, 0, 0]}}))
    ends = np.flatnonzero(np.isclose(link.X[:, 0], L) & (link.one != 0))
    slopes = u[ends[0] + 1 :]
    across = link.X[ends[0] + 1 :]
    twist = np.cross(across, slopes)[np.abs(across).max(axis=1) > 0.5, 0]
    J = W * T**3 * (1 / 3 - 0.21 * T / W * (1 - T**4 / (12 * W**4)))  # Roark
    assert_allclose(twist[-2:], 2.0 * L / (E / 2 / (1 + NU) * J), rtol=0.01)


@pytest.mark.parametrize("kind", ["solid", "tetrahedra", "plane"])
def test_a_torque_at_a_joint_is_that_on_its_bore(kind: str) -> None:
    here, there = (
        at_start(arm(kind, {"t": {"kind": "torque", "link": "arm", **place, "vector": [0, 0, 2.0]}, **push}))[1]
        for place in ({"at": [0, 0]}, {"joint": "A"})
        for push in [{"f": {"kind": "force", "link": "arm", "at": [L, 0.02], "vector": [0, 5]}}]
    )
    assert np.abs(here).max() > 0
    assert_allclose(here, there, atol=1e-12 * np.abs(here).max())


def test_a_drive_takes_the_torque_on_the_link_that_it_carries() -> None:
    """Two links: the crank is rigid and goes with the drive."""
    raw = arm("rigid", {"t": {"kind": "torque", "link": "arm", "at": [L, 0], "vector": [0, 0, 4.0], "frame": "link"}})
    raw["links"]["tip"] = {
        "material": "m", "model": "beam",
        "shape": {"kind": "bar", "between": [[L, 0], [2 * L, 0]], "width": W, "thickness": T},
    }  # fmt: skip
    raw["joints"]["B"] = {"kind": "weld", "links": ["arm", "tip"], "at": [L, 0], "axis": "z"}
    scene = scene_from(raw)
    model = elastic_model(scene, linkage(scene))
    (carried,) = model.prescribed
    (load,) = carried.loads
    force, moment = wrench(carried.link, load.forces)
    assert_allclose(force, 0, atol=1e-10)
    assert_allclose(moment, [0, 0, 4.0], atol=1e-10)


# -- pressure -----------------------------------------------------------------------------------------------


def ring(what: str, a: float, b: float, at: list[float], pressure: float) -> Link:
    """A ring about the origin and the forces of a pressure on one of its faces."""
    raw = arm("bar", {"p": {"kind": "pressure", "link": "ring", "at": at, "pressure": pressure}})
    outline = [[b, 0], {"via": [0, b], "to": [-b, 0]}, {"via": [0, -b], "to": [b, 0]}]
    shape = {"kind": "extrusion", "outline": outline, "holes": [{"at": [0, 0], "diameter": 2 * a}], "thickness": T}
    kind = {"element": "tet10"} if what == "tet10" else {"model": what}
    raw["links"] = {"ring": {"material": "m", **kind, "shape": shape, "mesh": {"size": 0.012}}}
    raw["joints"]["A"]["links"] = ["ground", "ring"]
    scene = scene_from(raw)
    model = elastic_model(scene, linkage(scene))
    return model.links[0], model.loads[0][0].forces


@pytest.mark.parametrize("what", ["plane", "solid", "tet10"])
@pytest.mark.parametrize("inner", [True, False], ids=["in the bore", "outside"])
def test_a_ring_under_pressure_is_that_of_lame(what: str, inner: bool) -> None:
    """Plane stress: u = p a / E / (b² − a²) · ((1 − ν) a² + (1 + ν) b²) in the bore under a pressure there."""
    a, b, p = 0.02, 0.04, 1.0e7
    link, forces = ring(what, a, b, [a, 0] if inner else [0, b], p)
    assert_allclose(forces.sum(axis=0), 0, atol=1e-9 * p * a * T)
    K = link.K0.toarray()
    rows = [np.eye(link.d)[k] * np.ones((link.n, 1)) for k in range(link.d)]
    rows += [
        link.X[:, [i]] * np.eye(link.d)[j] - link.X[:, [j]] * np.eye(link.d)[i] for i in range(link.d) for j in range(i)
    ]
    B = np.linalg.qr(np.stack([x.ravel() for x in rows], axis=1))[0]
    u = np.linalg.solve(K + np.trace(K) / len(K) * B @ B.T, forces.ravel()).reshape(forces.shape)
    r = np.linalg.norm(link.X[:, :2], axis=1)
    at_bore = np.isclose(r, a, rtol=1e-4)
    radial = np.einsum("nk,nk->n", u[at_bore, :2], link.X[at_bore, :2]) / a
    wanted = (
        p * a / E / (b**2 - a**2) * ((1 - NU) * a**2 + (1 + NU) * b**2)
        if inner
        else -2 * p * a * b**2 / E / (b**2 - a**2)
    )
    # a ring that nothing holds may have moved as a whole
    waves = np.column_stack([np.ones(len(radial)), link.X[at_bore, :2]])
    # tetrahedra of the same nodes err by 1.3e-3
    cap = 2e-3 if what == "tet10" else 1e-3
    assert_allclose(np.linalg.lstsq(waves, radial)[0][0], wanted, rtol=cap)


@pytest.mark.parametrize("kind", ["bar", "bar of tetrahedra", "edge"])
def test_a_pressure_pushes_on_its_face(kind: str) -> None:
    """On the end: −p A along the axis, whatever the mesh."""
    raw = arm(kind, {"p": {"kind": "pressure", "link": "arm", "at": [L, 0], "pressure": "2 MPa"}})
    link, u = at_start(raw)
    (pattern,) = patterns(scene_from(raw), {"arm": link})["arm"]
    force, moment = wrench(link, pattern.forces)
    assert_allclose(force, [-2e6 * W * T, 0, 0], atol=1e-9 * 2e6 * W * T)
    assert_allclose(moment, 0, atol=1e-9)
    end = np.isclose(link.X[:, 0], L)
    assert_allclose(u[end, 0].mean(), -2e6 * L / E, rtol=0.02)
    assert pattern.follows


# -- factors ------------------------------------------------------------------------------------------------


def factor_of(**table: Any) -> Any:
    load = {"kind": "force", "link": "arm", "at": [L, 0], "vector": [0, 1], "factor": table}
    return scene_from(arm("beam", {"f": load})).loads["f"].factor


def test_a_factor_repeats_after_its_period() -> None:
    factor = factor_of(over="angle", at=["10 deg", "100 deg"], value=[1.0, -2.0], period="360 deg")
    turn = 2 * np.pi
    phi = np.radians([10.0, 55.0, 100.0, 235.0, 370.0, -260.0, 5.0])
    wanted = [1.0, -0.5, -2.0, -0.5, 1.0, -2.0, 1.0 - 3.0 * 5 / 270]
    t = np.full(len(phi), 7.0)
    for whole in (-3, 0, 5):
        assert_allclose(load_factor(factor, t, phi + whole * turn), wanted, atol=1e-12)
    assert_allclose(load_factor(factor_of(at=[0.0, 1.0], value=[0.0, 1.0], period=2.0), np.array([0.5, 1.5, 2.25])),
                    [0.5, 0.5, 0.25])  # fmt: skip


def test_a_table_as_long_as_its_period_jumps_where_its_ends_differ() -> None:
    factor = factor_of(over="angle", at=[0.0, 1.0], value=[0.0, 1.0], period=1.0)
    phi = np.array([0.0, 0.25, 0.999, 1.25, -0.25])
    assert_allclose(load_factor(factor, 0 * phi, phi), [0.0, 0.25, 0.999, 0.25, 0.75], atol=1e-12)


def test_a_force_over_the_angle_is_that_over_time_at_constant_speed() -> None:
    speed, at, value = 20.0, np.array([0.0, 0.4, 0.7, 2.5]), [0.0, 1.0, -1.0, 0.5]
    found = []
    for table in ({"over": "angle", "at": at.tolist()}, {"time": (at / speed).tolist()}):
        load = {"kind": "force", "link": "arm", "at": [L, 0], "vector": [0, 50.0], "factor": {**table, "value": value}}
        raw = arm("beam", {"f": load}, speed=speed, revolutions=0.5, steps_per_revolution=200, initial="rest")
        del raw["analysis"]["end_time"], raw["analysis"]["step"]
        ready, _ = prepared(scene_from(raw))
        solver = steps_of(ready.scene, ready.model)
        blocks = transient(ready.scene, ready.linkage, ready.path, ready.model, solver)
        found.append(np.concatenate([block.links[0].u for block in blocks]))
    assert np.abs(found[0]).max() > 1e-5
    assert_allclose(found[0], found[1], atol=1e-12 * np.abs(found[0]).max())


def test_a_factor_comes_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "cut.csv").write_text("angle [deg], factor\n0, 0\n90, 2\n")
    load = {
        "kind": "force", "link": "arm", "at": [L, 0], "vector": [0, 1],
        "factor": {"over": "angle", "file": "cut.csv", "period": "180 deg"},
    }  # fmt: skip
    factor = scene_from(arm("beam", {"f": load}), tmp_path).loads["f"].factor
    assert_allclose(load_factor(factor, np.zeros(2), np.array([np.pi / 4, 1.25 * np.pi])), [1.0, 1.0])
    (tmp_path / "cut.csv").write_text("0, 0\n90, two\n")
    with pytest.raises(SceneError, match=r"loads.f.factor.file: cut.csv, line 2: must be two numbers, angle and factor"):
        scene_from(arm("beam", {"f": load}), tmp_path)


# -- without a drive ----------------------------------------------------------------------------------------

SPUN: dict[str, tuple[str, dict[str, Any], float]] = {
    "force on a beam": ("beam", {"kind": "force", "at": [L, 0], "vector": [0, 50.0], "frame": "link"}, 50 * L),
    "force on a solid": ("bar", {"kind": "force", "at": [L, 0], "vector": [0, 50.0], "frame": "link"}, 50 * L),
    "force on a spatial beam": ("spatial", {"kind": "force", "at": [L, 0], "vector": [0, 50.0], "frame": "link"}, 50 * L),
    "pressure on a solid": ("bar", {"kind": "pressure", "at": [0.19, -W / 2], "pressure": 5e4}, 5e4 * L * T * L / 2),
    "pressure on a plane": ("edge", {"kind": "pressure", "at": [0.19, -W / 2], "pressure": 5e4}, 5e4 * L * T * L / 2),
    "torque on a beam": ("beam", {"kind": "torque", "at": [L, 0], "vector": [0, 0, 10.0]}, 10.0),
    "torque on a plane": ("plane", {"kind": "torque", "at": [L, 0], "vector": [0, 0, 10.0]}, 10.0),
    "torque on a solid": ("bar", {"kind": "torque", "at": [L, 0], "vector": [0, 0, 10.0], "frame": "link"}, 10.0),
}  # fmt: skip


def spun(kind: str, load: dict[str, Any]) -> dict[str, np.ndarray]:
    """Channels of a link on a hinge that a load turns from rest, by about half a revolution."""
    raw = arm(kind, {"load": {"link": "arm", **load}}, end_time=0.05, step=2.5e-4, initial="rest", rho_inf=0.8)
    del raw["drive"]
    raw["joints"]["A"]["links"] = ["arm", "ground"]
    ready, _ = prepared(scene_from(raw))
    solver = steps_of(ready.scene, ready.model)
    blocks = list(transient(ready.scene, ready.linkage, ready.path, ready.model, solver))
    return {
        x.channel.name: np.concatenate([x.rows(block)[:, 0] for block in blocks])
        for x in recording(ready.scene, ready.model)
    }


@pytest.mark.parametrize(
    "name", [pytest.param(x, marks=pytest.mark.long if x == "force on a beam" else ()) for x in SPUN]
)
def test_a_load_turns_with_a_link_that_nothing_leads(name: str) -> None:
    """Its moment about the hinge does not change as the link turns: work M φ, all of it kinetic energy at last."""
    kind, load, moment = SPUN[name]
    found = spun(kind, load)
    angle, work = found["joints/A/angle"], found["energy/work"]
    assert angle[-1] > 1.0
    assert_allclose(work[-1], moment * angle[-1], rtol=5e-3)  # the angle is that of the hub, before the bend
    assert_allclose(found["energy/kinetic"][-1], moment * angle[-1], rtol=2e-2)


def test_a_table_over_time_is_written_out_period_by_period() -> None:
    factor = factor_of(at=[0.1, 0.2, 0.5], value=[0.0, 1.0, -1.0], period=0.6)
    at, value = factor_table(factor, 2.0)
    t = np.linspace(0, 2, 997)
    assert_allclose(np.interp(t, at, value), load_factor(factor, t), atol=1e-12)
