"""Pictures of frames of the animation, rendered by VTK in a separate process."""

import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from kedfem.errors import OutputError, PictureError
from kedfem.results import replacing

TIMEOUT = 300  # seconds after which rendering is ended, e.g. if the display does not answer
ADVICE = "picture: must be drawn by VTK, for which Linux without a display needs libEGL (package libegl1)"


def write_picture(
    vtu: Path,
    png: Path,
    title: str,
    deformation_scale: float = 1.0,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    meanwhile: Callable[[], object] | None = None,
) -> None:
    """Draw the links of a VTU file, deformed as in the frame, coloured by von Mises stress.

    Parameters
    ----------
    vtu : a frame of :class:`~kedfem.output.animation.AnimationWriter`
    png : the picture
    title : text above the picture; long ones are wrapped
    deformation_scale : factor on the deformation in the frame, written below
    gravity : (3,) it points down in the picture, unless that is the direction of view [m/s²]
    meanwhile : function that is called while VTK draws

    Raises
    ------
    PictureError
        VTK cannot draw the frame, or cannot open a window here.
    OutputError
        There is no such frame, or the PNG cannot be written.
    """
    vtu = Path(vtu)
    if not vtu.is_file():
        raise OutputError(f"{vtu}: must be a frame of the animation, got no such file")
    words = (title, deformation_scale, *gravity)
    draw_in_process("rendering.py", (vtu, Path(png)), words, f"{vtu}: must be a frame", meanwhile)


def draw_in_process(
    script: str,
    files: tuple[Path, Path],
    words: Sequence[object],
    wanted: str,
    meanwhile: Callable[[], object] | None = None,
) -> None:
    """Run VTK in a separate process.

    If it cannot open a window VTK ends with a segmentation fault, and graphics drivers write to the terminal.

    Parameters
    ----------
    script : a file in this folder
    files : the file to draw, and the PNG
    words : further arguments of the script
    wanted : first words of the message about a file that cannot be drawn
    meanwhile : function that is called at the same time

    Raises
    ------
    PictureError
        VTK cannot draw here, or cannot draw this.
    OutputError
        The PNG cannot be written.
    """
    drawn, png = files
    with replacing(png) as part:
        given = (Path(__file__).with_name(script), drawn, part, *words)
        command = [sys.executable, "-P", *map(str, given)]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as drawing:
            try:
                if meanwhile is not None:
                    meanwhile()
                _, output = drawing.communicate(timeout=TIMEOUT)
            except subprocess.TimeoutExpired as error:
                raise PictureError(f"{ADVICE}, got no picture within {TIMEOUT} s") from error
            finally:
                drawing.kill()
        if drawing.returncode != 0 or not part.is_file():
            raise PictureError(_fault(wanted, drawing.returncode, output.decode(errors="replace")))


def _fault(wanted: str, code: int, output: str) -> str:
    """The reason why there is no picture: VTK cannot draw on this machine, or not this frame."""
    lines = output.strip().splitlines()
    if "Traceback (most recent call last):" not in lines:
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return f"{ADVICE}, got no window ({how})"
    if lines[-1].startswith("ImportError"):
        return f"{ADVICE}, got {lines[-1]}"
    return f"{wanted} that VTK can draw, got {lines[-1]}"
