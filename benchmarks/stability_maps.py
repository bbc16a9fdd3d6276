"""Maps of stability of a four-bar and of a slider-crank with stiffening, over speed and damping.

`python -m benchmarks.stability_maps FOLDER [four-bar | slider-crank]`: a sweep of steady motions of each, with the
edges of unstable bands to 0.1 %; in FOLDER/NAME are its picture, sweep.png, and its edges, edges.csv. The scenes are
those whose edges tests compare by three routes.
"""

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tests.laws.test_unstable_bands import plane_four_bar, plane_slider_crank

from kedfem.sweep import sweep
from kedfem.sweep.axes import axes_of
from kedfem.sweep.points import BaseScene
from kedfem.sweep.run import SweepOptions

#: scene, speeds, damping β [s], steps in a revolution
MAPS = {
    "four-bar": (plane_four_bar, "3000rpm:8000rpm:26", "5e-6,1e-5,2e-5,4e-5", 360),
    "slider-crank": (plane_slider_crank, "2400rpm:4400rpm:21", "5e-6,1e-5,2e-5,4e-5", 360),
}


def main(given: Sequence[str]) -> None:
    """The maps that are asked for, and their edges."""
    folder, names = Path(given[0]), given[1:] or list(MAPS)
    for name in names:
        linkage, speeds, damping, steps = MAPS[name]
        raw = linkage(True)
        raw["analysis"] |= {"kind": "steady", "steps_per_revolution": steps}
        over = axes_of([f"drive.motion.speed={speeds}", f"damping.beta={damping}"], raw)
        done = sweep(BaseScene(raw, folder, name), over, SweepOptions(quick=True, edges=1e-3), folder / name)
        print(name, dict(Counter(row.status for row in done.rows)))
        for each in done.edges:
            which = "unstable" if each.unstable_above else "stable"
            print(f"  beta = {each.others[0]}: {which} from {each.at:.5g} rpm on")


if __name__ == "__main__":
    main(sys.argv[1:])
