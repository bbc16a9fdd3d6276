"""Steps with frames that follow: the condensed step with absolute positions, swept until it is in balance.

x = R0 + δ. In the balance of generalised-α the internal force is that of all segments' frames (`dynamics.frames`),

    M [(1 − α_m) δ1'' + α_m δ0''] + (1 − α_f) f1 + α_f f0 = (1 − α_f) F1 + α_f F0 + Wᵀ λ,   F = P − M R0''

and a sweep corrects δ1 by A Δ = residual + Wᵀ λ, joints and cuts closed, with the effective matrix A of each segment,
constant and factored once, in the segment's frame as predicted: [KED, eqs. (12)(14)] for a segment.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.acting import acting_on, over_block
from kedfem.dynamics.action import Action
from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.frames import frames_of, stress_deformation
from kedfem.dynamics.held import closed, closure, held_part, interface_factor, on_nodes, solved
from kedfem.dynamics.history import Forcing, LinkHistory
from kedfem.dynamics.mixing import Mixing
from kedfem.dynamics.ports import port_rotation
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.segment import (
    CONVERGED,
    EASIER,
    PATIENCE,
    SWEEPS,
    NotConverged,
    first_state,
    rounding,
    too_far,
)
from kedfem.dynamics.stacks import (
    Each,
    Rows,
    Stack,
    StackFrame,
    StackState,
    State,
    deformations,
    frame_forces,
    rotations,
    stacked,
    stacks,
)
from kedfem.dynamics.state import LinkState, NodalOf, Rayleigh, accelerated
from kedfem.dynamics.substructure import effective_coefficients
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion


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
        self.factorisations, self.sweeps, self.eased = len(self.parts), 0, 0
        self.scale, self._too_far = rounding(links), too_far(links)
        self.mixing, self.stacks = Mixing(), stacks(links)
        self._acting = acting_on(actions, links)
        self._turned = np.zeros(len(actions))
        self._closure = closure(
            joints, [on_nodes(link, joint) for link, joint in zip(links, joints, strict=True)]
        )

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
        state = self._closed(state)
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

    def _closed(self, state: State) -> State:
        """The state with its joints closed, in displacement and rates."""
        out = list(state.stacks)
        for name, times in (("u", "Mu"), ("v", "Mv"), ("a", "Ma")):
            rows = self._by_segment(
                [stack.parts(getattr(s, name)) for stack, s in zip(self.stacks, out, strict=True)]
            )
            at_ports = [x[joint.nodes].ravel() for joint, x in zip(self.joints, rows, strict=True)]
            rows = [x.copy() for x in rows]
            for joint, x, y in zip(self.joints, rows, closed(self._closure, at_ports), strict=True):
                x[joint.nodes] = y.reshape(-1, x.shape[1])
            for i, stack in enumerate(self.stacks):
                x = np.concatenate([rows[k] for k in stack.members])
                changed: dict[str, Any] = {name: x, times: stack.mass(x)}
                out[i] = replace(out[i], **changed)
        return replace(state, stacks=tuple(out))

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
                self.eased += bool(sizes.sum() > self.tolerance**2 * max(self.scale, moved))
                self.scale = max(self.scale, moved)
                now, self._turned = self._acted(now, before, F, acting, t)
                return self._ended(state, now, R, frames, forces)
        self.mixing = Mixing()
        return self.links[int(np.argmax(np.nan_to_num(sizes, nan=np.inf)))].name

    def _interface(self, frames: Sequence[Each]) -> list[NodalOf]:
        """Rᵀ B of all segments."""
        of = self._by_segment(frames)
        return [port_rotation(joint, R).T @ joint.B for joint, R in zip(self.joints, of, strict=True)]

    def _by_segment(self, stacked: Sequence[Any]) -> list[Any]:
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
