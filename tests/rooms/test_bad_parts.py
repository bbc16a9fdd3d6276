"""CAD files that are broken or odd, as a user meets them: in a scene, with a message, and nothing left behind."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.errors import MeshError
from kedfem.scene import scene_from
from tests import bad_cad

HERE = (10e-3, 10e-3, 5e-3)  # in the first bore of the sound part
REFUSED = [
    (bad_cad.empty, r"links.arm.shape.file: must be a CAD file \(.*\), got an empty file at"),
    (bad_cad.no_step, r"links.arm.shape.file: must hold STEP, as its ending says, got another text in"),
    (bad_cad.binary, r"links.arm.shape.file: must hold STEP, as its ending says, got another text in"),
    (bad_cad.truncated, r"links.arm.shape.file: must be a whole file of STEP, got one that breaks off"),
    (bad_cad.header_only, r"links.arm.shape.file: must be a file that OpenCASCADE can read as STEP, got"),
    (
        bad_cad.open_shell,
        r"links.arm.shape.file: must hold a solid, got faces that do not close \(7 of them, 4 free edges",
    ),
    (bad_cad.wires, r"links.arm.shape.file: must hold a solid, got 1 curves and no faces"),
    (bad_cad.two_solids, r"links.arm.shape.solid: is required, or a solid called 'arm' like the link, .* left, right"),
    (bad_cad.same_names, r"links.arm.shape.solid: is required, .* arm 1, arm 2"),
    (bad_cad.overlapping, r"links.arm.shape.solid: is required, .* first, second"),
    (
        bad_cad.self_crossing,
        r"links.arm.shape.file: must be a closed solid that does not intersect itself, "
        r"got a plane face facing .* \(face \d+\) with",
    ),
    (bad_cad.wrong_ending, r"links.arm.shape.file: must hold STEP, as its ending says, got another text"),
    (
        bad_cad.no_bore,
        r"joints.A: must sit on a bore or a flat face of link 'arm' at .*got none there .*its nearest face is the plane",
    ),
    (bad_cad.thousandfold, r"joints.A: must sit on .*other units"),
]


def arm(file: Path, **joint: Any) -> Any:
    """A scene of one part, hinged to the ground at a bore."""
    raw = {
        "links": {"arm": {"material": "steel", "shape": {"file": file.name}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": HERE, **joint}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}},
        "analysis": {"end_time": 0.1, "step": 0.01},
    }
    return meshed(scene_from(raw, file.parent))


@pytest.mark.parametrize(("write", "message"), REFUSED, ids=[write.__name__ for write, _ in REFUSED])
def test_is_refused(write: Callable[[Path], Path], message: str, tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=message):
        arm(write(tmp_path))


@pytest.mark.parametrize("write", bad_cad.GOOD)
def test_sound_ones_run(write: Callable[[Path], Path], tmp_path: Path) -> None:
    mass = 7850 * (60 * 20 - 2 * 3.14159265 * 16) * 10e-9
    assert arm(write(tmp_path)).model.links[0].m1[:, 0].sum() == pytest.approx(mass, rel=1e-4)


def test_an_axis_askew_is_told(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"joints.A: .* its axis is 5 deg off"):
        arm(bad_cad.sound(tmp_path), axis=[0.0872, 0, 0.9962])


def test_a_face_that_is_not_there_is_told(tmp_path: Path) -> None:
    message = r"joints.A.faces: must name faces of link 'arm', got 'pin'; it has 'face 1', 'face 2'"
    with pytest.raises(MeshError, match=message):
        arm(bad_cad.sound(tmp_path), faces={"arm": "pin"})
