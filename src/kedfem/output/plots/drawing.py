"""How curves over the drive angle are drawn; `groups` says which pictures there are."""

import io
import textwrap
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import cycle
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from jaxtyping import Float, Int

from kedfem.output.plots.abscissa import Abscissa, abscissa, draw_abscissa
from kedfem.output.plots.groups import STIFF, Curves, Panel, Picture, pictures
from kedfem.output.words import prefixed
from kedfem.results import Channel, Results, replacing

T = TypeVar("T")

SIZE = (11.0, 6.2)  # inches, at DPI dots each
PAGE_SIZE = (8.4, 4.8)  # inches of a figure that is one of many on a page
DPI = 120

# groups of points in a long curve, about one per pixel; each keeps its smallest and largest value
BINS = 1500
NEGLIGIBLE = 1e-9  # a component below this part of the channel's peak is named in the legend instead of drawn
COMPRESSION = 3  # of PNGs: files a fifth larger than with the usual 6, written in a third of the time
# what a PNG of this room says of itself, so that stale ones are distinguished from a user's own
MARK = "kedfem plot"
DARKER = 0.5  # what is left of a color in the curve of rigid links


def _largest(values: Float[np.ndarray, "..."]) -> float:
    return float(np.max(np.abs(values), where=np.isfinite(values), initial=0.0))


def worth_drawing(results: Results) -> Iterator[Picture]:
    """All pictures but those of rounding only, which the table of a run reports as ≈ 0; nothing at all is drawn, once."""
    highest: dict[str, float] = {}
    for channel, values in results.channels.values():
        highest[channel.unit] = max(highest.get(channel.unit, 0.0), _largest(values))
    for picture in pictures(results):
        above = highest.get(picture.channel.unit, 0.0) if picture.channel else 0.0
        largest = max((_largest(y) for _, _, curves in picture.panels for y in curves.values()), default=0.0)
        if not above or largest > NEGLIGIBLE * above:
            yield picture


def drawn_over(results: Results) -> Abscissa:
    """The drive angle or time; time alone where channels are of a drive that slides, or of several."""
    of_drives = [name.split("/")[1:] for name in results.channels if name.startswith("drive/")]
    slides = results.drive.unit == "m"
    if slides or any(len(parts) > 1 or parts[0] in {"force", "rigid_force"} for parts in of_drives):
        return Abscissa(results.time, over_time=True)
    return abscissa(results.time, results.angle)


def envelope(values: Float[np.ndarray, " n"], bins: int = BINS) -> Int[np.ndarray, " k"]:
    """Numbers of the points that draw the same curve as all of them: the extremes of each group.

    Parameters
    ----------
    values : (n,) [any unit]
    bins : groups; a curve of no more than two points a group is kept whole

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
    """The panels one above the other on one abscissa; below, where needed, the drive angle over time.

    The axes of matplotlib, from top to bottom.
    """
    strip = 0 if along.degrees is None else 1
    ratios = [3, 2, 2][: len(panels)] + [1] * strip
    axes = figure.subplots(len(ratios), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for ax, (quantity, unit, curves) in zip(axes, panels, strict=False):
        draw_curves(ax, along, curves, quantity if len(panels) < 3 else quantity.replace(" ", "\n"), unit)
    if along.degrees is not None:
        axes[-1].plot(along.values, along.degrees, color="0.35", linewidth=1.2)
        axes[-1].set_ylabel("drive (°)")
        axes[-1].grid(alpha=0.3)
    draw_abscissa(axes[0], axes[-1], along)
    return axes


def draw_curves(ax: Any, along: Abscissa, curves: Curves, quantity: str, unit: str) -> None:
    """Curves of one unit, with a legend where there is more than one."""
    from matplotlib.colors import to_rgb

    peaks = {name: float(np.max(np.abs(y), where=np.isfinite(y), initial=0.0)) for name, y in curves.items()}
    largest = max(peaks.values(), default=0.0)
    divisor, label = prefixed(largest, unit)
    zero = [name for name in curves if peaks[name] <= NEGLIGIBLE * largest] if len(curves) > 1 else []
    styles = ("-", ":") if any(name.endswith(STIFF) for name in curves) else ("-", "--", ":")
    every = cycle([(f"C{c}", style) for style in styles for c in range(10) if c != 7])
    looks = dict(zip(dict.fromkeys(name.removesuffix(STIFF) for name in curves), every, strict=False))
    beside = (
        "magnitude" if f"magnitude{STIFF}" not in curves else ""
    )  # what stands back behind its components
    marker = "o" if len(along.values) == 1 else ""
    for name, y in curves.items():
        color, style = looks[name.removesuffix(STIFF)]
        style = "--" if name.endswith(STIFF) else style
        if name in zero:
            continue
        kept = envelope(y)
        width = 1.3 if len(kept) == len(y) else 0.7
        look = ("0.15", "-", 0.7 * width) if name == beside else (color, style, width)
        (line,) = ax.plot(along.values[kept], y[kept] / divisor, marker=marker, label=_plain(name))
        line.set(color=look[0], linestyle=look[1], linewidth=look[2], zorder=2 + (name != beside))
        if name.endswith(STIFF):  # often along the elastic one: darker, and above it
            line.set(color=[DARKER * c for c in to_rgb(color)], linewidth=0.8 * width, zorder=4)
    if zero:
        ax.plot([], [], " ", label=_plain(textwrap.fill(", ".join(zero), 18) + "  ≈ 0"))
    if len(curves) > 1:
        ax.legend(loc="upper left", bbox_to_anchor=(1.005, 1.02), frameon=False, ncols=1 + (len(curves) > 18))
    ax.axhline(0.0, color="0.5", linewidth=0.6, zorder=1)
    ax.set_ylabel(f"{quantity} ({label})" if label else quantity)
    ax.ticklabel_format(useOffset=False)
    ax.grid(alpha=0.3)


def heading(text: str, channel: Channel | None, results: Results) -> str:
    """The title, then the channel with its axes and, for a run that did not end, its status."""
    below = [channel.name] if channel else []
    if channel and channel.frame:
        below.append(f"{channel.frame} axes")
    if results.status != "complete":
        below.append("doubtful" if results.status == "doubtful" else f"not a whole run: {results.status}")
    title = "\n".join(textwrap.wrap(text[:1].upper() + text[1:], 95))
    return _plain("\n".join([title, "  ·  ".join(below)] if below else [title]))


def _plain(text: str) -> str:
    """Text that matplotlib does not take for a formula."""
    return text.replace("$", r"\$")


@contextmanager
def figure_saved(
    path: Path,
    title: str,
    size: tuple[float, float] = SIZE,
    layout: Literal["constrained"] | None = "constrained",
) -> Iterator[Any]:
    """A figure of its own (no global state), written to a PNG when it is drawn."""
    figure = _figure(size, layout)
    yield figure
    with replacing(path) as part:
        _save(figure, part, title, "png")


def figure_svg(title: str, draw: Callable[[Any], T]) -> tuple[str, T]:
    """A figure as SVG for a page, and what drawing it returned; the places of its axes are final then."""
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
        # it stays: saving would find it anew, by drawing all of it once more
        figure.set_layout_engine("none")
    metadata = {"Software": MARK} if kind == "png" else {"Creator": MARK, "Date": None}
    packed = {"pil_kwargs": {"compress_level": COMPRESSION}} if kind == "png" else {}
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # a letter that the font lacks is drawn as a box
        figure.savefig(file, format=kind, metadata=metadata, **packed)
