"""Equilibrium and motion of geometrically exact beams: full Newton, banded LU, generalised-α."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eig, lapack
from scipy.sparse.csgraph import reverse_cuthill_mckee

from .beams import Beams, assembled, component, internal_force

Law = Callable[[float], tuple[float, float, float]]  # time → value, rate, second rate
Load = Callable[[float], np.ndarray]  # time → (N,) dead nodal forces
NEWTON = 40


class NoConvergenceError(RuntimeError):
    """Newton's iteration has not come to an end."""


@dataclass(frozen=True, slots=True)
class RigidMotions:
    """Rigid motions of all rods at one time: v (r, 2) velocity of the world's origin moving along, omega (r,)."""

    v: np.ndarray
    omega: np.ndarray


@dataclass(frozen=True, slots=True)
class Problem:
    """Beams with supports, loads and damping.

    held : law, or constant value, per held unknown
    load : dead nodal forces over time
    alpha : damping force α M (v − v of the rigid-body motion, at the place where the node is) [1/s]
    beta : stress resultants D (e + β ė) [s]
    rigid_motion : for alpha
    """

    beams: Beams
    held: Mapping[int, Law | float] = field(default_factory=dict)
    load: Load | None = None
    alpha: float = 0.0
    beta: float = 0.0
    rigid_motion: Callable[[float], RigidMotions] | None = None


@dataclass(frozen=True, slots=True)
class State:
    """q, v, a (N,) at a time t [s]."""

    t: float
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray


class Banded:
    """Element matrices put into a band of the free unknowns, and solved.

    free : (f,) unknowns; order : (f,) the free unknowns, so that the band is narrow
    """

    def __init__(self, beams: Beams, held: Mapping[int, object]) -> None:
        graph = assembled(np.ones_like(beams.Me), beams.edof, beams.size)
        free = np.setdiff1d(np.arange(beams.size), list(held))
        self.order = free[reverse_cuthill_mckee(sp.csr_matrix(graph[free][:, free]), symmetric_mode=True)]
        place = np.full(beams.size, -1)
        place[self.order] = np.arange(len(free))
        at = place[beams.edof]
        i = np.repeat(at, at.shape[1], axis=1).ravel()
        j = np.tile(at, (1, at.shape[1])).ravel()
        self.kept = (i >= 0) & (j >= 0)
        i, j = i[self.kept], j[self.kept]
        self.width = int(np.abs(i - j).max())
        self.shape = (3 * self.width + 1, len(free))
        self.flat = (2 * self.width + i - j) * len(free) + j
        self.diagonal = 2 * self.width

    def band(self, Ke: np.ndarray, diagonal: np.ndarray) -> np.ndarray:
        """Σ Ke + diag: element matrices (E, k, k), diagonal (N,)."""
        ab = np.bincount(self.flat, Ke.ravel()[self.kept], self.shape[0] * self.shape[1]).reshape(self.shape)
        ab[self.diagonal] += diagonal[self.order]
        return np.asarray(ab)

    def solution(self, Ke: np.ndarray, diagonal: np.ndarray, rhs: np.ndarray) -> np.ndarray:
        """The free part of the solution, (N,) with zeros at what is held."""
        *_, x, failed = lapack.dgbsv(
            self.width, self.width, np.asfortranarray(self.band(Ke, diagonal)), rhs[self.order], overwrite_ab=1
        )
        if failed:
            raise NoConvergenceError(f"singular matrix, dgbsv says {failed}")
        out = np.zeros(len(rhs))
        out[self.order] = x
        return out


def held_values(problem: Problem, t: float) -> tuple[list[int], np.ndarray]:
    """The held unknowns and their values, rates and second rates (3, h)."""
    laws = [law(t) if callable(law) else (law, 0.0, 0.0) for law in problem.held.values()]
    return list(problem.held), np.array(laws, float).reshape(-1, 3).T


