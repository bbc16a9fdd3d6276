"""The moving mechanism as a self-contained document for a browser, made by k3d."""

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.output.views import picture_axes, sight
from kedfem.report.animated import Animated, bounds, extent
from kedfem.report.surfaces import Placement, Surface
from kedfem.results.files import of_extra

EXTRA = "report"  # the extra with the packages of a report
FINE = 1e-4  # of the mechanism's size: rounding of coordinates, so that the document compresses well
SHADES = 400  # steps of the colour scale
COMPRESSION = 6  # of zlib; 9 takes much longer and saves one percent
LEAST = 0.08  # start of the colour scale on matplotlib's turbo, whose lower end is nearly black
GREY, DARK, HOT = 0xB8BEC6, 0x1F2933, 0xC01030
FIELD_OF_VIEW = 25.0  # degrees

LISTENS = """
const flat = %s;
function look() {
  const box = document.getElementById('canvasTarget').getBoundingClientRect();
  const aspect = Math.max(box.width, 1) / Math.max(box.height, 1);
  const half = 1.12 * Math.max(flat.high, flat.wide / aspect);
  const far = half / Math.tan(flat.view * Math.PI / 360) + flat.deep;
  K3DInstance.setCamera([...flat.middle.map((x, k) => x + far * flat.towards[k]), ...flat.middle, ...flat.up]);
}
window.addEventListener('message', (event) => {
  if (event.source !== window.parent) return;
  if (typeof event.data.frame === 'number') K3DInstance.setTime(event.data.frame);
  if (event.data.look) look();
});
look();
K3DInstance.setTime(flat.first);
window.parent.postMessage({ready: true}, '*');
"""
"""Script by which the viewer obeys messages of its page: show a frame, or restore the first view."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A named point of a link.

    name, link : its name; its link, None for the ground
    at : (3,) in the reference position [m]
    hot : whether it is the place of the highest stress
    """

    name: str
    link: str | None
    at: Float[np.ndarray, "3"]
    hot: bool = False


def viewer(shown: Animated, highest: float, marks: Sequence[Mark], gravity: Float[np.ndarray, "3"], first: int) -> str:
    """An HTML document that shows the frame which its page asks for.

    The frame after the last one has undeformed links with their highest stresses.

    Parameters
    ----------
    highest : stress at the upper end of the colour scale [Pa]
    marks : points that are drawn with their names
    gravity : (3,) [m/s²]
    first : the frame that is shown first
    """
    k3d = of_extra("k3d", "kedfem report", EXTRA)
    taken = extent(shown.surfaces)
    size = float(np.linalg.norm(taken)) or 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of arrays that are copied
        plot = k3d.plot(
            snapshot_type="full", menu_visibility=False, grid_visible=False, camera_auto_fit=False,
            time_interpolation=False, camera_fov=FIELD_OF_VIEW, axes_helper=0.9, colorbar_object_id=0,
            label_color=DARK, lighting=2.0,
        )  # fmt: skip
        for surface in shown.surfaces:
            plot += _mesh(k3d, surface, highest, FINE * size)
        for mark in marks:
            for drawn in _mark(k3d, mark, shown, size):
                plot += drawn
        return str(plot.get_snapshot(COMPRESSION, additional_js_code=_listens(shown, taken, gravity, first)))


def gradient() -> str:
    """The colour scale for a style sheet, from its lower end."""
    colours = (f"rgb({', '.join(f'{255 * x:.0f}' for x in rgb)}) {100 * part:.0f}%" for part, rgb in scale())
    return ", ".join(colours)


def scale() -> list[tuple[float, tuple[float, ...]]]:
    """Shares of the highest stress, and their red, green and blue."""
    from matplotlib import colormaps

    parts = np.linspace(0.0, 1.0, 41)
    colours = colormaps["turbo"](LEAST + (1 - LEAST) * parts)[:, :3]
    return [(part, tuple(rgb)) for part, rgb in zip(parts.tolist(), colours.tolist(), strict=True)]


