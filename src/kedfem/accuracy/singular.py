"""Singular positions that an undriven mechanism passes, where rigid links meet impact-like accelerations.

The error of the step is not of order 2 there.

The path of a drive is searched before a run, but an undriven mechanism is known only from the run's own positions. The
mean frames of its links are put into the constraint equations, whose derivatives lose rank where two motions meet, as in
a folding four-bar with equal links. Links that hardly bend are held with little leverage there: joint forces of a kite of
steel beams, 0.3 and 0.2 m, change by 120 % of their peak between 400 and 800 steps and still by 12 % between 3,200 and
6,400, while its positions change by 1e-6 (measured).
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from kedfem.accuracy.prepared import Prepared
from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.links.record import in_space
from kedfem.motion.linkage import resting_poses
from kedfem.motion.parts import Part, parts
from kedfem.motion.values import Poses

NEAR = 0.05  # singular value near a singular position, over its largest one (elsewhere 0.19 and more, measured)
EXAMINED = 32  # time points of a block that are examined first; then all around the smallest values
CLOSER = 0.3  # of the largest value so far, below which all time points are examined


@dataclass
class LoopSingularity:
    """The smallest relative singular value of the constraints of closed loops during a run.

    part, rank : the loops, and the rank of their constraints in the reference position
    least, when : smallest value, and its time [s]
    largest : largest value over the run, with which the smallest is compared
    """

    part: Part
    rank: int
    least: float = np.inf
    when: float = 0.0
    largest: float = 0.0
    REMEMBERED: ClassVar = ("least", "when", "largest")

    @property
    def of_largest(self) -> float:
        """The smallest value relative to the largest; 1 before anything was examined."""
        return self.least / self.largest if self.largest else 1.0

    def add(self, values: Float[np.ndarray, " T"], t: Float[np.ndarray, " T"]) -> None:
        """Include the values at some times."""
        k = int(values.argmin())
        self.largest = max(self.largest, float(values.max()))
        if values[k] < self.least:
            self.least, self.when = float(values[k]), float(t[k])


@dataclass
class SingularPasses:
    """Singular values of closed loops of an undriven mechanism during a run, block after block."""

    ready: Prepared
    loops: list[LoopSingularity] = field(default_factory=list, repr=False)
    _of: dict[int, int] = field(default_factory=dict, repr=False)
    REMEMBERED: ClassVar = ("loops",)

    def __post_init__(self) -> None:
        linkage, model = self.ready.linkage, self.ready.model
        for k, body in enumerate(model.bodies):
            self._of.setdefault(body, k)  # of several segments the first
        if not len(linkage.drives) and set(self._of) == set(range(1, len(linkage.bodies))):
            rest = resting_poses(len(linkage.bodies))
            found = parts(linkage.rows, linkage.joints, len(linkage.bodies))
            every = ((part, part.rank(rest, linkage.size)) for part in found if part.closed)
            self.loops = [LoopSingularity(part, rank) for part, rank in every if rank < part.freedoms]

    def add(self, block: Block) -> None:
        """Examine the time points of a block."""
        if not self.loops:
            return
        stride = max(1, len(block) // EXAMINED)
        which = np.arange(0, len(block), stride)
        poses = self._poses(block, which)
        for loop in self.loops:
            values = self._values(loop, poses)
            loop.add(values, block.motion.t[which])
            k = which[values.argmin()]
            if stride > 1 and values.min() < CLOSER * loop.largest:
                near = np.arange(max(0, k - stride), min(len(block), k + stride + 1))
                loop.add(self._values(loop, self._poses(block, near)), block.motion.t[near])

    def _values(self, loop: LoopSingularity, poses: Poses) -> Float[np.ndarray, " T"]:
        s = np.linalg.svd(loop.part.jacobian(poses, self.ready.linkage.size), compute_uv=False)
        return np.asarray(s[:, loop.rank - 1] / s[:, 0])

    def _poses(self, block: Block, which: np.ndarray) -> Poses:
        """The mean frames of all bodies; that of the ground stays in the reference position."""
        model, linkage = self.ready.model, self.ready.linkage
        R = np.tile(np.eye(3), (len(which), len(linkage.bodies), 1, 1))
        p = np.zeros((len(which), len(linkage.bodies), 3))
        for body, k in self._of.items():
            link, history = model.links[k], block.links[k]
            mass = link.m1[:, 0] / float(link.one @ link.m1[:, 0])
            drawn = mass @ link.X - linkage.centre
            d = 2 if link.kind == "beam" else link.d  # the third component is the slope
            R[:, body, :d, :d] = history.R[which][:, :d, :d]
            moved = np.einsum("n,tnc->tc", mass, in_space(link, history.u[which]))
            p[:, body] = drawn + moved - R[:, body] @ drawn
        return R, p

    @property
    def worst(self) -> LoopSingularity | None:
        """The loops that come nearest to a singular position; None without any."""
        return min(self.loops, key=lambda loop: loop.of_largest, default=None)

    def warnings(self) -> tuple[str, ...]:
        """A warning if the mechanism passes near a singular position."""
        if self.worst is None or self.worst.of_largest > NEAR:
            return ()
        return (
            f"at {self.worst.when:.4g} s the mechanism comes near a singular position, from where it could move "
            "on in several ways: rigid links, and links that hardly bend, get impact-like accelerations there, whose "
            "size depends on the step, and small differences decide how they move on; compare with a shorter step, or "
            "take damping, or links that bend more",
        )
