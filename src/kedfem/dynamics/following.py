"""Steps with frames that follow: the condensed step with absolute positions, swept until it is in balance.

x = R0 + δ. In the balance of generalised-α the internal force is that of all segments' frames (`dynamics.frames`),

    M [(1 − α_m) δ1'' + α_m δ0''] + (1 − α_f) f1 + α_f f0 = (1 − α_f) F1 + α_f F0 + Wᵀ λ,   F = P − M R0''

and a sweep corrects δ1 by A Δ = residual + Wᵀ λ, joints and cuts closed, with the effective matrix A of each segment,
constant and factored once, in the segment's frame as predicted: [KED, eqs. (12)(14)] for a segment.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.dynamics.acting import acting_on, over_block
from kedfem.dynamics.action import Action
from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.dense import SMALL, dense_part
from kedfem.dynamics.frames import (
    Followed,
    followed,
    frame_force,
    frames_of,
    rotation,
    seen_from,
    stress_deformation,
)
from kedfem.dynamics.history import Forcing, LinkHistory
from kedfem.dynamics.ports import port_rotation
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.state import LinkState, Nodal, NodalOf, Nominal, Rayleigh, accelerated
from kedfem.dynamics.substructure import Substructure, effective_coefficients, factored
from kedfem.links.record import Link, mass_times
from kedfem.motion.rigid import RigidMotion

DEPTH = 4  # sweeps that are remembered
PATIENCE, EASIER = 6, 100.0  # after so many sweeps a larger change is taken: stiff hubs round coarsely
LEAST, FAR = 1e-6, 100.0  # of the links' sizes
SWEEPS = 40  # in a step, of which it takes 2 to 4
CONVERGED = 1e-7  # change of a sweep, of the largest that a step has made
FREE = 1e-9  # the same where nothing holds the motion as a whole: what is left of each step adds up in it


@dataclass(frozen=True, slots=True)
class SegmentState:
    """A segment at one time; rows (n, d) in world components, but for `frames` and `damped`.

    u, v, a : δ, δ', δ''; Mu, Mv, Ma : times the mass
    f : internal force
    F : P − M R0''
    R : (d, d) its mean orientation, link to world
    frames : what follows it; of a link with nominal frame one that does not turn
    damped : α M δ and rates in the nominal frame, (3, n, d)
    port_forces : (q,) λ, world components
    """

    u: Nodal
    v: Nodal
    a: Nodal
    Mu: Nodal
    Mv: Nodal
    Ma: Nodal
    f: Nodal
    F: Nodal
    R: Float[np.ndarray, "d d"]
    frames: tuple[Followed, ...]
    damped: Float[np.ndarray, "3 n d"]
    port_forces: Float[np.ndarray, " q"]
    strain: float


@dataclass(frozen=True, slots=True)
class HeldPart:
    """A segment with A = c_M M + c_K K0 seen from its ports: g = G r + Y w, λ = S w − Yᵀ r, w = W g; link frame.

    held : r (n, d) → G r (n, d) and Yᵀ r (q,): what r does while ports are held, and what they take
    Y : (dn, q); S : (q, q)
    """

    held: Callable[[Nodal], tuple[Nodal, Float[np.ndarray, " q"]]]
    Y: Float[np.ndarray, "k q"]
    S: Float[np.ndarray, "q q"]


def held_part(link: Link, joint: Attachment, c_M: float, c_K: float) -> HeldPart:
    """Dense and exact to rounding where the segment is small, whose stiff hubs lose digits otherwise."""
    if link.unknowns <= SMALL:
        return _small_part(link, joint, c_M, c_K)
    return held_substructure(factored(link, joint, c_M, c_K))


def held_substructure(part: Substructure) -> HeldPart:
    """A link condensed onto ports and anchors, seen from its ports."""
    q = len(part.attachment.keep)
    Y = part.Y @ part.S[:, :q]

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        y = part.solve(r)
        at_ports = part.S @ part.seen(y)
        return y - (part.Y @ at_ports).reshape(y.shape), at_ports[:q]

    return HeldPart(held, Y, part.S[:q, :q])


def _small_part(link: Link, joint: Attachment, c_M: float, c_K: float) -> HeldPart:
    part = dense_part(link, joint, c_M, c_K)
    T, n, d = scipy.linalg.block_diag(*part.T), link.n, link.d
    nodal = np.arange(n * d).reshape(d, n).T.ravel()  # component first to row by row
    G, Y = (T @ part.G @ T.T)[np.ix_(nodal, nodal)], (T @ part.Y)[nodal]

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        return (G @ r.ravel()).reshape(r.shape), Y.T @ r.ravel()

    return HeldPart(held, Y, part.S)


class NotConverged(Exception):  # noqa: N818 - not a fault yet: such a step is taken in parts
    """A step whose sweeps do not settle.

    taken : time points of the block before it
    histories, state : up to there
    link : name of the link that moves most from sweep to sweep
    """

    def __init__(self, taken: int, histories: list[LinkHistory], state: object, link: str) -> None:
        super().__init__(link)
        self.taken, self.histories, self.state, self.link = taken, histories, state, link


class Mixing:
    """Anderson's mixing of sweeps: the step whose change, extrapolated from the last few sweeps, is smallest.

    Anderson (1965), as Walker and Ni (2011) write it. It costs a few products and settles what single sweeps do not: bent
    segments, whose stiffness as drawn in their mean frame is not quite theirs.
    """

    def __init__(self) -> None:
        self._pairs: list[tuple[np.ndarray, np.ndarray]] = []
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def begin(self) -> None:
        """A new time step: what was learnt of the last one's sweeps still serves."""
        self._last = None

    def step(self, change: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """The step to take after a sweep that asks for a change."""
        if self._last is not None:
            self._pairs = [(self._last[0], change - self._last[1]), *self._pairs[: DEPTH - 1]]
        taken = change
        if self._pairs:
            dX, dF = (np.stack(each, axis=1) for each in zip(*self._pairs, strict=True))
            scale = np.linalg.norm(dF, axis=0)
            gamma = np.linalg.lstsq(dF / scale, change, rcond=1e-8)[0] / scale
            taken = change - (dX + dF) @ gamma
        self._last = taken, change
        return np.asarray(taken)


class FollowingSteps:
    """Advances all segments by generalised-α steps; their effective matrices are factored once, here."""

    def __init__(
        self, links: Sequence[Link], joints: Sequence[Attachment], scheme: Scheme, damping: Rayleigh,
        actions: Sequence[Action] = (), tolerance: float = CONVERGED,
    ) -> None:  # fmt: skip
        self.links, self.joints, self.scheme, self.damping, self.actions = (
            links,
            joints,
            scheme,
            damping,
            actions,
        )
        self.tolerance = tolerance
        c_M, c_K = effective_coefficients(scheme, damping)
        self.parts = [held_part(link, joint, c_M, c_K) for link, joint in zip(links, joints, strict=True)]
        self.factorisations, self.sweeps = len(self.parts), 0
        self.scale, self._too_far = rounding(links), too_far(links)
        self.mixing = Mixing()
        self._acting = acting_on(actions, links)
        self._turned = np.zeros(len(actions))

    def begin(self, states: Sequence[LinkState]) -> list[SegmentState]:
        """The state of the first time point."""
        return [
            first_state(link, joint, self.damping, s)
            for link, joint, s in zip(self.links, self.joints, states, strict=True)
        ]

    def copied(self, state: list[SegmentState]) -> list[SegmentState]:
        """A state that a solver may use up."""
        return list(state)

    def advance(
        self, state: list[SegmentState], forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], list[SegmentState]]:
        """All time points of a block; see `DenseSteps.advance`.

        Raises
        ------
        NotConverged
            With what was done before.
        """
        taken: list[list[SegmentState]] = []
        acting = over_block(self._acting, motion)
        for t in range(len(forcing[0].R)):
            now = self.step(state, [each.at(t) for each in forcing], acting, t)
            if isinstance(now, str):
                raise NotConverged(t, self._histories(taken), state, now)
            state = now
            taken.append(now)
        return self._histories(taken), state

    def step(
        self, states: Sequence[SegmentState], at: Sequence[Nominal], acting: Any, t: int
    ) -> list[SegmentState] | str:
        """States of all segments one step later, [KED, eq. (20)]; the name of a link if the sweeps do not settle."""
        now = [self._predicted(k, s, nominal) for k, (s, nominal) in enumerate(zip(states, at, strict=True))]
        R = [s.R for s in now]
        RB = [port_rotation(joint, each).T @ joint.B for joint, each in zip(self.joints, R, strict=True)]
        H = np.sum([b.T @ part.S @ b for part, b in zip(self.parts, RB, strict=True)], axis=0)
        factor = scipy.linalg.cho_factor(H, check_finite=False) if len(H) else None
        self.mixing.begin()
        reached = 0.0
        for sweep in range(SWEEPS):
            now, _ = self._acted(now, at, acting, t)
            rhs = [self._residual(s, n) @ r for s, n, r in zip(states, now, R, strict=True)]
            frame_change, forces = solved(self.parts, rhs, RB, factor)
            change = [x @ r.T for x, r in zip(frame_change, R, strict=True)]
            sizes = [
                float(np.vdot(x, mass_times(link.mass, x)))
                for link, x in zip(self.links, change, strict=True)
            ]
            self.sweeps += 1
            tolerance = self.tolerance * (1 if sweep < PATIENCE else EASIER)
            settled = sum(sizes) <= tolerance**2 * max(self.scale, reached)
            asked = np.concatenate([x.ravel() for x in change])
            taken = asked if settled else self.mixing.step(asked)
            ends = np.cumsum([x.size for x in change])[:-1]
            now = [
                self._moved(k, s, n, x.reshape(n.u.shape), nominal)
                for k, (s, n, x, nominal) in enumerate(
                    zip(states, now, np.split(taken, ends), at, strict=True)
                )
            ]
            reached = sum(float(np.vdot(n.u - s.u, n.Mu - s.Mu)) for n, s in zip(now, states, strict=True))
            if not reached <= self._too_far:
                break
            if settled:
                self.scale = max(self.scale, reached)
                now, self._turned = self._acted(now, at, acting, t)
                return [
                    self._ended(k, s, n, nominal, force)
                    for k, (s, n, nominal, force) in enumerate(zip(states, now, at, forces, strict=True))
                ]
        self.mixing = Mixing()
        return self.links[int(np.argmax(np.nan_to_num(sizes, nan=np.inf)))].name

    def _acted(
        self, now: Sequence[SegmentState], at: Sequence[Nominal], acting: Any, t: int
    ) -> tuple[list[SegmentState], Float[np.ndarray, " A"]]:
        """States with the forces of motors and springs where they are now, and the coordinates of these."""
        if acting is None:
            return list(now), self._turned
        from kedfem.dynamics.actions_kernel import external

        u, v, F = np.zeros((3, len(self.links), *self._acting.weights.shape[3:]))
        for padded, rows in ((u, [s.u for s in now]), (v, [s.v for s in now]), (F, [n.F for n in at])):
            for each, x in zip(padded, rows, strict=True):
                each[: x.shape[1], : len(x)] = x.T
        turned = external(acting, t, u, v, self._turned, F).copy()
        return [replace(s, F=x[: s.u.shape[1], : len(s.u)].T) for s, x in zip(now, F, strict=True)], turned

    def _predicted(self, k: int, s: SegmentState, at: Nominal) -> SegmentState:
        """The end of the step with an acceleration that stays, seen from frames there."""
        h = self.scheme.h
        u = s.u + h * s.v + (h * h / 2) * s.a
        now = self._moved(k, s, replace(s, u=s.u, Mu=s.Mu, F=at.F), u - s.u, at)
        return replace(now, R=self._mean(k, now, at))

    def _mean(self, k: int, now: SegmentState, at: Nominal) -> Float[np.ndarray, "d d"]:
        """Mean orientation of a segment, link to world."""
        link = self.links[k]
        if link.frames or link.fit is None:
            return mean_orientation(link, now.u, at.R)
        return np.asarray(at.R @ now.frames[0].Q)

    def _moved(self, k: int, s: SegmentState, now: SegmentState, change: Nodal, at: Nominal) -> SegmentState:
        """A state of the end of the step moved by a change of δ, with all that follows from it."""
        link, scheme = self.links[k], self.scheme
        u, Mu = now.u + change, now.Mu + mass_times(link.mass, change)
        v, a = accelerated(scheme, u, s.u, s.v, s.a)
        Mv, Ma = accelerated(scheme, Mu, s.Mu, s.Mv, s.Ma)
        y = position(link, u @ at.R)
        frames = tuple(
            followed(link, frame, y, before, scheme)
            for frame, before in zip(frames_of(self.links[k]), s.frames, strict=True)
        )
        damped = s.damped
        if self.damping.alpha:
            C = self.damping.alpha * (Mu @ at.R)
            damped = np.stack([C, *accelerated(scheme, C, *s.damped)])
        f, strain = internal_force(link, y, at.R, frames, damped, self.damping.beta)
        return SegmentState(u, v, a, Mu, Mv, Ma, f, now.F, now.R, frames, damped, s.port_forces, strain)

    def _residual(self, s: SegmentState, now: SegmentState) -> Nodal:
        """What is missing to balance at the end of the step, without joint forces, world components."""
        c_m, c_f = 1 - self.scheme.alpha_m, 1 - self.scheme.alpha_f
        r = c_f * (now.F - now.f) - c_m * now.Ma
        if self.scheme.alpha_f:
            r += self.scheme.alpha_f * (s.F - s.f)
        return np.asarray(r - self.scheme.alpha_m * s.Ma)

    def _ended(
        self, k: int, s: SegmentState, now: SegmentState, at: Nominal, force: Float[np.ndarray, " q"]
    ) -> SegmentState:
        """The state in balance, with the port forces at the end of the step."""
        world = port_rotation(self.joints[k], now.R) @ force
        if self.scheme.alpha_f:
            world = (world - self.scheme.alpha_f * s.port_forces) / (1 - self.scheme.alpha_f)
        return replace(now, port_forces=world, R=self._mean(k, now, at))

    def _histories(self, taken: Sequence[Sequence[SegmentState]]) -> list[LinkHistory]:
        if not taken:
            return []
        return [self._history(k, [states[k] for states in taken]) for k in range(len(self.links))]

    def _history(self, k: int, states: Sequence[SegmentState]) -> LinkHistory:
        link, joint, frames = self.links[k], self.joints[k], frames_of(self.links[k])
        g = [stress_deformation(link, frames, s.frames) if frames else s.u @ s.R for s in states]
        forces = [port_rotation(joint, s.R).T @ s.port_forces for s in states]
        u, v, a, R, F = (np.stack([getattr(s, name) for s in states]) for name in ("u", "v", "a", "R", "F"))
        strain = np.array([s.strain for s in states])
        return LinkHistory(u, v, a, np.stack(g), R, F, np.stack(forces), strain)


