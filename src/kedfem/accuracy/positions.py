"""Estimate of the largest values between the positions of static and quasi-static analyses, for the error budget.

A smooth curve with the second difference D at its highest point rises by at most D/8 above it between two points. Where
a load starts or ends the curve jumps. The median of five second differences ignores the jump, and the uncertainty of the
highest value is half the difference to its nearer neighbour.

Meshes are compared in fewer positions than those of a run, which would take as much time as the run: in so few that they
still show nearly the largest values of all channels.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kedfem.accuracy.error_budget import Share, by_kind
from kedfem.accuracy.histories import Histories, counted
from kedfem.accuracy.longer_steps import in_steps
from kedfem.arrays import Float
from kedfem.scene import Scene, time_grid

FEWEST = 24  # positions in which meshes are compared
SHOWN = 0.9  # least part of the largest value of each channel that these positions show
AROUND = 2  # positions on both sides of the highest one whose second differences count


def positions_share(found: Histories, sizes: Mapping[str, float]) -> Share:
    """Relative excess of the largest value of each channel between two positions.

    Parameters
    ----------
    found : channels, with a row for each position
    sizes : largest value of each judged channel
    """
    lengths = {name: np.linalg.norm(found.channels[name][1], axis=1) for name in sizes}
    errors = {name: missed(lengths[name]) / size for name, size in sizes.items()}
    remedy = "take more of them, analysis.steps_per_revolution, and let loads come and go over several of them"
    return Share("positions", by_kind(errors), remedy)


def missed(values: Float[np.ndarray, " n"]) -> float:
    """Possible rise of a curve between its points above its largest value; 0 if that is at an end.

    Examples
    --------
    >>> missed(np.array([0.0, 3.0, 4.0, 3.0, 0.0])), missed(np.array([0.0] * 3 + [5.0] * 4))
    (0.5, 0.0)
    """
    k = int(values.argmax())
    if k in {0, len(values) - 1}:
        return 0.0
    steps, bends = np.abs(np.diff(values)), np.abs(np.diff(values, 2))
    around = bends[max(k - 1 - AROUND, 0) : k + AROUND]  # bends[k - 1] is that at k
    return float(max(steps[k - 1 : k + 1].min() / 2, np.median(around) / 8))


def fewer_positions(scene: Scene, found: Histories) -> tuple[Scene, Histories]:
    """The scene in so few positions that they still nearly show the largest value of each channel, and its channels."""
    grid, sizes = time_grid(scene), counted(found)
    lengths = {name: np.linalg.norm(found.channels[name][1], axis=1) for name in sizes}
    apart = max(1, grid.steps // FEWEST)
    while apart > 1 and any(lengths[name][::apart].max() < SHOWN * size for name, size in sizes.items()):
        apart //= 2
    if apart == 1 or len(found.time) != grid.steps + 1:
        return scene, found
    some = {name: (channel, values[::apart]) for name, (channel, values) in found.channels.items()}
    scene = in_steps(scene, apart * grid.step, grid.steps // apart)
    return scene, replace(found, time=found.time[::apart], channels=some)
