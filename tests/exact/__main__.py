"""Compute the references again: ``python -m tests.exact [names]`` writes tests/verification/data/<name>.csv.

Without names all of them, which takes a quarter of an hour.
"""

import sys
from pathlib import Path

import numpy as np

from .cases import CASES, Case
from .solve import Stepping, motion

FOLDER = Path(__file__).parents[1] / "verification" / "data"


def history(case: Case, h: float, elements: int) -> tuple[np.ndarray, np.ndarray]:
    """t (T,) and values (T, c) with one step and mesh."""
    this = case.build(elements, case.nodes)
    stepping = Stepping(h, round(case.end / h), round(case.spacing / h), case.rho_inf)
    t, values, _ = motion(this.problem, this.first, stepping, this.observed)
    return t, values


def reference(case: Case) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """t, values extrapolated in the step (h², from h and 2h), and their errors by step and by mesh per column.

    The step's error is taken to be the change of the extrapolated values from (2h, 4h) to (h, 2h), the mesh's that
    of half the elements at 4h: both are too large rather than too small.
    """
    t, coarse = history(case, 4 * case.h, case.elements)
    half = history(case, 4 * case.h, case.elements // 2)[1]
    middle, fine = (history(case, k * case.h, case.elements)[1] for k in (2, 1))
    values = (4 * fine - middle) / 3
    before = (4 * middle - coarse) / 3
    return t, values, np.abs(values - before).max(axis=0), np.abs(half - coarse).max(axis=0)


def write(name: str) -> None:
    """One file, with its command and errors in front."""
    case = CASES[name]
    t, values, by_step, by_mesh = reference(case)
    peak = np.abs(values).max(axis=0)
    lines = [
        f"python -m tests.exact {name}",
        f"extrapolated from steps {2 * case.h:.6g} s and {case.h:.6g} s; "
        f"{case.elements} elements of {case.nodes} nodes a link",
        "largest values: " + ", ".join(f"{x:.4g}" for x in peak),
        "their errors by the step: " + ", ".join(f"{x:.1e}" for x in by_step / peak),
        "their errors by the mesh: " + ", ".join(f"{x:.1e}" for x in by_mesh / peak),
    ]
    FOLDER.mkdir(exist_ok=True)
    head = "\n".join(f"# {line}" for line in lines) + "\n" + ",".join(("t [s]", *case.columns))
    np.savetxt(FOLDER / f"{name}.csv", np.column_stack([t, values]), "%.7g", ",", header=head, comments="")
    sys.stdout.write(name + "\n" + "\n".join(lines[1:]) + "\n")


if __name__ == "__main__":
    for each in sys.argv[1:] or CASES:
        write(each)
