"""Where kedfem keeps what it need not find out twice, and files that appear only when they are whole."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex

from kedfem.processes import private

PART = re.compile(r".+\.[0-9a-f]{8}\.part(\.\w+)?")
"""Names of files that are not whole yet, or that killed runs left."""

KERNELS = "kernels"
"""Compiled code, in the cache folder."""


def cache_folder() -> Path | None:
    """Where entries are kept; None if nowhere, if the folder cannot be made, or if others could put entries there."""
    folder = named_cache()
    return None if folder is None else _usable(folder)


def compiled_folder() -> Path | None:
    """Where compiled code is kept, also while KEDFEM_CACHE is off; None if it cannot be there, see `cache_folder`."""
    return _usable((named_cache() or _users()) / KERNELS)


def _usable(folder: Path) -> Path | None:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return folder if private(folder) else None
    except OSError:
        return None


def named_cache() -> Path | None:
    """The folder that the user's settings name, whether or not it can be used; None if they switch it off."""
    given = os.environ.get("KEDFEM_CACHE")
    if given in {"", "off"}:
        return None
    return Path(given) if given else _users()


def _users() -> Path:
    from platformdirs import user_cache_path

    return user_cache_path("kedfem")


def own_part(path: Path) -> Path:
    """A name beside `path` that no other writer has, for a file that is not whole yet."""
    return path.with_name(f"{path.stem}.{token_hex(4)}.part{path.suffix}")


@contextmanager
def whole(path: Path, mode: int = 0o666) -> Iterator[Path]:
    """A file of its own beside `path` that takes its place when the block ends without an error, else is removed.

    Readers see the old file or the new one, never a part of it.

    Parameters
    ----------
    mode : rights of the new file, as far as the user's mask leaves them

    Raises
    ------
    OSError
        It cannot be made or put in place; the old file is left as it was.
    """
    part = own_part(path)
    try:
        os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, mode))
        yield part
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
