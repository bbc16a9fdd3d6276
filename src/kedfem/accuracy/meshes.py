"""Choices for links by trial runs for a required accuracy: meshes, segments, simpler models, reduction."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from kedfem.accuracy.choices import elastic, open_step
from kedfem.accuracy.error_budget import UNKNOWNS, percent
from kedfem.accuracy.estimates import PeakStrainStates
from kedfem.accuracy.histories import histories, worst
from kedfem.accuracy.mesh_estimate import link_errors, mesh_errors
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.trials import Trials
from kedfem.accuracy.variants import families, filleted, of_family, refinable, refined, shortened, with_links
from kedfem.dynamics.model import Model, segments
from kedfem.errors import KedfemError, SceneError
from kedfem.links.build import max_segments
from kedfem.links.segments import max_slices
from kedfem.scene import Cad, Extrusion, LinkScene, MeshFile, Part, Scene, link_frames, time_grid

MESH_ORDER = 2.0  # of convergence of a mesh; lower at re-entrant edges
FACTOR, LITTLE = 2.0, 1.2  # largest and least factor by which elements become smaller at a time
FINER = (1.0, 1.5, 2.0, 3.0, 4.0)  # fineness of the meshes tried for links whose model is open
FILLETS, FINEST_FILLET = ((0.1, 45.0), (0.05, 22.5)), 15.0  # angle of an element [deg] by accuracy, and the least
COUNTS = (3, 4, 6, 8, 12, 16, 24)  # segments tried; their error falls with the square of their number
LARGE, DEAR = 4_000, 2e7  # unknowns, and their product with steps (5 s), from which links are reduced by default


def open_meshes(scene: Scene) -> list[str]:
    """Names of the elastic solid and plane links whose mesh the scene leaves open."""
    return [
        name for name, link in scene.links.items()
        if elastic(link, "solid", "plane") and "mesh" not in link.model_fields_set
        and not isinstance(link.shape, MeshFile)
    ]  # fmt: skip


def with_fillets(scene: Scene, asked: float) -> Scene:
    """The scene with fillets and free bores of CAD parts and outlines as fine as stress requires, if meshes are open."""
    angle = np.radians(next((angle for least, angle in FILLETS if asked >= least), FINEST_FILLET))
    links = scene.links.items()
    drawn = {name: link for name, link in links if isinstance(link.shape, Cad | Extrusion | Part)}
    free = {n: x for n, x in drawn.items() if x.model != "rigid" and "mesh" not in x.model_fields_set}
    finer = {name: filleted(link, float(angle)) for name, link in free.items()}
    return with_links(scene, finer) if finer else scene


def open_modes(scene: Scene) -> list[str]:
    """Names of the elastic solid and plane links whose reduction is open, if a step or a mesh is open too.

    Unreduced steps may become expensive by the choice of these.
    """
    if scene.analysis.solver == "monolithic" or not (open_step(scene) or open_meshes(scene)):
        return []
    links = scene.links.items()
    return [n for n, x in links if elastic(x, "solid", "plane") and "reduction" not in x.model_fields_set]


def with_mesh(search: Trials, scene: Scene, left_open: Sequence[str], allowed: float) -> tuple[Scene, float, float]:
    """The scene with the coarsest sufficient mesh of links whose model is open, its error, and its fineness."""
    names = [
        name for name in left_open
        if "mesh" not in scene.links[name].model_fields_set and refinable(scene.links[name])
    ]  # fmt: skip
    if not names:
        return scene, 0.0, 1.0
    ladder = [(factor, _finer(scene, names, factor)) for factor in FINER]
    pairs = zip(ladder, [None, *ladder], strict=False)  # small numbers of elements may not change
    ladder = [now for now, before in pairs if before is None or now[1].links != before[1].links]
    k, error = first_accurate(search, ladder, allowed, "finer meshes")
    return ladder[k][1], error, ladder[k][0]


def _finer(scene: Scene, names: Sequence[str], factor: float) -> Scene:
    return with_links(scene, {name: refined(scene.links[name], factor) for name in names})


def chosen_meshes(search: Trials, scene: Scene, allowed: float, auto: Sequence[str]) -> tuple[Scene, float]:
    """The scene with finer meshes of its open solid and plane links where their indicator requires them, and the error.

    Trial runs begin with the usual meshes. Elements become smaller by the ratio of the error to the allowed one, as far
    as UNKNOWNS allows.
    """
    names = [name for name in open_meshes(scene) if name not in auto and refinable(scene.links[name])]
    error = 0.0
    while names:
        ready = search.ready(shortened(scene))
        error, eta = _mesh_error(ready, names)
        unknowns = sum((link.full or link).unknowns for link in ready.model.links)
        most = (UNKNOWNS / unknowns) ** (1 / 3)
        if error <= allowed or most < LITTLE:
            break
        factor = min((error / allowed) ** (1 / MESH_ORDER), FACTOR, most)
        worst_links = [name for name in names if eta.get(name, 0.0) >= 0.3 * max(eta.values())]
        scene = _finer(scene, worst_links, factor)
    if error > allowed:
        leave = f"meshes of {unknowns:,} unknowns leave an error of {percent(error)}"
        search.notes.append(f"{leave}; finer ones are not taken unasked")
    return scene, error


def _mesh_error(ready: Prepared, names: Sequence[str]) -> tuple[float, dict[str, float]]:
    """The error of some meshes in a trial run, and η of all links."""
    strained = PeakStrainStates(ready.model)
    base = histories(ready, look=strained.add)
    eta = link_errors(ready.model, strained.indicators)
    return worst(mesh_errors(ready, base, {name: eta[name] for name in names if name in eta})), eta


def with_modes(search: Trials, scene: Scene, names: Sequence[str]) -> Scene:
    """The scene with reduced links if unreduced steps would take longer than the computation of the modes."""
    ready = search.ready(shortened(scene))
    if not names or ready.linkage.mobility:
        return scene
    unknowns = sum((link.full or link).unknowns for link in ready.model.links)
    steps = time_grid(scene).steps * (2 ** (scene.analysis.extrapolation_levels or 1) - 1)
    if unknowns < LARGE or steps * unknowns < DEAR:
        return scene
    search.notes.append(
        f"{', '.join(names)}: reduced, as {steps:,} steps of {unknowns:,} unknowns would take long; the run reports the "
        "error of that"
    )
    links = {name: scene.links[name].model_copy(update={"reduction": "modal"}) for name in names}
    return with_links(scene, links)


def open_segments(scene: Scene) -> list[str]:
    """Names of the links whose number of segments the scene leaves open."""
    return [
        name for name, link in scene.links.items()
        if link.model in {"solid", "plane"} and link.segments is None and link_frames(scene, name) == "co-rotational"
    ]  # fmt: skip


def with_segments(search: Trials, scene: Scene, allowed: float) -> tuple[Scene, float]:
    """The scene with the fewest sufficient segments, the same number in all links that are not stubby, and the error."""
    most = {name: max_segments(scene, name) for name in open_segments(scene)}
    ladder = [(count, _segmented(scene, most, count)) for count in COUNTS]
    k, error = first_accurate(search, ladder, allowed, "more segments")
    return (scene, 0.0) if error == math.inf else (ladder[k][1], error)


def first_accurate(
    search: Trials, ladder: Sequence[tuple[float, Scene]], allowed: float, finer: str
) -> tuple[int, float]:
    """Index of the first of successively finer scenes whose error is allowed, and its error.

    The difference of two scenes shows the error of the finer one; it is infinite if two cannot be compared.

    Parameters
    ----------
    ladder : fineness and scene, coarsest first
    finer : name of the refinement, for notes
    """
    error = math.inf
    for k, ((fine, now), (next_fine, better)) in enumerate(pairwise(ladder)):
        try:
            change = search.difference(now, better)
        except KedfemError as fault:
            search.balances(now)
            search.notes.append(f"{finer} could not be tried: {str(fault).splitlines()[0]}")
            return k, error
        beyond = change / ((next_fine / fine) ** MESH_ORDER - 1)
        if change + beyond <= allowed:
            return k, change + beyond
        error = beyond
        if error <= allowed:
            return k + 1, error
    leave = f"these still leave an error of {percent(error)}"
    search.notes.append(f"{finer} than those tried would be needed: {leave}")
    return len(ladder) - 1, error


def _segmented(scene: Scene, most: Mapping[str, int], count: int) -> Scene:
    """The scene with links in segments, each in no more than do not soften it."""
    links = {name: {"segments": min(count, least)} for name, least in most.items()}
    return with_links(scene, {n: scene.links[n].model_copy(update=x) for n, x in links.items()})


def stubby_warning(model: Model) -> tuple[str, ...]:
    """A warning if links have segments shorter than the link is wide, which make it too soft."""
    stubby = []
    for name, parts in segments(model).items():
        if len(parts) > 1 and parts[0].meshed:
            X = [(part.full or part).X for part in parts]
            e = X[-1].mean(axis=0) - X[0].mean(axis=0)
            if len(parts) > (most := max_slices(np.concatenate(X), e / np.linalg.norm(e))):
                stubby.append(f"{name} ({len(parts)} segments: at most {most})")
    if not stubby:
        return ()
    return (
        f"segments shorter than their link is wide make it too soft: links {', '.join(stubby)}; leave "
        "links.NAME.segments out, or give fewer",
    )


def with_simpler_links(search: Trials, scene: Scene, left_open: list[str], allowed: float) -> tuple[Scene, float]:
    """The scene with links as rigid, beams or plane as far as the results change little, and the change.

    `allowed` is the error that the mesh leaves of both shares: a simpler link is compared with that on the mesh.
    """
    reference, error = scene, 0.0
    for name in left_open:
        for simpler in _simpler(scene.links[name], search.asked):
            trial = with_links(scene, {name: simpler})
            try:
                change = search.difference(trial, reference)
            except SceneError:  # such a model is refused, as one without any elastic link
                continue
            except KedfemError as fault:
                search.notes.append(f"{name}: not {simpler.model}, {str(fault).splitlines()[0]}")
                continue
            verdict = "taken" if change <= allowed else "left out"
            nouns = {"rigid": "a rigid link", "beam": "a beam", "plane": "a plane link"}
            noun = nouns.get(simpler.category, "a solid")
            search.notes.append(f"{name}: as {noun} the results change by {percent(change)}, {verdict}")
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
