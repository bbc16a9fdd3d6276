"""Sharing between points of a sweep: the steady motion found before, and the modes of reduced links.

Continuation: the search for a steady motion starts from that of the previous point, along the first key in the order of
its values, while the other keys are the same. A nonlinear scene may have several steady motions at one speed; the
direction of the sweep then determines which of them is found.

Points that differ only in the drive's speed and in damping share their reduced links: modes are computed for the fastest
and the slowest of them, and used for those in between.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path as FilePath

from kedfem.accuracy.prepared import alike
from kedfem.errors import SceneError, Where
from kedfem.scene import Scene
from kedfem.scene.questions.timing import scene_speed
from kedfem.sweep.axes import Axis, Value
from kedfem.sweep.files import keep_state, kept_state
from kedfem.sweep.points import Job, Row

FEWEST = 3  # points for which sharing modes saves something

Values = Mapping[Where, Value]


def refuse_without_order(scene: Scene, edges: bool) -> None:
    """Refuse continuation without steady motions, or where the points have no order."""
    if scene.analysis.kind != "steady":
        raise SceneError(
            "--follow: must be combined with analysis.kind = 'steady', whose search starts from the motion of the "
            f"previous point, got kind = {scene.analysis.kind!r}"
        )
    if edges:
        raise SceneError("--follow: must be without --edges, whose points lie between others")


@dataclass
class Continuation:
    """The previous point of each point, and the names of their rows, which depend on all points before.

    before : number of a point → that of the previous point; None for the first of a line
    """

    before: Mapping[int, int | None] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)

    @classmethod
    def along(cls, axes: Sequence[Axis]) -> "Continuation":
        """Along the first key."""
        last: dict[tuple[Value, ...], int] = {}
        before: dict[int, int | None] = {}
        for k in range(len(axes[0].values)):
            line = tuple(axis.values[k] for axis in axes[1:])
            before[k] = last.get(line)
            last[line] = k
        return cls(before)

    def named(self, k: int, own: str) -> str:
        """The name of a point's row; `own` without continuation."""
        if k not in self.before:
            return own
        last = self.before[k]
        before = "" if last is None else self.names.get(last, "")
        self.names[k] = sha256(f"{own} after {before}".encode()).hexdigest()
        return self.names[k]

    def due(self, k: int, rows: Mapping[int, Row]) -> bool:
        """Whether the previous point is finished."""
        last = self.before.get(k)
        return last is None or last in rows

    def started(self, k: int, job: Job, target: FilePath) -> Job:
        """The job of a point, with the state from which its search starts."""
        if k not in self.before:
            return job
        last = self.before[k]
        near = None if last is None else kept_state(target, self.names.get(last, ""))
        return replace(job, follows=True, near=near)

    def kept(self, k: int, row: Row, target: FilePath) -> Row:
        """A row without the state for the next point, which is written to the disk."""
        if row.begun is not None and k in self.names:
            keep_state(target, self.names[k], row.begun)
        return replace(row, begun=None)


@dataclass(frozen=True, slots=True)
class Ends:
    """Values of the fastest and of the slowest point of each group with common reduced links."""

    by: Mapping[str, tuple[Values, ...]] = field(default_factory=dict)

    @classmethod
    def among(cls, jobs: Sequence[Job]) -> "Ends":
        """Of all points of a sweep; those whose scene is invalid are left out."""
        groups: dict[str, list[tuple[float, Values]]] = {}
        for job in jobs:
            try:
                scene = job.scene()
            except SceneError:
                continue
            if (name := alike(scene)) is not None:
                groups.setdefault(name, []).append((abs(scene_speed(scene)), job.values))
        return cls({name: _fastest_and_slowest(each) for name, each in groups.items() if len(each) >= FEWEST})

    def of(self, job: Job) -> tuple[Values, ...]:
        """The points with which a point shares its modes; none if it has its own."""
        return self.by.get(alike(job.scene()) or "", ()) if self.by else ()


def _fastest_and_slowest(points: Sequence[tuple[float, Values]]) -> tuple[Values, ...]:
    fastest, slowest = max(points, key=lambda each: each[0]), min(points, key=lambda each: each[0])
    return (fastest[1],) if fastest[0] == slowest[0] else (fastest[1], slowest[1])
