"""Forces and moments that the ports of a joint exert on a link, block by block."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import rotated_ports
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.forces.exerted import on_ports
from kedfem.dynamics.system.forces.supports import supports
from kedfem.links.record import Link, in_space
from kedfem.results.forces.constraint_forces import ConstraintForces
from kedfem.results.forces.force_elements import ElementForces
from kedfem.results.recorded import Rows, once_per_block
from kedfem.vectors import cross

INDETERMINATE = 1e-6  # [-, m] share of an indeterminate port force of one that a joint would carry


@dataclass(frozen=True, slots=True)
class Forces:
    """Forces besides port forces: of constraint equations, motors and springs."""

    rows: ConstraintForces
    force_elements: ElementForces
    on_ports: Callable[[Block], Rows] = field(default_factory=lambda: once_per_block(lambda x: on_ports(supports(x))))


Wrench = Callable[[Block], tuple[Rows, Rows]]


def port_wrench(model: Model, k: int, joint: str, at: Float[np.ndarray, "3"], forces: Forces) -> Wrench:
    """Force and moment about `at` of one joint on link k, world components, from the port forces that determine them."""
    attachment, link = model.joints[k], model.links[k]
    rows = rows_of_joint(attachment, joint)
    arms, placed = _arms(attachment, joint, at), _arms_over_time(model, k, joint, at)
    shares = list(_sharing(model, attachment.shares[rows]))
    from_rows = attachment.from_rows[rows]

    def wrench(block: Block) -> tuple[Rows, Rows]:
        f = np.zeros((len(block), len(rows)))
        for j, share in shares:
            history = block.links[j]
            f += rotated_ports(model.joints[j], history.R, history.port_forces) @ share.T
        if from_rows.nnz:
            f += forces.on_ports(block) @ from_rows.T
        return resultant(link, placed(block), f.reshape(len(f), len(arms), link.d))

    return wrench


def _sharing(model: Model, shares: sp.csr_array) -> Iterator[tuple[int, Float[np.ndarray, "m q"]]]:
    """Links whose port forces determine some of a link's, and the share of each."""
    ends = np.cumsum([0, *(len(joint.keep) for joint in model.joints)])
    for j in np.unique(np.searchsorted(ends, np.unique(shares.indices), side="right") - 1):
        yield int(j), shares[:, ends[j] : ends[j + 1]].toarray()


def _arms_over_time(
    model: Model, k: int, joint: str, at: Float[np.ndarray, "3"]
) -> Callable[[Block], Float[np.ndarray, "T p 3"]]:
    """Vectors from a joint's point on link k to its ports, world components.

    With rigid-body frames they rotate with the frame. With co-rotational frames ports are displaced from the rigid-body
    motion, and the joint's point with them, so that force and moment do the work of the port forces.
    """
    attachment, link, body = model.joints[k], model.links[k], model.bodies[k]
    here = np.array([name == joint for name in attachment.joints], bool)
    drawn, weights = attachment.points[here], attachment.weights[here]
    centred = np.vstack([np.ones(len(drawn)), (drawn - at).T])
    among = np.linalg.lstsq(centred, np.array([1.0, 0, 0, 0]), rcond=1e-9)[0]
    beside = at - among @ drawn

    def undeformed(block: Block) -> Float[np.ndarray, "T p 3"]:
        return np.asarray((drawn - at) @ _orientation(block, k, link).transpose(0, 2, 1))

    def displaced(block: Block) -> Float[np.ndarray, "T p 3"]:
        u = np.asarray(weights @ block.links[k].u[:, attachment.nodes])
        x = drawn @ block.motion.R[:, body].transpose(0, 2, 1) + in_space(link, u)
        centre = among @ x + _orientation(block, k, link) @ beside
        return np.asarray(x - centre[:, None])

    return undeformed if link.fit is None else displaced


def _orientation(block: Block, k: int, link: Link) -> Float[np.ndarray, "T 3 3"]:
    """Orientation of a link's frame, in space."""
    R = np.tile(np.eye(3), (len(block), 1, 1))
    R[:, : link.d, : link.d] = block.links[k].R
    return R


def determinate(model: Model, k: int, joint: str, at: Float[np.ndarray, "3"]) -> tuple[bool, bool]:
    """Whether statics determine force and moment that a joint exerts on link k, where ports depend on each other."""
    force, moment = indeterminate_part(model, k, joint, at)
    return negligible(force), negligible(force) and negligible(moment)


def indeterminate_part(model: Model, k: int, joint: str, at: Float[np.ndarray, "3"]) -> tuple[Rows, Rows]:
    """Forces and moments of a joint that statics do not determine, in the reference position."""
    attachment = model.joints[k]
    arms, link = _arms(attachment, joint, at), model.links[k]
    f = attachment.loose[rows_of_joint(attachment, joint)].toarray().T
    return resultant(link, arms[None], f.reshape(len(f), len(arms), link.d))


def negligible(indeterminate: Float[np.ndarray, "..."]) -> bool:
    """Whether the indeterminate part of a port force is negligible beside the force that the joint would transmit."""
    return bool(np.abs(indeterminate).max(initial=0.0) < INDETERMINATE)


def rows_of_joint(attachment: Attachment, joint: str) -> Int[np.ndarray, " m"]:
    """All components of all ports of a joint."""
    here = np.flatnonzero([name == joint for name in attachment.joints])
    return (attachment.components * here[:, None] + np.arange(attachment.components)).ravel()


def _arms(attachment: Attachment, joint: str, at: Float[np.ndarray, "3"]) -> Float[np.ndarray, "p 3"]:
    """From a point to the ports of a joint, in the reference position."""
    return np.asarray(attachment.points[[name == joint for name in attachment.joints]] - at)


def resultant(link: Link, arms: Float[np.ndarray, "_ p 3"], f: Float[np.ndarray, "T p d"]) -> tuple[Rows, Rows]:
    """Force and moment of port forces, all in one frame."""
    if link.kind == "beam":  # third component is a moment
        return in_space(link, f).sum(axis=1), f.sum(axis=1) * [0, 0, 1]
    force = in_space(link, f)
    return force.sum(axis=1), cross(arms, force).sum(axis=1)


def link_of_joint(model: Model, name: str, joint: str) -> int:
    """The link of a name, or its segment, that a joint acts on."""
    every = enumerate(zip(model.links, model.joints, strict=True))
    return next(k for k, (link, held) in every if link.name == name and joint in held.joints)
