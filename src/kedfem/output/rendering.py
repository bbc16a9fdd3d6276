"""The drawing process of :func:`kedfem.output.picture.write_picture`.

It is run by its path.
"""

import re
import sys
import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.output.bars import LINES, bars, heights
from kedfem.output.fields import SPRING, VON_MISES
from kedfem.output.views import LIFT, View, hiding, labels, view
from kedfem.processes import end_with_parent

WIDTHS, HEIGHTS = (1000, 1600), (700, 1100)  # least and most pixels; the linkage's proportions decide
LEFT, RIGHT, TOP, BOTTOM = 60, 260, 130, 60  # margins in pixels: title above, colour bar and axes on the right
BALL, COIL = "steelblue", "#4d6b57"
LETTER, BESIDE = 11.5, 190  # pixels: width of a letter; distance of axes and colour bar from the right side
NAMED = 6  # most springs that are named
THROUGH = 0.12  # opacity of what hides the highest stress from both sides
FINEST, TRIANGLES = 4, 200_000  # halvings of quadratic faces, and most triangles that these may make
SHARP = 35.0  # least angle between faces at an edge that is drawn [deg]
QUADRILATERAL = 28  # VTK's number of the biquadratic quadrilateral, of plane links
FLAT_CELLS = {QUADRILATERAL, *LINES}


def render(vtu: str, png: str, title: str, deformation_scale: str = "1", *gravity: str) -> None:
    """Draw a frame for :func:`kedfem.output.picture.write_picture`."""
    import pyvista

    grid: Any = pyvista.read(vtu)
    grid.point_data["MPa"] = np.asarray(grid.point_data[VON_MISES], float) / 1e6  # the name in bars, for merging
    shown = view(grid, np.array([float(x) for x in gravity or (0, 0, 0)]))
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=window(shown.size))
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    balls, springs = labels(grid), labels(grid, SPRING)
    is_ball, is_spring = (np.isin(grid.cell_data["link"], list(of)) for of in (balls, springs))
    links = ~(is_ball | is_spring)
    draw_links(plotter, grid if links.all() else grid.extract_cells(links), shown)
    draw_balls(plotter, grid.extract_cells(is_ball), balls, shown)
    draw_springs(plotter, grid, springs, shown)
    draw_words(plotter, title, float(deformation_scale), shown.cut is not None)
    aim(plotter, grid, shown)
    mark(plotter, grid)
    plotter.screenshot(png)


def mark(plotter: Any, grid: Any) -> None:
    """Draw a ring and a number at the highest stress, in front of all links."""
    stress = grid.point_data["MPa"]
    if not np.nanmax(stress, initial=0.0) > 0:
        return
    import pyvista
    from vtkmodules.vtkRenderingCore import vtkCoordinate

    place = vtkCoordinate()
    place.SetCoordinateSystemToWorld()
    place.SetValue(*grid.points[int(np.nanargmax(stress))])
    plotter.render()
    x, y = place.GetComputedDisplayValue(plotter.renderer)
    angle = np.linspace(0, 2 * np.pi, 49)
    for radius, width, colour in ((13, 6, "white"), (13, 3, "black")):
        ring = np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), 0 * angle])
        plotter.add_actor(_flat(pyvista.MultipleLines(ring), width, colour), reset_camera=False)
    text = f"{np.nanmax(stress):.4g} MPa"
    words = plotter.add_text(text, position=(x + 18, y + 10), font_size=10, color="black")
    words.prop.SetBackgroundColor(1.0, 1.0, 1.0)
    words.prop.SetBackgroundOpacity(0.7)


def _flat(lines: Any, width: float, colour: str) -> Any:
    """An actor of lines in pixel coordinates."""
    from vtkmodules.vtkCommonColor import vtkNamedColors
    from vtkmodules.vtkRenderingCore import vtkActor2D, vtkPolyDataMapper2D

    mapper, actor = vtkPolyDataMapper2D(), vtkActor2D()
    mapper.SetInputData(lines)
    actor.SetMapper(mapper)
    actor.GetProperty().SetLineWidth(width)
    actor.GetProperty().SetColor(vtkNamedColors().GetColor3d(colour))
    return actor


