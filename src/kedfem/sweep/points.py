"""One point of a sweep: the scene with its values, its run, and its row: extremes of the last revolutions."""

import json
import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

from kedfem.accuracy.plan import plan_for
from kedfem.accuracy.prepared import Neighbours
from kedfem.accuracy.trials import Stage
from kedfem.analysis import analyse
from kedfem.arrays import Float
from kedfem.dynamics.system.period.map import StateArrays
from kedfem.errors import Fault, KedfemError, SceneError, Where, place
from kedfem.motion.assembly import assembled
from kedfem.results import Results
from kedfem.results.forces.loads import rms
from kedfem.resume import origin
from kedfem.scene import Scene, revolution_steps, scene_from, time_grid
from kedfem.sweep.axes import Value, with_values

SETTLED = 0.01  # largest relative difference of the last two revolutions
NOTHING = 1e-6  # of the largest channel with the same unit: what is rounding in a channel that should be zero
MAGNITUDE = "magnitude"
SUMS = "energy/"  # channels that add up over the run: they have no extremes of a revolution
STRESS = "stress/{}/peak"
GROWTH, MARCHES = "steady/growth", "steady/marches"
STATUSES = ("complete", "unreliable", "failed")

Extreme = tuple[float, float, float, float]
"""Maximum, minimum, root of the mean square, time [s] of the largest magnitude."""


@dataclass(frozen=True, slots=True)
class BaseScene:
    """A scene as it is written: keys and values, the folder of its files, its name."""

    raw: Mapping[str, Any]
    folder: FilePath
    stem: str


@dataclass(frozen=True, slots=True)
class SharedChoices:
    """Choices of one plan for all points, for the analysis and for links by name."""

    analysis: Mapping[str, Any] = field(default_factory=dict)
    links: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def applied(self, scene: Scene) -> Scene:
        """A scene with these choices."""
        chosen, every = self.links, scene.links.items()
        links = {name: link.model_copy(update=dict(chosen.get(name, {}))) for name, link in every}
        analysis = scene.analysis.model_copy(update=dict(self.analysis))
        return scene.model_copy(update={"links": links, "analysis": analysis})


@dataclass(frozen=True, slots=True)
class Job:
    """A point to be run in another process, in plain records.

    values : key → value
    last : revolutions whose extremes are evaluated
    folder : where the run's files are kept; None if they are not
    ends : values of the points with which it shares its reduced links; empty if it has its own
    follows : whether the search for its steady motion starts from that of the previous point, and its own is kept
    near : the state at the beginning of that motion; None without a previous point, or if it failed
    """

    base: BaseScene
    values: Mapping[Where, Value]
    chosen: SharedChoices
    last: float
    folder: FilePath | None = None
    ends: tuple[Mapping[Where, Value], ...] = ()
    follows: bool = False
    near: StateArrays | None = None

    def scene(self) -> Scene:
        """The scene of this point; a SceneError has all its faults."""
        raw = with_values(self.base.raw, self.values)
        return self.chosen.applied(scene_from(raw, self.base.folder, stem=self.base.stem))

    def identity(self) -> str:
        """Digest of all that the row depends on: values, scene, its files, kedfem's version, revolutions."""
        content = {k: v for k, v in origin(self.scene()).items() if not k.startswith("output.folder")}
        shared = [sorted((place(where), value) for where, value in each.items()) for each in self.ends]
        parts = [content, self.last, *([shared] if shared else [])]
        return sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Row:
    """The row of one point of a sweep.

    status : ``complete``, ``unreliable`` or ``failed``
    message : why it failed or is unreliable, else empty
    change : relative, between the last two revolutions; nan without two
    seconds : duration of the run
    extremes : name of a column → unit, (maximum, minimum, root of the mean square, time [s] of the largest magnitude)
    begun : the state at the beginning of its steady motion, if the next point starts from it; not part of its text
    """

    status: str
    message: str = ""
    change: float = math.nan
    seconds: float = 0.0
    extremes: Mapping[str, tuple[str, Extreme]] = field(default_factory=dict)
    begun: StateArrays | None = field(default=None, compare=False, repr=False)

    @property
    def settled(self) -> str:
        """``yes``, ``no``, or ``unknown`` without two revolutions."""
        return "unknown" if math.isnan(self.change) else "yes" if self.change <= SETTLED else "no"

    def text(self) -> str:
        """As JSON."""
        content = asdict(replace(self, begun=None))
        del content["begun"]
        return json.dumps(content)

    @classmethod
    def read(cls, text: str) -> "Row":
        """From JSON; a ValueError, KeyError or TypeError of another text, or of a status of an earlier kedfem."""
        content = json.loads(text)
        if content["status"] not in STATUSES:
            raise ValueError(f"a status {content['status']!r}")
        found: dict[str, tuple[str, Extreme]] = {}
        for name, (unit, (most, least, mean, when)) in content.pop("extremes").items():
            found[name] = unit, (float(most), float(least), float(mean), float(when))
        return cls(**content, extremes=found)


def chosen_by_plan(scene: Scene, stage: Stage) -> SharedChoices:
    """The choices of one point's plan, which all other points use too."""
    before, _ = assembled(scene)
    plan = plan_for(before, stage)
    if plan is None:
        return SharedChoices()
    every = plan.scene.links.items()
    links = {name: _different(dict(before.links[name]), dict(link)) for name, link in every}
    return SharedChoices(_different(dict(before.analysis), dict(plan.scene.analysis)), links)


def _different(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in after.items() if value != before.get(key)}


