"""Motors, springs and dampers: forces that do the work of their coordinate, whatever moves, and balance by themselves."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.force_elements import force_elements, law_of, places
from kedfem.dynamics.history import Block, LinkHistory
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_elements import OnLink, RigidElement, RigidElements, effort, rigid_elements
from kedfem.dynamics.system.ends import rigid_end
from kedfem.dynamics.system.forces.exerted import at_ends
from kedfem.dynamics.system.forces.poses import value
from kedfem.dynamics.system.forces.supports import exerted, supports
from kedfem.dynamics.system.record import ANGLE, COORDINATE, DISTANCE, GAP, RATE, TIME, Curve, Spring, Stop, Term
from kedfem.errors import MeshError, SceneError
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.motion.rigid import RigidMotion, resting
from kedfem.results.forces.force_elements import element_channels, element_forces
from kedfem.results.recording import recording
from kedfem.scene import Factor, Pieces, Scene, pieces, scene_from
from tests.force_vectors import TURN, ForceElement, coordinate, placed, wrench
from tests.force_vectors import force_elements as by_vectors
from tests.laws.strategies import examples
from tests.moving import ran
from tests.rooms.test_driven_efforts import ON_CRANK, four_bar
from tests.scenes import bar

Z = np.array([0.0, 0.0, 1.0])
NONE = np.zeros(3)


def straight(at: tuple[float, ...], value: tuple[float, ...]) -> Pieces:
    return pieces(Factor(at=at, value=value))


def gradient(element: ForceElement, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """∂q/∂x (T, 2, 2, 3) of any state, by central differences."""
    out, h = np.zeros_like(x), 1e-5
    for at in np.ndindex(x.shape[1:]):
        moved = np.zeros(x.shape[1:])
        moved[at] = h
        change = coordinate(element, x + moved) - coordinate(element, x - moved)
        whole = 2 * np.pi if element.kind == TURN else np.inf
        out[:, *at] = (change - (np.round(change / whole) * whole if np.isfinite(whole) else 0.0)) / (2 * h)
    return out


def unit(seed: int) -> np.ndarray:
    n = np.random.default_rng(seed).normal(size=3)
    return np.asarray(n / np.linalg.norm(n))


# -- coordinates and what they exert, of links that do not deform ----------------------------------------------


def moving(theta: np.ndarray, p: np.ndarray, t: np.ndarray) -> RigidMotion:
    """Bodies that turn by theta (B, 3) and move by p (B, 3) in a second, at steady rates."""
    at = resting(len(theta), t)
    at.R[:] = [[Rotation.from_rotvec(s * each).as_matrix() for each in theta] for s in t]
    at.p[:], at.v[:], at.omega[:] = t[:, None, None] * p, p, theta
    return at


def term(kind: int, axis: np.ndarray) -> Term:
    """A coordinate; the directions of an angle are drawn turned by 0.4 rad about its axis."""
    if kind != ANGLE:
        return Term(kind, 0, 1, np.array([0.1, 0.2, 0.3]), np.array([1.0, -0.4, 0.2]), axis)
    e = perpendiculars(axis)[0]
    return Term(kind, 0, 1, e, e, axis)


BOTH = rigid_end(1, NONE), rigid_end(2, np.array([1.0, -0.4, 0.2]))


@pytest.mark.parametrize("axis", [Z, -Z, unit(7)], ids=["z", "-z", "oblique"])
@pytest.mark.parametrize("angle", [0.0, 1.2, -2.9, 3.1])
def test_a_hinge_tells_its_turn(axis: np.ndarray, angle: float) -> None:
    motion = moving(np.array([NONE, (angle + 0.3) * axis, 0.3 * axis]), np.zeros((3, 3)), np.ones(1))
    assert value(term(ANGLE, axis), BOTH, motion, None)[0] == pytest.approx(angle, abs=1e-12)


@pytest.mark.parametrize("kind", [ANGLE, GAP, DISTANCE])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=examples(20), deadline=None)
def test_the_work_of_a_force_is_that_of_its_coordinate(kind: int, seed: int) -> None:
    """Forces times rates of both ends are Q q', the rate by central differences; they balance, moments too."""
    rng, law = np.random.default_rng(seed), Curve(TIME, straight((0.0,), (2.5,)))
    axis = unit(seed)
    theta = rng.normal(size=(3, 3)) if kind != ANGLE else np.array([NONE, 0.7 * axis, -0.4 * axis])
    p, h, t = rng.normal(size=(3, 3)), 1e-5, 0.8
    scene = scene_from(arm("rigid"))
    rigid = linkage(scene)
    of = RigidElements([RigidElement(law, term(kind, axis), (OnLink(BOTH[0]), OnLink(BOTH[1])))], scene, rigid,
                       path(rigid, 0.0, 0.0))  # fmt: skip
    motion = moving(theta, p, np.array([t]))
    apart = value(term(kind, axis), BOTH, moving(theta, p, t + h * np.array([-1, 1])), None)
    every = list(of.wrenches(motion))
    work = 0.0
    for body, f, m in every:
        x, v, omega = motion.p[0, body], motion.v[0, body], motion.omega[0, body]
        work += float(f[0] @ (v - np.cross(omega, x)) + m[0] @ omega)
    assert work == pytest.approx(2.5 * (apart[1] - apart[0]) / (2 * h), abs=1e-7)
    for left in (sum(f for _, f, _ in every), sum(m for _, _, m in every)):
        np.testing.assert_allclose(left, 0.0, atol=1e-12)


