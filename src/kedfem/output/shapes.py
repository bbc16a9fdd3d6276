"""Mode shapes: a cycle of each for ParaView, and a picture at its largest."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kedfem.output.animation import AnimationWriter, remove_animation
from kedfem.output.fields import LinkField
from kedfem.output.picture import write_picture
from kedfem.output.vtu import write_frame

FRAMES = 24  # over a cycle
AMPLITUDE = 1e-3  # m: largest displacement of a shape, for which its stresses are
DRAWN = 0.08  # of the size of what is drawn: largest displacement in pictures and animations
MOSTLY = 0.9  # of the squares of all displacements: a shape along one axis
STEM, GROWING = "shape", "growing"


@dataclass(frozen=True, slots=True)
class Shape:
    """A mode shape.

    frequency : [Hz]
    title : of its picture
    fields : of all links with displacements and stresses times the first number, drawn exaggerated by the second
    """

    frequency: float
    title: str
    fields: Callable[[float, float], Sequence[LinkField]]


def write_shapes(
    folder: Path, shapes: Sequence[Shape], gravity: tuple[float, float, float] = (0, 0, 0)
) -> None:
    """``shape_1.pvd`` with its frames over a cycle, ``shape_1.png``, ...; those of an earlier command go.

    Shapes are written with a largest displacement of AMPLITUDE, stresses with it.

    Raises
    ------
    OutputError
        A file cannot be written, or VTK cannot draw here.
    """
    for old in folder.glob(f"{STEM}_*.pvd"):
        remove_animation(folder, old.stem)
        old.with_suffix(".png").unlink(missing_ok=True)
    for k, shape in enumerate(shapes, 1):
        name = f"{STEM}_{k}"
        still = shape.fields(1.0, 0.0)
        points = np.concatenate([each.points for each in still])
        largest = max(float(np.linalg.norm(each.displacement, axis=1).max(initial=0.0)) for each in still)
        factor = AMPLITUDE / largest if largest else 1.0
        exaggeration = float(f"{DRAWN * float(np.linalg.norm(np.ptp(points, axis=0))) / AMPLITUDE:.2g}")
        writer = AnimationWriter(folder, name)
        for j in range(FRAMES):
            swing = float(np.cos(2 * np.pi * j / FRAMES))
            writer.add(j / FRAMES / shape.frequency, shape.fields(factor * swing, exaggeration))
        title = f"{shape.title}{_along(still)}; stress for a displacement of {1e3 * AMPLITUDE:g} mm"
        _write_picture(
            shape.fields(factor, exaggeration), folder / f"{name}.png", title, exaggeration, gravity
        )


def write_growing(
    folder: Path, title: str, frames: Sequence[tuple[float, Callable[[float, float], Sequence[LinkField]]]],
    gravity: tuple[float, float, float] = (0, 0, 0),
) -> None:  # fmt: skip
    """A vibration about a moving mechanism: ``growing.pvd``, and ``growing.png`` of the frame where it is largest.

    Parameters
    ----------
    frames : time [s], and the fields of all links as a `Shape` has them, of one and the same amplitude

    Raises
    ------
    OutputError
        A file cannot be written, or VTK cannot draw here.
    """
    largest = [
        max(float(np.linalg.norm(each.displacement, axis=1).max(initial=0.0)) for each in fields(1.0, 0.0))
        for _, fields in frames
    ]
    k = int(np.argmax(largest))
    still = frames[k][1](1.0, 0.0)
    size = float(np.linalg.norm(np.ptp(np.concatenate([each.points for each in still]), axis=0)))
    exaggeration = float(f"{DRAWN * size / AMPLITUDE:.2g}")
    writer = AnimationWriter(folder, GROWING)
    for t, fields in frames:
        writer.add(t, fields(AMPLITUDE / (largest[k] or 1.0), exaggeration))
    whole = f"{title}{_along(still)}; stress for a displacement of {1e3 * AMPLITUDE:g} mm"
    shown = frames[k][1](AMPLITUDE / (largest[k] or 1.0), exaggeration)
    _write_picture(shown, folder / f"{GROWING}.png", whole, exaggeration, gravity)


def _write_picture(
    fields: Sequence[LinkField],
    png: Path,
    title: str,
    exaggeration: float,
    gravity: tuple[float, float, float],
) -> None:
    with TemporaryDirectory() as apart:
        frame = Path(apart) / "frame.vtu"
        write_frame(frame, 0.0, fields)
        write_picture(frame, png, title, exaggeration, gravity)


def _along(fields: Sequence[LinkField]) -> str:
    """The world's axis along which nearly everything moves, which a picture may be looked along."""
    parts = sum((each.displacement**2).sum(axis=0) for each in fields)
    k = int(np.argmax(parts))
    return f", along {'xyz'[k]}" if np.asarray(parts)[k] > MOSTLY * np.sum(parts) else ""
