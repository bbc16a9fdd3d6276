"""Where kedfem keeps what it need not find out twice."""

import os
from pathlib import Path

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


def private(path: Path) -> bool:
    """Whether only this user can write a file or folder; always, where the system does not know such owners.

    Raises
    ------
    OSError
        There is none.
    """
    if not hasattr(os, "getuid"):
        return True
    status = path.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022