def test_a_spring_of_no_length_has_no_direction() -> None:
    at = Term(DISTANCE, 0, 1, BOTH[1].origin, BOTH[1].origin, NONE)
    still = resting(3, np.zeros(1))
    assert value(at, BOTH, still, None)[0] == 0.0
    assert not any(x.any() for _, _, f, m in exerted(at, BOTH, still, None) for x in (f, m))


# -- laws ---------------------------------------------------------------------------------------------------


def test_springs_and_stops_push_back() -> None:
    one, q, rate = resting(1, np.zeros(3)), np.array([1.2, 0.1, -0.4]), np.array([2.0, 0.0, -1.0])
    np.testing.assert_allclose(effort(Spring(3.0, 0.5, 0.2), one, q, rate), -3 * (q - 0.2) - 0.5 * rate)
    np.testing.assert_allclose(effort(Stop(-0.2, 1.0, 10.0, 0.5), one, q, rate), [-3.0, 0.0, 2.5])
    np.testing.assert_allclose(effort(Stop(-0.2, 1.0, 10.0, 2.0), one, q, -rate), [0.0, 0.0, 0.0])  # never a pull


@pytest.mark.parametrize("over", [TIME, RATE, COORDINATE])
def test_a_curve_is_linear_between_its_points_and_held_outside(over: int) -> None:
    at, given_, s = (-1.0, 0.5, 2.0), (5.0, -1.0, 3.0), np.linspace(-2, 3, 21)
    t, rate, q = (s if over == each else np.full(21, 0.3) for each in (TIME, RATE, COORDINATE))
    got = effort(Curve(over, straight(at, given_)), resting(1, t), q, rate)
    np.testing.assert_allclose(got, np.interp(s, at, given_), atol=1e-12)


# -- on links -----------------------------------------------------------------------------------------------

BAR = bar(1, 0.04, 0.02)["shape"]
PLATE = {"kind": "plate_link", "between": [[0, 0], [1, 0]], "width": 0.04, "thickness": 0.02, "bore_diameter": 0.02}
KINDS: dict[str, dict[str, Any]] = {
    "solid": {"shape": PLATE, "mesh": {"size": 0.02}},
    "face": {"shape": BAR, "mesh": {"elements": [8, 2, 1]}},
    "plane": {"model": "plane", "shape": PLATE, "mesh": {"size": 0.02}},
    "edge": {"model": "plane", "shape": BAR},
    "beam": {"model": "beam", "shape": BAR, "mesh": {"elements": 3}},
    "spatial": {"model": "beam", "beam": "spatial", "shape": BAR, "mesh": {"elements": 3}},
    "rigid": {"model": "rigid", "shape": PLATE},
    "rigid beam": {"model": "rigid", "shape": {"kind": "polyline", "points": [[0, 0], [1, 0]], "width": 0.04,
                                                  "thickness": 0.02}},
}  # fmt: skip


