"""Beams in space a thousand times longer than thick: sections stiff as EA, deflections of order L³/EI."""

import numpy as np
import pytest

from kedfem.links.beams.section import rectangle
from tests.rooms.test_dynamics import run, worst_difference
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
