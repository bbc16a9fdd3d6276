"""The monolithic solver: all unknowns of a system in one matrix, iterated to rounding, with newly assembled tangents.

The unknowns are the displacements u of all bodies (full rows, world components), the interface unknowns z, the forces λ
at interface points and the multipliers m of constraints:

    M [(1 − α_m) u1'' + α_m u0''] + (1 − α_f) (f1 − F1) + α_f (f0 − F0) = Wᵀ λ,   W u = B z,
    Bᵀ λ = Cᵀ m + α_f C₀ᵀ μ₀,   e(z) = 0 of constraints,   m = −(1 − α_f) φ(e, e') of force laws

It uses neither `step_kernel` nor the functions that this calls: internal forces are those of `dynamics.frames`,
coordinates those of `motion.values`.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Bool, Float
from kedfem.dynamics.frames import Deformed, deformation, frame_force, frames_of, rotation
from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.loads import applied
from kedfem.dynamics.matrices.substructure import mass_matrix
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.system.monolithic.monolithic_lines import measured
from kedfem.dynamics.system.monolithic.monolithic_places import force, rotated_load
from kedfem.dynamics.system.monolithic.monolithic_stops import HALVINGS, Motion, in_parts, sides
from kedfem.dynamics.system.monolithic.monolithic_tangent import Inverse, inverse, tangent
from kedfem.dynamics.system.record import Driven, Held, System
from kedfem.errors import SolveError
from kedfem.links.record import Matrix
from kedfem.motion.rigid import RigidMotion

ITERATIONS = 40
RATES = 0.01  # of a step, by which a mechanism moves on for the rates of its coordinates, of sixth order
SLOW = 0.1  # changes that do not fall faster have their tangents assembled anew
DIVERGED = 1e9  # m: a change with which iterations will not come back; forces of beams would soon overflow
STIFF = 0.01  # of the displacement: changes of linear steps below it are rounding, beside far stiffer links,
STALLED = 4  # where so many in a row have not halved
BALANCED = 1e-6  # of the largest force: what may be left of a body's balance where changes are rounding
ROUNDING = 1e-14  # of stiffness times size: what positions leave of forces
Column = Float[np.ndarray, " _"]
Seen = tuple[float, np.ndarray]
"""Angle of a frame, and g, g', g'' (3, n, d) seen from it."""


@dataclass(slots=True)
class Now:
    """One time: rows of all bodies flat, and what belongs to them; as `record.State`, but in nodal rows.

    met : stops whose push begins here, with the step after it
    """

    u: Column
    v: Column
    a: Column
    f: Column
    F: Column
    g: list[list[Seen]]
    z: Column
    e: Float[np.ndarray, "3 r"]
    term_angles: Column
    bearing: Column
    damped: list[np.ndarray]
    z_rates: Float[np.ndarray, "3 k"]
    multiplier: Column = field(default_factory=lambda: np.zeros(0))
    port_force: Column = field(default_factory=lambda: np.zeros(0))
    met: Bool[np.ndarray, " r"] = field(default_factory=lambda: np.zeros(0, bool))


