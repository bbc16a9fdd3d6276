"""Drawing of the pictures of `groups`: curves over the drive angle or time."""

import io
import json
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.output.abscissa import Abscissa, abscissa, draw_abscissa, over_positions
from kedfem.output.plots.groups import FAINT, STIFF, Panel, Picture, largest, pictures
from kedfem.output.words import prefixed
from kedfem.results import Channel, Results, replacing
from kedfem.results.records import rounding

T = TypeVar("T")

SIZE = (11.0, 6.2)  # inches, at DPI dots each
PAGE_SIZE = (8.4, 4.8)  # inches of a figure that is one of many on a page
DPI = 120

# groups of points of a long curve, about one per pixel, of which the smallest and the largest value are drawn
BINS = 1500
COMPARABLE = 0.1  # of the widest span of a quantity: panels with at least this span share its scale
NAMED = 48  # most letters of the names of curves too small to be drawn; otherwise only their number is given
LETTERS = 16  # in a line of a legend
COMPRESSION = 3  # of PNGs: files are a fifth larger than with the default 6, but written in a third of the time
MARK = "kedfem plot"  # note in PNGs that distinguishes them from a user's own
DARKER = 0.5  # factor on the colour of a curve of rigid links


def worth_drawing(results: Results) -> list[Picture]:
    """All pictures except those of rounding errors, which the table of a run reports as ≈ 0.

    Channels that are faint in a picture of several have no picture of their own. Panels of one quantity share a scale.
    """
    least, every = rounding(results), list(pictures(results))
    beside = {path: each for each in every for path in each.together}
    faint: dict[tuple[str, str], float] = {}
    for each in every:
        for panel in each.panels if each.together else ():
            key = each.group, panel.quantity
            faint[key] = max(faint.get(key, 0.0), FAINT * _peak(panel))
    drawn = []
    for each in every:
        floor = least.get(each.channel.unit, 0.0) if each.channel else 0.0
        if each.channel and each.channel.name in beside:
            floor = max(floor, faint.get((each.group, each.panels[0].quantity), 0.0))
        if not floor or max(map(_peak, each.panels), default=0.0) > floor:
            drawn.append(each)
    return _on_one_scale(drawn)


def _peak(panel: Panel) -> float:
    return max(map(largest, panel.curves.values()), default=0.0)


def _on_one_scale(every: Sequence[Picture]) -> list[Picture]:
    """The pictures with common limits of panels of one quantity, except for panels that would be illegible."""
    spans: dict[tuple[str, str, str, int], list[tuple[float, float]]] = {}
    for key, panel in ((key, panel) for each in every for key, panel in _keyed(each)):
        spans.setdefault(key, []).append(_span(panel))
    common, widest = {}, {}
    for key, found in spans.items():
        low, high = np.array(found).T
        widest[key] = np.max(high - low)
        wide = high - low >= COMPARABLE * widest[key]
        ends = float(low[wide].min()), float(high[wide].max())
        if wide.sum() > 1 and ends[1] > ends[0]:
            common[key] = ends
    out = []
    for each in every:
        panels = []
        for key, panel in _keyed(each):
            shared = key in common and np.ptp(_span(panel)) >= COMPARABLE * widest[key]
            panels.append(replace(panel, limits=common[key]) if shared else panel)
        out.append(replace(each, panels=panels))
    return out


def _keyed(picture: Picture) -> Iterator[tuple[tuple[str, str, str, int], Panel]]:
    for k, panel in enumerate(picture.panels):
        yield (picture.group + "/" * bool(picture.together), panel.quantity, panel.unit, k), panel


def _span(panel: Panel) -> tuple[float, float]:
    """Lowest and highest value, including zero."""
    finite = [y[np.isfinite(y)] for y in panel.curves.values()]
    return min(y.min(initial=0.0) for y in finite), max(y.max(initial=0.0) for y in finite)


