"""One HTML file about a run, with model, animation, curves, loads and warnings, which needs no network."""

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import KedfemError, OutputError
from kedfem.loads import loads_of, summaries, thinned
from kedfem.output.derived import PICTURE, REPORT
from kedfem.output.words import with_prefix
from kedfem.report.animated import Animated, animated
from kedfem.report.curves import Curve, cursor_places, curve_groups, polar_curves
from kedfem.report.facts import (
    Table,
    budget_table,
    facts,
    fatigue_table,
    frequencies_table,
    joints_table,
    links_table,
    loads_tables,
    named_table,
    notes_table,
    peaks_table,
    steady_table,
)
from kedfem.report.viewer import EXTRA, Mark, gradient, viewer
from kedfem.results import Peak, Results, read_results, replacing, results_file
from kedfem.results.files import beside, of_extra
from kedfem.results.frequencies import CAMPBELL, FREQUENCIES, OVER_TURN, read_summary
from kedfem.scene import scene_from


@dataclass(frozen=True, slots=True)
class Report:
    """A written report.

    path : path of the HTML file
    warnings : descriptions of what is missing in it, with reasons
    """

    path: Path
    warnings: tuple[str, ...]


def require_report(where: str) -> None:
    """Raise an OutputError unless the packages for a report are installed; `where` is for the message."""
    for package in ("jinja2", "k3d"):
        of_extra(package, where, EXTRA)


def write_report(given: Path, path: Path | None = None) -> Report:
    """Write one HTML file about the results of a run, or of `kedfem kinematics`.

    Parameters
    ----------
    given : `results.h5`, or the folder that has it
    path : the file; `report.html` beside the results if not given

    Raises
    ------
    OutputError
        The results cannot be read, the file cannot be written, or a package is missing.
    """
    require_report("kedfem report")
    file = results_file(Path(given))
    results, folder = read_results(file), file.parent
    missing: list[str] = []
    content = _content(results, folder, missing)
    target = folder / REPORT if path is None else path
    with replacing(target) as part:
        part.write_text(_template().render(content, missing=missing), encoding="utf-8")
    return Report(target, tuple(missing))


def _template() -> Any:
    import jinja2

    loader = jinja2.PackageLoader("kedfem.report", "")
    return jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True).get_template("page.html")


def _content(results: Results, folder: Path, missing: list[str]) -> dict[str, Any]:
    """The contents of the template; descriptions of missing parts are appended to `missing`."""
    scene: Mapping[str, Any] = json.loads(results.scene_json)
    highest = max(results.peaks.values(), key=lambda peak: peak.stress, default=None)
    if not len(results.time):
        missing.append("no time step was written: there are no curves")
    elif results.status in {"interrupted", "abandoned", "running"}:
        missing.append("highest stresses, estimated errors and timing are known only at the end of a run")
    if results.every > 1 and len(results.time) and not results.largest:
        missing.append(f"largest values are those of rows, of one step in {results.every}, as the run was killed")

    moment = partial(instant_in_words, scene, results)
    loads, polars = _loads(scene, results, folder, missing)
    picture = folder / PICTURE
    return {
        "title": scene.get("title") or folder.name.removesuffix("-results"),
        "results": results,
        "colours": gradient(),
        "facts": facts(results, highest, moment),
        "moving": _moving(scene, results, folder, highest, missing),
        "picture": b64encode(picture.read_bytes()).decode() if picture.exists() else "",
        "peaks": [peaks_table(results, moment)] if results.peaks else [],
        "fatigue": [fatigue_table(results.fatigue)] if results.fatigue else [],
        "frequencies": _frequencies(results, folder, missing),
        "modelled": [links_table(scene, results), joints_table(scene)],
        "loads": loads,
        "groups": curve_groups(results) | ({"Bearing loads": polars} if polars else {}),
        "trust": [*steady_table(results.notes), *budget_table(results.notes), notes_table(results.notes)],
        "seconds": [named_table("Seconds", results.seconds.items())] if results.seconds else [],
        "scene": results.scene_toml or json.dumps(scene, indent=1),
    }


def _frequencies(results: Results, folder: Path, missing: list[str]) -> dict[str, Any] | None:
    """Table and plots of `kedfem frequencies`, if they belong to the same text of the scene."""
    known = beside(folder, FREQUENCIES)
    found = read_summary(known)
    if found is None:
        return None
    if found.scene is None or found.scene != results.scene_toml:
        missing.append(
            f"natural frequencies in {known.name} are left out, as they are of another text of the scene: run "
            "kedfem frequencies again"
        )
        return None
    plots = [known / name for name in (OVER_TURN, CAMPBELL)]
    pictures = [b64encode(path.read_bytes()).decode() for path in plots if path.exists()]
    return {"tables": [frequencies_table(found)], "pictures": pictures}


