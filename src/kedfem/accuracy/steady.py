"""The steady motion of a run: its period, its residual, and whether vibrations about it decay."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, log

import numpy as np

from kedfem.accuracy.prepared import Prepared
from kedfem.dynamics.stepping.combined import level_weights
from kedfem.dynamics.stepping.start import period_map
from kedfem.dynamics.system.period.search import Periodic
from kedfem.dynamics.system.steps import Steps
from kedfem.dynamics.vibration import Vibration, vibration
from kedfem.scene import Scene, percentage, revolution_steps, time_grid

RESOLVED = 0.2  # most oscillations in a step (five steps each) for which a step determines whether they grow
GROWS = 1e-6  # growth in a period above which a vibration is unstable: rounding and the step's error are less
SLOW = 0.999  # factor of a vibration in a period above which it is practically undamped
APART = 0.1  # most difference of the logarithms of growth between levels of a step that resolves it
FALLEN = 0.5  # factor in a period below which a vibration is stable in any case
KNOWN = 1e-3  # error of the state up to which there is no warning
SETTLED = 0.01  # remainder of a vibration that has decayed


@dataclass(frozen=True, slots=True)
class Steady:
    """A steady motion.

    period : [s]
    revolutions : revolutions of the drive in a period; 0 if it does not rotate continuously
    marches : periods that were computed to find it, on all levels in time
    residual : largest change of the state in a period on any level, relative to its size [-]
    growth : factor by which a period multiplies the least damped vibration, combined from all levels; None if it was not
        computed, or if the levels disagree because the method itself causes it
    certain : whether the growth was found to the tolerance
    levels : growth on each level
    vibration : description of the growing vibration of an unstable motion: its frequency and the link that moves most
    passed : oscillations of that vibration in a step, if there are too many to determine its growth; else 0
    """

    period: float
    revolutions: float
    marches: int
    residual: float
    growth: float | None
    certain: bool
    levels: tuple[float, ...] = ()
    vibration: str = ""
    passed: float = 0.0

    def reported(self, frequency: float, words: str, step: float) -> "Steady":
        """The motion with the description of its growing vibration.

        Its growth is unknown if a single level's step [s] does not resolve its frequency [Hz].
        """
        passed = frequency * step
        if len(self.levels) > 1 or passed <= RESOLVED:
            return replace(self, vibration=words)
        return replace(self, vibration=words, growth=None, passed=passed)

    @property
    def unstable(self) -> bool:
        """Whether a vibration grows from period to period."""
        return self.growth is not None and self.growth > 1 + GROWS

    @property
    def periods(self) -> int | None:
        """Number of periods after which vibration has decayed to SETTLED; None if it does not or this is unknown."""
        if self.growth is None or self.growth >= 1 - GROWS:
            return None
        return max(1, ceil(log(SETTLED) / log(max(self.growth, 1e-300))))

    @property
    def error(self) -> float:
        """Sum of the residual over all further periods, relative to the state; 0 if its decay is unknown."""
        return self.residual / max(1 - self.growth, GROWS) if self.growth is not None else 0.0

    @property
    def notes(self) -> dict[str, str | float]:
        """The attributes of a results file."""
        known: dict[str, str | float] = {}
        known |= {} if self.growth is None else {"steady growth in a period": self.growth}
        known |= {"steady vibration that grows": self.vibration} if self.vibration and not self.passed else {}
        return {
            "steady period [s]": self.period, "steady revolutions": self.revolutions,
            "steady marches": float(self.marches), "steady residual": self.residual, **known,
        }  # fmt: skip


def steady_of(scene: Scene, solvers: Sequence[Steps]) -> Steady | None:
    """The steady motion found by the solvers of all levels; None for other motions."""
    found = [x for x in (getattr(each, "steady", None) for each in solvers) if isinstance(x, Periodic)]
    if not found:
        return None
    turn, grid, growth, levels = revolution_steps(scene), time_grid(scene), None, tuple[float, ...]()
    if all(len(each.multipliers) for each in found):
        weights = level_weights(len(found), scene.analysis.rho_inf)
        levels = tuple(max(each.growth, 1e-300) for each in found)
        if max(levels) < FALLEN or np.ptp(np.log(levels)) <= APART:
            growth = float(np.exp(weights @ np.log(levels)))
    return Steady(
        found[0].period, grid.steps / turn if turn else 0.0, sum(each.marches for each in found),
        max(each.residual for each in found), growth, all(each.certain for each in found), levels,
    )  # fmt: skip


def unstable(steady: Steady | None) -> str:
    """The reason why a machine cannot run in its steady motion; empty if it can or if this is unknown."""
    if steady is None or steady.growth is None or not steady.unstable:
        return ""
    sure = "; extrapolation_levels = 2 would show whether the steps are short enough for this"
    return (
        f"the steady motion is unstable: a vibration about it grows by {percentage(steady.growth - 1, 3)} in each period "
        f"of {steady.period:.4g} s{steady.vibration and f', {steady.vibration}'}, until something else limits it"
        f"{'' if len(steady.levels) > 1 else sure}"
    )


def steady_warning(steady: Steady | None) -> tuple[str, ...]:
    """Warnings about the steady motion."""
    if steady is None:
        return ()
    if steady.growth is None and steady.passed:
        return (
            "steady motion: whether it is stable cannot be determined with steps as long as these: a vibration "
            f"{steady.vibration}, is multiplied by {steady.levels[0]:.3g} in a period, but {steady.passed:.2g} of its "
            "oscillations pass in a step, and the method may cause the growth; take smaller steps",
        )
    if steady.growth is None and len(steady.levels) > 1:
        least, most = min(steady.levels), max(steady.levels)
        return (
            "steady motion: whether it is stable cannot be determined with steps as long as these: at the levels in time "
            f"vibrations are multiplied by {least:.3g} and {most:.3g} in a period, which the method causes; "
            "take smaller steps",
        )
    if steady.growth is None:
        text = "steady motion: its stability is not determined if joints have limits, which it may meet"
        return () if steady.certain else (text,)
    if why := unstable(steady):
        return (f"{why}; take another speed, or more damping outside the moving links",)
    out = []
    if steady.growth > SLOW:
        left = f"{steady.periods:,} periods" if steady.periods else "ever"
        out.append(
            f"steady motion: vibrations about it hardly die away ({percentage(1 - steady.growth)} in a period): a "
            f"machine would ring for {left}; give the scene its damping"
        )
    if steady.error > KNOWN:
        out.append(
            f"steady motion: it is known to about {percentage(steady.error)} only: a period leaves {steady.residual:.1g} "
            "of it, and vibrations hardly die away: give the scene its damping, or smaller steps"
        )
    if not steady.certain:
        out.append(
            "steady motion: how fast vibrations about it die away is known roughly only "
            f"(about {percentage(steady.growth, 3)} is left after a period): many are damped alike"
        )
    return tuple(out)


def growing(ready: Prepared, solvers: Sequence[Steps]) -> tuple[Steady | None, Vibration | None]:
    """The steady motion, and the growing vibration of an unstable one."""
    steady, solver = steady_of(ready.scene, solvers), solvers[-1]
    if steady is None or not steady.unstable or solver.steady is None:
        return steady, None
    over = period_map(ready.scene, ready.linkage, ready.path, ready.model, solver, solver.steady.state)
    found = vibration(over, solver, solver.steady)
    steady = steady.reported(found.frequency, found.words, solver.ready.c.h)
    return steady, found if steady.unstable else None
