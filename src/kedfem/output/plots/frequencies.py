"""Natural frequencies over a revolution of the drive, and the Campbell plot, as PNG."""

from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.output.plots.drawing import draw_legend, figure_saved
from kedfem.scene.records.units import RPM


def write_over_drive(
    path: Path, t: Float[np.ndarray, " P"], angle: Float[np.ndarray, " P"], values: Float[np.ndarray, "P f"],
    revolutions: bool,
) -> None:  # fmt: skip
    """Plot natural frequencies [Hz] over the angle of a continuously rotating drive, else over time."""
    x = np.degrees(angle) if revolutions else t
    with figure_saved(path, "Natural frequencies of the linkage frozen at positions") as figure:
        ax = figure.subplots()
        for k, f in enumerate(values.T, 1):
            ax.plot(x, f, marker=".", label=f"{k}")
        ax.set_xlabel("drive angle (°)" if revolutions else "time (s)")
        ax.set_ylabel("frequency (Hz)")
        ax.set_ylim(bottom=0.0)
        ax.grid(alpha=0.3)
        draw_legend(ax, title="mode")


def write_campbell(
    path: Path, speeds: Float[np.ndarray, " x"], lowest: Float[np.ndarray, "f x"],
    highest: Float[np.ndarray, "f x"], speed: float, harmonics: int,
) -> None:  # fmt: skip
    """Plot bands of the natural frequencies over a revolution [Hz] and the drive's harmonics over its speed [rad/s].

    Parameters
    ----------
    speed : the scene's speed of the drive [rad/s]
    """
    rpm = RPM * speeds
    title = "Campbell plot: natural frequencies over a revolution, harmonics of the drive"
    with figure_saved(path, title) as figure:
        ax = figure.subplots()
        for k, (least, most) in enumerate(zip(lowest, highest, strict=True)):
            if np.isfinite(least).all() and (least.min() <= harmonics * rpm[-1] / 60 or k == 0):
                look = {"color": f"C{k % 10}"}
                ax.fill_between(rpm, least, most, alpha=0.4, label=f"mode {k + 1}", **look)
                ax.plot(rpm, least, linewidth=0.8, **look)
        for k in range(1, harmonics + 1):
            ax.plot(rpm, k * rpm / 60, color="0.25", linewidth=0.9, linestyle="--")
            ax.annotate(f"{k}×", (rpm[-1], k * rpm[-1] / 60), xytext=(3, -3), textcoords="offset points")
        ax.axvline(RPM * speed, color="0.5", linewidth=0.9, linestyle=":")
        ax.set_xlabel("drive speed (rpm); dotted: the scene's")
        ax.set_ylabel("frequency (Hz)")
        ax.grid(alpha=0.3)
        draw_legend(ax, bbox_to_anchor=(1.04, 1.02))
