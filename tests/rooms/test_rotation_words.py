"""Rotations of links in the words of a check."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.tables.check import motion_in_words, rotation_in_words

OBLIQUE = np.array([1.0, -2.0, 2.0]) / 3


@pytest.mark.parametrize("axis", [np.array([0.0, 0.0, 1.0]), OBLIQUE])
@pytest.mark.parametrize(
    ("start", "end", "said"),
    [
        (0, 360, "rotates a full revolution"),
        (-90, 270, "rotates a full revolution"),
        (0, -720, "rotates 2 full revolutions"),
        (0, 359, "rotates up to 359° from the reference position"),
        (0, 60, "rotates up to 60° from the reference position"),
        (-20, 5, "rotates up to 20° from the reference position"),
        (0, 0, "rotates up to 0° from the reference position"),
    ],
)
def test_a_link_that_goes_round_makes_a_full_revolution(axis: np.ndarray, start: float, end: float, said: str) -> None:
    angles = np.radians(np.linspace(start, end, 73))
    assert rotation_in_words(Rotation.from_rotvec(angles[:, None] * axis).as_matrix()) == said


def test_about_several_axes_it_is_the_angle_between_both_positions() -> None:
    t = np.linspace(0, 1, 50)[:, None]
    R = Rotation.from_rotvec(t * [0.5, 0, 0]) * Rotation.from_rotvec(t * [0, 0.5, 0])
    angle = np.degrees(np.linalg.norm(R[-1].as_rotvec()))
    assert rotation_in_words(R.as_matrix()) == f"rotates up to {angle:.4g}° from the reference position"


def test_a_link_that_does_not_turn_slides_or_rests() -> None:
    """A ram turned "up to 1.1e-14°" while it went 45 mm."""
    R = Rotation.from_rotvec(1e-16 * np.ones((20, 3))).as_matrix()
    p = np.linspace(0, 1, 20)[:, None] * [0.03, -0.04, 0.0]
    assert motion_in_words(R, p, 0.5) == "slides up to 50 mm from the reference position"
    assert motion_in_words(R, 1e-15 * p, 0.5) == "does not move"
    R[-1] = Rotation.from_rotvec([0, 0, np.radians(3)]).as_matrix()
    assert motion_in_words(R, p, 0.5) == "rotates up to 3° from the reference position"
