"""Internal state of a body at the start of a march: internal force, frames and damped quantities from u and u'."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.frames import Deformed, frame_force, frames_of, mean_orientation, position, seen_from
from kedfem.dynamics.matrices.dense import component_first, coordinates, rows_of, work_on
from kedfem.dynamics.stepping.state import Nodal
from kedfem.dynamics.system.layout import points_of
from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.record import RIGID_BODY
from kedfem.dynamics.system.sparse import SparsePart, momentum
from kedfem.dynamics.system.state import State, empty_state, empty_trial, room
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import rigid_modes
from kedfem.motion.rigid import RigidMotion

Flat = Float[np.ndarray, " N"]
Frames = tuple[Float[np.ndarray, "L 3 3"], Float[np.ndarray, " L"]]
"""Rotations of bodies' frames against the rigid-body motion; of planar ones angles, counted beyond a revolution."""


class StaticForces:
    """Internal forces of all bodies where they do not move in their frames: what balances of deflections ask for.

    K : per body its stiffness on coordinates, in its frame; of sparse ones K0, on nodal rows
    rigid : per body its rigid motions on coordinates, orthonormal
    """

    def __init__(self, of: Ready) -> None:
        self.of = of
        self.K: list[Any] = [
            link.K0 if isinstance(part, SparsePart) else component_first(part.T, link.K0)
            for part, link in zip(of.parts, of.system.model.links, strict=True)
        ]
        self.rigid = [_rigid(link, part) for link, part in zip(of.system.model.links, of.parts, strict=True)]
        none = np.zeros_like(of.c.acceleration) if isinstance(of.c.acceleration, np.ndarray) else (0.0, 0.0, 0.0)
        self._c = of.c._replace(acceleration=none, rate=none, late=0.0, early=0.0, alpha=0.0, beta=0.0)
        self._state, self._work = empty_state(of.bodies, of.constraints), room(of.bodies)
        self._trial = empty_trial(of.bodies, of.ends, of.constraints, self._state)

    def forces(
        self, R: Float[np.ndarray, "M 3 3"], u: Flat, amounts: Float[np.ndarray, " w"]
    ) -> tuple[Flat, Float[np.ndarray, "L 3 3"]]:
        """f (N,), world components, and the bodies' orientations, at a displacement u.

        Parameters
        ----------
        R : of all bodies of the linkage in the rigid-body motion
        amounts : of follower loads
        """
        bodies, trial = self.of.bodies, self._trial
        trial.u[:] = u
        if (bodies.frame > RIGID_BODY).any():  # else nothing has to be compiled
            from kedfem.dynamics.system.starts.static_kernel import static_forces

            c, constant, state, end, work = self._of_forces
            static_forces(c, constant, R, amounts, state, end, work)
        f, mean = trial.f.copy(), R[bodies.motion].copy()
        for k, frame in enumerate(bodies.frame):
            if frame > RIGID_BODY:
                mean[k] = trial.Rp[k]
            else:
                here = own(self.of, k)
                f[here] = self.sprung(k, mean[k], u[here])
        return f, mean

    @cached_property
    def _of_forces(self) -> list[Any]:
        """Records as compiled code is handed them, once: their arrays stay where they are."""
        from kedfem.dynamics.system.reference import by_address

        return [by_address(x) for x in (self._c, self.of.bodies, self._state, self._trial, self._work)]

    @cached_property
    def _of_gradients(self) -> list[Any]:
        """The same for gradients."""
        from kedfem.dynamics.system.reference import by_address

        return [by_address(x) for x in (self.of.ends, self.of.constraints, self._trial, self._work)]

    def frames(self) -> Frames:
        """The bodies' frames as they were last found, from which they are sought again."""
        return self._trial.Q.copy(), self._trial.angle.copy()

    def seek_from(self, frames: Frames) -> None:
        """Have frames sought from these; from far off a rotation that is none of the bodies' may be found."""
        self._trial.Q[:], self._trial.angle[:] = frames

    def measured(
        self, motion: RigidMotion, stations: Float[np.ndarray, " w"], near: Float[np.ndarray, " t"],
        z: Float[np.ndarray, " k"],
    ) -> tuple[Float[np.ndarray, " e"], Float[np.ndarray, " r"], Float[np.ndarray, " r"]]:  # fmt: skip
        """Of all coordinates gradients on the columns of each, values, and rates in the rigid-body motion.

        Of those that are linear in the interface unknowns z they are at z = 0.

        Parameters
        ----------
        motion : rigid-body motion at one time; stations : weights of ends on lines there
        near : angles of all terms to within half a revolution
        z : in the order of a state
        """
        trial = self._trial
        if len(trial.e):
            from kedfem.dynamics.system.starts.static_kernel import static_gradients

            omega = np.ascontiguousarray(motion.omega[0])  # laid out as in steps: compiled once for both
            turning = motion.R[0], motion.v[0], omega
            ends, constraints, handed_trial, work = self._of_gradients
            trial.term_angles[:] = near
            static_gradients(ends, constraints, turning, motion.p[0], stations, z, handed_trial, work)
        return trial.C.copy(), trial.e.copy(), trial.m.copy()

    def sprung(self, k: int, R: Float[np.ndarray, "3 3"], u: Flat) -> Flat:
        """R K0 Rᵀ u of the displacement u (N,) of body k, world components.

        It does no work on rigid motions. Rounding would: of a stiff body on soft mounts by more than others' forces.
        """
        d, B = int(self.of.bodies.components[k]), self.rigid[k]
        turn = R[:d, :d]
        f = self.times(k, (turn.T @ u.reshape(d, -1)).ravel())
        f -= B @ (B.T @ f)
        return np.asarray(turn @ f.reshape(d, -1)).ravel()

    def times(self, k: int, x: Flat) -> Flat:
        """K0 x of coordinates of body k, in its frame."""
        if not isinstance(self.of.parts[k], SparsePart):
            return np.asarray(self.K[k] @ x)
        d = int(self.of.bodies.components[k])
        return np.asarray((self.K[k] @ x.reshape(d, -1).T.ravel()).reshape(-1, d).T.ravel())