def arm(kind: str, **more: Any) -> dict[str, Any]:
    return {
        "links": {"arm": {"material": "steel", **KINDS[kind]}},
        "joints": {"A": {"kind": "revolute", "links": ["arm", "ground"], "at": [0, 0], "axis": [0, 0, -1]}},
        "motors": {"m": {"joint": "A", "torque": 2.5}},
        "analysis": {"end_time": 1.0, "step": 0.01},
        **more,
    }


def built(raw: dict[str, Any]) -> tuple[Scene, Model]:
    scene = scene_from(raw)
    return scene, elastic_model(scene, linkage(scene))


def on_arm(scene: Scene, model: Model) -> RigidElements:
    rigid = linkage(scene)
    found = rigid_elements(scene, rigid, path(rigid, 0.0, 0.0), model)
    assert found is not None
    return found


def turning(model: Model, theta: np.ndarray) -> Callable[[int, np.ndarray], np.ndarray]:
    """All links turned about the origin by a rotation vector, as displacements of their functions."""

    def motion(k: int, X: np.ndarray) -> np.ndarray:
        link = model.links[k]
        u = Rotation.from_rotvec(theta).apply(np.array(X)) - X
        if link.kind == "beam":
            u[:, 2] = theta[2] * link.one
        return u[:, : link.d]

    return motion


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("angle", [0.5, -2.2])
def test_every_kind_of_link_shows_its_turn_and_takes_the_torque(kind: str, angle: float) -> None:
    """Angles count about the joint's axis, here −z, of the link named first against the ground."""
    scene, model = built(arm(kind))
    link, (element,) = model.links[0], on_arm(scene, model).every
    (looked,) = element_forces(scene, model).hinges.values()
    (block,) = blocks(model, np.array([0.0, 1.0]), np.array([angle, angle]), 2)
    for term_, on in ((element.term, element.on), looked):
        z = np.concatenate([each.unknowns(block) for each in on], axis=1)
        assert value(term_, (on[0].end, on[1].end), block.motion, z)[0] == pytest.approx(-angle, abs=1e-9)
    (forces,) = on_arm(scene, model).unit_loads(0)  # about the axis, in the reference position
    angle = 0.0
    spin = 1e-6
    u = turning(model, (angle + spin) * Z)(0, link.X) - turning(model, (angle - spin) * Z)(0, link.X)
    assert np.vdot(forces, u) / (2 * spin) == pytest.approx(-1.0, rel=1e-6)  # about z
    push = np.outer(link.one, np.ones(link.d))[:, : 2 if link.planar else 3]
    assert np.abs(np.einsum("nc,nc->c", forces[:, : push.shape[1]], push)).max() < 1e-9  # no net force


def spring(link: str, at: list[float], to: list[float], **more: Any) -> dict[str, Any]:
    return {
        "kind": "spring",
        "between": [{"link": link, "at": at}, {"link": "ground", "at": to}],
        "stiffness": 10,
        **more,
    }


def test_a_joint_that_names_the_ground_first_turns_its_link_all_the_same() -> None:
    raw = arm("beam")
    raw["joints"]["A"]["links"] = ["ground", "arm"]
    scene, model = built(raw)
    (on_link, moment), (on_ground, _) = (
        (body, m[0]) for body, _, m in on_arm(scene, model).wrenches(resting(2, np.zeros(1)))
    )
    assert (on_link, on_ground) == (1, 0)
    np.testing.assert_allclose(moment, [0, 0, -2.5], atol=1e-12)  # about the axis, −z


