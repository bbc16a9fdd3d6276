"""Reading a results file."""

from dataclasses import replace
from pathlib import Path
from typing import Any, cast, get_args

from kedfem.errors import OutputError
from kedfem.results import on_demand
from kedfem.results.additions import read_account, read_fatigue, read_peaks
from kedfem.results.channels import ANGLE, TIME, TRAVEL, Channel
from kedfem.results.files import reason
from kedfem.results.layout import (
    BETWEEN,
    FORMAT,
    LARGEST,
    all_rows,
    opened,
    opened_to_read,
    read_facts,
    read_text,
    sealed,
    series,
)
from kedfem.results.records import Results, Status

WANTED = "a results file of kedfem"


def read_results(path: Path) -> Results:
    """The time series of a run, finished or not.

    All channels; `status` shows whether the run came to its end.

    Raises
    ------
    OutputError
        The file is missing, corrupt, not from kedfem, or of a newer layout.
    """
    path = Path(path)
    if not path.is_file():
        got = "a folder" if path.is_dir() else "no such file"
        raise OutputError(f"{path}: must be {WANTED}, got {got}")
    try:
        with opened_to_read(path) as file:
            _refuse_foreign(file, path)
            found = _results(file, path)
            if not sealed(file):
                raise ValueError("a text that is not what was written")
        abandoned = found.status == "running" and not _alive(path)
        return replace(found, status="abandoned") if abandoned else found
    except (OSError, RuntimeError) as error:
        raise OutputError(f"{path}: must be {WANTED}, got a corrupt file ({reason(error)})") from error
    except (KeyError, ValueError, TypeError) as error:
        raise OutputError(f"{path}: must be {WANTED}, got one with a gap ({error})") from error


def abandoned_rows(path: Path) -> int | None:
    """Number of rows of a run whose process was killed; None if there is no such run."""
    try:
        with opened_to_read(path) as file:
            if read_facts(file).get("status") != "running":
                return None
            rows = len(file[TIME.name])
        return None if _alive(path) else rows
    except (OSError, RuntimeError, KeyError):
        return None


def run_status(path: Path) -> str:
    """Status of the run of a results file, without its rows; "" for a file that cannot be read."""
    try:
        with opened_to_read(path) as file:
            return str(read_facts(file)["status"])
    except (OSError, RuntimeError, KeyError):
        return ""


def foreign(path: Path) -> bool:
    """Whether there is an HDF5 file that is not of kedfem."""
    try:
        with opened_to_read(path) as file:
            return "kedfem_version" not in file.attrs
    except (OSError, RuntimeError):
        return False


def _alive(path: Path) -> bool:
    """Whether a process holds the lock of a file with status ``running``; True if that cannot be determined."""
    try:
        opened(path, "r", True).close()
    except OSError:
        return True
    return False


def _refuse_foreign(file: Any, path: Path) -> None:
    """Refuse files of other programs or of another layout."""
    layout = file.attrs.get("format")
    if layout is None or "kedfem_version" not in file.attrs:
        raise OutputError(f"{path}: must be {WANTED}, got another HDF5 file")
    if int(layout) != FORMAT:
        got = f"layout {layout} of kedfem {read_facts(file)['kedfem_version']}"
        raise OutputError(f"{path}: must be {WANTED} with layout {FORMAT}, got {got}: run the scene again")


def _results(file: Any, path: Path) -> Results:
    """The record; every series is cut to the rows that all of them have."""
    every = sorted(series(file), key=lambda name: int(file[name].attrs["index"]))
    n = min(len(file[name]) for name in every)
    named = [name.removeprefix("/") for name in every]
    toml = file["scene"].get("toml")
    position = TRAVEL if TRAVEL.name in named else ANGLE
    drive, facts = file[position.name], read_facts(file)
    time, scene = file[TIME.name], read_text(file["scene/json"])
    known = {name: _channel(name, file[name]) for name in named if name not in {position.name, TIME.name}}
    large = 8 * n * sum(len(channel.columns) for channel in known.values()) > on_demand.AT_ONCE
    later = on_demand.OnDemand(path, scene, known, n) if large and facts["status"] != "running" else None
    warnings, seconds = read_account(file)
    notes, with_largest = read_facts(file["notes"]), [name for name in known if LARGEST in file[name].attrs]
    return Results(
        time=all_rows(time, n), angle=all_rows(drive, n),
        channels=later or {name: (channel, on_demand.rows_of(file[name], channel, n)) for name, channel in known.items()},
        status=_status(facts["status"]), scene_json=scene,
        scene_toml=None if toml is None else read_text(toml), notes=notes,
        reason=facts["reason"], version=facts["kedfem_version"],
        drive=replace(position, description=read_facts(drive)["description"]), peaks=read_peaks(file),
        warnings=warnings, seconds=seconds,
        links={name: read_facts(group) for name, group in file["notes"].items()}, fatigue=read_fatigue(file),
        every=int(notes.get(BETWEEN, 1)),
        largest={name: file[name].attrs[LARGEST].reshape(-1, 2 + len(known[name].columns)) for name in with_largest},
    )  # fmt: skip


def _status(found: str) -> Status:
    """The status of a file; ValueError for an unknown word."""
    for known in get_args(Status):
        if found == known:
            return cast(Status, known)
    raise ValueError(f"a status {found!r}")


def _channel(name: str, rows: Any) -> Channel:
    facts = read_facts(rows)
    return Channel(name, tuple(facts["columns"]), facts["unit"], facts["frame"], facts["description"])
