"""Scenes from files and dictionaries: expressions evaluated, patterns written out, all faults reported at once."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from kedfem.errors import Fault, SceneError
from kedfem.scene.checks import cross_faults
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.checks.links import ELEMENTS, meshing_faults
from kedfem.scene.checks.parts import Entry, scene_parts
from kedfem.scene.checks.values import bare_numbers
from kedfem.scene.questions.modelling import default_frames, unsupported
from kedfem.scene.questions.timing import states_step, time_grid, without_vibration
from kedfem.scene.read.files import file_faults, inside, outside, toml_table
from kedfem.scene.read.including import KEY, toml_text, with_includes
from kedfem.scene.read.parameters import with_expressions
from kedfem.scene.read.patterns import in_pattern, steep_faults, with_patterns
from kedfem.scene.read.placing import Placement
from kedfem.scene.read.rigid_links import with_rigid_bodies
from kedfem.scene.read.tables import with_tables
from kedfem.scene.records.base import Record, plain
from kedfem.scene.records.joints import ChosenFace
from kedfem.scene.records.links import LinkScene
from kedfem.scene.records.materials import BUILT_IN, Material
from kedfem.scene.records.points import NO_PLACE, UNPLACED, XYZ, known_points
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.shapes import with_kind
from kedfem.scene.records.wording import one_of

T = TypeVar("T", bound=Record)
MOST_STEPS = 1e9  # of an analysis: days of computing, and more rows than fit on a disk


def read_scene(path: str | Path, *, sketch: bool = False, within: bool = False) -> Scene:
    """A scene from its TOML file.

    Parameters
    ----------
    path : the scene file; file names in it are relative to its folder
    sketch : whether elastic links may lack shape and material, which suffices for their rigid-body motion
    within : whether all files that it names, and its results, must be in its own folder, for scenes from others

    Raises
    ------
    SceneError
        All faults of the file or of the scene in it.
    """
    path = Path(path)
    raw, text = read_keys(path, within=within)
    return _scene(raw, path.parent, source=text, stem=path.stem, sketch=sketch)


def read_keys(path: Path, *, within: bool = False) -> tuple[dict[str, Any], str]:
    """Keys and values of a scene file, with its includes, and their text; parameters and errors as of `read_scene`."""
    folder = path.parent
    found, text = toml_table(path)
    raw = with_includes(found, folder, path, lambda each: not within or inside(folder, each.absolute()))
    if within and (faults := outside(raw, folder)):
        raise SceneError(faults)
    return raw, toml_text(raw) if KEY in found else text


def scene_from(
    raw: Mapping[str, Any], folder: str | Path = ".", *, source: str | None = None, stem: str = "scene"
) -> Scene:
    """A scene from a dictionary with the keys of a scene file.

    Parameters
    ----------
    raw : keys and values, units as in a file; records of this package may stand for tables
    folder : folder to which file names are relative
    source : text of the file from which it comes
    stem : name of the scene, for its results

    Raises
    ------
    SceneError
        All faults of the scene.
    """
    return _scene(raw, Path(folder), source=source, stem=stem)


def _scene(raw: Mapping[str, Any], folder: Path, *, source: str | None, stem: str, sketch: bool = False) -> Scene:
    try:
        raw = with_includes(raw, folder) if isinstance(raw, Mapping) and KEY in raw else raw
        scene = raw if isinstance(raw, Scene) and raw.checked else validated(raw, folder, sketch=sketch)
    except RecursionError:
        wanted = "must not be nested, nor have points that are constructed from each other, hundreds deep"
        raise SceneError(f"the scene: {wanted}, got more") from None
    scene._source, scene._folder, scene._stem = source, folder, stem
    return scene


def validated(given: Any, folder: Path, *, sketch: bool = False) -> Scene:
    """A scene from its raw keys and values.

    Parameters
    ----------
    given : keys and values as in a file; records of this package may stand for tables
    folder : folder to which file names are relative
    sketch : whether elastic links may lack shape and material

    Raises
    ------
    SceneError
        All faults of the scene.
    """
    written = plain(given)
    if not isinstance(written, Mapping):
        raise SceneError(f"must be a table of keys, got {written!r}")
    raw, wrong, echoes = with_expressions(written, Scene)
    repeated, (raw, more, origins) = raw.get("patterns"), with_patterns(raw, Scene)
    wrong, bare = wrong + more, raw
    placement = Placement(raw.get("points"), raw.get("joints"))
    points = {name: placement[name] for name in placement if not name.startswith("joints.")}
    raw, faults = with_tables(_completed(raw), folder, Scene)
    faults = placement.faults + faults
    if (raw.get("drive") is not None or raw.get("drives")) and raw.get("joints", {}) == {}:
        faults.append(Fault(("joints",), "is required with a drive, got nothing"))
    with known_points(placement):
        raw = with_rigid_bodies(raw)
        try:
            scene = Scene.model_validate(_prepared(raw, points))
        except ValidationError as error:
            scene, faults = None, faults + record_faults(error, Scene, raw)
        parts = scene_parts(raw, scene, folder, sketch)
    faults += [*cross_faults(parts), *file_faults(parts)]
    if scene is not None and not wrong + faults:
        faults = steep_faults(scene.links, repeated)
    if scene is None or wrong + faults:
        places = echoes.union(each.where for each in wrong)
        rest = [each for each in faults if each.where not in places]
        if any(each.where[0] == "points" for each in rest):  # faults of other points would repeat these
            rest = [each for each in rest if each.message != NO_PLACE]
        raise SceneError(in_pattern(each, origins) for each in [*wrong, *rest])
    if (steps := time_grid(scene).steps) > MOST_STEPS:
        raise SceneError([Fault(("analysis",), f"must end within {MOST_STEPS:.0e} steps, got {steps:.3g}")])
    if (
        states_step(scene) or without_vibration(scene) or scene.analysis.accuracy == "quick"
    ):  # otherwise a plan chooses the steps
        refuse_few_rows(scene)
    scene._unit_warnings, scene._as_given, scene._checked = tuple(bare_numbers(bare, Scene)), written, True
    if scene.analysis.frames is None:
        scene.analysis.fill(frames=default_frames(bool(scene.driven_joints)))
    return scene


def refuse_few_rows(scene: Scene) -> None:
    """Raise a SceneError if `output.every` exceeds the number of steps, stated or planned."""
    if (every := scene.output.every) > (steps := time_grid(scene).steps):
        raise SceneError([Fault(("output", "every"), f"must be at most {steps}, the steps of the analysis, got {every}")])


def refuse_unsupported(scene: Scene) -> None:
    """Refuse a static scene with links that nothing connects with the ground; a search for their balance would be long.

    Raises
    ------
    SceneError
        A link of a static scene is not connected with the ground by joints or springs, directly or by other links.
    """
    loose = unsupported(scene) if scene.analysis.kind == "static" else ()
    if loose:
        wanted = (
            "must be connected with the ground in a static analysis, by joints or springs, directly or over others, got "
        )
        remedy = "no way there; connect it, or take kind = 'transient', in which it flies"
        raise SceneError([Fault(("links", name), wanted + remedy) for name in loose])


def _completed(raw: dict[str, Any]) -> dict[str, Any]:
    """A raw scene whose links have the kinds of their shapes, and `auto` models if an accuracy is required."""
    links = raw.get("links")
    if not isinstance(links, Mapping):
        return raw
    links = {name: _of_a_kind(link) for name, link in links.items()}
    analysis = raw.get("analysis")
    if isinstance(analysis, Mapping) and analysis.get("accuracy", "quick") != "quick":
        links = {name: _left_open(link) for name, link in links.items()}
    return {**raw, "links": links}


def _of_a_kind(link: Any) -> Any:
    """A raw link whose shape has its kind."""
    return {**link, "shape": with_kind(link["shape"])} if isinstance(link, Mapping) and "shape" in link else link


def _left_open(link: Any) -> Any:
    """A raw link of a scene with a required accuracy: its model is `auto` if it has a shape and states no model."""
    if not isinstance(link, Mapping) or "shape" not in link or link.keys() & {"model", "reduction"}:
        return link
    return {**link, "model": "auto"}


def _prepared(raw: Mapping[str, Any], points: Mapping[str, XYZ]) -> dict[str, Any]:
    """A raw scene with constructed points, and the built-in materials that its links name."""
    ready = dict(raw)
    if isinstance(raw.get("points"), Mapping):
        ready["points"] = {name: point for name, point in points.items() if point is not UNPLACED}
    own, links = raw.get("materials", {}), raw.get("links")
    if isinstance(own, Mapping) and isinstance(links, Mapping):
        named = {str(link.get("material")) for link in links.values() if isinstance(link, Mapping)}
        ready["materials"] = {**{name: BUILT_IN[name] for name in BUILT_IN if name in named}, **own}
    return ready


def link_from(raw: Mapping[str, Any]) -> LinkScene:
    """A solid link on its own, for meshing; a SceneError has its faults by keys, e.g. ``mesh.size``."""
    raw = _of_a_kind(raw)
    try:
        link, faults = LinkScene.model_validate(raw), []
    except ValidationError as error:
        link, faults = None, record_faults(error, LinkScene, raw)
    faults += meshing_faults(Entry((), raw, link))
    if link is not None and link.element not in ELEMENTS["solid"]:
        faults.append(Fault(("element",), one_of(ELEMENTS["solid"], link.element)))
    if link is None or faults:
        raise SceneError(faults)
    return link


def material_from(where: str, text: str) -> Material:
    """A material by its built-in name or its properties, ``{ density = 7850, … }``; a SceneError names `where`."""
    if not text.lstrip().startswith("{"):
        if text not in BUILT_IN:
            other = "another one by { density = …, youngs_modulus = …, poisson_ratio = … }"
            raise SceneError(f"{where}: {one_of(list(BUILT_IN), text)}; {other}")
        return Material.model_validate(BUILT_IN[text])
    return _record(where, text, Material)


def face_from(where: str, text: str) -> str | ChosenFace:
    """A face by its name or its geometry, ``{ cylinder = "8 mm", axis = "z" }``; a SceneError names `where`."""
    return _record(where, text, ChosenFace) if text.lstrip().startswith("{") else text


def _record(where: str, text: str, kind: type[T]) -> T:
    """A record from a table in one line."""
    try:
        raw = tomllib.loads(f"table = {text}")["table"]
    except tomllib.TOMLDecodeError as error:
        wanted = "must be a name or a table, { key = value, … }"
        raise SceneError(f"{where}: {wanted}, got {text!r} ({error})") from None
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        raise SceneError(record_faults(error, kind, raw, (where,))) from None
