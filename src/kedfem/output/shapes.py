"""Files of mode shapes: a cycle of each for ParaView, and a picture at the largest displacement."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kedfem.output.animation import AnimationWriter, remove_animation
from kedfem.output.fields import LinkField
from kedfem.output.picture import write_picture
from kedfem.output.vtu import write_frame

FRAMES = 24  # of a cycle
AMPLITUDE = 1e-3  # m, largest displacement of a shape, to which its stresses belong
DRAWN = 0.08  # largest drawn displacement, in sizes of the mechanism
MOSTLY = 0.9  # least share of one axis in the squares of all displacements of a shape along this axis
STEM, GROWING = "shape", "growing"
Fields = Callable[[float, float], Sequence[LinkField]]
Gravity = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Shape:
    """A mode shape.

    frequency : [Hz]
    title : title of its picture
    fields : function of a factor on displacements and stresses and of the deformation scale: fields of all links
    """

    frequency: float
    title: str
    fields: Fields


def write_shapes(folder: Path, shapes: Sequence[Shape], gravity: Gravity = (0, 0, 0)) -> None:
    """Write ``shape_1.pvd`` with its frames over a cycle, ``shape_1.png``, …; earlier files of shapes are removed.

    The largest displacement of a shape is AMPLITUDE, to which its stresses belong.
    """
    for old in folder.glob(f"{STEM}_*.pvd"):
        remove_animation(folder, old.stem)
        old.with_suffix(".png").unlink(missing_ok=True)
    for k, shape in enumerate(shapes, 1):
        cycle = np.arange(FRAMES) / FRAMES
        frames = [
            (t / shape.frequency, _times(shape.fields, swing))
            for t, swing in zip(cycle.tolist(), np.cos(2 * np.pi * cycle).tolist(), strict=True)
        ]
        _write(folder, f"{STEM}_{k}", shape.title, frames, 0, gravity)


def write_growing(folder: Path, title: str, frames: Sequence[tuple[float, Fields]], gravity: Gravity = (0, 0, 0)) -> None:
    """Write a vibration about a moving mechanism: ``growing.pvd``, and ``growing.png`` of the largest frame.

    Parameters
    ----------
    frames : times [s], and fields as of `Shape`, all of the same amplitude
    """
    k = int(np.argmax([_largest(fields(1.0, 0.0)) for _, fields in frames]))
    _write(folder, GROWING, title, frames, k, gravity)


def _times(fields: Fields, factor: float) -> Fields:
    return lambda size, exaggeration: fields(factor * size, exaggeration)


def _largest(fields: Sequence[LinkField]) -> float:
    """The largest of all displacements [m]."""
    return max(float(np.linalg.norm(each.displacement, axis=1).max(initial=0.0)) for each in fields)


def _write(folder: Path, name: str, title: str, frames: Sequence[tuple[float, Fields]], k: int, gravity: Gravity) -> None:
    """Write an animation of frames, and a picture of the k-th, in which displacements are largest."""
    still = frames[k][1](1.0, 0.0)
    size = float(np.linalg.norm(np.ptp(np.concatenate([each.points for each in still]), axis=0)))
    exaggeration = float(f"{DRAWN * size / AMPLITUDE:.2g}")
    factor = AMPLITUDE / (_largest(still) or 1.0)
    writer = AnimationWriter(folder, name)
    for t, fields in frames:
        writer.add(t, fields(factor, exaggeration))
    whole = f"{title}{_along(still)}; stress for a displacement of {1e3 * AMPLITUDE:g} mm"
    with TemporaryDirectory() as apart:
        frame = Path(apart) / "frame.vtu"
        write_frame(frame, 0.0, frames[k][1](factor, exaggeration))
        write_picture(frame, folder / f"{name}.png", whole, exaggeration, gravity)


def _along(fields: Sequence[LinkField]) -> str:
    """Words for the world's axis along which nearly everything moves, which a picture may not show; else empty."""
    parts = sum((each.displacement**2).sum(axis=0) for each in fields)
    k = int(np.argmax(parts))
    return f", along {'xyz'[k]}" if np.asarray(parts)[k] > MOSTLY * np.sum(parts) else ""
