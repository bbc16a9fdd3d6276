"""Where one segment is, and its internal force; when the iterations of a step have converged."""

from collections.abc import Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.frames import Deformed, frame_force, frames_of, rotation
from kedfem.dynamics.stepping.state import Nodal
from kedfem.links.record import Link

CONVERGED = 1e-7  # change of a iteration, of the largest that a step has made
FREE = 1e-9  # the same where nothing holds the motion as a whole: what is left of each step adds up in it


def position(link: Link, u: Float[np.ndarray, "... n d"]) -> Float[np.ndarray, "... n d"]:
    """Position of a segment displaced by u, both in the rigid-body frame; of a planar beam (x, y, ψ)."""
    X = link.X[:, : link.d]
    return np.asarray((X * [1, 1, 0] if link.kind == "beam" else X) + u)


def mean_orientation(link: Link, u: Nodal, R: Float[np.ndarray, "d d"]) -> Float[np.ndarray, "d d"]:
    """Mean orientation of a segment displaced by u, link to world; R where it keeps the rigid-body frame."""
    if link.fit is None:
        return R
    return np.asarray(R @ rotation(link, link.fit, position(link, u @ R), 0.0)[0])


def internal_force(
    link: Link,
    y: Nodal,
    R: Float[np.ndarray, "d d"],
    frames: Sequence[Deformed],
    damped: np.ndarray,
    beta: float,
) -> tuple[Nodal, float]:
    """Internal force of a segment with co-rotational frames and damping, world components, and its strain energy.

    Parameters
    ----------
    y : (n, d) position in the rigid-body frame R
    damped : α M δ and its rates there
    """
    found = [
        frame_force(link, frame, now, y, beta) for frame, now in zip(frames_of(link), frames, strict=True)
    ]
    return (sum(f for f, _ in found) + damped[1]) @ R.T, sum(energy for _, energy in found)
