"""Output of the commands: the two streams, tables, warnings, progress bars."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic
from typing import Any

import typer

from kedfem.cli.options import INTERRUPTED
from kedfem.processes import imported
from kedfem.terminal import terminal

out, err = terminal(), terminal(stderr=True)
QUIET, EVERY = 2.0, 10.0  # s: stages that take less have no line of progress; from one line to the next
COMPILING = "compiling, once for this version of kedfem"


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


def say_there(text: str) -> None:
    """One line of progress for the stream of errors."""
    err.print(text, markup=False, soft_wrap=True)


@contextmanager
def interruptible(kept: Callable[[], str]) -> Iterator[None]:
    """Ctrl-C ends a command with its own status, and with what is kept of its work."""
    try:
        yield
    except KeyboardInterrupt:
        warn(f"interrupted; {kept()}")
        raise typer.Exit(INTERRUPTED) from None


class progress:  # noqa: N801
    """Progress as a context: bars on a terminal, plain lines in a pipe or file."""

    def __enter__(self) -> Callable[[str, int, int], None]:
        from kedfem.compiled import compiling

        imported()
        self._shown = _Bars() if err.is_terminal else _Lines()
        self._compiling = compiling(self._shown.compiles)
        self._compiling.__enter__()
        return self._shown.watch

    def __exit__(self, kind: object, *_: object) -> None:
        self._shown.stop(kind is None)
        self._compiling.__exit__(None, None, None)


class _Bars:
    """Stages spin, counted work shows a bar."""

    def __init__(self) -> None:
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            SpinnerColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
        times = TimeElapsedColumn(), TimeRemainingColumn()
        self._bars = Progress(*columns, *times, console=err, transient=True)
        self._bars.start()
        self._stage, self._task, self._once = "", None, None

    def stop(self, whole: bool) -> None:
        del whole
        self._bars.stop()

    def compiles(self, begins: bool) -> None:
        if begins:
            self._once = self._bars.add_task(COMPILING, total=None)
        elif self._once is not None:
            self._bars.remove_task(self._once)

    def watch(self, stage: str, done: int, total: int) -> None:
        if stage != self._stage:
            if self._task is not None:
                self._bars.remove_task(self._task)
            self._stage, self._task = stage, self._bars.add_task(stage, total=total or None)
        if total and self._task is not None:
            self._bars.update(self._task, completed=done, total=total)

    _task: Any
    _once: Any


class _Lines:
    """A line once a stage has taken some seconds, then from time to time, and when it has ended; none of short ones."""

    def __init__(self) -> None:
        self._stage, self._done, self._total, self._begun, self._due = "", 0, 0, 0.0, QUIET
        self._lock, self._over, self._compiled = Lock(), Event(), False
        Thread(target=self._often, daemon=True).start()

    def stop(self, whole: bool) -> None:
        self._over.set()
        with self._lock:
            if whole:
                self._end()

    def compiles(self, begins: bool) -> None:
        if begins and not self._compiled:
            self._compiled = True
            say_there(COMPILING)

    def watch(self, stage: str, done: int, total: int) -> None:
        with self._lock:
            if stage != self._stage:
                self._end()
                self._stage, self._begun, self._due = stage, monotonic(), QUIET
            self._done, self._total = done, total
        self._tell()

    def _often(self) -> None:
        """Where compiled code lets other threads go on; else lines come when it calls back."""
        while not self._over.wait(1.0):
            self._tell()

    def _tell(self) -> None:
        with self._lock:
            lasted = monotonic() - self._begun
            if self._stage and lasted >= self._due:
                count = f" {self._done:,} of {self._total:,}" if self._total else ""
                say_there(f"{self._stage}:{count} after {lasted:.0f} s")
                self._due = lasted + EVERY

    def _end(self) -> None:
        if self._stage and self._due > QUIET:
            say_there(f"{self._stage}: done after {monotonic() - self._begun:.0f} s")


@contextmanager
def stages() -> Iterator[Callable[[str], None]]:
    """Shows names of stages while they take their time."""
    with progress() as watch:
        yield lambda name: watch(name, 0, 0)
