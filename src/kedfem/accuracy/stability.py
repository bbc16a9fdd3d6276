"""Steps that links need as they turn, damped or in co-rotational frames, so that vibration which no step resolves
dies."""

import math

import numpy as np

from kedfem.scene import Scene, corotational, drive_angle, enforced_by_equations, rayleigh, time_grid

MARGIN = 0.8  # of the turn 1 − ρ∞ [rad] in a step, at which such vibration neither grows nor dies (measured)


def fewest_steps(scene: Scene) -> float:
    """Steps of an analysis below which it may grow: the drive then turns by more than 1 − ρ∞ in a step."""
    rho_inf = scene.analysis.rho_inf
    if rayleigh(scene.damping)[1] == 0.0 and not corotational(scene) and not _moving(scene):
        return 0.0
    if rho_inf == 1.0:
        return math.inf
    end = time_grid(scene).end
    t = np.linspace(0.0, end, 2001)
    turning = [
        each.motion for name, each in scene.driven_joints.items() if scene.joints[name].kind != "prismatic"
    ]
    fastest = max((float(np.abs(drive_angle(law, t)[1]).max()) for law in turning), default=0.0)
    return fastest * end / (MARGIN * (1 - rho_inf))


def _moving(scene: Scene) -> str | None:
    """A joint enforced by constraint equations, from whose force vibration comes that grows alike (from twice MARGIN on,
    measured)."""
    return next((name for name in scene.joints if enforced_by_equations(scene, name)), None)


def stability_warning(scene: Scene) -> tuple[str, ...]:
    """A warning where vibration that the step cannot resolve may grow (docs/theory/errors.md)."""
    fewest, steps = fewest_steps(scene), time_grid(scene).steps
    if steps >= fewest:
        return ()
    cause = "co-rotational frames" if corotational(scene) else "damping in proportion to the stiffness"
    if not corotational(scene) and (name := _moving(scene)):
        cause = f"joint {name} between links that move"
    what = f"with {cause} vibration that the step cannot resolve grows in links that turn"
    if fewest == math.inf:
        return (f"analysis.rho_inf = 1: {what}; take 0.95",)
    return (
        f"the step is too long for rho_inf = {scene.analysis.rho_inf:g}: {what} by more than 1 - rho_inf in a step; "
        f"take {math.ceil(fewest)} steps instead of {steps}, or a smaller rho_inf",
    )
