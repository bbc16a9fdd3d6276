"""One rendered picture of a frame of the animation."""

import subprocess
import sys
from pathlib import Path

from kedfem.errors import OutputError
from kedfem.results import replacing

TIMEOUT = 300
"""Seconds after which rendering is given up, e.g. with a display that does not answer."""

ADVICE = "picture: must be drawn by VTK, for which Linux without a display needs libEGL (package libegl1)"


def write_picture(
    vtu: Path,
    png: Path,
    title: str,
    deformation_scale: float = 1.0,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Draw the links of a VTU file, deformed as they are there, coloured by von Mises stress.

    VTK draws in a process of its own: without any way to open a window it ends by a segmentation fault, and
    graphics drivers talk on the terminal.

    Parameters
    ----------
    vtu
        A frame of :class:`~kedfem.output.AnimationWriter`.
    png
        The picture.
    title
        Written above; long ones are wrapped.
    exaggeration
        Of the deformation in the frame, written below.
    gravity : (3,) [m/s²]
        Points down in the picture, unless it is looked along.

    Raises
    ------
    OutputError
        The frame cannot be read, VTK cannot open a window here, or the PNG cannot be written.
    """
    vtu = Path(vtu)
    if not vtu.is_file():
        raise OutputError(f"{vtu}: must be a frame of the animation, got no such file")
    with replacing(Path(png)) as part:
        drawing = Path(__file__).with_name("rendering.py")
        command = [
            sys.executable,
            "-P",
            str(drawing),
            str(vtu),
            str(part),
            title,
            str(deformation_scale),
            *map(str, gravity),
        ]
        try:
            done = subprocess.run(command, capture_output=True, timeout=TIMEOUT, check=False)
        except subprocess.TimeoutExpired as error:
            raise OutputError(f"{ADVICE}, got no picture within {TIMEOUT} s") from error
        if done.returncode != 0 or not part.is_file():
            raise OutputError(drawing_fault(f"{vtu}: must be a frame", done))


def drawing_fault(wanted: str, done: "subprocess.CompletedProcess[bytes]") -> str:
    """Why there is no picture: VTK cannot draw here, or cannot draw this."""
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    if "Traceback (most recent call last):" not in lines:
        how = f"signal {-done.returncode}" if done.returncode < 0 else f"exit code {done.returncode}"
        return f"{ADVICE}, got no window ({how})"
    if lines[-1].startswith("ImportError"):
        return f"{ADVICE}, got {lines[-1]}"
    return f"{wanted} that VTK can draw, got {lines[-1]}"
