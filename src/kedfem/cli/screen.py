"""What the commands print on: the two streams, tables, warnings, progress bars."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from kedfem.cli.options import INTERRUPTED
from kedfem.terminal import terminal

out, err = terminal(), terminal(stderr=True)


def show(tables: Iterable[Any], warnings: Iterable[str] = ()) -> None:
    """Tables that have rows, and warnings after them."""
    for table in tables:
        if table.row_count:
            out.print(table)
    for warning in warnings:
        warn(f"warning: {warning}", soft_wrap=False)


def say(*words: object) -> None:
    """One line, however long: mostly a file and what it is."""
    out.print("  ".join(str(each) for each in words if each), markup=False, soft_wrap=True)


def say_written(folder: Path, files: Mapping[str, str]) -> None:
    """Those files of a folder that are there, with what they are."""
    for name, what in files.items():
        if (folder / name).exists():
            say(folder / name, what)


def warn(text: str, style: str = "yellow", soft_wrap: bool = True) -> None:
    """One line for the stream of errors."""
    err.print(text, style=style, markup=False, soft_wrap=soft_wrap)


@contextmanager
def interruptible(kept: Callable[[], str]) -> Iterator[None]:
    """Ctrl-C ends a command with its own status, and with what is kept of its work."""
    try:
        yield
    except KeyboardInterrupt:
        warn(f"interrupted; {kept()}")
        raise typer.Exit(INTERRUPTED) from None


class progress:  # noqa: N801
    """Progress bars as a context: stages spin, counted work shows a bar."""

    def __enter__(self) -> Callable[[str, int, int], None]:
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            SpinnerColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        from kedfem.compiled import compiling

        columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
        self._bars = Progress(
            *columns, TimeElapsedColumn(), TimeRemainingColumn(), console=err, transient=True
        )
        self._compiling = compiling(self._compiles)
        self._compiling.__enter__()
        self._bars.start()
        self._stage, self._task = "", None
        return self._watch

    def __exit__(self, *_: object) -> None:
        self._bars.stop()
        self._compiling.__exit__(None, None, None)

    def _compiles(self, begins: bool) -> None:
        if begins:
            self._once = self._bars.add_task("compiling, once for this version of kedfem", total=None)
        else:
            self._bars.remove_task(self._once)

    def _watch(self, stage: str, done: int, total: int) -> None:
        if stage != self._stage:
            if self._task is not None:
                self._bars.remove_task(self._task)
            self._stage, self._task = stage, self._bars.add_task(stage, total=total or None)
        if total and self._task is not None:
            self._bars.update(self._task, completed=done, total=total)

    _stage: str
    _task: Any
    _once: Any


@contextmanager
def stages() -> Iterator[Callable[[str], None]]:
    """Shows names of stages while they take their time."""
    with progress() as watch:
        yield lambda name: watch(name, 0, 0)
