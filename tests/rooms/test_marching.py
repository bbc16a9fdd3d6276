"""Steps by hand: the system of a scene, marched by a script."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from kedfem.analysis import analyse
from kedfem.errors import SolveError
from kedfem.marching import State, begun_march
from kedfem.scene import scene_from
from tests.moving import bar

FALLING: dict[str, Any] = {
    "links": {"arm": bar("beam", (0, 0), (0.5, 0), 2)},
    "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
    "gravity": [0, -9.81],
    "analysis": {
        "end_time": 0.05,
        "step": 1e-3,
        "frames": "co-rotational",
        "accuracy": "quick",
        "extrapolation_levels": 1,
    },
}


def test_a_march_by_hand_moves_as_the_run_does(tmp_path: Path) -> None:
    """The tip as `analyse` records it: the arm hangs from a free hinge, of which it falls as by its results file."""
    probes = {"tip": {"link": "arm", "at": [0.5, 0], "quantity": "travel"}}
    output = {"folder": str(tmp_path / "r"), "animation": False, "plots": False, "picture": False, "probes": probes}
    run = analyse(scene_from({**FALLING, "output": output}))
    arm = begun_march(scene_from(FALLING))
    assert arm.step == 1e-3
    _, history = arm.marched(50)
    last = arm.displacements("arm", history)[-1]
    tip = run.results.channels["probes/tip/travel"][1][1:]
    assert abs(tip).max() > 5e-3
    assert_allclose(last[:, -1, :2], tip, atol=1e-12)


def test_a_state_from_a_file_goes_on_bit_for_bit(tmp_path: Path) -> None:
    arm = begun_march(scene_from(FALLING))
    whole, _ = arm.marched(20)
    half, _ = arm.marched(8)
    np.savez(tmp_path / "state.npz", **half._asdict())
    later, _ = arm.marched(12, State(**np.load(tmp_path / "state.npz")))
    assert float(later.time[0]) == pytest.approx(0.02)
    for x, y in zip(later, whole, strict=True):
        assert_array_equal(x, y)


def test_what_takes_no_steps_is_refused() -> None:
    joints = {"A": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0]}}
    scene = scene_from({**FALLING, "joints": joints, "analysis": {"kind": "static", "accuracy": "quick"}})
    with pytest.raises(SolveError, match=r"analysis\.kind: .*got 'static'"):
        begun_march(scene)


@pytest.mark.parametrize(("key", "value"), [("solver", "monolithic"), ("extrapolation_levels", 2)])
def test_what_a_march_by_hand_does_not_do_is_refused(key: str, value: object) -> None:
    scene = scene_from({**FALLING, "analysis": {**FALLING["analysis"], key: value}})
    with pytest.raises(SolveError, match=rf"analysis\.{key}: .*by hand, got .*{value}"):
        begun_march(scene)


def test_a_link_that_has_no_displacements_is_named() -> None:
    arm = begun_march(scene_from(FALLING))
    _, history = arm.marched(1)
    with pytest.raises(KeyError, match="boom"):
        arm.displacements("boom", history)
