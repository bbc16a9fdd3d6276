"""Follower loads with co-rotational frames: as by the monolithic solver, as by elastica, and the work that they do."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from kedfem.dynamics.system.forces.follower_loads import rotated_forces
from kedfem.dynamics.system.ready import displacements
from kedfem.frequencies import Wanted, frequencies
from kedfem.scene import scene_from
from tests.laws.test_capabilities import as_a_run
from tests.moving import beam_in_space, ran, state
from tests.spatial_joints import rigid_in_space
from tests.systems import against_oracle, begun, marched

ASKEW = Rotation.from_rotvec([0.9, -0.7, 1.3]).as_matrix()
DRAWN = {"reference": np.eye(3), "askew": ASKEW}
Raw = dict[str, Any]


def arm(kind: str, R: np.ndarray, elements: int = 2) -> Raw:
    """Half a metre of steel from the origin along R e_x."""
    end = (R @ [0.5, 0, 0]).tolist()
    if kind == "spatial beam":
        return beam_in_space((0, 0, 0), end, elements, up=R[:, 2].tolist())
    flat = kind in {"beam", "plane"}
    mesh: Any = {"beam": elements, "plane": [elements, 1]}.get(kind, [elements, 1, 1])
    shape = {"kind": "bar", "between": [[0.0, 0.0, 0.0], end], "width": 0.02, "thickness": 0.02}
    if not flat:
        shape["up"] = R[:, 2].tolist()
    link: Raw = {
        "model": "solid" if kind == "reduced" else kind,
        "material": "steel",
        "shape": shape,
        "mesh": {"elements": mesh},
    }
    if flat:
        shape["between"] = [[0.0, 0.0], end[:2]]
    if kind == "reduced":
        link |= {"reduction": 6}
    if kind != "beam":
        link["segments"] = 2
    return link


def loads(kind: str, R: np.ndarray) -> dict[str, Raw]:
    """One of each that turns with its link."""
    tip, side = (R @ [0.5, 0, 0]).tolist(), (R @ [0.13, 0.01, 0]).tolist()
    force = {"kind": "force", "link": "arm", "at": tip, "vector": (R @ [30, 80, 20]).tolist(), "frame": "link"}
    torque = {"kind": "torque", "link": "arm", "at": tip, "vector": (R @ [4, 2, 5]).tolist(), "frame": "link"}
    if kind in {"beam", "plane"}:
        force |= {"at": tip[:2], "vector": [30, 80]}
        torque |= {"at": tip[:2], "vector": [0, 0, 5]}
    found = {"force": force}
    if kind in {"beam", "spatial beam"}:
        found["torque"] = torque
    if kind in {"beam", "spatial beam"}:
        ends = [(R @ [0.05, 0, 0]).tolist(), (R @ [0.38, 0, 0]).tolist()]
        pull = {"vector": (R @ [20, 200, 50]).tolist(), "end_vector": (R @ [0, 90, -30]).tolist(), "between": ends}
        if kind == "beam":
            pull = {"vector": [20, 200], "end_vector": [0, 90], "between": [x[:2] for x in ends]}
        found["line"] = {"kind": "line", "link": "arm", "frame": "link", **pull}
    if kind == "spatial beam":
        found["world"] = torque | {"frame": "world"}
    if kind in {"plane", "solid"}:
        found["pressure"] = {"kind": "pressure", "link": "arm", "at": side[: 2 if kind == "plane" else 3],
                             "pressure": 2e5}  # fmt: skip
    return found


def moving(kind: str, R: np.ndarray, driven: bool) -> Raw:
    """An arm that turns, loaded from the first step on."""
    hinge = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": R[:, 2].tolist()}
    raw: Raw = {
        "links": {"arm": arm(kind, R)}, "joints": {"A": hinge}, "loads": loads(kind, R),
        "damping": {"alpha": 3.0, "beta": 1e-5},
        "analysis": {"end_time": 0.005, "step": 2e-4, "rho_inf": 0.8, "frames": "co-rotational", "initial": "rest"},
    }  # fmt: skip
    if driven:
        return raw | {"drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 30.0}}}
    raw["analysis"]["initial_speeds"] = {"A": 30.0}
    return raw | {"damping": {"beta": 1e-5}}


CASES = [
    ("beam", "force"), ("beam", "torque"), ("beam", "line"), ("plane", "force"), ("plane", "pressure"),
    ("solid", "force"), ("solid", "pressure"), ("spatial beam", "force"), ("spatial beam", "torque"),
    ("spatial beam", "line"), ("spatial beam", "world"),
]  # fmt: skip


@pytest.mark.parametrize("kind", ["beam", "spatial beam", "plane", "solid"])
def test_a_driven_arm_under_all_its_loads_moves_as_by_the_oracle(kind: str) -> None:
    R = ASKEW if kind in {"spatial beam", "solid"} else np.eye(3)
    assert against_oracle(as_a_run(begun(moving(kind, R, driven=True)))) < 1e-7


@pytest.mark.parametrize("kind", ["plane", "solid"])
def test_bodies_with_sparse_factors_move_as_by_the_oracle(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kedfem.dynamics.system.layout.SMALL", 0)
    of = as_a_run(begun(moving(kind, ASKEW if kind == "solid" else np.eye(3), driven=False)))
    assert not of.ready.bodies.dense.any()
    assert against_oracle(of) < 1e-7


@pytest.mark.long
@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize(("kind", "load"), CASES)
def test_a_free_arm_under_each_load_moves_as_by_the_oracle(kind: str, load: str, drawn: str) -> None:
    raw = moving(kind, DRAWN[drawn] if kind in {"spatial beam", "solid"} else np.eye(3), driven=False)
    raw["loads"] = {load: raw["loads"][load]}
    assert against_oracle(as_a_run(begun(raw))) < 1e-7


EI = 2.1e11 * np.pi * 0.02**4 / 64  # N m² of the rod


def follower_tip(load: float) -> np.ndarray:
    """Where a cantilever of unit length goes under a force that stays across its tip, by P L²/EI: from the tip inwards.

    There φ = 0, φ' = 0, and φ'' = −(P/EI) cos φ along the rod as it is.
    """

    def along(_: float, y: np.ndarray) -> list[float]:
        return [y[1], load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])]

    phi, _, x, y = solve_ivp(along, (0, 1), np.zeros(4), rtol=1e-12, atol=1e-14).y[:, -1]
    c, s = np.cos(phi), np.sin(phi)
    return np.array([c * x + s * y, s * x - c * y])


@pytest.mark.parametrize(("drawn", "elements"), [("reference", 4), ("askew", 8)])
def test_a_rod_in_space_bends_as_elastica_under_a_force_that_stays_across_its_tip(drawn: str, elements: int) -> None:
    """Loaded slowly, much damped; shear leaves 1e-3 of the length."""
    R, load = DRAWN[drawn], 2.0
    raw = moving("spatial beam", R, driven=True) | {"damping": {"beta": 0.01}}
    force = raw["loads"]["force"] | {"factor": {"time": [0.0, 0.15], "value": [0.0, 1.0]}}
    force["vector"] = (R @ [0, load * EI / 0.5**2, 0]).tolist()
    raw |= {"links": {"arm": arm("spatial beam", R, elements)}, "loads": {"force": force}}
    raw["drive"]["motion"] = {"kind": "cycloidal", "angle": 1e-9, "rise": 1.0}
    raw["analysis"] |= {"end_time": 0.25, "step": 1e-3, "rho_inf": 0.6}
    ready, blocks = ran(raw)
    links = ready.model.links
    last = max(range(len(links)), key=lambda k: float((links[k].nodes @ R)[:, 0].max()))
    at = int((links[last].nodes @ R)[:, 0].argmax())
    moved = links[last].nodes[at] + state(blocks, last, "u")[-1, np.flatnonzero(links[last].one)[at]]
    assert_allclose(moved @ R / 0.5, np.append(follower_tip(load), 0.0), atol=2e-3)


@pytest.mark.parametrize("kind", ["spatial beam", "beam", "solid"])
def test_the_work_of_loads_that_turn_is_the_energy_of_a_free_body_to_second_order(kind: str) -> None:
    """In flight: kinetic and strain energy gained against ∫ F · δ', with slopes from both sides."""
    R = ASKEW if kind in {"spatial beam", "solid"} else np.eye(3)
    left = []
    for h in (2e-4, 1e-4, 5e-5):
        raw = moving(kind, R, driven=False)
        raw |= {"joints": {}, "damping": {}}
        ramp = {"factor": {"time": [0.0, 0.004], "value": [0.0, 1.0]}}
        raw["loads"] = {name: load | ramp for name, load in raw["loads"].items()}
        raw["analysis"] = {"end_time": 0.008, "step": h, "rho_inf": 0.9}
        ready, blocks = ran(raw)
        energy, work = 0.0, 0.0
        for k, link in enumerate(ready.model.links):
            v, F = state(blocks, k, "v"), state(blocks, k, "F")
            Mv = np.stack([(link.mass[c] @ v[:, :, c].T).T for c in range(link.d)], axis=2)
            energy = energy + 0.5 * np.einsum("tnd,tnd->t", v, Mv) + state(blocks, k, "strain")
            power = np.einsum("tnd,tnd->t", v, F)
            work = work + h * np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2)])
        left.append(float(np.abs(energy - energy[0] - work).max() / energy.max()))
    assert left[0] < 2e-2
    order = np.log2(np.array(left[:-1]) / left[1:])
    assert np.all((order > 1.7) & (order < 2.4)), left


