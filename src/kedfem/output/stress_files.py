"""Files of the highest stresses over all steps and of damage: fields, tables, and lists of the highest values."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.links.recovery import StressRecovery
from kedfem.output.vtu import write_points
from kedfem.results import Fatigue, Peak
from kedfem.results.fatigue.surface import LinkFatigue
from kedfem.results.stresses.envelope import LinkEnvelope
from kedfem.results.stresses.peaks import reference_points
from kedfem.results.table import write_rows

ENVELOPE, POINTS, TOP = "envelope.vtu", "envelope.csv", "peaks.csv"
DAMAGE, DAMAGE_POINTS, SPOTS = "fatigue.vtu", "fatigue_points.csv", "fatigue.csv"
KINDS = ("highest von Mises", "largest principal", "smallest principal")
PLACE = tuple(f"reference {c} [m]" for c in "xyz")
MOST = 300.0  # power of ten that stands for an endless life
Columns = dict[str, Float[np.ndarray, " p"]]


@dataclass(frozen=True, slots=True)
class Extremes:
    """The envelope for its files.

    found : envelope of each link or segment
    near : for each of its points a description of the singular place that it is near to, or empty
    drive : name of the drive's position with its unit, e.g. "drive angle [rad]"
    """

    found: Sequence[LinkEnvelope]
    near: Sequence[Sequence[str]]
    drive: str

    def columns(self) -> Columns:
        """Stresses of all points of all links, with their times and drive positions; nan for rigid links."""
        stress = np.concatenate([each.stress for each in self.found], axis=1)
        when = np.concatenate([each.when for each in self.found], axis=2)
        what, _, unit = self.drive.partition(" [")
        out: Columns = {}
        for k, name in enumerate(KINDS):
            none = np.isnan(stress[k])
            out[f"{name} stress [Pa]"] = stress[k]
            phrases = f"time of {name} stress [s]", f"{what} of {name} stress [{unit}"
            for phrase, values in zip(phrases, when[:, k], strict=True):
                out[phrase] = np.where(none, np.nan, values)
        return out


def write_envelope(folder: Path, extremes: Extremes, table: bool) -> None:
    """Write the highest stresses of every point with their times, undeformed: for ParaView, and optionally CSV."""
    near = [word for each in extremes.near for word in each]
    singular = {"depends on mesh or joint": np.array([float(bool(word)) for word in near])}
    recoveries, columns = [each.recovery for each in extremes.found], extremes.columns()
    _write_field(folder / ENVELOPE, recoveries, columns | singular)
    if table:
        _write_table(folder / POINTS, recoveries, columns, {"near": near})


def write_top(folder: Path, every: Mapping[str, Sequence[Peak]], drive: str) -> None:
    """Write the highest stresses of each link at separate places as CSV; nothing if no link has stress."""
    header = ["link", "rank", "von Mises stress [Pa]", *PLACE, "time [s]", drive, "node", "near"]
    ranked = ((link, *each) for link, peaks in every.items() for each in enumerate(peaks, start=1))
    rows = [[link, k, x.stress, *x.place, x.time, x.angle, x.node, x.near] for link, k, x in ranked]
    if every:
        write_rows(folder / TOP, header, rows)


def write_fatigue(folder: Path, found: Fatigue, fields: Sequence[LinkFatigue], table: bool) -> None:
    """Write damage on undeformed links for ParaView, hot spots as CSV, and optionally all points as CSV."""
    recoveries, columns = [each.recovery for each in fields], _damage_columns(found, fields)
    _write_field(folder / DAMAGE, recoveries, columns)
    _write_spots(folder / SPOTS, found)
    if table:
        _write_table(folder / DAMAGE_POINTS, recoveries, columns, {})


def _damage_columns(found: Fatigue, fields: Sequence[LinkFatigue]) -> Columns:
    """Values of all points of all links; nan where there are none."""
    damage = np.concatenate([each.damage for each in fields])
    with np.errstate(divide="ignore"):
        periods = np.minimum(-np.log10(damage), MOST)
    return {
        "damage in a period": damage,
        "life, power of ten of hours": periods + np.log10(found.period / 3600),
        "utilisation of endurance": np.concatenate([each.utilisation for each in fields]),
        "amplitude of worst cycle [Pa]": np.concatenate([each.amplitude for each in fields]),
        "mean of worst cycle [Pa]": np.concatenate([each.mean for each in fields]),
        "disproportion": np.concatenate([each.disproportion for each in fields]),
        "criterion (0 von Mises, 1 normal, 2 Findley)": np.concatenate([x.criterion for x in fields]),
    }


def _write_spots(path: Path, found: Fatigue) -> None:
    """Write the places of the highest damage of each link."""
    header = [
        "link", "rank", *PLACE, "node", "criterion", "damage in a period", "life [periods]", "life [revolutions]",
        "life [h]", "utilisation", "amplitude [Pa]", "mean stress [Pa]", "disproportion", "support factor",
        "cycles in a period", "near", "unreliable",
    ]  # fmt: skip
    rows = []
    for link, spots in found.spots.items():
        for rank, spot in enumerate(spots, start=1):
            periods = 1 / spot.damage if spot.damage else np.inf
            turns = periods * found.revolutions if found.revolutions else np.nan
            rows.append(
                [link, rank, *spot.place, spot.node, spot.criterion, spot.damage, periods, turns, found.hours(spot),
                 spot.utilisation, spot.amplitude, spot.mean, spot.disproportion, spot.support, spot.cycles,
                 spot.near, found.unreliable]
            )  # fmt: skip
    write_rows(path, header, rows)


def _write_field(path: Path, recoveries: Sequence[StressRecovery], columns: Columns) -> None:
    """Write values at all points of all links, undeformed, for ParaView."""
    parts = [(x.link.name, reference_points(x), (x.cell_type, x.cells)) for x in recoveries]
    write_points(path, parts, columns)


def _write_table(
    path: Path, recoveries: Sequence[StressRecovery], columns: Columns, words: Mapping[str, Sequence[str]]
) -> None:
    """Write the same values as CSV, with texts for each point."""
    names = [(x.link.name, node) for x in recoveries for node in range(x.points)]
    numbers = np.column_stack([np.concatenate([reference_points(x) for x in recoveries]), *columns.values()])
    rows = zip(names, numbers.tolist(), *words.values(), strict=True)
    header = ["link", "node", *PLACE, *columns, *words]
    write_rows(path, header, ([*name, *row, *more] for name, row, *more in rows))
