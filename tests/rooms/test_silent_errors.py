"""What once was silent: beams that locked, loads between the steps, eased tolerances, growth, mass in a plane."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.loads import coarse_steps
from kedfem.dynamics.stepping import solvers, transient
from kedfem.dynamics.stepping.transient import finite_part
from kedfem.dynamics.system import layout
from kedfem.errors import SceneError, SolveError
from kedfem.scene import scene_from
from tests.moving import bar, ran
from tests.rooms.test_driven_efforts import arm


@pytest.mark.parametrize(("elements", "cap"), [(1, 0.15), (2, 0.01), (4, 1e-3)])
def test_beams_in_space_do_not_lock(elements: int, cap: float) -> None:
    """A steel arm 125 times as long as high that bends by 4.5 % of its length, against planar beams of eight elements.

    Linear strains seen from one frame of each element bent it too little by 91, 78 and 56 %.
    """
    tips = []
    for kind, count in (("beam", 8), ("spatial", elements)):
        raw = arm(kind, count)
        raw["analysis"] |= {"end_time": 0.1, "step": 1e-3}
        if kind == "spatial":
            raw["links"]["arm"]["shape"]["up"] = [0, 0, 1]  # 4 mm high in the plane
        ready, blocks = ran(raw)
        last = ready.model.links[-1]
        tip = np.flatnonzero(np.abs(last.X[:, 0] - 0.5) * (last.one != 0) + (last.one == 0) < 1e-9)
        tips.append(np.concatenate([block.links[-1].u[:, tip[0], :2] for block in blocks]))
    assert np.abs(tips[1] - tips[0]).max() < cap * np.abs(tips[0]).max()


def loaded(factor: dict[str, Any]) -> tuple[str, ...]:
    raw = arm("beam", 2)
    load = {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, 1.0], "factor": factor}
    return coarse_steps(scene_from(raw | {"loads": {"P": load}}))


def test_a_pulse_between_two_steps_is_told_and_jumps_are_not() -> None:
    """Steps of 0.5 ms: a pulse of 0.3 ms between two of them is not seen at all; a jump is, but for a part of a step."""
    pulse = {"time": [0.0201, 0.02025, 0.0204], "value": [0.0, 1.0, 0.0]}
    (message,) = loaded(pulse)
    assert message.startswith(
        "loads.P: its table is finer than the time step of 0.0005 s: its integral over the steps is off by 100 %"
    )
    assert loaded({"time": [0.05, 0.0501], "value": [0.0, 1.0]}) == ()
    assert loaded({"over": "angle", "at": [0.0, 1.0, 2.0], "value": [0.0, 1.0, 0.0]}) == ()


def test_steps_at_an_eased_tolerance_are_counted_and_told(monkeypatch: Any) -> None:
    """A tolerance near rounding is eased in some of the steps, the usual one in none."""
    raw = arm("beam", 2)
    raw["analysis"] |= {"end_time": 0.02}
    ready = meshed(scene_from(raw))

    def eased() -> int:
        steps = solvers.steps_of(ready.scene, ready.model)
        list(transient.transient(ready.scene, ready.linkage, ready.path, ready.model, steps))
        assert solvers.eased_warning([steps]) == () or "the iterations of" in solvers.eased_warning([steps])[0]
        return int(steps.eased)

    assert eased() == 0
    monkeypatch.setattr(solvers, "CONVERGED", 1e-12)
    monkeypatch.setattr(layout, "SMALLEST", 0.0)
    assert eased() > 0


@pytest.mark.parametrize("value", [np.inf, np.nan, 1e50])
def test_growth_in_any_function_ends_a_run(value: float) -> None:
    """Not only in the first function, and not only at infinity."""
    raw = arm("beam", 2)
    raw["analysis"] |= {"end_time": 0.01}
    ready, blocks = ran(raw)
    block = blocks[1]
    g = block.links[0].g.copy()
    g[2, -1, 1] = value
    every = finite_part(ready.linkage, replace(block, links=[replace(block.links[0], g=g), *block.links[1:]]))
    assert len(next(every)) == 2
    with pytest.raises(SolveError, match="got none at step 3"):
        next(every)


def test_a_rigid_link_whose_mass_lies_in_a_plane_is_refused() -> None:
    """A lamina on a carrier of next to no mass: nothing determines how the link's functions move across it."""
    light = {"density": 1e-3, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}
    raw: dict[str, Any] = {
        "materials": {"light": light},
        "links": {"plate": bar("rigid", [0, 0], [0.3, 0]) | {"material": "light"}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "plate"], "at": [0, 0]}},
        "bodies": {
            "sheet": {
                "kind": "rigid_body",
                "link": "plate",
                "at": [0, 0],
                "mass": 1.0,
                "inertia": [0.01, 0.02, 0.03, 0, 0, 0],
                "centre": [0, 0, 0],
            }
        },
        "gravity": [0, -9.81, 0],
        "analysis": {"end_time": 0.01, "step": 1e-3},
    }
    with pytest.raises(SceneError, match=r"links.plate: a rigid link must have mass along all its directions"):
        meshed(scene_from(raw))
    raw["bodies"]["sheet"]["inertia"] = [0.012, 0.02, 0.03, 0, 0, 0]
    assert meshed(scene_from(raw)).model.links
