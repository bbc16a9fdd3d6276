"""Reading a results file."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.errors import OutputError
from kedfem.results.files import reason
from kedfem.results.records import ANGLE, TIME, TRAVEL, Channel, Peak, Results
from kedfem.results.writer import FORMAT, PEAKS

WANTED = "a results file of kedfem"


def read_results(path: Path) -> Results:
    """The time series of a run, finished or not.

    Parameters
    ----------
    path
        A file written by :class:`~kedfem.results.ResultsWriter`.

    Returns
    -------
    All channels; `status` tells whether the run came to its end.

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
        with _opened(path) as file:
            _refuse_foreign(file, path)
            return _results(file)
    except (OSError, RuntimeError) as error:
        raise OutputError(f"{path}: must be {WANTED}, got a corrupt file ({reason(error)})") from error
    except (KeyError, ValueError, TypeError) as error:
        raise OutputError(f"{path}: must be {WANTED}, got one with a gap ({error})") from error


def _opened(path: Path) -> Any:
    """The file, whether or not a run is writing it."""
    import h5py

    try:
        return h5py.File(path, "r", locking=False)  # the run holds the lock
    except OSError:
        return h5py.File(path, "r")  # HDF5 wants equal locking flags where the run is this same process


def _refuse_foreign(file: Any, path: Path) -> None:
    """Only files of kedfem, of a layout that is known here."""
    layout = file.attrs.get("format")
    if layout is None or "kedfem_version" not in file.attrs:
        raise OutputError(f"{path}: must be {WANTED}, got another HDF5 file")
    if int(layout) > FORMAT:
        got = f"layout {layout} of kedfem {file.attrs['kedfem_version']}"
        raise OutputError(f"{path}: must be {WANTED} with layout {FORMAT} or older, got {got}")


def _results(file: Any) -> Results:
    """The record; every series is cut to the rows that all of them have."""
    series = sorted(_series(file), key=lambda rows: int(rows.attrs["index"]))
    n = min(len(rows) for rows in series)
    named = {rows.name.removeprefix("/"): rows for rows in series}
    toml = file["scene"].get("toml")
    position = TRAVEL if TRAVEL.name in named else ANGLE
    drive = named.pop(position.name)
    return Results(
        time=_frozen(named.pop(TIME.name)[:n]),
        angle=_frozen(drive[:n]),
        channels={name: (_channel(name, rows), _frozen(rows[:n])) for name, rows in named.items()},
        status=file.attrs["status"],
        scene_json=file["scene/json"].asstr()[()],
        scene_toml=None if toml is None else toml.asstr()[()],
        notes={key: _plain(value) for key, value in file["notes"].attrs.items()},
        reason=file.attrs["reason"],
        version=file.attrs["kedfem_version"],
        drive=replace(position, description=drive.attrs["description"]),
        peaks={name: _peak(group) for name, group in file.get(PEAKS, {}).items()},
    )


def _peak(group: Any) -> Peak:
    said = group.attrs
    x, y, z = map(float, said["place [m]"])
    return Peak(
        float(said["von_mises [Pa]"]), said["link"], (x, y, z), int(said["node"]), int(said["step"]),
        float(said["time [s]"]), float(said["drive [rad or m]"]), said["near"],
        _peak(group["away"]) if "away" in group else None,
    )  # fmt: skip


def _series(file: Any) -> list[Any]:
    """Every dataset that carries a unit."""
    found: list[Any] = []

    def keep(_: str, item: Any) -> None:
        if "unit" in item.attrs:
            found.append(item)

    file.visititems(keep)
    return found


def _channel(name: str, rows: Any) -> Channel:
    said = rows.attrs
    return Channel(name, tuple(map(str, said["columns"])), said["unit"], said["frame"], said["description"])


def _frozen(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def _plain(value: Any) -> str | float:
    """A note as Python's own text or number."""
    plain: str | float = value.item() if isinstance(value, np.generic) else value
    return plain
