"""Runs in steps twice as long as those of an analysis, for differences between two models."""

import math

from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.resolution import fewest_steps
from kedfem.accuracy.variants import with_analysis
from kedfem.scene import Scene, corotational, rayleigh, time_grid, without_vibration

FEWEST = 4  # least number of steps of such a run
PERIOD = 20  # steps in the period of a vibration that steps twice as long resolve badly
DAMPED = 0.01  # least damping ratio of such a vibration


def in_steps(scene: Scene, h: float, steps: int) -> Scene:
    """The scene in `steps` steps of h [s]."""
    return with_analysis(scene, end_time=h * steps, revolutions=None, step=h, steps_per_revolution=None)


def can_double(ready: Prepared) -> bool:
    """Whether a scene may be run in steps twice as long.

    Vibration must not grow without bound, and rigid links must not rotate so far in a step that they lose stiffness.
    """
    grid = time_grid(ready.scene)
    firm = [x for x in ready.model.step_limits if x is not None and x.in_steps(grid.step).rotates_little]
    alike = all(x.in_steps(2 * grid.step).rotates_little for x in firm)
    return alike and grid.steps // 2 >= max(fewest_steps(ready.scene), FEWEST)


def doubled(scene: Scene) -> Scene:
    """The scene in half as many steps, twice as long, on a single level."""
    grid = time_grid(scene)
    return with_analysis(in_steps(scene, 2.0 * grid.step, grid.steps // 2), extrapolation_levels=1)


def differs_alike(ready: Prepared) -> bool:
    """Whether runs take long, and two models of a scene differ in steps twice as long as they do in its own steps.

    With co-rotational frames each step takes several iterations. The error of modes or elements shows in vibration of
    all frequencies. Longer steps resolve that of low ones as well, and damping must end the others: without damping the
    difference was a third of that in the scene's own steps. Joint limits are met at different times.
    """
    scene = ready.scene
    quick = not corotational(scene) or without_vibration(scene) or scene.analysis.kind == "steady"
    if quick or scene.limits:
        return False
    ratio = rayleigh(scene.damping)[1] * math.pi / (PERIOD * time_grid(scene).step)
    return ratio >= DAMPED and can_double(ready)
