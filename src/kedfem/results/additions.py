"""What is added to a results file after its rows: the verdict, peaks, notes, warnings and timing; all files are whole.

An OutputError says that a file cannot be written.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kedfem.errors import OutputError
from kedfem.results.files import reason
from kedfem.results.layout import FATIGUE, PEAKS, TIMING, WARNINGS, opened, seal, write_facts
from kedfem.results.records import Fatigue, FatigueSpot, Peak


def mark_doubtful(path: Path, why: str) -> None:
    """Say that results mean nothing, and why."""
    with _changed(path) as file:
        write_facts(file, {"status": "doubtful", "reason": why})


def add_peaks(path: Path, peaks: Mapping[str, Peak]) -> None:
    """Store the highest stress of each link, ``peaks/LINK``."""
    with _changed(path) as file:
        for name, peak in peaks.items():
            _lay_peak(file.create_group(f"{PEAKS}/{name}"), peak)


def _lay_peak(group: Any, peak: Peak) -> None:
    write_facts(
        group,
        {
            "von_mises [Pa]": peak.stress, "place [m]": peak.place, "node": peak.node, "step": peak.step,
            "time [s]": peak.time, "drive [rad or m]": peak.angle, "near": peak.near, "link": peak.link,
        }
    )  # fmt: skip
    if peak.away is not None:
        _lay_peak(group.create_group("away"), peak.away)


def add_fatigue(path: Path, found: Fatigue) -> None:
    """Store damage, ``fatigue/LINK/RANK``."""
    with _changed(path) as file:
        group = file.create_group(FATIGUE)
        write_facts(
            group,
            {
                "period [s]": found.period, "revolutions": found.revolutions, "repeats to": found.repeats,
                "doubt": found.doubt, "links without data": "\n".join(found.without),
            },
        )  # fmt: skip
        for name, spots in found.spots.items():
            link = group.create_group(name)
            write_facts(link, {"strength": found.strengths[name], "points left out": found.left_out[name]})
            for rank, spot in enumerate(spots, start=1):
                _lay_spot(link.create_group(str(rank)), spot)


def _lay_spot(group: Any, spot: FatigueSpot) -> None:
    write_facts(
        group,
        {
            "damage in a period": spot.damage, "utilisation": spot.utilisation, "criterion": spot.criterion,
            "amplitude [Pa]": spot.amplitude, "mean stress [Pa]": spot.mean, "disproportion": spot.disproportion,
            "support factor": spot.support, "cycles in a period": spot.cycles, "place [m]": spot.place,
            "node": spot.node, "near": spot.near,
        },
    )  # fmt: skip


def add_notes(path: Path, notes: Mapping[str, str | float]) -> None:
    """Store more facts about a run."""
    with _changed(path) as file:
        write_facts(file["notes"], notes)


def add_account(path: Path, warnings: Sequence[str], seconds: Mapping[str, float]) -> None:
    """Store what is reported of a run, and the seconds of each of its stages."""
    with _changed(path) as file:
        numbered = {f"warning {k}": text for k, text in enumerate(warnings, start=1)}
        for name, facts in ((WARNINGS, numbered), (TIMING, seconds)):
            file.pop(name, None)
            write_facts(file.create_group(name), facts)


@contextmanager
def _changed(path: Path) -> Iterator[Any]:
    """A file that is whole, opened to change its texts."""
    try:
        with opened(path, "r+") as file:
            yield file
            seal(file)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"{path}: must be a file that can be written, got {reason(error)}") from error
