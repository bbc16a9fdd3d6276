"""Cache folders, files that appear only when they are complete, and digests.

By digests changed bytes are noticed before anything is made of them. Of content: it is kept behind its digest. Of a
folder of files that others write and read, so that changed ones go: numba reads what it compiled by unpickling and
linking it, where a flipped bit would end in a library's error, or worse.
"""

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from secrets import token_hex

from kedfem.processes import private

PART = re.compile(r".+\.[0-9a-f]{8}\.part(\.\w+)?")
"""Names of files that are not whole yet, or that killed runs left."""

KERNELS = "kernels"
"""Compiled code, in the cache folder."""
DIGESTS = "digests.json"
_LENGTH = sha256().digest_size


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


def sealed(content: bytes) -> bytes:
    """Content behind its digest."""
    return sha256(content).digest() + content


def unsealed(sealed_content: bytes) -> bytes | None:
    """The content that was sealed; None if any byte is another."""
    digest, content = sealed_content[:_LENGTH], sealed_content[_LENGTH:]
    return content if sha256(content).digest() == digest else None


def drop_changed(folder: Path, known: dict[str, str], name: str) -> None:
    """Remove the files of a function that are not as they were noted; those written since stay."""
    for file in folder.glob(f"{name}.*nb[ci]"):
        with suppress(OSError):
            if known.get(_name(file), digest := _digest(file)) != digest:
                file.unlink()


def note(folder: Path) -> None:
    """Write the digests of all files, if some were written since the last note; nothing where nothing can be written."""
    with suppress(OSError):
        # another process may write a file meanwhile: named before it is read, it has another name by then
        known, named = noted(folder), {_name(file): file for file in _files(folder)}
        if named.keys() <= known.keys():
            return
        with whole(folder / DIGESTS) as part:
            digests = {name: known.get(name) or _digest(file) for name, file in named.items()}
            part.write_text(json.dumps(digests))


def _files(folder: Path) -> list[Path]:
    return [file for file in folder.glob("*/*.nb[ci]") if file.is_file()]


def _name(file: Path) -> str:
    """A file with the time at which it was written."""
    return f"{file.parent.name}/{file.name} {file.stat().st_mtime_ns}"


def _digest(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()


def noted(folder: Path) -> dict[str, str]:
    """The digests in a folder's last note."""
    try:
        known = json.loads((folder / DIGESTS).read_bytes())
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}
