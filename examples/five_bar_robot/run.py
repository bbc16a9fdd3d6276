"""A planar robot with two drives, its swing after the stop; run with `python examples/five_bar_robot/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene

STOP = 0.12  # s


def main() -> None:
    scene = read_scene(Path(__file__).with_name("scene.toml"))
    run = analyse(scene)
    channels = {name: values for name, (_, values) in run.results.channels.items()}
    time = run.results.time
    after = time > STOP + 0.005

    # rigid links need no torque once they stand still; elastic ones swing on about their place
    for drive in ("A", "E"):
        rigid, torque = channels[f"drive/{drive}/rigid_torque"][:, 0], channels[f"drive/{drive}/torque"][:, 0]
        print(
            f"drive {drive}: up to {np.abs(torque).max():.2f} N m; after the stop {np.abs(torque[after]).max():.3f} N m"
        )
        assert np.abs(rigid[after]).max() < 1e-6 * np.abs(rigid).max()

    # while the drives stand still the swing's energy can only go into damping
    swing = 1e6 * np.abs(channels["probes/tip/displacement"])
    print(f"tip: off its place by up to {swing.max():.0f} um, by {swing[after].max():.1f} um after the stop")
    energy = (channels["energy/kinetic"] + channels["energy/strain"])[after, 0]
    lost = channels["energy/dissipated"][after, 0]
    left = np.abs(energy - energy[0] + lost - lost[0]).max() / energy[0]
    ends = 1e6 * energy[[0, -1]]
    print(f"energy of the swing {ends[0]:.2f} uJ, at the end {ends[1]:.2f} uJ; {left:.1e} of it unaccounted for")
    assert energy[-1] < 0.5 * energy[0]
    assert left < 0.01
    assert run.balance is not None
    assert run.balance.energy < 1e-3


if __name__ == "__main__":
    main()
