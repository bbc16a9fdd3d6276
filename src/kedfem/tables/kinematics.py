"""What kinematics found: ranges of joint coordinates, transmission angles, largest rigid forces."""

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.kinematics import Moved, first_largest
from kedfem.output.words import NOTHING, clock, moment, with_prefix
from kedfem.results.kinematic import transmission_key
from kedfem.scene import Scene


def kinematics_tables(scene: Scene, moved: Moved) -> list[Table]:
    """Coordinates of joints, transmission angles, forces of joints and drive, and the seconds spent."""
    found = moved.results
    spent = Table(title=f"{len(found.time) - 1} steps; seconds", show_header=False)
    for stage, seconds in moved.seconds.items():
        spent.add_row(stage, f"{seconds:.2f}")
    tables = [_coordinates(scene, moved), _transmissions(scene, moved), _forces(scene, moved)]
    return [*(table for table in tables if table.row_count), spent]


def _coordinates(scene: Scene, moved: Moved) -> Table:
    table = Table(title=Text(scene.title or "Joints"))
    for column in ("joint", "coordinate", "from", "to", "range"):
        table.add_column(column, justify="left" if column in {"joint", "coordinate"} else "right")
    for each in moved.recorded.coordinates:
        values = moved.results.channels[f"joints/{each.joint}/{each.name}"][1][:, 0]
        low, high = float(values.min()), float(values.max())
        words = [
            _length(x) if each.kind == "length" else f"{np.degrees(x):.2f}°" for x in (low, high, high - low)
        ]
        driven = " (driven)" if each.joint in scene.driven_joints else ""
        table.add_row(each.joint, each.name.replace("_", " ") + driven, *words)
    return table


def _transmissions(scene: Scene, moved: Moved) -> Table:
    table = Table(title="Transmission angles")
    for column in ("coupler", "drives", "from", "to", "furthest from 90°", f"at {clock(scene)}"):
        table.add_column(column, justify="left" if column in {"coupler", "drives"} else "right")
    for each in moved.recorded.transmissions:
        values = moved.results.channels[transmission_key(each.coupler)][1][:, 0]
        k = first_largest(np.abs(values - np.pi / 2))
        words = (f"{np.degrees(x):.2f}°" for x in (values.min(), values.max(), values[k]))
        table.add_row(each.coupler, each.driven, *words, _at(scene, moved, k))
    return table


def _forces(scene: Scene, moved: Moved) -> Table:
    """Largest sizes; what statics do not determine is not there."""
    table = Table(title="Largest forces were all links rigid")
    for column in ("of", "largest", f"at {clock(scene)}"):
        table.add_column(column, justify="left" if column == "of" else "right")
    found = {name: x for name, x in moved.results.channels.items() if "/rigid_" in name}
    highest: dict[str, float] = {}
    for channel, values in found.values():
        highest[channel.unit] = max(highest.get(channel.unit, 0.0), float(np.abs(values).max()))
    for name, (channel, values) in found.items():
        size = np.linalg.norm(values, axis=1)
        k = first_largest(size)
        shown = float(values[k, 0]) if values.shape[1] == 1 else float(size[k])
        of = name.replace("/rigid_", " ").replace("/", " ").removeprefix("joints ")
        if abs(shown) <= NOTHING * highest[channel.unit]:
            table.add_row(of, "≈ 0", "")
            continue
        table.add_row(of, with_prefix(shown, channel.unit), _at(scene, moved, k))
    return table


def _at(scene: Scene, moved: Moved, k: int) -> str:
    return moment(scene, float(moved.results.time[k]), float(moved.results.angle[k]))


def _length(x: float) -> str:
    return with_prefix(x, "m") if abs(x) > 1e-12 else "0 m"
