"""A shaft line with two universal joints; run with `python examples/universal_joint_shaft/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.kinematics import kinematics
from kedfem.scene import read_scene

BEND = np.radians(25)
G, DENSITY = 2.1e11 / 2.6, 7850.0  # steel
SOLID, TUBE = np.pi / 32 * 0.03**4, np.pi / 32 * (0.03**4 - 0.026**4)  # m^4
LENGTHS = 0.2, 0.6, 0.8 - 0.6 * np.cos(BEND)
WHEEL = 0.02  # kg m^2


def main() -> None:
    scene = read_scene(Path(__file__).with_name("scene.toml"))

    # one joint: tan phi2 = tan phi1 / cos beta or its inverse; the second one undoes it, the forks being in line
    rigid = kinematics(scene).results.channels
    turn, out = (rigid[f"joints/{name}/angle"][1][:, 0] for name in ("A", "D"))
    swing = np.abs(rigid["links/middle/angular_velocity"][1]).max()
    apart = np.degrees(np.abs(out - turn).max())
    print(f"output and input: {apart:.1e} deg apart; the middle shaft up to {swing:.1f} rad/s")
    assert np.abs(out - turn).max() < 1e-9

    # after the ramp the flywheel swings against the shafts' twist, three springs in a row
    run = analyse(scene)
    channels = {name: values[:, 0] for name, (_, values) in run.results.channels.items()}
    flexibility = sum(length / (G * J) for length, J in zip(LENGTHS, (SOLID, TUBE, SOLID), strict=True))
    inertia = WHEEL + DENSITY * (SOLID * LENGTHS[2] + TUBE * LENGTHS[1] / 3)
    wanted = np.sqrt(1 / (flexibility * inertia)) / (2 * np.pi)
    got = ringing(run.results.time, channels["drive/torque"] - channels["drive/rigid_torque"])
    print(f"the torque swings at {got:.2f} Hz, by the shafts' twist {wanted:.2f} Hz")
    assert 0.9 < got / wanted < 1.0  # the joints at 25 deg bend the shafts too, which adds flexibility
    peak, still = (np.abs(channels[f"drive/{name}"]).max() for name in ("torque", "rigid_torque"))
    print(f"torque up to {peak:.1f} N m, with all links rigid {still:.1f} N m")
    assert run.balance is not None
    assert run.balance.energy < 1e-3


def ringing(t: np.ndarray, x: np.ndarray) -> float:
    """Strongest frequency of a signal [Hz], between the lines of its spectrum by a parabola."""
    x = (x - x.mean()) * np.hanning(len(x))
    size = np.abs(np.fft.rfft(x, 16 * len(x)))
    return float(np.fft.rfftfreq(16 * len(x), t[1] - t[0])[size.argmax()])


if __name__ == "__main__":
    main()
