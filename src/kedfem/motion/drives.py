"""Drives of a linkage over the parameter τ of its path: angle or travel of a single drive, the time with several."""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.scene import MotionLaw, Scene, drive_angle, driven_travel

Driven = tuple[Float[np.ndarray, "T D"], Float[np.ndarray, "T D"], Float[np.ndarray, "T D"]]
STEP = np.radians(12.0)  # of a drive between grid points of a path [rad], of a slide in lengths of the linkage
SAMPLES = 4001  # of laws over a path, to find the fastest


@dataclass(frozen=True, slots=True)
class Drives:
    """The drives of a linkage.

    joints : name of the joint of each drive
    units : of each drive: 1 of an angle [rad], the linkage's size of a travel [m]
    turning : whether it prescribes an angle
    laws : their motions over time; not needed where there is only one drive
    """

    joints: tuple[str, ...] = ()
    units: tuple[float, ...] = ()
    turning: tuple[bool, ...] = ()
    laws: tuple[MotionLaw, ...] = ()

    def __len__(self) -> int:
        return len(self.joints)

    def at(self, tau: Float[np.ndarray, " T"]) -> Driven:
        """Values of all drives and their derivatives by τ."""
        if len(self) == 1:
            return tau[:, None], np.ones((len(tau), 1)), np.zeros((len(tau), 1))
        columns = [drive_angle(law, tau) for law in self.laws]
        q, q1, q2 = (np.stack([c[k] for c in columns], axis=1) if columns else np.zeros((len(tau), 0)) for k in range(3))
        return q, q1, q2

    def step(self, low: float, high: float) -> float:
        """Step of τ between two values: no drive moves by more than STEP in it, nor τ by more than a sixteenth."""
        if len(self) == 1:
            return float(STEP) * self.units[0]
        speeds = np.abs(self.at(np.linspace(low, high, SAMPLES))[1]) / np.array(self.units)
        fastest, least = float(speeds.max(initial=0.0)), 16 * STEP / max(high - low, 1e-300)
        return float(STEP / max(fastest, least))

    def period(self) -> float:
        """τ of the first possible return of all drives; infinite unless all rotate at constant speed."""
        if len(self) == 1:
            return 2 * np.pi if self.turning[0] else np.inf
        if not self.laws or not all(self.turning) or any(x.kind != "constant_speed" for x in self.laws):
            return np.inf
        steady = (abs(x.speed) for x in self.laws if x.kind == "constant_speed" and x.speed)
        slowest = min(steady, default=0.0)
        return 2 * np.pi / slowest if slowest else np.inf


def drives(scene: Scene, size: float) -> Drives:
    """The drives of a scene, its linkage of some size [m]."""
    driven = scene.all_drives
    turning = tuple(not driven_travel(scene, name) for name in driven)
    units = tuple(1.0 if turns else size for turns in turning)
    return Drives(tuple(x.joint for x in driven.values()), units, turning, tuple(x.motion for x in driven.values()))
