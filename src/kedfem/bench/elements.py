"""Hexahedra of 27, 20 and 8 nodes, tetrahedra of 10: error against work, on parts that bend and on bad meshes."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from kedfem.bench.machine import Watch, markdown, write_page
from kedfem.bench.parts import FORMS, PARTS, Answer, BenchPart, Size, answer

TARGETS = {"1 %": 1e-2, "0.1 %": 1e-3}
QUANTITIES = ("deflection", "frequencies", "stress")
REPEATS = 3
MARKS = dict(zip(FORMS, "osd^", strict=True))

Found = dict[str, list[tuple[Size, Answer, dict[str, float]]]]


def bench_elements(folder: Path, quick: bool, watch: Watch) -> str:
    """Errors and times of all meshes of all parts, what each error costs, and what follows; table and plot."""
    found: dict[str, Found] = {}
    exact: dict[str, Answer] = {}  # by shape: that of the straight bar serves its distorted meshes too
    for number, part in enumerate(PARTS):
        watch("elements", number, len(PARTS))
        if str(part.shape) not in exact:
            finest = part.sizes["hex27"][-1] if quick else part.reference
            exact[str(part.shape)] = answer(part, "hex27", finest, 1)
        found[part.name] = _measured(part, exact[str(part.shape)], quick)
    header = (
        "part",
        "element",
        "mesh",
        "unknowns",
        "factor [ms]",
        "solve [ms]",
        *(f"{q} [%]" for q in QUANTITIES),
    )
    text = markdown(
        "Elements: error against work", "kedfem bench elements", header, _rows(found), _after(found)
    )
    write_page(folder, "elements", text)
    _write_plot(folder, found)
    return text


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
    return float(
        np.exp(np.interp(-np.log(target), -np.log(least[k - 1 : k + 1]), np.log(work[k - 1 : k + 1])))
    )


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
                ms = {
                    e: cost([of(a) for _, a, _ in m], [x[q] for *_, x in m], target)
                    for e, m in elements.items()
                }
                out[part, name, q] = {e: c for e, c in ms.items() if c is not None}
    return out


def _after(found: dict[str, Found]) -> str:
    """The second table and the words that follow from it."""
    costs = _costs(found)
    works = {name: _costs(found, of) for name, of in WORKS.items()}
    lines = [
        "A mesh is named by its elements along, across and through a bar, or across and through a plate. The load",
        "is a force spread over one end or bore, balanced by the other's mean reactions; the frequencies are the",
        "first three of the free part, the stress is the equivalent one at mid-span, behind the bore or in the fillet.",
        "Errors are relative to a finer mesh of hex27. Factor and solve are those of a step's constant matrix. In the",
        "distorted mesh corners lie up to a quarter of an element's side away from their place: in such elements",
        "hex20 holds linear fields only, hex27 quadratic ones too. Tetrahedra are six in each hexahedron, on the nodes",
        "of hex27.",
        "", "![elements](elements.png)", "",
        "## What an error costs", "",
        "Unknowns / milliseconds to factor / milliseconds of a solve from which the error stays below the target,",
        "between meshes interpolated; — where no mesh here reaches it. The cheapest is that of a solve.", "",
        f"| part | error | of | {' | '.join(FORMS)} | cheapest |", "|---|---|---|" + "---:|" * len(FORMS) + "---|",
    ]  # fmt: skip
    for (part, target, q), ms in costs.items():
        shown = [
            " / ".join(_short(w[part, target, q][e]) for w in works.values()) if e in ms else "—"
            for e in FORMS
        ]
        lines.append(f"| {part} | {target} | {q} | {' | '.join(shown)} | {_cheapest(ms)} |")
    return "\n".join([*lines, "", "## Which element", "", *_words(costs)])


def _short(number: float) -> str:
    """Two digits, or a whole number."""
    return f"{number:.2g}" if number < 100 else f"{number:,.0f}"


def _cheapest(ms: dict[str, float]) -> str:
    """The elements within a tenth of the least time, which is what the clock can tell."""
    return ", ".join(e for e in ms if ms[e] <= 1.1 * min(ms.values())) or "—"


def _words(costs: dict[tuple[str, str, str], dict[str, float]]) -> list[str]:
    """A sentence for each part and target, then the default that follows."""
    lines = []
    for part in dict.fromkeys(key[0] for key in costs):
        said = [f"for {t} {_both(costs, part, t)}" for t in TARGETS]
        lines.append(f"* **{part[0].upper() + part[1:]}**: {'; '.join(said)}.")
    tets = [(ms["tet10"], ms["hex20"]) for ms in costs.values() if {"tet10", "hex20"} <= set(ms)]
    dearer = float(np.exp(np.mean([np.log(a / b) for a, b in tets]))) if tets else float("nan")
    pairs = [(ms["hex20"], ms["hex27"]) for ms in costs.values() if {"hex20", "hex27"} <= set(ms)]
    ratio = float(np.exp(np.mean([np.log(a / b) for a, b in pairs])))
    missed = {e: sum(e not in ms and bool(ms) for ms in costs.values()) for e in FORMS}
    default = "hex20" if ratio < 1 and missed["hex20"] <= missed["hex27"] else "hex27"
    misses = ", ".join(f"{e} {count}" for e, count in missed.items())
    return [
        *lines, "",
        f"Where both reach a target, a solve with hex20 takes {ratio:.2f} of the time of one with hex27 (geometric",
        f"mean of {len(pairs)} rows). Targets missed that another element reaches: {misses} of {len(costs)}.",
        f"A solve with tet10 takes {dearer:.2g} times that of one with hex20 ({len(tets)} rows): hexahedra where a part",
        "can be swept, tetrahedra where not.",
        f"By these figures the default should be **{default}**.",
    ]  # fmt: skip


def _both(costs: dict[tuple[str, str, str], dict[str, float]], part: str, target: str) -> str:
    """The cheapest element of each quantity in words."""
    cheapest = {
        q: _cheapest(costs[part, target, q]).replace(", ", " or ").replace("—", "none") for q in QUANTITIES
    }
    if len(set(cheapest.values())) == 1:
        return cheapest[QUANTITIES[0]]
    return ", ".join(f"{element} ({q})" for q, element in cheapest.items())


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
