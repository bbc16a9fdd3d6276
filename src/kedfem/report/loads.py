"""Loads of joints and drives as tables."""

from collections.abc import Mapping

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.loads import Loads
from kedfem.output.words import with_prefix


def loads_tables(found: Loads) -> list[Table]:
    """Peak, mean and equivalent loads of joints; torque and power of drives."""
    out = [
        _table("Loads of joints; equivalent: mean by the power of the bearing's life", "joint", found.joints)
    ]
    return [*out, _table("Drives", "drive", found.drives)] if found.drives else out


def _table(title: str, what: str, every: Mapping[str, Mapping[str, float]]) -> Table:
    table = Table(title=Text(title))
    table.add_column(what)
    names = list(dict.fromkeys(name for row in every.values() for name in row))
    for name in names:
        table.add_column(name.rpartition(" [")[0], justify="right")
    for key, row in every.items():
        table.add_row(key, *(_number(row.get(name, np.nan), name) for name in names))
    return table


def _number(x: float, name: str) -> str:
    return with_prefix(x, name.rpartition(" [")[2].removesuffix("]"))
