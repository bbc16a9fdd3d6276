"""Links of a plane do not spin about the line through two balls: there these are hinges, in every result."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import moving
from kedfem.errors import MotionError
from kedfem.scene import scene_from
from tests.moving import bar, channels, ran, turning

PLACES = {"A": (0.0, 0.0), "B": (0.03, 0.05), "C": (0.2, 0.12), "D": (0.17, 0.0)}
ENDS = {"A": ("ground", "crank"), "B": ("crank", "coupler"), "C": ("coupler", "rocker"), "D": ("rocker", "ground")}

CAPS = {"rigid-body": 1e-9, "co-rotational": 1e-7}  # of the peak; these iterate


def four_bar(model: str, kinds: dict[str, str], **analysis: Any) -> dict[str, Any]:
    """Bars of one kind, the coupler on joints of other kinds than hinges."""
    joints: dict[str, Any] = {
        name: {"kind": kinds.get(name, "revolute"), "links": list(ENDS[name]), "at": list(at)}
        for name, at in PLACES.items()
    }
    links = {name: bar(model, PLACES[a], PLACES[b], 4) for name, a, b in
             (("crank", "A", "B"), ("coupler", "B", "C"), ("rocker", "C", "D"))}  # fmt: skip
    steps = {"revolutions": 0.5, "steps_per_revolution": 200, "initial": "quasi-static", **analysis}
    return {"links": links, "joints": joints, "drive": turning("600 rpm"), "analysis": steps}


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("model", ["beam", "plane"])
@pytest.mark.parametrize("balls", ["BC", "BCD"])
def test_a_coupler_on_balls_moves_as_on_hinges(model: str, frames: str, balls: str) -> None:
    found, hinged = (
        channels(*ran(four_bar(model, dict.fromkeys(which, "spherical"), frames=frames))) for which in (balls, "")
    )
    for name, expected in hinged.items():
        if not name.endswith(("rigid_force", "rigid_moment")):
            atol = CAPS[frames] * np.abs(expected).max(initial=0.0)
            assert_allclose(found[name], expected, rtol=0, atol=atol, err_msg=name)


def test_in_space_it_spins() -> None:
    with pytest.raises(MotionError, match=r"link 'coupler' can turn about .* the line through joints B and C"):
        moving(scene_from(four_bar("solid", {"B": "spherical", "C": "spherical"})))
