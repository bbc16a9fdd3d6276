"""Where kedfem keeps what it need not find out twice."""

import os
from pathlib import Path

from kedfem.processes import private

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
