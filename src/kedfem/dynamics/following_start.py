"""Deflections without vibration at the start of links whose frames follow: the static balance, swept as steps are."""

from collections.abc import Sequence

import numpy as np

from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.frames import frames_of, seen_from
from kedfem.dynamics.held import HeldPart, held_part, interface_factor, solved
from kedfem.dynamics.mixing import Mixing
from kedfem.dynamics.ports import port_rotation
from kedfem.dynamics.segment import internal_force, mean_orientation, position
from kedfem.dynamics.start import Instant
from kedfem.dynamics.state import Nodal, NodalOf, Rayleigh
from kedfem.errors import SolveError
from kedfem.links.record import Link, mass_times

SWEEPS = 60
SETTLED = 1e-9  # change of a sweep, of the deflection
ROUNDING = 1e-11  # the same, of the links' size


def far_deflected(
    links: Sequence[Link],
    joints: Sequence[Attachment],
    instants: Sequence[Instant],
    start: Sequence[Sequence[NodalOf]],
) -> list[list[NodalOf]]:
    """Deflections of any size that turn with their links without vibrating: f(δ) = P − M R0'' − M ([α]× + [ω]×²) δ.

    Parameters
    ----------
    start : per instant, per link (n, d) δ of the linear equation, world components, to begin from

    Returns
    -------
    per instant, per link (n, d), world components

    Raises
    ------
    SolveError
        If the sweeps do not settle.
    """
    parts = [held_part(link, joint, 0.0, 1.0) for link, joint in zip(links, joints, strict=True)]
    return [_balanced(links, joints, parts, at, list(u)) for at, u in zip(instants, start, strict=True)]


def excess(link: Link, damping: Rayleigh, u: Nodal, g1: Nodal, R: NodalOf) -> Nodal:
    """What the internal force of a moving deflection has beside K0 g + β K0 g', nominal frame [N]."""
    g, y = u @ R, position(link, u @ R)
    frames = [seen_from(link, frame, y, g1) for frame in frames_of(link)]
    f, _ = internal_force(link, y, R, frames, np.zeros((3, *y.shape)), damping.beta)
    linear = g + damping.beta * g1 if link.fit is not None else g
    return np.asarray(f @ R - (link.K0 @ linear.ravel()).reshape(g.shape))


def _balanced(
    links: Sequence[Link],
    joints: Sequence[Attachment],
    parts: Sequence[HeldPart],
    instant: Instant,
    u: list[NodalOf],
) -> list[NodalOf]:
    mixing, least = Mixing(), ROUNDING * max(link.size for link in links)
    ends = np.cumsum([x.size for x in u])[:-1]
    for _ in range(SWEEPS):
        R = [mean_orientation(link, x, now.R) for link, x, now in zip(links, u, instant.at, strict=True)]
        rhs = [
            (now.F - mass_times(link.mass, x @ S.T) - _internal(link, x, now.R)[0]) @ r
            for link, x, now, S, r in zip(links, u, instant.at, instant.spin, R, strict=True)
        ]
        RB = [port_rotation(joint, r).T @ joint.B for joint, r in zip(joints, R, strict=True)]
        factor = interface_factor(parts, RB)
        change = [x @ r.T for x, r in zip(solved(parts, rhs, RB, factor)[0], R, strict=True)]
        taken = mixing.step(np.concatenate([x.ravel() for x in change]))
        u = [x + y.reshape(x.shape) for x, y in zip(u, np.split(taken, ends), strict=True)]
        if max(np.abs(x).max() for x in change) <= max(SETTLED * max(np.abs(x).max() for x in u), least):
            return u
    raise SolveError(
        'analysis.initial: must be a deflection that can be found, got none that settles: take initial = "rest"'
    )


def _internal(link: Link, u: Nodal, R: NodalOf) -> tuple[Nodal, float]:
    """Internal force of a segment that stands still in its frames, world components, and its strain energy."""
    y = position(link, u @ R)
    frames = [seen_from(link, frame, y) for frame in frames_of(link)]
    return internal_force(link, y, R, frames, np.zeros((3, *y.shape)), 0.0)
