"""Motors, springs and dampers: forces that do the work of their coordinate, whatever moves, and balance by themselves."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.force_element import (
    ANGLE,
    DISTANCE,
    PAIR,
    POINT,
    SINGLE,
    SLIDE,
    TURN,
    End,
    ForceElement,
    coordinate,
    effort,
    placed,
    unit_forces,
    wrench,
)
from kedfem.dynamics.force_elements import force_elements, hinges
from kedfem.dynamics.history import Block, LinkHistory
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.forces.exerted import at_ends
from kedfem.dynamics.system.forces.supports import supports
from kedfem.dynamics.system.record import COORDINATE, RATE, TIME, Curve, Law, Spring
from kedfem.errors import MeshError, SceneError
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.linkage import linkage
from kedfem.motion.rigid import resting
from kedfem.results.forces.force_elements import acting, measured_elements
from kedfem.results.recording import recording
from kedfem.scene import Factor, Pieces, Scene, pieces, scene_from
from tests.laws.strategies import examples
from tests.moving import ran
from tests.rooms.test_driven_efforts import ON_CRANK, four_bar
from tests.scenes import bar

Z = np.array([0.0, 0.0, 1.0])


def end(form: int, X: Any, k: int = 0) -> End:
    X = np.atleast_2d(np.asarray(X, float))
    return End(k, 1, form, np.ones((len(X), 1)), X)


def straight(at: tuple[float, ...], value: tuple[float, ...]) -> Pieces:
    return pieces(Factor(at=at, value=value))


def hinge(one: int, other: int, axis: np.ndarray, law: Law | None = None) -> ForceElement:
    """A hinge whose ends show themselves in two ways; the second is drawn turned by 0.4 rad about the axis."""
    e = np.array(perpendiculars(axis))
    aside = Rotation.from_rotvec(0.4 * axis).apply(e)
    X = {PAIR: (e, e), SINGLE: ([e[0], axis], [aside[0], axis]), ANGLE: (np.zeros(3), np.zeros(3))}
    return ForceElement("h", TURN, (end(one, X[one][0]), end(other, X[other][1])), law, axis)


def drawn(element: ForceElement) -> np.ndarray:
    x = np.zeros((2, 2, 3))
    for e, each in enumerate(element.ends):
        x[e, : len(each.X)] = each.X
    return x


def found(
    element: ForceElement, x: np.ndarray, v: np.ndarray | None = None, t: float = 0.0, before: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Forces (2, 2, 3), where no hub is deformed, and q, q', Q of one force element."""
    unit = unit_forces(element, x[None])[0]
    q, rate = coordinate(element, x[None], before), np.atleast_1d(0.0 if v is None else (unit * v).sum())
    Q = effort(element.law, resting(1, np.array([t])), q, rate)
    return Q * unit, np.array([q[0], rate[0], Q[0]])


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


def turned(x: np.ndarray, element: ForceElement, turns: Sequence[np.ndarray]) -> np.ndarray:
    """Each end's vectors turned by its own rotation; a planar beam's angle about z added."""
    out = x.copy()
    for e, theta in enumerate(turns):
        if element.ends[e].form == ANGLE:
            out[e, 0, 2] += theta[2]
        else:
            out[e] = Rotation.from_rotvec(theta).apply(x[e])
    return out


FORMS = [(PAIR, PAIR), (PAIR, SINGLE), (SINGLE, PAIR), (SINGLE, SINGLE)]
UPRIGHT = [(ANGLE, ANGLE), (ANGLE, PAIR), (PAIR, ANGLE), (ANGLE, SINGLE), (SINGLE, ANGLE)]
vectors = st.lists(st.floats(-1, 1), min_size=3, max_size=3).map(np.array)
seeds = st.integers(0, 2**32 - 1)


def unit(seed: int) -> np.ndarray:
    n = np.random.default_rng(seed).normal(size=3)
    return np.asarray(n / np.linalg.norm(n))


# -- the turn of a hinge ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("one", "other"), FORMS + UPRIGHT)
@pytest.mark.parametrize("axis", [Z, -Z], ids=["z", "-z"])
@pytest.mark.parametrize("angle", [0.0, 1.2, -2.9, 3.1])
def test_a_hinge_tells_its_turn(one: int, other: int, axis: np.ndarray, angle: float) -> None:
    element = hinge(one, other, axis)
    x = turned(drawn(element), element, [(angle + 0.3) * axis, 0.3 * axis])
    assert found(element, x)[1][0] == pytest.approx(angle, abs=1e-12)


