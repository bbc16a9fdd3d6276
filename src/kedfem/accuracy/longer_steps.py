"""Steps twice as long as an analysis's, for runs of which only differences count."""

import math

from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.resolution import fewest_steps
from kedfem.accuracy.variants import with_analysis
from kedfem.scene import Scene, corotational, rayleigh, time_grid, without_vibration

FEWEST = 4  # steps of such a run
PERIOD = 20  # steps of a vibration that steps twice as long do not show well
DAMPED = 0.01  # its damping ratio, at least


def in_steps(scene: Scene, h: float, steps: int) -> Scene:
    """The scene in so many steps of h."""
    return with_analysis(scene, end_time=h * steps, revolutions=None, step=h, steps_per_revolution=None)


def can_double(ready: Prepared) -> bool:
    """Whether a scene may be run in steps twice as long: where vibration would not grow without bound, and rigid links
    would not turn too far in a step to stay as stiff beside it."""
    grid = time_grid(ready.scene)
    firm = [x for x in ready.model.step_limits if x is not None and x.in_steps(grid.step).rotates_little]
    alike = all(x.in_steps(2 * grid.step).rotates_little for x in firm)
    return alike and grid.steps // 2 >= max(fewest_steps(ready.scene), FEWEST)


def doubled(scene: Scene) -> Scene:
    """The scene in half as many steps, twice as long, a single march."""
    grid = time_grid(scene)
    return with_analysis(in_steps(scene, 2.0 * grid.step, grid.steps // 2), extrapolation_levels=1)


def differs_alike(ready: Prepared) -> bool:
    """Whether two models of a scene differ in steps twice as long as they do in its own, and runs take long.

    With co-rotational frames each step takes several passes. What modes or elements leave out shows in vibration of all
    frequencies; longer steps see that of low ones alike, and damping must be what ends the others: of runs without
    damping their difference was a third of that in the scene's own steps. Stops are met at another time in each.
    """
    scene = ready.scene
    quick = not corotational(scene) or without_vibration(scene) or scene.analysis.kind == "steady"
    if quick or scene.limits:
        return False
    ratio = rayleigh(scene.damping)[1] * math.pi / (PERIOD * time_grid(scene).step)
    return ratio >= DAMPED and can_double(ready)
