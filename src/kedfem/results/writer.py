"""Writing a results file while the analysis runs."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from shutil import copyfile
from types import TracebackType
from typing import Any, Self

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import OutputError, SolveError
from kedfem.folders import own_part
from kedfem.results.blocks import not_finite, require_channels
from kedfem.results.channels import ANGLE, TIME, Channel
from kedfem.results.dimensions import lay_dimensions
from kedfem.results.files import ready_folder, require_space, unwritable
from kedfem.results.layout import (
    ADDED,
    BETWEEN,
    CHUNK_ROWS,
    FORMAT,
    LARGEST,
    chunk_rows,
    installed_version,
    new_rows,
    opened,
    read_facts,
    refuse_another_run,
    seal,
    series,
    write_facts,
    write_text,
)
from kedfem.results.reader import read_results
from kedfem.results.thinning import Rows, Thinning

SPARE_SPACE = 1_000_000  # bytes kept for HDF5's own tables and for the status of an interrupted run


class ResultsWriter:
    """Appends rows to a results file; a context manager that shows how the run ended.

    See :mod:`kedfem.results` for what happens to an older file of the same name. Until its first rows it writes to a
    file with a name of its own; if another writer has put rows in place meanwhile, it is refused and leaves them alone.

    path : the HDF5 file; its folder is made where missing
    channels : all channels, with distinct names
    scene_json, scene_toml : the scene, stored in the file
    notes : facts about the run, stored as attributes; those about a link, by their names, as attributes of a group
    drive : name and unit of the drive's position

    Attributes: `thinning`, which time points become rows; `rows`, how many are in the file.

    Raises
    ------
    OutputError
        On entering: the folder or file cannot be written, or another run is writing it. Later: a disk error.

    Examples
    --------
    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> torque = Channel("drive/torque", ("torque",), "N m", "", "drive torque")
    >>> path = Path(folder.name) / "results.h5"
    >>> with ResultsWriter(path, [torque], "{}", None, {}) as writer:
    ...     writer.append(np.array([0.1]), np.array([1.0]), {"drive/torque": np.array([[3.0]])})
    >>> from kedfem.results import read_results
    >>> read_results(path).status
    'complete'
    >>> folder.cleanup()
    """

    def __init__(
        self,
        path: Path,
        channels: Sequence[Channel],
        scene_json: str,
        scene_toml: str | None,
        notes: Mapping[str, str | float | Mapping[str, Any]],
        drive: Channel = ANGLE,
    ) -> None:
        self.drive = drive
        self.run, self._before = "", 0
        self.path = Path(path)
        self.channels = tuple(channels)
        self.rows, self._chunk, self.thinning = 0, CHUNK_ROWS, Thinning(self.channels)
        self._scene = {"json": scene_json} | ({} if scene_toml is None else {"toml": scene_toml})
        self._notes = {name: fact for name, fact in notes.items() if not isinstance(fact, Mapping)}
        self._links = {name: facts for name, facts in notes.items() if isinstance(facts, Mapping)}
        self._part = own_part(self.path)
        self._published = False
        self._file: Any = None

    def of_run(self, run: str, steps: int) -> Self:
        """The same writer, for a run with a unique name.

        Parameters
        ----------
        steps : time points of that run whose rows are kept, and after which it goes on; 0 begins a new file
        """
        self.run, self._before = run, steps
        return self

    def thinned(self, every: int, steps: int) -> Self:
        """The same writer, which writes only each n-th time point, and the first and the last.

        For each channel it also writes what is largest of all.

        Parameters
        ----------
        steps : expected number of time points, for the allocation of space
        """
        self.thinning.every, self._chunk = every, chunk_rows(-(-steps // every) + 1)
        self._notes |= {BETWEEN: every} if every > 1 else {}
        return self

    def __enter__(self) -> Self:
        ready_folder(self.path.parent)
        refuse_another_run(self.path)
        try:
            require_space(self.path.parent, SPARE_SPACE)
            if self._before:
                self._go_on()
                return self
            self._file = opened(self._part, "x")
            self._lay_out()
        except OSError as error:
            self._discard()
            raise unwritable(self.path, error) from error
        except OutputError:
            self._discard()
            raise
        return self

    def append(
        self,
        time: Float[np.ndarray, " b"],
        angle: Float[np.ndarray, " b"],
        values: Mapping[str, Float[np.ndarray, "b c"]],
    ) -> None:
        """Take the next time points: write their rows at the end, and bring them to the disk.

        Parameters
        ----------
        time : (b,) [s]
        angle : (b,) [rad], or [m] where the drive slides
        values : channel name → (b, columns), for every channel, in its unit

        Raises
        ------
        OutputError
            The disk refused.
        SolveError
            A value is not finite: the rows before it are written.
        ValueError
            A channel is missing, unknown or of the wrong shape.
        """
        require_channels(self.channels, len(time), values)
        if (fault := not_finite(time, values)) is not None:
            row, message = fault
            if row:
                self.append(time[:row], angle[:row], {name: block[:row] for name, block in values.items()})
            raise SolveError(message)
        every = {**values, self.drive.name: angle, TIME.name: time}
        chosen, last = self.thinning.chosen(every, (TIME.name, self.drive.name))
        try:
            self._write(chosen)
            if not self._published:
                self._publish()
        except (OSError, RuntimeError) as error:
            raise unwritable(self.path, error) from error
        self.thinning.last = last

    def _write(self, rows: Rows) -> None:
        """More rows of all channels, those of time last."""
        count = len(rows.get(TIME.name, ()))
        if not count:
            return
        width = 2 + sum(len(channel.columns) for channel in self.channels)  # in whole chunks
        require_space(self.path.parent, 8 * width * self._chunk * (count // self._chunk + 2) + SPARE_SPACE)
        for name, block in rows.items():
            found = self._file[name]
            found.resize(self.rows + count, axis=0)
            found[self.rows :] = np.reshape(block, (count, *found.shape[1:]))
        self._file.flush()
        self.rows += count

    def note(self, notes: Mapping[str, str | float]) -> None:
        """Store more facts about the run, e.g. those that are known only at its end."""
        try:
            write_facts(self._file["notes"], notes)
            seal(self._file)
        except OSError as error:
            raise unwritable(self.path, error) from error

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._end("complete", "")
            elif self._published:
                self._end("interrupted", f"{kind.__name__}: {error}".removesuffix(": "))
            else:
                self._discard()
        except (OSError, RuntimeError) as fault:
            if kind is None:
                raise unwritable(self.path, fault) from fault

    def _lay_out(self) -> None:
        """The empty file: scene, notes, one extendable dataset per channel with its units and dimensions."""
        began = {"status": "running", "reason": "", "run": self.run}
        write_facts(self._file, {"format": FORMAT, "kedfem_version": installed_version(), **began})
        scene = self._file.create_group("scene")
        for key, text in self._scene.items():
            write_text(scene, key, text)
        notes = self._file.create_group("notes")
        write_facts(notes, self._notes)
        for name, facts in self._links.items():
            write_facts(notes.create_group(name), facts)
        for index, channel in enumerate((TIME, self.drive, *self.channels)):
            width = (len(channel.columns),) if len(channel.columns) > 1 else ()
            rows = new_rows(self._file, channel.name, width, self._chunk)
            said = {"unit": channel.unit, "frame": channel.frame, "description": channel.description}
            write_facts(rows, said | {"columns": list(channel.columns) or [channel.name], "index": index})
        lay_dimensions(self._file, self.drive, self.channels)
        seal(self._file)

    def _go_on(self) -> None:
        """Take the first rows of this run's own file; it stays as it is until its shortened copy takes its place."""
        before = read_results(self.path)
        require_space(self.path.parent, self.path.stat().st_size + SPARE_SPACE)
        copyfile(self.path, self._part)
        self._file = opened(self._part, "r+")
        self.thinning.steps = self._before
        kept = self.thinning.rows
        found = series(self._file)
        names = {f"/{each.name}" for each in (TIME, self.drive, *self.channels)}
        own = read_facts(self._file).get("run") == self.run and set(found) == names
        if not own or len(before.time) < kept:
            wanted = f"{self.path}: must hold the {kept} rows of the run to be resumed"
            raise OutputError(f"{wanted}, got another run's or fewer; run without --resume")
        for name in ADDED:
            self._file.pop(name, None)
        for name in found:
            self._file[name].resize(kept, axis=0)
        write_facts(self._file["notes"], self._notes)
        write_facts(self._file, {"status": "running", "reason": ""})
        seal(self._file)
        self.rows = kept
        self._publish()

    def _publish(self) -> None:
        """Put the new file in the old one's place; closed meanwhile: not every system renames open files."""
        self._file.close()
        refuse_another_run(self.path)
        self._part.replace(self.path)
        self._published = True
        self._file = opened(self.path, "r+")

    def _end(self, status: str, why: str) -> None:
        """Close the file with all channels cut to the rows that were written completely."""
        if not self._file:  # stopped while it was being put in place
            self._file = opened(self.path, "r+")
        try:
            self._write(self.thinning.last or {})
        except (OSError, RuntimeError, OutputError):
            if status == "complete":
                raise
        for channel in (TIME, self.drive, *self.channels):
            self._file[channel.name].resize(self.rows, axis=0)
        for name, rows in self.thinning.largest.items():
            write_facts(self._file[name], {LARGEST: rows.ravel()})
        write_facts(self._file, {"reason": why, "status": status})
        seal(self._file)
        if not self._published:
            self._publish()
        self._file.close()

    def _discard(self) -> None:
        """Remove a file that has no rows yet."""
        if self._file:
            self._file.close()
        self._part.unlink(missing_ok=True)