@pytest.mark.parametrize(("one", "other"), FORMS + UPRIGHT)
def test_turns_are_counted_on(one: int, other: int) -> None:
    element = hinge(one, other, Z)
    x0, q = drawn(element), 0.0
    for angle in [*np.arange(0, 20, 1.3), *np.arange(20, -20, -2.9)]:
        q = float(found(element, turned(x0, element, [angle * Z, 0 * Z]), before=q)[1][0])
        assert q == pytest.approx(angle, abs=1e-9)


@pytest.mark.parametrize(("one", "other"), FORMS)
@given(seed=seeds, whole=vectors, angle=st.floats(-3, 3))
@settings(max_examples=examples(20), deadline=None)
def test_a_turn_does_not_depend_on_where_all_of_it_is_turned(
    one: int, other: int, seed: int, whole: np.ndarray, angle: float
) -> None:
    axis = unit(seed)
    element = hinge(one, other, axis, Spring(3.0, free=0.7))
    x = turned(drawn(element), element, [angle * axis, 0 * axis])
    R = Rotation.from_rotvec(3 * whole)
    f, values = found(element, x, before=angle)
    F, turned_values = found(element, np.array([R.apply(e) for e in x]), before=angle)
    np.testing.assert_allclose(turned_values, values, atol=1e-9)
    np.testing.assert_allclose(F, [R.apply(e) for e in f], atol=1e-9)
    x += 0.1 * np.random.default_rng(seed).normal(size=x.shape)  # hubs deform and tilt
    q = coordinate(element, np.array([x, [R.apply(e) for e in x]]), angle)
    assert q[1] == pytest.approx(q[0], abs=1e-9)


@pytest.mark.parametrize(("one", "other"), FORMS + UPRIGHT)
@given(seed=seeds)
@settings(max_examples=examples(20), deadline=None)
def test_the_work_of_a_torque_is_that_of_its_turn(one: int, other: int, seed: int) -> None:
    """Forces · δx = Q δq by central differences, along any deformation."""
    rng = np.random.default_rng(seed)
    axis = unit(seed) if ANGLE not in (one, other) else Z
    element = hinge(one, other, axis, Curve(TIME, straight((0.0,), (2.5,))))
    x = turned(drawn(element), element, [rng.uniform(-2, 2) * axis, 0 * axis])
    v = rng.normal(size=x.shape)
    f, values = found(element, x, v)
    h = 1e-5
    rate = (found(element, x + h * v)[1][0] - found(element, x - h * v)[1][0]) / (2 * h)
    assert values[1] == pytest.approx(rate, abs=1e-7)
    assert np.vdot(f, v) == pytest.approx(2.5 * rate, abs=1e-7)


@pytest.mark.parametrize(("one", "other"), FORMS)
def test_torques_on_both_ends_balance(one: int, other: int) -> None:
    """Σ x × f over all directions is the moment, T n on the first end."""
    axis = unit(3)
    element = hinge(one, other, axis, Curve(TIME, straight((0.0,), (2.5,))))
    x = turned(drawn(element), element, [0.9 * axis, 0.2 * axis])
    moments = np.cross(x, found(element, x)[0]).sum(axis=1)
    np.testing.assert_allclose(moments, [2.5 * axis, -2.5 * axis], atol=1e-12)


def test_a_planar_beam_takes_the_torque_on_its_angle() -> None:
    for axis in (Z, -Z):
        element = hinge(ANGLE, ANGLE, axis, Curve(TIME, straight((0.0,), (2.5,))))
        f, _ = found(element, turned(drawn(element), element, [4 * Z, 1 * Z]))
        np.testing.assert_allclose(f[:, 0], [2.5 * axis, -2.5 * axis], atol=1e-12)
        assert not f[:, 1].any()


# -- laws ---------------------------------------------------------------------------------------------------


def test_a_torsion_spring_turns_back() -> None:
    element = hinge(PAIR, PAIR, Z, Spring(3.0, 0.5, 0.2))
    x0 = drawn(element)
    x = turned(x0, element, [1.2 * Z, 0 * Z])
    v = np.zeros_like(x)
    v[0] = np.cross(2.0 * Z, x[0])
    _, values = found(element, x, v)
    np.testing.assert_allclose(values, [1.2, 2.0, -3.0 * 1.0 - 0.5 * 2.0], atol=1e-12)


