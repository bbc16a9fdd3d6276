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
from kedfem.dynamics.frames import Followed, frame_force, frames_of, rotation, seen_from, stress_deformation
from kedfem.dynamics.history import Forcing, LinkHistory
from kedfem.dynamics.ports import port_rotation
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.stacks import (
    Each,
    Rows,
    Stack,
    StackFrame,
    deformations,
    first_frames,
    frame_forces,
    rotations,
    stacks,
)
from kedfem.dynamics.state import LinkState, Nodal, NodalOf, Rayleigh, accelerated
from kedfem.dynamics.substructure import Substructure, effective_coefficients, factored
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion

DEPTH = 4  # sweeps that are remembered
RIDGE, TINY = 1e-13, 1e-300  # of a pair's own square: pairs that repeat each other; for pairs of nothing
PATIENCE, EASIER = 12, 100.0  # after so many sweeps a larger change is taken: stiff hubs round coarsely
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


@dataclass(frozen=True, slots=True)
class StackState:
    """The segments of a stack at one time; rows (N, d) in world components, but for `frames` and `damped`.

    u, v, a : δ, δ', δ''; Mu, Mv, Ma : times the mass; in a sweep v, a, Mv are those of the beginning
    f : internal force
    F : P − M R0''
    R : (s, d, d) mean orientation, link to world
    frames : what follows; none of links with nominal frame
    damped : α M δ and rates in the nominal frame, (3, N, d)
    strain : (s,) energy [J]
    """

    u: Rows
    v: Rows
    a: Rows
    Mu: Rows
    Mv: Rows
    Ma: Rows
    f: Rows
    F: Rows
    R: Each
    frames: tuple[StackFrame, ...]
    damped: Float[np.ndarray, "3 N d"]
    strain: Float[np.ndarray, " s"]


@dataclass(frozen=True, slots=True)
class State:
    """All segments at one time; port_forces : per segment (q,) λ, world components."""

    stacks: tuple[StackState, ...]
    port_forces: tuple[Float[np.ndarray, " _"], ...]


