"""Records of arrays and words as `.npz` of NumPy or `.mat` of MATLAB, and back."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import numpy as np

from kedfem.errors import OutputError
from kedfem.results import replacing
from kedfem.results.files import reason

ENDINGS = (".npz", ".mat")
Record = TypeVar("Record")


def require_ending(path: Path, endings: Sequence[str] = ENDINGS) -> None:
    """OutputError unless a file is of a kind that is known."""
    if path.suffix not in endings:
        raise OutputError(f"{path}: must end in {' or '.join(endings)}, got '{path.suffix}'")


def write_record(record: Any, path: Path, name: str) -> None:
    """Write a dataclass of arrays, words, numbers and tuples of words, with the name of its format.

    Raises
    ------
    OutputError
        The file has another ending, or cannot be written.
    """
    require_ending(path)
    data = {each.name: getattr(record, each.name) for each in fields(record)} | {"format": name}
    with replacing(path) as part, part.open("wb") as file:
        if path.suffix == ".npz":
            np.savez_compressed(file, **data)
        else:
            from scipy.io import savemat

            cells = {key: np.array(x, object) for key, x in data.items() if isinstance(x, tuple)}
            savemat(file, data | cells, do_compression=True)


def read_record(path: Path, kind: type[Record], name: str, what: str) -> Record:
    """A record that :func:`write_record` wrote.

    Raises
    ------
    OutputError
        It is not such a file.
    """
    try:
        if path.suffix == ".mat":
            from scipy.io import loadmat

            with path.open("rb") as file:
                data = loadmat(file)
        else:
            with np.load(path, allow_pickle=False) as file:
                data = dict(file)
        if (found := str(np.ravel(data["format"])[0])) != name:
            raise ValueError(f"format '{found}'")
        hints = get_type_hints(kind)
        return kind(**{each: _as(hints[each], np.asarray(data[each])) for each in hints})
    except OSError as error:
        raise OutputError(f"{path}: must be {what} that kedfem wrote, got {reason(error)}") from error
    except Exception as error:
        raise OutputError(f"{path}: must be {what} that kedfem wrote, got another file ({error})") from error


def _as(hint: Any, found: np.ndarray) -> Any:
    """What a file has of a field, in the field's own type: MATLAB knows matrices and cells alone."""
    if hint in (str, float, int):
        return hint(found.ravel()[0])
    if hint == tuple[str, ...]:
        return tuple(str(np.ravel(each)[0]) for each in found.ravel())
    if "bool" in str(getattr(hint, "dtypes", "")).lower():
        found = found.astype(bool)
    return found.ravel() if len(hint.dims) == 1 else found
