"""Writable folders and files, files that appear only when they are complete, packages that some outputs need."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from kedfem.errors import OutputError
from kedfem.folders import PART, whole
from kedfem.processes import reserve

LOCK = ".kedfem.lock"
DATA = "data"  # the extra with xarray, pandas and what they write files with


def unwritable(path: Path, error: OSError | RuntimeError) -> OutputError:
    """The error of a results file that cannot be written, with a message for the user."""
    if isinstance(error, BlockingIOError):
        return OutputError(f"{path}: must not be in use, got another run that is writing it")
    return OutputError(f"{path}: must be a file that can be written, got {reason(error)}")


def reason(error: OSError | RuntimeError) -> str:
    """What the system (or HDF5, which also raises RuntimeError) reported, in one line and without paths."""
    reason = error.strerror if isinstance(error, OSError) else None
    return (reason or str(error)).splitlines()[0]


def results_file(given: Path) -> Path:
    """The path of a results file: `results.h5` in a given folder, or the given file."""
    given = Path(given)
    return given / "results.h5" if given.is_dir() else given


def beside(folder: Path, what: str) -> Path:
    """The folder of another command beside that of a run's results, such as NAME-frequencies."""
    return folder.with_name(f"{folder.name.removesuffix('-results')}-{what}")


def ready_folder(folder: Path) -> Path:
    """A writable folder, made with its parents if it does not exist.

    Raises
    ------
    OutputError
        ``output.folder: must be a writable folder, got …``: a file in the way, no permission, a full or
        read-only disk.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        why = _in_the_way(folder) or reason(error)
        raise OutputError(f"output.folder: must be a writable folder, got {folder} ({why})") from error
    return folder


def _in_the_way(folder: Path) -> str:
    """A message about a file in the place of a folder, and what to do; "" if there is none."""
    with suppress(OSError):
        for place in (folder, *folder.parents):
            there = place.exists()
            if not there and place.is_symlink():
                return f"{place} is a link to nothing: remove it, or make {place.readlink()}"
            if there:
                return "" if place.is_dir() else f"{place} is a file: move it, or name another folder"
    return ""


def require_space(folder: Path, size: int) -> None:
    """Ensure that `size` bytes can be written in a folder, within disk and quota; OSError if not.

    HDF5 cannot close a file after a refused write (it takes the process down, and the file with it): space is
    asked for before, on a file without a name that is gone at once.
    """
    with tempfile.TemporaryFile(dir=folder) as file:
        reserve(file, size)


@contextmanager
def claimed(folder: Path, within: Sequence[str] = ()) -> Iterator[Path]:
    """A folder that belongs to one run until the block ends; unfinished files of killed runs are removed.

    Parameters
    ----------
    within : names of folders in it that the run writes in, too

    Raises
    ------
    OutputError
        The folder cannot be written, or another run is writing there: that run is left alone.
    """
    from filelock import FileLock, Timeout

    new = not folder.exists()
    lock = FileLock(ready_folder(folder) / LOCK, timeout=0.05)
    try:
        lock.acquire()
    except Timeout as error:
        wanted = "must not be in use, got another run that is writing there"
        raise OutputError(f"{folder}: {wanted}; wait for it, or give output.folder another name") from error
    except OSError as error:
        raise OutputError(f"{folder}: must be a folder that can be locked, got {reason(error)}") from error
    try:
        for place in (folder, *(folder / each for each in within)):
            for path in place.iterdir() if place.is_dir() else ():
                if PART.fullmatch(path.name):
                    path.unlink(missing_ok=True)
        yield folder
    finally:
        with suppress(OSError):
            # while it is held: who waits for it sees that it is gone, and makes a new one
            (folder / LOCK).unlink()
        lock.release()
        if new:
            with suppress(OSError):
                folder.rmdir()  # of a run that was refused before it wrote anything


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` that replaces it when the block ends without an error.

    Readers see the old file or the new one, never a part of it.

    Raises
    ------
    OutputError
        The folder or the file cannot be written; the old file is left as it was.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as part:
            yield part
    except OSError as error:
        ready_folder(path.parent)  # or says what is wrong with it
        raise unwritable(path, error) from error


def of_extra(package: str, where: str, extra: str = DATA) -> Any:
    """A package of an extra of kedfem.

    Parameters
    ----------
    where : what needs it, as the user wrote it
    """
    try:
        return import_module(package)
    except ImportError as error:
        missing = f"{where}: needs {package}, which is not installed: pip install 'kedfem[{extra}]'"
        raise OutputError(missing) from error
