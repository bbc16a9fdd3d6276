"""Marks of a march, from which it can be resumed: the last blocks of its levels and their state before."""

from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from kedfem.dynamics.system.state import State
from kedfem.dynamics.system.steps import Steps


@dataclass
class Mark:
    """A march at the beginning of the block that it is in.

    step : number of the block's first time point
    state : of the solver before it; None before the first time point
    eased : steps of the solver so far whose tolerance was eased
    steady : what the solver found of a steady motion; None of another
    unstable : positions so far whose balance is, in words
    kept : whether anybody stores it
    start : the state at t = 0, where the march begins there, if it is known
    last : δ'' and the balance's acceleration before it of each link, where levels are combined
    """

    step: int = 0
    state: Any = None
    eased: int = 0
    last: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    steady: Any = None
    unstable: list[str] = field(default_factory=list)
    kept: bool = False
    start: Any = None
    REMEMBERED: ClassVar = ("step", "state", "eased", "last", "steady", "unstable")

    def set(self, step: int, state: Any, solver: Steps) -> None:
        """The march begins a block; a state that its solver uses up is copied, if anybody stores it.

        The system's states are never used up.
        """
        if self.kept:
            self.step, self.eased, self.steady, self.unstable = step, solver.eased, solver.steady, [*solver.unstable]
            self.state = state if isinstance(state, State) else deepcopy(state)


@dataclass
class Marks:
    """All levels of a march, and how far what they make together has come.

    done : number of the next time point of the analysis
    levels : coarsest first
    corrections : of the finest level's states at the last common time, link by link
    """

    done: int = 0
    levels: list[Mark] = field(default_factory=list)
    corrections: list[dict[str, np.ndarray]] = field(default_factory=list)
    REMEMBERED: ClassVar = ("done", "levels", "corrections")

    @classmethod
    def of(cls, solvers: int, kept: bool = True) -> "Marks":
        """Marks before the first time point, for a number of levels whose states are kept."""
        return cls(levels=[Mark(kept=kept) for _ in range(solvers)])
