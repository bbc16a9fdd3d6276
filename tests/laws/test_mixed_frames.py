"""Links with rigid-body frames beside co-rotational ones: what joins them neither resists rotations nor takes energy."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.laws.test_stiffened_energy import RISE, missing
from tests.moving import channels, ran, turned
from tests.partners import partner

Raw = dict[str, Any]
TURNS = {"z": np.eye(3), "x": np.eye(3)[[2, 0, 1]], "oblique": Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()}
IN_SPACE = ("beam", "solid")
LINKS = ("arm", "outer")


def two(kind: str, own: str, analysis: Raw) -> Raw:
    """An arm and an outer link in a line, welded; `own` is the co-rotational one, or all are."""
    c = 3 if kind in IN_SPACE else 2
    places = {"arm": ((0.0, 0.0, 0.0), (0.25, 0.0, 0.0)), "outer": ((0.25, 0.0, 0.0), (0.5, 0.0, 0.0))}
    links = {name: partner(kind, *ends, (0, 0, 1)) for name, ends in places.items()}
    for name in LINKS:
        links[name]["frames"] = "co-rotational" if own in (name, "all") else "rigid-body"
    joints: Raw = {
        "A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0][:c]},
        "B": {"kind": "weld", "links": list(LINKS), "at": [0.25, 0, 0][:c]},
    }
    if c == 3:
        joints["A"]["axis"] = [0, 0, 1]
    raw: Raw = {"links": links, "joints": joints, "analysis": analysis}
    probe = {"link": "outer", "at": [0.5, 0, 0][:c], "quantity": "displacement", "frame": "world"}
    return raw | {"output": {"probes": {"tip": probe}}}


def bent(kind: str, own: str, pull: list[float], turn: str, analysis: Raw, rigid: bool = False) -> np.ndarray:
    """How far a force moves its tip, with a rigid outer link if so."""
    c = 3 if kind in IN_SPACE else 2
    raw = two(kind, own, {"end_time": 1e-3, "step": 5e-4} | analysis)
    if rigid:
        of = raw["links"]["outer"]
        raw["links"]["outer"] = {key: of[key] for key in ("material", "shape", "frames")} | {"model": "rigid"}
    raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1e-3}}
    raw["loads"] = {"f": {"kind": "force", "link": "outer", "at": [0.5, 0, 0][:c], "vector": pull[:c]}}
    if turn == "z":
        return channels(*ran(raw))["probes/tip/displacement"][0][:c]
    return channels(*ran(turned(raw, TURNS[turn])))["probes/tip/displacement"][0] @ TURNS[turn]


POSITION, START = {"kind": "quasi-static"}, {"initial": "quasi-static"}


@pytest.mark.parametrize(
    ("kind", "own", "turn", "force", "analysis"),
    [("beam", "arm", "z", 200.0, START)] + [
        pytest.param(*x, marks=pytest.mark.long) for x in (
            ("beam", "outer", "x", 200.0, POSITION), ("beam", "outer", "oblique", 200.0, START),
            ("solid", "arm", "z", 3e3, POSITION), ("solid", "outer", "oblique", 3e3, START),
        )
    ],
)  # fmt: skip
def test_welded_links_bend_as_those_of_one_kind(kind: str, own: str, turn: str, force: float, analysis: Raw) -> None:
    """To what rotations of 1 and 10 deg leave open, 2e-4 and 2e-2: points that both shared resisted by 15 %."""
    found, wanted = (bent(kind, x, [0.0, force, force / 2], turn, analysis) for x in (own, "all"))
    np.testing.assert_allclose(
        found[1:], wanted[1:], rtol=0, atol={"beam": 1e-3, "solid": 3e-2}[kind] * np.abs(wanted).max()
    )


@pytest.mark.parametrize(
    ("kind", "own", "turn", "force"),
    [("beam", "arm", "z", 200.0), ("planar beam", "arm", "z", 3e3)] + [
        pytest.param(*x, marks=pytest.mark.long) for x in (
            ("beam", "outer", "x", 200.0), ("beam", "arm", "oblique", 200.0), ("planar beam", "outer", "z", 3e3),
            ("plane", "arm", "z", 3e3), ("plane", "outer", "z", 3e3),
            ("solid", "arm", "z", 3e3), ("solid", "outer", "x", 3e3),
        )
    ],
)  # fmt: skip
def test_so_does_a_rigid_link_at_their_end(kind: str, own: str, turn: str, force: float) -> None:
    """Points that it shared with a beam in space of the other frame left 30 and 80 % of the deflection at 1 degree."""
    found, wanted = (bent(kind, x, [0.0, force, force / 2], turn, POSITION, rigid=True) for x in (own, "all"))
    atol = {"beam": 1e-3, "solid": 3e-2}.get(kind, 1e-2) * np.abs(wanted).max()
    np.testing.assert_allclose(found[1:], wanted[1:], rtol=0, atol=atol)


@pytest.mark.parametrize("own", LINKS)
def test_welded_plane_links_bend_so_too(own: str) -> None:
    """To 0.2 % of 13 mm, what rotations of 3 degrees leave open: points that both shared resisted by 0.4 %."""
    found, wanted = (bent("plane", x, [0.0, 3e3], "z", POSITION) for x in (own, "all"))
    np.testing.assert_allclose(found[1], wanted[1], rtol=2e-3)


def spun(kind: str, own: str, step: float, pushed: bool, turn: str = "z") -> Raw:
    """Both brought to a speed that stiffens them by a seventh and more; `pushed` by a force that turns with the outer."""
    c = 3 if kind in IN_SPACE else 2
    raw = two(kind, own, {"end_time": 0.05, "step": step, "rho_inf": 0.99, "initial": "rest", "stiffening": True})
    raw |= {"drive": RISE, "gravity": [0, -9.81, 0][:c]}
    if pushed:
        factor = {"over": "time", "at": [0, 0.025, 0.05], "value": [0.0, 1.0, 0.0], "interpolation": "smooth"}
        force = {"kind": "force", "link": "outer", "at": [0.5, 0, 0][:c], "vector": [3000, 60, 0][:c], "frame": "link"}
        raw["loads"] = {"f": force | {"factor": factor}}
    return turned(raw, TURNS[turn]) if turn != "z" else raw


SPUN = [
    ("planar beam", "outer", True, "z"), ("planar beam", "arm", False, "z"),
    *(pytest.param(*x, marks=pytest.mark.long) for x in (
        ("planar beam", "arm", True, "z"), ("plane", "outer", True, "z"), ("plane", "arm", True, "z"),
        ("beam", "outer", True, "x"), ("beam", "arm", True, "oblique"), ("solid", "outer", True, "oblique"),
    )),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "own", "pushed", "turn"), SPUN)
def test_the_account_of_energy_closes(kind: str, own: str, pushed: bool, turn: str) -> None:
    """Four times as well with half the step, and to 5e-4: without the work of the stresses 2 to 6 % are missing."""
    rough, fine = (missing(spun(kind, own, step, pushed, turn)) for step in (5e-4, 2.5e-4))
    assert 3.0 < rough / fine < 5.0
    assert fine < 5e-4
