"""Layout of tables in the terminal: words to the left, numbers to the right, none cut off in a narrow one."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.table import Column, Table
from rich.text import Text

READ, LEAST = 100, 44  # characters of a readable line; least width of the last column


def left(*names: str, **look: Any) -> list[Column]:
    """Columns of words."""
    return [Column(name, overflow="fold", **look) for name in names]


def right(*names: str, **look: Any) -> list[Column]:
    """Columns of numbers."""
    return left(*names, justify="right", **look)


def facts(title: str | Text, rows: Iterable[Sequence[str | Text]] = (), **look: Any) -> Table:
    """A table of names and values without a heading; long texts are wrapped, in pipes and files too."""
    every = [tuple(row) for row in rows]
    columns = max(map(len, every), default=0)
    before = [max(len(row[k]) for row in every) for k in range(columns - 1)]
    most = max(LEAST, READ - sum(before) - 3 * columns - 1)  # less lines and spaces between columns and at both ends
    last = [Column(overflow="fold", max_width=most)] if every else []
    return listed(title, [*left(*([""] * len(before))), *last], every, show_header=False, **look)


def listed(title: str | Text, columns: Iterable[Column], rows: Iterable[Sequence[str | Text]] = (), **look: Any) -> Table:
    """A table of rows under columns."""
    table = Table(*columns, title=title, **look)
    for row in rows:
        table.add_row(*row)
    return table
