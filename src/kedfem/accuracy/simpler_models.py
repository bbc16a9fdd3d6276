"""Simpler models of links that leave theirs open, where these are exact enough."""

import math
from collections.abc import Iterator

from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import (
    families,
    of_family,
    refined,
    with_links,
)
from kedfem.errors import KedfemError, SceneError
from kedfem.scene import LinkScene, Scene


def with_simpler_links(
    search: Trials, scene: Scene, left_open: list[str], allowed: float
) -> tuple[Scene, float]:
    """The scene with links made rigid, beams or plane as far as that changes little, and by how much it does.

    Allowed is what the mesh left of both shares: a simpler link is compared with the one on that mesh.
    """
    reference, error = scene, 0.0
    for name in left_open:
        for simpler in _simpler(scene.links[name], search.asked):
            trial = with_links(scene, {name: simpler})
            try:
                change = search.difference(trial, reference)
            except SceneError:  # such a model makes no sense, as one without any elastic link
                continue
            except KedfemError as fault:
                search.notes.append(f"{name}: not {simpler.model}, {str(fault).splitlines()[0]}")
                continue
            verdict = "taken" if change <= allowed else "left out"
            search.notes.append(
                f"{name}: as {_noun(simpler)} the results change by {percent(change)}, {verdict}"
            )
            if change <= allowed:
                scene, error = trial, change
                break
    return scene, error


def _simpler(link: LinkScene, asked: float) -> Iterator[LinkScene]:
    """Simpler models of a link, simplest first."""
    for family in families(link)[:-1]:
        other = of_family(link, family, reduced=True)
        if family == "beam":
            other = refined(other, math.ceil(4 / math.sqrt(asked)))
        yield other if family in {"rigid", "beam"} else refined(other, 2.0)


def _noun(link: LinkScene) -> str:
    return {"rigid": "a rigid link", "beam": "a beam", "plane": "a plane link"}.get(link.category, "a solid")
