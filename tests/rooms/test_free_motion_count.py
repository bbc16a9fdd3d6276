"""How many free motions the drive leaves is told in the plane of a plane scene, by all commands alike."""

from pathlib import Path
from typing import Any

import pytest

from kedfem.accuracy.prepared import moving
from kedfem.export.motion import export_motion
from kedfem.kinematics import kinematics
from kedfem.motion.mobility import mobility
from kedfem.scene import Scene, scene_from
from tests.moving import bar, beam_in_space

SPATIAL = {"x": [1.0, 0.0, 0.0], "oblique": [0.3, 0.5, -0.8]}


def hanging(axis: list[float] | None) -> Scene:
    """A driven crank with a bar on a ball, which a spring holds; planar or in space."""
    A, B, C = [0.0, 0.0], [0.1, 0.0], [0.3, 0.0]
    made: Any = beam_in_space if axis else lambda a, b: bar("beam", a, b)
    ends = [{"link": "crank", "at": A}, {"link": "pendulum", "at": C}]
    return scene_from({
        "links": {"crank": made(A, B), "pendulum": made(B, C)},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": A, "axis": axis or "z"},
            "B": {"kind": "spherical", "links": ["crank", "pendulum"], "at": B},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}},
        "springs": {"s": {"kind": "spring", "between": ends, "stiffness": 100.0}},
        "analysis": {"end_time": 0.1, "step": 0.01, "frames": "co-rotational"},
    })  # fmt: skip


@pytest.mark.parametrize(("axis", "count"), [(None, 1), *((axis, 3) for axis in SPATIAL.values())])
def test_commands_count_free_motions_as_check_does(axis: list[float] | None, count: int, tmp_path: Path) -> None:
    scene = hanging(axis)
    linked, along = moving(scene)
    found = mobility(scene, linked, along)
    assert sum(motion.basis.shape[1] for motion in found.free) == count == linked.mobility
    told = f"free motions ({count}) are held in the reference position"
    assert told in export_motion(scene, tmp_path / "motion.csv")[1]
    assert any(words.startswith(told) for words in kinematics(scene, tmp_path / "moved").warnings)
