"""Polylines that end where they begin: closed frames against closed forms, and against the same frame welded of two."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.errors import SceneError
from kedfem.links.build import bare_link
from kedfem.scene import scene_from

Raw = dict[str, Any]
L, H, E, P = 1.0, 0.02, 2.1e11, 100.0
EI = E * H**4 / 12
CORNERS = [[0, 0, 0], [L, 0, 0], [L, L, 0], [0, L, 0]]
TURNS = {"in the plane": np.eye(3), "in space": np.array([[0.36, -0.8, 0.48], [0.48, 0.6, 0.64], [-0.8, 0, 0.6]])}


def beam(points: Any, turn: np.ndarray) -> Raw:
    at = [list(turn @ np.array(x, float)) for x in points]
    if not (turn == np.eye(3)).all() and points[0] == points[-1]:
        at[-1] = at[0]
    up = {} if (turn == np.eye(3)).all() else {"up": list(turn @ [0, 0, 1])}
    shape = {"kind": "polyline", "points": at, "width": H, "thickness": H, **up}
    return {"model": "beam", "element": "beam3", "mesh": {"elements": 4}, "material": "m", "shape": shape}


def pulled(links: Raw, joints: Raw, turn: np.ndarray, frames: str, load: float) -> Raw:
    """A square frame that a drive holds in the middle of its lower side, pulled up in the middle of the upper one."""
    top = list(turn @ [L / 2, L, 0])
    wall = {"kind": "revolute", "links": ["frame", "ground"], "at": list(turn @ [L / 2, 0, 0])}
    wall["axis"] = list(turn @ [0, 0, 1])
    rest = {"kind": "curve", "time": [0, 1], "value": [0, 0]}
    force = {"kind": "force", "link": next(reversed(links)), "at": top, "vector": list(load * (turn @ [0, 1, 0]))}
    return {
        "materials": {"m": {"youngs_modulus": E, "poisson_ratio": 0.3, "density": 7850.0}},
        "links": links, "joints": {"wall": wall, **joints}, "loads": {"F": force},
        "drive": {"joint": "wall", "motion": rest},
        "analysis": {"kind": "static", "end_time": 1, "step": 1, "accuracy": "quick", "frames": frames},
        "output": {
            "plots": False, "picture": False, "animation": False,
            "probes": {"top": {"link": force["link"], "at": top, "quantity": "travel"}},
        },
    }  # fmt: skip


def top(raw: Raw, turn: np.ndarray, folder: Path) -> np.ndarray:
    run = analyse(scene_from(raw, folder))
    travel = run.results.channels["probes/top/travel"][1][-1]
    return np.asarray(np.append(travel, np.zeros(3 - len(travel))) @ turn)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("where", TURNS)
def test_a_closed_frame_is_as_stiff_as_in_closed_form(where: str, frames: str, tmp_path: Path) -> None:
    """Sides of equal length bear P L/16 at their ends: pulled apart by 2 · 5 P L³/(384 EI), slender, at small loads."""
    turn = TURNS[where]
    u = top(pulled({"frame": beam([*CORNERS, CORNERS[0]], turn)}, {}, turn, frames, P / 10), turn, tmp_path)
    assert_allclose(u[1], 2 * 5 * P / 10 * L**3 / (384 * EI), rtol=0.01)  # shear and stretch give 0.6 %
    assert_allclose(u[[0, 2]], 0, atol=1e-6 * u[1])


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("where", TURNS)
def test_a_frame_that_closes_is_one_that_is_welded_together(where: str, frames: str, tmp_path: Path) -> None:
    """Pulled until it bends by a tenth of its side: as two halves that are welded at the corners."""
    turn, load = TURNS[where], 10 * P
    once = top(pulled({"frame": beam([*CORNERS, CORNERS[0]], turn)}, {}, turn, frames, load), turn, tmp_path)
    low, high = [CORNERS[3], CORNERS[0], CORNERS[1]], [CORNERS[1], CORNERS[2], CORNERS[3]]
    joints = {
        name: {"kind": "weld", "links": ["frame", "half"], "at": list(turn @ np.array(at, float))}
        for name, at in (("right", CORNERS[1]), ("left", CORNERS[3]))
    }
    twice = pulled({"frame": beam(low, turn), "half": beam(high, turn)}, joints, turn, frames, load)
    assert_allclose(once, top(twice, turn, tmp_path), rtol=1e-4, atol=1e-7)


def test_a_closed_frame_has_one_node_at_each_corner_and_the_mass_of_its_sides() -> None:
    for turn in TURNS.values():
        raw = pulled({"frame": beam([*CORNERS, CORNERS[0]], turn)}, {}, turn, "rigid-body", P)
        link = bare_link(scene_from(raw), "frame")
        assert float(link.one @ link.m1[:, 0]) == pytest.approx(4 * L * H**2 * 7850)
        nodes = link.X[link.one > 0]
        assert len(nodes) == len(np.unique(nodes.round(9), axis=0)) == 4 * 8


@pytest.mark.parametrize(
    ("points", "more", "said"),
    [([[0, 0], [1, 0], [0, 0]], {}, "must be different points"),
     ([[0, 0], [1, 0], [1, 1], [1, 0]], {}, "must be different points"),
     ([[0, 0], [1, 0], [1, 1], [0, 0]], {"smooth": True}, "smooth: must be left out of a line that ends")],
)  # fmt: skip
def test_lines_that_meet_themselves_elsewhere_are_refused(points: Any, more: Raw, said: str) -> None:
    raw = pulled({"frame": beam([*CORNERS, CORNERS[0]], np.eye(3))}, {}, np.eye(3), "rigid-body", P)
    raw["links"]["frame"]["shape"] |= {"points": points, **more}
    with pytest.raises(SceneError, match=said):
        scene_from(raw)
