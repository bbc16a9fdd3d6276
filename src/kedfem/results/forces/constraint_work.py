"""Energy that springs and dampers of joints store and take: bushings, shafts of drives."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.constraint_matrices import JointRows, joint_rows
from kedfem.dynamics.model import Model


@dataclass(frozen=True, slots=True)
class ConstraintWork:
    """Over a block of T time points.

    stored : (T,) ½ Σ k e² [J]
    dissipated : (T,) in the step that ends there, Σ c (Δe)²/h [J]
    pushed : (T,) work of springs and dampers on their links in that step, as their deflection changes [J]
    last : e and force of each at the end
    """

    stored: Float[np.ndarray, " T"]
    dissipated: Float[np.ndarray, " T"]
    pushed: Float[np.ndarray, " T"]
    last: tuple[float, Float[np.ndarray, " s"], Float[np.ndarray, " s"]]


def row_work(
    model: Model, block: Block, mu: Float[np.ndarray, "T r"],
    before: tuple[float, Float[np.ndarray, " s"], Float[np.ndarray, " s"]] | None,
) -> ConstraintWork | None:  # fmt: skip
    """Of all springs in joints; None without any.

    Parameters
    ----------
    mu : forces of all rows, where the block does not know what springs exert
    before : time, e and forces at the end of the block before
    """
    found = _springs(model, block, mu)
    if found is None:
        return None
    (e, force, k, c), t = found, block.motion.t
    t0, e0, f0 = before or (float(t[0]), e[0], force[0])
    change = np.diff(e, axis=0, prepend=e0[None])
    h = np.diff(t, prepend=t0)
    mean = 0.5 * (force + np.vstack([f0[None], force[:-1]]))
    return ConstraintWork(
        0.5 * (e**2) @ k, (change**2) @ c / np.where(h > 0, h, np.inf), (mean * change).sum(axis=1),
        (float(t[-1]), e[-1], force[-1]),
    )  # fmt: skip


def _springs(model: Model, block: Block, mu: Float[np.ndarray, "T r"]) -> tuple[np.ndarray, ...] | None:
    """Deflections and forces (T, s) of springs in joints, and their stiffness and damping; None without any."""
    if block.exerted is not None:
        of = block.exerted
        return (of.spring[:, 0], of.spring[:, 1], of.stiffness, of.damping) if len(of.stiffness) else None
    rows = joint_rows(model.rows, block.motion)
    if rows is None or not rows.soft.any():
        return None
    soft = rows.soft
    return deflections(model, block, rows)[:, soft], mu[:, soft], rows.stiffness[soft], rows.damping[soft]


def deflections(model: Model, block: Block, rows: JointRows) -> Float[np.ndarray, "T r"]:
    """e = C z over time."""
    return np.asarray(np.einsum("trk,tk->tr", rows.C, interface(model, block)))


def interface(model: Model, block: Block) -> Float[np.ndarray, "T k"]:
    """Interface unknowns z over time, from the displacements at all ports."""
    w = [
        (joint.weights @ history.u[:, joint.nodes]).reshape(len(block), -1)[:, joint.keep]
        for joint, history in zip(model.joints, block.links, strict=True)
    ]
    return np.asarray(
        np.concatenate(w, axis=1) @ np.linalg.pinv(np.vstack([joint.B for joint in model.joints])).T
    )
