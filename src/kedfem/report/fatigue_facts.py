"""Tables of fatigue for the report."""

from kedfem.accuracy.error_budget import percent
from kedfem.output.words import place_of, with_prefix
from kedfem.report.records import Rows, Table
from kedfem.results import Fatigue

ENDLESS = 1e15  # revolutions, hours: as good as for ever


FATIGUE_HEAD = (
    "link", "life", "utilisation", "amplitude", "mean", "criterion", "not proportional", "reference position", "near",
)  # fmt: skip


def fatigue_rows(found: Fatigue, most: int) -> Rows:
    """The places of the highest damage of each link."""
    return [
        (
            name if rank == 0 else "", life_of(spot.damage, found), percent(spot.utilisation),
            with_prefix(spot.amplitude, "Pa"), with_prefix(spot.mean, "Pa"), spot.criterion,
            percent(spot.disproportion), place_of(spot.place), spot.near,
        )
        for name, spots in found.spots.items()
        for rank, spot in enumerate(spots[:most])
    ]  # fmt: skip


def life_of(damage: float, found: Fatigue) -> str:
    """Life in turns of the drive, or periods, and hours, by the damage in a period."""
    turns, what = (found.revolutions, "revolutions") if found.revolutions else (1.0, "periods")
    hours = found.period / 3600
    return "endless" if damage * ENDLESS < turns else f"{turns / damage:.3g} {what}, {hours / damage:.3g} h"


def fatigue_notes(found: Fatigue) -> list[str]:
    """What a reader of the table has to know, in words."""
    turns = f", {found.revolutions:.6g} revolutions" if found.revolutions else ""
    lines = [f"Period {with_prefix(found.period, 's')}{turns}; stresses repeat to {percent(found.repeats)}."]
    lines += [f"DOUBTFUL: {found.doubt}."] if found.doubt else []
    lines += [f"{name}: {words}." for name, words in found.strengths.items()]
    if left := found.left_out_words:
        lines.append(f"Left out near corners, point forces and joints: {left} points.")
    empty = [name for name, spots in found.spots.items() if not spots]
    lines += [f"No point of {', '.join(empty)} is left to look at."] if empty else []
    lines += [f"No data of {', '.join(found.without)}."] if found.without else []
    return lines


def fatigue_table(found: Fatigue) -> Table:
    """Life and utilisation at the places of the highest damage."""
    note = " ".join(fatigue_notes(found))
    return Table("Fatigue: life and utilisation", FATIGUE_HEAD, fatigue_rows(found, 3), note)
