"""Scenes from files and from dictionaries."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from kedfem.errors import Fault, SceneError
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.checks.links import ELEMENTS, meshing_faults
from kedfem.scene.checks.parts import Entry
from kedfem.scene.read.files import inside, outside, toml_table
from kedfem.scene.read.including import KEY, toml_text, with_includes
from kedfem.scene.read.validation import validated
from kedfem.scene.records.base import Record
from kedfem.scene.records.faces import ChosenFace
from kedfem.scene.records.links import LinkScene, spelt_out
from kedfem.scene.records.materials import BUILT_IN, Material
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.wording import one_of

T = TypeVar("T", bound=Record)


def read_scene(path: str | Path, *, sketch: bool = False, within: bool = False) -> Scene:
    """A scene from its TOML file.

    Parameters
    ----------
    path : the scene file; file names in it are relative to its folder.
    sketch : elastic links may lack shape and material: enough for their rigid motion, not for an analysis.
    within : whether all files that it names, and its results, must be in its own folder: for scenes from others.

    Raises
    ------
    SceneError
        With all faults: of the file, or of the scene in it.
    """
    path = Path(path)
    raw, text = read_keys(path, within=within)
    return _scene(raw, path.parent, source=text, stem=path.stem, sketch=sketch)


def read_keys(path: Path, *, within: bool = False) -> tuple[dict[str, Any], str]:
    """Keys and values of a scene file as they are written, includes taken over, and their text.

    Parameters
    ----------
    path, within : as of `read_scene`

    Raises
    ------
    SceneError
        With all faults of the file.
    """
    folder = path.parent
    found, text = toml_table(path)
    raw = with_includes(found, folder, path, lambda each: not within or inside(folder, each.absolute()))
    if within and (faults := outside(raw, folder)):
        raise SceneError(faults)
    return raw, toml_text(raw) if KEY in found else text


def link_from(raw: Mapping[str, Any]) -> LinkScene:
    """A solid link on its own, to be meshed; its faults are reported by its keys, e.g. ``mesh.size``.

    Raises
    ------
    SceneError
        With all faults.
    """
    raw = spelt_out(raw)
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


def scene_from(
    raw: Mapping[str, Any], folder: str | Path = ".", *, source: str | None = None, stem: str = "scene"
) -> Scene:
    """A scene from a dictionary of the keys that a scene file has.

    Parameters
    ----------
    raw : keys and values; records of this package may stand for tables, units as in a file.
    folder : what file names in it are relative to.
    source : text of the file that it comes from.
    stem : name of the scene, for its results.

    Raises
    ------
    SceneError
        With all faults.
    """
    return _scene(raw, Path(folder), source=source, stem=stem)


def _scene(
    raw: Mapping[str, Any], folder: Path, *, source: str | None, stem: str, sketch: bool = False
) -> Scene:
    try:
        raw = with_includes(raw, folder) if isinstance(raw, Mapping) and KEY in raw else raw
        scene = raw if isinstance(raw, Scene) and raw.checked else validated(raw, folder, sketch=sketch)
    except RecursionError:
        wanted = "must not be nested, nor have points that are constructed from each other, hundreds deep"
        raise SceneError(f"the scene: {wanted}, got more") from None
    scene._source, scene._folder, scene._stem = source, folder, stem
    return scene


def material_from(where: str, text: str) -> Material:
    """A material that is built in, by its name, or by its properties: ``{ density = 7850, … }``.

    Raises
    ------
    SceneError
        With all faults, under `where`.
    """
    if not text.lstrip().startswith("{"):
        if text not in BUILT_IN:
            wanted = one_of(list(BUILT_IN), text)
            raise SceneError(
                f"{where}: {wanted}; another one by {{ density = …, youngs_modulus = …, poisson_ratio = … }}"
            )
        return Material.model_validate(BUILT_IN[text])
    return _record(where, text, Material)


def face_from(where: str, text: str) -> str | ChosenFace:
    """A face by its name, or by what it is: ``{ cylinder = "8 mm", axis = "z" }``.

    Raises
    ------
    SceneError
        With all faults, under `where`.
    """
    return _record(where, text, ChosenFace) if text.lstrip().startswith("{") else text


def _record(where: str, text: str, kind: type[T]) -> T:
    """A record from a table in one line."""
    try:
        raw = tomllib.loads(f"table = {text}")["table"]
    except tomllib.TOMLDecodeError as error:
        raise SceneError(
            f"{where}: must be a name or a table, {{ key = value, … }}, got {text!r} ({error})"
        ) from None
    try:
        return kind.model_validate(raw)
    except ValidationError as error:
        raise SceneError(record_faults(error, kind, raw, (where,))) from None
