"""The spinning bar against its exact stretch; run with `python examples/spinning_bar/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene

RHO, E, L, OMEGA = 7800.0, 2e11, 0.5, 3000.0


def main() -> None:
    results = analyse(read_scene(Path(__file__).with_name("scene.toml"))).results
    _, tip = results.channels["probes/tip/displacement"]
    alpha = np.sqrt(RHO * OMEGA**2 / E)
    exact = np.sin(alpha * L) / (alpha * np.cos(alpha * L)) - L  # code_aster V3.04.105: 0.0151572424 m
    stretch = tip[-1, 0]
    print(f"stretch of the steady rotation: {1e3 * stretch:.5f} mm, exact {1e3 * exact:.5f} mm")
    assert abs(stretch / exact - 1) < 1e-4
    _, force = results.channels["joints/A/force"]
    # the pull at the root of an axially vibrating bar in steady rotation: E A u'(0) = E A (1/cos αL − 1)
    pull = E * 0.02**2 * (1 / np.cos(alpha * L) - 1)
    print(f"pull at the root: {1e-3 * np.linalg.norm(force[-1]):.3f} kN, exact {1e-3 * pull:.3f} kN")
    assert abs(np.linalg.norm(force[-1]) / pull - 1) < 1e-4


if __name__ == "__main__":
    main()
