"""Steps with frames that follow, taken in parts where their sweeps do not settle."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.following import FollowingSteps
from kedfem.dynamics.history import LinkHistory, joined
from kedfem.dynamics.scheme import generalised_alpha
from kedfem.dynamics.segment import NotConverged
from kedfem.motion.rigid import RigidMotion

HALVINGS = 6  # a step is taken in up to 2⁶ parts

Advance = Callable[[FollowingSteps, Any, RigidMotion], tuple[list[LinkHistory], Any]]


class Stuck(Exception):  # noqa: N818 - the driver of the steps says it as an error
    """A step that does not settle in any parts.

    taken, histories : time points of the block before it
    link : name of the link that moves most from sweep to sweep
    """

    def __init__(self, taken: int, histories: list[LinkHistory], link: str) -> None:
        super().__init__(link)
        self.taken, self.histories, self.link = taken, histories, link


@dataclass
class Bridge:
    """Solvers of the same model with smaller steps, made where they are needed, each factored once.

    motion_at : rigid motion at given times
    advance : a solver and its state over the time points of a motion
    bridged : steps taken in parts so far
    """

    h: float
    rho_inf: float
    motion_at: Callable[[Float[np.ndarray, " T"]], RigidMotion]
    advance: Advance
    finer: dict[int, FollowingSteps] = field(default_factory=dict)
    bridged: int = 0

    def block(self, solver: FollowingSteps, state: Any, motion: RigidMotion) -> tuple[list[LinkHistory], Any]:
        """All time points of a block, [KED, eq. (20)].

        Raises
        ------
        Stuck
            With what was done before.
        """
        done: list[list[LinkHistory]] = []
        k = 0
        while k < len(motion.t):
            try:
                histories, state = self.advance(solver, state, motion.part(k, len(motion.t)))
                done.append(histories)
                break
            except NotConverged as failed:
                if failed.taken:
                    done.append(failed.histories)
                k, state = k + failed.taken, failed.state
                histories, state = self._in_parts(solver, state, motion.part(k, k + 1), k, done, failed.link)
                done.append(histories)
                k += 1
        return joined(done), state

    def _in_parts(
        self,
        solver: FollowingSteps,
        state: Any,
        end: RigidMotion,
        k: int,
        done: list[list[LinkHistory]],
        link: str,
    ) -> tuple[list[LinkHistory], Any]:
        """The step to one time point in 2, 4, 8, … parts."""
        self.bridged += 1
        for level in range(1, HALVINGS + 1):
            parts = 2**level
            t = end.t[0] - self.h + self.h * np.arange(1, parts + 1) / parts
            try:
                start = solver.copied(state)
                histories, after = self.advance(self._finer(solver, level), start, self.motion_at(t))
            except NotConverged as failed:
                link = failed.link
                continue
            return [each.part(parts - 1, parts) for each in histories], after
        raise Stuck(k, joined(done), link)

    def _finer(self, solver: FollowingSteps, level: int) -> FollowingSteps:
        if level not in self.finer:
            scheme = generalised_alpha(self.h / 2**level, self.rho_inf)
            self.finer[level] = type(solver)(
                solver.links, solver.joints, scheme, solver.damping, solver.actions, solver.tolerance
            )
        return self.finer[level]
