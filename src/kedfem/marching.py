"""Steps by hand, for scripts: the system of a scene at its start, to march from any state over any times.

`analyse` writes results and estimates errors; here a script holds the state itself: it stores and restores it, changes a
speed at an instant, or asks for the motion after an event.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.accuracy.plan import ready_to_step
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.variants import with_analysis
from kedfem.arrays import Float
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.dynamics.stepping.start import motion_of, started
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import Motion, Ready, displacements
from kedfem.dynamics.system.state import History, State
from kedfem.errors import SolveError
from kedfem.motion.assembly import assembled
from kedfem.scene import Scene, without_vibration

__all__ = ["History", "March", "State", "begun_march", "march"]


@dataclass(frozen=True, slots=True)
class March:
    """A scene's system, made ready for its steps, with its state at t = 0 and its rigid-body motion.

    scene, prepared : with its choices made; linkage, path and elastic model
    system : what `march` takes
    state : at t = 0; named arrays, complete: a later one may be stored and put in its place
    motion : rigid-body motion at given times
    """

    scene: Scene
    prepared: Prepared
    system: Ready
    state: State
    motion: Motion

    @property
    def step(self) -> float:
        """Length of a step [s]."""
        return self.system.scheme.h

    def times(self, steps: int, state: State | None = None) -> Float[np.ndarray, " T"]:
        """Ends of so many steps after the time of a state, which is the start if not given [s]."""
        begin = float((self.state if state is None else state).time[0])
        return begin + self.step * np.arange(1, steps + 1)

    def marched(self, steps: int, state: State | None = None) -> tuple[State, History]:
        """The state after so many steps from a state, which is the start if not given, and what happened in between.

        Raises
        ------
        SolveError
            If the iterations of a step do not converge.
        """
        begin = self.state if state is None else state
        return march(self.system, begin, self.motion(self.times(steps, begin)), self.motion)

    def displacements(self, link: str, history: History) -> Sequence[Float[np.ndarray, "T n d"]]:
        """Displacements [m] at the nodes of a link, world components: (T, n, d) of each of its segments.

        Raises
        ------
        KeyError
            If the scene has no elastic link of that name.
        """
        names = self.system.system.names
        if link not in names:
            raise KeyError(link)
        return [displacements(self.system, k, history.u) for k, name in enumerate(names) if name == link]


def begun_march(scene: Scene) -> March:
    """The system of a scene at the start that the scene asks for; models, meshes and step are chosen as in `analyse`.

    Its steps are those of the condensed solver, a single march without extrapolation levels.

    Raises
    ------
    KedfemError
        With a message for the user, as by `analyse`; SolveError too for an analysis that takes no steps or those of
        the monolithic solver, and for extrapolation levels.
    """
    if without_vibration(scene):
        got = f"got {scene.analysis.kind!r}; take 'transient'"
        raise SolveError(f"analysis.kind: must be one that takes time steps, {got}")
    if scene.analysis.solver == "monolithic":
        raise SolveError("analysis.solver: must be 'condensed' for a march by hand, got 'monolithic'; leave it out")
    if (levels := scene.analysis.extrapolation_levels or 1) > 1:
        raise SolveError(f"analysis.extrapolation_levels: must be 1 for a march by hand, got {levels}; leave it out")
    scene, _ = assembled(scene)
    _, prepared, _ = ready_to_step(scene)
    scene = with_analysis(prepared.scene, extrapolation_levels=1)
    solver = level_steps(scene, prepared.model)[0]
    state = started(scene, prepared.linkage, prepared.path, prepared.model, solver)
    return March(scene, prepared, solver.ready, state, motion_of(scene, prepared.linkage, prepared.path))