def test_a_spring_between_points_pulls_along_its_line() -> None:
    element = ForceElement("s", DISTANCE, (end(POINT, [0, 0, 0]), end(POINT, [3, 4, 0])), Spring(10.0, 2.0, 4.0))
    x, v = drawn(element), np.zeros((2, 2, 3))
    v[1, 0] = [1, 0, 0]  # lengthens it by 3/5
    f, values = found(element, x, v)
    np.testing.assert_allclose(values, [5, 0.6, -10 * 1 - 2 * 0.6])
    np.testing.assert_allclose(f[:, 0], 11.2 * np.array([[0.6, 0.8, 0], [-0.6, -0.8, 0]]))


def test_a_spring_of_no_length_has_no_direction() -> None:
    element = ForceElement("s", DISTANCE, (end(POINT, [1, 0, 0]), end(POINT, [1, 0, 0])), Spring(10.0, 2.0))
    f, values = found(element, drawn(element))
    assert not f.any()
    assert not values.any()


def test_a_slide_is_pushed_along_its_axis() -> None:
    axis = unit(5)
    element = ForceElement("m", SLIDE, (end(POINT, [1, 2, 3]), end(POINT, [1, 2, 3], -1)), axis=axis,
                           law=Curve(COORDINATE, straight((0.0, 1.0), (0.0, 8.0))))  # fmt: skip
    x = drawn(element)
    x[0, 0] += 0.25 * axis + 7 * np.array(perpendiculars(axis)[0])
    f, values = found(element, x)
    np.testing.assert_allclose(values, [0.25, 0, 2.0], atol=1e-12)
    np.testing.assert_allclose(f[:, 0], [2 * axis, -2 * axis], atol=1e-12)


@pytest.mark.parametrize("over", [TIME, RATE, COORDINATE])
def test_a_curve_is_linear_between_its_points_and_held_outside(over: int) -> None:
    at, value = (-1.0, 0.5, 2.0), (5.0, -1.0, 3.0)
    element = hinge(PAIR, PAIR, Z, Curve(over, straight(at, value)))
    x0 = drawn(element)
    for s in np.linspace(-2, 3, 21):
        x = turned(x0, element, [(s if over == COORDINATE else 0.3) * Z, 0 * Z])
        v = np.zeros_like(x)
        v[0] = np.cross((s if over == RATE else 0.1) * Z, x[0])
        got = found(element, x, v, t=s if over == TIME else 9.0)[1][2]
        assert got == pytest.approx(np.interp(s, at, value), abs=1e-12)


def test_several_times_at_once_are_as_one_by_one() -> None:
    spring_ = ForceElement("s", DISTANCE, (end(POINT, [0, 0, 0]), end(POINT, [1, 0, 0])))
    t = np.linspace(0, 2, 9)
    for element in (hinge(PAIR, PAIR, Z), spring_, hinge(ANGLE, PAIR, Z)):
        x = np.array([turned(drawn(element), element, [2 * s * Z, -s * Z]) for s in t])
        q, unit = coordinate(element, x), unit_forces(element, x)
        for k in range(9):
            alone = coordinate(element, x[k : k + 1], q[max(k - 1, 0)])[0]
            assert q[k] == pytest.approx(alone, abs=1e-12)
            np.testing.assert_allclose(unit[k], unit_forces(element, x[k : k + 1])[0], atol=1e-12)
        if element.kind == TURN:
            np.testing.assert_allclose(q, 3 * t, atol=1e-12)


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