def stacked(stack: Stack, general: Sequence[SegmentState]) -> StackState:
    """The segments of a stack at the first time point."""
    names = ("u", "v", "a", "Mu", "Mv", "Ma", "f", "F")
    rows = [np.concatenate([getattr(s, name) for s in general]) for name in names]
    damped = np.concatenate([s.damped for s in general], axis=1)
    frames = first_frames(stack, [s.frames for s in general])
    return StackState(
        *rows, np.stack([s.R for s in general]), frames, damped, np.array([s.strain for s in general])
    )


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
        self._known, self._slot = 0, 0
        self._steps = self._changes = np.zeros((DEPTH, 0))
        self._products = np.zeros((DEPTH, DEPTH))
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def begin(self) -> None:
        """A new time step: what was learnt of the last one's sweeps still serves."""
        self._last = None

    def step(self, change: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        """The step to take after a sweep that asks for a change."""
        if self._last is not None:
            self._learn(change)
        taken, m = change, self._known
        if m:
            size = np.sqrt(self._products[:m, :m].diagonal()) + TINY
            A = self._products[:m, :m] / np.outer(size, size)
            A[np.diag_indices(m)] = 1 + RIDGE
            gamma = np.linalg.solve(A, (self._changes[:m] @ change) / size) / size
            taken = change - gamma @ self._steps[:m]
        self._last = taken, change
        return np.asarray(taken)

    def _learn(self, change: Float[np.ndarray, " N"]) -> None:
        """Keep what the last step did to the change, in place of the oldest."""
        if not self._steps.size:
            self._steps, self._changes = np.zeros((2, DEPTH, len(change)))
        taken, before = self._last if self._last is not None else (change, change)
        slot, self._known = self._slot, min(DEPTH, self._known + 1)
        np.subtract(change, before, out=self._changes[slot])
        np.add(taken, self._changes[slot], out=self._steps[slot])
        products = self._changes[: self._known] @ self._changes[slot]
        self._products[slot, : self._known] = self._products[: self._known, slot] = products
        self._slot = (slot + 1) % DEPTH


class FollowingSteps:
    """Advances all segments by generalised-α steps; their effective matrices are factored once, here."""

    def __init__(
        self, links: Sequence[Link], joints: Sequence[Attachment], scheme: Scheme, damping: Rayleigh,
        actions: Sequence[Action] = (), tolerance: float = CONVERGED,
    ) -> None:  # fmt: skip
        self.links, self.joints, self.scheme, self.damping = links, joints, scheme, damping
        self.actions, self.tolerance = actions, tolerance
        c_M, c_K = effective_coefficients(scheme, damping)
        self.parts = [held_part(link, joint, c_M, c_K) for link, joint in zip(links, joints, strict=True)]
        self.factorisations, self.sweeps = len(self.parts), 0
        self.scale, self._too_far = rounding(links), too_far(links)
        self.mixing, self.stacks = Mixing(), stacks(links)
        self._acting = acting_on(actions, links)
        self._turned = np.zeros(len(actions))

    def begin(self, states: Sequence[LinkState]) -> State:
        """The state of the first time point."""
        every = [
            first_state(link, joint, self.damping, s)
            for link, joint, s in zip(self.links, self.joints, states, strict=True)
        ]
        of = tuple(stacked(stack, [every[k] for k in stack.members]) for stack in self.stacks)
        return State(of, tuple(s.port_forces for s in every))

    def copied(self, state: State) -> State:
        """A state that a solver may use up."""
        return state

    def advance(
        self, state: State, forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], State]:
        """All time points of a block; see `DenseSteps.advance`.

        Raises
        ------
        NotConverged
            With what was done before.
        """
        taken: list[State] = []
        acting = over_block(self._acting, motion)
        R = [np.stack([forcing[k].R for k in stack.members], axis=1) for stack in self.stacks]
        F = [np.concatenate([forcing[k].F for k in stack.members], axis=1) for stack in self.stacks]
        for t in range(len(forcing[0].R)):
            now = self.step(state, [x[t] for x in R], [x[t] for x in F], acting, t)
            if isinstance(now, str):
                raise NotConverged(t, self._histories(taken), state, now)
            state = now
            taken.append(now)
        return self._histories(taken), state

    def step(self, state: State, R: Sequence[Each], F: Sequence[Rows], acting: Any, t: int) -> State | str:
        """The state one step later, [KED, eq. (20)]; the name of a link if the sweeps do not settle.

        Parameters
        ----------
        R, F : nominal orientation and P − M R0'' of each stack at the end of the step
        """
        before = state.stacks
        now = [self._predicted(*each) for each in zip(self.stacks, before, R, F, strict=True)]
        frames = [self._mean(*each) for each in zip(self.stacks, now, R, strict=True)]
        RB = self._interface(frames)
        factor = interface_factor(self.parts, RB)
        self.mixing.begin()
        sizes, moved = np.zeros(len(self.links)), 0.0
        for sweep in range(SWEEPS):
            now, _ = self._acted(now, before, F, acting, t)
            change, forces = self._asked(before, now, frames, RB, factor)
            for stack, x in zip(self.stacks, change, strict=True):
                sizes[list(stack.members)] = stack.dots(x, stack.lumped * x)
            self.sweeps += 1
            tolerance = self.tolerance * (1 if sweep < PATIENCE else EASIER)
            settled = sizes.sum() <= tolerance**2 * max(self.scale, moved)
            asked = np.concatenate([x.ravel() for x in change])
            taken = asked if settled else self.mixing.step(asked)
            ends = np.cumsum([x.size for x in change])[:-1]
            now = [
                self._moved(stack, s, n, x.reshape(n.u.shape), r)
                for stack, s, n, x, r in zip(self.stacks, before, now, np.split(taken, ends), R, strict=True)
            ]
            moved = sum(float(np.vdot(n.u - s.u, n.Mu - s.Mu)) for n, s in zip(now, before, strict=True))
            if not moved <= self._too_far:
                break
            if settled:
                self.scale = max(self.scale, moved)
                now, self._turned = self._acted(now, before, F, acting, t)
                return self._ended(state, now, R, frames, forces)
        self.mixing = Mixing()
        return self.links[int(np.argmax(np.nan_to_num(sizes, nan=np.inf)))].name

    def _interface(self, frames: Sequence[Each]) -> list[NodalOf]:
        """Rᵀ B of all segments."""
        of = self._by_segment(frames)
        return [port_rotation(joint, R).T @ joint.B for joint, R in zip(self.joints, of, strict=True)]

    def _by_segment(self, stacked: Sequence[Sequence[np.ndarray]]) -> list[Any]:
        """What is given stack by stack, in the order of the segments."""
        out: list[Any] = [None] * len(self.links)
        for stack, every in zip(self.stacks, stacked, strict=True):
            for k, each in zip(stack.members, every, strict=True):
                out[k] = each
        return out

    def _asked(
        self, before: Sequence[StackState], now: Sequence[StackState], frames: Sequence[Each], RB: Sequence[NodalOf],
        factor: tuple[np.ndarray, bool] | None,
    ) -> tuple[list[Rows], list[Float[np.ndarray, " _"]]]:  # fmt: skip
        """The change of δ that a sweep asks for, world components, and the port forces in the predicted frames."""
        rhs = [
            stack.parts(stack.turned(self._residual(s, n), r))
            for stack, s, n, r in zip(self.stacks, before, now, frames, strict=True)
        ]
        found, forces = solved(self.parts, self._by_segment(rhs), RB, factor)
        change = [
            stack.turned(np.concatenate([found[k] for k in stack.members]), r.transpose(0, 2, 1))
            for stack, r in zip(self.stacks, frames, strict=True)
        ]
        return change, forces

    def _acted(
        self, now: Sequence[StackState], before: Sequence[StackState], F: Sequence[Rows], acting: Any, t: int
    ) -> tuple[list[StackState], Float[np.ndarray, " A"]]:
        """States with the forces of motors and springs where they are now, and the coordinates of these."""
        if acting is None:
            return list(now), self._turned
        from kedfem.dynamics.actions_kernel import external

        rates = [self._rates(n.u, s.u, s.v, s.a)[0] for n, s in zip(now, before, strict=True)]
        u, v, P = np.zeros((3, len(self.links), *self._acting.weights.shape[3:]))
        for padded, rows in ((u, [s.u for s in now]), (v, rates), (P, F)):
            every = self._by_segment([stack.parts(x) for stack, x in zip(self.stacks, rows, strict=True)])
            for each, x in zip(padded, every, strict=True):
                each[: x.shape[1], : len(x)] = x.T
        turned = external(acting, t, u, v, self._turned, P).copy()
        of = [
            np.concatenate(
                [P[k, : x.shape[1], :n].T for k, n in zip(stack.members, np.diff(stack.bounds), strict=True)]
            )
            for stack, x in zip(self.stacks, F, strict=True)
        ]
        return [replace(s, F=x) for s, x in zip(now, of, strict=True)], turned

    def _predicted(self, stack: Stack, s: StackState, R: Each, F: Rows) -> StackState:
        """The end of the step with an acceleration that stays, seen from frames there."""
        h = self.scheme.h
        change = h * s.v + (h * h / 2) * s.a
        return self._moved(stack, s, replace(s, F=F), change, R)

    def _mean(self, stack: Stack, now: StackState, R: Each) -> Each:
        """Mean orientation of the segments, link to world."""
        if not stack.follows:
            return R
        if not stack.points:
            return np.asarray(R @ now.frames[0].Q)
        y = stack.X + stack.turned(now.u, R)
        return np.asarray(R @ rotations(stack, stack.fit, y, np.zeros(len(R)))[0])

    def _moved(self, stack: Stack, s: StackState, now: StackState, change: Rows, R: Each) -> StackState:
        """A state of the end of the step moved by a change of δ, with all that a sweep needs to know of it."""
        u, Mu = now.u + change, now.Mu + stack.mass(change)
        Ma = self._rates(Mu, s.Mu, s.Mv, s.Ma)[1]
        damped = s.damped
        if self.damping.alpha:
            C = self.damping.alpha * stack.turned(Mu, R)
            damped = np.stack([C, *self._rates(C, *s.damped)])
        frames, f, strain = self._forces(stack, stack.X + stack.turned(u, R), s.frames)
        if self.damping.alpha:
            f = f + damped[1]
        f = stack.turned(f, R.transpose(0, 2, 1))
        return StackState(u, now.v, now.a, Mu, now.Mv, Ma, f, now.F, s.R, frames, damped, strain)

    def _forces(
        self, stack: Stack, y: Rows, before: tuple[StackFrame, ...]
    ) -> tuple[tuple[StackFrame, ...], Rows, Float[np.ndarray, " s"]]:
        """Frames at the end of the step; internal force in the nominal frame, and its strain energy."""
        if not stack.follows:
            g = y - stack.X
            Kg = stack.stiffness[0](g)
            return (), Kg, 0.5 * stack.dots(g, Kg)
        f, strain, frames = np.zeros_like(y), np.zeros(len(stack.members)), []
        for fit, times, s in zip(stack.fits, stack.stiffness, before, strict=True):
            Q, angle = rotations(stack, fit, y, s.angle)
            g = deformations(stack, y, Q, angle)
            Kg = times(g)
            # K0 is constant, so that K0 g' follows from K0 g by the formulas of g' itself
            rates = self._rates(Kg, *s.K) if self.damping.beta else s.K[1:]
            frames.append(StackFrame(Q, angle, g, np.stack([Kg, *rates])))
            strain += 0.5 * stack.dots(g, Kg)
            Kg = Kg + self.damping.beta * rates[0] if self.damping.beta else Kg
            f += frame_forces(stack, fit, frames[-1], Kg, y)
        return tuple(frames), f, strain

    def _rates(self, x1: Rows, x: Rows, v: Rows, a: Rows) -> tuple[Rows, Rows]:
        return accelerated(self.scheme, x1, x, v, a)

    def _residual(self, s: StackState, now: StackState) -> Rows:
        """What is missing to balance at the end of the step, without joint forces, world components."""
        c_m, c_f = 1 - self.scheme.alpha_m, 1 - self.scheme.alpha_f
        r = c_f * (now.F - now.f) - c_m * now.Ma
        if self.scheme.alpha_f:
            r += self.scheme.alpha_f * (s.F - s.f)
        return np.asarray(r - self.scheme.alpha_m * s.Ma)

    def _ended(
        self, state: State, now: Sequence[StackState], R: Sequence[Each], frames: Sequence[Each],
        forces: Sequence[Float[np.ndarray, " _"]],
    ) -> State:  # fmt: skip
        """The state in balance, with all rates, and the port forces at the end of the step."""
        ended = []
        for stack, s, n, r in zip(self.stacks, state.stacks, now, R, strict=True):
            v, a = self._rates(n.u, s.u, s.v, s.a)
            Mv, Ma = self._rates(n.Mu, s.Mu, s.Mv, s.Ma)
            ended.append(replace(n, v=v, a=a, Mv=Mv, Ma=Ma, R=self._mean(stack, n, r)))
        alpha = self.scheme.alpha_f
        of = zip(self.joints, self._by_segment(frames), forces, state.port_forces, strict=True)
        world = (
            (port_rotation(joint, r) @ force - alpha * start) / (1 - alpha) for joint, r, force, start in of
        )
        return State(tuple(ended), tuple(world))

    def _histories(self, taken: Sequence[State]) -> list[LinkHistory]:
        found: list[Any] = [None] * len(self.links)
        for i, stack in enumerate(self.stacks if taken else ()):
            states = [state.stacks[i] for state in taken]
            rows = {name: np.stack([getattr(s, name) for s in states]) for name in ("u", "v", "a", "F")}
            R, strain = (np.stack([getattr(s, name) for s in states]) for name in ("R", "strain"))
            for e, k in enumerate(stack.members):
                here, link = slice(stack.bounds[e], stack.bounds[e + 1]), self.links[k]
                frames = frames_of(link)
                g = [stress_deformation(link, frames, [x.g[here] for x in s.frames]) if frames else s.u[here] @ s.R[e]
                     for s in states]  # fmt: skip
                forces = [
                    port_rotation(self.joints[k], r).T @ state.port_forces[k]
                    for r, state in zip(R[:, e], taken, strict=True)
                ]
                u, v, a, F = (rows[name][:, here] for name in ("u", "v", "a", "F"))
                found[k] = LinkHistory(u, v, a, np.stack(g), R[:, e], F, np.stack(forces), strain[:, e])
        return found if taken else []


def mean_orientation(link: Link, u: Nodal, R: Float[np.ndarray, "d d"]) -> Float[np.ndarray, "d d"]:
    """Mean orientation of a segment displaced by u, link to world; R where it keeps the nominal frame."""
    if link.fit is None:
        return R
    return R @ rotation(link, link.fit, position(link, u @ R), 0.0)[0]


def interface_factor(parts: Sequence[HeldPart], RB: Sequence[NodalOf]) -> tuple[np.ndarray, bool] | None:
    """Factor of H = Σ Bᵀ R S Rᵀ B, None without interface unknowns; a segment has a share in few rows of it."""
    H = np.zeros((RB[0].shape[1], RB[0].shape[1]))
    if not len(H):
        return None
    for part, b in zip(parts, RB, strict=True):
        own = np.flatnonzero(b.any(axis=0))
        known = b[:, own]
        H[np.ix_(own, own)] += known.T @ part.S @ known
    return scipy.linalg.cho_factor(H, check_finite=False)


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
    factor : of `interface_factor`
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