def window(size: Float[np.ndarray, " 2"]) -> list[int]:
    """Window size in pixels for a linkage of some width and height, without much empty space."""
    aspect = size[0] / size[1]
    high = int(np.clip((WIDTHS[1] - LEFT - RIGHT) / aspect + TOP + BOTTOM, *HEIGHTS))
    return [int(np.clip((high - TOP - BOTTOM) * aspect + LEFT + RIGHT, *WIDTHS)), high]


def draw_links(plotter: Any, grid: Any, shown: View) -> None:
    """Draw all links with their edges on one colour scale; what hides the highest stress is translucent."""
    stress = grid.point_data["MPa"]
    look = {
        "scalars": "MPa", "cmap": "turbo",
        "clim": (0.0, float(np.max(stress, where=np.isfinite(stress), initial=0.0)) or 1.0),
        "smooth_shading": True, "show_scalar_bar": False, "nan_color": "lightgrey", "ambient": 0.55,
        "diffuse": 0.5,
    }  # fmt: skip
    above = lifted(grid)
    is_line = np.isin(grid.celltypes, list(LINES))
    solids, pieces = above.extract_cells(~is_line), []
    if solids.n_cells and shown.cut is not None:  # links elsewhere stay whole
        cut = np.isin(solids.cell_data["link"], list(hiding(grid, shown.direction)))
        hide, solids = solids.extract_cells(cut), solids.extract_cells(~cut)
        before = curved_surface(hide.clip(-shown.direction, shown.cut))
        plotter.add_mesh(before, **look, opacity=THROUGH)
        pieces.append(curved_surface(hide.clip(shown.direction, shown.cut)))
    if solids.n_cells:
        pieces.append(curved_surface(solids))
    if is_line.any():
        pieces.append(bars(above.extract_cells(is_line), heights(grid)))
    import pyvista

    surface = pyvista.merge(pieces, merge_points=False) if len(pieces) > 1 else pieces[0]
    links = plotter.add_mesh(surface, split_sharp_edges=True, feature_angle=SHARP, **look)
    edges = surface.extract_feature_edges(SHARP, manifold_edges=False, non_manifold_edges=False)
    if edges.n_cells:
        plotter.add_mesh(edges, color="black", line_width=2.0, opacity=0.7)
    draw_bar(plotter, links)


def draw_balls(plotter: Any, grid: Any, words: Mapping[int, str], shown: View) -> None:
    """Draw attached masses, translucent so that they hide nothing, with their names."""
    for cell in range(grid.n_cells):
        ball = grid.extract_cells([cell])
        look = {"color": BALL, "opacity": 0.5, "smooth_shading": True}
        plotter.add_mesh(curved_surface(ball), scalars=None, **look)
        name(plotter, ball.center, words[int(ball.cell_data["link"][0])], shown)


def draw_springs(plotter: Any, grid: Any, words: Mapping[int, str], shown: View) -> None:
    """Draw springs and dampers, with their names if they are few."""
    for number, word in words.items():
        cells = grid.extract_cells(grid.cell_data["link"] == number)
        spring = cells.extract_surface(algorithm="dataset_surface")
        plotter.add_mesh(spring, color=COIL, scalars=None, smooth_shading=True, split_sharp_edges=True)
        if len(words) <= NAMED:
            name(plotter, spring.center, word, shown)


def name(plotter: Any, place: Any, word: str, shown: View) -> None:
    """Draw a label in front of everything, right of its point, or left of it if it would cover the axes."""
    wide, high = plotter.window_size
    pixel = np.max(shown.size / [wide - LEFT - RIGHT, high - TOP - BOTTOM])
    begins = LEFT + (wide - LEFT - RIGHT) / 2 + (np.asarray(place) @ shown.across - shown.middle[0]) / pixel
    length = LETTER * len(word)
    left = length * pixel * shown.across if begins + length > wide - BESIDE else np.zeros(3)
    plotter.add_point_labels(
        [place - left], [word], always_visible=True, font_size=20, show_points=False, text_color="black",
        shape="rounded_rect", shape_color="white", shape_opacity=0.7, margin=2, justification_vertical="bottom",
    )  # fmt: skip