def _mesh(k3d: Any, surface: Surface, highest: float, fine: float) -> Any:
    """A link in all frames, then in the reference position with the highest stresses."""
    count = len(surface.placements)
    order = [*range(1, count + 1), 0]
    vertices = _series([(np.round(surface.points[k] / fine) * fine).astype(np.float32) for k in order])
    look: dict[str, Any] = {"color": GREY}
    if surface.stressed and highest > 0:
        shade = highest / SHADES
        stress = (np.round(np.nan_to_num(surface.stress[k]) / shade) * shade for k in order)
        look = {"attribute": _series([x.astype(np.float32) for x in stress]), "color_range": [0.0, highest]}
        look["color_map"] = [x for part, rgb in scale() for x in (part, *rgb)]
    triangles = surface.triangles.astype(np.uint32)
    look |= {"flat_shading": False, "side": "double", "roughness": 0.9, "name": surface.name}
    mesh = k3d.mesh(vertices, triangles, **look)
    mesh.model_matrix = _series([*map(_matrix, surface.placements), np.eye(4, dtype=np.float32)])
    return mesh


def _mark(k3d: Any, mark: Mark, shown: Animated, size: float) -> list[Any]:
    """A ball and a name at a link's point in all frames."""
    of = next((each for each in shown.surfaces if each.name == mark.link), None)
    if mark.link is not None and of is None:
        return []
    places = [mark.at] * (len(shown.times) + 1)
    if of is not None:
        near = int(((of.points[0] - mark.at) ** 2).sum(axis=1).argmin())
        frames = zip(of.points[1:], of.placements, strict=True)
        places = [x.p + x.R @ (points[near] if mark.hot else mark.at) for points, x in frames] + [mark.at]
    colour, radius = (HOT, 0.014) if mark.hot else (DARK, 0.011)
    look = {"color": colour, "name": mark.name}
    positions = _series([place[None].astype(np.float32) for place in places])
    ball = k3d.points(positions, point_size=radius * size, shader="3d", **look)
    word = {"size": 0.8, "reference_point": "lt", "is_html": True}
    at = _series([place.tolist() for place in places])
    return [ball, k3d.text(escape(mark.name), position=at, **word, **look)]


def _series(frames: Sequence[Any]) -> Any:
    """A value for each frame, or a single value for a single frame."""
    return frames[0] if len(frames) == 1 else {str(float(k)): x for k, x in enumerate(frames)}


def _matrix(placed: Placement) -> Float[np.ndarray, "4 4"]:
    out = np.eye(4, dtype=np.float32)
    out[:3, :3], out[:3, 3] = placed.R, placed.p
    return out


def first_view(
    shown: Animated, taken: Float[np.ndarray, "3"], gravity: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3 3"]:
    """Unit vectors to the right, upwards and towards the viewer, as in the picture; gravity points down if known."""
    if shown.seen_from is not None:
        return np.array([shown.seen_from.across, shown.seen_from.up, shown.seen_from.direction])
    towards, up = sight(taken, gravity)
    return np.array([*picture_axes(towards, up, gravity), towards])


def _listens(shown: Animated, taken: Float[np.ndarray, "3"], gravity: Float[np.ndarray, "3"], first: int) -> str:
    """The script with the first view: that of the picture of the highest stress, wide enough for all frames."""
    axes = first_view(shown, taken, gravity)
    low, high = bounds(shown.surfaces, axes)
    wide, tall, deep = (high - low) / 2
    messages: Mapping[str, Any] = {
        "middle": ((low + high) / 2 @ axes).tolist(), "towards": axes[2].tolist(), "up": axes[1].tolist(),
        "wide": wide, "high": tall, "deep": deep, "view": FIELD_OF_VIEW, "first": first,
    }  # fmt: skip
    return LISTENS % json.dumps(messages)
