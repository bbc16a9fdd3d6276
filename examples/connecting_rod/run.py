"""The engine from CAD parts; run with `python examples/connecting_rod/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene

RADIUS, ROD = 0.04, 0.14


def main() -> None:
    run = analyse(read_scene(Path(__file__).with_name("scene.toml")))
    for name, way in run.results.notes.items():
        if name.startswith("mesh of "):
            print(f"{name}: {way}")
            assert "swept along z" in str(way)  # all three consist of layers
    channels = run.results.channels
    torque, rigid = (channels[name][1][:, 0] for name in ("drive/torque", "drive/rigid_torque"))
    difference = rms(torque - rigid) / rms(rigid)
    print(f"drive torque: {rms(torque):.2f} N m rms, {100 * difference:.1f} % from that of the rigid linkage")
    assert difference < 0.06
    # the guide pushes across its direction only, and as much as the rod leans: on a massless rod F_y = F_x tan β
    guide, pin = channels["joints/guide/force"][1], channels["joints/C/force"][1]
    assert np.abs(guide[:, 0]).max() < 1e-6 * np.abs(guide[:, 1]).max()
    assert np.abs(pin[:, 1]).max() < 1.3 * np.abs(pin[:, 0]).max() * RADIUS / np.sqrt(ROD**2 - RADIUS**2)
    assert run.peak is not None
    print(f"highest von Mises stress {run.peak.stress / 1e6:.1f} MPa in the {run.peak.link}; see {run.folder}")


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


if __name__ == "__main__":
    main()
