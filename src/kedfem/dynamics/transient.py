"""The elastic motion step by step: M δ'' + C δ' + K δ = P − M R0'', [KED, eq. (20)]."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.condensed import CondensedSteps
from kedfem.dynamics.literal import LiteralSteps
from kedfem.dynamics.loads import applied
from kedfem.dynamics.model import Model
from kedfem.dynamics.scheme import generalised_alpha
from kedfem.dynamics.start import Deflected, Instant, initial_states, quasi_static
from kedfem.dynamics.state import LinkState, Nominal
from kedfem.errors import SolveError
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import cross_matrix
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import MotionLaw, Scene, drive_angle, time_grid

BLOCK = 256  # time points of rigid motion found together


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything at one time point: number of the step, rigid motion (entry k of a block), elastic states."""

    step: int
    motion: RigidMotion
    k: int
    states: list[LinkState]

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self.motion.t[self.k])

    @property
    def phi(self) -> float:
        """Drive angle [rad]."""
        return float(self.motion.phi[self.k])


Steps = CondensedSteps | LiteralSteps


def steps_of(scene: Scene, model: Model) -> Steps:
    """The solver that the scene asks for, its matrices factored.

    Raises
    ------
    SolveError
        If an effective matrix is not positive definite.
    """
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    solver = CondensedSteps if scene.analysis.solver == "condensed" else LiteralSteps
    return solver(model.links, model.joints, scheme, model.damping)


def transient(scene: Scene, linkage: Linkage, along: Path, model: Model, solver: Steps) -> Iterator[Snapshot]:
    """All time points of the analysis, [KED, eq. (20)], one after the other; nothing is kept.

    Raises
    ------
    SolveError
        If a displacement is not finite: with step, time and drive angle.
    """
    grid = time_grid(scene)
    law = scene.drive.motion
    states: list[LinkState] = []
    for first in range(0, grid.steps + 1, BLOCK):
        t = grid.step * np.arange(first, min(first + BLOCK, grid.steps + 1))
        motion = rigid_motion(linkage, along, t, drive_angle(law, t))
        factors = load_factors(model, t)
        for k in range(len(t)):
            if states:
                states = solver.advance(states, nominal(model, factors, motion, k))
                _check_finite(states, first + k, motion, k)
            else:
                states = first_states(scene, linkage, along, law, model)
            yield Snapshot(first + k, motion, k, states)


def load_factors(model: Model, t: Float[np.ndarray, " T"]) -> list[Float[np.ndarray, "_ T"]]:
    """Factors of all loads at given times, per link."""
    return [np.array([load.factor(t) for load in loads]).reshape(len(loads), len(t)) for loads in model.loads]


def nominal(
    model: Model, factors: list[Float[np.ndarray, "_ T"]], motion: RigidMotion, k: int
) -> list[Nominal]:
    """Orientation and P − M R0'' of all links at time point k."""
    return [
        Nominal(motion.R[k, body, : link.d, : link.d], applied(link, loads, factor, motion, body, k))
        for link, loads, factor, body in zip(model.links, model.loads, factors, model.bodies, strict=True)
    ]


def first_states(
    scene: Scene, linkage: Linkage, along: Path, law: MotionLaw, model: Model
) -> list[LinkState]:
    """States at t = 0: at rest, or quasi-static with its rate from three instants."""
    at_rest = scene.analysis.initial == "rest"
    grid = time_grid(scene)
    h = min(grid.step, grid.end / 2)
    t = h * np.arange(1 if at_rest else 3)
    motion = rigid_motion(linkage, along, t, drive_angle(law, t))
    factors = load_factors(model, t)
    instants = [instant(model, factors, motion, k) for k in range(len(t))]
    if at_rest:
        start = [Deflected(*(np.zeros((link.n, link.d)) for _ in range(3))) for link in model.links]
        return initial_states(model.links, model.joints, instants[0].at, model.damping, start)
    u = quasi_static(model.links, model.joints, instants)
    g = [
        [x @ now.R for x, now in zip(us, each.at, strict=True)] for us, each in zip(u, instants, strict=True)
    ]
    rates = ([(-3 * x0 + 4 * x1 - x2) / (2 * h) for x0, x1, x2 in zip(*x, strict=True)] for x in (u, g))
    start = [Deflected(*x) for x in zip(u[0], *rates, strict=True)]
    return initial_states(model.links, model.joints, instants[0].at, model.damping, start)


def instant(model: Model, factors: list[Float[np.ndarray, "_ T"]], motion: RigidMotion, k: int) -> Instant:
    """Orientation, load and spin of all links at time point k."""
    W = cross_matrix(motion.omega[k])
    spin = cross_matrix(motion.alpha[k]) + W @ W
    turning = [spin[body, : link.d, : link.d] for link, body in zip(model.links, model.bodies, strict=True)]
    return Instant(nominal(model, factors, motion, k), turning)


def drive_range(scene: Scene) -> tuple[float, float]:
    """Least and greatest drive angle of the analysis [rad]."""
    grid = time_grid(scene)
    t = grid.step * np.arange(grid.steps + 1)
    phi = drive_angle(scene.drive.motion, t)[0]
    return min(float(phi.min()), 0.0), max(float(phi.max()), 0.0)


def _check_finite(states: list[LinkState], step: int, motion: RigidMotion, k: int) -> None:
    if not all(np.isfinite(s.g[0]).all() and np.isfinite(s.g[-1]).all() for s in states):
        raise SolveError(
            f"analysis: the elastic motion must stay finite, got none at step {step}, t = {motion.t[k]:.6g} s, "
            f"drive angle {np.degrees(motion.phi[k]):.6g} deg"
        )
