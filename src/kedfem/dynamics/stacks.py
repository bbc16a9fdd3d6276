"""Segments one below the other: what `dynamics.frames` does for one, for all segments of a kind at once.

Rows of all members stand below each other, (N, d); what a segment has once stands in a row of its own, (s, …). So a sweep
costs a few products of whole arrays, however many segments there are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from kedfem.dynamics.frames import Followed, frames_of
from kedfem.dynamics.segment import SegmentState
from kedfem.links.metric import pulled_back, strains_of
from kedfem.links.record import BeamElement, Link
from kedfem.motion.newton import cross_matrix, rotation

Rows = Float[np.ndarray, "N d"]
Each = Float[np.ndarray, "s d d"]
Times = Callable[[Rows], Rows]


@dataclass(frozen=True, slots=True)
class Stack:
    """Segments of one kind, with as many frames.

    members : their numbers
    bounds : (s + 1,) where the rows of each begin and end
    X : (N, d) position as drawn, of planar beams (x, y, 0); one : (N,)
    centre : (N,) m·1 over the segment's mass: weights of the mean
    planar, beam, follows, points : whether they turn about z only, have rows (u, v, ψ), frames that follow, many of them
    lumped : (N, d) the mass's diagonal, scaled to the whole mass (Hinton, Rock, Zienkiewicz 1976), for norms
    fit : (N, 3) of the mean rotation; fits : per frame; stiffness : K0 times rows, per frame; mass : M times rows
    elements : of beams in space, whose strains need no frame
    """

    members: tuple[int, ...]
    bounds: Int[np.ndarray, " b"]
    X: Rows
    one: Float[np.ndarray, " N"]
    centre: Float[np.ndarray, " N"]
    lumped: Rows
    planar: bool
    beam: bool
    follows: bool
    points: bool
    fit: Float[np.ndarray, "N 3"]
    fits: tuple[Float[np.ndarray, "N 3"], ...]
    stiffness: tuple[Times, ...]
    mass: Times
    elements: tuple[BeamElement, ...] = ()

    @property
    def k(self) -> int:
        """Components that turn."""
        return 2 if self.planar else 3

    def parts(self, x: Float[np.ndarray, "N *"]) -> list[Float[np.ndarray, "n *"]]:
        """The rows of each segment."""
        return [x[a:b] for a, b in zip(self.bounds, self.bounds[1:], strict=False)]

    def spread(self, each: Float[np.ndarray, "s *"]) -> Float[np.ndarray, "N *"]:
        """What a segment has once, for each of its rows."""
        return np.asarray(np.repeat(each, np.diff(self.bounds), axis=0))

    def turned(self, x: Rows, R: Each) -> Rows:
        """x R, segment by segment; segments of one size at once."""
        even = self._even(x)
        if even is not None:
            return np.asarray(np.matmul(even, R).reshape(x.shape))
        out = np.empty_like(x)
        for a, b, r in zip(self.bounds, self.bounds[1:], R, strict=False):
            np.matmul(x[a:b], r, out=out[a:b])
        return out

    def moments(self, x: Float[np.ndarray, "N _"], c: Float[np.ndarray, "N _"]) -> Float[np.ndarray, "s k k"]:
        """Σ x_a ⊗ c_a of each segment, of the components that turn."""
        k, even, other = self.k, self._even(x), self._even(c)
        if even is not None and other is not None:
            return np.asarray(even[..., :k].transpose(0, 2, 1) @ other[..., :k])
        return np.stack([p[:, :k].T @ q[:, :k] for p, q in zip(self.parts(x), self.parts(c), strict=True)])

    def _even(self, x: Rows) -> Float[np.ndarray, "s n d"] | None:
        """All rows, segment by segment; None if segments differ in size."""
        n = len(x) // len(self.members)
        same = self.bounds[1] == n and self.bounds[-2] == len(x) - n and (np.diff(self.bounds) == n).all()
        return x.reshape(len(self.members), n, -1) if same else None

    def dots(self, x: Rows, y: Rows) -> Float[np.ndarray, " s"]:
        """Σ x · y of each segment."""
        return np.asarray(np.add.reduceat(np.einsum("nd,nd->n", x, y), self.bounds[:-1]))


@dataclass(frozen=True, slots=True)
class StackFrame:
    """One frame of all segments at one time: Q (s, d, d), angle (s,), g (N, d) and K0 (g, g', g''), (3, N, d)."""

    Q: Each
    angle: Float[np.ndarray, " s"]
    g: Rows
    K: Float[np.ndarray, "3 N d"]


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
    rows = {
        name: np.concatenate([getattr(s, name) for s in general])
        for name in ("u", "v", "a", "Mu", "Mv", "Ma", "f", "F")
    }
    R, strain = np.stack([s.R for s in general]), np.array([s.strain for s in general])
    damped = np.concatenate([s.damped for s in general], axis=1)
    frames = first_frames(stack, [s.frames for s in general])
    return StackState(**rows, R=R, frames=frames, damped=damped, strain=strain)


def stacks(links: Sequence[Link]) -> list[Stack]:
    """All segments, those of a kind together."""
    kinds: dict[tuple[object, ...], list[int]] = {}
    for k, link in enumerate(links):
        key = (
            link.planar,
            link.kind == "beam",
            link.d,
            link.fit is None,
            len(link.frames),
            link.element is not None,
            sp.issparse(link.K0),
        )
        kinds.setdefault(key, []).append(k)
    return [_stack(tuple(members), [links[k] for k in members]) for members in kinds.values()]


def _stack(members: tuple[int, ...], links: Sequence[Link]) -> Stack:
    first, d = links[0], links[0].d
    beam = first.kind == "beam"
    frames = [frames_of(link) for link in links]
    stiffness: list[list[object]] = [[link.K0 for link in links]] if first.fit is None else [
        [every[e].K0 for every in frames] for e in range(len(frames[0]))
    ]  # fmt: skip
    bounds = np.concatenate([[0], np.cumsum([link.n for link in links])])
    return Stack(
        members, bounds, np.concatenate([link.X[:, :d] * ([1, 1, 0] if beam else 1) for link in links]),
        np.concatenate([link.one for link in links]),
        np.concatenate([link.m1[:, 0] / (link.m1[:, 0] @ link.one) for link in links]),
        np.concatenate([_lumped(link) for link in links]), first.planar, beam, first.fit is not None, bool(first.frames),
        np.concatenate([link.X if link.fit is None else link.fit for link in links]),
        tuple(np.concatenate([every[e].fit for every in frames]) for e in range(len(frames[0]))),
        tuple(_flat(_below(each), d) for each in stiffness), _by_component(links),
        tuple(link.element for link in links if link.element is not None),
    )  # fmt: skip


def _lumped(link: Link) -> Rows:
    diagonal = np.stack([m.diagonal() for m in link.mass], axis=1)
    return np.asarray(diagonal * (link.one @ link.m1[:, 0]) / (link.one**2 @ diagonal[:, 0]))


def _below(matrices: Sequence[object]) -> Callable[[np.ndarray], np.ndarray]:
    """Products with matrices along a diagonal."""
    if sp.issparse(matrices[0]):
        whole = sp.csr_array(sp.block_diag(matrices, format="csr"))
        return lambda x: np.asarray(whole @ x)
    dense = [np.asarray(each) for each in matrices]
    ends = np.cumsum([len(each) for each in dense])[:-1]
    return lambda x: np.concatenate([m @ y for m, y in zip(dense, np.split(x, ends), strict=True)])


def _flat(times: Callable[[np.ndarray], np.ndarray], d: int) -> Times:
    return lambda x: times(x.ravel()).reshape(-1, d)


def _by_component(links: Sequence[Link]) -> Times:
    """Products with the mass: one scalar matrix for all components, or one for each."""
    masses = [_below([link.mass[c] for link in links]) for c in range(links[0].d)]
    if all(m is link.mass[0] for link in links for m in link.mass) and sp.issparse(links[0].mass[0]):
        return masses[0]
    return lambda x: np.stack([m(np.ascontiguousarray(x[:, c])) for c, m in enumerate(masses)], axis=1)


def first_frames(stack: Stack, every: Sequence[tuple[Followed, ...]]) -> tuple[StackFrame, ...]:
    """Frames of a stack from those of its segments, which stand still."""
    found = []
    for e, times in enumerate(stack.stiffness if stack.follows else ()):
        g = np.concatenate([frames[e].g for frames in every])
        Q, angle = (np.stack([getattr(frames[e], name) for frames in every]) for name in ("Q", "angle"))
        K = np.stack(
            [times(np.concatenate([getattr(f[e], name) for f in every])) for name in ("g", "g1", "g2")]
        )
        found.append(StackFrame(Q, angle, g, K))
    return tuple(found)


def rotations(
    stack: Stack, fit: Float[np.ndarray, "N 3"], y: Rows, angle: Float[np.ndarray, " s"]
) -> tuple[Each, Float[np.ndarray, " s"]]:
    """`frames.rotation` of all segments."""
    A = stack.moments(y, fit)
    if stack.planar:
        turn = np.arctan2(A[:, 1, 0] - A[:, 0, 1], A[:, 0, 0] + A[:, 1, 1])
        turn += 2 * np.pi * np.round((angle - turn) / (2 * np.pi))
        Q = np.zeros((len(turn), y.shape[1], y.shape[1]))
        Q[:, -1, -1] = 1.0
        cos, sin = np.cos(turn), np.sin(turn)
        Q[:, 0, 0], Q[:, 0, 1], Q[:, 1, 0], Q[:, 1, 1] = cos, -sin, sin, cos
        return Q, turn
    left, _, right = np.linalg.svd(A)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    Q = left @ right
    return Q @ rotation(_axial_solved(Q.transpose(0, 2, 1) @ A, None)), np.zeros(len(Q))


def deformations(stack: Stack, y: Rows, Q: Each, angle: Float[np.ndarray, " s"]) -> Rows:
    """`frames.deformation` of all segments."""
    if stack.elements:
        every = zip(stack.elements, stack.parts(y), strict=True)
        return np.concatenate([(x.share @ strains_of(x, part)).reshape(part.shape) for x, part in every])
    g = stack.turned(y, Q)
    g -= stack.X
    if stack.beam:
        g[:, 2] = y[:, 2] - stack.spread(angle) * stack.one
    k = stack.k
    mean = np.add.reduceat(stack.centre[:, None] * g[:, :k], stack.bounds[:-1], axis=0)
    g[:, :k] -= stack.one[:, None] * stack.spread(mean)
    return g


def frame_forces(stack: Stack, fit: Float[np.ndarray, "N 3"], now: StackFrame, f: Rows, y: Rows) -> Rows:
    """`frames.frame_force` of all segments from f = K0 (g + β g') in their frames; in the nominal frame."""
    if stack.elements:
        every = zip(stack.elements, stack.parts(y), stack.parts(f), strict=True)
        return np.concatenate([pulled_back(x, part, x.share.T @ own.ravel()) for x, part, own in every])
    k = stack.k
    U = now.Q[:, :k, :k].transpose(0, 2, 1) @ stack.moments(y, fit)
    if stack.planar:
        torque = np.add.reduceat(now.g[:, 0] * f[:, 1] - now.g[:, 1] * f[:, 0], stack.bounds[:-1])
        torque = stack.spread(torque / (U[:, 0, 0] + U[:, 1, 1]))
        f = f.copy()
        f[:, 0] += torque * fit[:, 1]
        f[:, 1] -= torque * fit[:, 0]
    else:
        x = _axial_solved(U, -stack.moments(now.g, f))
        f = f - np.concatenate([c @ w for c, w in zip(stack.parts(fit), -cross_matrix(x), strict=True)])
    return stack.turned(f, now.Q.transpose(0, 2, 1))


def _axial_solved(U: Each, N: Each | None) -> Float[np.ndarray, "s 3"]:
    """G⁻¹ times the axial vector of N, of U if not given: G = tr(U) 1 − sym U."""
    of = U if N is None else N
    axial = np.stack(
        [of[:, 2, 1] - of[:, 1, 2], of[:, 0, 2] - of[:, 2, 0], of[:, 1, 0] - of[:, 0, 1]], axis=1
    )
    G = np.trace(U, axis1=1, axis2=2)[:, None, None] * np.eye(3) - (U + U.transpose(0, 2, 1)) / 2
    return np.asarray(np.linalg.solve(G, axial[:, :, None])[:, :, 0])
