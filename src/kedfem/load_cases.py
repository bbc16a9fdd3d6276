"""Load cases of one link at chosen instants of a run, for a static analysis of it elsewhere: decks, VTU, tables.

A results file does not hold the state of every node: the run's steps are taken again, up to the last of the instants.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.levels import in_balance, level_steps, leveled
from kedfem.errors import OutputError, SceneError
from kedfem.links.record import Link
from kedfem.output.animation import write_collection
from kedfem.output.static_decks import ELEMENTS, reactions, resultants, supports, write_case, write_deck, write_resultants
from kedfem.results import Results, read_results, ready_folder, results_file
from kedfem.results.forces.load_cases import LoadCase, Statics, load_case
from kedfem.results.table import drive_heading
from kedfem.scene import Scene, corotational, percentage, scene_from
from kedfem.stepping import Watch

OTHER = 0.01  # of the largest strain energy: what a run taken again may differ by, on another processor too
DIFFERENT = 0.01  # of the highest stress: more between run and statics is reported as a warning
OUT_OF_BALANCE = 0.01  # reactions of supports, of the largest force: more is reported as a warning


@dataclass(frozen=True, slots=True)
class LoadCases:
    """The outcome of `load_cases`.

    folder : where the files are
    link : its name
    element, nodes, elements : of the deck's mesh; the first empty where there is no deck
    cases : by instant
    left : of each what supports would bear, of the largest resultant of a kind of force [-]
    warnings : what is not as it is in the run, and why
    """

    folder: FilePath
    link: str
    element: str
    nodes: int
    elements: int
    cases: Sequence[LoadCase]
    left: Sequence[float]
    warnings: tuple[str, ...]


def load_cases(
    file: FilePath, link: str, at: Sequence[float] = (), folder: FilePath | None = None,
    watch: Watch = lambda stage, done, total: None,
) -> LoadCases:  # fmt: skip
    """Write the load cases of one link of a run at some instants.

    Parameters
    ----------
    file : `results.h5` of `kedfem run`, or the folder that has it
    link : name of a solid link with a rigid-body frame
    at : instants [s], each the nearest time step; of the link's highest stress if none is given
    folder : where all goes; `loads` beside the results if not given

    Raises
    ------
    KedfemError
        With a message for the user.
    """
    path = results_file(file)
    results = read_results(path)
    scene = scene_from(json.loads(results.scene_json), path.parent.parent)
    _refuse(scene, link)
    steps = _steps(path, results, link, at)
    known = {step // results.every * results.every for step in steps}
    watch("mesh and matrices", 0, 0)
    ready, reduction = prepared(scene)
    full = meshed(scene).model if reduction else ready.model
    k = [each.name for each in full.links].index(link)
    statics = Statics(full.links[k], supports(full.links[k]))
    found: list[LoadCase] = []
    for block in _blocks(ready, steps[-1], watch):
        here = range(block.step, block.step + len(block))
        for step in sorted(known.intersection(here)):
            _refuse_other(path, scene, results, block, step)
        for step in sorted(set(steps).intersection(here)):
            found.append(load_case(block.at(step - block.step), k, ready.model, full, statics))
    target = ready_folder(folder or path.parent / "loads")
    return _written(target, scene, full.links[k], found, results)


def _steps(path: FilePath, results: Results, link: str, at: Sequence[float]) -> list[int]:
    """The time steps of the instants."""
    if "energy/strain" not in results.channels or not len(results.time):
        raise OutputError(f"{path}: must be results of `kedfem run` with rows, got none with elastic motion")
    if not at:
        if link not in results.peaks:
            raise OutputError(f"--at: is required [s], got nothing and no highest stress of '{link}' in {path}")
        at = [results.peaks[link].time]
    time = results.instants
    first, last = float(time[0]), float(time[-1])
    step = (last - first) / max(len(time) - 1, 1)
    for t in at:
        if not first - step / 2 <= t <= last + step / 2:
            raise OutputError(f"--at: must be from {first:g} to {last:g} s, the run's time, got {t:g}")
    return sorted({int(np.abs(time - t).argmin()) for t in at})


def _refuse(scene: Scene, name: str) -> None:
    """Links whose load is none of a static analysis in three dimensions about its reference shape."""
    if name not in scene.links:
        known = ", ".join(repr(each) for each in scene.links)
        raise SceneError(f"--link: must be a link of the scene ({known}), got '{name}'")
    link, where = scene.links[name], f"links.{name}"
    if link.category != "solid":
        got = "a rigid one" if link.category == "rigid" else f"a {link.category}"
        raise SceneError(f'{where}: must be an elastic solid for load cases, got {got}: take `model = "solid"`')
    if corotational(scene):
        raise SceneError(
            "analysis.frames: must be rigid-body for load cases (a linear static analysis knows small deflections), got "
            'co-rotational ones: take `frames = "rigid-body"` where the error that this makes is small'
        )
    if scene.analysis.stiffening:
        raise SceneError(
            "analysis.stiffening: must be off for load cases (a static analysis would have to know the stress that "
            "stiffens), got true: leave it out"
        )


def _blocks(ready: Prepared, last: int, watch: Watch) -> Iterator[Block]:
    """The run again, up to a time step."""
    solvers = level_steps(ready.scene, ready.model)
    blocks = leveled(ready.scene, ready.linkage, ready.path, ready.model, solvers)
    for block in blocks if len(solvers) > 1 else in_balance(ready.scene, blocks):
        watch("steps", min(block.step + len(block), last + 1), last + 1)
        yield block
        if block.step + len(block) > last:
            return


def _refuse_other(path: FilePath, scene: Scene, results: Results, block: Block, step: int) -> None:
    """The run must be the one that wrote the results: neither files nor kedfem have changed what it finds."""
    springs = scene.springs or scene.limits or any(joint.bushing for joint in scene.joints.values())
    if springs:  # whose energy the channel counts too
        return
    strain = results.channels["energy/strain"][1][:, 0]
    again, row = sum(float(each.strain[step - block.step]) for each in block.links), step // results.every
    if abs(again - strain[row]) > OTHER * np.abs(strain).max():
        raise OutputError(
            f"{path}: must be of the scene's present files and this kedfem, got a strain energy of {strain[row]:.6g} J "
            f"at t = {results.time[row]:g} s where the same run now has {again:.6g} J: run the scene again"
        )


def _written(target: FilePath, scene: Scene, link: Link, cases: list[LoadCase], results: Results) -> LoadCases:
    element, drive = ELEMENTS.get(link.cell_type, ""), drive_heading(results.drive)
    about = {f"joint {name}": np.asarray(joint.at) for name, joint in scene.joints.items()}
    left = [_left(link, case) for case in cases]
    deck = target / f"{link.name}.inp"
    if element:
        write_deck(deck, link, scene.materials[str(scene.links[link.name].material)], cases, _head(scene, link))
    else:
        deck.unlink(missing_ok=True)  # of an earlier mesh
    files = [f"{link.name}_{number:04d}.vtu" for number in range(len(cases))]
    for name, case in zip(files, cases, strict=True):
        write_case(target / name, link, case)
    write_collection(target, link.name, [(x.time, link.name, name) for x, name in zip(cases, files, strict=True)])
    write_resultants(target / f"{link.name}.csv", link.X, cases, about, drive)
    warnings = [*_elements(link), *_balance(link.name, cases, left), *_differing(scene, link, cases)]
    counts = link.n, len(link.cells)
    return LoadCases(target, link.name, element, *counts, cases, left, tuple(warnings))


def _head(scene: Scene, link: Link) -> list[str]:
    return [
        f"Load cases of link {link.name}: {scene.title or 'kedfem'}. SI units: m, N, Pa.",
        "Axes are the world's in the reference position and rotate with the link; so do all loads.",
        "Forces at nodes are those of joints, loads, damping and inertia together, of bodies on the link too.",
    ]


def _elements(link: Link) -> Iterator[str]:
    """Where the deck's elements are not the run's, or its stresses are found in another way."""
    if link.cell_type not in ELEMENTS:
        yield (
            f"links.{link.name}.element: must be hex20, hex8 or tet10 for a deck (CalculiX has no 27-node hexahedra, and "
            'with 20 of their nodes stresses are up to 15 % off), got hex27: take `element = "hex20"` and run again; VTU '
            "and table are written"
        )
    if link.cell_type == "hexahedron":
        yield (
            f"links.{link.name}: 8-node hexahedra have kedfem's stresses in their middles; at nodes CalculiX puts what "
            "its points near the corners show, which is far off where a link bends: compare middles, or take hex20"
        )


def _balance(name: str, cases: Sequence[LoadCase], left: Sequence[float]) -> Iterator[str]:
    for case, x in zip(cases, left, strict=True):
        if x > OUT_OF_BALANCE:
            yield (
                f"at t = {case.time:g} s forces on {name} are out of balance by {percentage(x)} of the largest: take a "
                "smaller step"
            )


def _differing(scene: Scene, link: Link, cases: Sequence[LoadCase]) -> Iterator[str]:
    """Where statics under the deck's forces has other stresses than the run."""
    why = (
        "the link is reduced in the run, and whole in the deck, which has what the modes leave out too"
        if scene.links[link.name].reduced
        else "some of the link's vibrations are shorter than the step resolves: take a smaller one"
    )
    for case in cases:
        if case.differs > DIFFERENT:
            yield f"at t = {case.time:g} s statics finds stresses up to {percentage(case.differs)} off the run's: {why}"


def _left(link: Link, case: LoadCase) -> float:
    """What supports bear, of the largest force, or moment over the link's size, of what acts on the link."""
    bears = reactions(link, supports(link), case.total)
    centre, size = link.X.mean(axis=0), float(np.ptp(link.X, axis=0).max())
    every = resultants(link.X, case, dict.fromkeys(case.parts, centre)).values()
    largest = max(max(np.linalg.norm(force), np.linalg.norm(moment) / size) for _, force, moment in every)
    return float(np.abs(bears).max() / largest) if largest else 0.0
