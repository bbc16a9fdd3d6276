"""The stress envelope: the highest stresses at every point of the links over all steps, and when they occur.

The states of a link lie in the span of a few modes, which are found step by step. So its stress is a product of the
modes' stress and a few coordinates, and `envelope_kernel` skips most times by bounds. Rigid links have no stress.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import NONE, Block, Snapshot
from kedfem.dynamics.model import Model
from kedfem.links.record import Link
from kedfem.links.recovery import StressRecovery, stress_modes
from kedfem.links.reduced import rigid_modes

EXACT = 1e-6  # of a link's highest stress: what may be missing of an envelope
NOTHING = 1e-13  # of a link's displacement: rounding, which no mode is made for
DECADES = 1e-4  # of the largest: singular values that one Gram matrix resolves
SOME = 64  # steps of which new modes are made at a time
SAMPLE = 1000  # points at which the stress of a mode is judged
WAITING = 192_000_000  # bytes of histories, at most, that are examined together
STEPS = 2048  # and steps
HEAD = 1e-3  # of the largest: coordinates with less effect on stress are bounded before they are summed up
VON_MISES, LARGEST, SMALLEST = range(3)


@dataclass(frozen=True, slots=True)
class LinkEnvelope:
    """Extremes over all steps at the points of a link or of a segment of one.

    stress : (3, p) highest von Mises, largest and smallest principal stress [Pa]; of a rigid link nan
    step : (3, p) of each
    when : (2, 3, p) time [s] and position of the drive at each
    """

    link: str
    recovery: StressRecovery
    stress: Float[np.ndarray, "3 p"]
    step: Int[np.ndarray, "3 p"]
    when: Float[np.ndarray, "2 3 p"]


@dataclass(frozen=True, slots=True)
class StressHistory:
    """The stress of a link over some time as a product.

    parts : (p, 6, r) stresses of its modes, as of `links.recovery.stress_modes`
    times : (T,) [s]
    C : (T, r) coordinates of the modes
    """

    parts: Float[np.ndarray, "p 6 r"]
    times: Float[np.ndarray, " T"]
    C: Float[np.ndarray, "T r"]


class Modes:
    """Modes of a link's deformation, found from its steps, and their stresses.

    basis : (r, dn) orthonormal, without rigid motion
    parts : (p, 6, r) as the kernel wants them
    """

    REMEMBERED = ("basis", "parts", "gain")

    def __init__(self, link: Link, recovery: StressRecovery) -> None:
        self.link, self.recovery = link, recovery
        self.rigid = np.linalg.qr(rigid_modes(link))[0].T
        self.basis = np.zeros((0, link.unknowns))
        self.parts = np.zeros((recovery.stressed, 6, 0))
        self.gain = 0.0  # highest stress of a mode, so far

    def coordinates(self, G: Float[np.ndarray, "T k"], highest: float) -> Float[np.ndarray, "T r"]:
        """Coordinates of steps G (T, dn); modes are added until the residual stress is negligible beside the highest."""
        floor = NOTHING * largest_row(G)
        G = G - (G @ self.rigid.T) @ self.rigid
        C = np.zeros((len(G), 0))
        while True:
            new = self.basis[C.shape[1] :]
            added = G @ new.T
            G -= added @ new
            C = np.hstack([C, added])
            size = largest_row(G)
            stress = max(highest, self._stress_of(C[np.argmax((C**2).sum(axis=1))]) if C.size else 0.0)
            allowed = max(floor, EXACT * stress / self.gain if self.gain else 0.0)
            if size <= allowed or len(self.basis) + len(self.rigid) >= self.basis.shape[1]:
                return C
            self._extend(G, allowed)

    def _stress_of(self, c: Float[np.ndarray, " r"]) -> float:
        """Highest von Mises stress at one time."""
        return float(np.sqrt(((self.parts[:, :5] @ c) ** 2).sum(axis=1).max(initial=0.0)))

    def _extend(self, G: Float[np.ndarray, "T k"], allowed: float) -> None:
        """More modes, the principal directions of the residual at some steps."""
        size = (G**2).sum(axis=1)
        even = np.linspace(0, len(G) - 1, min(SOME, len(G))).astype(int)
        some = G[np.union1d(even, np.argsort(size)[-SOME // 2 :])]
        values, vectors = np.linalg.eigh(some @ some.T)
        sizes = np.sqrt(np.maximum(values, 0.0))
        kept = np.flatnonzero(sizes > max(DECADES * sizes[-1], allowed / 2))[::-1]
        kept = kept[: self.basis.shape[1] - len(self.basis) - len(self.rigid)]
        found = vectors[:, kept].T @ some / sizes[kept, None]
        for _ in range(2):
            found = found - (found @ self.rigid.T) @ self.rigid
            found = found - (found @ self.basis.T) @ self.basis
            found = np.linalg.qr(found.T)[0].T
        stress = stress_modes(self.recovery, self.link, found)
        seen = stress[:: 1 + len(stress) // SAMPLE]
        deviator = np.sqrt((seen[:, :5] ** 2).sum(axis=1))
        self.gain = max(self.gain, float((deviator + np.abs(seen[:, 5])).max(initial=0.0)))
        self.basis = np.vstack([self.basis, found])
        self.parts = np.concatenate([self.parts, stress], axis=2)


@dataclass
class Envelope:
    """The highest and lowest stresses of successive blocks of steps, which it only reads.

    model : whose steps they are
    recoveries : per link, then per prescribed rigid link
    since : time [s] before which stresses do not count
    kept_since : time [s] from which on the coordinates of all modes are kept; none if not given
    worst : the instant of the highest stress so far
    examined, evaluated : stresses at a point and a time that were examined, and that all modes were summed up for
    """

    model: Model
    recoveries: Sequence[StressRecovery]
    since: float = -np.inf
    kept_since: float = np.inf
    worst: Snapshot | None = None
    examined: int = 0
    evaluated: int = 0
    _modes: list[Modes | None] = field(default_factory=list, repr=False)
    _stress: list[Float[np.ndarray, "3 p"]] = field(default_factory=list, repr=False)
    _step: list[Int[np.ndarray, "3 p"]] = field(default_factory=list, repr=False)
    _waiting: list[Block] = field(default_factory=list, repr=False)
    _when: list[Float[np.ndarray, "3 T"]] = field(default_factory=list, repr=False)
    _kept: list[list[tuple[int, Float[np.ndarray, "T r"]]]] = field(default_factory=list, repr=False)
    REMEMBERED: ClassVar = (
        "worst", "examined", "evaluated", "_modes", "_stress", "_step", "_waiting", "_when", "_kept",
    )  # fmt: skip

    def __post_init__(self) -> None:
        for link, recovery in zip(self.model.links, self.recoveries, strict=False):
            self._modes.append(None if link.rigid else Modes(link, recovery))
            self._stress.append(np.full((3, recovery.stressed), -np.inf))
            self._step.append(np.zeros((3, recovery.stressed), np.int64))
            self._kept.append([])

    def add(self, block: Block) -> None:
        """Examine a block, together with earlier ones or later."""
        numbers = np.arange(block.step, block.step + len(block), dtype=float)
        self._when.append(np.stack([numbers, block.motion.t, block.motion.phi]))
        first = int(np.searchsorted(block.motion.t, self.since))
        if first == len(block):
            self._forget()
            return
        # what waits may be stored: without multipliers, which know their system
        self._waiting.append(replace(block.part(first, len(block)), multipliers=NONE))
        steps = sum(map(len, self._waiting))
        if steps >= STEPS or 9 * 8 * steps * self.model.unknowns >= WAITING:
            self.flush()

    @property
    def waits(self) -> bool:
        """Whether there are blocks that were not examined."""
        return bool(self._waiting)

    def flush(self) -> None:
        """Examine all blocks that wait."""
        if not self._waiting:
            return
        blocks, self._waiting = self._waiting, []
        before = self._highest()
        early = int(np.searchsorted(np.concatenate([b.motion.t for b in blocks]), self.kept_since))
        for i, modes in enumerate(self._modes):
            if modes is not None:
                G = np.concatenate([block.links[i].g.reshape(len(block), -1) for block in blocks])
                self._examine(i, modes, G, blocks[0].step, early)
        if self._highest() > before or self.worst is None:
            _, step = max(((x[0].max(), k[0][x[0].argmax()]) for x, k in self._stressed()), default=(0.0, 0))
            block = next((b for b in blocks if b.step <= step < b.step + len(b)), blocks[0])
            k = max(0, int(step) - block.step)
            self.worst = block.part(k, k + 1).at(0).copied()
        self._forget()

    def _forget(self) -> None:
        """Drop instants without an extreme, unless histories are kept: a million take 24 MB."""
        if self.kept_since == np.inf:
            wanted = np.unique(np.concatenate([np.zeros(1), *(x.ravel() for x in self._step)]))
            every = np.concatenate(self._when, axis=1)
            self._when = [every[:, np.isin(every[0], wanted)]]

    def _examine(self, i: int, modes: Modes, G: Float[np.ndarray, "T k"], first: int, early: int) -> None:
        from kedfem.results.stresses.envelope_kernel import LEVELS, enveloped, residuals_of

        C = modes.coordinates(G, max(0.0, float(self._stress[i][0].max(initial=0.0))))
        if early < len(C):
            self._kept[i].append((first + early, C[early:].copy()))
        C, parts, m = leading(C, modes.parts)
        residuals = np.zeros((LEVELS, -(-len(C) // 2), m + 1))
        residuals_of(C, m, residuals)
        heads = np.ascontiguousarray(parts[:, :, :m].transpose(0, 2, 1))
        rest = np.sqrt((C[:, m:] ** 2).sum(axis=1))
        examined, full = enveloped(heads, parts, C, rest, residuals, first, self._stress[i], self._step[i])
        self.examined += examined
        self.evaluated += full

    def _stressed(self) -> list[tuple[Float[np.ndarray, "3 p"], Int[np.ndarray, "3 p"]]]:
        every = zip(self._modes, self._stress, self._step, strict=True)
        return [(x, k) for modes, x, k in every if modes is not None]

    def _highest(self) -> float:
        return max((float(x[0].max()) for x, _ in self._stressed()), default=-np.inf)

    def links(self) -> list[LinkEnvelope]:
        """The extremes found, per link or segment, then per prescribed rigid link, at the links' points."""
        self.flush()
        out = []
        names = [*self.model.links, *(prescribed.link for prescribed in self.model.prescribed)]
        for i, (link, recovery) in enumerate(zip(names, self.recoveries, strict=True)):
            points = recovery.points
            if i >= len(self._modes) or self._modes[i] is None:
                nothing = np.full((3, points), np.nan), np.zeros((3, points), int), np.zeros((2, 3, points))
                out.append(LinkEnvelope(link.name, recovery, *nothing))
                continue
            stress = self._stress[i].reshape(3, -1, points)  # both fibres of a planar beam
            chosen = stress.argmax(axis=1)[:, None]
            stress = np.take_along_axis(stress, chosen, 1)[:, 0] * [[1.0], [1.0], [-1.0]]
            step = np.take_along_axis(self._step[i].reshape(3, -1, points), chosen, 1)[:, 0]
            out.append(LinkEnvelope(link.name, recovery, stress, step, self.at(step)))
        return out

    def kept(self, i: int) -> StressHistory | None:
        """The history of a link or segment over the time that is kept; None of one that has no stress."""
        self.flush()
        modes, pieces = self._modes[i], self._kept[i]
        if modes is None or not pieces:
            return None
        r = len(modes.basis)
        steps = np.concatenate([np.arange(first, first + len(C)) for first, C in pieces])
        C = np.concatenate([np.pad(C, ((0, 0), (0, r - C.shape[1]))) for _, C in pieces])
        return StressHistory(modes.parts, self.at(steps)[0], C)

    def at(self, steps: Int[np.ndarray, "..."]) -> Float[np.ndarray, "2 ..."]:
        """Time [s] and position of the drive at steps at which stress is highest, or whose histories are kept."""
        if not self._when:
            return np.zeros((2, *steps.shape))
        known = np.concatenate(self._when, axis=1)
        return np.asarray(known[1:, np.searchsorted(known[0], steps)])

    @property
    def times(self) -> Float[np.ndarray, " T"]:
        """Times of all steps, where histories are kept [s]."""
        return np.asarray(np.concatenate(self._when, axis=1)[1])