def on_a_rigid_end(plane: bool, R: np.ndarray) -> Raw:
    """A beam on the ground's hinge, undriven, and a rigid bar hinged to it, which a force of its own axes pushes."""
    if plane:
        first = arm("beam", np.eye(3))
        second = {"model": "rigid", "material": "steel"}
        second["shape"] = {"kind": "bar", "between": [[0.5, 0], [0.7, 0.1]], "width": 0.02, "thickness": 0.02}
        at, end, push, axis = [0.5, 0.0], [0.7, 0.1], [3.0, 8.0], {}
    else:
        first, axis = arm("spatial beam", R), {"axis": (R @ [0.1, -0.2, 1.0]).tolist()}
        at, end = (R @ [0.5, 0, 0]).tolist(), (R @ [0.7, 0.1, 0.05]).tolist()
        second = rigid_in_space(np.array(at), np.array(end))
        push = (R @ [3, 8, 2]).tolist()
    origin = [0.0] * len(at)
    return {
        "links": {"arm": first, "tip": second},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "arm"], "at": origin, **axis},
            "B": {"kind": "revolute", "links": ["arm", "tip"], "at": at, **axis},
        },
        "loads": {
            "f": {
                "kind": "force",
                "link": "tip",
                "at": end,
                "vector": push,
                "frame": "link",
                "factor": {"over": "time", "at": [0.0, 0.02], "value": [0.0, 1.0]},
            }
        },
        "analysis": {"end_time": 0.02, "step": 1e-3, "rho_inf": 0.8, "initial": "rest", "accuracy": "quick"},
    }


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("plane", [True, False])
def test_a_load_turns_with_a_rigid_link(plane: bool, drawn: str, tmp_path: Path) -> None:
    """As by the oracle; where the link has turned by Q its forces are those in the reference position by Q.

    A run, whose rigid links are very stiff ones, moves alike; frequencies are those without the load.
    """
    raw = on_a_rigid_end(plane, DRAWN[drawn])
    of = as_a_run(begun(raw, today=False))
    assert against_oracle(of, 4) < 1e-7
    system = of.ready.system
    k = system.names.index("tip")
    link, (load,) = system.model.links[k], [x for x in system.model.loads[k] if x.load == "f"]
    assert load.own
    Q = Rotation.from_rotvec([0, 0, 0.8] if plane else [0.4, -0.9, 0.7]).as_matrix()[: link.d, : link.d]
    X = link.X[:, : link.d]
    u = (X @ Q.T - X)[None]
    found = rotated_forces(link, load, np.eye(3)[None], u, np.array([2.0]))[0]
    assert_allclose(found, 2 * load.forces @ Q.T, atol=1e-9 * np.abs(load.forces).max())
    wanted = displacements(of.ready, system.names.index("arm"), marched(of, 20)[1].u)
    run = state(ran(raw)[1], 0, "u")[1:]
    assert_allclose(run.reshape(20, -1), wanted.reshape(20, -1), atol=1e-2 * np.abs(wanted).max())
    loaded, bare = (
        frequencies(scene_from({**raw, "loads": x}), Wanted(modes=3), tmp_path / str(k)).values
        for k, x in enumerate((raw["loads"], {}))
    )
    assert_allclose(loaded, bare, rtol=1e-9)
