"""Linear frames and co-rotational frames, from rest; run with `python examples/four_bar_corotational/run.py`."""

import tomllib
from pathlib import Path

import numpy as np

from kedfem.analysis import Run, analyse
from kedfem.scene import scene_from

SCENE = Path(__file__).with_name("scene.toml")
PEAK = 352.6e6  # Pa, three revolutions; geometrically exact beams (Reissner 1972), converged in mesh and step


def main() -> None:
    linear, stiffened = run(frames="rigid-body"), run(frames="rigid-body", stiffening=True)
    assert linear.budget.of("frames").errors["stress"] > 0.15  # it says so itself
    print(*linear.warnings, sep="\n")
    corotational = run(pictures=True)
    y = stress(corotational)
    peak = np.abs(y).max()
    off = {name: np.abs(stress(each) - y).max() / peak for name, each in (("linear", linear), ("stiffened", stiffened))}
    print(f"peak stress {peak / 1e6:.1f} MPa, exact beams {PEAK / 1e6:.1f} MPa")
    print(*(f"the {name} equation is off by {100 * error:.0f} % of it at worst" for name, error in off.items()), sep="\n")
    assert abs(peak / PEAK - 1) < 0.01
    assert 0.35 < off["linear"] < 0.45  # 40 % against exact beams
    assert off["stiffened"] < 0.6 * off["linear"]
    assert corotational.balance is not None
    print(f"energy not accounted for: {corotational.balance.energy:.1e} of the largest exchanged")
    assert corotational.balance.energy < 1e-3

    # at a tenth of the speed links bend a hundredth as far, and the linear equation serves
    slow = [stress(run("60 rpm", revolutions=1, frames=frames)) for frames in ("rigid-body", "co-rotational")]
    left = np.abs(slow[0] - slow[1]).max() / np.abs(slow[1]).max()
    print(f"at 60 rpm by {100 * left:.2f} %")
    assert left < 0.01


def run(speed: str = "600 rpm", pictures: bool = False, **analysis: object) -> Run:
    """A run of the scene, changed."""
    raw = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    raw["drive"]["motion"]["speed"] = speed
    raw["analysis"] |= analysis
    if not pictures:
        raw["output"] |= {"animation": False, "plots": False, "picture": False}
    return analyse(scene_from(raw, SCENE.parent))


def stress(of: Run) -> np.ndarray:
    """Stress on the outer side of the rocker's midpoint [Pa]."""
    return of.results.channels["probes/rocker_outer/stress"][1][:, 0]


if __name__ == "__main__":
    main()
