"""Newton–Krylov method for a deflection in static balance, for displacements of any size.

With A the stiffness of bodies in their mean frames, and all forces on bodies and interface at u as right-hand sides,

    A Δ = r − (J − A) Δ + Wᵀ λ,   C Δz + Δm / κ = target,   Σ Bᵀ R λ = Cᵀ (m + Δm) + (∂C/∂z Δz)ᵀ m

J Δ is a difference of forces along Δ, ∂C/∂z Δz one of gradients, so that both include forces that rotate with bodies:
those of springs and joints, axial forces of beams, preloads. GMRES solves for Δ, preconditioned by A. Rigid bodies then
take a finite rotation, as its linear part would strain them; the next Δ closes the joints that this opens. The step is
shortened until the residual, preconditioned by the same factor, decreases (Deuflhard's monotonicity test).
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
from kedfem.dynamics.system.starts.rotating_bodies import CONVERGED, RotatingBodies, Spins
from kedfem.errors import SolveError
from kedfem.links.reduced import reach

ITERATIONS = 120
SHORTEST, IN_A_ROW = 1 / 64, 4  # of a step; so many of them end a search
FALLS = 0.25  # of a step's length: share by which what is left has to fall
KRYLOV = 40
OPEN = 1e-4  # of the largest link: what joints may be open in a balance; found ones are at 1e-9
CLOSED = 1e-9  # of displacements at interface points: open by less is closed but for rounding
FAR = 1e4  # of the largest link: displacements of unconstrained links
LEFT = 1e-3  # of a residual by GMRES: an iteration leaves about as much of the error
ROUNDING = 1e-8  # of the deflection: changes below it that do not fall
LEAST = 1e-6  # the same of soft directions, where nothing is left to rounding and no step lessens it
DIFFERENCE = 1e-9  # of the size of bodies: displacements along which forces are differenced

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
        self.size = DIFFERENCE * np.sqrt(mass) * max(reach(link) for link in links)

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

    def change(self, at: Point, m: Flat, balance: LinearEquations, direct: Flat) -> Flat:
        """The change that brings all forces into balance, to first order."""
        push = self.exerted(at, m)

        def applied(x: Flat) -> Flat:
            long = float(np.linalg.norm(x))
            if long == 0.0:
                return x
            part = self.size / long
            _, r, _ = self.forces(at.u + part * x)
            turned = self.now.gradients(self.now.interface(at.u + part * x)).T @ push - at.C.T @ push
            left = (at.r - r) / part - self.stiff(at, x)
            return np.asarray(x + balance.solved(left, more=-turned / part, alone=True).x)

        whole = LinearOperator((len(direct),) * 2, applied, dtype=float)
        return np.asarray(gmres(whole, direct, rtol=LEFT, restart=KRYLOV, maxiter=1)[0])

    def stiff(self, at: Point, x: Flat) -> Flat:
        """A x of all bodies."""
        out, of, always = np.zeros_like(x), self.now.of, self.now.always
        links = of.system.model.links
        for k in range(len(links)):
            here = own(of, k)
            d = int(of.bodies.components[k])
            R = at.R[k][:d, :d]
            local = (R.T @ x[here].reshape(d, -1)).ravel()
            mass = momentum(links[k], local) if self.bodies.sparse[k] else local
            f = always.static.times(k, local) + always.least(k) * mass
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
        tiny : whether the change is rounding, and is taken as it is
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


def gaps(now: Instant, u: Flat, z: Flat) -> list[Flat]:
    """How far the interface points of each body are from where the interface unknowns have them."""
    every = zip(now.of.parts, now.of.system.model.joints, strict=True)
    return [part.W @ u[own(now.of, k)] - joint.B @ z[joint.columns] for k, (part, joint) in enumerate(every)]


def closed(now: Instant, u: Flat) -> Flat:
    """The deflection with closed joints that is nearest to another."""
    out = u.copy()
    for k, open_ in enumerate(gaps(now, u, now.interface(u)) if u.any() else ()):
        W, here = now.of.parts[k].W, own(now.of, k)
        if np.abs(open_).max(initial=0.0) > CLOSED * np.abs(W @ u[here]).max(initial=0.0):
            out[here] -= np.linalg.lstsq(W, open_)[0]
    return out


def stands_off(now: Instant, u: Flat, z1: Flat | None) -> str:
    """Which link a deflection leaves off its joints, or farther off than anything holds it; nothing if it does neither.

    Forces of open joints balance nothing: iterations of large motions may settle there. So may they where what nothing
    holds has gone so far that changes are small beside it.
    """
    system, z = now.of.system, now.interface(u)
    links = system.model.links
    off = [np.abs(x).max(initial=0.0) for x in gaps(now, u, z)]
    largest, far = max(map(reach, links)), moved(now.of, u)
    if max(far) > FAR * largest and max(off) <= OPEN * max(far):
        return f"link '{links[int(np.argmax(far))].name}' would move by {max(far):.3g} m"
    size = OPEN * largest
    if max(off) > size:
        return f"link '{links[int(np.argmax(off))].name}' would be {max(off):.3g} m off its joints"
    C, e = now.measured(z, z1)
    open_ = np.abs(e[0]) * now.hard(C)
    if open_.max(initial=0.0) > size:
        return f"{system.constraints[int(open_.argmax())].name} would be open by {open_.max():.3g} (m or rad)"
    return ""


def solution(problem: Equilibrium, u: Flat) -> tuple[Flat, str]:
    """The deflection at which all forces balance, from a guess; what changed most where none is found, in words."""
    now, bodies, last, settled, short = problem.now, problem.bodies, np.inf, False, 0
    at = problem.at(u)
    m, change, new = np.zeros(len(at.e)), np.zeros_like(u), at
    for _ in range(ITERATIONS):
        try:
            balance = LinearEquations(now.of, bodies.held(at.R), at.R, problem.asked(at, m))
            first = balance.solved(at.r, at.moved)
            m = problem.reactions(at, m, first.m)
            change = problem.change(at, m, balance, first.x)
        except (SolveError, np.linalg.LinAlgError):
            break
        if not np.isfinite(change).all():
            break
        size, reached = float(np.linalg.norm(change)), float(np.linalg.norm(at.u))
        left, tiny = float(np.linalg.norm(first.x)), size <= ROUNDING * reached
        new, part = problem.stepped(at, m, balance, change, left, tiny)
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
