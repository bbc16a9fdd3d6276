"""The largest stiffness of a rigid link with a co-rotational frame that a time step allows."""

from dataclasses import dataclass, replace

# ω h of rigid links with co-rotational frames: of those that turn far in a step, and of those that do not. Vibration
# that no step resolves grows in links that turn by about 1 − ρ∞ in one (docs/theory/errors.md)
RESOLVED, FIRM = 30.0, 3e3


@dataclass(frozen=True, slots=True)
class StepLimit:
    """The frequency of a rigid link's deformation, bounded by the step.

    highest : frequency for arbitrarily short steps [rad/s]
    turning : its largest angular speed [rad/s]; inf if that is not known beforehand
    stable_rotation : rotation in a step up to which numerical damping damps stiff vibration [rad]
    step : h [s]
    longest : the longest of several steps whose results are compared: it decides for all of them whether the link turns
        little, so that what it gives falls with the square of the step [s]
    """

    highest: float
    turning: float
    stable_rotation: float
    step: float
    longest: float

    @property
    def rotates_little(self) -> bool:
        """Whether it may be FIRM."""
        return self.turning * self.longest <= self.stable_rotation

    @property
    def frequency(self) -> float:
        """ω [rad/s]."""
        return min(self.highest, (FIRM if self.rotates_little else RESOLVED) / self.step)

    def in_steps(self, h: float, longest: float | None = None) -> "StepLimit":
        """The same in other steps."""
        return replace(self, step=h, longest=longest or h)