def mean_orientation(link: Link, u: Nodal, R: Float[np.ndarray, "d d"]) -> Float[np.ndarray, "d d"]:
    """Mean orientation of a segment displaced by u, link to world; R where it keeps the nominal frame."""
    if link.fit is None:
        return R
    return np.asarray(R @ rotation(link, link.fit, position(link, u @ R), np.eye(link.d), 0.0)[0])


def solved(
    parts: Sequence[HeldPart],
    rhs: Sequence[NodalOf],
    RB: Sequence[NodalOf],
    factor: tuple[np.ndarray, bool] | None,
) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:
    """Changes of all segments in their frames, and port forces: A Δ = r + Wᵀ λ, Σ Bᵀ R λ = 0, R W Δ = B z.

    Parameters
    ----------
    rhs : r per segment (n, d)
    RB : Rᵀ B
    factor : of H = Σ Bᵀ R S Rᵀ B, None without interface unknowns
    """
    held, reactions = zip(*(part.held(r) for part, r in zip(parts, rhs, strict=True)), strict=True)
    z = np.zeros(RB[0].shape[1])
    if factor is not None:
        f = np.sum([b.T @ x for b, x in zip(RB, reactions, strict=True)], axis=0)
        z = scipy.linalg.cho_solve(factor, f, check_finite=False)
    w = [b @ z for b in RB]
    forces = [part.S @ x - y for part, x, y in zip(parts, w, reactions, strict=True)]
    return [x + (part.Y @ y).reshape(x.shape) for part, x, y in zip(parts, held, w, strict=True)], forces


