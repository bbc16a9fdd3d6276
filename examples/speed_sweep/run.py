"""Resonances of a slender rod over speed, each point a steady motion; run with `python examples/speed_sweep/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.frequencies import Wanted, frequencies
from kedfem.scene import read_keys, read_scene
from kedfem.sweep import BaseScene, SweepOptions, axes_of, sweep

SCENE = Path(__file__).with_name("scene.toml")
RANGE = "drive.speed=1600rpm:2400rpm:9"


def main() -> None:
    # where harmonic 2 of the crank meets the rod's first frequency, of the frozen linkage
    found = frequencies(read_scene(SCENE), Wanted(modes=1))
    (crossing,) = (x for x in found.crossings if x.harmonic == 2)
    expected = (crossing.slowest + crossing.fastest) / 2 * 30 / np.pi
    print(f"harmonic 2 meets {found.values[0, 0]:.2f} Hz at {expected:.0f} rpm")

    raw, _ = read_keys(SCENE)
    done = sweep(BaseScene(raw, SCENE.parent, SCENE.stem), axes_of([RANGE], raw), SweepOptions())
    speeds = np.asarray(done.axes[0].numbers)
    stress = np.array([row.extremes["stress/rod/peak"][1][0] for row in done.rows])
    growth = np.array([row.extremes["steady/growth"][1][0] for row in done.rows])
    worst = int(stress.argmax())
    print(f"peak stress of the rod {1e-6 * stress[worst]:.1f} MPa at {speeds[worst]:.0f} rpm, "
          f"{1e-6 * stress[0]:.1f} MPa at {speeds[0]:.0f} rpm")  # fmt: skip
    assert abs(speeds[worst] - expected) < 51
    assert stress[worst] > 3 * stress[0]
    # 2 % damping leaves exp(-2 pi 0.02 f T) of the rod's first vibration after a revolution
    left = np.exp(-2 * np.pi * 0.02 * found.values[0, 0] * 60 / speeds)
    assert np.all(growth < 1)
    assert np.abs(growth / left - 1).max() < 0.02


if __name__ == "__main__":
    main()
