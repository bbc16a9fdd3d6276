"""Newton–Krylov method for a deflection in static balance, for displacements of any size.

With A the stiffness of bodies in their mean frames, and all forces on bodies and interface at u as right-hand sides,

    A Δ = r − (J − A) Δ + Wᵀ λ,   C Δz + Δm / κ = target,   Σ Bᵀ R λ = Cᵀ (m + Δm) + (∂C/∂z Δz)ᵀ m

J Δ is a difference of forces along Δ, ∂C/∂z Δz one of gradients, so that both include forces that rotate with bodies:
those of springs and joints, axial forces of beams, preloads. GMRES solves for Δ, preconditioned by A. Rigid bodies then
take a finite rotation, as its linear part would strain them; the next Δ closes the joints that this opens. The step is
shortened until the residual, preconditioned by the same factor, decreases (Deuflhard's monotonicity test). Slender bodies
need whole steps, and their tangents in A: what a large rotation stretches has a residual far above that of its bending,
which the next step takes out. Where shortened steps find no balance such ones are taken.
"""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, gmres

from kedfem.arrays import Bool, Float
from kedfem.dynamics.frames import mean_orientation
from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.system.record import COROTATIONAL
from kedfem.dynamics.system.sparse import momentum
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import Frames as Sought
from kedfem.dynamics.system.starts.internal_forces import drawn, moved, own, rows
from kedfem.dynamics.system.starts.linear_equations import LinearEquations
from kedfem.dynamics.system.starts.open_joints import gaps
from kedfem.dynamics.system.starts.rotating_bodies import CONVERGED, RotatingBodies, Spins
from kedfem.dynamics.system.starts.tangents import Tangents, held_by_tangents, tangents
from kedfem.errors import SolveError
from kedfem.links.reduced import overall_length

ITERATIONS, WHOLE = 120, 30  # of shortened steps, and of whole ones
SHORTEST, IN_A_ROW = 1 / 64, 4  # of a step; so many of them end a search
FALLS = 0.25  # of a step's length: share by which what is left has to fall
KRYLOV = 40
LEFT, NONE = 1e-3, 1e-7  # of a residual by GMRES: an iteration leaves about as much of the error; of whole steps
ROUNDING = 1e-8  # of the deflection: changes below it that do not fall
LEAST = 1e-6  # the same of soft directions, where nothing is left to rounding and no step lessens it
DIFFERENCE = 1e-9  # of the size of bodies: displacements along which forces are differenced
CENTRAL = 1e3  # times these on both sides: rounding in the axial force of a slender beam is little of its bending

Frames = Float[np.ndarray, "L 3 3"]


@dataclass(frozen=True, slots=True)
class Point:
    """All forces at a deflection.

    f, r, R : internal forces and all that act on bodies, world components, and their mean frames
    z, C, e : interface unknowns, gradients and values of coordinates
    laws, slopes : (r,) force along each coordinate, and how it falls with it
    hard : which coordinates are constraints
    moved : (N,) what closes joints together with u
    frames : of bodies, from which those nearby are sought
    """

    u: Flat
    f: Flat
    r: Flat
    R: Frames
    z: Flat
    C: sp.csr_array
    e: Flat
    laws: Flat
    slopes: Flat
    hard: Bool[np.ndarray, " r"]
    moved: Flat
    frames: Sought


