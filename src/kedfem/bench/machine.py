"""What all benchmarks share: the machine's name, medians, tables, pictures."""

import os
import platform
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from time import perf_counter

from kedfem import __version__

Watch = Callable[[str, int, int], None]


def machine() -> str:
    """The machine and the threads allowed, in words."""
    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = (
            line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line
        )
        name = next(lines, name)
    threads = os.environ.get("OMP_NUM_THREADS", "not set")
    software = f"Python {platform.python_version()}, kedfem {__version__}"
    return f"{name}, {os.cpu_count()} cores, OMP_NUM_THREADS {threads}, {software}"


def seconds(work: Callable[[], object], repeats: int) -> float:
    """Median time of a piece of work [s]."""
    times = []
    for _ in range(repeats):
        since = perf_counter()
        work()
        times.append(perf_counter() - since)
    return median(times)


def markdown(
    title: str, command: str, header: Sequence[str], rows: Sequence[Sequence[str]], after: str = ""
) -> str:
    """A results page: machine, command that regenerates it, table."""
    lines = [f"# {title}", "", f"Regenerate with `{command}`. Measured on: {machine()}.", ""]
    lines += table(header, rows)
    return "\n".join([*lines, "", after, ""]) if after else "\n".join([*lines, ""])


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table in Markdown."""
    first, *others = (f"| {' | '.join(row)} |" for row in (header, *rows))
    return [first, "|" + "---|" * len(header), *others]


def write_page(folder: Path, name: str, text: str) -> None:
    """Write a results page into the benchmark folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text, encoding="utf-8")


def write_loglog(folder: Path, name: str, curves: Mapping[str, tuple[Sequence[float], Sequence[float]]],
                 labels: tuple[str, str]) -> None:  # fmt: skip
    """A log-log plot of several curves as PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for (label, (x, y)), marker in zip(curves.items(), "osd^vx*" * 2, strict=False):
        axes.loglog(x, y, marker=marker, label=label)
    sizes = sorted({value for x, _ in curves.values() for value in x})
    axes.set_xticks(sizes, [f"{size:,.0f}" for size in sizes])
    axes.set_xticks([], minor=True)
    axes.set_xlabel(labels[0])
    axes.set_ylabel(labels[1])
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend()
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / f"{name}.png", dpi=130)