def _rigid(link: Link, part: Any) -> Float[np.ndarray, "N m"]:
    """Rigid motions of a body from its reference position, in its coordinates, orthonormal."""
    moved = rigid_modes(link).T.reshape(-1, link.n, link.d)
    return np.asarray(np.linalg.qr(np.array([coordinates(link, part, x).ravel() for x in moved]).T)[0])


@dataclass(frozen=True, slots=True)
class InternalState:
    """A body at one time: internal force f (N,) on its coordinates, world components; R (3, 3) its mean orientation.

    g : (n, d) its displacement in the rigid-body frame [m]; energy : ½ gᵀ K0 g, as its frames see it [J]
    frames : what its frames see; damped : (3, n, d) damping force without its rate, and its rates, rigid-body frame
    """

    f: Flat
    R: Float[np.ndarray, "3 3"]
    frames: list[Deformed]
    damped: Float[np.ndarray, "3 n d"]
    g: Nodal
    energy: float


def rows(of: Ready, k: int, x: Flat) -> Nodal:
    """Nodal rows (n, d) of body k from its coordinates."""
    link = of.system.model.links[k]
    return np.asarray(rows_of(link, of.parts[k], x.reshape(1, link.d, link.n))[0])


def moved(of: Ready, x: Float[np.ndarray, " _"]) -> list[float]:
    """How far each body moves by coordinates, at the most of one component [m]."""
    return [float(np.abs(rows(of, k, x[own(of, k)])).max(initial=0.0)) for k in range(len(of.parts))]


def own(of: Ready, k: int) -> slice:
    """Where the coordinates of body k stand."""
    return slice(int(of.bodies.at[k]), int(of.bodies.at[k + 1]))


def drawn(link: Link) -> Nodal:
    """Position of a body in the reference position; ψ of a planar beam has none."""
    return position(link, np.zeros((link.n, link.d)))


def rotated_rate(spin: Float[np.ndarray, "3 3"], x: Nodal) -> Nodal:
    """[ω]× x of rows; of a planar beam ψ stays out of it."""
    d = x.shape[1]
    return np.asarray(x @ spin[:d, :d].T)


def internal_state(
    static: StaticForces, k: int, R: Float[np.ndarray, "3 3"], spin: Float[np.ndarray, "3 3"], u: Flat, v: Flat
) -> InternalState:
    """Body k at the displacement u with the rate v.

    Parameters
    ----------
    R, spin : of the rigid-body motion, and its [ω]×
    """
    of = static.of
    link, damping = of.system.model.links[k], of.system.model.damping
    d = link.d
    x, x1 = rows(of, k, u), rows(of, k, v)
    g, g1 = x @ R[:d, :d], (x1 - rotated_rate(spin, x)) @ R[:d, :d]
    y = position(link, g)
    damped = np.zeros((3, *g.shape))
    for m, each in enumerate((g, g1)):
        damped[m] = damping.alpha * mass_times(link.mass, each)
        if link.fit is None and damping.beta:
            damped[m] += damping.beta * (link.K0 @ each.ravel()).reshape(each.shape)
    frames = [seen_from(link, frame, y, g1) for frame in frames_of(link)]
    mean = R.copy()
    mean[:d, :d] = mean_orientation(link, x, R[:d, :d])
    if link.fit is None:
        elastic = static.sprung(k, R, u)
        f = elastic + work_on(of.parts[k], damped[1] @ R[:d, :d].T).ravel()
        return InternalState(f, mean, frames, damped, g, 0.5 * float(elastic @ u))
    force, energy = damped[1], 0.0
    for frame, now in zip(frames_of(link), frames, strict=True):
        own_force, own_energy = frame_force(link, frame, now, y, damping.beta)
        force, energy = force + own_force, energy + own_energy
    return InternalState(work_on(of.parts[k], force @ R[:d, :d].T).ravel(), mean, frames, damped, g, energy)


def store_internal_state(of: Ready, k: int, found: InternalState, state: State) -> None:
    """What a step remembers of body k, put into the state."""
    link, part, here = of.system.model.links[k], of.parts[k], own(of, k)
    state.f[here] = found.f
    for m in range(3):
        state.damped[m, here] = work_on(part, found.damped[m]).ravel()
    points, b = points_of(link), np.searchsorted(of.bodies.beams.segment, k)
    for e, (point, seen) in enumerate(zip(points, found.frames, strict=False)):
        state.strain[0, b, :, e] = point.strains @ seen.g.ravel()
        state.strain[1, b, :, e] = point.strains @ seen.g1.ravel()
        state.direction[b, :, e], state.turn[b, e] = seen.Q[:2, :2] @ point.tangent, seen.angle
    for seen in found.frames if not points else ():
        state.Q[k, : link.d, : link.d], state.angle[k] = seen.Q, seen.angle
        for m, x in enumerate((seen.g, seen.g1)):
            state.seen[m, here] = coordinates(link, part, x).ravel()


def put_momenta(of: Ready, state: State) -> None:
    """M δ, M δ', M δ'' of sparse bodies, put into the state beside δ, δ' and δ''."""
    for k, part in enumerate(of.parts):
        if isinstance(part, SparsePart):
            here, link = own(of, k), of.system.model.links[k]
            state.momentum[:, here] = [momentum(link, x[here]) for x in (state.u, state.v, state.a)]
