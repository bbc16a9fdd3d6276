"""A raw scene made a scene: expressions worked out, patterns written out, points placed, all checked at once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from kedfem.errors import Fault, SceneError
from kedfem.scene.checks import cross_faults
from kedfem.scene.checks.faults import record_faults
from kedfem.scene.checks.parts import scene_parts
from kedfem.scene.checks.unit_plausibility import bare_numbers
from kedfem.scene.questions.frames import default_frames
from kedfem.scene.questions.timing import time_grid
from kedfem.scene.read.files import file_faults
from kedfem.scene.read.parameters import with_expressions
from kedfem.scene.read.patterns import in_pattern, steep_faults, with_patterns
from kedfem.scene.read.placing import Placement
from kedfem.scene.read.rigid_links import with_rigid_bodies
from kedfem.scene.read.tables import with_tables
from kedfem.scene.records.base import plain
from kedfem.scene.records.links import spelt_out
from kedfem.scene.records.materials import BUILT_IN
from kedfem.scene.records.points import UNPLACED, XYZ, known_points
from kedfem.scene.records.scene import Scene

MOST_STEPS = 1e9  # of an analysis: days of computing, and more rows than a disk holds


def validated(given: Any, folder: Path, *, sketch: bool = False) -> Scene:
    """A scene from its raw keys and values.

    Parameters
    ----------
    given : as a file has them; records of this package may stand for tables
    folder : what file names in it are relative to
    sketch : whether elastic links may lack shape and material

    Raises
    ------
    SceneError
        With all faults of the scene.
    """
    written = plain(given)
    if not isinstance(written, Mapping):
        raise SceneError(f"must be a table of keys, got {written!r}")
    raw, wrong = with_expressions(written, Scene)
    repeated, (raw, more, origins) = raw.get("patterns"), with_patterns(raw, Scene)
    wrong, bare = wrong + more, raw
    placement = Placement(raw.get("points"), raw.get("joints"))
    points = {name: placement[name] for name in placement if not name.startswith("joints.")}
    raw, faults = with_tables(_spelt_out(raw), folder, Scene)
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
        places = {each.where for each in wrong}
        rest = [each for each in faults if each.where not in places]
        raise SceneError(in_pattern(each, origins) for each in [*wrong, *rest])
    if (steps := time_grid(scene).steps) > MOST_STEPS:
        raise SceneError([Fault(("analysis",), f"must end within {MOST_STEPS:.0e} steps, got {steps:.3g}")])
    scene._doubts, scene._as_given, scene._checked = tuple(bare_numbers(bare, Scene)), written, True
    if scene.analysis.frames is None:
        scene.analysis.fill(frames=default_frames(bool(scene.driven_joints)))
    return scene


def _spelt_out(raw: dict[str, Any]) -> dict[str, Any]:
    """A raw scene with the keys of its links that others stand for."""
    links = raw.get("links")
    if not isinstance(links, Mapping):
        return raw
    links = {name: spelt_out(link) for name, link in links.items()}
    analysis = raw.get("analysis")
    if isinstance(analysis, Mapping) and analysis.get("accuracy", "quick") != "quick":
        links = {name: _left_open(link) for name, link in links.items()}
    return {**raw, "links": links}


def _left_open(link: Any) -> Any:
    """A raw link of a scene that asks for an accuracy: with a shape and no model stated it is `auto`."""
    if not isinstance(link, Mapping) or "shape" not in link or link.keys() & {"model", "reduction"}:
        return link
    return {**link, "model": "auto"}


def _prepared(raw: Mapping[str, Any], points: Mapping[str, XYZ]) -> dict[str, Any]:
    """A raw scene with its points placed and the built-in materials that its links name."""
    ready = dict(raw)
    if isinstance(raw.get("points"), Mapping):
        ready["points"] = {name: point for name, point in points.items() if point is not UNPLACED}
    own, links = raw.get("materials", {}), raw.get("links")
    if isinstance(own, Mapping) and isinstance(links, Mapping):
        named = {str(link.get("material")) for link in links.values() if isinstance(link, Mapping)}
        ready["materials"] = {**{name: BUILT_IN[name] for name in BUILT_IN if name in named}, **own}
    return ready
