"""The cache of results between runs: meshes, reduced links, plans.

The folder is the user's cache folder, or that in KEDFEM_CACHE; KEDFEM_CACHE=off keeps nothing. An entry belongs to a key
that holds all that it depends on, the versions of kedfem and of the libraries among it. One that cannot be read, or is
not what was written, is made again. Entries are pickles, which can run code: a folder that others own or may write is
not used.
"""

import os
import pickle
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from kedfem.folders import KERNELS, cache_folder, sealed, unsealed, whole
from kedfem.processes import private

LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio")
MOST = 1_000_000_000  # bytes that the cache may take
OLDEST = 90 * 86400.0  # seconds after which an entry that nobody read goes
SUFFIX = ".kept"

T = TypeVar("T")


def kept(what: str, key: str, made: Callable[[], T], packed: Callable[[T], Any],
         unpacked: Callable[[Any], T]) -> T:  # fmt: skip
    """The stored value of a key; if there is none it is made and stored.

    Parameters
    ----------
    what : kind of entry
    key : of all that it depends on, beside the software
    made : makes it
    packed, unpacked : to and from something that can be pickled; None is not worth keeping
    """
    folder = cache_folder()
    if folder is None:
        return made()
    entry = folder / what / (sha256((software() + key).encode()).hexdigest() + SUFFIX)
    content = _read(entry)
    if content is not None:
        return unpacked(pickle.loads(content))
    fresh = made()
    if (small := packed(fresh)) is not None:
        with suppress(OSError):  # nothing is kept where nothing can be written
            entry.parent.mkdir(mode=0o700, exist_ok=True)
            with whole(entry, 0o600) as part:
                part.write_bytes(sealed(pickle.dumps(small, protocol=pickle.HIGHEST_PROTOCOL)))
            _make_room(folder)
    return fresh


def itself(x: T) -> T:
    """Something that can be kept as it is."""
    return x


def entries(folder: Path) -> Iterator[Path]:
    """All entries of a cache folder, compiled code, and what killed runs left of unfinished ones."""
    found = (*folder.glob("*/*"), *folder.glob(f"{KERNELS}/*/*/*"))
    return (path for path in found if path.suffix in {SUFFIX, ".part", ".nbi", ".nbc"} and path.is_file())


def clear(folder: Path) -> int:
    """Remove all entries of a cache folder, and nothing else; how many there were."""
    found = list(entries(folder))
    for path in found:
        path.unlink(missing_ok=True)
    return len(found)


def _read(entry: Path) -> bytes | None:
    """What an entry holds; None if there is none, if others may write it, or if it is not what was written."""
    try:
        if not (private(entry.parent) and private(entry)):
            return None
        whole = entry.read_bytes()
        os.utime(entry)  # what is used stays longest
    except OSError:
        return None
    return unsealed(whole)


def _make_room(folder: Path) -> None:
    """Remove entries that are too old, then those used longest ago while all take too much space."""
    found = sorted(((path.stat(), path) for path in entries(folder)), key=lambda each: each[0].st_mtime)
    size = sum(status.st_size for status, _ in found)
    for status, path in found:
        if size <= MOST and time.time() - status.st_mtime < OLDEST:
            break
        path.unlink(missing_ok=True)
        size -= status.st_size


def contents(files: Iterable[Path]) -> bytes:
    """A digest of what files hold; one that cannot be read counts as empty, and is refused where it is needed."""
    digest = sha256()
    for file in files:
        try:
            held = file.read_bytes()
        except OSError:
            held = b""
        digest.update(sha256(held).digest())
    return digest.digest()


@cache
def software() -> str:
    """kedfem's own source, since versions do not change while it is worked on, and the libraries' versions."""
    digest = sha256(" ".join(f"{name} {version(name)}" for name in LIBRARIES).encode())
    digest.update(contents(sorted(Path(__file__).parent.rglob("*.py"))))
    return digest.hexdigest()
