"""Headings of tables beside a scene: columns without a unit may say so, others must have one that can be read."""

import math
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from kedfem.errors import SceneError
from kedfem.scene.read.tables import two_columns


@pytest.mark.parametrize("unit", ["[-]", "[1]", "(-)", "[–]", "[]", "[ - ]", ""])
def test_a_column_without_a_unit_may_say_so(tmp_path: Path, unit: str) -> None:
    (tmp_path / "factor.csv").write_text(f"Angle [deg], Factor {unit}\n0, 0\n180, 2\n", encoding="utf-8")
    at, value = two_columns(tmp_path / "factor.csv", ("angle", "factor"), ("rad", "1"))
    assert_allclose([at, value], [[0.0, math.pi], [0.0, 2.0]])


@pytest.mark.parametrize(
    ("heading", "told"),
    [
        ("speed [-], torque [N*m]", r"'speed \[-\]', which has no unit; wanted is one of the kind of rad/s"),
        ("speed [1/min], torque [N*m]", r"'1/min' is not a unit; wanted is one of the kind of rad/s"),
    ],
)
def test_a_column_that_needs_a_unit_is_told_so(tmp_path: Path, heading: str, told: str) -> None:
    (tmp_path / "torque.csv").write_text(f"{heading}\n0, 0\n180, 2\n")
    with pytest.raises(SceneError, match=rf"^torque\.csv, line 1: must have units of speed and torque, got: {told}$"):
        two_columns(tmp_path / "torque.csv", ("speed", "torque"), ("rad/s", "N*m"))
