"""What an accuracy chooses for solid and plane links by trial runs: their meshes, and whether they are reduced."""

from collections.abc import Sequence

import numpy as np

from kedfem.accuracy.choices import elastic, open_step
from kedfem.accuracy.error_budget import UNKNOWNS, percent
from kedfem.accuracy.estimates import Strained
from kedfem.accuracy.histories import histories, worst
from kedfem.accuracy.mesh_estimate import link_errors, mesh_errors
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import filleted, refinable, refined, shortened, with_links
from kedfem.scene import Cad, Extrusion, MeshFile, Part, Scene, time_grid

MESH_ORDER = 2.0  # at which the error of a mesh falls; at edges that point inwards it does worse
FACTOR, LITTLE = 2.0, 1.2  # by which elements are made smaller in one go: at most, and at least
FILLETS, FINEST_FILLET = ((0.1, 45.0), (0.05, 22.5)), 15.0  # degrees an element turns, by accuracy
LARGE, DEAR = 4_000, 2e7  # unknowns, and their product with steps (5 s), from which links are reduced unasked


def open_meshes(scene: Scene) -> list[str]:
    """Names of the elastic solid and plane links whose mesh it leaves open."""
    return [
        name for name, link in scene.links.items()
        if (elastic(link, "solid") or elastic(link, "plane")) and "mesh" not in link.model_fields_set
        and not isinstance(link.shape, MeshFile)
    ]  # fmt: skip


def with_fillets(scene: Scene, asked: float) -> Scene:
    """The scene with fillets and free bores of CAD parts and outlines as fine as stress needs, where meshes are open."""
    angle = np.radians(next((angle for least, angle in FILLETS if asked >= least), FINEST_FILLET))
    links = {
        name: filleted(link, float(angle))
        for name, link in scene.links.items()
        if isinstance(link.shape, Cad | Extrusion | Part)
        and link.model != "rigid"
        and "mesh" not in link.model_fields_set
    }
    return with_links(scene, links) if links else scene


def open_modes(scene: Scene) -> list[str]:
    """Names of the elastic solid and plane links that do not say whether they are reduced, where a step or a mesh is open
    too: what is chosen for these makes unreduced steps dear."""
    if scene.analysis.solver == "monolithic" or not (open_step(scene) or open_meshes(scene)):
        return []
    return [
        name
        for name, link in scene.links.items()
        if (elastic(link, "solid") or elastic(link, "plane")) and not link.model_fields_set & {"reduction"}
    ]


def chosen_meshes(search: Trials, scene: Scene, allowed: float, auto: Sequence[str]) -> tuple[Scene, float]:
    """The scene with finer meshes of its open solid and plane links where their indicator asks for it, and the error.

    Trial runs, on the usual meshes first: elements are made smaller by what the error is beyond the allowed one, as far
    as the UNKNOWNS allow.
    """
    names = [name for name in open_meshes(scene) if name not in auto and refinable(scene.links[name])]
    error = 0.0
    while names:
        ready = search.ready(shortened(scene))
        error, eta = _mesh_error(ready, names)
        unknowns = sum((link.full or link).unknowns for link in ready.model.links)
        room = (UNKNOWNS / unknowns) ** (1 / 3)
        if error <= allowed or room < LITTLE:
            break
        factor = min((error / allowed) ** (1 / MESH_ORDER), FACTOR, room)
        worst_links = [name for name in names if eta.get(name, 0.0) >= 0.3 * max(eta.values())]
        scene = with_links(scene, {name: refined(scene.links[name], factor) for name in worst_links})
    if error > allowed:
        search.notes.append(
            f"meshes of {unknowns:,} unknowns leave an error of {percent(error)}; finer ones are not taken unasked"
        )
    return scene, error


def _mesh_error(ready: Prepared, names: Sequence[str]) -> tuple[float, dict[str, float]]:
    """The error that some meshes cause in a trial run, and the indicators of all."""
    strained = Strained(ready.model)
    base = histories(ready, look=strained.add)
    eta = link_errors(ready.model, strained.indicators)
    return worst(mesh_errors(ready, base, {name: eta[name] for name in names if name in eta})), eta


def distinct(meshes: list[tuple[float, Scene]]) -> list[tuple[float, Scene]]:
    """Without those that are like the one before: few elements become more by whole numbers only."""
    pairs = zip(meshes, [None, *meshes], strict=False)
    return [now for now, before in pairs if before is None or now[1].links != before[1].links]


def with_modes(search: Trials, scene: Scene, names: Sequence[str]) -> Scene:
    """The scene with links on modes where all its unreduced steps would take longer than to find these."""
    ready = search.ready(shortened(scene))
    if not names or ready.linkage.mobility:
        return scene
    unknowns = sum((link.full or link).unknowns for link in ready.model.links)
    steps = time_grid(scene).steps * (2 ** (scene.analysis.extrapolation_levels or 1) - 1)
    if unknowns < LARGE or steps * unknowns < DEAR:
        return scene
    search.notes.append(
        f"{', '.join(names)}: reduced, as {steps:,} steps of {unknowns:,} unknowns would take long; the run reports what "
        "that costs"
    )
    links = {name: scene.links[name].model_copy(update={"reduction": "modal"}) for name in names}
    return with_links(scene, links)
