"""Checks of the time step and the drive's speed: resolution of the motion, stability in rotating links, resonances."""

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import ClassVar

import numpy as np

from kedfem.accuracy.error_budget import percent
from kedfem.accuracy.prepared import Prepared
from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.reduction import frozen_frequencies, static_parts
from kedfem.dynamics.stepping.scheme import Scheme, generalised_alpha, stable_rotation
from kedfem.errors import SolveError
from kedfem.motion.rigid import rigid_motion
from kedfem.results.stresses.envelope import largest_row
from kedfem.scene import (
    Scene,
    corotational,
    drive_angle,
    driven_travel,
    enforced_by_equations,
    path_parameter,
    rayleigh,
    revolution_steps,
    time_grid,
)

POSES = 8  # positions of the last revolution at which the linkage is frozen
LARGE = 100_000  # unknowns above which the stiffness is not factored for this check
FEWEST = 10  # least number of steps in a period, which is then 3 % too long
UNFOLLOWED = 0.01  # error of a step below which unresolved vibration is negligible
HARMONICS = 5  # of the drive's speed that are compared
NEAR = 0.03  # relative distance of a harmonic from a frequency that counts as a resonance


@dataclass(frozen=True, slots=True)
class Resonance:
    """A harmonic of the drive [Hz] near the first frequency of the linkage at a drive angle [rad]."""

    harmonic: int
    frequency: float
    angle: float


@dataclass(frozen=True, slots=True)
class Resolution:
    """First frequencies, in some poses with fixed drive, of the vibrations that the loads excite.

    step : time step of the analysis [s]
    first : (p,) frequency in each pose [Hz]
    angles : (p,) drive angle of each pose [rad]
    resonances : those with harmonics of the drive
    """

    step: float
    first: Float[np.ndarray, " p"]
    angles: Float[np.ndarray, " p"]
    resonances: tuple[Resonance, ...]

    @property
    def steps_per_period(self) -> float:
        """Fewest steps in a period of the first frequency."""
        return 1 / (self.step * float(self.first.max()))


def resolution(ready: Prepared) -> Resolution | None:
    """First frequencies of a prepared scene's linkage; None if it can move, nothing is excited or the model is large."""
    if ready.model.unknowns > LARGE or ready.linkage.mobility:
        return None
    scene, grid = ready.scene, time_grid(ready.scene)
    turn = revolution_steps(scene)
    span = min((turn or grid.steps) * grid.step, grid.end)
    t = grid.end - span * np.arange(POSES)[::-1] / POSES
    phi = path_parameter(scene, t)
    motion = rigid_motion(ready.linkage, ready.path, t, phi)
    try:
        parts = static_parts(ready.model)
        lowest = frozen_frequencies(ready.model, parts, motion)
    except SolveError:  # a link without support
        return None
    excited = [k for k, found in enumerate(lowest) if len(found)]
    if not excited:
        return None
    first = np.array([lowest[k][0] for k in excited]) / (2 * np.pi)
    angles = phi[0][excited]
    speed = 1 / (turn * grid.step) if turn else 0.0
    return Resolution(grid.step, first, angles, tuple(resonances(first, angles, speed)))


def resonances(first: Float[np.ndarray, " p"], angles: Float[np.ndarray, " p"], speed: float) -> list[Resonance]:
    """Poses in which a harmonic of a drive's speed [Hz] is near a frequency."""
    found = []
    around = [*zip(first, angles, strict=True), (first[0], angles[0])]
    for k in range(1, HARMONICS + 1):
        for (f0, at), (f1, _) in pairwise(around):
            if speed and (1 - NEAR) * min(f0, f1) <= k * speed <= (1 + NEAR) * max(f0, f1):
                found.append(Resonance(k, k * speed, float(at)))
                break
    return found


def local_error(scheme: Scheme) -> float:
    """Factor (1 + 3 θ²)/12 h² [s²] of |δ1'' − δ0''| in the error of one step in the displacement, θ = α_m − α_f.

    After Zienkiewicz and Xie (1991): for Newmark's method it is their (6 β − 1)/6, 1/12 with average acceleration;
    δ'' of generalised-α belongs to the time θ h after the step's end.
    """
    return (1 + 3 * (scheme.alpha_m - scheme.alpha_f) ** 2) / 12 * scheme.h**2