def test_a_spring_hangs_on_points_of_links_sliders_and_the_ground() -> None:
    springs = {"tip": spring("arm", [1, 0], [1, 2]), "shoe": spring("shoe", [1.5, 0.1], [3.5, 0.1], free_length=0)}
    raw = arm("beam", springs=springs)
    raw["links"]["shoe"] = {"model": "rigid", "mass": 1}
    raw["joints"]["B"] = {"kind": "revolute", "links": ["arm", "shoe"], "at": [1, 0]}
    raw["joints"]["S"] = {"kind": "prismatic", "links": ["shoe", "ground"], "at": [1, 0], "axis": "x"}
    raw["motors"]["push"] = {"joint": "S", "force": 4}
    scene, model = built(raw)
    every = dict(force_elements(scene))
    assert list(every) == ["motors.m", "motors.push", "springs.tip", "springs.shoe"]
    assert [law_of(every[f"springs.{name}"]) for name in ("tip", "shoe")] == [Spring(10.0, free=2.0), Spring(10.0)]
    assert [link for link, _ in places(scene, every["motors.push"])] == ["shoe", "ground"]
    motion = resting(3, np.zeros(1))
    motion.p[0, 1] = [0.0, 0.5, 0.0]  # shorter than free, it pushes down; and never by a moment on ψ
    loads = on_arm(scene, model).loads(motion)
    motor, push, tip, shoe = ((k, model.links[k].one @ f[0]) for k, f in loads)
    assert [k for k, _ in (motor, push, tip, shoe)] == [0, 3, 2, 3]  # segments of the arm, and the shoe
    for (_, found), wanted in zip((motor, push, tip, shoe), ([0, 0, -2.5], [4, 0], [0, -5, 0], [20, 0]), strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-12)


@pytest.mark.parametrize("kind", ["beam", "spatial", "solid", "plane"])
def test_ends_are_on_the_segments_that_hold_them(kind: str) -> None:
    """A link in segments, each a link of its name: forces are on them where they touch joint or point."""
    raw = arm(kind, springs={"tip": spring("arm", [0.98, 0], [1, 2])})
    if kind in {"solid", "plane"}:
        raw["links"]["arm"]["segments"] = 3
    scene, model = built(raw)
    assert [link.name for link in model.links] == ["arm"] * 3
    found = on_arm(scene, model)
    motor, tip = found.every
    assert [motor.on[0].k, tip.on[0].k] == [0, 2]
    (block,) = blocks(model, np.array([0.0, 1.0]), np.array([0.3, 0.3]), 2)
    moved = np.array([0.98, 0, 0]) + [*tip.on[0].unknowns(block)[0], 0.0, 0.0][:3]
    np.testing.assert_allclose(moved[:2], 0.98 * np.array([np.cos(0.3), np.sin(0.3)]), atol=1e-9)


def test_ends_must_be_on_their_links() -> None:
    scene, model = built(arm("beam", springs={"tip": spring("arm", [1, 0.01], [1, 2])}))
    with pytest.raises(SceneError, match=r"springs\.tip\.between\[0\]\.at: must lie on the axis of beam 'arm'"):
        on_arm(scene, model)
    scene, model = built(arm("solid", springs={"tip": spring("arm", [7, 0], [1, 2])}))
    with pytest.raises((SceneError, MeshError), match=r"springs\.tip\.between\[0\]\.at"):
        on_arm(scene, model)


# -- recorded -----------------------------------------------------------------------------------------------


def blocks(model: Model, t: np.ndarray, angle: np.ndarray, length: int) -> list[Block]:
    """An arm that turns about the origin by an angle over time, at rest in its rigid-body motion, block by block."""
    out, rate = [], np.gradient(angle, t)
    for first in range(0, len(t), length):
        here, histories = range(first, min(first + length, len(t))), []
        for k, link in enumerate(model.links):
            u = np.array([turning(model, angle[i] * Z)(k, link.X) for i in here])
            x = u + link.X[:, : link.d] if link.kind != "beam" else u + link.X * [1.0, 1.0, 0.0]
            v = np.zeros_like(u)
            v[..., 0], v[..., 1] = -rate[here, None] * x[..., 1], rate[here, None] * x[..., 0]
            if link.kind == "beam":
                v[..., 2] = rate[here, None] * link.one
            none, R = np.zeros((len(u), 0)), np.tile(np.eye(link.d), (len(u), 1, 1))
            histories.append(LinkHistory(u, v, 0 * u, 0 * u, R, 0 * u, none, np.zeros(len(u))))
        out.append(Block(first, resting(2, t[here]), histories))
    return out


