"""The drawing process of :func:`kedfem.output.mesh_picture.write_mesh_picture`.

It is run by its path; of kedfem it imports only `kedfem.processes`, which imports no other module of kedfem.
"""

import math
import sys
import textwrap
from typing import Any

import numpy as np

from kedfem.processes import end_with_parent

SIZE = 1500  # pixels of the picture of one mesh, each way, before its margin is cut off
COLOURS = ("#a50026", "#f46d43", "#fee08b", "#d9ef8b", "#8cc665")
"""Colours from bad to good; the good ones are light enough for black edges."""

# distance of edges before the surface, in diagonals, so that it does not cover them
LIFT = 2e-3
BINS = 20  # of the histogram, from 0 to 1


def render(npz: str, png: str, count: str) -> None:
    """Draw `count` meshes from a file of arrays."""
    import matplotlib as mpl

    mpl.use("Agg")
    given = np.load(npz)
    figure, dpi = (draw_one(given), 110) if int(count) == 1 else (draw_several(given, int(count)), 80)
    figure.savefig(png, dpi=dpi, format="png")


def draw_one(given: Any) -> Any:
    """A mesh and the histogram of its quality."""
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6.6), width_ratios=[2, 1], layout="constrained")
    left.imshow(image(given, 0))
    left.set_axis_off()
    quality = given["quality0"]
    counts, edges = np.histogram(quality, bins=BINS, range=(0.0, 1.0))
    middles = (edges[1:] + edges[:-1]) / 2
    right.bar(middles, counts, width=0.9 / BINS, color=colours()(middles), edgecolor="black", lw=0.4)
    right.axvline(float(quality.min()), color="black", ls="--", lw=1)
    right.set_title(f"worst {quality.min():.2f}, median {np.median(quality):.2f}", fontsize=11)
    right.set(xlim=(0, 1), xlabel="scaled Jacobian", ylabel="elements")
    figure.suptitle("\n".join(textwrap.wrap(str(given["title"]), 120)), fontsize=12)
    return figure


def draw_several(given: Any, count: int) -> Any:
    """Meshes in rows and columns."""
    import matplotlib as mpl
    import matplotlib.pyplot as plt

    columns = min(3, count)
    rows = math.ceil(count / columns)
    figure, axes = plt.subplots(rows, columns, figsize=(5.0 * columns, 4.9 * rows), layout="constrained", squeeze=False)
    for i, place in enumerate(axes.ravel()):
        place.set_axis_off()
        if i < count:
            place.imshow(image(given, i))
            words = "\n".join(textwrap.fill(line, 52) for line in str(given[f"words{i}"]).splitlines())
            place.set_title(words, fontsize=11)
    bar = mpl.cm.ScalarMappable(mpl.colors.Normalize(0, 1), colours())
    figure.colorbar(bar, ax=axes, location="bottom", shrink=0.4, aspect=40, label="scaled Jacobian")
    figure.suptitle(str(given["title"]), fontsize=14)
    return figure


def image(given: Any, i: int) -> Any:
    """Pixels of one mesh, seen obliquely from above its flat side."""
    import pyvista

    points, patches, lines = (given[f"{key}{i}"] for key in ("points", "patches", "lines"))
    surface = pyvista.PolyData(points, np.insert(patches, 0, 4, axis=1).ravel())
    surface.cell_data["quality"] = given[f"values{i}"]
    direction, up = sight(points)
    lift = LIFT * np.linalg.norm(np.ptp(points, axis=0)) * direction / np.linalg.norm(direction)
    edges = pyvista.PolyData(points + lift, lines=np.insert(lines, 0, lines.shape[1], axis=1).ravel())
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=[SIZE, SIZE])
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    plotter.add_mesh(
        surface, scalars="quality", cmap=colours(), clim=(0, 1), show_scalar_bar=False, ambient=0.45,
        diffuse=0.6,
    )  # fmt: skip
    plotter.add_mesh(edges, color="black", line_width=1.5)
    plotter.camera_position = [tuple(points.mean(axis=0) + direction), tuple(points.mean(axis=0)), tuple(up)]
    if i == 0 and "label_places" in given:
        add_numbers(plotter, given, direction)
    plotter.camera.parallel_projection = True
    plotter.reset_camera()
    return trimmed(plotter.screenshot(return_img=True))


def add_numbers(plotter: Any, given: Any, direction: Any) -> None:
    """Draw numbers of faces, each at its place nearest to the viewer; those on planes that face away are grey."""
    places, numbers, normals = (given[f"label_{key}"] for key in ("places", "numbers", "normals"))
    several = [np.flatnonzero(numbers == number) for number in np.unique(numbers)]
    near = np.array([own[(places[own] @ direction).argmax()] for own in several])
    away = normals[near] @ direction < 0
    for which, colour in ((near[away], "grey"), (near[~away], "black")):
        if len(which):
            plotter.add_point_labels(
                places[which], [str(x) for x in numbers[which]], always_visible=True, font_size=34, bold=True,
                text_color=colour, shape="rounded_rect", shape_color="white", shape_opacity=0.85, margin=4,
                show_points=True, point_color=colour, point_size=9,
            )  # fmt: skip


def colours() -> Any:
    """The map of COLOURS."""
    import matplotlib as mpl

    return mpl.colors.LinearSegmentedColormap.from_list("quality", COLOURS)


def sight(points: Any) -> tuple[Any, Any]:
    """The direction to the viewer, and the upward one; the longest side of a part runs to the right."""
    low, high = points.min(axis=0), points.max(axis=0)
    order = np.argsort(high - low)
    normal, up, right = np.eye(3)[order]
    if np.linalg.det([right, up, normal]) < 0:
        normal = -normal
    return 1.0 * normal + 0.55 * up * -1 + 0.35 * right, up


def trimmed(pixels: Any) -> Any:
    """Pixels without the empty margin."""
    used = (pixels < 250).any(axis=2)
    rows, columns = np.flatnonzero(used.any(axis=1)), np.flatnonzero(used.any(axis=0))
    margin = 15
    top, left = max(rows[0] - margin, 0), max(columns[0] - margin, 0)
    return pixels[top : rows[-1] + margin, left : columns[-1] + margin]


if __name__ == "__main__":
    end_with_parent()
    render(*sys.argv[1:])
