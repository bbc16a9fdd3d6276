"""Tables and facts of a report."""

from dataclasses import dataclass

Rows = list[tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the page.

    title, head : what it shows; names of its columns, empty of a table of names and values
    rows : texts; the first of each is a name
    note : below it
    """

    title: str
    head: tuple[str, ...]
    rows: Rows
    note: str = ""


@dataclass(frozen=True, slots=True)
class Fact:
    """A number of the first look: its name, the number in words, more about it."""

    name: str
    value: str
    more: str = ""
