"""The state of one segment whose frame follows it, and what the steps count as large or small."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.frames import Followed, frame_force, frames_of, rotation, seen_from, stress_deformation
from kedfem.dynamics.history import LinkHistory
from kedfem.dynamics.ports import port_rotation
from kedfem.dynamics.state import LinkState, Nodal, Rayleigh
from kedfem.links.record import Link, mass_times

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


class NotConverged(Exception):  # noqa: N818 - not a fault yet: such a step is taken in parts
    """A step whose sweeps do not settle.

    taken : time points of the block before it
    histories, state : up to there
    link : name of the link that moves most from sweep to sweep
    """

    def __init__(self, taken: int, histories: list[LinkHistory], state: object, link: str) -> None:
        super().__init__(link)
        self.taken, self.histories, self.state, self.link = taken, histories, state, link


def position(link: Link, u: Float[np.ndarray, "... n d"]) -> Float[np.ndarray, "... n d"]:
    """Position of a segment displaced by u, both in the nominal frame; of a planar beam (x, y, ψ)."""
    X = link.X[:, : link.d]
    return np.asarray((X * [1, 1, 0] if link.kind == "beam" else X) + u)


def mean_orientation(link: Link, u: Nodal, R: Float[np.ndarray, "d d"]) -> Float[np.ndarray, "d d"]:
    """Mean orientation of a segment displaced by u, link to world; R where it keeps the nominal frame."""
    if link.fit is None:
        return R
    return np.asarray(R @ rotation(link, link.fit, position(link, u @ R), 0.0)[0])


def first_state(link: Link, joint: Attachment, damping: Rayleigh, s: LinkState) -> SegmentState:
    """A segment's state at the first time point."""
    y = position(link, s.u @ s.R)
    frames = [seen_from(link, frame, y, s.g1) for frame in frames_of(link)]
    damped = np.zeros((3, *y.shape))
    damped[0] = damping.alpha * (s.Mu @ s.R)
    if damping.alpha and s.g1 is not None:
        damped[1] = damping.alpha * mass_times(link.mass, s.g1)
    f, strain = internal_force(link, y, s.R, frames, damped, damping.beta)
    return SegmentState(
        s.u, s.v, s.a, s.Mu, s.Mv, s.Ma, f, s.F, s.R, tuple(frames), damped,
        port_rotation(joint, s.R) @ s.port_forces, strain,
    )  # fmt: skip


def first_history(link: Link, joint: Attachment, damping: Rayleigh, s: LinkState) -> LinkHistory:
    """The first time point as a history: g and port forces as the frames see them."""
    now, frames = first_state(link, joint, damping, s), frames_of(link)
    R = mean_orientation(link, s.u, s.R)
    g = stress_deformation(link, frames, [x.g for x in now.frames]) if frames else s.g
    forces = port_rotation(joint, R).T @ now.port_forces
    return LinkHistory(
        s.u[None], s.v[None], s.a[None], g[None], R[None], s.F[None], forces[None], np.array([now.strain])
    )


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


def rounding(links: Sequence[Link]) -> float:
    """Square of what counts as a step even where nothing moves, in the norm of the mass: far above rounding."""
    sizes = [float(link.one @ link.m1[:, 0]) * link.size**2 for link in links]
    return float(LEAST**2 * sum(sizes))


def too_far(links: Sequence[Link]) -> float:
    """Square of what no step moves, in the same norm: the links' sizes many times over, where sweeps have run away."""
    return FAR**2 / LEAST**2 * rounding(links)
