"""Probes: elastic and total motion, deflection in the link's own frame, of elastic, rigid and prescribed links."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.errors import SceneError
from kedfem.results.probes import probe_channels
from kedfem.scene import scene_from
from tests.runs import Ran, ran

E, L, WIDTH = 2.1e11, 0.3, 0.012  # steel's modulus; length of the coupler, side of its square section [m]
LINKS = {
    "planar beam": {"model": "beam", "beam": "planar", "mesh": {"elements": 2}},
    "spatial beam": {"model": "beam", "beam": "spatial", "mesh": {"elements": 2}},
    "plane": {"model": "plane", "mesh": {"elements": [6, 2]}},
    "solid": {"element": "hex20", "mesh": {"elements": [6, 1, 1]}},
}
FRAMES = ["rigid-body", "co-rotational"]


def bar(between: list[str], **keys: Any) -> dict[str, Any]:
    shape = {"kind": "bar", "between": between, "width": WIDTH, "thickness": WIDTH}
    return {"material": "steel", "shape": shape, **keys}


def hinge(at: str, *links: str) -> dict[str, Any]:
    return {"kind": "revolute", "links": list(links), "at": at}


def four_bar(kind: str, frames: str, probes: dict[str, Any], **analysis: Any) -> dict[str, Any]:
    """A crank and a rocker that are rigid, a coupler of one kind, drawn level."""
    rigid = {"model": "rigid", "mesh": {"elements": [1, 1, 1]}}
    return {
        "points": {"A": [0, 0], "B": [0, 0.1], "C": [L, 0.1], "D": [L, -0.1]},
        "links": {
            "crank": bar(["A", "B"], **rigid),
            "coupler": bar(["B", "C"], **LINKS[kind]),
            "rocker": bar(["C", "D"], **rigid),
        },
        "joints": {
            "A": hinge("A", "ground", "crank"),
            "B": hinge("B", "crank", "coupler"),
            "C": hinge("C", "coupler", "rocker"),
            "D": hinge("D", "ground", "rocker"),
        },
        "damping": {"beta": 1e-5},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 20.0}},
        "analysis": {"end_time": 0.01, "step": 1e-4, "frames": frames, **analysis},
        "output": {"probes": probes},
    }


def probe(link: str, at: Any, quantity: str, **keys: Any) -> dict[str, Any]:
    return {"link": link, "at": at, "quantity": quantity, **keys}


Values = dict[str, np.ndarray]


def probed(raw: dict[str, Any]) -> tuple[Ran, Values]:
    """A scene that was run, and what its probes read."""
    done = ran(raw)
    every = probe_channels(done.ready.scene, done.ready.model)
    read = {each.channel.name: np.concatenate([each.rows(b) for b in done.blocks]) for each in every}
    return done, read


def values(read: Values, name: str, quantity: str) -> np.ndarray:
    return read[f"probes/{name}/{quantity}"]


QUANTITIES = ("displacement", "position", "travel", "total_velocity", "total_acceleration")


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize("kind", LINKS)
def test_rigid_and_elastic_motion_add_up_on_links_of_every_kind(kind: str, frames: str) -> None:
    at = {"crank": [0.02, 0.07], "coupler": [L / 3, 0.1], "rocker": [L, 0.03]}
    probes = {
        f"{link} {quantity}": probe(link, X, quantity, frame="world") for link, X in at.items() for quantity in QUANTITIES
    } | {f"{link} end": probe(link, "B" if link == "crank" else "C", "position") for link in at}
    probes["coupler start"] = probe("coupler", "B", "position")
    done, read = probed(four_bar(kind, frames, probes, initial="quasi-static"))
    for link, X in at.items():
        f, x, travel, v, a = (values(read, f"{link} {quantity}", quantity) for quantity in QUANTITIES)
        n = x.shape[1]
        rigid = done.rigid_motion(link, X)[:, :n]
        np.testing.assert_allclose(x, rigid + f, atol=1e-12)  # R' = R + f, [KED, eqs. (2)(3)]
        np.testing.assert_allclose(travel, x - np.array([*X, 0.0])[:n], atol=1e-12)
        h = done.t[1] - done.t[0]
        for rate, of in ((v, x), (a, v)):  # central differences: h² of a motion at 20 rad/s and its vibration
            difference = (of[2:] - of[:-2]) / (2 * h)
            near = 0.02 * np.abs(rate).max()
            np.testing.assert_allclose(difference[20:], rate[1:-1][20:], atol=near)
    assert not values(read, "crank displacement", "displacement").any()  # prescribed: it is the rigid motion
    ends = [values(read, f"{link}", "position") for link in ("crank end", "coupler start", "coupler end", "rocker end")]
    n = min(x.shape[1] for x in ends)
    near = 1e-9 if frames == "rigid-body" else 1e-8
    np.testing.assert_allclose(ends[0][:, :n], ends[1][:, :n], atol=near)  # joints hold them together
    np.testing.assert_allclose(ends[2][:, :n], ends[3][:, :n], atol=near)


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize("kind", LINKS)
def test_the_deflection_of_a_coupler_is_that_of_a_beam_on_two_supports(kind: str, frames: str) -> None:
    force, middle = 500.0, [L / 2, 0.1]
    probes = {
        "sag": probe("coupler", middle, "deflection"),
        "same": probe("coupler", middle, "deflection", chord=["B", "C"], frame="world"),
        "end": probe("coupler", middle, "deflection", chord=["B", middle]),
    }
    raw = four_bar(kind, frames, probes, initial="quasi-static", end_time=3e-4)
    raw["drive"]["motion"]["speed"] = 1e-6
    raw["loads"] = {"push": {"kind": "force", "link": "coupler", "at": middle, "vector": [0, -force]}}
    if kind in {"plane", "solid"}:  # a point force there would be a port of its own: a load on a face as wide
        raw["loads"] = {"push": {"kind": "body", "link": "coupler", "vector": [0, -force / (L * WIDTH**2)]}}
    _, read = probed(raw)
    second, G = WIDTH**4 / 12, E / 2.6
    spread = kind in {"plane", "solid"}
    bending = 5 / 384 if spread else 1 / 48
    shear = (1 / 8 if spread else 1 / 4) * force * L / (5 / 6 * G * WIDTH**2)
    sag = bending * force * L**3 / (E * second) + shear  # Timoshenko's beam on two supports
    for name in ("sag", "same"):
        assert values(read, name, "deflection")[0, 1] == pytest.approx(-sag, rel=0.02), name
    np.testing.assert_allclose(values(read, "end", "deflection")[:, 1], 0.0, atol=1e-12)


@pytest.mark.parametrize("segments", [1, 3])
@pytest.mark.parametrize("kind", LINKS)
@pytest.mark.parametrize("joints", [1, 2])
def test_a_rigid_motion_of_any_size_deflects_nothing(kind: str, segments: int, joints: int) -> None:
    cut = {"mesh": {"elements": 3}} if kind.endswith("beam") else {"segments": segments}
    shape = {**LINKS[kind], **cut}
    raw = {
        "points": {"A": [0.1, 0.2], "B": [0.1 + L, 0.25]},
        "links": {"arm": bar(["A", "B"], **shape), "end": bar(["B", "A"], **LINKS[kind])},
        "joints": {"A": hinge("A", "ground", "arm")} | ({"B": hinge("B", "arm", "end")} if joints == 2 else {}),
        "analysis": {"end_time": 1e-3, "step": 5e-4},
        "output": {
            "probes": {
                frame: probe("arm", {"between": ["A", "B"], "fraction": 0.3}, "deflection", frame=frame)
                for frame in ("link", "world")
            }
        },
    }
    beside = 0.0 if kind == "planar beam" else 0.004  # off the chord, where a roll about it would show
    raw["points"]["P"] = {"between": ["A", "B"], "fraction": 0.3, "offset": beside}
    for each in raw["output"]["probes"].values():
        each["at"] = "P"
    scene = scene_from(raw)
    ready = meshed(scene)
    block = next(iter(transient(scene, ready.linkage, ready.path, ready.model, steps_of(scene, ready.model))))
    planar = ready.model.links[0].planar
    turn = Rotation.from_rotvec([0, 0, 2.5] if planar else [0.7, -1.1, 2.0]).as_matrix()
    shift = np.array([3.0, -2.0, 0.0 if planar else 5.0])

    def moved(k: int, history: Any) -> Any:
        link = ready.model.links[k]
        u = np.outer(link.one, shift) + link.X @ (turn - np.eye(3)).T
        if link.kind == "beam":
            u[:, 2] = 2.5 * link.one
        return replace(history, u=np.tile(u[:, : link.d], (len(history.u), 1, 1)))

    links = [moved(k, history) for k, history in enumerate(block.links)]
    turned = Block(block.step, block.motion, links)
    for each in probe_channels(scene, ready.model):
        np.testing.assert_allclose(each.rows(turned), 0.0, atol=1e-13)  # of 6 m of travel


def test_a_falling_pendulum_travels_far_and_deflects_little() -> None:
    arm = bar(["A", "B"], **LINKS["planar beam"])
    probes = {"middle": probe("arm", [L / 2, 0], "deflection"), "tip": probe("arm", "B", "travel"),
              "speed": probe("arm", "B", "total_velocity")}  # fmt: skip
    _, read = probed({
        "gravity": [0, -9.81], "points": {"A": [0, 0], "B": [L, 0]}, "links": {"arm": arm},
        "joints": {"A": hinge("A", "ground", "arm")}, "analysis": {"end_time": 0.2, "step": 1e-3},
        "damping": {"beta": 1e-5}, "output": {"probes": probes},
    })  # fmt: skip
    fall = values(read, "tip", "travel")[-1]
    speed = np.linalg.norm(values(read, "speed", "total_velocity")[-1])
    turn = np.arccos(1 + fall[0] / L)
    # energy of a uniform bar that has turned down: ½ (L²/3) ω² = g (L/2) sin
    assert speed == pytest.approx(np.sqrt(3 * 9.81 * L * np.sin(turn)), rel=1e-3)
    assert np.linalg.norm(fall) > 0.1
    assert np.abs(values(read, "middle", "deflection")).max() < 1e-5


def test_a_slider_without_a_shape_moves_with_its_pin() -> None:
    raw = four_bar("planar beam", "rigid-body", {
        "block": probe("block", [L, 0.1], "position"), "pin": probe("coupler", "C", "position"),
        "block moves": probe("block", [L, 0.1], "displacement", frame="world"),
    })  # fmt: skip
    raw["links"]["block"] = {"model": "rigid", "mass": 2.0}
    del raw["links"]["rocker"], raw["points"]["D"]
    raw["joints"]["C"]["links"] = ["coupler", "block"]
    raw["joints"]["D"] = {"kind": "prismatic", "links": ["ground", "block"], "at": "C", "axis": "x"}
    _, read = probed(raw)
    np.testing.assert_allclose(values(read, "block", "position"), values(read, "pin", "position"), atol=1e-12)
    assert np.abs(values(read, "block moves", "displacement")[:, 0]).max() > 1e-9


FAULTS = [
    ({"quantity": "stress", "link": "crank"}, "probes.p.link: must name an elastic link for a stress"),
    ({"quantity": "deflection", "link": "crank"}, "probes.p.link: must name an elastic link for a deflection"),
    ({"quantity": "position", "frame": "link"}, "probes.p.frame: must be 'world' for a position"),
    ({"quantity": "stress", "frame": "world"}, "probes.p.frame: must be 'link' for a stress"),
    ({"quantity": "travel", "chord": ["B", "C"]}, "probes.p.chord: must be given for a deflection only"),
    ({"quantity": "deflection", "chord": ["B", "B"]}, "probes.p.chord: must be two different points"),
    ({"quantity": "deflection", "chord": ["B", "X"]}, "probes.p.chord[1]: must name a point, got 'X'"),
]  # fmt: skip


@pytest.mark.parametrize(("keys", "message"), FAULTS)
def test_probes_that_cannot_be_are_refused(keys: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError) as refused:
        scene_from(four_bar("planar beam", "rigid-body", {"p": {"link": "coupler", "at": "B", **keys}}))
    assert f"output.{message}" in str(refused.value)


@pytest.mark.parametrize(
    ("quantity", "instead"),
    [("displacement", "position, travel or deflection"), ("velocity", "total_velocity"),
     ("acceleration", "total_acceleration")],
)  # fmt: skip
def test_what_is_against_the_rigid_motion_needs_a_drive(quantity: str, instead: str) -> None:
    raw = four_bar("planar beam", "co-rotational", {"p": probe("coupler", "B", quantity)})
    del raw["drive"]
    wanted = f"output.probes.p.quantity: must be {instead} without a drive"
    with pytest.raises(SceneError, match=wanted):
        scene_from(raw)


@pytest.mark.parametrize("frames", FRAMES)
@pytest.mark.parametrize(
    "kind", [{"model": "plane"}, {"element": "hex20"}, {"element": "hex20", "reduction": "modal"}],
    ids=["plane", "solid", "reduced"],
)  # fmt: skip
def test_the_centre_of_a_bore_goes_with_the_pin_that_holds_it(kind: dict[str, Any], frames: str) -> None:
    """There is no material: the bore's mean motion is that of the joint, as the rigid crank's point shows it."""
    pins = {"B": ("coupler", "crank"), "C": ("coupler", "rocker")}
    probes = {
        f"{link} {at} {quantity}": probe(link, at, quantity)
        for at, links in pins.items() for link in links for quantity in ("position", "total_velocity")
    }  # fmt: skip
    raw = four_bar("solid", frames, probes, step=2e-4)
    shape = {"kind": "plate_link", "between": ["B", "C"], "width": WIDTH, "thickness": WIDTH,
             "eye_diameter": 2 * WIDTH, "bore_diameter": WIDTH}  # fmt: skip
    raw["links"]["coupler"] = {"material": "steel", "shape": shape, **kind}
    _, read = probed(raw)
    for quantity, size in (("position", L), ("total_velocity", 2.0)):  # m, and m/s of the crank's pin
        for at, links in pins.items():
            bore, pin = (values(read, f"{link} {at} {quantity}", quantity) for link in links)
            n = min(bore.shape[1], pin.shape[1])
            np.testing.assert_allclose(bore[:, :n], pin[:, :n], atol=1e-7 * size)  # joints close to rounding
    raw["output"]["probes"] = {"off": probe("coupler", [0.002, 0.1], "position")}
    with pytest.raises(SceneError, match=r"must lie in link 'coupler'.* the centre of a bore"):
        probed(raw)