def turning(beams: Beams, q: np.ndarray, motions: RigidMotions) -> tuple[np.ndarray, np.ndarray]:
    """Rate (E, k) of each element's unknowns, and (N,) of the bodies', in the rigid-body motion."""
    qe, omega = q[beams.edof].reshape(len(beams.edof), -1, 3), motions.omega[beams.rod][:, None]
    rate = np.empty_like(qe)
    rate[..., :2] = motions.v[beams.rod][:, None, :]
    rate[..., 0] -= omega * qe[..., 1]
    rate[..., 1] += omega * qe[..., 0]
    rate[..., 2] = omega
    lumped = np.zeros(beams.size)
    if beams.lumps.any():
        angles = np.concatenate(beams.dof)[:, 2]
        lumped[angles] = motions.omega[beams.lump_rod[angles]]
    return rate.reshape(len(beams.edof), -1), lumped


def mass_damping(problem: Problem, state: State, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """α M (v − rigid-body), with the rotations of bodies only, and its derivative by q when dv = rate · dq, (E, k, k)."""
    beams, alpha = problem.beams, problem.alpha
    assert problem.rigid_motion is not None
    motions = problem.rigid_motion(state.t)
    rigid_motion, lumped = turning(beams, state.q, motions)
    relative = state.v[beams.edof] - rigid_motion
    forces = alpha * (beams.Me @ relative[..., None])[..., 0]
    out = np.bincount(beams.edof.ravel(), forces.ravel(), beams.size)
    out += alpha * beams.lumps * (state.v - lumped)
    k = beams.Me.shape[1]
    J = np.kron(np.eye(k // 3), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]]))
    tangent = alpha * (rate * beams.Me - motions.omega[beams.rod][:, None, None] * (beams.Me @ J))
    return out, tangent


def forces(problem: Problem, state: State, rate: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Internal and damping forces less the loads (N,), and their derivative by q when dv = rate · dq (E, k, k)."""
    f, Ke = internal_force(problem.beams, state.q, state.v, problem.beta, rate)
    if problem.alpha:
        damping, tangent = mass_damping(problem, state, rate)
        f, Ke = f + damping, Ke + tangent
    return (f if problem.load is None else f - problem.load(state.t)), Ke


def equilibrium(problem: Problem, steps: int = 10, q: np.ndarray | None = None, spin: float = 0.0) -> np.ndarray:
    """The state at 'time' 1 of load(t) and held(t), reached in equal steps of t [the state at rest at 0].

    Parameters
    ----------
    spin : angular velocity √t · spin of the world about the origin, as its centrifugal load [rad/s]
    """
    beams, band = problem.beams, Banded(problem.beams, problem.held)
    q = (beams.q0 if q is None else q).copy()
    zero = np.zeros(beams.size)
    translation = component(beams, 0) + component(beams, 1)
    outward = beams.Me * np.kron(np.ones(beams.Me.shape[1] // 3), [1.0, 1.0, 0.0])
    for t in np.arange(1, steps + 1) / steps:
        at, values = held_values(problem, t)
        q[at] = values[0]
        for _ in range(NEWTON):
            f, Ke = forces(problem, State(t, q, zero, zero))
            f = f - t * spin**2 * (beams.M @ (translation * q))
            change = band.solution(Ke - t * spin**2 * outward, zero, -f)
            q += change
            if np.abs(change).max() < 1e-9:
                break
        else:
            raise NoConvergenceError(f"no equilibrium at {t:.4g} of the load")
    return q


def start(problem: Problem, q: np.ndarray, v: np.ndarray, t: float = 0.0) -> State:
    """The state with the acceleration that follows from q and v."""
    beams = problem.beams
    at, values = held_values(problem, t)
    q, v, a = q.copy(), v.copy(), np.zeros(beams.size)
    q[at], v[at], a[at] = values
    f, _ = forces(problem, State(t, q, v, a))
    a += Banded(beams, problem.held).solution(beams.Me, beams.lumps, -f - beams.M @ a)
    return State(t, q, v, a)


Observed = Callable[[State], np.ndarray]


@dataclass(frozen=True, slots=True)
class Stepping:
    """Generalised-α with a constant step (Chung and Hulbert 1993).

    h, steps : step [s] and their number
    every : steps from one kept state to the next
    rho_inf : spectral radius at infinite frequency; 1 is the average acceleration
    """

    h: float
    steps: int
    every: int = 1
    rho_inf: float = 0.9


def motion(
    problem: Problem, first: State, stepping: Stepping, observed: Observed
) -> tuple[np.ndarray, np.ndarray, State]:
    """The motion from a first state on, forces and inertia each mixed from both ends of a step.

    Parameters
    ----------
    observed : what is kept of a state

    Returns
    -------
    t (T,), kept values (T, ...) and the last state
    """
    h, rho_inf = stepping.h, stepping.rho_inf
    beams, band = problem.beams, Banded(problem.beams, problem.held)
    am, af = ((2 * rho_inf - 1) / (rho_inf + 1), rho_inf / (rho_inf + 1)) if rho_inf < 1 else (0.0, 0.0)
    gamma = 0.5 - am + af
    beta = (1 - am + af) ** 2 / 4
    now, (f0, _) = first, forces(problem, first)
    times, kept = [first.t], [observed(first)]
    inertia, lumped = (1 - am) / (beta * h**2) * beams.Me, (1 - am) / (beta * h**2) * beams.lumps
    scale = np.ptp(beams.q0)
    for step in range(1, stepping.steps + 1):
        t = first.t + step * h
        at, values = held_values(problem, t)
        q = now.q + h * now.v + h * h / 2 * now.a
        for iteration in range(NEWTON):
            a = (q - now.q - h * now.v) / (beta * h * h) - (1 / (2 * beta) - 1) * now.a
            v = now.v + h * ((1 - gamma) * now.a + gamma * a)
            q[at], v[at], a[at] = values
            f, Ke = forces(problem, State(t, q, v, a), gamma / (beta * h))
            residual = beams.M @ ((1 - am) * a + am * now.a) + (1 - af) * f + af * f0
            if iteration and size < 1e-7 * scale:  # the correction was so small that what is left is rounding
                break
            effective = inertia + (1 - af) * Ke
            bodies = lumped + (1 - af) * damped(problem, gamma / (beta * h))
            change = band.solution(effective, bodies, -residual)
            size = np.abs(change).max()
            q = q + change
        else:
            raise NoConvergenceError(f"no solution at t = {t:.6g} s, corrections of {size:.3g}")
        now, f0 = State(t, q, v, a), f
        if step % stepping.every == 0:
            times.append(t)
            kept.append(observed(now))
    return np.array(times), np.array(kept), now


def damped(problem: Problem, rate: float) -> np.ndarray:
    """Derivative of the damping of the bodies (N,)."""
    return problem.alpha * rate * problem.beams.lumps


def spinning_frequencies(problem: Problem, q: np.ndarray, spin: float, coriolis: bool = True) -> np.ndarray:
    """Angular frequencies [rad/s] of small vibrations about a state that turns steadily about the origin."""
    beams = problem.beams
    free = np.setdiff1d(np.arange(beams.size), list(problem.held))
    zero = np.zeros(beams.size)
    k = beams.Me.shape[1] // 3
    Ke = forces(problem, State(1.0, q, zero, zero))[1] - spin**2 * beams.Me * np.tile([1.0, 1.0, 0.0], k)
    J = np.kron(np.eye(k), np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 0]]))
    K, M, G = (
        assembled(x, beams.edof, beams.size)[free][:, free].toarray() for x in (Ke, beams.Me, 2 * spin * beams.Me @ J)
    )
    M += np.diag(beams.lumps[free])
    n = len(free)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, G * coriolis)]])
    values = eig(A, right=False)
    return np.sort(values.imag[values.imag > 0])
