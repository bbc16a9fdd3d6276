"""The time steps of a run, with rows to the results file, frames to the animation, and restart states."""

from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from time import perf_counter
from typing import Any, TypeVar

import numpy as np

from kedfem.accuracy.estimates import ErrorMonitor, error_monitor
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.singular import SingularPasses
from kedfem.accuracy.step_estimate import StepErrorMonitor, StepEstimate
from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Block, Snapshot
from kedfem.dynamics.model import mesh_methods, segments
from kedfem.dynamics.stepping.levels import leveled
from kedfem.dynamics.stepping.marks import Marks
from kedfem.dynamics.system.steps import Steps
from kedfem.errors import OutputError
from kedfem.links.recovery import StressRecovery
from kedfem.output.animation import AnimationWriter
from kedfem.output.derived import ONE_FILE, STEM, fields, remove_derived
from kedfem.output.fields import JointField
from kedfem.output.frames import joint_field, link_fields
from kedfem.output.vtkhdf import AnimationFile
from kedfem.results import Channel, ResultsWriter
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.modelled import link_facts
from kedfem.results.recorded import Recorded, drive_channel
from kedfem.results.recording import rows
from kedfem.results.stresses.envelope import Envelope
from kedfem.results.table import drive_heading
from kedfem.resume import Keeper, remove_state
from kedfem.scene import Scene, revolution_steps, time_grid

ROWS, SECONDS = 4096, 0.5  # steps, or time, after which they go to the results file
AHEAD, HELD = 16, 100e6  # instants, and bytes of them, that wait to be drawn as frames while steps go on

T = TypeVar("T")
Watch = Callable[[str, int, int], None]
"""Called as a run proceeds: (stage, done, total)."""


def frame_steps(scene: Scene) -> Int[np.ndarray, " f"]:
    """Numbers of the time steps that become animation frames."""
    animation, grid = scene.output.animation, time_grid(scene)
    if animation is None:
        return np.zeros(0, int)
    turn = revolution_steps(scene) or float(grid.steps)
    last = animation.last_revolutions
    first = 0.0 if last is None else max(0.0, grid.steps - last * turn)
    count = int((grid.steps - first) * animation.frames_per_revolution / turn + 1e-9)
    steps = grid.steps - np.arange(count, -1, -1) * turn / animation.frames_per_revolution
    return np.unique(np.clip(np.round(steps), 0, grid.steps).astype(int))


@dataclass(frozen=True, slots=True)
class Watched:
    """What is evaluated at each step: channels, the indeterminate ones with the reason, efforts, stresses.

    stresses_since : time [s] before which they do not count as highest
    kept_since : time [s] from which on their history is kept
    """

    recorded: list[Recorded]
    indeterminate: dict[str, str]
    efforts: CrossChecks
    recoveries: list[StressRecovery]
    passes: SingularPasses
    stresses_since: float = -np.inf
    kept_since: float = np.inf


Marched = tuple[Envelope, ErrorMonitor, StepEstimate]
"""What the steps of a run leave: extremes of stress, and what they show of errors."""


def stepped(ready: Prepared, solvers: list[Steps], watched: Watched,
             folder: FilePath, watch: Watch, keeper: Keeper | None = None,
             ) -> Marched:  # fmt: skip
    """All time steps: rows to the results file, frames to the animation; also what the steps show of errors.

    A keeper stores states on the disk, and may have one to go on from.
    """
    scene, model, steps = ready.scene, ready.model, time_grid(ready.scene).steps
    shown = _Frames.of(ready, watched.recoveries, folder)
    envelope = Envelope(model, watched.recoveries, watched.stresses_since, watched.kept_since)
    seen = error_monitor(ready, solvers)
    errors = StepErrorMonitor(ready, watched.recorded, seen.running)
    channels = [each.channel for each in watched.recorded]
    notes, drive = _notes(ready, watched), drive_channel(scene)
    writer = ResultsWriter(folder / "results.h5", channels, scene.model_dump_json(), scene.source, notes, drive)
    writer.thinned(scene.output.every, steps + 1)
    marks = Marks.of(len(solvers), keeper is not None)
    memories = {
        "marks": marks, "frames": shown.frames, "envelope": envelope, "seen": seen, "errors": errors,
        "efforts": watched.efforts, "account": watched.efforts.account, "passes": watched.passes, "rows": writer.thinning,
    }  # fmt: skip
    memories |= {"one file": shown.one} if shown.one else {}
    if keeper is not None:
        keeper.prepared(ready)
        keeper.put_back(memories)
        refuse_without(shown.frames, shown.one)
    for each in solvers:
        each.watch = lambda marched: watch(f"steady motion: march {marched} over a period", 0, 0)
    with writer.of_run(keeper.run, keeper.steps) if keeper else writer, closing(shown):
        table = _Table(writer, channels, folder)
        if not (keeper and keeper.steps):
            watch("start", 0, 0)
        try:
            for block in leveled(scene, ready.linkage, ready.path, model, solvers, marks):
                if block.fine or not block.levels:
                    envelope.add(block)
                if block.fine:
                    continue
                values = rows(watched.recorded, block)
                table.add(block, values)
                watched.efforts.add(block, values)
                watched.passes.add(block)
                seen.add(block)
                errors.add(block, values)
                shown.add(block, values)
                watch("steps", block.step + len(block) - 1, steps)
                if keeper is not None and keeper.due(envelope.waits):
                    shown.finish()
                    table.flush()
                    keeper.keep(writer.thinning.steps, memories)
        finally:
            table.flush()
            writer.note(errors.estimate.notes)
    envelope.flush()
    return envelope, seen, errors.estimate


