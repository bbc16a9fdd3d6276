"""A four-bar that a motor spins up; run with `python examples/motor_four_bar/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene

CRANK, COUPLER, ROCKER, FRAME = 0.3048, 0.9144, 0.762, 0.9144  # m
TORQUE, NO_LOAD, DAMPER = 30.0, 300 * np.pi / 30, 3.0  # N m at rest; rad/s; N m s/rad


def main() -> None:
    run = analyse(read_scene(Path(__file__).with_name("scene.toml")))
    channels = {name: values[:, 0] for name, (_, values) in run.results.channels.items()}
    angle, speed = channels["motors/drive/angle"], channels["motors/drive/speed"]

    # the energy account of the whole run: what the scheme leaves, of the largest energy exchanged
    assert run.balance is not None
    print(f"energy not accounted for: {run.balance.energy:.1e} of the largest exchanged")
    assert run.balance.energy < 1e-3

    # over the last revolution the motor gives what the damper takes; weights and spring return what they were given
    last = angle >= angle[-1] - 2 * np.pi
    given = np.trapezoid(channels["motors/drive/torque"][last], angle[last])
    taken = -np.trapezoid(channels["springs/load/torque"][last], channels["springs/load/angle"][last])
    gained = np.ptp(channels["energy/kinetic"][last][[0, -1]])
    print(f"last revolution: the motor gives {given:.2f} J, the damper takes {taken:.2f} J, {gained:.3f} J stay")
    assert abs(given - taken) < 0.01 * given

    # it settles where the motor's mean torque is the damper's, T (1 - w/w0) = c w <(rocker's speed / crank's)^2>
    settled = TORQUE / (TORQUE / NO_LOAD + DAMPER * transmission())
    mean = 2 * np.pi / np.ptp(run.results.time[last])
    print(f"mean speed of the last revolution: {mean:.3f} rad/s, of rigid links at even speed {settled:.3f} rad/s")
    assert abs(mean / settled - 1) < 0.01
    assert np.ptp(speed[last]) < 0.2 * mean

    stress = np.abs(channels["probes/coupler_stress/stress"])
    print(f"highest bending stress in the coupler: {stress.max() / 1e6:.1f} MPa")


def transmission() -> float:
    """Mean square of the rocker's speed over the crank's, from the law of cosines."""
    phi = np.linspace(0, 2 * np.pi, 3601)
    diagonal = np.sqrt(FRAME**2 + CRANK**2 - 2 * FRAME * CRANK * np.cos(phi))
    below = np.arctan2(CRANK * np.sin(phi), FRAME - CRANK * np.cos(phi))  # of the diagonal, at D
    inside = np.arccos((ROCKER**2 + diagonal**2 - COUPLER**2) / (2 * ROCKER * diagonal))
    rocker = np.pi - below - inside
    return float(np.mean(np.gradient(rocker, phi)[:-1] ** 2))


if __name__ == "__main__":
    main()
