"""The slider-crank of solid parts; run with `python examples/slider_crank_solids/run.py`."""

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
    # the guide pushes across its direction only
    guide = channels["joints/guide/force"][1]
    assert np.abs(guide[:, 0]).max() < 1e-9 * np.abs(guide[:, 1]).max()
    assert run.peak is not None
    print(f"highest von Mises stress {run.peak.stress / 1e6:.1f} MPa in the {run.peak.link}; see {run.folder}")


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


if __name__ == "__main__":
    main()
