"""Stability of a static balance: whether the tangent stiffness, with the change of the forces, is positive definite.

With A the stiffness of bodies in their mean frames and of laws, and J the tangent of all forces at a balance, both for
motions that joints allow,

    A⁻¹ J x = σ x

has σ = 1 where forces do not change the stiffness, σ < 1 under compression, and σ < 0 where the balance is unstable: a
buckled column, or an inverted pendulum. Inertia of the deflection is not in J: beyond a critical speed rotating links may
be stable by it.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.starts.condensed import condensed
from kedfem.dynamics.system.starts.instant import Flat, Instant, Motion
from kedfem.dynamics.system.starts.internal_forces import moved
from kedfem.dynamics.system.starts.linear_equations import LinearEquations
from kedfem.dynamics.system.starts.newton_krylov import Equilibrium, Point
from kedfem.dynamics.system.starts.rotating_bodies import spins_of
from kedfem.dynamics.system.state import State
from kedfem.errors import SolveError
from kedfem.links.reduced import overall_length

DIFFERENCE = 5e-4  # of the largest link: displacements to both sides, and twice as far, where forces are differenced
CENTRAL = {1: 2 / 3, -1: -2 / 3, 2: -1 / 12, -2: 1 / 12}  # of fourth order: what turns linearly is strained by its square
KRYLOV, SHARP, SURE = 40, 1e-2, 3  # directions; change of the least σ from one to the next, so many times, that ends it
NOTHING = 1e-8  # of a direction: rounding, where all motions have been found
UNSTABLE = -1e-8  # rounding leaves some 1e-9


@dataclass(frozen=True, slots=True)
class Stability:
    """The least σ of a balance, and the name of the link that moves most in its motion."""

    least: float
    moves: str


def stability(of: Ready, motion_at: Motion, state: State, at_rest: bool, like: Instant | None = None) -> Stability | None:
    """How stable the balance is in which a state is; None if that is not found out.

    Parameters
    ----------
    motion_at : rigid-body motion at given times
    at_rest : whether it is one of standing still
    like : another instant, with what does not depend on time
    """
    whole = Instant(of, motion_at, float(state.time[0]), like, state.term_angles)
    small = condensed(whole, None if at_rest else lambda: whole.motion)
    now, u = small.at(whole, motion_at, state), small.onto(state.u)
    spins, z1 = (None, None) if at_rest else (spins_of(now), now.interface(small.onto(state.v)))
    problem = Equilibrium(now, lambda u, f: np.zeros_like(u), spins, z1)
    at = problem.at(u)
    m = np.zeros(len(at.e))
    try:
        balance = LinearEquations(now.of, problem.bodies.held(at.R), at.R, problem.asked(at, m))
        m = problem.reactions(at, m, balance.solved(at.r, at.moved).m)
        tangent = _Tangent(problem, at, problem.exerted(at, m), balance)
        least, x = tangent.least()
    except (SolveError, np.linalg.LinAlgError):
        return None
    return Stability(least, of.system.model.links[int(np.argmax(moved(now.of, x)))].name)


class _Tangent:
    """x → A⁻¹ J x of motions that joints allow.

    Parameters
    ----------
    push : forces along all coordinates
    balance : A with all joints and laws
    """

    def __init__(self, problem: Equilibrium, at: Point, push: Flat, balance: LinearEquations) -> None:
        self.problem, self.at, self.push, self.balance = problem, at, push, balance
        self.far = DIFFERENCE * max(map(overall_length, problem.now.of.system.model.links))
        self.falling = np.where(at.hard, 0.0, np.minimum(at.slopes, 0.0))  # tangents of laws that A does not have

    def __call__(self, x: Flat) -> Flat:
        problem, at, now, most = self.problem, self.at, self.problem.now, max(moved(self.problem.now.of, x))
        if most == 0.0:
            return x
        part = self.far / most
        r, turned = np.zeros_like(x), np.zeros(now.of.system.unknowns)
        for side, weight in CENTRAL.items():
            forces, on_joints = self._forces(problem.taken(at, side * part * x))
            r += weight / part * forces
            turned += weight / part * on_joints
        left = -r - problem.inertia.inertia(x) - problem.stiff(at, x)
        more = at.C.T @ (self.falling * (at.C @ now.interface(x))) - turned
        return np.asarray(x + self.balance.solved(left, more=more, alone=True).x)

    def _forces(self, u: Flat) -> tuple[Flat, Flat]:
        """Of all bodies, and of joints and laws on the interface, at a deflection."""
        self.problem.bodies.static.seek_from(self.at.frames)
        now = self.problem.now
        return self.problem.forces(u)[1], now.gradients(now.interface(u)).T @ self.push

    def least(self) -> tuple[float, Flat]:
        """The least σ, and its motion, by Arnoldi's method from motions that joints allow."""
        begin = self.balance.solved(np.random.default_rng(1).standard_normal(len(self.at.u)), alone=True).x
        basis, H = [begin / np.linalg.norm(begin)], np.zeros((KRYLOV + 1, KRYLOV))
        least, settled = np.inf, 0
        for k in range(KRYLOV):
            x = self(basis[k])
            for _ in range(2):  # once more takes out what rounding leaves
                for j, each in enumerate(basis):
                    share = float(each @ x)
                    H[j, k] += share
                    x = x - share * each
            H[k + 1, k] = np.linalg.norm(x)
            values, vectors = np.linalg.eig(H[: k + 1, : k + 1])
            n, before = int(values.real.argmin()), least
            least = float(values[n].real)
            settled = settled + 1 if abs(least - before) <= SHARP * abs(least) else 0
            if settled == SURE or H[k + 1, k] <= NOTHING * np.abs(H[: k + 1, k]).max():
                break
            basis.append(x / H[k + 1, k])
        return least, np.asarray(np.stack(basis[: k + 1], axis=1) @ vectors[:, n].real)
