"""Files of damage: at every point for ParaView, and as tables of all points and of hot spots."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from kedfem.output.vtu import write_points
from kedfem.results import Fatigue
from kedfem.results.fatigue.surface import LinkFatigue
from kedfem.results.stresses.hot_spots import drawn_points
from kedfem.results.table import cell, text_file

FIELD, SPOTS, POINTS = "fatigue.vtu", "fatigue.csv", "fatigue_points.csv"
MOST = 300.0  # of powers of ten: life without damage


def write_fatigue(folder: Path, found: Fatigue, fields: Sequence[LinkFatigue], table: bool) -> None:
    """Damage at every point on the undeformed links for ParaView, hot spots as CSV, all points as CSV if asked."""
    every = [(each, drawn_points(each.recovery)) for each in fields]
    columns = _columns(found, fields)
    parts = [(each.recovery.link.name, X, each.recovery.cells, each.recovery.cell_type) for each, X in every]
    write_points(folder / FIELD, parts, columns)
    _write_spots(folder / SPOTS, found)
    if table:
        X = np.concatenate([points for _, points in every])
        names = [(each.recovery.link.name, k) for each, points in every for k in range(len(points))]
        with text_file(folder / POINTS) as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["link", "node", *(f"reference {c} [m]" for c in "xyz"), *columns])
            for (link, node), row in zip(names, np.column_stack([X, *columns.values()]), strict=True):
                writer.writerow([link, node, *map(cell, row)])


def _columns(found: Fatigue, fields: Sequence[LinkFatigue]) -> dict[str, np.ndarray]:
    """Of all points of all links; nan where there is nothing."""
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
    """The places of the highest damage of each link."""
    header = [
        "link", "rank", *(f"reference {c} [m]" for c in "xyz"), "node", "criterion", "damage in a period",
        "life [periods]", "life [revolutions]", "life [h]", "utilisation", "amplitude [Pa]", "mean stress [Pa]",
        "disproportion", "support factor", "cycles in a period", "near", "doubt",
    ]  # fmt: skip
    with text_file(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for link, spots in found.spots.items():
            for rank, spot in enumerate(spots, start=1):
                periods = 1 / spot.damage if spot.damage else np.inf
                turns = periods * found.revolutions if found.revolutions else np.nan
                lives = (periods, turns, found.hours(spot))
                numbers = (spot.utilisation, spot.amplitude, spot.mean, spot.disproportion, spot.support)
                writer.writerow(
                    [link, rank, *map(cell, spot.place), spot.node, spot.criterion, cell(spot.damage),
                     *map(cell, lives), *map(cell, numbers), spot.cycles, spot.near, found.doubt]
                )  # fmt: skip
