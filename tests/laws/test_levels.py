"""Levels in time: the order of what they combine to, by every solver; estimates against the truth."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.resolution import step_error
from kedfem.accuracy.step_estimate import StepErrorMonitor, cheapest
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import factor_bytes
from kedfem.dynamics.stepping import levels as in_time
from kedfem.dynamics.stepping.combined import LINEAR, level_weights
from kedfem.dynamics.stepping.levels import level_steps, leveled, most_levels
from kedfem.errors import SolveError
from kedfem.results.recording import recording, rows
from kedfem.scene import Scene, scene_from
from tests.moving import inverted
from tests.rooms.test_force_elements_on_links import LINE
from tests.rooms.test_force_elements_on_links import four_bar as hinged

Channels = dict[str, np.ndarray]
END = 0.15
SOFT = {"density": 7850, "youngs_modulus": 4e8, "poisson_ratio": 0.3}  # bends by a tenth of a link's length


def linkage(kind: str) -> dict[str, Any]:
    """Soft links that rise smoothly, a 4-5-6-7 polynomial: what they do has no jump up to its third derivative."""
    frames = "co-rotational" if kind == "co-rotational" else "rigid-body"
    raw = inverted() if kind == "rows" else hinged(frames)
    if kind == "springs":
        raw["springs"] = {"s": {**LINE, "stiffness": 50.0, "damping": 0.5}}
    motion = {"kind": "polynomial", "order": 7, "angle": 1.5, "rise": 0.12}
    analysis = {"end_time": END, "step": END, "initial": "rest", "stiffening": kind == "stiffened"}
    if kind != "rows":
        analysis["frames"] = frames
    probe = {"link": "coupler", "at": "C", "quantity": "acceleration"}
    output = {} if kind == "rows" else {"probes": {"a": probe}}
    links = {name: {**link, "material": "soft"} for name, link in raw["links"].items()}
    return raw | {
        "links": links, "materials": {"soft": SOFT}, "drive": {"joint": "A", "motion": motion}, "analysis": analysis,
        "damping": {"ratio": 0.02, "frequencies": [5, 50]}, "output": output,
    }  # fmt: skip


@cache
def ready_linkage(kind: str) -> Prepared:
    return meshed(scene_from(linkage(kind)))


@cache
def marched(kind: str, steps: int, levels: int) -> tuple[Channels, StepErrorMonitor]:
    """All channels of a linkage in so many steps of so many levels, and what is known of their error."""
    ready = ready_linkage(kind)
    analysis = ready.scene.analysis.model_copy(update={"step": END / steps, "extrapolation_levels": levels})
    scene = ready.scene.model_copy(update={"analysis": analysis})
    ready = replace(ready, scene=scene)
    recorded = recording(scene, ready.model)
    watch, found = StepErrorMonitor(ready, recorded, step_error(ready)), []
    for block in leveled(scene, ready.linkage, ready.path, ready.model, level_steps(scene, ready.model)):
        found.append(rows(recorded, block))
        watch.add(block, found[-1])
        watch.running.add(block)
    return {name: np.concatenate([x[name] for x in found]) for name in found[0]}, watch


def blocks(kind: str, steps: int, levels: int, fine: bool = False, solver: str = "condensed") -> list[Block]:
    """All blocks of a linkage."""
    ready = ready_linkage(kind)
    keys = {"step": END / steps, "extrapolation_levels": levels, "solver": solver}
    scene = ready.scene.model_copy(update={"analysis": ready.scene.analysis.model_copy(update=keys)})
    solvers = level_steps(scene, ready.model)
    return list(leveled(scene, ready.linkage, ready.path, ready.model, solvers, fine))


def over_time(found: list[Block], name: str) -> list[np.ndarray]:
    """A field of every link."""
    return [np.concatenate([getattr(x.links[k], name) for x in found]) for k in range(len(found[0].links))]


def error(found: Channels, true: Channels, name: str) -> float:
    """At worst in time, of the peak."""
    stride = (len(true[name]) - 1) // (len(found[name]) - 1)
    gap = np.linalg.norm(found[name] - true[name][::stride], axis=1).max()
    return float(gap / np.linalg.norm(true[name], axis=1).max())


# caps on the errors of two and three levels; to 1e-6 the solvers' iterations leave the latter free
CASES = [
    pytest.param("rigid-body", 5e-4, 5e-5, id="rigid-body"),
    pytest.param("co-rotational", 5e-4, 5e-5, id="co-rotational"),
    pytest.param("stiffened", 5e-4, 5e-5, id="stiffened", marks=pytest.mark.long),
    pytest.param("rows", 5e-4, 5e-5, id="time-varying constraints", marks=pytest.mark.long),
    pytest.param("springs", 5e-4, 5e-5, id="springs", marks=pytest.mark.long),
]


@pytest.mark.parametrize(("kind", "fourth", "sixth"), CASES)
def test_levels_raise_the_order_of_every_solver(kind: str, fourth: float, sixth: float) -> None:
    """Generalised-α is of order 2; two levels of order 4, three of order 6 as long as ρ∞ = 0.95 leaves h³ small."""
    true = marched(kind, 240, 3)[0]
    names = ["energy/strain", "drive/torque", "joints/B/force"]
    names += [] if kind == "rows" else ["probes/a/acceleration"]
    one, two, three = (
        np.array([[error(marched(kind, n, levels)[0], true, name) for name in names] for n in (60, 120)])
        for levels in (1, 2, 3)
    )
    orders = [np.log2(x[0] / x[1]) for x in (one, two, three)]
    assert np.all(np.abs(orders[0] - 2) < 0.2)
    assert np.all((orders[1][:3] > 3.6) & (orders[1][:3] < 4.4))
    assert np.all(orders[1][3:] > 3.2)  # accelerations have most of what such steps hardly resolve
    assert two[1, :3].max() < fourth
    assert three[0].max() < 0.3 * two[0].max()
    assert three[1, :3].max() < sixth


def test_estimates_tell_the_truth() -> None:
    """Where the order shows and where the steps are too long: within a factor 3 below and 8 above, in every channel."""
    for kind in ("rigid-body", "co-rotational"):
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


@pytest.mark.parametrize("kind", ["rigid-body", "rows"])
def test_monolithic_steps_combine_to_the_same(kind: str) -> None:
    """The oracle through the layer, in all that a block holds; rounding grows over 40 steps."""
    fast, monolithic = blocks(kind, 20, 2), blocks(kind, 20, 2, solver="monolithic")
    for name in LINEAR:
        for x, y in zip(over_time(fast, name), over_time(monolithic, name), strict=True):
            assert_allclose(x, y, rtol=0, atol=2e-8 * np.abs(y).max(initial=1e-300))


def test_time_points_are_those_of_one_level_whatever_is_kept_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Portions of 7 steps: the same states; no block is longer than that."""
    whole = blocks("co-rotational", 60, 3)
    assert_allclose(np.concatenate([x.motion.t for x in whole]), np.linspace(0, END, 61), rtol=0, atol=1e-15)
    monkeypatch.setattr(in_time, "block_length", lambda model: 28)
    parts = blocks("co-rotational", 60, 3)
    assert max(len(x) for x in parts) == 7
    assert [x.step for x in parts][:3] == [0, 1, 8]
    for name in LINEAR:
        for x, y in zip(over_time(parts, name), over_time(whole, name), strict=True):
            assert_allclose(x, y, rtol=0, atol=1e-12 * np.abs(y).max(initial=1e-300))


