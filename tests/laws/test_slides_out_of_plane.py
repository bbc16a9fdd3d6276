"""Slides between a plane link and one in space, which stays upright: as between plane links, and as by the oracle."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cells import as_a_run
from tests.moving import bar, channels, ran, turned
from tests.partners import chain
from tests.systems import against_oracle, begun, stiffened

Raw = dict[str, Any]
OWN = {"own": {"youngs_modulus": 2.1e11, "poisson_ratio": 0.0, "density": 7850.0}}
ORDERS = [("plane", "solid"), ("solid", "plane")]


def without_contraction(kinds: tuple[str, str], frames: str) -> Raw:
    """A chain with a slide between links of these kinds, of one shape and a material with ν = 0; solids of one layer."""
    raw = chain("prismatic", ("plane", "plane"), plane=True)
    for name, kind in zip(raw["joints"]["J"]["links"], kinds, strict=True):
        raw["links"][name] |= {"material": "own"}
        if kind == "solid":
            raw["links"][name] |= {"model": "solid", "element": "hex27", "mesh": {"elements": [2, 2, 1]}}
    raw["analysis"] |= {"frames": frames}
    raw["gravity"] = [2.0, -9.0, 0.0]
    return raw | {"materials": OWN}


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("kinds", ORDERS)
def test_a_plane_link_slides_on_a_solid_as_on_a_plane_link(kinds: tuple[str, str], frames: str) -> None:
    """Without contraction a plane link is the solid that moves in its plane."""
    mixed, flat = (channels(*ran(without_contraction(each, frames))) for each in (kinds, ("plane", "plane")))
    for name in (
        "joints/J/force",
        "joints/J/moment",
        "joints/K1/force",
        "joints/K3/force",
        "drive/torque",
        "energy/strain",
    ):
        part = slice(-1, None) if name.endswith("moment") else slice(2)
        size = float(np.abs(flat[name]).max())
        assert_allclose(mixed[name][:, part], flat[name][:, part], rtol=0, atol=1e-7 * size, err_msg=name)


def pushed(kinds: tuple[str, str], force: Any, at: Any, analysis: Raw, **more: Any) -> Raw:
    """A bar that is welded to the ground or turned, and one that slides on its end, with a force on the latter."""
    meshes: dict[str, Raw] = {"plane": {"elements": [6, 2]}, "solid": {"elements": [6, 2, 1]}}
    ends = {"one": ([0, 0], [0.2, 0]), "two": ([0.2, 0], [0.4, 0])}
    links = {name: bar(kind, *ends[name], mesh=meshes[kind]) for name, kind in zip(ends, kinds, strict=True)}
    return {
        "links": links,
        "joints": {
            "A": {"kind": "weld", "links": ["ground", "one"], "at": [0, 0, 0]},
            "J": {"kind": "prismatic", "links": ["two", "one"], "at": [0.2, 0, 0], "axis": [1, 0, 0]},
        },
        "loads": {"f": {"kind": "force", "link": "two", "at": list(at), "vector": list(force)}},
        "analysis": analysis, **more,
    }  # fmt: skip


@pytest.mark.parametrize("angle", [0.0, 90.0, 33.0])
@pytest.mark.parametrize("kinds", ORDERS)
def test_a_slide_balances_a_force_beside_the_plane(kinds: tuple[str, str], angle: float) -> None:
    """A spring along it bears F, the slide P, and the moments of both: about the axes in the plane too where the force
    is on a solid's upper face, which a plane link bears without any rotation. 3e-3: bars turn by 1e-4, go by 3e-4 m."""
    F, P, k = 300.0, 40.0, 1e6
    away = np.array([0.2, 0.015, 0.01 if kinds[1] == "solid" else 0.0])
    springs = {"s": {"kind": "spring", "joint": "J", "stiffness": k}}
    R = np.array([[np.cos(a := np.deg2rad(angle)), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    raw = turned(
        pushed(kinds, (F, -P, 0), (away + np.array([0.2, 0.0, 0.0])).tolist(), {"kind": "static"}, springs=springs), R
    )
    got = channels(*ran(raw))
    assert got["springs/s/travel"][-1, 0] == pytest.approx(F / k, rel=1e-3)
    moment = np.cross(away, [F, -P, 0])
    force = R.T @ got["joints/J/force"][-1]
    assert_allclose(force, [0, P, 0], atol=3e-3 * P)
    found = R.T @ got["joints/J/moment"][-1]
    assert_allclose(found, -moment, atol=3e-3 * np.abs(moment).max())


FRAMES = ("rigid-body", "stiffening", "co-rotational", "no drive")
LAWS: dict[str, Raw] = {
    "none": {},
    "bushing": {"bushing": {"stiffness": 1e6, "damping": 10.0, "rotational_stiffness": 1e3, "rotational_damping": 0.1}},
    "drive on the joint": {},
    "limit": {"kind": "travel", "joint": "J", "upper": 1e-6, "lower": -1e-6, "stiffness": 1e5},
}
QUICK = [("solid", "rigid-body", "none"), ("solid", "co-rotational", "bushing"),
         ("beam", "rigid-body", "drive on the joint"), ("beam", "no drive", "limit")]  # fmt: skip
CELLS = [
    pytest.param(other, frames, law, marks=[] if (other, frames, law) in QUICK else pytest.mark.long)
    for other in ("solid", "beam") for frames in FRAMES for law in LAWS
    if (law, frames) != ("drive on the joint", "no drive")
]  # fmt: skip


@pytest.mark.parametrize("first", ["plane", "other"])
@pytest.mark.parametrize(("other", "frames", "law"), CELLS)
def test_a_slide_on_a_plane_link_moves_as_by_the_oracle(first: str, other: str, frames: str, law: str) -> None:
    """1e-7 with beams in space, beside whose stiff ends is rounding."""
    kinds = ("plane", other) if first == "plane" else (other, "plane")
    raw = slid(kinds, law == "drive on the joint")
    raw["analysis"]["frames"] = "co-rotational" if frames in {"co-rotational", "no drive"} else "rigid-body"
    raw["analysis"] |= {"stiffening": True} if frames == "stiffening" else {}
    raw["joints"]["J"] |= LAWS[law] if law == "bushing" else {}
    raw["limits"] = {"stop": LAWS[law]} if law == "limit" else {}
    if frames == "no drive":
        del raw["drive"]
        raw["analysis"]["initial_speeds"] = {"A": 3.0}
    of = as_a_run(begun(raw))
    assert against_oracle(stiffened(of) if frames == "stiffening" else of, 3) < (1e-8 if other == "solid" else 5e-7)


def slid(kinds: tuple[str, str], driven: bool) -> Raw:
    """A chain with a slide between a plane link and one in space, that moves from the first step on."""
    raw = chain("prismatic", ("plane", "planar beam" if "beam" in kinds else "solid"), driven, plane=True)
    if "beam" in kinds:
        (link,) = (raw["links"][x] for x in raw["joints"]["J"]["links"] if raw["links"][x]["model"] == "beam")
        link["beam"] = "spatial"
    if kinds[1] == "plane":
        raw["joints"]["J"]["links"].reverse()
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": 0.3 if driven else 3.0}
    raw["analysis"] |= {"initial": "rest"}
    raw["gravity"] = [2.0, -9.0, 0.0]
    return raw
