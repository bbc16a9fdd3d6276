"""Orders of elimination of a plate's and a thick block's matrix; two factors in two threads; columns solved together."""

import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, matrix, spmatrix

from benchmarks.memory import memory_held, most_memory
from benchmarks.pages import apart, script, table, write_page
from kedfem.dynamics.matrices import dissection
from kedfem.dynamics.matrices.cholesky import Cholesky, laid_out

BODIES = {  # elements; width and thickness of a body 1 m long
    "plate": (((40, 8, 2), (64, 14, 2)), 0.22, 0.02),
    "block": (((14, 7, 7), (20, 10, 10), (25, 13, 13)), 0.5, 0.5),
}
LARGE = ((72, 17, 17), (0.236, 0.236))  # elements and section of a thick bar that minimum degree alone cannot hold
NEEDS = {
    "CHOLMOD, minimum degree (AMD)": "cvxopt",
    "CHOLMOD, dissected by coordinates": "cvxopt",
    "CHOLMOD, METIS (pymetis)": "pymetis",
    "PARDISO, METIS (pypardiso)": "pypardiso",
}
NOW = "CHOLMOD, minimum degree (AMD)"
COLUMNS, PAIRS, SOLVES = 12, 3, 5


def bench_orderings(folder: Path, quick: bool) -> None:
    """Fill, times and memory of each order and library that is installed; threads; columns."""
    rows, pairs = [], []
    with tempfile.TemporaryDirectory() as kept:
        for body, (sizes, width, thickness) in BODIES.items():
            for size in sizes[:1] if quick else sizes:
                _write_body(Path(kept), size, (width, thickness))
                found = {name: apart("benchmarks.orderings", "one_solver", [kept, name]) for name in NEEDS
                         if find_spec(NEEDS[name])}  # fmt: skip
                rows += [_row(body, name, each, found[NOW]) for name, each in found.items()]
                if size == sizes[0]:
                    pairs.append(_pair_row(body, Path(kept)))
        _write_body(Path(kept), (20, 5, 5) if quick else LARGE[0], LARGE[1])
        large = apart("benchmarks.orderings", "one_large", kept)
    for name, library in NEEDS.items():
        if not find_spec(library):
            print(f"{name}: skipped, {library} is not installed")
    header = ("body", "unknowns", "order", "numbers of L [10⁶]", "order and analysis [s]", "factor [s]", "solve [ms]",
              "memory [GB]", "residual", "less fill", "faster factor", "with its order", "faster solve")  # fmt: skip
    others = ("body", "unknowns", "two factors: one after the other / in two threads",
              f"{COLUMNS} columns: one by one / `solve_many`")  # fmt: skip
    thick = ("unknowns", "factor by minimum degree [GB]", "factor now [GB]", "order, analysis and factor [s]",
             "solve [s]", "most memory [GB]")  # fmt: skip
    least, now, memory = (f"{large[key] / 1e9:.1f}" for key in ("by_degree", "now", "memory"))
    row = (f"{large['unknowns']:,}", least, now, f"{large['factor']:.0f}", f"{large['solve']:.1f}", memory)
    write_page(folder, "performance/orderings", [table(header, rows), table(thick, [row]), table(others, pairs)])


def _row(body: str, name: str, each: dict[str, float], now: dict[str, float]) -> tuple[str, ...]:
    whole, whole_now = (x["analysis"] + x["factor"] for x in (each, now))
    ratios = (now["fill"] / each["fill"], now["factor"] / each["factor"], whole_now / whole, now["solve"] / each["solve"])
    return (
        body, f"{each['unknowns']:,}", name, f"{each['fill'] / 1e6:.1f}", f"{each['analysis']:.2f}",
        f"{each['factor']:.2f}", f"{1e3 * each['solve']:.0f}", f"{each['memory'] / 1e9:.2f}", f"{each['residual']:.0e}",
        *(f"{ratio:.2f}" for ratio in ratios),
    )  # fmt: skip


def _write_body(folder: Path, size: tuple[int, int, int], section: tuple[float, float]) -> None:
    """The effective matrix of a body and its nodes, for processes that measure."""
    from kedfem.dynamics.matrices.substructure import effective_matrix
    from kedfem.dynamics.stepping.scheme import generalised_alpha
    from kedfem.links.build import link_axes
    from kedfem.links.solid import solid_link
    from kedfem.mesh import link_mesh
    from kedfem.scene import Bar, LinkScene, Material, Meshing

    shape = Bar(between=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), width=section[0], thickness=section[1])
    scene = LinkScene(material="steel", shape=shape, mesh=Meshing(elements=size), element="hex27")
    material = Material(density=7850.0, youngs_modulus=2.1e11, poisson_ratio=0.3)
    link = solid_link("body", link_mesh("body", scene, Path()), material, link_axes(scene))
    A = effective_matrix(link, generalised_alpha(1e-4, 1.0).a0, 1.0)
    sp.save_npz(folder / "A.npz", sp.csr_matrix(A), compressed=False)
    np.save(folder / "X.npy", link.X)


def _read_body(folder: Path) -> tuple[sp.csr_array, np.ndarray]:
    return sp.csr_array(sp.load_npz(folder / "A.npz")), np.load(folder / "X.npy")


