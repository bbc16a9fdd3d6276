"""A system at one time of its nominal motion: all that starts ask of bodies, coordinates and laws there."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from kedfem.dynamics.system.internal import Inside, inside, own
from kedfem.dynamics.system.march import Ready, driving
from kedfem.dynamics.system.rates import coordinates, gradients, places, term_values, travels
from kedfem.dynamics.system.record import ANGLE, Driven, Held
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion

TURN = 2 * np.pi
NOTHING = 1e-10  # gradient of a constraint that the interface satisfies by itself

Motion = Callable[[Float[np.ndarray, " T"]], RigidMotion]
Flat = Float[np.ndarray, " _"]


class Instant:
    """A system at one time of its nominal motion."""

    def __init__(self, of: Ready, motion_at: Motion, time: float) -> None:
        motion = motion_at(np.array([time]))
        self.of, self.time, self.motion = of, time, motion
        self.F, self.at = driving(of, motion).F[0], places(motion)
        self.R, self.omega = motion.R[0][of.bodies.motion], motion.omega[0][of.bodies.motion]
        self.travels = travels(of.system, self.at)
        self.number = renumbered(of)
        self.B = np.concatenate([joint.B for joint in of.system.model.joints])

    def inside(self, u: Flat, v: Flat) -> list[Inside]:
        """All bodies at a displacement and rate."""
        spins = cross_matrix(self.omega)
        return [inside(self.of, k, self.R[k], spins[k], u[own(self.of, k)], v[own(self.of, k)])
                for k in range(len(self.R))]  # fmt: skip

    def interface(self, x: Flat) -> Flat:
        """Interface unknowns from coordinates whose joints are closed: B z = W x."""
        w = [part.W @ x[own(self.of, k)] for k, part in enumerate(self.of.parts)]
        if not self.B.shape[1]:
            return np.zeros(0)
        return np.asarray(np.linalg.lstsq(self.B, np.concatenate(w), rcond=None)[0])

    def coordinates(self, z: Float[np.ndarray, "3 k"]) -> Float[np.ndarray, "3 r"]:
        """Coordinates of all constraints less what drives ask, with their rates."""
        e = coordinates(self.of.system, self.at, z)
        for n, each in enumerate(self.of.system.constraints):
            drive = getattr(each.law, "drive", -1)
            if drive >= 0 and not each.linear:
                e[:, n] -= [self.motion.drives[0, drive], *self.travels[1:, n]]
                if each.terms[0].kind == ANGLE:
                    e[0, n] -= TURN * np.round(e[0, n] / TURN)
        return e

    def gradients(self, z: Flat) -> Float[np.ndarray, "r k"]:
        """Of all coordinates by z."""
        return gradients(self.of.system, self.at, z)

    def forces(self, e: Float[np.ndarray, "3 r"]) -> Float[np.ndarray, "r 3"]:
        """Of all laws: force along the coordinate, and how it falls with it and its rate; zero of constraints."""
        from kedfem.dynamics.system.constraints_kernel import law

        out = np.zeros((e.shape[1], 3))
        for n, each in enumerate(self.of.system.constraints):
            if not isinstance(each.law, Held | Driven):
                law(self.of.constraints, n, self.time, e[0, n], e[1, n], out[n])
        out[:, 0] *= -1
        return out

    def hard(self, C: Float[np.ndarray, "r k"]) -> Bool[np.ndarray, " r"]:
        """Which are constraints that say something of z."""
        fixed = [isinstance(each.law, Held | Driven) for each in self.of.system.constraints]
        return np.array(fixed, bool) & (np.abs(C).max(axis=1, initial=0.0) > NOTHING)


def renumbered(of: Ready) -> np.ndarray:
    """Where each interface unknown of the system stands in a state."""
    number, bodies = np.zeros(of.system.unknowns, int), of.bodies
    for k, joint in enumerate(of.system.model.joints):
        number[np.flatnonzero(joint.B.any(axis=0))] = bodies.columns[
            bodies.column_at[k] : bodies.column_at[k + 1]
        ]
    return number


def turned(now: Instant, z: Flat) -> Flat:
    """Angles of all terms, within half a turn of zero; of drives of what these ask."""
    found = term_values(now.of.system, now.at, z)
    near, place = np.zeros(len(found)), 0
    for each in now.of.system.constraints:
        drive = getattr(each.law, "drive", -1)
        near[place] = now.motion.drives[0, drive] if drive >= 0 else 0.0
        place += len(each.terms)
    angles = np.array([x.kind == ANGLE for each in now.of.system.constraints for x in each.terms], bool)
    return np.asarray(np.where(angles, found + TURN * np.round((near - found) / TURN), 0.0))
