"""Entries of a results file that are written after its rows: status, peaks, damage, notes, warnings, timing.

An OutputError reports a file that cannot be written.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.results.files import unwritable
from kedfem.results.layout import FATIGUE, PEAKS, TIMING, WARNINGS, opened, read_facts, seal, write_facts
from kedfem.results.records import Fatigue, FatigueSpot, Peak

OF_PEAK = {
    "stress": "von_mises [Pa]", "link": "link", "place": "place [m]", "node": "node", "step": "step",
    "time": "time [s]", "angle": "drive [rad or m]", "near": "near", "strength": "yield_strength [Pa]",
}  # fmt: skip
OF_FATIGUE = {"period": "period [s]", "revolutions": "revolutions", "repeats": "repeats to", "unreliable": "unreliable"}
OF_SPOT = {
    "place": "place [m]", "node": "node", "criterion": "criterion", "damage": "damage in a period",
    "utilisation": "utilisation", "amplitude": "amplitude [Pa]", "mean": "mean stress [Pa]",
    "disproportion": "disproportion", "support": "support factor", "cycles": "cycles in a period", "near": "near",
}  # fmt: skip
"""Field of a record → its name in the file."""


def mark_unreliable(path: Path, why: str) -> None:
    """Mark results as unreliable, with the reason."""
    with _changed(path) as file:
        write_facts(file, {"status": "unreliable", "reason": why})


def add_peaks(path: Path, peaks: Mapping[str, Peak]) -> None:
    """Store the highest stress of each link, ``peaks/LINK``."""
    with _changed(path) as file:
        for name, peak in peaks.items():
            _store(file.create_group(f"{PEAKS}/{name}"), peak, OF_PEAK)
            if peak.away is not None:
                _store(file.create_group(f"{PEAKS}/{name}/away"), peak.away, OF_PEAK)


def read_peaks(file: Any) -> dict[str, Peak]:
    """The highest stresses that `add_peaks` stored."""
    return {name: _peak(group) for name, group in file.get(PEAKS, {}).items()}


def _peak(group: Any) -> Peak:
    return Peak(**_stored(group, OF_PEAK), away=_peak(group["away"]) if "away" in group else None)


def add_fatigue(path: Path, found: Fatigue) -> None:
    """Store damage, ``fatigue/LINK/RANK``."""
    with _changed(path) as file:
        group = file.create_group(FATIGUE)
        _store(group, found, OF_FATIGUE)
        write_facts(group, {"links without data": "\n".join(found.without)})
        for name, spots in found.spots.items():
            link = group.create_group(name)
            write_facts(link, {"strength": found.strengths[name], "points left out": found.left_out[name]})
            for rank, spot in enumerate(spots, start=1):
                _store(link.create_group(str(rank)), spot, OF_SPOT)


def read_fatigue(file: Any) -> Fatigue | None:
    """The damage that `add_fatigue` stored; None without any."""
    if FATIGUE not in file:
        return None
    links, without = file[FATIGUE], read_facts(file[FATIGUE])["links without data"]
    of = {name: read_facts(link) for name, link in links.items()}
    spots = {
        name: tuple(FatigueSpot(name, **_stored(link[rank], OF_SPOT)) for rank in sorted(link, key=int))
        for name, link in links.items()
    }
    return Fatigue(
        **_stored(links, OF_FATIGUE),
        spots=spots,
        strengths={name: facts["strength"] for name, facts in of.items()},
        left_out={name: facts["points left out"] for name, facts in of.items()},
        without=tuple(without.split("\n")) if without else (),
    )


def _store(group: Any, record: Peak | Fatigue | FatigueSpot, names: Mapping[str, str]) -> None:
    write_facts(group, {fact: getattr(record, name) for name, fact in names.items()})


def _stored(group: Any, names: Mapping[str, str]) -> dict[str, Any]:
    facts = read_facts(group)
    found = {name: facts[fact] for name, fact in names.items()}
    return {name: tuple(x.tolist()) if isinstance(x, np.ndarray) else x for name, x in found.items()}


def add_notes(path: Path, notes: Mapping[str, str | float]) -> None:
    """Store more facts about a run."""
    with _changed(path) as file:
        write_facts(file["notes"], notes)


def add_account(path: Path, warnings: Sequence[str], seconds: Mapping[str, float]) -> None:
    """Store the warnings of a run, and the seconds of each of its stages."""
    with _changed(path) as file:
        numbered = {f"warning {k}": text for k, text in enumerate(warnings, start=1)}
        for name, facts in ((WARNINGS, numbered), (TIMING, seconds)):
            file.pop(name, None)
            write_facts(file.create_group(name), facts)


def read_account(file: Any) -> tuple[tuple[str, ...], dict[str, float]]:
    """The warnings and seconds that `add_account` stored."""
    facts = read_facts(file[WARNINGS]) if WARNINGS in file else {}
    numbered = sorted(facts, key=lambda key: int(key.rpartition(" ")[2]))
    return tuple(facts[key] for key in numbered), read_facts(file[TIMING]) if TIMING in file else {}


@contextmanager
def _changed(path: Path) -> Iterator[Any]:
    """A complete file, opened to change its texts."""
    try:
        with opened(path, "r+") as file:
            yield file
            seal(file)
    except (OSError, RuntimeError) as error:
        raise unwritable(path, error) from error
