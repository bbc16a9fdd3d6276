"""Singular positions that an undriven mechanism passes: there rigid links get a kick, and the error is not of order 2.

A drive's path is searched before a run; what nothing drives goes where it goes. So the run's own positions are examined:
the mean frames of the links put into the constraint equations, whose derivatives lose rank where two motions meet, as in
a four-bar with equal links that folds. Links that hardly bend are then held with little leverage: joint forces of a kite
of steel beams, 0.3 and 0.2 m, change by 120 % of their peak between 400 and 800 steps and still by 12 % between 3,200 and
6,400, where its positions change by 1e-6 (measured).
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from kedfem.accuracy.prepared import Prepared
from kedfem.dynamics.history import Block
from kedfem.links.record import in_space
from kedfem.motion.values import Poses, features, jacobian

NEAR = 0.05  # of its largest value: singular value that vanishes at a singular position (others: 0.19 and more, measured)
LOOKED_AT = 32  # of a block's time points at first; all of them around the smallest values
CLOSER = 0.3  # of the largest value so far, below which all are examined


@dataclass
class SingularPasses:
    """The smallest singular value of the constraints that a run comes to, block after block.

    least, when : the value there, and the time [s]
    largest : over the run; the value means nothing by itself
    """

    ready: Prepared
    least: float = np.inf
    when: float = 0.0
    largest: float = 0.0
    _rank: int = field(default=0, repr=False)
    _of: dict[int, int] = field(default_factory=dict, repr=False)
    REMEMBERED: ClassVar = ("least", "when", "largest")

    def __post_init__(self) -> None:
        linkage, model = self.ready.linkage, self.ready.model
        for k, body in enumerate(model.bodies):
            self._of.setdefault(body, k)  # of several segments the first
        free = not len(linkage.drives) and 0 < linkage.mobility < 6 * (len(linkage.bodies) - 1)
        if free and set(self._of) == set(range(1, len(linkage.bodies))):
            self._rank = 6 * (len(linkage.bodies) - 1) - linkage.mobility

    def add(self, block: Block) -> None:
        """The time points of one more block."""
        if not self._rank:
            return
        stride = max(1, len(block) // LOOKED_AT)
        self._look(block, np.arange(0, len(block), stride), stride)

    def _look(self, block: Block, which: np.ndarray, stride: int) -> None:
        values = self._values(block, which)
        self.largest = max(self.largest, float(values.max()))
        k = int(values.argmin())
        if stride > 1 and values[k] < CLOSER * self.largest:
            first, last = max(0, which[k] - stride), min(len(block), which[k] + stride + 1)
            self._look(block, np.arange(first, last), 1)
        elif values[k] < self.least:
            self.least, self.when = float(values[k]), float(block.motion.t[which[k]])

    def _values(self, block: Block, which: np.ndarray) -> Float[np.ndarray, " T"]:
        """The singular value, of the largest one, at some time points."""
        linkage = self.ready.linkage
        near = np.zeros((len(which), len(linkage.rows.angles)))
        f = features(linkage.rows, self._poses(block, which), near)
        J = jacobian(linkage.rows, f, len(linkage.bodies), linkage.size)
        s = np.linalg.svd(J, compute_uv=False)
        return np.asarray(s[:, self._rank - 1] / s[:, 0])

    def _poses(self, block: Block, which: np.ndarray) -> Poses:
        """The mean frames of all bodies; the ground's is in the reference position."""
        model, linkage = self.ready.model, self.ready.linkage
        R = np.tile(np.eye(3), (len(which), len(linkage.bodies), 1, 1))
        p = np.zeros((len(which), len(linkage.bodies), 3))
        for body, k in self._of.items():
            link, history = model.links[k], block.links[k]
            mass = link.m1[:, 0] / float(link.one @ link.m1[:, 0])
            drawn = mass @ link.X - linkage.centre
            d = 2 if link.kind == "beam" else link.d  # its third is the slope
            R[:, body, :d, :d] = history.R[which][:, :d, :d]
            moved = np.einsum("n,tnc->tc", mass, in_space(link, history.u[which]))
            p[:, body] = drawn + moved - R[:, body] @ drawn
        return R, p

    def warnings(self) -> tuple[str, ...]:
        """What a user should know of such a pass."""
        if not self._rank or self.least > NEAR * self.largest:
            return ()
        return (
            f"at {self.when:.4g} s the mechanism comes near a singular position, from where it could move in more ways "
            "than one: rigid links, and links that hardly bend, get a kick there whose size depends on the step: little "
            "decides how they move on; compare with a shorter step, or take damping, or links that bend more",
        )
