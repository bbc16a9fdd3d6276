"""Sparse direct solvers from Python wheels on the effective matrix of one link: why CHOLMOD."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg

from benchmarks.pages import script, seconds, table, write_page
from benchmarks.scenes import bar_four_bar
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.matrices.substructure import effective_matrix
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.links.build import bare_links

SIZES = ((18, 3, 2), (36, 6, 4), (48, 9, 7))


def bench_solvers(folder: Path, quick: bool) -> None:
    """Factor and solve times of the solvers that are installed."""
    rows = []
    sizes = SIZES[:1] if quick else SIZES
    for size in sizes:
        link = bare_links(bar_four_bar(size))["coupler"]
        A = effective_matrix(link, generalised_alpha(1e-4, 1.0).a0, 1.0)
        b = np.random.default_rng(1).standard_normal(A.shape[0])
        for name, factored in _solvers().items():
            rows.append((f"{A.shape[0]:,}", name, *_measured(factored, A, b)))
    header = ("unknowns", "solver", "factor [s]", "one solve [ms]", "residual")
    write_page(folder, "performance/solvers", [table(header, rows)])


Factored = Callable[[sp.csr_array], Callable[[np.ndarray], np.ndarray]]


def _measured(factored: Factored, A: sp.csr_array, b: np.ndarray) -> tuple[str, str, str]:
    """Seconds to factor, milliseconds to solve, residual."""
    kept: dict[str, Any] = {}
    factor = seconds(lambda: kept.update(solve=factored(A)), 1)
    solve = seconds(lambda: kept["solve"](b), 5)
    residual = float(np.abs(A @ kept["solve"](b) - b).max())
    return f"{factor:.2f}", f"{1e3 * solve:.1f}", f"{residual:.0e}"


def _solvers() -> dict[str, Factored]:
    out: dict[str, Factored] = {"CHOLMOD (cvxopt)": lambda A: Cholesky(A, "bench").solve, "SuperLU (SciPy)": _superlu}
    try:
        import pypardiso  # noqa: F401
    except ImportError:
        return out
    return out | {"PARDISO (pypardiso)": _pardiso}


def _superlu(A: sp.csr_array) -> Callable[[np.ndarray], np.ndarray]:
    options = {"SymmetricMode": True}
    lu = scipy.sparse.linalg.splu(sp.csc_array(A), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return lu.solve  # type: ignore[no-any-return]


def _pardiso(A: sp.csr_array) -> Callable[[np.ndarray], np.ndarray]:
    from pypardiso import PyPardisoSolver

    solver = PyPardisoSolver(mtype=2)
    upper = sp.csr_matrix(sp.triu(A))
    solver.factorize(upper)

    def solve(b: np.ndarray) -> np.ndarray:
        solver.set_phase(33)
        return np.asarray(solver._call_pardiso(upper, b)).ravel()

    return solve


if __name__ == "__main__":
    script(bench_solvers)
