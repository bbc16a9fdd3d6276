"""Natural frequencies over positions, and of single links, as tables for spreadsheets and for reports."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.results.files import replacing
from kedfem.results.table import text_file, write_numbers

FREQUENCIES = "frequencies"  # name of their folder beside that of a run: `results.files.beside`
OVER_TURN, CAMPBELL, SUMMARY = "frequencies.png", "campbell.png", "frequencies.json"


@dataclass(frozen=True, slots=True)
class Summary:
    """Natural frequencies of a linkage in short.

    scene : its text; none of a scene made in Python
    positions, free, still : how many; whether drives release their joints; motions without strain
    lowest, highest : of each mode over all positions [Hz]
    speed : of the drive [rpm]; 0 of one that does not rotate continuously
    crossings : mode, harmonic of the drive, slowest and fastest speed at which they meet [rpm]
    notes : how exact they are, and warnings
    """

    scene: str | None
    positions: int
    free: bool
    still: int
    lowest: list[float]
    highest: list[float]
    speed: float
    crossings: list[tuple[int, int, float, float]]
    notes: list[str]


def write_summary(folder: Path, summary: Summary) -> None:
    """Write what a report shows of them."""
    with replacing(folder / SUMMARY) as part:
        part.write_text(json.dumps(asdict(summary)), encoding="utf-8")


def read_summary(folder: Path) -> Summary | None:
    """The contents of the file of :func:`write_summary`; None without one, or if another program wrote it."""
    try:
        found = Summary(**json.loads((folder / SUMMARY).read_text(encoding="utf-8")))
        numbers = np.array([*found.lowest, *found.highest, *np.ravel(found.crossings)], float)
    except (OSError, ValueError, TypeError):
        return None
    return found if not np.isnan(numbers).any() else None


def write_frequencies(
    path: Path, t: Float[np.ndarray, " P"], place: Float[np.ndarray, " P"], values: Float[np.ndarray, "P f"],
    drive: str,
) -> None:  # fmt: skip
    """One row a position: time [s], drive angle [rad] or travel [m], natural frequencies [Hz]."""
    header = ["time [s]", drive, *(f"frequency {k + 1} [Hz]" for k in range(values.shape[1]))]
    with text_file(path) as file:
        write_numbers(file, header, [np.column_stack([t, place, values])])


def write_part_frequencies(path: Path, values: Float[np.ndarray, " f"]) -> None:
    """One row a mode: its number, natural frequency [Hz]."""
    with text_file(path) as file:
        rows = np.column_stack([1 + np.arange(len(values)), values])
        write_numbers(file, ["mode", "frequency [Hz]"], [rows])
