"""All points of a sweep on a pool of processes, except points that an earlier sweep finished."""

import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path as FilePath
from typing import Any

from kedfem.errors import KedfemError, OutputError, SceneError
from kedfem.processes import BLAS_THREADS, end_with_parent
from kedfem.results import claimed
from kedfem.scene import scene_from
from kedfem.scene.questions.timing import scene_speed
from kedfem.stepping import Watch
from kedfem.sweep.axes import Axis, with_values
from kedfem.sweep.edges import Edge, edges, refuse_without_growth, with_middles, write_edges
from kedfem.sweep.files import ROWS, STATES, keep_row, kept_row, write_sweep, write_table
from kedfem.sweep.neighbours import Continuation, Ends, refuse_without_order
from kedfem.sweep.plot import write_plot
from kedfem.sweep.points import BaseScene, Job, Row, SharedChoices, chosen_by_plan, finished, refuse_thinned

AHEAD = 2  # points in the queue of each worker, so that none is idle
ONE_THREAD = dict.fromkeys((*BLAS_THREADS, "NUMBA_NUM_THREADS"), "1")


@dataclass(frozen=True, slots=True)
class SweepOptions:
    """Options of a sweep.

    last : revolutions of the drive whose extremes are evaluated
    workers : number of processes; if None, the number of cores that this one may use
    quick : defaults for open choices of the scene, instead of a plan
    keep : whether the files of each run are kept
    edges : relative width to which edges of unstable bands are found along the first key; None: no edges
    follow : whether the search for a steady motion starts from that of the previous point along the first key
    """

    last: float = 1.0
    workers: int | None = None
    quick: bool = False
    keep: bool = False
    edges: float | None = None
    follow: bool = False


@dataclass(frozen=True, slots=True)
class SweepResult:
    """The outcome of a sweep: a row for each point, in the order of the axes' values.

    before : rows that an earlier sweep had finished
    planned : the point whose plan all points use; None without a plan
    edges : of unstable bands; empty if none were asked for
    """

    folder: FilePath
    axes: tuple[Axis, ...]
    rows: tuple[Row, ...]
    before: int
    planned: int | None
    edges: tuple[Edge, ...] = ()


def sweep_folder(base: BaseScene) -> FilePath:
    """The default folder of a sweep: beside the scene."""
    return base.folder / f"{base.stem}-sweep"


def sweep(
    base: BaseScene, axes: Sequence[Axis], asked: SweepOptions, folder: FilePath | None = None,
    watch: Watch = lambda stage, done, total: None, executor: Executor | None = None,
) -> SweepResult:  # fmt: skip
    """Run a scene at all points; finished rows are kept, so that the same sweep continues where it was stopped.

    Parameters
    ----------
    folder : `sweep_folder` if not given
    executor : runs the points instead of a pool of processes of this machine

    Raises
    ------
    KedfemError
        The scene is invalid, the folder cannot be written, a worker was killed; the failure of a point is in its row.
    """
    if not asked.last > 0:
        raise SceneError(f"--last: must be positive, got {asked.last:g}")
    if asked.workers is not None and asked.workers < 1:
        raise SceneError(f"--workers: must be at least 1, got {asked.workers}")
    if asked.quick:
        analysis = {**base.raw.get("analysis", {}), "accuracy": "quick"}
        base = replace(base, raw={**base.raw, "analysis": analysis})
    scene = scene_from(base.raw, base.folder, stem=base.stem)  # raises its own faults, before those of points
    refuse_thinned(scene, asked.keep)
    if asked.edges is not None:
        refuse_without_growth(scene, axes[0], asked.edges)
    if asked.follow:
        refuse_without_order(scene, asked.edges is not None)
    with claimed(folder or sweep_folder(base), (ROWS, STATES)) as target:
        chosen, planned = _planned(base, axes, watch)
        shared = chosen or SharedChoices()  # without a common plan no modes are shared
        jobs = [Job(base, values, shared, asked.last) for values in _points(axes)] if chosen else []
        following = Continuation.along(axes) if asked.follow else Continuation()
        point = _Points(base, shared, asked, target, Ends.among(jobs), following)
        rows: dict[int, Row] = {}
        axes, found, pool = list(axes), list[Edge](), executor
        try:
            while True:
                waiting = point.waiting(axes, rows)
                pool = pool or _pool(asked.workers, len(waiting))
                _run(waiting, rows, point, watch, pool)
                if asked.edges is None:
                    break
                found = list(edges(axes, rows))
                if not (wide := [each for each in found if each.width > asked.edges and not each.unknown]):
                    break
                axes = with_middles(axes, wide)
            _end(pool, kill=False)
        except BaseException:
            if pool is not None:
                _end(pool, kill=True)
            raise
        finally:
            order = sorted(rows)
            done, every = [axis.at(order) for axis in axes], [rows[k] for k in order]
            write_sweep(target / "sweep.h5", done, every, asked.last)
            write_table(target / "sweep.csv", done, every)
            write_plot(target / "sweep.png", done, every, found)
            if asked.edges is not None:
                write_edges(target / "edges.csv", axes, found)
    return SweepResult(target, tuple(axes), tuple(every), point.before, planned, tuple(found))