def lifted(grid: Any) -> Any:
    """The links, planar ones moved apart along z so that faces in one plane are not mixed."""
    out = grid.copy()
    for kind in FLAT_CELLS:
        numbers = grid.cell_data["link"][grid.celltypes == kind]
        for cell, link in zip(grid.cells_dict.get(kind, ()), numbers, strict=True):
            out.points[cell, 2] = grid.points[cell, 2] + LIFT * grid.length * link
    return out


def curved_surface(solids: Any) -> Any:
    """Outer faces, with quadratic ones divided until they look curved."""
    import pyvista
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

    halvings = int(np.log(TRIANGLES / solids.n_cells) / np.log(4.0))
    faces = vtkDataSetSurfaceFilter()
    faces.SetInputData(solids)
    faces.SetNonlinearSubdivisionLevel(int(np.clip(halvings, 1, FINEST)))
    faces.Update()
    return pyvista.wrap(faces.GetOutput())


def draw_words(plotter: Any, title: str, deformation_scale: float, cut: bool) -> None:
    """Draw title, scale of the deformation, and axes."""
    import matplotlib as mpl

    font = f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf"  # VTK's own has no Greek
    letters = int(plotter.window_size[0] / 16)
    whole = re.sub(r"\([^)]*\) m\b|\bt = \S+ s\b", lambda part: part[0].replace(" ", "\xa0"), title)
    text = "\n".join(textwrap.wrap(whole, letters, max_lines=3, placeholder=" …"))
    look = {"viewport": True, "color": "black", "font_file": font}
    words = plotter.add_text(text, position=(0.03, 0.97), font_size=13, **look)
    words.prop.justification_vertical = "top"
    words.prop.SetLineSpacing(1.2)
    scale = f"deformation × {deformation_scale:g}" + ("; cut at the highest stress" if cut else "")
    plotter.add_text(scale, position=(0.03, 0.015), font_size=11, **look)
    wide, high = plotter.window_size
    plotter.add_axes(color="black", line_width=3, viewport=(1 - 210 / wide, 0.0, 1 - 30 / wide, 180 / high))


def draw_bar(plotter: Any, links: Any) -> None:
    """Draw the colour bar of links."""
    wide, high = plotter.window_size
    bar = plotter.add_scalar_bar(
        "von Mises\nstress (MPa)\n", mapper=links.mapper, n_labels=6, fmt="%.3g", color="black",
        position_x=1 - 170 / wide, position_y=220 / high, width=90 / wide, height=1 - (220 + TOP) / high,
        vertical=True, title_font_size=22, label_font_size=22,
    )  # fmt: skip
    bar.SetTextPad(8)


def aim(plotter: Any, grid: Any, shown: View) -> None:
    """Set a parallel projection with the whole linkage inside the margins of the picture."""
    wide, high = plotter.window_size
    pixel = np.max(shown.size / [wide - LEFT - RIGHT, high - TOP - BOTTOM])
    centre = shown.middle + pixel / 2 * np.array([RIGHT - LEFT, TOP - BOTTOM])
    depth = np.mean(grid.points @ shown.direction)
    focus = centre[0] * shown.across + centre[1] * shown.up + depth * shown.direction
    camera = plotter.camera
    camera.focal_point, camera.up = focus, shown.up
    camera.position = focus + 10 * grid.length * shown.direction
    camera.parallel_projection, camera.parallel_scale = True, pixel * high / 2
    plotter.renderer.ResetCameraClippingRange()


if __name__ == "__main__":
    end_with_parent()
    render(*sys.argv[1:])
