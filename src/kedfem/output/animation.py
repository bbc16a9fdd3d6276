"""The ParaView animation: a VTU file per link and frame, and a PVD file that lists them as named blocks."""

import os
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from html import escape
from itertools import count
from pathlib import Path

from kedfem.errors import OutputError
from kedfem.folders import PART
from kedfem.output.fields import Block
from kedfem.output.vtu import write_blocks
from kedfem.processes import threads
from kedfem.results.files import ready_folder, reason, replacing

HEAD = b'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
TAIL = b"  </Collection>\n</VTKFile>\n"  # of a PVD file


class AnimationWriter:
    """Writer of frames; each frame and the list of frames are complete at any time.

    The first frame removes the frames of an earlier run with the same stem, and nothing else.

    folder : folder of ``STEM.pvd``, and of the folder ``STEM`` with ``NAME_0000.vtu``, ``NAME_0001.vtu``, … of each link
    stem : first part of the names
    drive : name of the drive's position with its unit; empty without a drive
    """

    REMEMBERED = ("entries", "count")

    def __init__(self, folder: Path, stem: str, drive: str = "") -> None:
        self.folder, self.stem, self.drive = Path(folder), stem, drive
        self.entries: list[Entry] = []
        self.count = 0
        self._listed = -1

    @property
    def missing(self) -> Path | None:
        """A frame that was written and no longer exists."""
        return next((path for _, _, name in self.entries if not (path := self.folder / name).is_file()), None)

    def add(self, time: float, fields: Sequence[Block], angle: float = 0.0) -> list[Path]:
        """Write the next frame, at a time [s] and a position of the drive [rad or m]; returns its VTU files."""
        if not self.count:
            remove_animation(self.folder, self.stem)
        now = {"TimeValue": float(time)} | ({self.drive: float(angle)} if self.drive else {})
        files = [f"{self.stem}/{name}_{self.count:04d}.vtu" for name in _file_names(fields)]

        def write(k: int) -> None:
            with replacing(self.folder / files[k]) as part:
                write_blocks(part, now, [fields[k]], k)

        # most of the time goes into compression, which releases Python's lock
        with ThreadPoolExecutor(threads()) as pool:
            list(pool.map(write, range(len(fields))))
        blocks = [(float(time), field.name, name) for field, name in zip(fields, files, strict=True)]
        self.entries += blocks
        self.count += 1
        path = self.folder / f"{self.stem}.pvd"
        if not self._extended(path, _rows(blocks)):  # writing the whole list for each of n frames would take n² rows
            write_collection(self.folder, self.stem, self.entries)
        self._listed = path.stat().st_size
        return [self.folder / name for name in files]

    def _extended(self, path: Path, more: bytes) -> bool:
        """Insert rows before the end of this writer's list if it is unchanged; returns whether that was possible."""
        with suppress(OSError), path.open("r+b", buffering=0) as file:
            if file.seek(0, os.SEEK_END) == self._listed:
                end = file.seek(-len(TAIL), os.SEEK_END)
                if file.write(more + TAIL) == len(more + TAIL):
                    return True
                file.truncate(file.seek(end))  # the disk is full
                file.write(TAIL)
        return False


Entry = tuple[float, str, str]  # of a list of frames: time [s], name of the block, file beside the list


def write_collection(folder: Path, stem: str, entries: Sequence[Entry]) -> None:
    """Write the PVD file ``STEM.pvd``, which lists VTU files with their times."""
    with replacing(folder / f"{stem}.pvd") as part:
        part.write_bytes(HEAD + _rows(entries) + TAIL)


def read_collection(path: Path) -> list[tuple[float, list[Path]]]:
    """Frames that a PVD file lists, in its order: time [s] and the existing files of its blocks.

    Raises
    ------
    OutputError
        The file is damaged.
    """
    import xml.etree.ElementTree as ET

    out: dict[float, list[Path]] = {}
    try:
        for each in ET.parse(path).iter("DataSet"):
            file = (path.parent / each.attrib["file"]).resolve()
            if file.is_relative_to(path.parent.resolve()) and file.exists():
                out.setdefault(float(each.attrib["timestep"]), []).append(file)
    except (ET.ParseError, KeyError, ValueError, OSError) as error:
        raise OutputError(f"{path}: must be a list of frames, got a damaged file") from error
    return list(out.items())


def _file_names(fields: Sequence[Block]) -> list[str]:
    """Different file names for all blocks, whatever characters their own names have."""
    out: list[str] = []
    for field in fields:
        name = re.sub(r"[^A-Za-z0-9.-]", "_", field.name)
        same = (f"{name}{k}" if k else name for k in count())
        out.append(next(x for x in same if x.lower() not in {y.lower() for y in out}))
    return out


def remove_animation(folder: Path, stem: str) -> None:
    """Delete the animation of an earlier run: ``STEM.pvd``, and complete or partial frames in the folder ``STEM``.

    Raises
    ------
    OutputError
        The folder cannot be written, or a file in it cannot be removed.
    """
    ready_folder(folder)
    frame, inside = re.compile(r".+_\d{4,}\.vtu"), folder / stem
    try:
        (folder / f"{stem}.pvd").unlink(missing_ok=True)
        if not inside.is_dir():
            return
        for path in inside.iterdir():
            if frame.fullmatch(path.name) or PART.fullmatch(path.name):
                path.unlink()
        if not any(inside.iterdir()):
            inside.rmdir()
    except OSError as error:
        got = f"{Path(error.filename).name} that cannot be removed ({reason(error)})"
        raise OutputError(f"{folder}: must be free of the frames of an earlier run, got {got}") from error


def _rows(entries: Sequence[Entry]) -> bytes:
    """Rows of the PVD file; parts of one time are numbered."""
    rows, last, part = [], None, 0
    for time, name, file in entries:
        part, last = (part + 1 if time == last else 0), time
        at = f'timestep="{time!r}" part="{part}" name="{escape(name)}" file="{escape(file)}"'
        rows.append(f"    <DataSet {at}/>\n")
    return "".join(rows).encode()