def _notes(ready: Prepared, watched: Watched) -> dict[str, str | float | Mapping[str, Any]]:
    """What a run says of itself before its first step."""
    model = ready.model
    notes: dict[str, str | float | Mapping[str, Any]] = {
        "unknowns": model.unknowns,
        "step [s]": time_grid(ready.scene).step,
    }
    corotational = {name: parts for name, parts in segments(model).items() if parts[0].fit is not None}
    notes |= {f"segments of {name}": len(parts) for name, parts in corotational.items()}
    notes |= {f"mesh of {name}": method for name, method in mesh_methods(model).items()}
    notes |= {f"not reported: {name}": reason for name, reason in watched.indeterminate.items()}
    return notes | link_facts(ready.scene, ready.linkage, model)


@dataclass
class _Frames:
    """The animation: a list of files, and one file if that is wanted; drawn by a thread while steps go on.

    wanted : steps that are frames
    """

    ready: Prepared
    recoveries: list[StressRecovery]
    frames: AnimationWriter
    one: AnimationFile | None
    wanted: set[int]
    _thread: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))
    _waiting: deque[Future[None]] = field(default_factory=deque)

    @classmethod
    def of(cls, ready: Prepared, recoveries: list[StressRecovery], folder: FilePath) -> "_Frames":
        """Of a scene, before its first step."""
        scene = ready.scene
        named, animation = drive_heading(drive_channel(scene)), scene.output.animation
        one = AnimationFile(folder / ONE_FILE, named) if animation is not None and animation.vtkhdf else None
        frames = AnimationWriter(folder, STEM, named if scene.driven else "")
        return cls(ready, recoveries, frames, one, set(frame_steps(scene).tolist()))

    def add(self, block: Block, values: dict[str, Float[np.ndarray, "T c"]]) -> None:
        """The frames among the time points of a block, with what joints exert; an error of an earlier one comes here."""
        scene, model = self.ready.scene, self.ready.model
        ahead = min(AHEAD, max(1, int(HELD / (8 * 10 * model.unknowns))))
        for k in (k for k in range(len(block)) if block.step + k in self.wanted):
            self.finish(ahead - 1)
            joints = joint_field(scene, self.ready.linkage, block.motion, values, k)
            self._waiting.append(self._thread.submit(self._draw, block.at(k).copied(), joints))

    def _draw(self, now: Snapshot, joints: JointField | None) -> None:
        scene, model = self.ready.scene, self.ready.model
        exerted = [joints] if joints else []
        self.frames.add(now.t, [*fields(scene, model, self.recoveries, now), *exerted], now.phi)
        if self.one is not None:
            drawn = link_fields(model, self.recoveries, now, 0.0, scene)
            self.one.add(now.t, now.phi, [*drawn, *exerted])

    def finish(self, but: int = 0) -> None:
        """Wait for the frames that were begun, but for so many."""
        while len(self._waiting) > but:
            self._waiting.popleft().result()

    def close(self) -> None:
        """Wait for the last frame; where one failed, for none of those after it."""
        try:
            self.finish()
        finally:
            self._thread.shutdown(cancel_futures=True)


def refuse_without(*writers: AnimationWriter | AnimationFile | None) -> None:
    """A run goes on only where the frames that it wrote are still there."""
    for missing in (writer.missing for writer in writers if writer):
        if missing is not None:
            raise OutputError(
                f"{missing}: must be there, with its frames, to resume the run that wrote it, got less; run without "
                "--resume"
            )


@dataclass
class _Table:
    """Rows that wait for the results file, but the first: with those an earlier run's frames, pictures and table go."""

    writer: ResultsWriter
    channels: list[Channel]
    folder: FilePath
    waiting: int = 0
    since: float = 0.0
    when: list[Float[np.ndarray, "2 T"]] = field(default_factory=list)
    values: list[dict[str, Float[np.ndarray, "T c"]]] = field(default_factory=list)

    def add(self, block: Block, values: dict[str, Float[np.ndarray, "T c"]]) -> None:
        """More rows."""
        self.when.append(np.stack([block.motion.t, block.motion.phi]))
        self.values.append(values)
        self.waiting += len(block)
        if self.waiting >= ROWS or perf_counter() - self.since >= SECONDS:
            self.flush()

    def flush(self) -> None:
        """Bring the rows to the disk."""
        if self.when:
            time, angle = np.concatenate(self.when, axis=1)
            block = {c.name: np.concatenate([each[c.name] for each in self.values]) for c in self.channels}
            self.when, self.values, self.waiting, self.since = [], [], 0, perf_counter()
            first = self.writer.rows == 0
            self.writer.append(time, angle, block)
            if first:
                remove_derived(self.folder)
                remove_state(self.folder)


@dataclass
class Clock:
    """Seconds of each stage, whose name is passed to `watch` when it begins."""

    watch: Watch
    seconds: dict[str, float] = field(default_factory=dict)
    _name: str = ""
    _since: float = 0.0

    def stage(self, name: str, words: str = "") -> None:
        """End the running stage and begin the next, reported in its own words if there are any."""
        now = perf_counter()
        if self._name:
            self.seconds[self._name] = now - self._since
        self._name, self._since = name, now
        if name:
            self.watch(words or name, 0, 0)

    def timed(self, name: str, work: Callable[[], T], words: str = "") -> T:
        """Do the work of one stage."""
        self.stage(name, words)
        out = work()
        self.stage("")
        return out