def finished(job: Job) -> Row:
    """The row of a point; its message has the reason of any failure."""
    began = perf_counter()
    try:
        row = _ran(job)
    except KedfemError as error:
        row = Row("failed", str(error))
    except Exception as error:  # noqa: BLE001 - a defect at one point must not cost the others
        row = Row("failed", f"internal error: {type(error).__name__}: {error}")
    return replace(row, seconds=perf_counter() - began)


def refuse_thinned(scene: Scene, keep: bool) -> None:
    """Refuse to keep files of thinned runs: a sweep finds extremes in the rows of all steps."""
    if keep and scene.output.every > 1:
        message = "must be 1 for files that stay (--keep): a sweep finds extremes in the rows of all steps"
        raise SceneError([Fault(("output", "every"), f"{message}, got {scene.output.every}")])


def _ran(job: Job) -> Row:
    scene = job.scene()
    refuse_thinned(scene, job.folder is not None)
    since = _since(scene, job.last)
    with ExitStack() as stack:
        folder = job.folder or FilePath(stack.enter_context(TemporaryDirectory(prefix="kedfem-sweep-")))
        update: dict[str, Any] = {"folder": str(folder.absolute())}
        if job.folder is None:
            update["every"] = 1  # extremes are of all steps
            update |= dict.fromkeys(("csv", "parquet", "plots", "picture", "report"), False)
            update["animation"] = None
        output = scene.output.model_copy(update=update)
        quiet = scene.model_copy(update={"output": output, "fatigue": None})
        run = analyse(quiet, stresses_since=since, beside=Neighbours(_ends(job), job.near))
        results = run.results
    found = extremes(results, since)
    for name, peak in run.peaks.items():
        found[STRESS.format(name)] = ("Pa", (peak.stress, math.nan, math.nan, peak.time))
    turn, unknown = revolution_steps(scene), (math.nan,) * 3
    if run.steady is not None:
        if run.steady.growth is not None:
            found[GROWTH] = ("1", (run.steady.growth, *unknown))
        begun = run.begun if job.follows else None
        found[MARCHES] = ("1", (float(run.steady.marches), *unknown))
        return Row(results.status, results.reason, run.steady.residual, extremes=found, begun=begun)
    settled = change(results, turn * time_grid(scene).step) if turn else math.nan
    return Row(results.status, results.reason, settled, extremes=found)


_ENDS: dict[str, tuple[Scene, ...]] = {}
"""The last scenes of this process whose reduced links are shared."""


def _ends(job: Job) -> tuple[Scene, ...]:
    """Scenes, as they are analysed, with which a point shares its reduced links."""
    if not job.ends:
        return ()
    name = Job(job.base, {}, job.chosen, 0.0, None, job.ends).identity()
    if name not in _ENDS:
        _ENDS.clear()
        _ENDS[name] = tuple(assembled(replace(job, values=values).scene())[0] for values in job.ends)
    return _ENDS[name]


def _since(scene: Scene, last: float) -> float:
    """The time [s] after which extremes count, between two steps; before the start without revolutions of the drive, and
    where the analysis is a single period or independent positions."""
    turn, grid = revolution_steps(scene), time_grid(scene)
    if turn is None or scene.analysis.kind != "transient":
        return -0.5 * grid.step
    if last * turn > grid.steps + 0.5:
        message = f"must be at most the {grid.steps / turn:.3g} revolutions that are run, got {last:g}"
        raise SceneError(f"--last: {message}")
    return grid.end - (last * turn - 0.5) * grid.step


def extremes(results: Results, since: float) -> dict[str, tuple[str, Extreme]]:
    """Extremes of every column after a time [s], by name with unit; of vectors also of their magnitude."""
    late = int(np.argmax(results.time > since))
    begun = max(late - 1, 0)  # where the first interval of the mean begins
    t, some = results.time[begun:], np.arange(begun, len(results.time))
    return {name: (unit, _four(t, values, late - begun)) for name, unit, values in columns(results, some)}


def _four(t: Float[np.ndarray, " n"], values: Float[np.ndarray, " n"], begins: int) -> Extreme:
    late = values[begins:]
    return float(late.max()), float(late.min()), rms(t, values), float(t[begins + np.abs(late).argmax()])


def columns(results: Results, some: np.ndarray) -> Iterator[tuple[str, str, Float[np.ndarray, " n"]]]:
    """Name, unit and values of every column at some of the rows; energies and works are left out."""
    for name, (channel, values) in results.channels.items():
        if name.startswith(SUMS):
            continue
        rows = values[some]
        for k, column in enumerate(channel.columns):
            yield f"{name}/{column}", channel.unit, rows[:, k]
        if channel.vector:
            yield f"{name}/{MAGNITUDE}", channel.unit, np.sqrt((rows**2).sum(axis=1))


def change(results: Results, turn: float) -> float:
    """Largest relative difference between the largest magnitudes of the last revolution [s] and of the previous one.

    Channels that are negligible beside others of the same unit are left out; nan without two revolutions.
    """
    end = float(results.time[-1])
    half = 0.5 * float(results.time[-1] - results.time[-2])
    if end < 2 * turn - half:
        return float("nan")
    last = results.time > end - turn + half
    before = (results.time > end - 2 * turn + half) & ~last
    now, then = (
        {name: (unit, np.abs(values).max()) for name, unit, values in columns(results, some)} for some in (last, before)
    )
    largest: dict[str, float] = {}
    for unit, size in (*now.values(), *then.values()):
        largest[unit] = max(largest.get(unit, 0.0), size)
    pairs = ((unit, size, then[name][1]) for name, (unit, size) in now.items())
    changes = [abs(a - b) / max(a, b) for unit, a, b in pairs if max(a, b) > NOTHING * largest[unit]]
    return float(max(changes, default=0.0))