def state_of(element: ForceElement, model: Model, motion: Callable[[int, np.ndarray], np.ndarray]) -> np.ndarray:
    """Vectors (2, 2, 3) of an element's ends where the functions of link k, at X (n, 3), are moved by motion(k, X)."""
    x = drawn(element)
    for e, at in enumerate(element.ends):
        if at.k >= 0:
            u = motion(at.k, model.links[at.k].X)
            x[e, : len(at.X), : u.shape[1]] += (at.weights @ u) * np.array(at.mask)[: u.shape[1]]
    return x


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
    (element,) = force_elements(scene, model)
    (looked,) = hinges(scene, model)
    link = model.links[0]
    x = state_of(element, model, turning(model, angle * Z))
    f, values = found(element, x)
    assert values[0] == pytest.approx(-angle, abs=1e-9)
    assert found(looked, x)[1][0] == pytest.approx(-angle, abs=1e-9)
    mask = np.array(element.ends[0].mask)[: link.d]
    forces = np.einsum("mn,mc->nc", element.ends[0].weights, (f[0, : len(element.ends[0].X), : link.d] * mask))
    spin = 1e-6
    u = turning(model, (angle + spin) * Z)(0, link.X) - turning(model, (angle - spin) * Z)(0, link.X)
    assert np.vdot(forces, u) / (2 * spin) == pytest.approx(-2.5, rel=1e-6)  # about z
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
    (element,) = force_elements(scene, model)
    f, values = found(element, state_of(element, model, turning(model, 0.5 * Z)))
    assert values[0] == pytest.approx(-0.5)
    np.testing.assert_allclose(f[0, 0], [0, 0, -2.5], atol=1e-12)  # about the axis, −z


def test_a_spring_hangs_on_points_of_links_sliders_and_the_ground() -> None:
    springs = {"tip": spring("arm", [1, 0], [1, 2]), "shoe": spring("shoe", [1.5, 0.1], [3.5, 0.1], free_length=0)}
    raw = arm("beam", springs=springs)
    raw["links"]["shoe"] = {"model": "rigid", "mass": 1}
    raw["joints"]["B"] = {"kind": "revolute", "links": ["arm", "shoe"], "at": [1, 0]}
    raw["joints"]["S"] = {"kind": "prismatic", "links": ["shoe", "ground"], "at": [1, 0], "axis": "x"}
    raw["motors"]["push"] = {"joint": "S", "force": 4}
    scene, model = built(raw)
    motor, push, tip, shoe = force_elements(scene, model)
    assert [x.name for x in (motor, push, tip, shoe)] == ["motors/m", "motors/push", "springs/tip", "springs/shoe"]
    assert (tip.law, shoe.law) == (Spring(10.0, free=2.0), Spring(10.0))
    x = state_of(tip, model, lambda k, X: np.array([[0.0, 0.5, 9.0]] * len(X)))
    np.testing.assert_allclose(found(tip, x)[1][0], 1.5)
    # shorter than free, it pushes down; and never by a moment on ψ
    np.testing.assert_allclose(found(tip, x)[0][0, 0], [0, -5, 0])
    moved = state_of(push, model, lambda k, X: np.array([[-0.2, 0.0, 9.0]] * len(X)))
    np.testing.assert_allclose(found(push, moved)[1][[0, 2]], [-0.2, 4])
    np.testing.assert_allclose(shoe.ends[0].X + shoe.ends[0].offset, [[1.5, 0.1, 0]])


@pytest.mark.parametrize("kind", ["beam", "spatial", "solid", "plane"])
def test_ends_are_on_the_segments_that_hold_them(kind: str) -> None:
    """A link in segments, each a link of its name: forces are on them where they touch joint or point."""
    raw = arm(kind, springs={"tip": spring("arm", [0.98, 0], [1, 2])})
    if kind in {"solid", "plane"}:
        raw["links"]["arm"]["segments"] = 3
    scene, model = built(raw)
    assert [link.name for link in model.links] == ["arm"] * 3
    motor, tip = force_elements(scene, model)
    assert [motor.ends[0].k, tip.ends[0].k] == [0, 2]
    x = state_of(tip, model, turning(model, 0.3 * Z))
    np.testing.assert_allclose(x[0, 0], 0.98 * np.array([np.cos(0.3), np.sin(0.3), 0]), atol=1e-9)


def test_ends_must_be_on_their_links() -> None:
    scene, model = built(arm("beam", springs={"tip": spring("arm", [1, 0.01], [1, 2])}))
    with pytest.raises(SceneError, match=r"springs\.tip\.between\[0\]\.at: must lie on the axis of beam 'arm'"):
        force_elements(scene, model)
    scene, model = built(arm("solid", springs={"tip": spring("arm", [7, 0], [1, 2])}))
    with pytest.raises((SceneError, MeshError), match=r"springs\.tip\.between\[0\]\.at"):
        force_elements(scene, model)


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
    elements = force_elements(ready.scene, ready.model)
    measured, before = measured_elements(ready.scene, ready.model), np.zeros(len(elements))
    channels = acting(ready.scene, measured)
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
