"""What was found once is kept between runs: meshes, reduced links, plans.

The folder is the user's cache folder, or that in KEDFEM_CACHE; KEDFEM_CACHE=off keeps nothing. An entry belongs to a key
that holds all that it depends on, the versions of kedfem and of the libraries among it. One that cannot be read, or is
not what was written, is made again.
"""

import pickle
import warnings
from collections.abc import Callable, Iterable
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from kedfem.folders import cache_folder

LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio")
MOST = 1_000_000_000  # bytes that the cache may take

T = TypeVar("T")


def kept(what: str, key: str, made: Callable[[], T], packed: Callable[[T], Any],
         unpacked: Callable[[Any], T]) -> T:  # fmt: skip
    """What was made before under a key, or is made now and kept.

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
    from joblib import Memory

    fresh: list[T] = []

    def make() -> Any:
        fresh.append(made())
        return packed(fresh[0])

    memory = Memory(folder, verbose=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an entry that cannot be read or written is made again
        entry = memory.cache(_sealed, ignore=["made"])
        place = what, sha256((software() + key).encode()).hexdigest()
        digest, content = entry(*place, make)
        if not fresh and sha256(content).hexdigest() != digest:
            entry.call(*place, make)
        memory.reduce_size(bytes_limit=MOST)
    if fresh:
        return fresh[0]
    found = pickle.loads(content)
    return made() if found is None else unpacked(found)


def itself(x: T) -> T:
    """Something that can be kept as it is."""
    return x


def _sealed(what: str, key: str, made: Callable[[], Any]) -> tuple[str, bytes]:
    """What is made, as bytes with their digest."""
    del what, key
    content = pickle.dumps(made(), protocol=pickle.HIGHEST_PROTOCOL)
    return sha256(content).hexdigest(), content


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