@pytest.mark.parametrize("kind", ["beam", "plane", "solid"])
@pytest.mark.parametrize("length", [1, 7, 100])
def test_a_channel_tells_how_a_hinge_turned(kind: str, length: int) -> None:
    """Over a turn, in blocks; the joint's axis is −z."""
    scene, model = built(arm(kind))
    t = np.linspace(0, 2, 61)
    angle = 2.5 * np.pi * np.sin(np.pi * t / 4) ** 2
    wanted = [x for x in recording(scene, model) if x.channel.name == "joints/A/angle"]
    got = np.concatenate([wanted[0].rows(block) for block in blocks(model, t, angle, length)])
    np.testing.assert_allclose(got[:, 0], -angle, atol=1e-8)
    again = wanted[0].rows(blocks(model, t, angle, 5)[0])  # a new run counts from zero
    np.testing.assert_allclose(again[:, 0], -angle[:5], atol=1e-9)


@pytest.mark.parametrize("kind", ["beam", "plane", "solid", "rigid-body", "monolithic"])
def test_channels_and_forces_are_those_of_laws_where_links_are(kind: str) -> None:
    """The system's coordinates against those of a force element's vectors, from the links' states.

    The joint's axis is −z, a motor over speed.

    A coupling surface turns by its rotation there and by its directions here: they differ by the square of its strain.
    """
    motor = {"joint": "A", "torque": {"over": "speed", "at": [-20, 20], "value": [10, -10]}}
    torsion = {"kind": "torsion", "joint": "A", "stiffness": 2, "damping": 0.5, "free_angle": 1}
    tip = [1, 0] if kind == "beam" else [0.98, 0]
    if kind in ("rigid-body", "monolithic"):
        raw = four_bar("rigid", ON_CRANK["spring to the rocker"])
        raw["analysis"] |= {"solver": "monolithic"} if kind == "monolithic" else {"frames": kind}
        raw["motors"] = {"m": {"joint": "D", "torque": {"over": "angle", "at": [0, 2], "value": [5, 1]}}}
    else:
        raw = arm(kind, motors={"m": motor}, springs={"t": torsion, "s": spring("arm", tip, [0, 2], damping=3)})
        raw["analysis"] = {"end_time": 0.5, "step": 5e-3, "rho_inf": 0.8}
    ready, every = ran(raw)
    elements = by_vectors(ready.scene, ready.model)
    measured, before = element_forces(ready.scene, ready.model), np.zeros(len(elements))
    channels = element_channels(ready.scene, measured)
    assert not any(each.channel.name.startswith("drive") for each in channels)
    for block in every:
        got = {each.channel.name: each.rows(block)[:, 0] for each in channels}
        for i, element in enumerate(elements):
            x, v = placed(element, block.motion, block.links)
            q = coordinate(element, x, before[i])
            unit, before[i] = gradient(element, x, q), q[-1]
            rate = (unit * v).sum(axis=(1, 2, 3))
            Q = effort(element.law, block.motion, q, rate)
            values = {"angle": q, "length": q, "speed": rate, "torque": Q, "force": -Q}
            for what in values.keys() & {x.rpartition("/")[2] for x in got if x.startswith(f"{element.name}/")}:
                assert_near(got.pop(f"{element.name}/{what}"), values[what])
            for e, on in enumerate(at_ends(supports(block), element.name.replace("/", "."))):
                f = Q[:, None, None] * unit[:, e]
                for got_, wanted in zip(on, wrench(element.ends[e], x[:, e], f), strict=True):
                    assert_near(got_, wanted)
        assert set(got) <= {"joints/A/angle"}


def assert_near(x: np.ndarray, wanted: np.ndarray) -> None:
    np.testing.assert_allclose(x, wanted, rtol=0, atol=1e-6 * max(np.abs(wanted).max(), 1.0))
