"""Cantilevers under loads along them, drawn along x, y, z and obliquely: q L⁴/8EI with shear, q L²/2, turned or not."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.analysis import analyse
from kedfem.results import Results
from kedfem.scene import scene_from

Raw = dict[str, Any]
L, W, T, E, NU = 0.5, 0.03, 0.02, 2.1e11, 0.3
KGA = 5 / 6 * E / 2 / (1 + NU) * W * T
DRAWN = {  # what turns a beam along x, loaded along y, into these
    "x": np.eye(3), "y": Rotation.from_rotvec([0, 0, np.pi / 2]).as_matrix(),
    "z": Rotation.from_rotvec([0, -np.pi / 2, 0]).as_matrix(),
    "oblique": Rotation.from_rotvec([0.9, -0.7, 1.3]).as_matrix(),
    "in the plane": Rotation.from_rotvec([0, 0, 0.7]).as_matrix(),
}  # fmt: skip
AT = (0.0, 0.1, 0.25, 0.45)


def cantilever(kind: str, R: np.ndarray, loads: Raw, **more: Any) -> Raw:
    """Clamped at the origin, with a drive turning about the axis across beam and load; a single element unless given."""
    shape: Raw = {"kind": "bar", "between": [[0, 0, 0], (R @ [L, 0, 0]).tolist()], "width": W, "thickness": T}
    link: Raw = {"model": "beam", "beam": kind, "material": "m", "shape": shape}
    if kind == "spatial":
        shape["up"] = R[:, 2].tolist()
    link["mesh"] = {"elements": more.pop("elements", 1)}
    probes = {
        f"s{k}": {"link": "arm", "at": (R @ [x, W / 2, 0]).tolist(), "quantity": "stress"} for k, x in enumerate(AT)
    }
    tip: Raw = {"link": "arm", "at": (R @ [L, 0, 0]).tolist()}
    raw: Raw = {
        "materials": {"m": {"youngs_modulus": E, "poisson_ratio": NU, "density": 7850.0}},
        "links": {"arm": link}, "loads": {name: {"link": "arm", **load} for name, load in loads.items()},
        "joints": {"A": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0, 0]}},
        "analysis": {"kind": "static", "frames": "co-rotational"},
        "output": {
            "plots": False, "picture": False, "animation": False,
            "probes": probes | {"tip": {**tip, "quantity": "travel"}},
        },
    }  # fmt: skip
    if more.pop("driven", False):
        raw["joints"]["A"] = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": R[:, 2].tolist()}
        raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": "90 deg/s"}}
        raw["analysis"] = {"kind": "quasi-static", "end_time": 1.0, "step": 0.125}
        raw["output"]["probes"]["tip"] |= {"quantity": "displacement", "frame": "link"}
    raw["analysis"] |= more
    return raw


def run(raw: Raw, folder: Path) -> Results:
    return analyse(scene_from(raw, folder)).results


def inertia(depth: float, width: float) -> float:
    return width * depth**3 / 12


PUSHED: dict[str, Any] = {  # q along y, by R
    "line": lambda R, q: {"kind": "line", "vector": (R @ [0, q, 0]).tolist()},
    "pressure": lambda R, q: {"kind": "pressure", "at": (R @ [0.2, -W / 2, 0]).tolist(), "pressure": q / T},
}
EVERY = [("planar", x) for x in ("x", "y", "in the plane")] + [("spatial", x) for x in ("x", "y", "z", "oblique")]
FEW = [("planar", "in the plane", "line"), ("spatial", "oblique", "line"), ("spatial", "z", "pressure")]
CASES = [
    pytest.param(*case, load, marks=[] if (*case, load) in FEW else pytest.mark.long) for case in EVERY for load in PUSHED
]  # fmt: skip


@pytest.mark.parametrize(("kind", "drawn", "load"), CASES)
def test_a_cantilever_bends_as_beam_theory_has_it(kind: str, drawn: str, load: str, tmp_path: Path) -> None:
    """v = q L⁴/8EI + q L²/2κGA, M = q (L − x)²/2 in a single element, force q L and moment q L²/2 of the clamp.

    By 2e-6 of its length; rounding leaves 1e-6 of stresses.
    """
    R, q, EI = DRAWN[drawn], 1.0, E * inertia(W, T)
    found = run(cantilever(kind, R, {"q": PUSHED[load](R, q)}), tmp_path).channels
    dims = 2 if kind == "planar" else 3
    tip = np.zeros(3)
    tip[:dims] = found["probes/tip/travel"][1][-1]
    bent = q * L**4 / 8 / EI + q * L**2 / 2 / KGA
    assert_allclose((R.T @ tip)[1:], [bent, 0], atol=1e-9 * bent)
    assert abs((R.T @ tip)[0]) < bent**2 / L  # to second order it comes nearer
    largest = q * L**2 / 2 * W / 2 / inertia(W, T)
    stresses = [found[f"probes/s{k}/stress"][1][-1, 0] for k in range(len(AT))]
    assert_allclose(stresses, -largest * (1 - np.array(AT) / L) ** 2, atol=1e-6 * largest)
    force, moment = (found[f"joints/A/{name}"][1][-1] for name in ("force", "moment"))
    assert_allclose(R.T @ force, [0, -q * L, 0], atol=2 * q * bent)  # a pressure leans by what the axis turns
    assert_allclose(R.T @ moment, [0, 0, -q * L**2 / 2], atol=1e-6 * q * L**2)


def test_a_load_that_ends_in_the_middle_leaves_no_moment_beyond(tmp_path: Path) -> None:
    """q (L/2 − x)²/2 before, nothing after: stress is not smoothed over where the load ends. Rigid-body frames, still."""
    q = 1.0
    load = {"kind": "line", "vector": [0, q], "between": [[0, 0], [L / 2, 0]]}
    raw = cantilever("planar", np.eye(3), {"q": load}, elements=8, driven=True, frames="rigid-body")
    raw["drive"]["motion"] = {"kind": "cycloidal", "angle": 1e-9, "rise": 1.0}
    at = (0.1, 0.24, 0.26, 0.3)
    raw["output"]["probes"] = {
        f"s{k}": {"link": "arm", "at": [x, W / 2], "quantity": "stress"} for k, x in enumerate(at)
    }  # fmt: skip
    found = run(raw, tmp_path).channels
    wanted = [-q * max(0.0, L / 2 - x) ** 2 / 2 * W / 2 / inertia(W, T) for x in at]
    stresses = [found[f"probes/s{k}/stress"][1][0, 0] for k in range(len(at))]
    assert_allclose(stresses, wanted, atol=1e-7 * q * L**2 / 8 * W / 2 / inertia(W, T))


@pytest.mark.parametrize(("kind", "frames"), [
    ("planar", "rigid-body"), ("spatial", "co-rotational"),
    *(pytest.param(*x, marks=pytest.mark.long) for x in (("planar", "co-rotational"), ("spatial", "rigid-body"))),
])  # fmt: skip
def test_a_load_keeps_its_direction_or_turns_with_the_link(kind: str, frames: str, tmp_path: Path) -> None:
    """Through a quarter turn, moved slowly: q L⁴/8EI and shear across it, of a load fixed in the world times cos φ.

    Beside it that pulls along the axis by q sin φ: q L²/2EA, on what its turning stretches, ρ ω² L³/3E.
    """
    q, EI, R = 1.0, E * inertia(W, T), np.eye(3)
    tips = {}
    for frame in ("world", "link"):
        load = PUSHED["line"](R, q) | {"frame": frame}
        results = run(cantilever(kind, R, {"q": load}, driven=True, frames=frames), tmp_path / frame)
        tips[frame] = results.channels["probes/tip/displacement"][1]
    phi, bent = results.angle, q * L**4 / 8 / EI + q * L**2 / 2 / KGA
    assert_allclose(phi[-1], np.pi / 2, rtol=1e-12)
    along, spun = q * L**2 / 2 / E / W / T, 7850.0 * (np.pi / 2) ** 2 * L**3 / 3 / E
    for frame, turned in (("world", phi), ("link", 0 * phi)):
        assert_allclose(tips[frame][:, 1], bent * np.cos(turned), atol=1e-5 * bent)
        assert_allclose(tips[frame][:, 0], spun + along * np.sin(turned), atol=1e-5 * bent)


@pytest.mark.parametrize("kind", ["planar", "spatial"])
def test_a_load_that_grows_along_a_cantilever_bends_it_as_beam_theory_has_it(kind: str, tmp_path: Path) -> None:
    """From 0 at the clamp to q at the tip: 11 q L⁴/120EI and shear q L²/3κGA, by integration; q L²/3 at the clamp."""
    R, q, EI = DRAWN["in the plane"], 1.0, E * inertia(W, T)
    load = PUSHED["line"](R, 0.0) | {"end_vector": (R @ [0, q, 0]).tolist()}
    raw = cantilever(kind, R, {"q": load}, elements=4)
    raw["links"]["arm"]["element"] = "beam4"
    found = run(raw, tmp_path).channels
    tip = found["probes/tip/travel"][1][-1]
    tip = tip @ R[: len(tip), : len(tip)]
    wanted = 11 * q * L**4 / 120 / EI + q * L**2 / 3 / KGA
    assert_allclose(tip[1], wanted, rtol=1e-8)
    stress = q * L**2 / 3 * -W / 2 / inertia(W, T)
    assert_allclose(found["probes/s0/stress"][1][-1, 0], stress, rtol=1e-6)
