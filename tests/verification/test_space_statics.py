"""Beams in space bent far: orders of convergence against exact rods, and against planar beams in motion."""

import numpy as np

from tests.rooms.test_driven_efforts import arm
from tests.runs import ran

from .space_statics import error, exact_slanted, hinge_error, slanted


def test_a_strip_bent_both_ways_and_twisted_converges_with_the_fourth_power_of_its_elements() -> None:
    """Order 4, as linear beams of 3 nodes."""
    tip = exact_slanted(13.345, np.radians(30))
    errors = [error(*slanted(n, 13.345, np.radians(30)), tip) for n in (2, 4, 8)]
    slopes = -np.diff(np.log2(errors))
    assert errors[1] < 1e-3
    assert np.all(slopes > 3.3)
    assert np.all(slopes < 4.7)


def test_hinges_strain_the_end_of_a_beam_the_less_the_finer_its_mesh() -> None:
    """An end is 1000 E I / l stiff: its share of the tip's compliance falls with l."""
    errors = np.array([hinge_error(n) for n in (1, 4, 16)])
    assert errors[0] < 1e-3
    assert np.all(errors > 0)
    assert np.all((np.diff(np.log2(errors)) > -2.2) & (np.diff(np.log2(errors)) < -1.6))


def test_an_arm_that_whips_converges_as_planar_beams_do() -> None:
    """0.5 m, 4 × 20 mm, turned by 2 rad: tip against planar beams of 16 elements, of its largest deflection."""
    whole = whipped("beam", 16)
    errors = [np.abs(whipped("spatial", n) - whole).max() / np.abs(whole).max() for n in (2, 4)]
    assert errors[1] < 1e-3
    assert 3.5 < np.log2(errors[0] / errors[1]) < 4.5


def whipped(kind: str, elements: int) -> np.ndarray:
    raw = arm(kind, elements)
    raw["analysis"] |= {"end_time": 0.25, "step": 5e-4}
    if kind == "spatial":
        raw["links"]["arm"]["shape"]["up"] = [0, 0, 1]
    return ran(raw).displaced("arm", [0.5, 0, 0])[:, :2]
