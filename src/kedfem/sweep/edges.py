"""Edges of unstable bands, by bisection of the interval between a stable and an unstable point.

Neighbours are points whose other keys have the same values, along the first key.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.steady import GROWS
from kedfem.errors import SceneError
from kedfem.results.table import write_rows
from kedfem.scene import Scene
from kedfem.sweep.axes import Axis, Value, stated
from kedfem.sweep.points import GROWTH, Row

FINEST = 1e-9  # relative width of an edge: rounding, not speed, is found below


@dataclass(frozen=True, slots=True)
class Edge:
    """Where a motion becomes unstable, or stable again, along the first key.

    others : values of the other keys
    below, above : of the first key: the edge is between them
    unstable_above : whether the motion is unstable above the edge; else below
    points : numbers of the two points
    unknown : number of points between whose stability is unknown: they failed, or their steps are too long
    """

    others: tuple[Value, ...]
    below: float
    above: float
    unstable_above: bool
    points: tuple[int, int]
    unknown: int = 0

    @property
    def at(self) -> float:
        """The middle of the interval."""
        return 0.5 * (self.below + self.above)

    @property
    def width(self) -> float:
        """Relative width of the interval."""
        return (self.above - self.below) / max(abs(self.below), abs(self.above))


def refuse_without_growth(scene: Scene, axis: Axis, width: float) -> None:
    """Refuse edges without steady motions, their stability, or numbers along the first key."""
    if not FINEST <= width < 1.0:
        wanted = f"must be a relative width from {FINEST:g} to below 1, such as 0.001"
        raise SceneError(f"--edges: {wanted}, got {width:g}")
    if scene.analysis.kind != "steady" or not scene.analysis.stability:
        given = f"kind = {scene.analysis.kind!r}" if scene.analysis.kind != "steady" else "stability = false"
        raise SceneError(
            "--edges: must be combined with analysis.kind = 'steady' and its stability, which show what vibrations are "
            f"multiplied by in a period, got {given}"
        )
    if axis.numbers is None or len(axis.numbers) < 2:
        raise SceneError(f"--edges: must be combined with numbers of the first key, {axis.key}, at least two")


def edges(axes: Sequence[Axis], rows: Mapping[int, Row]) -> Iterator[Edge]:
    """All edges between finished points, in the order of the other keys and the first."""
    numbers, others = axes[0].numbers, axes[1:]
    if numbers is None:
        return
    lines: dict[tuple[Value, ...], list[int]] = {}
    for k in sorted(rows, key=lambda k: (float(numbers[k]), k)):
        lines.setdefault(tuple(axis.values[k] for axis in others), []).append(k)
    for same, line in lines.items():
        known = [n for n, k in enumerate(line) if GROWTH in rows[k].extremes]
        for m, n in pairwise(known):
            i, j = line[m], line[n]
            first, second = (rows[k].extremes[GROWTH][1][0] > 1 + GROWS for k in (i, j))
            if first != second:
                yield Edge(same, float(numbers[i]), float(numbers[j]), bool(second), (i, j), n - m - 1)


def unstable_bands(
    numbers: np.ndarray, rows: Sequence[Row], line: Sequence[int], found: Sequence[Edge]
) -> list[tuple[float, float]]:
    """Intervals of the first key in which the motion is unstable, along a line of points.

    Parameters
    ----------
    numbers : (n,) of the first key, at all points
    line : points that differ in the first key alone
    found : edges of this line, in rising order; none: a line is unstable throughout or not at all
    """
    growth = [rows[k].extremes[GROWTH][1][0] for k in line if GROWTH in rows[k].extremes]
    lowest, highest = float(np.min(numbers[line])), float(np.max(numbers[line]))
    if not found:
        return [(lowest, highest)] if growth and min(growth) > 1 + GROWS else []
    ends = [] if found[0].unstable_above else [lowest]
    ends += [each.at for each in found]
    ends += [highest] if found[-1].unstable_above else []
    return list(pairwise(ends))[::2]


def with_middles(axes: Sequence[Axis], found: Sequence[Edge]) -> list[Axis]:
    """The axes with an additional point in the middle of each edge."""
    first, out = axes[0], []
    middles = np.array([each.at for each in found])
    for axis in axes:
        if axis is first:
            values = tuple(stated(x, axis.unit) for x in middles)
            numbers = None if axis.numbers is None else np.concatenate([axis.numbers, middles])
            out.append(replace(axis, values=axis.values + values, numbers=numbers))
        else:
            out.append(axis.at([*range(len(axis.values)), *(each.points[0] for each in found)]))
    return out


def write_edges(path: FilePath, axes: Sequence[Axis], found: Sequence[Edge]) -> None:
    """One line per edge: values of the other keys, the edge, half its width, and the unstable side."""
    first = axes[0]
    unit = f" [{first.unit}]" if first.unit else ""
    header = [*(axis.key for axis in axes[1:]), f"{first.key}{unit}", f"half width{unit}", "unstable"]
    write_rows(path, header, (
        [*each.others, each.at, f"{0.5 * (each.above - each.below):.3g}", "above" if each.unstable_above else "below"]
        for each in found
    ))  # fmt: skip
