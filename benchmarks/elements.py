"""Hexahedra of 27, 20 and 8 nodes, tetrahedra of 10: error against work, on parts that bend and on bad meshes."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.pages import script, table, write_page
from benchmarks.parts import FORMS, PARTS, Answer, BenchPart, Size, answer

TARGETS = {"1 %": 1e-2, "0.1 %": 1e-3}
QUANTITIES = ("deflection", "frequencies", "stress")
REPEATS = 3
MARKS = dict(zip(FORMS, "osd^", strict=True))

Found = dict[str, list[tuple[Size, Answer, dict[str, float]]]]


def bench_elements(folder: Path, quick: bool) -> None:
    """Errors and times of all meshes of all parts, what each error costs, and what follows; table and plot."""
    found: dict[str, Found] = {}
    exact: dict[str, Answer] = {}  # by shape: that of the straight bar serves its distorted meshes too
    for part in PARTS:
        if str(part.shape) not in exact:
            finest = part.sizes["hex27"][-1] if quick else part.reference
            exact[str(part.shape)] = answer(part, "hex27", finest, 1)
        found[part.name] = _measured(part, exact[str(part.shape)], quick)
    header = ("part", "element", "mesh", "unknowns", "factor [ms]", "solve [ms]", *(f"{q} [%]" for q in QUANTITIES))
    write_page(folder, "performance/elements", [table(header, _rows(found)), *_after(found)])
    _write_plot(folder, found)


def _measured(part: BenchPart, exact: Answer, quick: bool) -> Found:
    """Every mesh of a part, the coarse ones alone if it has to be quick; errors against the reference."""
    out: Found = {}
    for element in FORMS:
        if element not in part.sizes:
            continue
        sizes = part.sizes[element][:2] if quick else part.sizes[element]
        answers = [answer(part, element, size, REPEATS) for size in sizes]
        out[element] = [(s, a, a.errors(exact)) for s, a in zip(sizes, answers, strict=True)]
    return out


def _rows(found: dict[str, Found]) -> list[tuple[str, ...]]:
    return [
        (part, element, "×".join(map(str, size)), f"{a.unknowns:,}", f"{1e3 * a.factor:.2g}", f"{1e3 * a.solve:.2g}",
         *(f"{100 * errors[q]:.2g}" for q in QUANTITIES))
        for part, elements in found.items() for element, meshes in elements.items() for size, a, errors in meshes
    ]  # fmt: skip


def cost(work: Sequence[float], errors: Sequence[float], target: float) -> float | None:
    """Work from which the error stays below a target, by straight lines between meshes in logarithmic scales.

    Parameters
    ----------
    work, errors : of meshes from coarse to fine; errors that fall by chance and rise again do not count

    Returns
    -------
    The work, that of the coarsest mesh at least; None if the finest misses the target.

    >>> round(cost([1.0, 10.0, 100.0], [1e-1, 1e-4, 1e-3], 1e-2), 2)
    3.16
    """
    least = np.maximum.accumulate(np.asarray(errors, dtype=float)[::-1])[::-1]
    if least[-1] > target:
        return None
    if least[0] <= target:
        return float(work[0])
    k = int(np.argmax(least <= target))
    return float(np.exp(np.interp(-np.log(target), -np.log(least[k - 1 : k + 1]), np.log(work[k - 1 : k + 1]))))


WORKS: dict[str, Callable[[Answer], float]] = {
    "unknowns": lambda a: a.unknowns,
    "factor [ms]": lambda a: 1e3 * a.factor,
    "solve [ms]": lambda a: 1e3 * a.solve,
}


def _costs(
    found: dict[str, Found], of: Callable[[Answer], float] = WORKS["solve [ms]"]
) -> dict[tuple[str, str, str], dict[str, float]]:
    """The work that each error target costs, milliseconds of a solve: by part, target, quantity; by element."""
    out = {}
    for part, elements in found.items():
        for name, target in TARGETS.items():
            for q in QUANTITIES:
                ms = {e: cost([of(a) for _, a, _ in m], [x[q] for *_, x in m], target) for e, m in elements.items()}
                out[part, name, q] = {e: c for e, c in ms.items() if c is not None}
    return out


def _after(found: dict[str, Found]) -> tuple[list[str], list[str]]:
    """What each error costs, and the elements beside each other."""
    costs = _costs(found)
    works = {name: _costs(found, of) for name, of in WORKS.items()}
    rows = []
    for (part, target, q), ms in costs.items():
        shown = (" / ".join(_short(w[part, target, q][e]) for w in works.values()) if e in ms else "—" for e in FORMS)
        rows.append((part, target, q, *shown, _cheapest(ms)))
    return table(("part", "error", "of", *FORMS, "cheapest"), rows), _compared(costs)


def _short(number: float) -> str:
    """Two digits, or a whole number."""
    return f"{number:.2g}" if number < 100 else f"{number:,.0f}"


def _cheapest(ms: dict[str, float]) -> str:
    """The elements within a tenth of the least time, which is what the clock resolves."""
    return ", ".join(e for e in ms if ms[e] <= 1.1 * min(ms.values())) or "—"


def _compared(costs: dict[tuple[str, str, str], dict[str, float]]) -> list[str]:
    """Of each element: a solve beside one of hex20, where both reach a target; targets missed that another reaches."""
    rows = []
    for element in FORMS:
        ratios = [ms[element] / ms["hex20"] for ms in costs.values() if {element, "hex20"} <= set(ms)]
        mean = f"{float(np.exp(np.mean(np.log(ratios)))):.2f}" if ratios else "—"
        missed = sum(element not in ms and bool(ms) for ms in costs.values())
        rows.append((element, mean, str(len(ratios)), f"{missed} of {len(costs)}"))
    return table(("element", "solve / solve of hex20", "rows", "targets missed"), rows)


def _write_plot(folder: Path, found: dict[str, Found]) -> None:
    """Error against the time of a solve: a column for each part, a row for each quantity."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.2 * len(found), 8), layout="constrained")
    grid = figure.subplots(len(QUANTITIES), len(found), sharex=True, squeeze=False)
    for column, (part, elements) in zip(grid.T, found.items(), strict=True):
        column[0].set_title(part, fontsize=10)
        for axes, q in zip(column, QUANTITIES, strict=True):
            for element, meshes in elements.items():
                axes.loglog(
                    [1e3 * a.solve for _, a, _ in meshes],
                    [x[q] for *_, x in meshes],
                    f"{MARKS[element]}-",
                    color=f"C{list(MARKS).index(element)}",
                    label=element,
                )
            axes.grid(visible=True, alpha=0.3)
    for row, q in zip(grid, QUANTITIES, strict=True):
        row[0].set_ylabel(f"relative error, {q}")
    for axes in grid[-1]:
        axes.set_xlabel("one solve [ms]")
    grid[0, 0].legend()
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "elements.png", dpi=110)


if __name__ == "__main__":
    script(bench_elements)
