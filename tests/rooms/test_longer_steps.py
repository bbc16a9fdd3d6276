"""Runs of which only differences count are in steps twice as long where that shows the same."""

from collections.abc import Collection
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from benchmarks.scenes import four_bar_of
from numpy.testing import assert_allclose

from kedfem.accuracy import reduction
from kedfem.accuracy.estimates import step_errors
from kedfem.accuracy.histories import Histories, histories, relative_errors
from kedfem.accuracy.longer_steps import differs_alike, doubled
from kedfem.accuracy.mesh_estimate import mesh_errors
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.scene import scene_from, time_grid

#: 2 % at 20 and 200 Hz: a vibration of 20 steps, 180 Hz here, has 1.8 %
DAMPED = {"ratio": 0.02, "frequencies": [20, 200]}
FASTER = 0.2  # of an estimate: what steps twice as long may change of that of a mesh; 12 % at most here


def bars(damping: dict[str, Any] | None = DAMPED, **analysis: Any) -> dict[str, Any]:
    """A four-bar from rest at 600 rpm, a turn in 360 steps; two segments a link."""
    link = {"model": "solid", "mesh": {"elements": [6, 1, 1]}, "segments": 2, "reduction": "modal"}
    raw = four_bar_of({"kind": "bar", "width": 0.0254, "thickness": 0.0254}, link)
    raw["analysis"] = {"revolutions": 1, "steps_per_revolution": 360, "initial": "rest", **analysis}
    raw["analysis"].setdefault("frames", "co-rotational")
    raw["output"] = {"probes": {"stress": {"link": "rocker", "at": "M", "quantity": "stress"}}}
    return raw if damping is None else {**raw, "damping": damping}


def rigid_frames() -> dict[str, Any]:
    """The same without segments."""
    raw = bars(frames="rigid-body")
    for link in raw["links"].values():
        del link["segments"]
    return raw


def ready(raw: dict[str, Any]) -> Prepared:
    return meshed(scene_from(raw))


def estimate_and_truth(full: Prepared, longer: bool) -> np.ndarray:
    """(channels, 2): estimate of a reduction to a given number of modes, and its difference from the unreduced run."""
    names = [link.name for link in full.model.links]
    with patch.object(reduction, "differs_alike", differs_alike if longer else lambda ready: False):
        found = reduction.reduced(full, names, 0.01, dict.fromkeys(names, 14))
    true = relative_errors(histories(found.ready), histories(full))
    return np.array([(found.estimate[name], true[name]) for name in true])


@pytest.mark.parametrize("thickness", [0.0254, 0.02])
def test_a_damped_scene_shows_what_its_modes_leave_out_in_steps_twice_as_long(thickness: float) -> None:
    """Own steps show `CAUTION` times the true error, longer ones up to twice that.

    A square section vibrates alike along both sides: which of its modes are taken depends on rounding.
    """
    raw = bars()
    for link in raw["links"].values():
        link["shape"]["thickness"] = thickness
    full = ready(raw)
    assert differs_alike(full)
    own, true = estimate_and_truth(full, longer=False).T
    assert true.max() > 1e-3
    assert (own > 1.2 * true).all()
    assert (own < 1.8 * true).all()
    estimate, true = estimate_and_truth(full, longer=True).T
    assert (estimate > true).all()
    assert (estimate < 3.5 * true).all()


def test_steps_twice_as_long_that_are_divided_show_nothing_of_modes() -> None:
    """Divided steps excite vibration of their own: the estimate is that of the scene's steps."""
    full = ready(bars(revolutions=0.1))
    names = [link.name for link in full.model.links]
    step, real = time_grid(full.scene).step, reduction.histories

    def found(ready: Prepared, keep: Collection[int] = ()) -> Histories:
        return replace(real(ready, keep), divided=time_grid(ready.scene).step > 1.5 * step)

    def estimate() -> dict[str, float]:
        return reduction.reduced(full, names, 0.01, dict.fromkeys(names, 14)).estimate

    longer = estimate()
    with patch.object(reduction, "differs_alike", lambda ready: False):
        own = estimate()
    with patch.object(reduction, "histories", found):
        assert estimate() == own != longer


@pytest.mark.parametrize(
    "raw",
    [bars(None), bars({**DAMPED, "ratio": 0.01}), rigid_frames(), bars(steps_per_revolution=6)],
    ids=["undamped", "half as much damping", "rigid-body frames", "few steps"],
)
def test_other_scenes_keep_their_steps(raw: dict[str, Any]) -> None:
    assert not differs_alike(ready(raw))


def test_a_damped_scene_shows_its_mesh_error_in_steps_twice_as_long() -> None:
    full = ready(bars())
    eta = {link.name: 0.05 for link in full.model.links}
    base = histories(full)
    longer = step_errors(full, base)[1]
    assert longer is not None
    own = mesh_errors(full, base, eta)
    found = mesh_errors(replace(full, scene=doubled(full.scene)), longer, eta)
    assert_allclose(list(found.values()), list(own.values()), rtol=FASTER)
