"""Files of the highest stresses over all steps: at every point, for ParaView and as a table; the top ten of each link."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from kedfem.output.vtu import write_points
from kedfem.results import Peak
from kedfem.results.stresses.envelope import LinkEnvelope
from kedfem.results.stresses.hot_spots import drawn_points
from kedfem.results.table import cell, text_file

ENVELOPE, POINTS, TOP = "envelope.vtu", "envelope.csv", "peaks.csv"
KINDS = ("highest von Mises", "largest principal", "smallest principal")


@dataclass(frozen=True, slots=True)
class Extremes:
    """The envelope as files have it.

    found : per link or segment
    when : (2, T) time and drive at every step
    near : per link or segment what each point is near to, in words; empty where stress is what it seems
    drive : the drive's position with its unit, e.g. "drive angle [rad]"
    """

    found: Sequence[LinkEnvelope]
    when: Float[np.ndarray, "2 T"]
    near: Sequence[Sequence[str]]
    drive: str

    def columns(self) -> dict[str, Float[np.ndarray, " p"]]:
        """Of all points of all links: stresses, time and drive of each; nan of rigid links."""
        stress = np.concatenate([each.stress for each in self.found], axis=1)
        step = np.concatenate([each.step for each in self.found], axis=1)
        what, _, unit = self.drive.partition(" [")
        out: dict[str, Float[np.ndarray, " p"]] = {}
        for k, name in enumerate(KINDS):
            none = np.isnan(stress[k])
            out[f"{name} stress [Pa]"] = stress[k]
            for phrase, values in (
                (f"time of {name} stress [s]", self.when[0]),
                (f"{what} of {name} stress [{unit}", self.when[1]),
            ):
                out[phrase] = np.where(none, np.nan, values[np.where(none, 0, step[k])])
        return out


def write_envelope(folder: Path, extremes: Extremes, table: bool) -> None:
    """Highest stresses at every point and when they occur, on the undeformed links: for ParaView, and as CSV if asked."""
    every = [(each, drawn_points(each.recovery)) for each in extremes.found]
    columns = extremes.columns()
    doubts = np.array([float(bool(x)) for each in extremes.near for x in each])
    parts = [(each.link, points, each.recovery.cells, each.recovery.cell_type) for each, points in every]
    write_points(folder / ENVELOPE, parts, columns | {"depends on mesh or joint": doubts})
    if not table:
        return
    X = np.concatenate([points for _, points in every])
    header = ["link", "node", *(f"reference {c} [m]" for c in "xyz"), *columns, "near"]
    names = [(each.link, k) for each, points in every for k in range(len(points))]
    numbers = np.column_stack([X, *columns.values()])
    words = [word for each in extremes.near for word in each]
    with text_file(folder / POINTS) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for (link, node), row, word in zip(names, numbers, words, strict=True):
            writer.writerow([link, node, *map(cell, row), word])


def write_top(folder: Path, every: Mapping[str, Sequence[Peak]], drive: str) -> None:
    """The highest stresses of each link at places apart as CSV; nothing where no link has stress."""
    if not every:
        return
    header = [
        "link",
        "rank",
        "von Mises stress [Pa]",
        *(f"reference {c} [m]" for c in "xyz"),
        "time [s]",
        drive,
        "node",
        "near",
    ]
    with text_file(folder / TOP) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for link, peaks in every.items():
            for rank, peak in enumerate(peaks, start=1):
                numbers = map(cell, (peak.stress, *peak.place, peak.time, peak.angle))
                writer.writerow([link, rank, *numbers, peak.node, peak.near])
