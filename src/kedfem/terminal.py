"""Output on the terminal, cleaned so that names from files and scenes cannot send it commands."""

import os
import unicodedata
from collections.abc import Iterator

from rich.console import Console, ConsoleDimensions, ConsoleOptions, ConsoleRenderable, RenderHook
from rich.segment import Segment

TURNING = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Marks that turn the direction of writing."""

WIDE = 10_000  # characters in a line of a pipe or file: tables have their natural width there


def terminal(stderr: bool = False) -> Console:
    """A console that prints no control characters but those of its own colours; into pipes and files no line is broken.

    COLUMNS, where it is set, is the width of these too.
    """
    console = _Wide(stderr=stderr, highlight=False)
    console.push_render_hook(_Printable())
    return console


def printable(text: str) -> str:
    """A text without control characters, but for line ends and tabulators.

    >>> printable("a\\x1b[31mb\\u202ec")
    'a[31mbc'
    """
    return "".join(c for c in text if c in "\n\t" or (unicodedata.category(c) != "Cc" and c not in TURNING))


class _Wide(Console):
    @property  # type: ignore[misc]
    def size(self) -> ConsoleDimensions:
        size = super().size
        whole = not self.is_terminal and "COLUMNS" not in os.environ
        return ConsoleDimensions(WIDE, size.height) if whole else size


class _Printable(RenderHook):
    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        return [_Cleaned(each) for each in renderables]


class _Cleaned:
    """Something to print, its texts made printable."""

    def __init__(self, of: ConsoleRenderable) -> None:
        self.of = of

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        for segment in console.render(self.of, options):
            yield segment if segment.control else Segment(printable(segment.text), segment.style)
