"""A spatial four-bar with a ball and a universal joint; run with `python examples/rssr/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene

ROD = np.linalg.norm([0.2, 0.025, 0.46650635])  # m


def main() -> None:
    run = analyse(read_scene(Path(__file__).with_name("scene.toml")))
    channels = {name: values for name, (_, values) in run.results.channels.items()}

    # a ball bears no moment, the universal joint one about its cross's normal only: that holds the rod from spinning
    force, ball, cross = (channels[f"joints/{name}"] for name in ("B/force", "B/moment", "C/moment"))
    most = np.linalg.norm(force, axis=1).max()
    share = np.linalg.norm(cross, axis=1).max() / (most * ROD)
    print(f"force at the ball {most:.1f} N; moment of the cross {share:.1e} of force times rod")
    assert np.abs(ball).max() < 1e-9 * np.abs(force).max()
    assert share < 1e-3

    middle = np.linalg.norm(channels["probes/rod_middle/displacement"], axis=1)
    print(f"the rod's middle bends out by {1e3 * middle.max():.2f} mm")
    torque, rigid = (channels[f"drive/{name}"][:, 0] for name in ("torque", "rigid_torque"))
    last = run.results.angle >= run.results.angle[-1] - 2 * np.pi
    rms = np.sqrt(np.mean((torque - rigid)[last] ** 2) / np.mean(rigid[last] ** 2))
    print(f"drive torque {np.abs(torque).max():.2f} N m, rms {100 * rms:.1f} % from that of rigid links")
    assert rms < 0.1
    assert run.balance is not None
    assert run.balance.energy < 1e-3


if __name__ == "__main__":
    main()