@dataclass
class Monolithic:
    """Steps of a system by assembled tangents; `scheme` as any step's.

    keeps : whether steps go on with the tangent of the step before while changes fall with it, which is dear to assemble
    kept : the tangent's inverse
    stressed : of all links the stiffness that stresses of the rigid-body motion give at the end of the step, world
        components; none without stiffening
    sides : of all laws which stop may push in the step
    """

    system: System
    scheme: Scheme
    keeps: bool = False
    kept: Inverse | None = None
    stressed: Sequence[Matrix] = ()
    sides: Sequence[int | None] = ()

    def __post_init__(self) -> None:
        model = self.system.model
        every = list(zip(model.links, model.joints, strict=True))
        ends = np.cumsum([0, *(link.unknowns for link in model.links)])
        self.of = [slice(a, b) for a, b in pairwise(ends)]
        self.N, self.k = int(ends[-1]), self.system.unknowns
        self.terms = [(n, term) for n, x in enumerate(self.system.constraints) for term in x.terms]
        self.hard = [n for n, x in enumerate(self.system.constraints) if isinstance(x.law, Held | Driven)]
        self.linear = all(link.fit is None for link in model.links) and all(x.linear for x in self.system.constraints)
        sizes = [float(abs(link.K0).max()) * link.size for link in model.links]
        self.rounding = 0.0 if self.linear else ROUNDING * max(sizes)
        self.masses = [sp.csr_array(mass_matrix(link)) for link in model.links]
        self.M = sp.csr_array(sp.block_diag(self.masses))
        self.W = sp.csr_array(sp.block_diag([port_columns(joint, link.n).T for link, joint in every]))
        self.B = interface_matrix(model.joints)

    def rates(self, x: np.ndarray, x0: np.ndarray, v0: np.ndarray, a0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Newmark's formulas."""
        n, r = self.scheme.acceleration, self.scheme.rate
        return r[0] * (x - x0) - r[1] * v0 - r[2] * a0, n[0] * (x - x0) - n[1] * v0 - n[2] * a0

    def step(self, old: Now, at: RigidMotion, between: Motion | None = None, halvings: int = HALVINGS) -> Now:
        """The state one step later; steps in which stops with damping are met are divided, as those of `march` are.

        Parameters
        ----------
        between : rigid-body motion at any times; without it steps stay undivided
        halvings : how often parts may be divided

        Raises
        ------
        SolveError
            If the iterations do not converge.
        """
        return in_parts(self, old, at, between, halvings)

    def undivided(self, old: Now, at: RigidMotion, apart: bool = False) -> Now:
        """The same in one part; `apart`: stops with damping that do not push at its beginning do not push in it."""
        stiffening, self.sides = self.system.stiffening, sides(self.system, old, apart)
        self.stressed = () if stiffening is None else stiffening.stiffness(forcings(self.system.model, at), at)
        if self.keeps:
            try:
                return self._stepped(old, at, patience=1)
            except SolveError:
                pass
        self.kept = None
        return self._stepped(old, at, patience=0)

    def _stepped(self, old: Now, at: RigidMotion, patience: int) -> Now:
        """The same; `patience` is how many changes in a row may fall slowly before tangents are assembled anew."""
        scheme, r, hard = self.scheme, len(self.system.constraints), self.hard
        now = self._guess(old, at)
        q, size, slow, least, stalled = self.W.shape[0], np.inf, 0, np.inf, 0
        lam, m = np.zeros(q), np.zeros(r)
        if patience and len(old.multiplier):
            m[hard] = (1 - scheme.alpha_f) * old.multiplier[hard]
        for _ in range(ITERATIONS):
            self._evaluated(now, old, at)
            e, C = self.coordinates(now.z, now.term_angles, at)
            now.e[0] = e
            now.e[1], now.e[2] = self.rates(e, *old.e)
            own = self.own_rates(now, self.rates(now.z, *old.z_rates)[0], at)
            for n, each in enumerate(self.system.constraints):
                if n not in hard:
                    m[n] = -(1 - scheme.alpha_f) * force(each, at, now.e[0, n], own[n], self.sides[n])
            left = [
                self._unbalanced(now, old) - self.W.T @ lam,
                self.W @ now.u - self.B @ now.z,
                self.B.T @ lam - C.T @ m - scheme.alpha_f * old.bearing,
                now.e[0, hard],
            ]
            if self.kept is None:
                self.kept = inverse(tangent(self, now, old, at, C, m), C[hard])
            used = self.kept
            change = used(-np.concatenate(left))
            now.u = now.u + change[: self.N]
            now.z = now.z + change[self.N : self.N + self.k]
            lam += change[self.N + self.k : self.N + self.k + q]
            m[hard] += change[self.N + self.k + q :]
            before, size = size, float(np.abs(change[: self.N]).max())
            if not size < DIVERGED:
                break
            slow = slow + 1 if size > SLOW * before else 0
            self.kept = None if slow > patience else self.kept
            stalled, least = 0 if size < least / 2 else stalled + 1, min(least, size)
            reached = float(np.abs(now.u).max())
            lost = self.linear and stalled >= STALLED and size < STIFF * reached
            if lost or size <= 1e-14 * max(1.0, reached) or (size < 1e-11 and size > 0.5 * before):
                borne = max(float(np.abs(x).max(initial=0.0)) for x in (self.W.T @ lam, now.F, old.F))
                if lost or float(np.abs(left[0]).max()) <= max(BALANCED * borne, self.rounding):
                    self.kept = used
                    return self._ended(now, old, at, m, lam)
                if not self.linear:
                    break
        raise SolveError(
            f"analysis.solver: the iterations of the monolithic solver must converge to a balance, got none at "
            f'{float(at.t[0]):.6g} s: take solver = "condensed", or a smaller step'
        )

    def _guess(self, old: Now, at: RigidMotion) -> Now:
        h = self.scheme.h
        u = old.u + h * old.v + h * h / 2 * old.a
        F = self.applied(at)
        zero = np.zeros_like(old.u)
        z = old.z_rates[0] + h * old.z_rates[1] + h * h / 2 * old.z_rates[2]
        return Now(u, zero, zero, zero, F, [], z, np.zeros_like(old.e), old.term_angles.copy(), zero, [],
                   old.z_rates)  # fmt: skip

    def applied(self, at: RigidMotion) -> Column:
        """P − M R0'' of all bodies, world components."""
        model = self.system.model
        every = zip(model.links, model.loads, model.bodies, strict=True)
        return np.concatenate([applied(link, loads, at, body)[0].ravel() for link, loads, body in every])

    def _evaluated(self, now: Now, old: Now, at: RigidMotion) -> None:
        """Rates, and internal forces of all bodies."""
        now.v, now.a = self.rates(now.u, old.u, old.v, old.a)
        found = [self.force_of(k, now.u[own], old, at) for k, own in enumerate(self.of)]
        now.f = np.concatenate([f for f, _, _ in found])
        now.g, now.damped = [g for _, g, _ in found], [C for _, _, C in found]

    def force_of(self, k: int, u: Column, old: Now, at: RigidMotion) -> tuple[Column, list[Seen], np.ndarray]:
        """Internal force of body k, world components; deformations with their rates; damped quantities with theirs."""
        link, damping = self.system.model.links[k], self.system.model.damping
        whole = at.R[0, self.system.model.bodies[k]]
        R = whole[: link.d, : link.d]
        x = u.reshape(link.n, link.d) @ R
        Mx = (self.masses[k] @ x.ravel()).reshape(x.shape)
        if link.fit is None:
            Kx = (link.K0 @ x.ravel()).reshape(x.shape)
            C = damping.alpha * Mx + damping.beta * Kx
            C = np.stack([C, *self.rates(C, *old.damped[k])])
            f = ((Kx + C[1]) @ R.T).ravel()
            return (f + self.stressed[k] @ u if self.stressed else f), [], C
        y = x + link.X[:, : link.d] * ([1, 1, 0] if link.kind == "beam" else 1)
        C = damping.alpha * Mx
        C = np.stack([C, *self.rates(C, *old.damped[k])])
        f = C[1].copy()
        seen: list[Seen] = []
        for frame, (angle, g0) in zip(frames_of(link), old.g[k], strict=True):
            Q, turn = rotation(link, frame.fit, y, angle)
            g = deformation(link, y, Q, turn)
            rates = self.rates(g, *g0)
            f += frame_force(link, frame, Deformed(Q, turn, g, rates[0]), y, damping.beta)[0]
            seen.append((turn, np.stack([g, *rates])))
        own = [load for load in self.system.model.loads[k] if load.own]
        x = u.reshape(link.n, link.d)
        pushed = [load.factor(at.t, at.phi)[0] * rotated_load(link, load, whole, x) for load in own]
        return (f @ R.T - sum(pushed, np.zeros_like(f))).ravel(), seen, C

    def _unbalanced(self, now: Now, old: Now) -> Column:
        s = self.scheme
        inertia = self.M @ ((1 - s.alpha_m) * now.a + s.alpha_m * old.a)
        return np.asarray(inertia + (1 - s.alpha_f) * (now.f - now.F) + s.alpha_f * (old.f - old.F))

    def coordinates(
        self, z: Column, angles: Column, at: RigidMotion, which: Collection[int] | None = None
    ) -> tuple[Column, Float[np.ndarray, "r k"]]:
        """All coordinates less their drives' travels, and their gradients; zero but for some, if these are given."""
        constraints = self.system.constraints
        e, C = np.zeros(len(constraints)), np.zeros((len(constraints), self.k))
        for linear in (True, False):  # those that are linear in z are so about z = 0
            mine = [k for k, (n, _) in enumerate(self.terms)
                    if constraints[n].linear is linear and (which is None or n in which)]  # fmt: skip
            terms, place = [self.terms[k][1] for k in mine], (at.R[0], at.p[0], 0 * z if linear else z)
            values, rows, angles[mine] = measured(self.system, terms, place, angles[mine])
            for k, value, row in zip(mine, values, rows, strict=True):
                n, term = self.terms[k]
                e[n] += term.factor * value
                C[n] += term.factor * row
        for n in range(len(constraints)) if which is None else which:
            drive = getattr(constraints[n].law, "drive", -1)
            e[n] = C[n] @ z if constraints[n].linear else e[n] - (at.drives[0, drive] if drive >= 0 else 0.0)
        return e, C

    def own_rates(self, now: Now, z1: Column, at: RigidMotion) -> Column:
        """Rates of all coordinates: Newmark's of linear ones, of those less a drive's travel and of held ones.

        Of others by differences: the mechanism and z move on, and back, as their rates, z' of these, show.
        """
        from scipy.spatial.transform import Rotation

        out, constraints = now.e[1].copy(), self.system.constraints
        shown = {*self.hard, *(n for n, x in enumerate(constraints) if x.linear or getattr(x.law, "drive", -1) >= 0)}
        which = [n for n in range(len(out)) if n not in shown]
        if not which:
            return np.asarray(out)
        ahead = np.array([-3, -2, -1, 1, 2, 3]) * (RATES * self.scheme.h)
        values = []
        for dt in ahead:
            turn = Rotation.from_rotvec(dt * at.omega[0]).as_matrix() @ at.R[0]
            moved = replace(at, R=turn[None], p=at.p + dt * at.v)
            values.append(self.coordinates(now.z + dt * z1, now.term_angles.copy(), moved, which)[0][which])
        out[which] = np.array([-1, 9, -45, 45, -9, 1]) @ np.array(values) / (60 * RATES * self.scheme.h)
        return np.asarray(out)

    def _ended(self, now: Now, old: Now, at: RigidMotion, m: Column, lam: Column) -> Now:
        self._evaluated(now, old, at)
        e, C = self.coordinates(now.z, now.term_angles, at)
        now.e = np.stack([e, *self.rates(e, *old.e)])
        now.z_rates = np.stack([now.z, *self.rates(now.z, *old.z_rates)])
        now.multiplier = m / (1 - self.scheme.alpha_f)
        now.bearing = C.T @ now.multiplier
        before = old.port_force if len(old.port_force) else 0 * lam
        now.port_force = (lam - self.scheme.alpha_f * before) / (1 - self.scheme.alpha_f)
        return now