def one_solver(given: list[str]) -> dict[str, float]:
    """Measure one library and order: processor times, numbers of L, memory above that of the matrix, residual."""
    A, X = _read_body(Path(given[0]))
    of = {"CHOLMOD": _cholmod, "PARDISO": _pardiso}[given[1].split(",")[0]]
    held = memory_held()
    analysis, factor, fill, solve = of(A, X, given[1])
    b = np.random.default_rng(1).standard_normal(A.shape[0])
    spent, x = [], b
    for _ in range(SOLVES):
        since = process_time()
        x = solve(b)
        spent.append(process_time() - since)
    memory, residual = most_memory() - held, float(np.abs(A @ x - b).max() / np.abs(b).max())
    return {"unknowns": len(b), "analysis": analysis, "factor": factor, "fill": fill, "solve": min(spent),
            "memory": memory, "residual": residual}  # fmt: skip


def one_large(kept: str) -> dict[str, float]:
    """Measure what kedfem does of a thick bar: bytes of the factor by minimum degree and now, processor times, memory."""
    A, X = _read_body(Path(kept))
    since = process_time()
    made = Cholesky(A, "bar", X)
    factored = process_time()
    made.solve(np.ones(A.shape[0]))
    solved, memory = process_time(), most_memory()
    now, made = laid_out(made.factor, A.shape[0]), None  # type: ignore[assignment]
    cholmod.options["supernodal"] = 2
    by_degree = laid_out(cholmod.symbolic(_columnwise(A)), A.shape[0])
    return {"unknowns": A.shape[0], "by_degree": by_degree, "now": now, "factor": factored - since,
            "solve": solved - factored, "memory": memory}  # fmt: skip


Solver = tuple[float, float, float, Callable[[np.ndarray], np.ndarray]]


def _cholmod(A: sp.csr_array, X: np.ndarray, name: str) -> Solver:
    dissection.THICK = 0.0
    cholmod.options |= {"supernodal": 2, "nmethods": int(name != NOW)}  # 1: the given order alone
    columnwise = _columnwise(A)
    since = process_time()
    order = None if name == NOW else dissection.dissected(A, X) if "coordinates" in name else _metis(A, len(X))
    factor = cholmod.symbolic(columnwise, **({} if order is None else {"p": matrix(order.astype(np.int64))}))
    analysed = process_time()
    cholmod.numeric(columnwise, factor)
    done = process_time()

    def solve(b: np.ndarray) -> np.ndarray:
        x = matrix(b.copy())
        cholmod.solve(factor, x)
        return np.array(x).ravel()

    return analysed - since, done - analysed, laid_out(factor, A.shape[0]) / 8, solve


def _columnwise(A: sp.csr_array) -> spmatrix:
    lower = sp.coo_array(sp.tril(A))
    return spmatrix(matrix(lower.data), *(matrix(index.astype(np.int64)) for index in lower.coords), A.shape)


def _metis(A: sp.csr_array, n: int) -> np.ndarray:
    import pymetis

    d, entries = A.shape[0] // n, sp.coo_array(A)
    rows, columns = (index // d for index in entries.coords)
    nodes = sp.csr_array((np.ones(len(rows), np.float32), (rows, columns)), shape=(n, n))
    nodes.setdiag(0)
    nodes.eliminate_zeros()
    order = np.asarray(pymetis.nested_dissection(pymetis.CSRAdjacency(nodes.indptr, nodes.indices))[0])
    return np.asarray((d * order[:, None] + np.arange(d)).ravel())


def _pardiso(A: sp.csr_array, X: np.ndarray, name: str) -> Solver:
    from pypardiso import PyPardisoSolver

    solver, upper = PyPardisoSolver(mtype=2), sp.csr_matrix(sp.triu(A))
    times = [process_time()]
    for phase in (11, 22):
        solver.set_phase(phase)
        solver._call_pardiso(upper, np.zeros(A.shape[0]))
        times.append(process_time())
    solver.set_phase(33)
    fill = float(solver.get_iparm(18))
    return times[1] - times[0], times[2] - times[1], fill, lambda b: np.asarray(solver._call_pardiso(upper, b)).ravel()


def _pair_row(body: str, folder: Path) -> tuple[str, ...]:
    """Best of pairs, elapsed time of two factors; processor time of columns."""
    A, X = _read_body(folder)
    B = np.random.default_rng(1).standard_normal((A.shape[0], COLUMNS))
    alone, beside, single, many = (list[float]() for _ in range(4))
    made: Any = Cholesky(A, body, X)
    for _ in range(PAIRS):
        alone.append(_spent(perf_counter, lambda: [Cholesky(A, body, X) for _ in range(2)]))
        with ThreadPoolExecutor(2) as pool:
            beside.append(_spent(perf_counter, lambda: list(pool.map(lambda _: Cholesky(A, body, X), range(2)))))
        single.append(_spent(process_time, lambda: [made.solve(b) for b in B.T]))
        many.append(_spent(process_time, lambda: made.solve_many(B)))
    return body, f"{len(B):,}", f"{min(alone) / min(beside):.2f}", f"{min(single) / min(many):.2f}"


def _spent(clock: Callable[[], float], work: Callable[[], object]) -> float:
    since = clock()
    work()
    return clock() - since


if __name__ == "__main__":
    script(bench_orderings)
