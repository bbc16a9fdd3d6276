"""Layout of a results file in HDF5, and detection of damage to it.

Numbers have HDF5's checksum (Fletcher's), its tables those of the layout of HDF5 1.8 and later. HDF5 has no checksums for
texts: their digest is stored beside them.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Float, UInt8
from kedfem.results.files import unwritable

FORMAT = 4  # version of the file's layout
CACHED = 2**18  # bytes of chunks of each series: some chunks; HDF5 would hold 8 MB of each that is open
# rows of a chunk: tens of kilobytes for the widest channel, little waste for the shortest run
CHUNK_ROWS = 512
MANY, MOST_CHUNK_ROWS = 100_000, 4096  # rows from which on chunks are larger, as HDF5 keeps a list of them; and how large
PEAKS, WARNINGS, TIMING, FATIGUE = "peaks", "warnings", "timing", "fatigue"
ADDED = (PEAKS, WARNINGS, TIMING, FATIGUE)  # groups that are written after the rows
BETWEEN, LARGEST = "steps between rows", "largest_rows"  # a note, and an attribute of channels, of files without all
OF_CHANNELS, OF_NOTES = "digest_of_channels", "digest_of_notes"
CHECKSUM = 4  # bytes of a chunk


def opened(path: Path, mode: str, locking: bool | str = "best-effort") -> Any:
    """The file, locked against a second writer if the disk supports locks; OSError with the reason of HDF5."""
    import h5py

    return h5py.File(path, mode, locking=locking, libver=("v108", "v110"), rdcc_nbytes=CACHED)


def refuse_another_run(path: Path) -> None:
    """OutputError if a run is writing a file, which must not be replaced then."""
    try:
        if path.is_dir():
            raise IsADirectoryError(21, "a folder of that name")
        if path.exists():
            opened(path, "r").close()
    except (BlockingIOError, IsADirectoryError) as error:
        raise unwritable(path, error) from error
    except OSError:
        return  # not readable as results: it will be replaced


def opened_to_read(path: Path) -> Any:
    """The file, whether or not a run is writing it."""
    try:
        return opened(path, "r", False)  # the run holds the lock
    except OSError:
        return opened(path, "r")  # HDF5 wants equal locking flags where the run is this same process


def installed_version() -> str:
    """The version of kedfem, or ``unknown`` where it runs without being installed."""
    try:
        return metadata.version("kedfem")
    except metadata.PackageNotFoundError:
        return "unknown"


def chunk_rows(expected: int) -> int:
    """Rows per chunk for an expected number of rows: at most that number, and larger chunks for very many rows."""
    return CHUNK_ROWS if CHUNK_ROWS <= expected <= MANY else min(max(expected, 1), MOST_CHUNK_ROWS)


def new_rows(file: Any, name: str, width: tuple[int, ...], chunk: int = CHUNK_ROWS) -> Any:
    """An empty dataset of rows that can grow, with checksums."""
    return file.create_dataset(name, (0, *width), "f8", maxshape=(None, *width), chunks=(chunk, *width), fletcher32=True)


def write_facts(item: Any, facts: Mapping[str, Any]) -> None:
    """Store facts as attributes, texts at fixed length: HDF5 may read damaged ones of variable length for ever."""
    for key, value in facts.items():
        if isinstance(value, str):
            data = _encoded(value)
            item.attrs.create(key, data, dtype=_text_type(len(data)))
        elif isinstance(value, list):
            every = [_encoded(each) for each in value]
            item.attrs.create(key, every, dtype=_text_type(max(map(len, every))))
        else:
            item.attrs[key] = value


def write_text(group: Any, key: str, text: str) -> None:
    """Store a text as a dataset, as an attribute is limited to 64 kB."""
    data = _encoded(text)
    group.create_dataset(key, data=data, dtype=_text_type(len(data)))


def write_texts(group: Any, key: str, texts: Sequence[str]) -> None:
    """Store texts as a dataset of variable length, as readers of netCDF expect names."""
    import h5py

    group.create_dataset(key, data=np.array(texts, object), dtype=h5py.string_dtype())


def read_facts(item: Any) -> dict[str, Any]:
    """The attributes of an item as Python's own texts and numbers, and lists of texts.

    Those by which HDF5 joins rows to dimensions are left alone: they are references of variable length.
    """
    attributes, facts = item.attrs, {}
    for key in attributes:
        of = attributes.get_id(key)  # opened once: h5py itself takes several times as long
        if of.dtype.kind not in "OV":
            value = np.empty(of.shape, of.dtype)
            of.read(value)
            facts[key] = _plain(value[()])
    return facts


def read_text(item: Any) -> str:
    """The text of a dataset."""
    return str(_plain(item[()]))


def _encoded(value: str) -> bytes:
    return value.encode("utf-8", "surrogateescape")


def _text_type(length: int) -> Any:
    import h5py

    return h5py.string_dtype("utf-8", max(length, 1))


def _plain(value: Any) -> Any:
    if isinstance(value, bytes):
        return value.decode("utf-8", "surrogateescape")
    if isinstance(value, np.ndarray) and value.dtype.kind in "SO":
        return [_plain(each) for each in value]
    return value.item() if isinstance(value, np.generic) else value


def series(file: Any) -> list[str]:
    """Names of all datasets that carry a unit; each takes 0.1 MB while it is open."""
    found: list[str] = []

    def keep(_: str, item: Any) -> None:
        if "unit" in item.attrs:
            found.append(item.name)

    file.visititems(keep)
    return found


def all_rows(rows: Any, n: int) -> Float[np.ndarray, "n ..."]:
    """The first rows of a dataset, a frozen array.

    Raises
    ------
    OSError
        Numbers are not those that were written.
    ValueError
        The list of chunks is not: HDF5 has no checksum of it, and a wrong one leaves gaps, also where it
        says that rows begin with the file, or checks nothing.
    """
    size = rows.dtype.itemsize * int(np.prod(rows.chunks)) + CHECKSUM
    for first in range(0, len(rows), rows.chunks[0]):
        chunk = rows.id.get_chunk_info_by_coord((first,) + (0,) * (rows.ndim - 1))
        if not chunk.byte_offset or (chunk.size, chunk.filter_mask) != (size, 0):
            raise ValueError(f"rows of {rows.name} that are not those that were written")
    values: np.ndarray = rows[:n]
    values.flags.writeable = False
    return values


def seal(file: Any) -> None:
    """Store the digests of the file's present texts; those of channels and scene are written once."""
    if OF_CHANNELS not in file.attrs:
        file.attrs[OF_CHANNELS] = _digest(_channel_texts(file))
    file.attrs[OF_NOTES] = _digest(_note_texts(file))


