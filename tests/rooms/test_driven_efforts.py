"""What drive and hub of a driven link bear: springs and motors on it included, in balance with energy."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.moving import bar, channels, ran

SPRING = {"kind": "spring", "stiffness": 1e4}
ON_CRANK: dict[str, dict[str, Any]] = {
    "torsion spring about the driven joint": {
        "springs": {"k": {"kind": "torsion", "joint": "A", "stiffness": 5.0, "free_angle": 0.5}}
    },
    "motor on the driven joint": {
        "motors": {"k": {"joint": "A", "torque": {"over": "angle", "at": [0, 2], "value": [5.0, 1.0]}}}
    },
    "spring to the ground": {
        "springs": {
            "k": SPRING | {"between": [{"link": "crank", "at": [0.05, 0.0866]}, {"link": "ground", "at": [0.5, 0]}]}
        }
    },
    "spring to the rocker": {
        "springs": {
            "k": SPRING | {"between": [{"link": "crank", "at": [0.05, 0.0866]}, {"link": "rocker", "at": [0.3, 0]}]}
        }
    },
    "torsion spring": {"springs": {"k": {"kind": "torsion", "joint": "B", "stiffness": 20.0}}},
    "motor": {"motors": {"m": {"joint": "B", "torque": 5.0}}},
    "motor at the rocker": {"motors": {"m": {"joint": "D", "torque": 5.0}}},
}


def four_bar(crank: str, more: dict[str, Any], **analysis: Any) -> dict[str, Any]:
    """At 1 rpm through a third of a revolution; nothing vibrates, so that elastic and rigid links bear the same."""
    a, d, b = np.array([0.0, 0.0]), np.array([0.3, 0.0]), np.array([0.05, 0.0866])
    along = (d - b) / np.linalg.norm(d - b)
    s = (np.linalg.norm(d - b) ** 2 + 0.3**2 - 0.25**2) / (2 * np.linalg.norm(d - b))
    c = b + s * along + np.sqrt(0.3**2 - s**2) * np.array([-along[1], along[0]])
    pins = {"A": a, "B": b, "C": c, "D": d}
    links = {
        "crank": bar(crank, a.tolist(), b.tolist(), 2),
        "coupler": bar("beam", b.tolist(), c.tolist(), 2),
        "rocker": bar("beam", d.tolist(), c.tolist(), 2),
    }
    joints = {
        name: {"kind": "revolute", "links": pair, "at": pins[name].tolist()}
        for name, pair in {
            "A": ["ground", "crank"],
            "B": ["crank", "coupler"],
            "C": ["coupler", "rocker"],
            "D": ["rocker", "ground"],
        }.items()
    }
    steps = {"revolutions": 1 / 3, "steps_per_revolution": 36, "initial": "quasi-static", "rho_inf": 1.0, **analysis}
    drive = {"joint": "A", "motion": {"kind": "constant_speed", "speed": "1 rpm"}}
    return {"links": links, "joints": joints, "drive": drive, "analysis": steps, **more}


@pytest.mark.parametrize(
    ("crank", "frames"),
    [("beam", "rigid-body"), ("rigid", "rigid-body"), ("rigid", "co-rotational"), ("beam", "co-rotational")],
)
@pytest.mark.parametrize("acting", list(ON_CRANK))
def test_drive_and_hub_bear_springs_and_motors_on_the_driven_link(acting: str, crank: str, frames: str) -> None:
    """As the inverse dynamics of rigid links says; a beam bends by some 1e-3 of its length under 1.4 kN."""
    got = channels(*ran(four_bar(crank, ON_CRANK[acting], frames=frames)))
    most = np.abs(got["drive/rigid_torque"]).max()
    assert most > 2.0  # N m
    assert_allclose(got["drive/torque"], got["drive/rigid_torque"], atol=0.01 * most)
    for joint in "ABD":
        rigid = got[f"joints/{joint}/rigid_force"]
        assert_allclose(got[f"joints/{joint}/force"][:, :2], rigid[:, :2], atol=0.01 * np.abs(rigid).max() + 1e-3)


@pytest.mark.long
@pytest.mark.parametrize("acting", ["torsion spring", "motor"])
@pytest.mark.parametrize("coupler", ["plane", "solid"])
def test_drives_bear_what_laws_exert_on_surfaces_that_they_share(acting: str, coupler: str) -> None:
    """The pin's surface of the coupler has points that the rigid crank holds, and others that the law turns."""
    raw = four_bar("rigid", ON_CRANK[acting])
    b, c = (raw["joints"][name]["at"] for name in "BC")
    raw["links"]["coupler"] = bar(coupler, b, c)
    if coupler == "solid":
        raw["links"]["rocker"] = bar(coupler, raw["joints"]["D"]["at"], c)
    got = channels(*ran(raw))
    rigid = got["drive/rigid_torque"]
    assert_allclose(got["drive/torque"], rigid, atol=0.01 * np.abs(rigid).max())


def test_a_spring_from_the_driven_crank_to_the_ground_is_in_its_hub() -> None:
    """1417 N at A and 76.7 N m, 1e4 N/m to (0.5, 0): elongation and lever of the crank's pin, by hand."""
    got = channels(*ran(four_bar("rigid", ON_CRANK["spring to the ground"])))
    angle = np.radians(60) + np.linspace(0, 2 * np.pi / 3, len(got["drive/torque"]))
    pin = np.hypot(0.05, 0.0866) * np.stack([np.cos(angle), np.sin(angle)])
    arm = np.array([[0.5], [0.0]]) - pin
    length = np.linalg.norm(arm, axis=0)
    pull = 1e4 * (length - length[0])
    torque = pull * (pin[0] * arm[1] - pin[1] * arm[0]) / length
    assert_allclose(np.linalg.norm(got["joints/A/force"], axis=1).max(), pull.max(), rtol=1e-3)
    assert_allclose(pull.max(), 1417, atol=1)
    assert_allclose(got["drive/torque"][:, 0], -torque, atol=0.005)
    assert_allclose(np.abs(torque).max(), 76.7, atol=0.1)


