"""Facts about the steady motion of a run: its period, how it was found, and whether vibrations about it decay."""

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
from kedfem.scene import Scene, revolution_steps, time_grid

# oscillations in a step, five steps each: of faster ones a step does not determine whether they grow
RESOLVED = 0.2
GROWS = 1e-6  # by which a period multiplies more than one: rounding and the step's error are less
SLOW = 0.999  # a vibration that falls by less in a period is as good as undamped
APART = 0.1  # of logarithms of growth, by which levels of a step that resolves what grows differ at most
FALLEN = 0.5  # what falls to less in a period is stable, whatever its last digit
KNOWN = 1e-3  # error of the state that needs no warning
SETTLED = 0.01  # what is left of a vibration that has died away


@dataclass(frozen=True, slots=True)
class Steady:
    """A steady motion.

    period : [s]; revolutions : of the drive in it, 0 if it does not rotate continuously
    marches : periods that were marched to find it, at all levels in time
    residual : change of the state in a period, relative to its size, at worst of all levels
    growth : by which a period multiplies the least damped vibration, combined of all levels; None if not asked for, or
        if the levels do not agree: then it is the method's own
    certain : whether that was found to the tolerance
    levels : growth of each level
    vibration : that one, of an unstable motion: how fast it is, and which link moves most, in words
    passed : periods of that vibration in a step, if these are too many for its growth to be more than the method's doing
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
        """With the vibration that grows; its growth is not known where steps [s] do not resolve its frequency [Hz].

        Several levels in time that agree do resolve it.
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
        """Number of periods after which a vibration has fallen to SETTLED; None if none falls, or if it is unknown."""
        if self.growth is None or self.growth >= 1 - GROWS:
            return None
        return max(1, ceil(log(SETTLED) / log(max(self.growth, 1e-300))))

    @property
    def error(self) -> float:
        """Sum of the residual over all further periods, relative to the state; 0 if its decay is unknown."""
        return self.residual / max(1 - self.growth, GROWS) if self.growth is not None else 0.0

    @property
    def notes(self) -> dict[str, str | float]:
        """As notes of a results file."""
        known: dict[str, str | float] = {}
        known |= {} if self.growth is None else {"steady growth in a period": self.growth}
        known |= {"steady vibration that grows": self.vibration} if self.vibration and not self.passed else {}
        return {
            "steady period [s]": self.period, "steady revolutions": self.revolutions,
            "steady marches": float(self.marches), "steady residual": self.residual, **known,
        }  # fmt: skip


def steady_of(scene: Scene, solvers: Sequence[Steps]) -> Steady | None:
    """The steady motion that the solvers of all levels found; None for other motions."""
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
    """The reason why a machine does not run in its steady motion; empty if it does, or if that is unknown."""
    if steady is None or steady.growth is None or not steady.unstable:
        return ""
    sure = "; that the steps are short enough for this only extrapolation_levels = 2 shows"
    return (
        f"the steady motion is unstable: a vibration about it grows by {100 * (steady.growth - 1):.3g} % in each period "
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
            "oscillations pass in a step, and the growth may be the method's doing; take smaller steps",
        )
    if steady.growth is None and len(steady.levels) > 1:
        least, most = min(steady.levels), max(steady.levels)
        return (
            "steady motion: whether it is stable cannot be determined with steps as long as these: at the levels in time "
            f"vibrations are multiplied by {least:.3g} and {most:.3g} in a period, which is the method's doing; "
            "take smaller steps",
        )
    if steady.growth is None:
        text = "steady motion: whether it is stable is not found out where joints have limits, which it may run against"
        return () if steady.certain else (text,)
    if why := unstable(steady):
        return (f"{why}; take another speed, or more damping outside the moving links",)
    out = []
    if steady.growth > SLOW:
        left = f"{steady.periods:,} periods" if steady.periods else "ever"
        out.append(
            f"steady motion: vibrations about it hardly die away ({100 * (1 - steady.growth):.2g} % in a period): a "
            f"machine would ring for {left}; give the scene its damping"
        )
    if steady.error > KNOWN:
        out.append(
            f"steady motion: it is known to about {100 * steady.error:.2g} % only: a period leaves {steady.residual:.1g} "
            "of it, and vibrations hardly die away: give the scene its damping, or smaller steps"
        )
    if not steady.certain:
        out.append(
            "steady motion: how fast vibrations about it die away is known roughly only "
            f"(about {100 * steady.growth:.3g} % is left after a period): many are damped alike"
        )
    return tuple(out)


def growing(ready: Prepared, solvers: Sequence[Steps]) -> tuple[Steady | None, Vibration | None]:
    """What is known of a steady motion, and of one that is unstable the vibration that grows."""
    steady, solver = steady_of(ready.scene, solvers), solvers[-1]
    if steady is None or not steady.unstable or solver.steady is None:
        return steady, None
    over = period_map(ready.scene, ready.linkage, ready.path, ready.model, solver, solver.steady.state)
    found = vibration(over, solver, solver.steady)
    steady = steady.reported(found.frequency, found.words, solver.ready.c.h)
    return steady, found if steady.unstable else None