def sealed(file: Any) -> bool:
    """Whether the texts are unchanged since they were sealed."""
    digests = {OF_CHANNELS: _channel_texts(file), OF_NOTES: _note_texts(file)}
    return all(np.array_equal(file.attrs[name], _digest(texts)) for name, texts in digests.items())


def _digest(texts: Iterable[str]) -> UInt8[np.ndarray, "32"]:
    digest = sha256()
    for text in texts:
        digest.update(sha256(text.encode("utf-8", "surrogateescape")).digest())
    return np.frombuffer(digest.digest(), np.uint8)


def _channel_texts(file: Any) -> Iterator[str]:
    """Facts of the channels, and the scene, in an order of its own."""
    for key in sorted(file["scene"]):
        yield f"{key} = {read_text(file['scene'][key])}"
    for name in sorted(series(file)):
        yield from _said(name, file[name])


def _note_texts(file: Any) -> Iterator[str]:
    """Facts of the run."""
    yield from _said("", file)
    yield from _said("notes", file["notes"])
    for name in sorted(file["notes"]):
        yield from _said(name, file["notes"][name])
    for name in ADDED:
        if name in file:
            yield from _all_said(file[name])


def _all_said(group: Any) -> Iterator[str]:
    """Of a group and all groups in it."""
    yield from _said(group.name, group)
    for name in sorted(group):
        yield from _all_said(group[name])


def _said(where: str, item: Any) -> Iterator[str]:
    for key, value in sorted(read_facts(item).items()):
        if isinstance(value, str | list):
            yield f"{where} {key} = {value}"