def leading(
    C: Float[np.ndarray, "T r"], parts: Float[np.ndarray, "p 6 r"]
) -> tuple[Float[np.ndarray, "T r"], Float[np.ndarray, "p 6 r"], int]:
    """Modes rotated to their principal directions over some steps, sorted by their effect on stress, the largest first.

    Coordinates and stresses of the same steps, and the number of modes that make up all stress but `HEAD` of it.
    """
    seen = parts[:: 1 + len(parts) // SAMPLE]
    gain = np.sqrt((seen**2).sum(axis=(0, 1)))
    if not C.shape[1] or not gain.max() > 0:
        return np.ascontiguousarray(C), np.ascontiguousarray(parts), C.shape[1]
    gain = np.maximum(gain, NOTHING * gain.max())
    _, size, V = np.linalg.svd(C * gain, full_matrices=False)
    if len(V) < len(gain):  # fewer steps than modes
        V = np.vstack([V, np.linalg.svd(V)[2][len(V) :]])
    head = int((size > HEAD * size[0]).sum())
    scale = np.zeros(len(gain))
    scale[: len(size)] = size
    # the others scaled so that the bound of Cauchy and Schwarz is sharp
    unit = np.sqrt(np.maximum(scale, NOTHING * size[0]))
    turned = (parts.reshape(-1, len(gain)) @ (V.T / gain[:, None] * unit)).reshape(parts.shape)
    return np.ascontiguousarray((C * gain) @ V.T / unit), turned, head


def largest_row(G: Float[np.ndarray, "T k"]) -> float:
    """The length of the longest row; 0 without any."""
    return float(np.sqrt((G**2).sum(axis=1).max(initial=0.0)))