@dataclass
class _Points:
    """The points of a sweep: those with a row of an earlier sweep, and those that are still to be run.

    before : rows that an earlier sweep had finished
    """

    base: BaseScene
    chosen: SharedChoices
    asked: SweepOptions
    target: FilePath
    ends: Ends
    following: Continuation
    before: int = 0

    def waiting(self, axes: Sequence[Axis], rows: dict[int, Row]) -> dict[int, tuple[str, Job]]:
        """Points without a row, with their digests; rows of earlier sweeps and of invalid scenes are added to `rows`."""
        out: dict[int, tuple[str, Job]] = {}
        for k, values in enumerate(_points(axes)):
            if k in rows:
                continue
            job = Job(self.base, values, self.chosen, self.asked.last)
            try:
                job = replace(job, ends=() if self.asked.keep else self.ends.of(job))
                name = self.following.named(k, job.identity())
            except SceneError as error:
                rows[k] = Row("failed", str(error))
                continue
            own = self.target / "runs" / f"{k:05d}" if self.asked.keep else None
            kept = kept_row(self.target, name)
            if kept is not None and (own is None or (own / "results.h5").exists()):
                rows[k] = kept
                self.before += 1
            else:
                out[k] = name, replace(job, folder=own)
        return out


def _points(axes: Sequence[Axis]) -> Iterator[dict[Any, Any]]:
    for values in zip(*(axis.values for axis in axes), strict=True):
        yield {axis.where: value for axis, value in zip(axes, values, strict=True)}


def _planned(base: BaseScene, axes: Sequence[Axis], watch: Watch) -> tuple[SharedChoices | None, int | None]:
    """Choices for all points, by the plan of the point with the fastest drive, the first of several.

    None where accuracies or models of links are swept: each point has a plan of its own.
    """
    points, speeds, wanted = list(_points(axes)), dict[int, float](), set[tuple[object, ...]]()
    for k, values in enumerate(points):
        try:
            scene = scene_from(with_values(base.raw, values), base.folder, stem=base.stem)
        except SceneError:
            continue
        speeds[k] = scene_speed(scene)
        wanted.add((scene.analysis.accuracy, *(link.model for link in scene.links.values())))
    if len(wanted) > 1:
        return None, None
    for k in sorted(speeds, key=lambda k: -speeds[k]):
        scene = scene_from(with_values(base.raw, points[k]), base.folder, stem=base.stem)
        try:
            chosen = chosen_by_plan(scene, lambda name: watch(name, 0, 0))
        except KedfemError:
            continue  # its row says why
        return chosen, k if chosen.analysis else None
    return SharedChoices(), None


def _run(
    waiting: Mapping[int, tuple[str, Job]], rows: dict[int, Row], point: _Points, watch: Watch, pool: Executor
) -> None:
    """Run the waiting points, in any order, but none before the point that it follows."""
    left, total, target = dict(waiting), len(rows) + len(waiting), point.target
    pending: dict[Future[Row], int] = {}
    most = AHEAD * (getattr(pool, "_max_workers", 0) or os.cpu_count() or 1)
    try:
        watch("points", len(rows), total)
        while True:
            due = (k for k in left if point.following.due(k, rows))
            for k in list(islice(due, most - len(pending))):
                _, job = left.pop(k)
                pending[pool.submit(finished, point.following.started(k, job, target))] = k
            if not pending:
                break
            _keep(wait(pending, return_when=FIRST_COMPLETED).done, pending, waiting, rows, point)
            watch("points", len(rows), total)
    except BrokenExecutor as error:
        raise OutputError(
            f"{target}: a worker process must not end before its point is done, got one that was killed, by a lack of "
            f"memory perhaps; {len(rows)} of {total} points are kept: start again to go on, with fewer --workers"
        ) from error
    except BaseException:
        _keep({each for each in pending if each.done()}, pending, waiting, rows, point)
        raise


def _keep(
    done: set[Future[Row]], pending: dict[Future[Row], int], waiting: Mapping[int, tuple[str, Job]],
    rows: dict[int, Row], point: _Points,
) -> None:  # fmt: skip
    """Write the rows of finished points to the disk."""
    for each in done:
        k = pending.pop(each)
        try:
            rows[k] = point.following.kept(k, each.result(), point.target)
        except BrokenExecutor:
            raise
        except Exception as error:  # noqa: BLE001 - as libraries of clusters have them
            rows[k] = Row("failed", f"its worker was lost: {type(error).__name__}: {error}")
            continue
        keep_row(point.target, waiting[k][0], rows[k])


def _end(pool: Executor, kill: bool) -> None:
    from joblib.externals.loky.process_executor import ProcessPoolExecutor

    if isinstance(pool, ProcessPoolExecutor):
        pool.shutdown(wait=True, kill_workers=kill)
    else:
        pool.shutdown(wait=True, cancel_futures=kill)


def _pool(workers: int | None, points: int) -> Executor:
    """Processes of this machine, with one thread each."""
    from joblib.externals.loky import cpu_count
    from joblib.externals.loky.process_executor import ProcessPoolExecutor

    count = max(1, min(workers or cpu_count(), points))
    pool: Executor = ProcessPoolExecutor(count, initializer=_begin, env=ONE_THREAD)
    return pool


def _begin() -> None:
    """A worker ignores Ctrl-C, which its parent handles, and ends with its parent."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
