"""What acts out of the plane of a scene is never left out: beams move in space, scenes of plane links are refused."""

from typing import Any

import numpy as np
import pytest

from kedfem.errors import SceneError
from kedfem.scene import scene_from
from kedfem.scene.questions.planes import spatial_beams
from tests.moving import bar, channels, ran

TIP = {"at": [0.5, 0]}
ACTS: dict[str, tuple[dict[str, Any], str]] = {
    "gravity": ({"gravity": [0, -9.81, 1]}, "gravity"),
    "force": ({"loads": {"x": {"kind": "force", "link": "arm", **TIP, "vector": [0, 1, 5]}}}, "loads.x.vector"),
    "body force": ({"loads": {"x": {"kind": "body", "link": "arm", "vector": [0, 0, 5]}}}, "loads.x.vector"),
    "torque": ({"loads": {"x": {"kind": "torque", "link": "arm", **TIP, "vector": [0, 5, 1]}}}, "loads.x.vector"),
    "deflection": (
        {"initial_deflection": {"x": {"link": "arm", **TIP, "force": [0, 5, 5]}}},
        "analysis.initial_deflection.x.force",
    ),
    "speed": ({"initial_motions": {"arm": {**TIP, "velocity": [0, 1, 2]}}}, "analysis.initial_motions.arm.velocity"),
    "rotation": (
        {"initial_motions": {"arm": {**TIP, "angular_velocity": [3, 0, 1]}}},
        "analysis.initial_motions.arm.angular_velocity",
    ),
}  # fmt: skip


def arm(model: str, acts: dict[str, Any], hinged: bool = True) -> dict[str, Any]:
    """Half a metre along x, about z on a spring, or free."""
    start = {key: x for key, x in acts.items() if key.startswith("initial")}
    raw: dict[str, Any] = {
        "gravity": [0, 0, 0], "links": {"arm": bar(model, (0, 0), (0.5, 0), 4)}, "joints": {},
        "analysis": {"end_time": 0.01, "step": 1e-3, "frames": "co-rotational", **start},
        "output": {"probes": {"tip": {"link": "arm", **TIP, "quantity": "travel"}}},
    } | {key: x for key, x in acts.items() if key not in start}  # fmt: skip
    if hinged:
        raw["joints"] = {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}}
        raw["springs"] = {"S": {"kind": "torsion", "joint": "A", "stiffness": 500.0}}
    return raw


@pytest.mark.parametrize("name", ACTS)
def test_whatever_acts_out_of_the_plane_makes_beams_spatial_and_is_refused_of_plane_links(name: str) -> None:
    acts, where = ACTS[name]
    assert spatial_beams(scene_from(arm("beam", acts))) == {"arm"}
    with pytest.raises(SceneError, match=rf"{where}: must (lie in the xy plane|be along z) in a scene of plane links"):
        scene_from(arm("plane", acts))


@pytest.mark.long
def test_a_beam_let_go_from_a_force_out_of_the_plane_swings_there() -> None:
    """As the solid does, to its coarse mesh; it had been planar, and z left out."""
    found = [channels(*ran(arm(x, ACTS["deflection"][0])))["probes/tip/travel"] for x in ("beam", "solid")]
    assert np.abs(found[1][:, 2]).max() > 1e-5
    np.testing.assert_allclose(found[0][0], found[1][0], atol=0.05 * np.abs(found[1][0, 2]))


@pytest.mark.long
def test_a_free_beam_moves_on_out_of_the_plane() -> None:
    """v t of its tip along y and z, but for its turn by 0.001 rad; z had been lost."""
    raw = arm("beam", {"initial_motions": {"arm": {**TIP, "velocity": [0, 1, 2]}}}, False)
    travel = channels(*ran(raw))["probes/tip/travel"]
    np.testing.assert_allclose(travel[-1], [0, 0.01, 0.02], atol=2e-5)
