"""How tables of the terminal look: words to the left, numbers to the right, both whole however narrow it is."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.table import Column, Table
from rich.text import Text


def left(*names: str, **look: Any) -> list[Column]:
    """Columns of words."""
    return [Column(name, overflow="fold", **look) for name in names]


def right(*names: str, **look: Any) -> list[Column]:
    """Columns of numbers."""
    return left(*names, justify="right", **look)


def facts(title: str | Text, rows: Iterable[Sequence[str | Text]] = (), **look: Any) -> Table:
    """A table without a heading: what it is, and how much."""
    return listed(title, (), rows, show_header=False, **look)


def listed(title: str | Text, columns: Iterable[Column], rows: Iterable[Sequence[str | Text]] = (), **look: Any) -> Table:
    """A table of rows under columns."""
    table = Table(*columns, title=title, **look)
    for row in rows:
        table.add_row(*row)
    return table
