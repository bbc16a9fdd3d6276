"""Levels in time: the order of what they combine to, by every solver; estimates against the truth."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.resolution import step_error
from kedfem.accuracy.step_estimate import StepWatch
from kedfem.dynamics.levels import level_steps, level_weights, leveled
from kedfem.results.recording import recording, rows
from kedfem.scene import scene_from
from tests.moving import inverted
from tests.rooms.test_acted import LINE
from tests.rooms.test_acted import four_bar as hinged

Channels = dict[str, np.ndarray]
END = 0.15
SOFT = {"density": 7850, "youngs_modulus": 4e8, "poisson_ratio": 0.3}  # bends by a tenth of a link's length


def linkage(kind: str) -> dict[str, Any]:
    """Soft links that rise smoothly, a 4-5-6-7 polynomial: what they do has no jump up to its third derivative."""
    frames = "following" if kind == "following" else "nominal"
    raw = inverted() if kind == "rows" else hinged(frames)
    if kind == "springs":
        raw["springs"] = {"s": {**LINE, "stiffness": 50.0, "damping": 0.5}}
    motion = {"kind": "polynomial", "order": 7, "angle": 1.5, "rise": 0.12}
    analysis = {"end_time": END, "step": END, "initial": "rest", "stiffening": kind == "stiffened"}
    if kind != "rows":
        analysis["frames"] = frames
    links = {name: {**link, "material": "soft"} for name, link in raw["links"].items()}
    return raw | {
        "links": links, "materials": {"soft": SOFT}, "drive": {"joint": "A", "motion": motion}, "analysis": analysis,
        "damping": {"ratio": 0.02, "frequencies": [5, 50]},
    }  # fmt: skip


@cache
def ready_linkage(kind: str) -> Prepared:
    return meshed(scene_from(linkage(kind)))


@cache
def marched(kind: str, steps: int, levels: int) -> tuple[Channels, StepWatch]:
    """All channels of a linkage in so many steps of so many levels, and what is known of their error."""
    ready = ready_linkage(kind)
    analysis = ready.scene.analysis.model_copy(update={"step": END / steps, "levels": levels})
    scene = ready.scene.model_copy(update={"analysis": analysis})
    ready = replace(ready, scene=scene)
    recorded = recording(scene, ready.model)
    watch, found = StepWatch(ready, recorded, step_error(ready)), []
    for block in leveled(scene, ready.linkage, ready.path, ready.model, level_steps(scene, ready.model)):
        found.append(rows(recorded, block))
        watch.add(block, found[-1])
        watch.running.add(block)
    return {name: np.concatenate([x[name] for x in found]) for name in found[0]}, watch


def error(found: Channels, true: Channels, name: str) -> float:
    """At worst in time, of the peak."""
    stride = (len(true[name]) - 1) // (len(found[name]) - 1)
    gap = np.linalg.norm(found[name] - true[name][::stride], axis=1).max()
    return float(gap / np.linalg.norm(true[name], axis=1).max())


# caps on the errors of two and three levels; to 1e-6 the solvers' iterations leave the latter free
CASES = [
    pytest.param("nominal", 5e-4, 5e-5, id="nominal"),
    pytest.param("following", 5e-4, 5e-5, id="co-rotational"),
    pytest.param("stiffened", 5e-4, 5e-5, id="stiffened", marks=pytest.mark.long),
    pytest.param("rows", 5e-4, 5e-5, id="time-varying constraints", marks=pytest.mark.long),
    pytest.param("springs", 5e-4, 5e-5, id="springs", marks=pytest.mark.long),
]


@pytest.mark.parametrize(("kind", "fourth", "sixth"), CASES)
def test_levels_raise_the_order_of_every_solver(kind: str, fourth: float, sixth: float) -> None:
    """Generalised-α is of order 2; two levels of order 4, three of order 6 as long as ρ∞ = 0.95 leaves h³ small."""
    true = marched(kind, 240, 3)[0]
    names = ("energy/strain", "drive/torque", "joints/B/force")
    one, two, three = (
        np.array([[error(marched(kind, n, levels)[0], true, name) for name in names] for n in (60, 120)])
        for levels in (1, 2, 3)
    )
    orders = [np.log2(x[0] / x[1]) for x in (one, two, three)]
    assert np.all(np.abs(orders[0] - 2) < 0.2)
    assert np.all((orders[1] > 3.6) & (orders[1] < 4.4))
    assert two[1].max() < fourth
    assert three[0].max() < 0.3 * two[0].max()
    assert three[1].max() < sixth


def test_estimates_tell_the_truth() -> None:
    """Where the order shows and where the steps are too long: within a factor 3 below and 8 above, in every channel."""
    for kind in ("nominal", "following"):
        true = marched(kind, 240, 3)[0]
        for steps, levels in ((30, 2), (60, 2), (120, 2), (30, 3), (60, 3)):
            found, watch = marched(kind, steps, levels)
            assert watch.estimate.levels == levels
            for name, estimate in watch.estimate.errors.items():
                truth = error(found, true, name)
                if truth > 1e-6:
                    assert truth / 3 < estimate < 8 * truth, (kind, steps, levels, name, estimate, truth)


def test_weights_remove_powers_of_the_step() -> None:
    """Σ w = 1, Σ w/4ᵏ = 0 (h²), and of three levels h⁴ where numerical damping is small, else h³."""
    h = 0.5 ** np.arange(3)
    assert_allclose(level_weights(2, 0.95) @ np.stack([h[:2] ** 0, h[:2] ** 2], axis=1), [1, 0], atol=1e-15)
    assert_allclose(level_weights(3, 0.95) @ np.stack([h**0, h**2, h**4], axis=1), [1, 0, 0], atol=1e-15)
    assert_allclose(level_weights(3, 0.3) @ np.stack([h**0, h**2, h**3], axis=1), [1, 0, 0], atol=1e-15)
