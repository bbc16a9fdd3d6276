"""Estimate of the largest values between the positions of static and quasi-static analyses, for the error budget.

A smooth curve with the second difference D about its highest point rises by at most D/8 above it between two points.
Where a load comes or goes the curve jumps (the median of five second differences knows nothing of it), and what it has
reached by then is open by half the step to the flatter side.
"""

from collections.abc import Mapping

import numpy as np

from kedfem.accuracy.error_budget import Share, by_kind
from kedfem.accuracy.histories import Histories
from kedfem.arrays import Float

AROUND = 2  # positions on both sides of the highest one at which the curve's bend counts


def positions_share(found: Histories, sizes: Mapping[str, float]) -> Share:
    """Relative excess of the largest value of each channel between two positions.

    Parameters
    ----------
    found : channels, a row for each position
    sizes : channel that counts → its largest value
    """
    lengths = {name: np.linalg.norm(found.channels[name][1], axis=1) for name in sizes}
    errors = {name: missed(lengths[name]) / size for name, size in sizes.items()}
    remedy = "take more of them, analysis.steps_per_revolution, and let loads come and go over several of them"
    return Share("positions", by_kind(errors), remedy)


def missed(values: Float[np.ndarray, " n"]) -> float:
    """Possible rise of a curve above its largest value between its points; 0 if that is at an end.

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
