"""Deformation of rigid links with co-rotational frames under the forces that they transmit: an error of the step.

It falls with the square of the step, as other errors of the step do, and is included in the estimates of these: in steps
twice as long such links are four times as soft (`dynamics.rigid_links.for_steps`).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from kedfem.accuracy.error_budget import percent
from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.model import Model
from kedfem.links.record import Link, in_space

WARNED = 0.01  # of the largest displacement: a warning unless an accuracy is required
INSTANTS = 256  # of a block that are examined


@dataclass
class RigidLinkCompliance:
    """Largest deformation of each such link so far, and the largest displacement of joints and ends of all links.

    displacement : (L,) largest change of the vector between two of a link's joints or outermost nodes [m]
    moved : largest displacement from the reference position [m]
    """

    model: Model
    displacement: Float[np.ndarray, " L"]
    moved: float = 0.0
    REMEMBERED: ClassVar = ("displacement", "moved")

    def __init__(self, model: Model) -> None:
        self.model, self.displacement = model, np.zeros(len(model.links))
        every = zip(model.links, model.joints, model.step_limits, strict=True) if model.step_limits else ()
        self._places = [
            (joint.weights, joint.nodes) if limit is None else (ends(link, joint), np.arange(link.n))
            for link, joint, limit in every
        ]

    def add(self, block: Block) -> None:
        """Evaluate some time points of a block."""
        some, motion = slice(None, None, max(1, len(block) // INSTANTS)), block.motion
        for k, (weights, nodes) in enumerate(self._places):
            link, body, history = self.model.links[k], self.model.bodies[k], block.links[k]
            if self.model.step_limits[k] is not None:
                x = in_space(link, weights @ history.g[some])
                apart = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
                self.displacement[k] = max(self.displacement[k], float(apart.max(initial=0.0)))
            X = weights @ link.X[nodes]
            rigid = motion.p[some, body, None] + X @ motion.R[some, body].transpose(0, 2, 1) - X
            moved = rigid + in_space(link, weights @ history.u[some][:, nodes])
            self.moved = max(self.moved, float(np.linalg.norm(moved, axis=2).max(initial=0.0)))

    @property
    def relative(self) -> float:
        """The largest deformation of a link, relative to the largest displacement."""
        most = float(self.displacement.max(initial=0.0))
        return most / self.moved if self.moved else 0.0


def ends(link: Link, joint: Attachment) -> Float[np.ndarray, "p n"]:
    """Weights of a rigid link's functions for the displacements of its joints and its outermost nodes [-]."""
    full, dimensions = link.full or link, 2 if link.planar else 3
    nodes = full.X[full.one != 0.0]
    outermost = nodes[np.concatenate([nodes.argmin(axis=0), nodes.argmax(axis=0)])]
    points = np.concatenate([joint.weights @ link.X[joint.nodes], outermost])[:, :dimensions]
    known = np.column_stack([link.one, link.X[:, :dimensions]])
    return np.column_stack([np.ones(len(points)), points]) @ np.linalg.pinv(known)


def compliance_warning(found: RigidLinkCompliance, asked: float | None = None) -> tuple[str, ...]:
    """A warning if rigid links deform by more than the required accuracy, relative to the largest displacement."""
    allowed = WARNED if asked is None else asked
    if found.relative <= allowed:
        return ()
    k = int(found.displacement.argmax())
    limit, name = found.model.step_limits[k], found.model.links[k].name
    if limit is None:
        raise ValueError("no link deforms")
    turned, step = np.degrees(limit.turning * limit.step), limit.step * np.sqrt(allowed / found.relative)
    cause = f"it rotates by up to {turned:.2g} deg in a step" if np.isfinite(turned) else "no drive moves it"
    return (
        f"rigid link {name} deforms by up to {1e3 * found.displacement[k]:.2g} mm, {percent(found.relative)} of the "
        f"largest displacement, under the forces that it transmits: {cause}, and steps of {limit.step:.2g} s allow "
        f"no stiffer link. The deformation falls with the square of the step: take {float(f'{step:.1g}'):g} s or less, "
        "or analysis.extrapolation_levels = 2",
    )
