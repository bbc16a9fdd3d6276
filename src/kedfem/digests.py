"""Digests by which changed bytes are noticed before anything is made of them.

Of content: it is kept behind its digest. Of a folder of files that others write and read, so that changed ones go: numba
reads what it compiled by unpickling and linking it, where a flipped bit would end in a library's error, or worse.
"""

import json
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from kedfem.folders import whole

DIGESTS = "digests.json"
_LENGTH = sha256().digest_size


def sealed(content: bytes) -> bytes:
    """Content behind its digest."""
    return sha256(content).digest() + content


def unsealed(whole: bytes) -> bytes | None:
    """The content that was sealed; None if any byte is another."""
    digest, content = whole[:_LENGTH], whole[_LENGTH:]
    return content if sha256(content).digest() == digest else None


def drop_changed(folder: Path) -> None:
    """Remove the files of a folder's own folders that are not as `note` found them; those written since stay."""
    known = _known(folder)
    for file in _files(folder) if known else ():
        with suppress(OSError):
            if known.get(_name(file), digest := _digest(file)) != digest:
                file.unlink()


def note(folder: Path) -> None:
    """Write the digests of all files, if some were written since the last note; nothing where nothing can be written."""
    with suppress(OSError):
        # another process may write a file meanwhile: named before it is read, it has another name by then
        known, named = _known(folder), {_name(file): file for file in _files(folder)}
        if named.keys() <= known.keys():
            return
        with whole(folder / DIGESTS) as part:
            part.write_text(
                json.dumps({name: known.get(name) or _digest(file) for name, file in named.items()})
            )


def _files(folder: Path) -> list[Path]:
    return [file for file in folder.glob("*/*.nb[ci]") if file.is_file()]


def _name(file: Path) -> str:
    """A file with the time at which it was written."""
    return f"{file.parent.name}/{file.name} {file.stat().st_mtime_ns}"


def _digest(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()


def _known(folder: Path) -> dict[str, str]:
    try:
        known = json.loads((folder / DIGESTS).read_bytes())
    except (OSError, ValueError):
        return {}
    return known if isinstance(known, dict) else {}