def drawn_over(results: Results) -> Abscissa:
    """The abscissa of a run: the drive angle or time; always time with a sliding drive or several drives.

    Static positions have the position of the only drive.
    """
    of_drives = [name.split("/")[1:] for name in results.channels if name.startswith("drive/")]
    slides = results.drive.unit == "m"
    scene = json.loads(results.scene_json)
    if scene.get("analysis", {}).get("kind") == "static" and len(scene.get("drives") or ()) < 2:
        found = over_positions(results.angle, slides)
        if found is not None:
            return found
    if slides or any(len(parts) > 1 or parts[0] in {"force", "rigid_force"} for parts in of_drives):
        return Abscissa(results.time, over_time=True)
    return abscissa(results.time, results.angle)


def envelope(values: Float[np.ndarray, " n"], bins: int = BINS) -> Int[np.ndarray, " k"]:
    """Indices of the points that give the same drawn curve as all points: the extremes of each group.

    Parameters
    ----------
    values : (n,) [any unit]
    bins : number of groups; a curve of at most two points per group is kept whole

    Returns
    -------
    (k,), rising, with the first and the last point.

    Examples
    --------
    >>> envelope(np.array([0.0, 5.0, 1.0, 2.0, 2.5, -3.0, 0.5]), bins=2).tolist()
    [0, 1, 4, 5, 6]
    """
    n = len(values)
    if n <= 2 * bins:
        return np.arange(n)
    width = -(-n // bins)
    groups = np.append(values, np.full(-n % width, values[-1])).reshape(-1, width)
    first = np.arange(len(groups)) * width
    kept = np.concatenate([[0], first + groups.argmin(axis=1), first + groups.argmax(axis=1)])
    return np.union1d(np.minimum(kept, n - 1), [n - 1])


def draw_panels(figure: Any, along: Abscissa, panels: list[Panel]) -> Any:
    """Draw panels above each other on one abscissa, and the drive angle below if they are over time.

    Returns matplotlib's axes from top to bottom.
    """
    strip = 0 if along.degrees is None else 1
    ratios = [3, 2, 2][: len(panels)] + [1] * strip
    axes = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for ax, panel in zip(axes, panels, strict=False):
        quantity = panel.quantity if len(panels) < 3 else panel.quantity.replace(" ", "\n")
        draw_curves(ax, along, replace(panel, quantity=quantity))
    if along.degrees is not None:
        draw_drive(axes[-1], along)
    draw_abscissa(axes[0], axes[-1], along)
    return axes


def draw_drive(ax: Any, along: Abscissa) -> None:
    """Draw the drive's angle over time."""
    ax.plot(along.values, along.degrees, color="0.35", linewidth=1.2)
    ax.set_ylabel("drive (°)")
    ax.grid(alpha=0.3)


def draw_legend(ax: Any, **look: Any) -> None:
    """Draw the names of curves beside the axes."""
    ax.legend(loc="upper left", **{"bbox_to_anchor": (1.005, 1.02), "frameon": False, **look})


def draw_curves(ax: Any, along: Abscissa, panel: Panel) -> None:
    """Draw curves of one unit, with a legend if there is more than one."""
    from matplotlib.colors import to_rgb

    curves = panel.curves
    peaks = {name: largest(y) for name, y in curves.items()}
    highest = max(peaks.values(), default=0.0)
    divisor, label = prefixed(max(map(abs, panel.limits or (highest,))), panel.unit)
    faint = [name for name in curves if peaks[name] <= FAINT * highest] if len(curves) > 1 else []
    stiff = any(name.endswith(STIFF) and name not in faint for name in curves)
    styles = ("-", ":") if stiff else ("-", "--", ":")
    every = cycle([(f"C{c}", style) for style in styles for c in range(10) if c != 7])
    looks = dict(zip(dict.fromkeys(name.removesuffix(STIFF) for name in curves), every, strict=False))
    # the magnitude is drawn behind its components
    beside = "magnitude" if f"magnitude{STIFF}" not in curves else ""
    marker = "o" if len(along.values) == 1 else ""
    for name, y in curves.items():
        if name in faint:
            continue
        rigid = name.endswith(STIFF)
        color, style = looks[name.removesuffix(STIFF)]
        kept = envelope(y)
        width = 1.3 if len(kept) == len(y) else 0.7
        look = ("0.15", "-", 0.7 * width) if name == beside else (color, "--" if rigid else style, width)
        words = None if rigid and name.removesuffix(STIFF) in curves else _lines(name)
        (line,) = ax.plot(along.values[kept], y[kept] / divisor, marker=marker, label=words)
        line.set(color=look[0], linestyle=look[1], linewidth=look[2], zorder=2 + (name != beside))
        if rigid:  # often close to the elastic curve: darker and above it
            line.set(color=[DARKER * c for c in to_rgb(color)], linewidth=0.8 * width, zorder=4)
    if stiff:
        ax.plot([], [], color="0.2", linestyle="--", label="rigid links")
    if names := [name for name in faint if not (name.endswith(STIFF) and name.removesuffix(STIFF) in faint)]:
        words = ", ".join(names)
        words = words if len(words) <= NAMED else f"{len(names)} others"
        ax.plot([], [], " ", label=_lines(f"{words}: < {100 * FAINT:g} %"))
    if len(curves) > 1:
        draw_legend(ax, ncols=1 + (len(ax.get_legend_handles_labels()[0]) > 18))
    ax.axhline(0.0, color="0.5", linewidth=0.6, zorder=1)
    if panel.limits:
        margin = 0.05 * np.ptp(panel.limits)
        ax.set_ylim((panel.limits[0] - margin) / divisor, (panel.limits[1] + margin) / divisor)
    ax.set_ylabel(f"{panel.quantity} ({label})" if label else panel.quantity)
    ax.ticklabel_format(useOffset=False)
    ax.grid(alpha=0.3)


def _lines(name: str) -> str:
    """Text in lines of a legend, broken after underscores if one word is too long."""
    whole = name.replace(" %", "\1%").replace("< ", "<\1")
    words = re.sub(rf"\S{{{LETTERS + 1},}}", lambda word: word[0].replace("_", "_\0 "), whole)
    broken = "\n".join(textwrap.wrap(words, LETTERS + 1, break_on_hyphens=False)) or name
    return _plain(broken.replace("\0 ", "").replace("\0", "").replace("\1", " "))


def heading(text: str, channel: Channel | None, results: Results) -> str:
    """The title, then the channel with its axes, the recorded steps, and the status of an incomplete run."""
    below = [channel.name] if channel else []
    if channel and channel.frame:
        below.append(f"{channel.frame} axes")
    if results.every > 1:
        below.append(f"one step in {results.every}")
    if results.status != "complete":
        below.append("unreliable" if results.status == "unreliable" else f"not a whole run: {results.status}")
    title = "\n".join(textwrap.wrap(text[:1].upper() + text[1:], 95))
    return _plain("\n".join([title, "  ·  ".join(below)] if below else [title]))


def _plain(text: str) -> str:
    """Text escaped for matplotlib, which would take dollar signs as formulas."""
    return text.replace("$", r"\$")


@contextmanager
def figure_saved(
    path: Path, title: str, size: tuple[float, float] = SIZE, layout: Literal["constrained"] | None = "constrained"
) -> Iterator[Any]:
    """A figure without global state, which is saved as PNG at the end of the context."""
    figure = _figure(size, layout)
    yield figure
    with replacing(path) as part:
        _save(figure, part, title, "png")


def figure_svg(title: str, draw: Callable[[Any], T]) -> tuple[str, T]:
    """A figure as SVG for a page, and the result of drawing it, whose axes have their final positions."""
    figure = _figure(PAGE_SIZE)
    drawn = draw(figure)
    file = io.BytesIO()
    _save(figure, file, title, "svg")
    return file.getvalue().decode(), drawn


def _figure(size: tuple[float, float], layout: Literal["constrained"] | None = "constrained") -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=DPI, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, file: Path | io.BytesIO, title: str, kind: str) -> None:
    figure.suptitle(title, x=0.01, ha="left", fontsize=12)
    if figure.get_layout_engine() is not None:
        figure.get_layout_engine().execute(figure)
        # the layout is fixed, because saving would compute it again by another drawing
        figure.set_layout_engine("none")
    metadata = {"Software": MARK} if kind == "png" else {"Creator": MARK, "Date": None}
    packed = {"pil_kwargs": {"compress_level": COMPRESSION}} if kind == "png" else {}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a letter that the font lacks is drawn as a box
        figure.savefig(file, format=kind, metadata=metadata, **packed)