@pytest.mark.parametrize(("kind", "left"), [("rigid-body", 0.08), ("co-rotational", 0.2)])
def test_between_time_points_the_finest_level_is_corrected(kind: str, left: float) -> None:
    """Between common times of 60 steps in two levels: far nearer to the truth than the finest level's own states."""
    found = [x for x in blocks(kind, 120, 2, fine=True) if x.fine]
    t = np.concatenate([x.motion.t for x in found])
    assert_allclose(t, END * np.arange(241) / 240, rtol=1e-12)
    assert [x.step for x in found][:2] == [0, 1]
    common = over_time([x for x in blocks(kind, 120, 2, fine=True) if not x.fine], "g")
    for x, y in zip(over_time(found, "g"), common, strict=True):
        assert_allclose(x[::2], y, rtol=0, atol=1e-13 * np.abs(y).max())
    true, own = (over_time(blocks(kind, *march), "u") for march in ((480, 2), (240, 1)))
    for x, exact, alone in zip(over_time(found, "u"), true, own, strict=True):
        size = np.abs(exact).max()
        error, before = (np.abs(x[1::2] - exact[2::4]).max() / size, np.abs(alone[1::2] - exact[2::4]).max() / size)
        assert error < left * before
        assert error < 1e-3


def test_a_level_that_fails_ends_the_run_with_what_all_have(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, transient = blocks("rigid-body", 60, 2), in_time.transient

    def failing(scene: Scene, *others: Any) -> Iterator[Block]:
        for block in transient(scene, *others):
            if scene.analysis.step == END / 120 and len(block) > 1:
                yield block.part(0, 41)
                raise SolveError("no further")
            yield block

    monkeypatch.setattr(in_time, "transient", failing)
    ready = ready_linkage("rigid-body")
    keys = {"step": END / 60, "extrapolation_levels": 2}
    scene = ready.scene.model_copy(update={"analysis": ready.scene.analysis.model_copy(update=keys)})
    found: list[Block] = []
    marching = leveled(scene, ready.linkage, ready.path, ready.model, level_steps(scene, ready.model))
    with pytest.raises(SolveError, match="no further"):
        found.extend(marching)
    assert sum(map(len, found)) == 21  # at rest, and 20 steps: 41 half ones make 20 whole ones
    assert_allclose(over_time(found, "u")[1], over_time(whole, "u")[1][:21], rtol=0, atol=1e-15)


def test_factors_that_do_not_fit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    model = ready_linkage("rigid-body").model
    need = factor_bytes(model)
    monkeypatch.setattr(in_time, "memory", lambda: 2.5 * need)
    assert most_levels(model) == 2
    with pytest.raises(SolveError, match=r"analysis\.extrapolation_levels: must be at most 2 .* got 3"):
        blocks("rigid-body", 20, 3)


def test_the_cheapest_step_reaches_what_is_asked_for() -> None:
    """From one trial: 1e-3 by fewer steps than a single level would take, and not ten times better than asked for."""
    for kind in ("rigid-body", "co-rotational"):
        true, (_, watch) = marched(kind, 240, 3)[0], marched(kind, 30, 3)
        choice = cheapest(watch.estimate, 1e-3)
        steps = next(n for n in (15, 16, 20, 24, 30, 40, 48, 60, 80, 120, 240) if n >= END / choice.h - 1e-9)
        found, after = marched(kind, steps, choice.levels)
        worst = max(error(found, true, name) for name in after.estimate.errors)
        assert choice.levels > 1
        assert 1e-4 < worst < 1.5e-3
        single = max(D[0] for D in watch.estimate.differences.values()) * 4 / 3
        assert choice.work < 0.8 * np.sqrt(single / 1e-3) / watch.estimate.h
