"""Files of loads for suppliers: a table for each joint and drive, a summary, polar diagrams of bearing loads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.motion.released_motions import components
from kedfem.output.plots.drawing import figure_saved
from kedfem.output.words import prefixed
from kedfem.results import Results
from kedfem.results.forces.loads import DriveLoad, JointLoad, polar_axes
from kedfem.results.table import drive_heading, text_file, write_numbers, write_rows

XYZ = "xyz"
Columns = dict[str, Float[np.ndarray, " T"]]


def write_joint_load(path: Path, load: JointLoad, results: Results, rows: Bool[np.ndarray, " T"]) -> None:
    """Write a joint's load over time as CSV: in the axes of world and links, magnitude, axial and bearing load, speed."""
    first, second = load.links
    columns: Columns = {f"on {first}, world {c} [N]": load.world[:, k] for k, c in enumerate(XYZ)}
    for link, inside in zip(load.links, load.inside, strict=False):
        columns |= {f"on {link}, its axes {c} [N]": inside[:, k] for k, c in enumerate(XYZ)}
    columns["magnitude [N]"] = load.magnitude
    some = {f"axial on {first} [N]": load.axial, "bearing load [N]": load.bearing}
    some[f"speed of {first} against {second} [rad/s]"] = load.rate
    columns |= {name: x for name, x in some.items() if x is not None}
    _write(path, columns, results, rows)


def write_drive_load(path: Path, load: DriveLoad, results: Results, rows: Bool[np.ndarray, " T"]) -> None:
    """Write a drive's torque or force, rate and power over time as CSV."""
    torque = load.unit == "N m"
    columns: Columns = {f"{'torque' if torque else 'force'} [{load.unit}]": load.effort}
    if load.rate is not None and load.power is not None:
        columns |= {f"rate [{'rad/s' if torque else 'm/s'}]": load.rate, "power [W]": load.power}
    _write(path, columns, results, rows)


def _write(path: Path, columns: Columns, results: Results, rows: Bool[np.ndarray, " T"]) -> None:
    every = {"time [s]": results.time, drive_heading(results.drive): results.angle} | columns
    with text_file(path) as file:
        write_numbers(file, every, [np.column_stack([x[rows] for x in every.values()])])


def write_summary(path: Path, what: str, every: Mapping[str, Mapping[str, float]]) -> None:
    """Write a line for each joint or drive; unknown numbers are empty."""
    names = list(dict.fromkeys(name for found in every.values() for name in found))
    rows = ([key, *(found.get(name, np.nan) for name in names)] for key, found in every.items())
    write_rows(path, [what, *names], rows)


def write_polar(path: Path, load: JointLoad, rows: Bool[np.ndarray, " T"]) -> bool:
    """Write a polar diagram of a hinge's radial load on each link, in its axes; returns whether there is one."""
    if not has_polar(load):
        return False
    with figure_saved(path, polar_title(load, rows)) as figure:
        draw_polar(figure, load, rows)
    return True


def has_polar(load: JointLoad) -> bool:
    """Whether the joint is a hinge whose links' orientations are known."""
    return load.axis is not None and bool(load.inside)


def polar_title(load: JointLoad, rows: Bool[np.ndarray, " T"]) -> str:
    """Title of a polar diagram, with the unit."""
    return f"Joint {load.joint}: radial load ({_polar_unit(load, rows)[1]}) about axis {_vector(np.asarray(load.axis))}"


def _polar_unit(load: JointLoad, rows: Bool[np.ndarray, " T"]) -> tuple[float, str]:
    return prefixed(float(np.asarray(load.bearing)[rows].max()), "N")


def draw_polar(figure: Any, load: JointLoad, rows: Bool[np.ndarray, " T"]) -> None:
    """Draw the diagram of a hinge: the load on each of its links."""
    e1, e2 = polar_axes(np.asarray(load.axis))
    divisor, unit = _polar_unit(load, rows)
    sides = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
    for ax, link, force in zip(sides, load.links, load.inside, strict=True):
        a, b = force[rows] @ e1, force[rows] @ e2
        angle, size = np.arctan2(b, a), np.hypot(a, b) / divisor
        k = int(size.argmax())
        marker = "o" if np.ptp(np.column_stack([a, b]), axis=0).max() == 0 else ""
        ax.plot(angle, size, linewidth=1.2, marker=marker)
        ax.plot(angle[k], size[k], "o", color="C3", label=f"peak {size[k]:.4g} {unit}")
        ax.set_ylim(0.0, 1.1 * max(float(size.max()), 1e-300))
        ax.set_title(f"on {link}, in its axes: 0° is {_vector(e1)}, 90° {_vector(e2)}", fontsize=10)
        ax.legend(loc="upper left", bbox_to_anchor=(-0.05, -0.02), frameon=False)
        ax.set_rlabel_position(22.5)


def _vector(x: Float[np.ndarray, "3"]) -> str:
    for k, name in enumerate(XYZ):
        if abs(abs(x[k]) - 1.0) < 1e-9:
            return f"−{name}" if x[k] < 0 else name
    return components(x)
