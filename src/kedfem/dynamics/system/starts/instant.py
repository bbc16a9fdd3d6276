"""A system at one instant of its rigid-body motion: bodies, coordinates and laws for the computation of starts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from kedfem.arrays import Bool, Float, Int
from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.matrices.bordered import row_of
from kedfem.dynamics.matrices.dense import work_on
from kedfem.dynamics.matrices.substructure import factored
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.system.ends import left_line, line_of
from kedfem.dynamics.system.forces.follower_loads import own_patterns, rotated_forces
from kedfem.dynamics.system.ready import Ready, driving
from kedfem.dynamics.system.record import ANGLE, Driven, Held, law_at
from kedfem.dynamics.system.sparse import SparsePart, softening
from kedfem.dynamics.system.starts.coordinate_rates import angles, coordinates, pins, places, travels
from kedfem.dynamics.system.starts.internal_forces import InternalState, StaticForces, internal_state, own, rows
from kedfem.dynamics.system.starts.laws import TemporarySprings, exerted, feels_rates
from kedfem.dynamics.system.starts.linear_equations import HeldBody, held_body, mass_body, sparse_body
from kedfem.dynamics.system.state import State
from kedfem.errors import SolveError
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion

TURN = 2 * np.pi
SOFTER = 1e-6  # of the lowest elastic eigenvalue: what holds a dense body that nothing else holds
NOTHING = 1e-10  # gradient of a constraint that the interface satisfies by itself

Motion = Callable[[Float[np.ndarray, " T"]], RigidMotion]
Flat = Float[np.ndarray, " _"]


@dataclass(frozen=True, slots=True)
class Always:
    """What does not depend on time.

    number : (k,) where each interface unknown of the system stands in a state
    columns : (e,) interface unknowns that coordinates have entries of their gradients on
    rated : which coordinates are linear in these, with a force that depends on their rate
    closed : z from displacements at all interface points, w = B z as nearly as can be
    static : internal forces of bodies
    least : what the stiffness of body k gets of its mass, so that it is definite where nothing constrains it [1/s²]
    held, mass : a body with that stiffness, and with its mass, for a matrix, factored once
    """

    number: Int[np.ndarray, " k"]
    columns: Int[np.ndarray, " e"]
    rated: Bool[np.ndarray, " r"]
    closed: Callable[[Flat], Flat]
    static: StaticForces
    least: Callable[[int], float]
    held: Callable[[int], HeldBody]
    mass: Callable[[int], HeldBody]


class Instant:
    """A system at one time of its rigid-body motion.

    Parameters
    ----------
    like : another of the same system: what does not depend on time is taken from there
    near : (terms,) angles of all terms to within half a revolution, as of a state shortly before; none: near zero

    `relief`, (r,) or nothing, is taken from the forces along all coordinates.
    """

    def __init__(
        self, of: Ready, motion_at: Motion, time: float, like: "Instant | None" = None, near: Flat | None = None
    ) -> None:
        motion = motion_at(np.array([time]))
        self.near, self.relief = near, np.zeros(())
        self.of, self.time, self.motion = of, time, motion
        along = driving(replace(of, stressed=None), motion)  # `stress` has these as forces
        self.F, self.amounts, self.at = along.F[0], along.amounts[0], places(motion)
        self._stations = along.stations[0]
        self.slow = False  # whether the mass that makes matrices of bodies definite slows iterations
        self.temporary_springs: TemporarySprings | None = None
        self.R, self.omega = motion.R[0][of.bodies.motion], motion.omega[0][of.bodies.motion]
        self.travels = travels(of.system, self.at)
        self.always: Always = always(of) if like is None else like.always
        self._stress = of.stressed and of.stressed.stiffening.stress_forces(forcings(of.system.model, motion), motion)

    def stress(self, u: Flat) -> Flat:
        """Forces by the stresses of the rigid-body motion, R (k g P), at a displacement; none without stiffening."""
        out = np.zeros_like(u)
        for k, stressed in enumerate(self._stress or ()):
            R = self.R[k][: (d := self.of.system.model.links[k].d), :d]
            force = stressed(rows(self.of, k, u[own(self.of, k)]) @ R) @ R.T
            out[own(self.of, k)] = work_on(self.of.parts[k], force).ravel()
        return out

    def internal_states(self, u: Flat, v: Flat) -> list[InternalState]:
        """All bodies at a displacement and rate; follower loads are subtracted from their internal forces."""
        of, spins = self.of, cross_matrix(self.omega)
        static = self.always.static
        out = [internal_state(static, k, self.R[k], spins[k], u[own(of, k)], v[own(of, k)]) for k in range(len(self.R))]
        pushed = self.pushed(u) - self.stress(u)
        return [replace(each, f=each.f - pushed[own(of, k)]) for k, each in enumerate(out)]

    def pushed(self, u: Flat) -> Flat:
        """Loads that turn with bodies (N,) on the coordinates at a displacement, world components."""
        of, out = self.of, np.zeros_like(u)
        for (k, load), amount in zip(own_patterns(of.system.model.loads), self.amounts, strict=True):
            link, here = of.system.model.links[k], own(of, k)
            force = rotated_forces(link, load, self.R[k][None], rows(of, k, u[here])[None], amount[None])[0]
            out[here] += work_on(of.parts[k], force).ravel()
        return out

    def interface(self, x: Flat) -> Flat:
        """Interface unknowns from coordinates whose joints are closed: B z = W x."""
        w = [part.W @ x[own(self.of, k)] for k, part in enumerate(self.of.parts)]
        return self.always.closed(np.concatenate(w))

    def coordinates(self, z: Float[np.ndarray, "3 k"]) -> Float[np.ndarray, "3 r"]:
        """Coordinates of all constraints less what drives ask, with their rates."""
        e = coordinates(self.of.system, self.at, z)
        if self.near is not None:
            e[0] += self._whole_revolutions(z[0])
        return self._less_drives(e)

    def _less_drives(self, e: Float[np.ndarray, "n r"]) -> Float[np.ndarray, "n r"]:
        """Coordinates, with rates of theirs, less what drives ask."""
        for n, each in enumerate(self.of.system.constraints):
            drive = getattr(each.law, "drive", -1)
            if drive >= 0 and not each.linear:
                e[:, n] -= [self.motion.drives[0, drive], *self.travels[1 : len(e), n]]
                if each.terms[0].kind == ANGLE:
                    e[0, n] -= TURN * np.round(e[0, n] / TURN)
        return e

    def _whole_revolutions(self, z: Flat) -> Float[np.ndarray, " r"]:
        """What coordinates gain by the whole revolutions that their terms have made; none where they are linear in z."""
        system, out, place = self.of.system, np.zeros(len(self.of.system.constraints)), 0
        found = angles(system, self.at, z)
        more = _counted(self, found) - found
        for n, each in enumerate(system.constraints):
            for term in each.terms:
                out[n] += 0.0 if each.linear or term.kind != ANGLE else term.factor * more[place]
                place += 1
        return out

    def check_lines(self, z: Flat) -> None:
        """Whether all pins are on their lines.

        Raises
        ------
        SolveError
            If one has slid off.
        """
        system = self.of.system
        for end, s in pins(system, self.at, z).items():
            if not line_of(system.ends[end]).stations.covers(s):
                raise SolveError(left_line(system, end, self.time))

    def measured(self, z: Flat, z1: Flat | None = None) -> tuple[sp.csr_array, Float[np.ndarray, "2 r"]]:
        """Gradients of all coordinates by z, and these with their rates as in `coordinates`, as steps have them."""
        always, (C, e, rate) = self.always, self._as_in_steps(z)
        e = np.where(self.of.constraints.linear, C @ z, e)
        out = self._less_drives(np.stack([e, rate if z1 is None else rate + C @ z1]))
        if always.rated.any():
            full = self.coordinates(np.stack([z, 0 * z if z1 is None else z1, 0 * z]))
            out[1, always.rated] = full[1, always.rated]
        return C, out

    def gradients(self, z: Flat) -> sp.csr_array:
        """Of all coordinates by z."""
        return self._as_in_steps(z)[0]

    def _as_in_steps(self, z: Flat) -> tuple[sp.csr_array, Float[np.ndarray, " r"], Float[np.ndarray, " r"]]:
        """The same with values and rates as in `StaticForces.measured`."""
        of, always, known = self.of, self.always, np.zeros(self.of.system.unknowns)
        known[always.number] = z
        near = np.zeros(len(of.constraints.kind)) if self.near is None else _nearby(self)
        data, e, rate = always.static.measured(self.motion, self._stations, near, known)
        return sp.csr_array((data, always.columns, of.constraints.column_at), (len(e), len(z))), e, rate

    def forces(self, e: Float[np.ndarray, "_ r"]) -> Float[np.ndarray, "r 3"]:
        """Of all laws: force along the coordinate, and how it falls with it and its rate; zero of constraints."""
        laws = [law_at(each.law, self.motion.t, self.motion.phi) for each in self.of.system.constraints]
        found = exerted(laws, self.time, e, self.temporary_springs)
        found[:, 0] -= self.relief
        return found

    def hard(self, C: sp.csr_array) -> Bool[np.ndarray, " r"]:
        """Which are constraints that say something of z."""
        fixed = [isinstance(each.law, Held | Driven) for each in self.of.system.constraints]
        return np.asarray(np.array(fixed, bool) & (sizes(C) > NOTHING))


def instant_near(of: Ready, motion_at: Motion, time: float, like: Instant | None, near: State | None) -> Instant:
    """An instant whose revolutions and frames are sought from those of a state, if given, whatever was sought last."""
    if near is None:
        return Instant(of, motion_at, time, like)
    now = Instant(of, motion_at, time, like, near.term_angles)
    now.always.static.seek_from((near.Q, near.angle))
    return now


def sizes(C: sp.csr_array) -> Float[np.ndarray, " r"]:
    """Largest entry of each row."""
    out = np.zeros(C.shape[0])
    np.maximum.at(out, row_of(C), np.abs(C.data))
    return out


def always(of: Ready) -> Always:
    """What starts of a system ask at every time."""
    static, links, joints = StaticForces(of), of.system.model.links, of.system.model.joints
    lowest = cache(lambda: SOFTER * _lowest(of, static))

    def least(k: int) -> float:
        return softening(links[k]) if isinstance(of.parts[k], SparsePart) else lowest()

    def held(k: int) -> HeldBody:
        if not isinstance(of.parts[k], SparsePart):
            return held_body(static.K[k] + least(k) * np.eye(len(static.K[k])), of.parts[k].W)
        return sparse_body(links[k], joints[k], factored(links[k], joints[k], least(k), 1.0))

    number = renumbered(of)
    rated = np.array([each.linear and feels_rates(each.law) for each in of.system.constraints], bool)
    columns, mass = np.argsort(number)[of.constraints.columns], partial(mass_body, of)
    return Always(number, columns, rated, closure(of), static, cache(least), cache(held), cache(mass))


def _lowest(of: Ready, static: StaticForces) -> float:
    """Least eigenvalue of free dense bodies that strain."""
    every = zip(static.K, of.system.model.links, of.parts, strict=True)
    dense = [(K, link) for K, link, part in every if not isinstance(part, SparsePart) and K.any()]
    return min((float(np.linalg.eigvalsh(K)[3 if link.planar else 6]) for K, link in dense), default=1.0)


def closure(of: Ready) -> Callable[[Flat], Flat]:
    """z from displacements at all interface points, w = B z as nearly as can be."""
    B = interface_matrix(of.system.model.joints)
    if not B.shape[1]:
        return lambda w: np.zeros(0)
    factor = splu(sp.csc_array(B.T @ B))
    return lambda w: np.asarray(factor.solve(B.T @ w))


def renumbered(of: Ready) -> Int[np.ndarray, " k"]:
    """Where each interface unknown of the system stands in a state."""
    number, bodies = np.zeros(of.system.unknowns, int), of.bodies
    for k, joint in enumerate(of.system.model.joints):
        number[joint.columns] = bodies.columns[bodies.column_at[k] : bodies.column_at[k + 1]]
    return number


def term_angles(now: Instant, z: Flat) -> Flat:
    """Angles of all terms, within half a revolution of what they are near; of drives of what these ask."""
    return _counted(now, angles(now.of.system, now.at, z))


def _counted(now: Instant, found: Flat) -> Flat:
    """The same of angles to within whole revolutions."""
    near = _nearby(now)
    of_angles = np.array([x.kind == ANGLE for each in now.of.system.constraints for x in each.terms], bool)
    return np.asarray(np.where(of_angles, found + TURN * np.round((near - found) / TURN), 0.0))


def _nearby(now: Instant) -> Flat:
    """Angles of all terms to within half a revolution."""
    near, place = np.zeros(len(now.of.constraints.kind)) if now.near is None else now.near.copy(), 0
    for each in now.of.system.constraints:
        drive = getattr(each.law, "drive", -1)
        near[place] = now.motion.drives[0, drive] if drive >= 0 else near[place]
        place += len(each.terms)
    return near
