"""Where kedfem keeps what it need not find out twice."""

import os
from pathlib import Path


def cache_folder() -> Path | None:
    """Where entries are kept; None if nowhere, or if the folder cannot be made."""
    given = os.environ.get("KEDFEM_CACHE")
    if given in {"", "off"}:
        return None
    from platformdirs import user_cache_path

    folder = Path(given) if given else user_cache_path("kedfem")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder
