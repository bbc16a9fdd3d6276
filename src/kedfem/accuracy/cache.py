"""What was found for a scene is kept between runs: its plan, its reduced links.

The folder is the user's cache folder, or that in KEDFEM_CACHE; KEDFEM_CACHE=off keeps nothing. An entry belongs to all
that it depends on: the scene, the contents of its files, the versions of kedfem and of the libraries. One that cannot be
read is made again.
"""

import json
import warnings
from collections.abc import Callable, Iterable
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from kedfem.folders import cache_folder
from kedfem.scene import MeshFile, Part, Scene

LIBRARIES = ("numpy", "scipy", "scikit-fem", "gmsh", "meshio")
MOST = 1_000_000_000  # bytes that the cache may take

T = TypeVar("T")
P = TypeVar("P")


def kept(what: str, scene: Scene, made: Callable[[], T], packed: Callable[[T], P | None],
         unpacked: Callable[[P], T]) -> T:  # fmt: skip
    """What was made for a scene before, or is made now and kept.

    Parameters
    ----------
    what : kind of entry
    made : makes it
    packed, unpacked : to and from something that can be pickled; None is not worth keeping
    """
    folder = cache_folder()
    if folder is None:
        return made()
    from joblib import Memory

    fresh: list[T] = []

    def make() -> P | None:
        fresh.append(made())
        return packed(fresh[0])

    memory = Memory(folder, verbose=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # an entry that cannot be read or written is made again
        found = memory.cache(_made, ignore=["made"])(what, key(scene), make)
        memory.reduce_size(bytes_limit=MOST)
    if fresh:
        return fresh[0]
    return made() if found is None else unpacked(found)


def _made(what: str, key: str, made: Callable[[], Any]) -> Any:
    del what, key
    return made()


def key(scene: Scene) -> str:
    """A digest of everything that a plan or a reduced model depends on."""
    digest = sha256(_software().encode())
    said = scene.model_dump(mode="json", exclude={"title"})
    said["output"] = said["output"]["probes"]
    digest.update(json.dumps(said).encode())
    shapes = (link.shape for link in scene.links.values())
    digest.update(contents(scene.folder / x.file for x in shapes if isinstance(x, MeshFile | Part)))
    return digest.hexdigest()


def contents(files: Iterable[Path]) -> bytes:
    """A digest of what files hold."""
    digest = sha256()
    for file in files:
        digest.update(sha256(file.read_bytes()).digest())
    return digest.digest()


@cache
def _software() -> str:
    """kedfem's own source, since versions do not change while it is worked on, and the libraries' versions."""
    digest = sha256(" ".join(f"{name} {version(name)}" for name in LIBRARIES).encode())
    digest.update(contents(sorted(Path(__file__).parents[1].rglob("*.py"))))
    return digest.hexdigest()
