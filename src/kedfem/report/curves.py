"""Curves of a run as SVG, with the positions of a cursor on them."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.output.abscissa import Abscissa
from kedfem.output.load_files import draw_polar, has_polar, polar_title
from kedfem.output.plots.drawing import draw_panels, drawn_over, figure_svg, heading, worth_drawing
from kedfem.results import Results
from kedfem.results.forces.loads import JointLoad

GROUPS = {
    "probes": "Probes", "drive": "Drive", "joints": "Joints", "energy": "Energy", "gears": "Gears",
    "motors": "Motors", "springs": "Springs", "limits": "Limits", "links": "Links",
}  # fmt: skip
"""Headings for the first part of channel names, in the order of the page."""

# groups of pictures of several channels, which come first in them
FIRST = {"joint_angles": "joints", "joint_travels": "joints", "energies": "energy"}


@dataclass(frozen=True, slots=True)
class Curve:
    """A picture of the page.

    title, svg : its title and drawing
    box : left, right, top and bottom of the axes, in widths and heights of the picture; None for a polar diagram
    """

    title: str
    svg: str
    box: tuple[float, float, float, float] | None


def curve_groups(results: Results) -> dict[str, list[Curve]]:
    """Pictures of all channels by their group, in the order of the page."""
    if not len(results.time):
        return {}
    along = drawn_over(results)
    found: dict[str, list[Curve]] = {title: [] for title in GROUPS.values()}
    for picture in worth_drawing(results):
        where, first = FIRST.get(picture.name, picture.group), picture.name in FIRST or picture.together
        title = heading(picture.title, picture.channel, results)

        svg, axes = figure_svg(title, partial(draw_panels, along=along, panels=picture.panels))
        boxes = [each.get_position() for each in axes]
        box = boxes[0].x0, boxes[0].x1, 1 - boxes[0].y1, 1 - boxes[-1].y0
        group = found.setdefault(GROUPS.get(where, "Others"), [])
        group.insert(0 if first else len(group), Curve(picture.title, _alone(svg), box))
    return {name: curves for name, curves in found.items() if curves}


def polar_curves(loads: list[JointLoad], rows: Bool[np.ndarray, " T"]) -> Iterator[Curve]:
    """Polar diagrams of bearing loads."""
    for load in loads:
        if has_polar(load):
            title = polar_title(load, rows)
            svg, _ = figure_svg(title, partial(draw_polar, load=load, rows=rows))
            yield Curve(title, _alone(svg), None)


def cursor_places(results: Results, times: Float[np.ndarray, " f"]) -> list[float]:
    """Position of the cursor in each frame, relative to the axes' width; empty without curves."""
    if len(results.time) < 2:
        return []
    along: Abscissa = drawn_over(results)
    at = np.interp(times, results.time, along.values)
    low, high = along.ends
    return [float(x) for x in (at - low) / (high - low)] if high != low else []


def _alone(svg: str) -> str:
    """The drawing without the header of its file, for HTML."""
    return svg[svg.index("<svg") :]
