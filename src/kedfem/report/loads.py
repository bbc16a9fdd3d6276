"""Loads of joints and drives as tables."""

from collections.abc import Mapping

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.loads import Loads
from kedfem.output.words import NOTHING, with_prefix

SHORT = {
    "drive at peak": "at", "largest bearing load": "radial", "largest axial": "axial", "equivalent, ball bearing": "ball",
    "equivalent, roller bearing": "roller", "drive at largest": "at", "largest power": "peak power",
}  # fmt: skip


def loads_tables(found: Loads) -> list[Table]:
    """Peak, mean and equivalent loads of joints; torque and power of drives."""
    joints = _table("Loads of joints", "joint", found.joints)
    joints.caption = "radial, axial: largest; ball, roller: equivalent load for the life of such a bearing"
    return [joints, _table("Drives", "drive", found.drives)] if found.drives else [joints]


def _table(title: str, what: str, every: Mapping[str, Mapping[str, float]]) -> Table:
    table = Table(title=Text(title))
    table.add_column(what, overflow="fold")
    names = list(dict.fromkeys(name for row in every.values() for name in row))
    if any(name.startswith("drive at") for name in names):
        names = [name for name in names if not name.startswith("time of")]
    for name in names:
        label = name.rpartition(" [")[0]
        table.add_column(SHORT.get(label, label), justify="right", overflow="fold")
    for key, row in every.items():
        table.add_row(key, *(_number(row, name) for name in names))
    return table


def _number(row: Mapping[str, float], name: str) -> str:
    x, unit = row.get(name, np.nan), name.rpartition(" [")[2]
    largest = max((abs(value) for other, value in row.items() if other.endswith(unit)), default=0.0)
    return "≈ 0" if abs(x) < NOTHING * largest else with_prefix(x, unit.removesuffix("]"))