class Equilibrium:
    """The balance of all forces at one instant.

    Parameters
    ----------
    more : forces beside applied and internal ones, at a deflection u with the internal force f
    spins : of the inertia that the deflection has as it turns, if any
    z1 : rates of the interface unknowns
    """

    def __init__(self, now: Instant, more: Callable[[Flat, Flat], Flat], spins: Spins | None, z1: Flat | None) -> None:
        self.now, self.more, self.z1 = now, more, z1
        self.inertia = RotatingBodies(now, spins)
        self.bodies = RotatingBodies(now, None)
        self.right = [np.linalg.pinv(part.W) for part in now.of.parts]
        links = now.of.system.model.links
        mass = sum(float(link.one @ link.m1[:, 0]) for link in links)
        self.size = DIFFERENCE * np.sqrt(mass) * max(overall_length(link) for link in links)

    def forces(self, u: Flat) -> tuple[Flat, Flat, Frames]:
        """Internal ones, all on bodies, and their mean frames."""
        now = self.now
        f, R = self.bodies.static.forces(now.motion.R[0], u, now.amounts)
        return f, now.F - f + self.more(u, f) - self.inertia.inertia(u) - now.stress(u), R

    def at(self, u: Flat) -> Point:
        """All forces at a deflection."""
        now, of = self.now, self.now.of
        f, r, R = self.forces(u)
        z = now.interface(u)
        C, e = now.measured(z, self.z1)
        laws = now.forces(e)
        moved = np.zeros_like(u)
        for k, open_ in enumerate(gaps(now, u, z)):
            moved[own(of, k)] = self.right[k] @ open_
        frames = self.bodies.static.frames()
        return Point(u, f, r, R, z, C, e[0], laws[:, 0], laws[:, 1], now.hard(C), moved, frames)

    def asked(self, at: Point, m: Flat) -> ConstraintTerms:
        """What constraints and laws ask of a change, with forces m of constraints in it."""
        soft = at.slopes > 0.0
        every = at.hard | soft
        compliance = np.where(soft, 1 / np.where(soft, at.slopes, 1.0), 0.0)
        target = np.where(at.hard, -at.e, 0.0)
        return ConstraintTerms(at.C[every], target[every], compliance[every], at.C.T @ self.exerted(at, m))

    def exerted(self, at: Point, m: Flat) -> Flat:
        """Forces along all coordinates."""
        return np.asarray(np.where(at.hard, m, at.laws))

    def change(self, at: Point, m: Flat, balance: LinearEquations, direct: Flat, A: Tangents | None) -> Flat:
        """The change that brings all forces into balance, to first order.

        Parameters
        ----------
        A : tangents of bodies, if the balance has these
        """
        push, whole = self.exerted(at, m), A is not None

        def applied(x: Flat) -> Flat:
            long = float(np.linalg.norm(x))
            if long == 0.0:
                return x
            part = (CENTRAL if whole else 1.0) * self.size / long
            r, C = at.r, at.C
            if whole:
                _, r, _ = self.forces(at.u - part * x)
                C = self.now.gradients(self.now.interface(at.u - part * x))
            apart = 2 * part if whole else part
            _, ahead, _ = self.forces(at.u + part * x)
            turned = self.now.gradients(self.now.interface(at.u + part * x)).T @ push - C.T @ push
            left = (r - ahead) / apart - self.stiff(at, x, A)
            return np.asarray(x + balance.solved(left, more=-turned / apart, alone=True).x)

        operator = LinearOperator((len(direct),) * 2, applied, dtype=float)
        return np.asarray(gmres(operator, direct, rtol=NONE if whole else LEFT, restart=KRYLOV, maxiter=1)[0])

    def stiff(self, at: Point, x: Flat, A: Tangents | None = None) -> Flat:
        """A x of all bodies."""
        out, of, always = np.zeros_like(x), self.now.of, self.now.always
        links = of.system.model.links
        for k in range(len(links)):
            here = own(of, k)
            d = int(of.bodies.components[k])
            R = at.R[k][:d, :d]
            local = (R.T @ x[here].reshape(d, -1)).ravel()
            mass = momentum(links[k], local) if self.bodies.sparse[k] else local
            f = A[k] @ local if A is not None and len(A[k]) else always.static.times(k, local) + always.least(k) * mass
            out[here] = (R @ f.reshape(d, -1)).ravel()
        return out

    def left(self, at: Point, m: Flat, balance: LinearEquations) -> Flat:
        """The change that a balance of another deflection asks for here."""
        asked = self.asked(at, m)
        if len(asked.target) != len(balance.asked.target):
            return np.full_like(at.u, np.inf)
        other = copy(balance)
        other.asked = replace(balance.asked, target=asked.target, known=asked.known)
        return other.solved(at.r, at.moved).x

    def reactions(self, at: Point, m: Flat, more: Flat) -> Flat:
        """Forces of constraints with what a solution adds to them."""
        added = np.zeros(len(m))
        added[at.hard | (at.slopes > 0.0)] = more
        return np.asarray(np.where(at.hard, m + added, 0.0))

    def stepped(
        self, at: Point, m: Flat, balance: LinearEquations, change: Flat, before: float, tiny: bool
    ) -> tuple[Point, float]:
        """All forces after a step along a change, and the part of it that is taken.

        Parameters
        ----------
        before : what is left at the point, seen through the balance there
        tiny : whether the change is taken as it is
        """
        part = 1.0
        while True:
            self.bodies.static.seek_from(at.frames)
            new = self.at(self.taken(at, part * change))
            left = float(np.linalg.norm(self.left(new, m, balance)))
            if left <= (1 - FALLS * part) * before or tiny or part <= SHORTEST:
                return new, part
            part /= 2

    def moves(self, at: Point, new: Point, change: Flat) -> str:
        """What moves most along a change, and whose force changes most between two points."""
        of = self.now.of
        most = of.system.model.links[int(np.argmax(moved(of, change)))].name
        words = f"link '{most}' moves most from iteration to iteration"
        forces = np.abs(new.laws - at.laws)
        if forces.any():
            words += f", and the force of {of.system.constraints[int(np.argmax(forces))].name} changes most"
        return words

    def taken(self, at: Point, change: Flat) -> Flat:
        """The deflection after a change, rigid bodies rotated by whole rotations."""
        of, u = self.now.of, at.u + change
        for k, link in enumerate(of.system.model.links):
            if not link.rigid or of.bodies.frame[k] != COROTATIONAL:
                continue
            here, d = own(of, k), link.d
            R0, R = self.now.R[k][:d, :d], at.R[k][:d, :d]
            base = drawn(link) @ R0.T
            before, after = base + rows(of, k, at.u[here]), base + rows(of, k, u[here])
            turned = mean_orientation(link, rows(of, k, u[here]), R0)
            share = link.m1[:, 0] / (link.one @ link.m1[:, 0])
            B = self.now.always.static.rigid[k]
            strain = (R.T @ change[here].reshape(d, -1)).ravel()
            strain = strain - B @ (B.T @ strain)
            strain = rows(of, k, strain)
            shape = (before - np.outer(link.one, share @ before)) @ R + strain - np.outer(link.one, share @ strain)
            middle = share @ after
            if link.kind == "beam":  # ψ turns as the frame does: the linear change has the tangent of that angle
                Q = R.T @ turned
                middle[2] = share @ before[:, 2] + np.arctan2(Q[1, 0], Q[0, 0]) + share @ strain[:, 2]
            placed = np.outer(link.one, middle) + shape @ turned.T
            u[here] += coordinates(link, of.parts[k], placed - after).ravel()
        return np.asarray(u)


