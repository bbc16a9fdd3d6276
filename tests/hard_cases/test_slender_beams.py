"""Beams in space a thousand times longer than thick: sections stiff as EA, deflections of order L³/EI."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.links.beams.section import rectangle
from tests.rooms.test_dynamics import run, worst_difference
from tests.runs import ran
from tests.verification.linear import free_map, frequencies
from tests.verification.spatial_beams import ROOT, bent_cantilever, straight, tip_displacement, wanted_modes


@pytest.mark.parametrize("slenderness", [500, 1000])
@pytest.mark.parametrize("elements", [1, 8])
def test_a_slender_bent_beam_keeps_its_compliance(slenderness: int, elements: int) -> None:
    section = rectangle(1.0 / slenderness, 0.7 / slenderness)
    link = straight([[0, 0, 0], [1, 0, 0], [1, 0.6, 0]], section, elements)
    for axis, exact in bent_cantilever(1.0, 0.6, section).items():
        k = "xyz".index(axis)
        # rounding times the ratio of a hub's stiffness and the beam's, 100 EA L and EI/L
        assert tip_displacement(link, np.eye(3)[k])[k] == pytest.approx(exact, rel=1e-5)


def test_a_slender_beam_keeps_its_frequencies() -> None:
    section = rectangle(0.002, 0.001)
    link = straight([[0, 0, 0], [1, 0, 0]], section, 16)
    exact = wanted_modes(1.0, section)
    got = frequencies(link, free_map(link, ROOT), 2, 1)
    np.testing.assert_allclose(got, [exact["along z"][0], exact["along y"][0]], rtol=1e-5)


def test_condensed_is_monolithic_on_a_slender_arm_in_space() -> None:
    """1 : 500, swung about an axis askew to its section; long and short steps."""
    shape = {"kind": "polyline", "points": [[0, 0], [0.5, 0], [0.5, 0.5, 0.2]], "width": 0.002, "thickness": 0.001}
    for step in (1e-4, 1e-2):
        raw = {
            "links": {"arm": {"model": "beam", "material": "steel", "mesh": {"elements": 3}, "shape": shape}},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0], "axis": [0.3, 1, 0.5]}},
            "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": 0.5, "rise": 100 * step}},
            "analysis": {"end_time": 100 * step, "step": step},
        }
        _, _, fast = run(raw)
        raw["analysis"]["solver"] = "monolithic"
        _, _, slow = run(raw)
        assert worst_difference(fast, slow) < 1e-6


ALL_WAYS = {"x": [0, 0, 0], "y": [0, 0, np.pi / 2], "z": [0, -np.pi / 2, 0], "oblique": [0.3, -0.7, 0.5]}
IN_PLANE = {"x": [0, 0, 0], "y": [0, 0, np.pi / 2], "oblique": [0, 0, 0.7]}
ARCS = {
    "planar": (4, 360.0, 20, 1e-9, IN_PLANE),
    "slender": (4, 60.0, 250, 1e-6, IN_PLANE),
    "spatial": (3, 60.0, 250, 1e-3, ALL_WAYS),
}


@pytest.mark.parametrize(("kind", "along"), [(kind, along) for kind, arc in ARCS.items() for along in arc[-1]])
def test_a_slender_cantilever_under_an_end_moment_is_an_arc(kind: str, along: str) -> None:
    """Exactly a circle, M = EI φ/L, in one static position: the tip is at L sin φ/φ, L (1 − cos φ)/φ."""
    elements, turn, slenderness, within, ways = ARCS[kind]
    R = Rotation.from_rotvec(ways[along]).as_matrix()
    side, angle = 1.0 / slenderness, np.deg2rad(turn)
    M = 2e11 * side**4 / 12 * angle
    shape = {
        "kind": "bar",
        "between": [[0, 0, 0], R[:, 0].tolist()],
        "width": side,
        "thickness": side,
        "up": R[:, 2].tolist(),
    }
    arm = {
        "model": "beam",
        "beam": "spatial" if kind == "spatial" else "planar",
        "material": "m",
        "mesh": {"elements": elements},
        "shape": shape,
    }
    done = ran(
        {
            "materials": {"m": {"density": 7850, "youngs_modulus": 2e11, "poisson_ratio": 0.3}},
            "links": {"arm": arm},
            "joints": {"A": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0]}},
            "loads": {
                "M": {"kind": "torque", "link": "arm", "at": shape["between"][1], "vector": (M * R[:, 2]).tolist()}
            },
            "analysis": {"kind": "static", "accuracy": "quick"},
        }
    )
    tip = R.T @ done.position("arm", shape["between"][1])[-1]
    np.testing.assert_allclose(tip, [np.sin(angle) / angle, (1 - np.cos(angle)) / angle, 0], atol=within)
