"""Frequencies of a four-bar and of its links alone; run with `python examples/four_bar_frequencies/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.frequencies import Wanted, frequencies, link_of_scene, part_frequencies
from kedfem.scene import read_scene

SCENE = Path(__file__).with_name("scene.toml")


def bending(length: float, height: float) -> float:
    """First frequency of a slender steel bar between two hinges [Hz]: (π/L)² √(EI/ρA) / 2π."""
    return float(np.pi / 2 / length**2 * height * np.sqrt(210e9 / 12 / 7850))


def main() -> None:
    scene = read_scene(SCENE)
    coupler = part_frequencies(link_of_scene(scene, "coupler", ["B", "C"]), 1)
    alone, slender = float(coupler.values[0]), bending(0.32, 6e-3)
    print(f"coupler between its hinges: {alone:.1f} Hz, slender {slender:.1f} Hz")
    assert coupler.still == 0
    assert abs(alone / slender - 1) < 2e-3  # shear and rotary inertia, four elements

    free = part_frequencies(link_of_scene(scene, "coupler"), 1)
    assert free.still == 3  # a body in a plane
    # Euler and Bernoulli's bars: (4.7300 / π)² between free ends and hinged ones
    assert abs(free.values[0] / alone / (4.7300 / np.pi) ** 2 - 1) < 5e-3

    whole = frequencies(scene, Wanted(modes=2, positions=24))
    first = whole.values[:, 0]
    where = np.degrees(whole.angle[first.argmin()])
    print(f"linkage: {first.min():.1f} Hz at {where:.0f}° of the crank to {first.max():.1f} Hz")
    assert whole.still == 0  # the drive holds the crank
    assert frequencies(scene, Wanted(modes=1, positions=2, free=True), SCENE.with_name("free-frequencies")).still == 1
    for crossing in (x for x in whole.crossings if x.mode == 1):
        slowest, fastest = (30 / np.pi * speed for speed in (crossing.slowest, crossing.fastest))
        print(f"harmonic {crossing.harmonic} meets it at {slowest:.0f} to {fastest:.0f} rpm")
        assert np.isclose(slowest * crossing.harmonic / 60, first.min())
    assert first.max() > 1.1 * first.min()  # the flywheel pushes the other links differently at each position


if __name__ == "__main__":
    main()
