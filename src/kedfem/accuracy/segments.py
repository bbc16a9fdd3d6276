"""How many segments solid and plane links with co-rotational frames need for an accuracy, by trial runs."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import with_links
from kedfem.dynamics.model import Model, segments
from kedfem.errors import KedfemError
from kedfem.links.build import most_segments
from kedfem.links.segments import most_slices
from kedfem.scene import Scene, link_frames

COUNTS = (3, 4, 6, 8, 12, 16, 24)  # tried
ORDER = 2.0  # the error falls with the square of the number: what bends within a segment is seen from its mean frame


def open_segments(scene: Scene) -> list[str]:
    """Names of the links whose number of segments the scene leaves open."""
    return [
        name for name, link in scene.links.items()
        if link.model in {"solid", "plane"} and link.segments is None and link_frames(scene, name) == "co-rotational"
    ]  # fmt: skip


def with_segments(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the fewest segments whose error is allowed, the same number in all links that are not stubby, and
    that error."""
    most = {name: most_segments(scene, name) for name in open_segments(scene)}
    error = 0.0
    for count, more in pairwise(COUNTS):
        now, finer = (_segmented(scene, most, each) for each in (count, more))
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
    search.notes.append(f"as many as {COUNTS[-1]} segments still leave an error of {percent(error)}")
    return _segmented(scene, most, COUNTS[-1]), error


def _segmented(scene: Scene, most: Mapping[str, int], count: int) -> Scene:
    """Links in segments, none in more than do not soften it."""
    links = {
        name: scene.links[name].model_copy(update={"segments": min(count, least)})
        for name, least in most.items()
    }
    return with_links(scene, links)


def stubby_warning(model: Model) -> tuple[str, ...]:
    """A warning of links that are cut into slices shorter than they are wide, which soften them."""
    stubby = []
    for name, parts in segments(model).items():
        if len(parts) > 1 and parts[0].meshed:
            X = [(part.full or part).X for part in parts]
            e = X[-1].mean(axis=0) - X[0].mean(axis=0)
            if len(parts) > (most := most_slices(np.concatenate(X), e / np.linalg.norm(e))):
                stubby.append(f"{name} ({len(parts)} segments: at most {most})")
    if not stubby:
        return ()
    return (
        f"segments shorter than their link is wide make it too soft: links {', '.join(stubby)}; leave "
        "links.NAME.segments out, or give fewer",
    )
