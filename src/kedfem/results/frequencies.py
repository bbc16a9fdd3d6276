"""Natural frequencies over positions, and of single links, as tables for spreadsheets."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from kedfem.results.table import text_file, write_numbers


def write_frequencies(
    path: Path, t: Float[np.ndarray, " P"], place: Float[np.ndarray, " P"], values: Float[np.ndarray, "P f"],
    slides: bool,
) -> None:  # fmt: skip
    """One row a position: time [s], drive angle [rad] or travel [m], natural frequencies [Hz].

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    header = ["time [s]", "drive travel [m]" if slides else "drive angle [rad]"]
    header += [f"frequency {k + 1} [Hz]" for k in range(values.shape[1])]
    with text_file(path) as file:
        write_numbers(file, header, np.column_stack([t, place, values]))


def write_part_frequencies(path: Path, values: Float[np.ndarray, " f"]) -> None:
    """One row a mode: its number, natural frequency [Hz].

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with text_file(path) as file:
        write_numbers(file, ["mode", "frequency [Hz]"], np.column_stack([1 + np.arange(len(values)), values]))