@dataclass
class StepError:
    """The largest local error of the steps so far, in the mass norm, and the sum of local errors.

    Vibration accumulates them against damping at its frequency: earlier errors fall by exp(−h (α + β ω²)/2) in a step,
    ω² = |δ''|/|δ|.
    """

    model: Model
    constant: float
    h: float
    change: float = 0.0
    peak: float = 0.0
    grown: float = 0.0
    _swing: float = field(default=0.0, repr=False)
    _left: float = field(default=0.0, repr=False)
    _last: Float[np.ndarray, " k"] | None = field(default=None, repr=False)
    REMEMBERED: ClassVar = ("change", "peak", "grown", "_swing", "_left", "_last")

    def add(self, block: Block) -> None:
        """Evaluate the steps of a block."""
        a = self._weighted(block, "a")
        before = a[:1] if self._last is None else self._last[None]
        change = np.linalg.norm(np.diff(np.concatenate([before, a]), axis=0), axis=1)
        self.change = max(self.change, float(change.max(initial=0.0)))
        self.peak = max(self.peak, largest_row(self._weighted(block, "u")))
        self._swing = max(self._swing, largest_row(a))
        rate = self.model.damping.alpha
        if self.peak:
            rate += self.model.damping.beta * self._swing / self.peak
        kept = float(np.exp(-self.h * rate / 2))
        for x in change:
            self._left = kept * self._left + float(x)
            self.grown = max(self.grown, self._left)
        self._last = a[-1]

    @property
    def relative(self) -> float:
        """The largest local error, relative to the largest displacement."""
        return self.constant * self.change / self.peak if self.peak else 0.0

    @property
    def total(self) -> float:
        """The sum of local errors, relative to the largest displacement, at most 1."""
        return min(1.0, self.constant * self.grown / self.peak) if self.peak else 0.0

    def _weighted(self, block: Block, name: str) -> Float[np.ndarray, "T k"]:
        """√m times a field of all links; of a full mass matrix the diagonal is used."""
        both = zip(self.model.links, block.links, strict=True)
        every = ((getattr(history, name), c, m) for link, history in both for c, m in enumerate(link.mass))
        columns = [x[:, :, c] * np.sqrt(np.abs(m.diagonal())) for x, c, m in every]
        return np.concatenate(columns, axis=1)


def step_error(ready: Prepared) -> StepError:
    """The monitor of a prepared scene's local errors."""
    scheme = generalised_alpha(time_grid(ready.scene).step, ready.scene.analysis.rho_inf)
    return StepError(ready.model, local_error(scheme), scheme.h)


def resolution_warnings(found: Resolution | None, error: float | None = None) -> list[str]:
    """Warnings about the step and the drive's speed.

    Too few steps in a period are reported only if the error of the step shows that something vibrates.

    Parameters
    ----------
    error : of the step [-], if known
    """
    out = []
    if found is not None and found.steps_per_period < FEWEST and (error is None or error > UNFOLLOWED):
        known = "" if error is None else f", and its error is estimated to be {percent(error)}"
        out.append(
            f"the step resolves the first frequency of the linkage, {found.first.max():.3g} Hz, by "
            f"{found.steps_per_period:.2g} steps in a period{known}: vibration is not resolved; take {FEWEST} or more, a "
            f"step of {1 / (FEWEST * found.first.max()):.2g} s"
        )
    if found is not None and found.resonances:
        numbers = ", ".join(f"{x.harmonic}" for x in found.resonances)
        speeds = ", ".join(f"{x.frequency:.4g}" for x in found.resonances)
        angles = ", ".join(f"{np.degrees(x.angle) % 360:.0f}" for x in found.resonances)
        out.append(
            f"the drive's harmonic {numbers} ({speeds} Hz) meets the first frequency of the linkage, "
            f"{found.first.min():.3g} to {found.first.max():.3g} Hz over the revolution, near drive angle {angles} deg: "
            "resonance, as far as damping and the short passage allow"
        )
    return out


def fewest_steps(scene: Scene) -> float:
    """Least number of steps with which vibration cannot grow: the drive rotates by at most 1 − ρ∞ in a step."""
    rho_inf = scene.analysis.rho_inf
    if rayleigh(scene.damping)[1] == 0.0 and not corotational(scene) and not _moving(scene):
        return 0.0
    if rho_inf == 1.0:
        return math.inf
    end = time_grid(scene).end
    t = np.linspace(0.0, end, 2001)
    driven = scene.all_drives.items()
    turning = [each.motion for name, each in driven if not driven_travel(scene, name)]
    fastest = max((float(np.abs(drive_angle(law, t)[1]).max()) for law in turning), default=0.0)
    return fastest * end / stable_rotation(rho_inf)


def _moving(scene: Scene) -> str | None:
    """A joint enforced by constraint equations, whose forces cause vibration that grows in the same way, if there is one.

    It grows from twice `stable_rotation` on (measured).
    """
    return next((name for name in scene.joints if enforced_by_equations(scene, name)), None)


def stability_warning(scene: Scene) -> tuple[str, ...]:
    """A warning where vibration that the step cannot resolve may grow (docs/theory/errors.md)."""
    fewest, steps = fewest_steps(scene), time_grid(scene).steps
    if steps >= fewest:
        return ()
    cause = "co-rotational frames" if corotational(scene) else "damping in proportion to the stiffness"
    if not corotational(scene) and (name := _moving(scene)):
        cause = f"joint {name} between links that move"
    what = f"with {cause} vibration that the step cannot resolve grows in links that rotate"
    if fewest == math.inf:
        return (f"analysis.rho_inf = 1: {what}; take 0.95",)
    return (
        f"the step is too long for rho_inf = {scene.analysis.rho_inf:g}: {what} by more than 1 - rho_inf in a step; "
        f"take {math.ceil(fewest)} steps instead of {steps}, or a smaller rho_inf",
    )
