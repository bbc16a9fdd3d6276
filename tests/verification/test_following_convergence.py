"""Order two in the step of frames that follow, from both sides."""

import numpy as np
import pytest

from .following import double_errors, flight_errors, four_bar_error


@pytest.mark.long
def test_a_thrown_rod_and_its_energy_converge_with_order_two_in_the_step() -> None:
    """Positions of the ends against the reference; what numerical damping takes falls with the third power."""
    coarse, fine = flight_errors(5e-4), flight_errors(2.5e-4)
    order = np.log2(np.abs(coarse / fine))
    assert np.all(order[:4] > 1.7)
    assert np.all(order[:4] < 2.2)
    assert np.all(fine[:4] < 1.2e-4)
    assert 2.5 < order[6] < 3.5
    assert 0 < fine[6] < 1e-6


def test_a_double_pendulum_converges_with_order_two_in_the_step() -> None:
    coarse, fine = np.array(double_errors(1e-3)), np.array(double_errors(5e-4))
    order = np.log2(coarse / fine)
    assert np.all(order > 1.8)
    assert np.all(order < 2.2)


@pytest.mark.long
def test_the_four_bar_at_600_rpm_converges_with_order_two_in_the_step() -> None:
    errors = [four_bar_error(600, 0.02, 8, h, 5) for h in (1e-4, 5e-5, 2.5e-5)]
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(order > 1.8)
    assert np.all(order < 2.2)
    assert errors[-1] < 2e-3
