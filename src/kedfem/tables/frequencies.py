"""Natural frequencies over positions, and where harmonics of the drive meet them."""

from collections.abc import Mapping, Sequence

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.frequencies import Crossing, Frequencies, PartFrequencies
from kedfem.output.words import moment, with_prefix
from kedfem.scene import Scene
from kedfem.scene.records.units import RPM

WIDTH, BORDER = 72, 3  # of columns beside the first in a terminal of 80 characters; of each
MODES = 8  # side by side


def frequencies_tables(scene: Scene, found: Frequencies) -> list[Table]:
    """Frequencies at each position; of a drive that goes on turning critical speeds of each harmonic."""
    still = f"; {found.still} motions without strain, at 0 Hz" if found.still else ""
    stiffened = ", stiffened by its motion" if scene.analysis.stiffening else ""
    out = []
    for modes in _blocks(range(found.values.shape[1]), MODES):
        table = Table(title=Text(f"Natural frequencies of the frozen linkage{stiffened} [Hz]{still}"))
        table.add_column("position")
        for k in modes:
            table.add_column(str(k + 1), justify="right")
        for t, angle, row in zip(found.time, found.angle, found.values, strict=True):
            place = (
                "in the reference position" if scene.driven is None else moment(scene, float(t), float(angle))
            )
            table.add_row(place, *("–" if np.isnan(row[k]) else f"{row[k]:.4g}" for k in modes))
        out.append(table)
    ranges = {(x.mode, x.harmonic): _range(x, found.speed) for x in found.crossings}
    harmonics = sorted({k for _, k in ranges})
    side_by_side = WIDTH // (BORDER + max(map(len, ranges.values()), default=1))
    return out + [_speeds(found, ranges, some) for some in _blocks(harmonics, side_by_side)]


def _speeds(found: Frequencies, ranges: Mapping[tuple[int, int], str], harmonics: Sequence[int]) -> Table:
    message = (
        f"Drive speeds at which its harmonics meet them [rpm]; the drive turns at {found.speed * RPM:.4g}"
    )
    beyond = any(np.isinf(x.fastest) for x in found.crossings)
    caption = "* at the drive's speed" + ("; – alone: beyond the speeds examined" if beyond else "")
    table = Table(title=Text(message), caption=Text(caption))
    table.add_column("mode")
    for k in harmonics:
        table.add_column(f"{k}×", justify="right")
    for mode in sorted({mode for mode, _ in ranges}):
        table.add_row(str(mode), *(ranges.get((mode, k), "–") for k in harmonics))
    return table


def _blocks(numbers: Sequence[int], most: int) -> list[Sequence[int]]:
    """Columns that fit beside one another."""
    return [numbers[k : k + most] for k in range(0, len(numbers), most)]


def _range(x: Crossing, speed: float) -> str:
    """From the slowest speed to the fastest [rpm], with a mark where the drive's is among them."""
    here = " *" * (x.slowest <= speed <= x.fastest)
    fastest = f"{x.fastest * RPM:.0f}" if np.isfinite(x.fastest) else ""
    return f"{x.slowest * RPM:.0f}–{fastest}{here}"


def part_tables(found: PartFrequencies) -> list[Table]:
    """Frequencies of a single link; what it is and what holds it."""
    part, still = found.part, found.still
    held = f"held at {', '.join(part.held)}" if part.held else "free"
    table = Table(
        title=Text(f"Natural frequencies of {part.name}, {held}"),
        caption=Text(f"{still} motions without strain, at 0 Hz, are left out") if still else None,
        show_header=False,
        min_width=60,
    )
    table.add_row("mass", with_prefix(found.mass, "kg"))
    table.add_row("unknowns", str(part.link.unknowns))
    for number, f in enumerate(found.values, 1):
        table.add_row(f"mode {number}", f"{f:.5g} Hz")
    return [table]
