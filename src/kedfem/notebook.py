"""A progress bar in a notebook: what `analyse` and other long calls take as `watch`."""

from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from importlib import import_module
from time import perf_counter
from typing import Any

from kedfem.errors import OutputError
from kedfem.stepping import Watch

INTERVAL = 0.1  # seconds between two pictures of the bar: more would flood the page


def bar(stage: str, done: int, total: int, seconds: float) -> str:
    """The bar as HTML: a stage, and how much of it is done if that is counted."""
    counted = f'value="{done}" max="{total}"' if total else ""
    number = f"{done} of {total}" if total else ""
    return f"<progress {counted}></progress> {escape(stage)} {number} ({seconds:.0f} s)"


@contextmanager
def progress() -> Iterator[Watch]:
    """A bar below the cell that runs, as long as the context lasts.

    >>> with progress() as watch:  # doctest: +SKIP
    ...     run = analyse(scene, watch)

    Raises
    ------
    OutputError
        Where there is no IPython, which every notebook has.
    """
    try:
        page: Any = import_module("IPython.display")
    except ImportError:
        raise OutputError("progress: needs a notebook, got no IPython; pip install jupyterlab") from None
    began, shown, last = perf_counter(), -1.0, ("", -1)
    handle = page.display(page.HTML(bar("begins", 0, 0, 0)), display_id=True)

    def watch(stage: str, done: int, total: int) -> None:
        nonlocal shown, last
        now = perf_counter() - began
        if stage != last[0] or now - shown > INTERVAL or (total and done == total != last[1]):
            handle.update(page.HTML(bar(stage, done, total, now)))
            shown, last = now, (stage, done)

    end = "stopped"
    try:
        yield watch
        end = "done"
    finally:
        handle.update(page.HTML(f"{end} after {perf_counter() - began:.1f} s"))
