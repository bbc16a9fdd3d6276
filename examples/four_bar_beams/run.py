"""The source's four-bar of beams; run with `python examples/four_bar_beams/run.py`."""

import tomllib
from pathlib import Path

import numpy as np

from kedfem.accuracy.prepared import meshed
from kedfem.analysis import analyse
from kedfem.scene import read_scene, scene_from

SCENE = Path(__file__).with_name("scene.toml")


def main() -> None:
    ready = meshed(read_scene(SCENE))
    assert ready.model.coordinates == 18  # [KED]: 27 − 2·2 at B, C − 3 at the driven root − 2 at D

    coarse, fine, finer = stress(720, 4), stress(720, 8), stress(1440, 8)
    peak = np.abs(fine).max()
    low, high = fine.min() / 1e6, fine.max() / 1e6
    print(f"bending stress on the rocker's outer side, last revolution: {low:.1f} to {high:.1f} MPa")
    space, time = np.abs(fine - coarse).max() / peak, np.abs(fine - finer[::2]).max() / peak
    print(f"changes with 4 → 8 elements a link by {100 * space:.1f} %, with the step halved by {100 * time:.1f} %")
    assert space < 0.06
    assert time < 0.03

    # far below resonance only inertia loads the links: the stress grows with the square of the speed
    slow, twice = (np.abs(stress(720, 2, f"{rpm} rpm", revolutions=3)).max() for rpm in (15, 30))
    print(f"peak stress at 15 and 30 rpm: {slow / 1e3:.1f} and {twice / 1e3:.1f} kPa, ratio {twice / slow:.3f}")
    assert abs(twice / slow - 4) < 0.1


def stress(steps_per_revolution: int, elements: int, speed: str = "600 rpm", revolutions: int = 8) -> np.ndarray:
    """Stress of the last revolution [Pa]."""
    raw = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    for link in raw["links"].values():
        link["mesh"] = {"elements": elements}
    raw["drive"]["motion"]["speed"] = speed
    raw["analysis"] |= {"steps_per_revolution": steps_per_revolution, "revolutions": revolutions}
    if (steps_per_revolution, elements) != (1440, 8):  # pictures of the finest run only
        raw["output"] |= {"animation": False, "plots": False, "csv": False}
    results = analyse(scene_from(raw, SCENE.parent)).results
    return results.channels["probes/rocker_outer/stress"][1][-steps_per_revolution - 1 :, 0]


if __name__ == "__main__":
    main()
