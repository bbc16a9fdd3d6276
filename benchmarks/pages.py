"""What all benchmarks share: medians, plots, and the tables of pages in docs whose words are written by hand."""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from statistics import median
from time import perf_counter

from kedfem.errors import SolveError
from kedfem.processes import machine

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MEASURED = "Measured on: "
MOST_TICKS = 12  # of an axis that names every size
MANY = 6  # curves: their names stand beside the plot


def script(benchmark: Callable[[Path, bool], None]) -> None:
    """The benchmark of a script, as its arguments say."""
    parser = argparse.ArgumentParser(description=benchmark.__doc__)
    parser.add_argument("--folder", type=Path, default=DOCS / "performance", help="where page and plots go")
    parser.add_argument("--quick", action="store_true", help="small sizes only, to try it")
    given = parser.parse_args()
    benchmark(given.folder, given.quick)


def seconds(work: Callable[[], object], repeats: int) -> float:
    """Median time of a piece of work [s]."""
    times = []
    for _ in range(repeats):
        since = perf_counter()
        work()
        times.append(perf_counter() - since)
    return median(times)


def apart(module: str, function: str, argument: object) -> dict[str, float]:
    """What a benchmark's function measures in a process of its own, so that its memory is that of nothing else.

    Raises
    ------
    SolveError
        It failed; with the last line of what it said.
    """
    code = f"import json; from {module} import {function}; print(json.dumps({function}({argument!r})))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}: out of memory?"]
        raise SolveError(f"{module}: {function}({argument!r}) must run, got {said[0]}")
    found: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return found


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown."""
    first, *others = (f"| {' | '.join(row)} |" for row in (header, *rows))
    return [first, "|" + "---|" * len(header), *others]


def write_page(folder: Path, name: str, tables: Sequence[list[str]]) -> None:
    """A page of docs with new tables in the places of its former ones, in their order, and this machine's name."""
    page, left = DOCS / f"{name}.md", list(tables)
    text = page.read_text(encoding="utf-8")
    lines: list[str] = []
    for tabular, block in groupby(text.splitlines(), lambda line: line.startswith("|")):
        former = list(block)
        lines += left.pop(0) if tabular and left else former
    if left:
        raise ValueError(f"{page.name}: must have {len(tables)} tables, got {len(tables) - len(left)}")
    named = [f"{a}{MEASURED}{machine()}." if b else a for a, b, _ in (line.partition(MEASURED) for line in lines)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / page.name).write_text("\n".join([*named, ""]), encoding="utf-8")


def write_loglog(folder: Path, name: str, curves: Mapping[str, tuple[Sequence[float], Sequence[float]]],
                 labels: tuple[str, str]) -> None:  # fmt: skip
    """A log-log plot of several curves as PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for (label, (x, y)), marker in zip(curves.items(), "osd^vx*" * 2, strict=False):
        axes.loglog(x, y, marker=marker, label=label)
    sizes = sorted({value for x, _ in curves.values() for value in x})
    if len(sizes) <= MOST_TICKS:
        axes.set_xticks(sizes, [f"{size:,.0f}" for size in sizes])
        axes.set_xticks([], minor=True)
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    axes.grid(visible=True, which="both", alpha=0.3)
    if len(curves) > MANY:
        axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), fontsize=7)
    else:
        axes.legend()
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{name}.png", dpi=130)
