"""How many segments solid and plane links with co-rotational frames need for an accuracy, by trial runs."""

from itertools import pairwise

from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import with_links
from kedfem.errors import KedfemError
from kedfem.scene import Scene, link_frames

COUNTS = (3, 4, 6, 8, 12, 16, 24)  # tried
ORDER = 2.0  # the error falls with the square of the number: what bends within a segment is seen from its mean frame


def open_segments(scene: Scene) -> list[str]:
    """Names of the links whose number of segments the scene leaves open."""
    return [
        name for name, link in scene.links.items()
        if link.fidelity in {"solid", "plane"} and link.segments is None and link_frames(scene, name) == "co-rotational"
    ]  # fmt: skip


def with_segments(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the fewest segments whose error is allowed, the same number in all links, and that error."""
    names, error = open_segments(scene), 0.0
    for count, more in pairwise(COUNTS):
        now, finer = (_segmented(scene, names, each) for each in (count, more))
        try:
            change = search.difference(now, finer)
        except KedfemError as fault:
            search.notes.append(f"more segments could not be tried: {str(fault).splitlines()[0]}")
            return (now if count > COUNTS[0] else scene), error
        beyond = change / ((more / count) ** ORDER - 1)
        if change + beyond <= allowed:
            return now, change + beyond
        if beyond <= allowed:
            return finer, beyond
        error = beyond
    search.notes.append(f"as many as {COUNTS[-1]} segments still leave an error of {error:.2g}")
    return _segmented(scene, names, COUNTS[-1]), error


def _segmented(scene: Scene, names: list[str], count: int) -> Scene:
    return with_links(
        scene, {name: scene.links[name].model_copy(update={"segments": count}) for name in names}
    )
