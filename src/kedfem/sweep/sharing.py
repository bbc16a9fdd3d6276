"""Points of a sweep whose reduced links are the same: those that differ in the drive's speed and in damping alone.

Modes are found for the fastest and the slowest of them, and serve those in between.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from kedfem.accuracy.shared_modes import alike
from kedfem.errors import SceneError, Where
from kedfem.scene.questions.timing import scene_speed
from kedfem.sweep.axes import Value
from kedfem.sweep.points import Job

FEWEST = 3  # points for which sharing saves something

Values = Mapping[Where, Value]


@dataclass(frozen=True, slots=True)
class Ends:
    """Of points that are alike the values of the fastest and of the slowest, by what they have in common."""

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
        """Those that a point shares its modes with; none if it has its own.

        Raises
        ------
        SceneError
            With all faults of its scene.
        """
        return self.by.get(alike(job.scene()) or "", ()) if self.by else ()


def _fastest_and_slowest(points: Sequence[tuple[float, Values]]) -> tuple[Values, ...]:
    fastest, slowest = max(points, key=lambda each: each[0]), min(points, key=lambda each: each[0])
    return (fastest[1],) if fastest[0] == slowest[0] else (fastest[1], slowest[1])