def position(link: Link, u: Nodal) -> Nodal:
    """Position of a segment displaced by u, both in the nominal frame; of a planar beam (x, y, ψ)."""
    X = link.X[:, : link.d]
    return np.asarray((X * [1, 1, 0] if link.kind == "beam" else X) + u)


def rounding(links: Sequence[Link]) -> float:
    """Square of what counts as a step even where nothing moves, in the norm of the mass: far above rounding."""
    sizes = [float(link.one @ link.m1[:, 0]) * link.size**2 for link in links]
    return float(LEAST**2 * sum(sizes))


def too_far(links: Sequence[Link]) -> float:
    """Square of what no step moves, in the same norm: the links' sizes many times over, where sweeps have run away."""
    return FAR**2 / LEAST**2 * rounding(links)


def first_state(link: Link, joint: Attachment, damping: Rayleigh, s: LinkState) -> SegmentState:
    """A segment's state at the first time point."""
    y = position(link, s.u @ s.R)
    frames = [seen_from(link, frame, y) for frame in frames_of(link)]
    damped = np.zeros((3, *y.shape))
    damped[0] = damping.alpha * (s.Mu @ s.R)
    f, strain = internal_force(link, y, s.R, frames, damped, damping.beta)
    return SegmentState(
        s.u, s.v, s.a, s.Mu, s.Mv, s.Ma, f, s.F, s.R, tuple(frames), damped,
        port_rotation(joint, s.R) @ s.port_forces, strain,
    )  # fmt: skip


def internal_force(
    link: Link,
    y: Nodal,
    R: Float[np.ndarray, "d d"],
    frames: Sequence[Followed],
    damped: np.ndarray,
    beta: float,
) -> tuple[Nodal, float]:
    """Internal force of a segment with damping, world components, and its strain energy.

    Parameters
    ----------
    y : (n, d) position in the nominal frame R
    damped : α M δ and its rates there
    """
    if link.fit is None:
        g = y - position(link, np.zeros_like(y))
        Kg = np.asarray((link.K0 @ g.ravel()).reshape(g.shape))
        return (Kg + damped[1]) @ R.T, 0.5 * float(np.vdot(g, Kg))
    found = [
        frame_force(link, frame, now, y, beta) for frame, now in zip(frames_of(link), frames, strict=True)
    ]
    return (sum(f for f, _ in found) + damped[1]) @ R.T, sum(energy for _, energy in found)
