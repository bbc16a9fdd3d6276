"""Draws docs/pictures/joints.png for docs/conventions.md: `python docs/pictures/joints.py`."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Polygon
from PIL import Image

Vector = Sequence[float]
FIRST, SECOND, MOTION = "#4a90d9", "#b9b9b9", "#c0392b"
X, Y, Z = np.eye(3)
VIEW = np.array([[0.87, 0.45, 0.0], [-0.28, 0.42, 0.9]])  # paper coordinates of x, y and z


def flat(points: np.ndarray) -> np.ndarray:
    """Points (n, 3) on paper."""
    return np.asarray(points @ VIEW.T)


def circle(centre: Vector, axis: Vector, radius: float, degrees: np.ndarray) -> np.ndarray:
    """Points (n, 3) of a circle about an axis, by the right hand."""
    d = np.asarray(axis, float) / np.linalg.norm(axis)
    u = np.cross(d, Z if abs(d[2]) < 0.9 else X)
    u /= np.linalg.norm(u)
    t = np.radians(degrees)[:, None]
    return np.asarray(np.asarray(centre, float) + radius * (np.cos(t) * u + np.sin(t) * np.cross(d, u)))


class Sheet:
    """One drawing; what is drawn later lies above."""

    def __init__(self, ax: Axes, title: str, words: str) -> None:
        self.ax, self.level = ax, 1.0
        ax.set_title(title, fontsize=12, fontweight="bold", pad=2)
        ax.text(0.5, -0.02, words, transform=ax.transAxes, ha="center", va="top", fontsize=8.5)
        ax.set(xlim=(-1.75, 1.75), ylim=(-1.45, 1.55), aspect="equal")
        ax.axis("off")

    def _next(self) -> float:
        self.level += 1
        return self.level

    def box(self, centre: Vector, size: Vector, colour: str) -> None:
        """A box, its three visible faces."""
        c, (a, b, h) = np.asarray(centre), np.asarray(size) / 2
        for normal, u, v, shade in (
            (-a * X, b * Y, h * Z, 0.85),
            (-b * Y, a * X, h * Z, 0.7),
            (h * Z, a * X, b * Y, 1.0),
        ):
            face = [c + normal + s * u + t * v for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            rgb = np.asarray(mpl.colors.to_rgb(colour)) * shade + (1 - shade) * 0.25
            self.ax.add_patch(Polygon(flat(np.array(face)), facecolor=rgb, edgecolor="#333", lw=0.7, zorder=self._next()))

    def rod(self, a: Vector, b: Vector, radius: float, colour: str) -> None:
        """A round bar from one point to another."""
        a, b = np.asarray(a, float), np.asarray(b, float)
        ends = [circle(end, b - a, radius, np.linspace(0, 360, 60)) for end in (a, b)]
        across = np.array([-1, 1]) * (VIEW @ (b - a))[::-1]
        width = radius * across / np.linalg.norm(across)
        body = np.array([flat(a) + width, flat(b) + width, flat(b) - width, flat(a) - width])
        z = self._next()
        for points in (flat(ends[0]), body, flat(ends[1])):
            self.ax.add_patch(Polygon(points, facecolor=colour, edgecolor="#333", lw=0.7, zorder=z))

    def ball(self, centre: Vector, radius: float, colour: str) -> None:
        """A ball."""
        circle = plt.Circle(
            tuple(flat(np.asarray(centre, float))), radius, fc=colour, ec="#333", lw=0.7, zorder=self._next()
        )
        self.ax.add_patch(circle)

    def axis(self, a: Vector, b: Vector, name: str = "axis") -> None:
        """A dash-dotted line with an arrow head at its positive end."""
        p, q = flat(np.array([a, b], float))
        arrow = FancyArrowPatch(tuple(p), tuple(q), arrowstyle="-|>", mutation_scale=11, ls=(0, (6, 2, 1, 2)), lw=1.0,
                                color="black", zorder=50)  # fmt: skip
        self.ax.add_patch(arrow)
        self.ax.annotate(name, tuple(q), xytext=(4, 3), textcoords="offset points", fontsize=9, zorder=60)

    def slide(self, a: Vector, b: Vector) -> None:
        """An arrow of positive travel."""
        self._arrow(*flat(np.array([a, b], float)))

    def _arrow(self, p: np.ndarray, q: np.ndarray) -> None:
        """An arrow on paper, of a positive motion."""
        arrow = FancyArrowPatch(tuple(p), tuple(q), arrowstyle="-|>", mutation_scale=15, lw=2.2, color=MOTION, zorder=55)
        self.ax.add_patch(arrow)

    def rotation(self, centre: Vector, axis: Vector, radius: float, since: float = -150, to: float = 110) -> None:
        """An arrow of positive rotation, by the right hand about an axis."""
        p = flat(circle(centre, axis, radius, np.linspace(since, to, 60)))
        self.ax.plot(p[:-2, 0], p[:-2, 1], color=MOTION, lw=2.2, zorder=55)
        self._arrow(p[-6], p[-1])


def _revolute(s: Sheet) -> None:
    s.rod((0, 0, -0.6), (0, 0, 0.1), 0.34, SECOND)
    s.box((0.6, 0, 0.25), (1.7, 0.5, 0.26), FIRST)
    s.axis((0, 0, -1.2), (0, 0, 1.4))
    s.rotation((0, 0, 0.85), Z, 0.42)


def _prismatic(s: Sheet) -> None:
    s.box((0, 0, -0.35), (3.0, 0.7, 0.25), SECOND)
    s.box((0, 0, 0.02), (0.9, 0.7, 0.45), FIRST)
    s.axis((-1.7, 0, -0.0), (1.85, 0, 0.0))
    s.slide((-0.2, 0, 0.62), (0.95, 0, 0.62))


def _cylindrical(s: Sheet) -> None:
    s.rod((-1.5, 0, 0), (1.5, 0, 0), 0.16, SECOND)
    s.rod((-0.5, 0, 0), (0.5, 0, 0), 0.4, FIRST)
    s.axis((-1.7, 0, 0), (1.9, 0, 0))
    s.slide((-0.3, 0, 0.75), (0.8, 0, 0.75))
    s.rotation((1.0, 0, 0), X, 0.5)


def _screw(s: Sheet) -> None:
    s.rod((-1.5, 0, 0), (1.5, 0, 0), 0.16, SECOND)
    for x in np.arange(-1.4, 1.5, 0.16):
        p = flat(np.array([[x - 0.04, 0, -0.17], [x + 0.06, 0, 0.17]]))
        s.ax.plot(p[:, 0], p[:, 1], color="#555", lw=0.8, zorder=s.level + 0.5)
    s.box((0, 0, 0), (0.7, 0.75, 0.75), FIRST)
    s.axis((-1.7, 0, 0), (1.9, 0, 0))
    s.slide((-0.3, 0, 0.75), (0.7, 0, 0.75))
    s.rotation((1.0, 0, 0), X, 0.5)


def _spherical(s: Sheet) -> None:
    s.box((0, 0, -0.65), (1.0, 1.0, 0.4), SECOND)
    s.ball((0, 0, -0.15), 0.42, SECOND)
    s.rod((0, 0, 0.0), (0.5, 0, 1.1), 0.13, FIRST)
    s.ball((0, 0, -0.1), 0.3, FIRST)
    s.rotation((0, 0, -0.1), Z, 0.8, -60, 60)
    s.rotation((0, 0, -0.1), X, 0.8, -20, 60)
    s.rotation((0, 0, -0.1), Y, 0.8, 20, 100)


def _universal(s: Sheet) -> None:
    s.rod((-1.6, 0, 0), (-0.45, 0, 0), 0.2, FIRST)
    s.box((-0.3, 0, 0), (0.3, 0.95, 0.2), FIRST)
    s.rod((0, 0, -0.45), (0, 0, 0.45), 0.09, "#dddddd")
    s.rod((0, -0.5, 0), (0, 0.5, 0), 0.09, "#dddddd")
    s.box((0.3, 0, 0), (0.3, 0.2, 0.95), SECOND)
    s.rod((0.45, 0, 0), (1.6, 0, 0), 0.2, SECOND)
    s.axis((0, -1.5, 0), (0, 1.6, 0), "axes[0]")
    s.axis((0, 0, -1.1), (0, 0, 1.3), "axes[1]")
    s.rotation((0, 1.0, 0), Y, 0.26)
    s.rotation((0, 0, 0.9), Z, 0.3)


def _planar(s: Sheet) -> None:
    s.box((0, 0, -0.45), (2.7, 1.7, 0.15), SECOND)
    s.box((0, 0, -0.2), (0.8, 0.7, 0.35), FIRST)
    s.axis((0, 0, -0.2), (0, 0, 1.4))
    s.slide((0.4, 0, -0.15), (1.25, 0, -0.15))
    s.slide((0.0, 0.35, -0.05), (0, 1.2, -0.05))
    s.rotation((0, 0, 0.75), Z, 0.38)


def _slot(s: Sheet) -> None:
    s.box((0, 0.22, -0.25), (3.0, 0.25, 0.3), SECOND)
    s.rod((0, 0, -0.6), (0, 0, 0.5), 0.13, FIRST)
    s.box((0, -0.22, -0.25), (3.0, 0.25, 0.3), SECOND)
    s.box((-0.35, 0, 0.5), (1.0, 0.4, 0.2), FIRST)
    s.axis((-1.7, 0, -0.1), (1.85, 0, -0.1))
    s.slide((0.2, 0, 0.25), (1.1, 0, 0.25))


def _weld(s: Sheet) -> None:
    s.box((0.75, 0, 0), (1.5, 0.5, 0.4), SECOND)
    s.box((-0.75, 0, 0), (1.5, 0.5, 0.4), FIRST)


JOINTS = (
    (_revolute, "released: rotation about axis\nconstrained: 3 displacements, 2 rotations"),
    (_prismatic, "released: travel along axis\nconstrained: 2 displacements, 3 rotations"),
    (_cylindrical, "released: travel along, rotation about axis\nconstrained: 2 displacements, 2 rotations"),
    (_screw, "released: rotation, which is travel / lead · 2π\nconstrained: 2 displacements, 2 rotations, their ratio"),
    (_spherical, "released: 3 rotations\nconstrained: 3 displacements"),
    (_universal, "released: rotations about both axes\nconstrained: 3 displacements, 1 rotation"),
    (_planar, "released: 2 displacements across, rotation about axis\nconstrained: 1 displacement, 2 rotations"),
    (_slot, "released: travel of the pin along axis, 3 rotations\nconstrained: 2 displacements"),
    (_weld, "released: nothing\nconstrained: 3 displacements, 3 rotations"),
)


def main() -> None:
    """All joints on one sheet."""
    figure, axes = plt.subplots(3, 3, figsize=(11, 11.5), dpi=64)
    for ax, (draw, words) in zip(axes.flat, JOINTS, strict=True):
        draw(Sheet(ax, draw.__name__[1:], words))
    figure.text(
        0.5, 0.985, "blue: the link that the coordinate is of; grey: the other; red: positive", ha="center", fontsize=11
    )
    figure.subplots_adjust(0.01, 0.045, 0.96, 0.95, 0.02, 0.24)
    figure.canvas.draw()
    colours = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB").quantize(48)
    colours.save(Path(__file__).with_name("joints.png"), optimize=True)


if __name__ == "__main__":
    main()
