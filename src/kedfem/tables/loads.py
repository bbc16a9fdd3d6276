"""Loads of joints and drives, and load cases of links, as tables."""

from collections.abc import Mapping

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.load_cases import LoadCases
from kedfem.loads import Loads
from kedfem.output.words import NOTHING, number_in, with_prefix

SHORT = {
    "drive at peak": "at", "largest bearing load": "radial", "largest axial": "axial", "equivalent, ball bearing": "ball",
    "equivalent, roller bearing": "roller", "drive at largest": "at", "largest power": "peak power",
}  # fmt: skip


def loads_tables(found: Loads) -> list[Table]:
    """Peak, mean and equivalent loads of joints; torque and power of drives."""
    joints = _table("Loads of joints", "joint", found.joints)
    joints.caption = "radial, axial: largest; ball, roller: equivalent load for the life of such a bearing"
    return [joints, _table("Drives", "drive", found.drives)] if found.drives else [joints]


def case_tables(found: LoadCases) -> list[Table]:
    """Of each instant the resultant of each kind of force, in the link's axes; the highest stress, the residual."""
    table, short = (
        Table(title=Text(f"Load cases of {found.link}, in its axes in the reference position")),
        Table(),
    )
    for name in ("time", "what", "x", "y", "z"):
        table.add_column(name, justify="left" if name == "what" else "right", overflow="fold")
    for name in (
        "time",
        "highest von Mises stress",
        "by statics",
        "off at most",
        "supports bear, of the largest force",
    ):
        short.add_column(name, justify="right")
    for case, left in zip(found.cases, found.left, strict=True):
        every = {name: forces.sum(axis=0) for name, forces in case.parts.items()}
        largest = max(float(np.abs(x).max()) for x in every.values())
        time = with_prefix(case.time, "s")
        stresses = (with_prefix(float(x.max()), "Pa") for x in (case.von_mises, case.static_von_mises))
        for k, (name, force) in enumerate(every.items()):
            words = ("≈ 0" if abs(x) < NOTHING * largest else with_prefix(float(x), "N") for x in force)
            table.add_row(time if k == 0 else "", name, *words)
        table.add_section()
        short.add_row(time, *stresses, f"{100 * case.differs:.1g} %", f"{100 * left:.1g} %")
    return [table, short]


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
        table.add_row(key, *(number_in(row, name) for name in names))
    return table