def solution(problem: Equilibrium, u: Flat) -> tuple[Flat, str]:
    """The deflection at which all forces balance, from a guess; what changed most where none is found, in words."""
    frames = problem.bodies.static.frames()
    found, moves = _searched(problem, u, whole=False)
    if not moves:
        return found, ""
    problem.bodies.static.seek_from(frames)
    again, still = _searched(problem, u, whole=True)
    return (found, moves) if still else (again, "")


def _searched(problem: Equilibrium, u: Flat, whole: bool) -> tuple[Flat, str]:
    """The same by shortened steps, or by whole ones."""
    now, bodies, last, settled, short = problem.now, problem.bodies, np.inf, False, 0
    at = problem.at(u)
    m, change, new = np.zeros(len(at.e)), np.zeros_like(u), at
    for _ in range(WHOLE if whole else ITERATIONS):
        try:
            A = tangents(now, at.u, at.R, CENTRAL * problem.size) if whole else None
            held = bodies.held(at.R) if A is None else held_by_tangents(now, A, bodies.held(at.R))
            balance = LinearEquations(now.of, held, at.R, problem.asked(at, m))
            first = balance.solved(at.r, at.moved)
            m = problem.reactions(at, m, first.m)
            change = problem.change(at, m, balance, first.x, A)
        except (SolveError, np.linalg.LinAlgError):
            break
        if not np.isfinite(change).all():
            break
        size, reached = float(np.linalg.norm(change)), float(np.linalg.norm(at.u))
        left, tiny = float(np.linalg.norm(first.x)), size <= ROUNDING * reached
        new, part = problem.stepped(at, m, balance, change, left, tiny or whole)
        if settled:
            return new.u, ""
        stalls = size > last / 2 and tiny
        settled = stalls or (part == 1.0 and size <= CONVERGED * reached + now.of.c.floor)
        short = short + 1 if part <= SHORTEST else 0
        if short == IN_A_ROW:
            if size <= LEAST * reached and left <= CONVERGED * reached:
                return at.u, ""
            break
        at, last = new, size
    return at.u, problem.moves(at, new, change)