def instant_in_words(scene: Mapping[str, Any], results: Results, time: float, angle: float) -> str:
    """A time, with the drive's position if there is a single drive; results have only the first of several drives."""
    caption = f"t = {with_prefix(time, 's')}"
    if bool(scene.get("drive")) + len(scene.get("drives") or ()) != 1 or np.isnan(angle):
        return caption
    return f"{caption}, {results.drive.name.replace('_', ' ')} {with_prefix(angle, results.drive.unit)}"


def _moving(
    scene: Mapping[str, Any], results: Results, folder: Path, highest: Peak | None, missing: list[str]
) -> dict[str, Any] | None:
    """The viewer, captions and cursor positions of the frames, the first frame, numbers at the colour bar."""
    animation = scene.get("output", {}).get("animation") or {}
    scale = float(animation.get("deformation_scale", 1.0))
    gravity = tuple(scene.get("gravity") or (0.0, 0.0, 0.0))
    try:
        shown = animated(folder, scale, gravity)
    except OutputError as error:
        missing.append(f"the mechanism is not drawn: {error}")
        return None
    if shown is None:
        missing.append("the mechanism is not drawn: the run left neither an animation nor highest stresses")
        return None
    if not len(shown.times):
        missing.append("the mechanism does not move: the run left no animation")
    missing += shown.thinned
    first = 0
    if highest is not None and len(shown.times):
        first = int(np.abs(shown.times - highest.time).argmin())
    most = 0.0 if highest is None else highest.stress
    return {
        "document": viewer(shown, most, _marks(scene, highest), np.array(gravity, float), first),
        "frames": _frames(scene, results, shown, highest),
        "cursor": cursor_places(results, shown.times),
        "first": first,
        "scale": f"{scale:g}" if any(each.stressed for each in shown.surfaces) else "",
        "top": highest and [*(with_prefix(highest.stress * part, "Pa") for part in (1.0, 0.75, 0.5, 0.25)), "0"],
    }


def _frames(scene: Mapping[str, Any], results: Results, shown: Animated, highest: Peak | None) -> Sequence[str]:
    """Captions of the frames; the last one is the reference position, which has no time."""
    angles = _angles(results, shown.times)
    captions = [instant_in_words(scene, results, float(t), float(x)) for t, x in zip(shown.times, angles, strict=True)]
    stresses = ", with the highest stress of each point over all steps" if highest else ""
    return [*captions, f"links in the reference position{stresses}"]


def _angles(results: Results, times: Float[np.ndarray, " f"]) -> Float[np.ndarray, " f"]:
    """The drive's position in each frame; nan between recorded steps if not all were recorded."""
    if not len(results.time):
        return 0 * times
    angles = np.asarray(np.interp(times, results.time, results.angle))
    if results.every == 1 or len(results.time) < 2:
        return angles
    apart = np.abs(times[:, None] - results.time).min(axis=1)
    return np.asarray(np.where(apart < 1e-3 * np.diff(results.instants[:2]), angles, np.nan))


def _marks(scene: Mapping[str, Any], highest: Peak | None) -> list[Mark]:
    """Marks of the joints, each on a link other than the ground, and of the highest stress."""
    marks = [
        Mark(name, next(x for x in joint["links"] if x != "ground"), np.array(joint["at"], float))
        for name, joint in scene["joints"].items()
    ]
    if highest is not None:
        place = np.array(highest.place, float)
        marks.append(Mark(with_prefix(highest.stress, "Pa"), highest.link, place, hot=True))
    return marks


def _loads(raw: Mapping[str, Any], results: Results, folder: Path, missing: list[str]) -> tuple[list[Table], list[Curve]]:
    """Tables of loads, and polar diagrams of bearing loads."""
    if not len(results.time):
        return [], []
    if left := thinned(results):
        missing.append(f"loads of joints are left out: results {left}")
        return [], []
    try:
        scene = scene_from(raw, folder.parent)
    except KedfemError as error:
        missing.append(f"loads of joints are left out, as the scene cannot be read again: {error}")
        return [], []
    joints, drives, why = loads_of(scene, results)
    missing += why
    rows = np.ones(len(results.time), bool)
    return loads_tables(*summaries(joints, drives, results, rows)), list(polar_curves(joints, rows))
