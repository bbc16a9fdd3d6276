"""Which channels count where errors are told: not forces that are rounding beside moments, nor these beside forces."""

import numpy as np
import pytest

from kedfem.accuracy.histories import Histories, counted
from kedfem.results import Channel


def histories(force: float, moment: float, size: float) -> Histories:
    """A balanced rotor: forces of its joint, and the torque of its drive."""
    made = {
        "joints/A/force": (Channel("joints/A/force", ("x", "y", "z"), "N", "world", ""), force),
        "drive/torque": (Channel("drive/torque", ("torque",), "N m", "world", ""), moment),
    }
    every = {name: (each, np.full((3, len(each.columns)), value)) for name, (each, value) in made.items()}
    return Histories(np.linspace(0.0, 1.0, 3), every, size=size)


@pytest.mark.parametrize(
    ("force", "moment", "size", "names"),
    [
        (7e-7, 13.0, 0.5, {"drive/torque"}),
        (1e-3, 13.0, 0.5, {"joints/A/force", "drive/torque"}),
        (1e-3, 13.0, 1e-3, {"drive/torque"}),
        (50.0, 1e-5, 0.5, {"joints/A/force"}),
        (7e-7, 0.0, 0.5, {"joints/A/force"}),
    ],
)
def test_what_is_rounding_beside_others_does_not_count(force: float, moment: float, size: float, names: set[str]) -> None:
    """Forces against moments at the arm of the linkage's size, by 1e-6 as against other forces."""
    assert counted(histories(force, moment, size)).keys() == names
