"""Schemes whose stages are solved one after the other, or as a complex pair; and levels of generalised-α.

What a table says of a scheme: the work that it needs for an error, between the marches beside it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

Tableau = tuple[Float[np.ndarray, "s s"], Float[np.ndarray, " s"], Float[np.ndarray, " s"]]
ASKED = (1e-2, 1e-3, 1e-4, 1e-6)
RHO = 0.95  # ρ∞ of generalised-α, the package's default
Curves = Mapping[str, tuple[Sequence[float], Sequence[float]]]
"""Work and error of the marches of each scheme."""


@dataclass(frozen=True)
class Scheme:
    """A scheme: the tableau of its stages (none: generalised-α), levels that are extrapolated."""

    name: str
    tableau: Tableau | None = None
    levels: int = 1

    @property
    def solves(self) -> int:
        """Of a step: one an implicit stage, twice that where stages are coupled; of all levels together."""
        stages = 1 if self.tableau is None else int((self.tableau[0].diagonal() != 0).sum())
        coupled = self.tableau is not None and is_coupled(self.tableau)
        levels: int = 2**self.levels - 1
        return stages * (2 if coupled else 1) * levels


def is_coupled(tableau: Tableau) -> bool:
    """Whether stages depend on later ones."""
    return bool(np.triu(tableau[0], 1).any())


def _diagonal(A: list[list[float]], b: list[float]) -> Tableau:
    rows = np.zeros((len(A), len(A)))
    for k, row in enumerate(A):
        rows[k, : len(row)] = row
    return rows, np.array(b), rows.sum(axis=1)


def _suzuki() -> Tableau:
    """Five midpoint steps, the middle one backwards (M. Suzuki, Phys. Lett. A 146, 1990): order 4."""
    p = 1 / (4 - 4 ** (1 / 3))
    w = np.array([p, p, 1 - 4 * p, p, p])
    A = np.tril(np.broadcast_to(w, (5, 5)), -1) + np.diag(w / 2)
    return A, w, A.sum(axis=1)


ALEXANDER = 0.4358665215084590  # root of x³ − 3x² + 3x/2 − 1/6
CROUZEIX = np.cos(np.pi / 18) / np.sqrt(3) + 0.5
SQ3 = np.sqrt(3)
KENNEDY = [82889 / 524892, 0.0, 15625 / 83664, 69875 / 102672, -2260 / 8211, 1 / 4]
SCHEMES = (
    Scheme("generalised-α, ρ∞ = 0.95"),
    Scheme("two levels", levels=2),
    Scheme("three levels", levels=3),
    Scheme("SDIRK of order 2, L-stable", _diagonal([[1 - np.sqrt(0.5)], [np.sqrt(0.5), 1 - np.sqrt(0.5)]],
           [np.sqrt(0.5), 1 - np.sqrt(0.5)])),
    Scheme("SDIRK of order 3, L-stable (Alexander)", _diagonal(
        [[ALEXANDER], [(1 - ALEXANDER) / 2, ALEXANDER],
         [-(6 * ALEXANDER**2 - 16 * ALEXANDER + 1) / 4, (6 * ALEXANDER**2 - 20 * ALEXANDER + 5) / 4, ALEXANDER]],
        [-(6 * ALEXANDER**2 - 16 * ALEXANDER + 1) / 4, (6 * ALEXANDER**2 - 20 * ALEXANDER + 5) / 4, ALEXANDER])),
    Scheme("SDIRK of order 4, A-stable (Crouzeix)", _diagonal(
        [[CROUZEIX], [0.5 - CROUZEIX, CROUZEIX], [2 * CROUZEIX, 1 - 4 * CROUZEIX, CROUZEIX]],
        [1 / (6 * (1 - 2 * CROUZEIX) ** 2), 1 - 1 / (3 * (1 - 2 * CROUZEIX) ** 2), 1 / (6 * (1 - 2 * CROUZEIX) ** 2)])),
    Scheme("SDIRK of order 4, L-stable (Hairer and Wanner)", _diagonal(
        [[1 / 4], [1 / 2, 1 / 4], [17 / 50, -1 / 25, 1 / 4], [371 / 1360, -137 / 2720, 15 / 544, 1 / 4],
         [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4]], [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4])),
    Scheme("ESDIRK of order 4, L-stable (Kennedy and Carpenter)", _diagonal(
        [[0.0], [1 / 4, 1 / 4], [8611 / 62500, -1743 / 31250, 1 / 4],
         [5012029 / 34652500, -654441 / 2922500, 174375 / 388108, 1 / 4],
         [15267082809 / 155376265600, -71443401 / 120774400, 730878875 / 902184768, 2285395 / 8070912, 1 / 4], KENNEDY],
        KENNEDY)),
    Scheme("composition of five midpoint steps (Suzuki)", _suzuki()),
    Scheme("Gauss, two stages, order 4", (np.array([[1 / 4, 1 / 4 - SQ3 / 6], [1 / 4 + SQ3 / 6, 1 / 4]]),
           np.array([0.5, 0.5]), np.array([0.5 - SQ3 / 6, 0.5 + SQ3 / 6]))),
    Scheme("Radau IIA, two stages, order 3", (np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]]),
           np.array([0.75, 0.25]), np.array([1 / 3, 1.0]))),
)  # fmt: skip


def extrapolated(runs: Sequence[Float[np.ndarray, "S N"]]) -> Float[np.ndarray, "S N"]:
    """Runs of generalised-α with steps of h, h/2, h/4, combined."""
    for order in range(1, len(runs)):
        runs = [b + (b - a) / (4**order - 1) for a, b in pairwise(runs)]
    return runs[0]


def needed(work: Sequence[float], errors: Sequence[float], asked: float) -> str:
    """Work for an error, between the marches beside it; the last march whose error is larger counts."""
    above = max((k for k, e in enumerate(errors) if not e <= asked), default=None)
    if above is None:
        return f"< {work[0]:,.0f}"
    if above == len(work) - 1:
        return f"> {work[-1]:,.0f}"
    (w0, w1), (e0, e1) = work[above : above + 2], errors[above : above + 2]
    if not np.isfinite(e0):
        return f"{w1:,.0f}"
    return f"{np.exp(np.interp(np.log(1 / asked), np.log([1 / e0, 1 / e1]), np.log([w0, w1]))):,.0f}"


def row(name: str, curve: tuple[Sequence[float], Sequence[float]]) -> tuple[str, ...]:
    """What a scheme needs for each error that is asked for."""
    return (name, *(needed(*curve, asked) for asked in ASKED))


def write_grid(path: Path, drawn: Mapping[str, Curves], label: str) -> None:
    """Error against work as PNG, a field for each scene."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    figure = Figure(figsize=(11, 7), layout="constrained")
    fields = figure.subplots(2, 3, sharey=True).ravel()
    names = [scheme.name for scheme in SCHEMES]
    for axes, (title, curves) in zip(fields, drawn.items(), strict=False):
        for name, (x, y) in curves.items():
            k = names.index(name)
            style = "-" if "level" in name or "α" in name else "--"
            axes.loglog(
                x,
                y,
                marker="osd^vx*P<>hp"[k],
                markersize=4,
                linestyle=style,
                color=f"C{k}" if k < 10 else "black",
                label=name,
            )
        axes.axhline(1e-4, color="grey", linewidth=0.8)
        axes.set_title(title, fontsize=9, wrap=True)
        axes.set_ylim(1e-7, 1)
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(visible=True, which="both", alpha=0.3)
        axes.set_xlabel(label, fontsize=9)
    for axes in fields[::3]:
        axes.set_ylabel("error")
    for axes in fields[len(drawn) :]:
        axes.axis("off")
    fields[-1].legend(*fields[0].get_legend_handles_labels(), loc="center", fontsize=8, frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