@pytest.mark.parametrize("solver", ["condensed", "monolithic"])
@pytest.mark.parametrize("acting", list(ON_CRANK))
def test_what_the_drive_of_a_rigid_link_gives_is_the_work_of_its_supports(acting: str, solver: str) -> None:
    """∫ T dφ of the channel against the account of energy, which knows forces on ports and P − M R0'' only."""
    ready, blocks = ran(four_bar("rigid", ON_CRANK[acting], solver=solver))
    got = channels(ready, blocks)
    phi = np.concatenate([block.motion.phi for block in blocks])
    T = got["drive/torque"][:, 0]
    work = np.concatenate([[0.0], np.cumsum(0.5 * (T[1:] + T[:-1]) * np.diff(phi))])
    assert np.abs(work).max() > 1.0  # J
    assert_allclose(work, got["energy/work"][:, 1], atol=1e-9 * np.abs(work).max())


def arm(model: str, elements: Any, **more: Any) -> dict[str, Any]:
    """A steel arm, 4 mm in the plane by 20 mm, that turns by 2 rad in 0.25 s and bends by 4.5 % of its length."""
    if model == "spatial":
        section = {"kind": "rectangle", "width": 0.004, "thickness": 0.02}
        shape: dict[str, Any] = {
            "kind": "polyline",
            "points": [[0, 0, 0], [0.5, 0, 0]],
            "section": section,
            "up": [0, 1, 0],
        }
        link = {"model": "beam", "beam": "spatial", "material": "steel", "shape": shape, "mesh": {"elements": elements}}
    else:
        link = bar(model, [0, 0], [0.5, 0], **more) | {"mesh": {"elements": elements}}
        link["shape"] |= {"width": 0.004, "thickness": 0.02}
    motion = {"kind": "cycloidal", "angle": 2.0, "rise": 0.25}
    return {
        "links": {"arm": link},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": motion},
        "damping": {"beta": 1e-4},
        "analysis": {"end_time": 0.2, "step": 5e-4, "rho_inf": 0.9, "frames": "co-rotational"},
    }


@pytest.mark.parametrize(
    ("model", "elements", "more"),
    [("spatial", 2, {}), ("solid", [4, 1, 1], {"segments": 2}), ("plane", [8, 2], {"segments": 4}), ("beam", 2, {})],
    ids=["beams in space", "solid", "plane", "planar beams"],
)
def test_the_torque_of_co_rotational_frames_does_the_work_of_the_drive(
    model: str, elements: Any, more: dict[str, Any]
) -> None:
    """∫ T dφ is the change of energy plus what damping took; a hub stands as its drive has it, however the link bends."""
    ready, blocks = ran(arm(model, elements, **more))
    got = channels(ready, blocks)
    phi = np.concatenate([block.motion.phi for block in blocks])
    T = got["drive/torque"][:, 0]
    work = np.concatenate([[0.0], np.cumsum(0.5 * (T[1:] + T[:-1]) * np.diff(phi))])
    energy = got["energy/kinetic"] + got["energy/strain"] + got["energy/dissipated"]
    assert_allclose(work, energy[:, 0] - energy[0, 0], atol=1e-3 * np.abs(energy).max())


@pytest.mark.parametrize(
    "on", [{"springs": {"k": SPRING | {"joint": "G"}}}, {"motors": {"m": {"joint": "G", "force": 300.0}}}]
)
def test_the_pin_of_a_slider_bears_springs_and_motors_on_the_slider(on: dict[str, Any]) -> None:
    """A slider's mass rides on the rod that it is joined to, as do its spring and motor."""
    raw = four_bar("beam", on)
    raw["links"] = {
        "crank": bar("rigid", [0, 0], [0.0, 0.1], 2),
        "rod": bar("beam", [0.0, 0.1], [0.3, 0.0], 2),
        "ram": {"model": "rigid", "mass": 1.0},
    }
    raw["joints"] = {
        "A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0]},
        "B": {"kind": "revolute", "links": ["crank", "rod"], "at": [0.0, 0.1]},
        "P": {"kind": "revolute", "links": ["rod", "ram"], "at": [0.3, 0.0]},
        "G": {"kind": "prismatic", "links": ["ram", "ground"], "at": [0.3, 0.0], "axis": "x"},
    }
    got = channels(*ran(raw))
    for name in ("joints/P", "joints/G", "joints/A"):
        rigid, elastic = got[f"{name}/rigid_force"], got[f"{name}/force"][:, :2]
        assert_allclose(elastic, rigid[:, :2], atol=0.01 * np.abs(got["joints/P/rigid_force"]).max(), err_msg=name)
    assert np.abs(got["joints/P/rigid_force"]).max() > 100.0  # N


def test_a_spring_whose_ends_meet_pulls_nowhere() -> None:
    """From a point of the driven crank to the ground there, of no length: at the start it has no direction."""
    ends = [{"link": link, "at": [0.05, 0.0866]} for link in ("crank", "ground")]
    got = channels(*ran(four_bar("rigid", {"springs": {"k": SPRING | {"free_length": 0, "between": ends}}})))
    assert got["springs/k/length"][0] == 0
    for name, values in got.items():
        assert np.isfinite(values).all(), name
    assert_allclose(got["springs/k/force"], 1e4 * got["springs/k/length"], rtol=1e-12)
