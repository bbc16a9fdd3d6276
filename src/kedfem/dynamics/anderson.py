"""Anderson acceleration of iterations."""

import numpy as np

from kedfem.arrays import Float

DEPTH = 4  # iterations that are remembered
SAME = 1e-8  # pairs that repeat each other


class AndersonAcceleration:
    """Anderson acceleration of iterations: the step whose change, extrapolated from the last few iterations, is smallest.

    Anderson (1965), as Walker and Ni (2011) write it. It costs a few products and converges where plain iterations do
    not: for bent segments, whose tangent is only approximated by their reference stiffness in the mean frame.
    """

    def __init__(self) -> None:
        self._known, self._slot = 0, 0
        self._steps = self._changes = np.zeros((DEPTH, 0))
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def begin(self) -> None:
        """Begin a time step; differences of the last step's iterations are kept."""
        self._last = None

    def step(self, change: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """The step after an iteration that requests a change."""
        if self._last is not None:
            self._learn(change)
        taken, m = change, self._known
        if m:
            dF = self._changes[:m]
            scale = np.linalg.norm(dF, axis=1)
            gamma = np.linalg.lstsq((dF / scale[:, None]).T, change, rcond=SAME)[0] / scale
            taken = change - gamma @ self._steps[:m]
        self._last = taken, change
        return np.asarray(taken)

    def _learn(self, change: Float[np.ndarray, " N"]) -> None:
        """Replace the oldest difference by that of the last step."""
        if not self._steps.size:
            self._steps, self._changes = np.zeros((2, DEPTH, len(change)))
        taken, before = self._last if self._last is not None else (change, change)
        slot, self._known = self._slot, min(DEPTH, self._known + 1)
        np.subtract(change, before, out=self._changes[slot])
        np.add(taken, self._changes[slot], out=self._steps[slot])
        self._slot = (slot + 1) % DEPTH
