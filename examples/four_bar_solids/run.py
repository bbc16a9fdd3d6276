"""The four-bar of plate links; run with `python examples/four_bar_solids/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene


def main() -> None:
    run = analyse(read_scene(Path(__file__).with_name("scene.toml")))
    channels = run.results.channels
    # stiff links: the drive's torque is that of the rigid linkage, by virtual work, but for a few percent of vibration
    torque, rigid = (channels[name][1][:, 0] for name in ("drive/torque", "drive/rigid_torque"))
    difference = rms(torque - rigid) / rms(rigid)
    print(f"drive torque: {rms(torque):.2f} N m rms, {100 * difference:.1f} % from that of the rigid linkage")
    assert difference < 0.06
    # nothing constrains the pins of a planar linkage sideways: their forces stay in its plane
    for joint in "ABCD":
        force = channels[f"joints/{joint}/force"][1]
        assert np.abs(force[:, 2]).max() < 1e-6 * np.abs(force).max()
    assert run.peak is not None
    print(f"highest von Mises stress {run.peak.stress / 1e6:.1f} MPa in the {run.peak.link}; see {run.folder}")


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


if __name__ == "__main__":
    main()
