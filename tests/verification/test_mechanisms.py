"""Rates of convergence of the source's four-bar, from both sides."""

import numpy as np
import pytest

from .mechanisms import rigid_errors, space_errors, time_errors


def test_stress_converges_with_the_elements() -> None:
    e = space_errors()
    # beams of two Gauss points: stress at a node between elements converges with order 2 and better
    assert 1.9 < np.log2(e[8] / e[16]) < 4.5
    assert 1.9 < np.log2(e[4] / e[8]) < 4.5


@pytest.mark.long
def test_stress_converges_with_order_two_in_the_step() -> None:
    e = time_errors()
    assert 1.9 < np.log2(e[720] / e[1440]) < 2.2
    assert 1.9 < np.log2(e[1440] / e[2880]) < 2.2


def test_drive_torque_tends_to_the_rigid_linkages_with_one_over_E() -> None:
    e = rigid_errors()
    assert 0.85 < np.log(e[1] / e[4]) / np.log(4) < 1.3
    assert 0.85 < np.log(e[4] / e[16]) / np.log(4) < 1.3
