"""Loads that rotate with bodies with co-rotational frames, by directions of the body where the load acts.

The directions are y_m = R e_m + Σ_a w_ma u_a, e_m in the reference position: for a beam in space the two directions of
the section at the load, for other bodies two or three of the mean deformation, linear in u. Nodal forces are p Qᵀ, with
the rotation Q of Σ y_m ⊗ e_m = Q U, U symmetric, which does not depend on the choice of axes; for a planar beam the
rotation is ψ at the load. A torque fixed in the world is three loads, the couples about the body's axes e_k, times
m · Q e_k.
"""

from collections.abc import Sequence

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.loads import Pattern
from kedfem.dynamics.matrices.dense import Coordinates, work_on
from kedfem.dynamics.system.arrays import FollowerLoads, flat
from kedfem.links.record import Link
from kedfem.vectors import nearest_rotations

Loads = Sequence[Sequence[Pattern]]
Shown = tuple[Float[np.ndarray, "m 3"], Float[np.ndarray, "m n"]]


def own_patterns(loads: Loads) -> list[tuple[int, Pattern]]:
    """All follower loads, with the bodies' numbers."""
    return [(k, load) for k, own in enumerate(loads) for load in own if load.own]


def follower_loads(links: Sequence[Link], parts: Sequence[Coordinates], loads: Loads) -> FollowerLoads:
    """As flat arrays, on the coordinates of all bodies."""
    every, force_at, shown_at = own_patterns(loads), [0], [0]
    drawn, shown, force, axis, fixed = [], [], [], [], []
    for k, load in every:
        link, part = links[k], parts[k]
        e, weights = shown_by(link, load.forces)
        force.append(work_on(part, load.forces))
        of = 2 if link.kind == "beam" else 0
        T = part.T[of] if part.T else np.eye(link.n)
        shown.append((weights[:1] if of else e.T @ weights) @ T)
        drawn.append(e.T @ e)
        about, world = load.share if load.share is not None else (np.zeros(3), np.zeros(3))
        axis.append(about)
        fixed.append(world)
        force_at.append(force_at[-1] + force[-1].size)
        shown_at.append(shown_at[-1] + shown[-1].size)
    return FollowerLoads(
        body=np.array([k for k, _ in every], int), force_at=np.array(force_at), shown_at=np.array(shown_at),
        planar_beam=np.array([links[k].kind == "beam" for k, _ in every], bool),
        drawn=np.array(drawn).reshape(-1, 3, 3), shown=flat(shown),
        force=flat(force), axis=np.array(axis).reshape(-1, 3),
        fixed=np.array(fixed, float).reshape(-1, 3),
    )  # fmt: skip


def rotated_forces(
    link: Link, load: Pattern, R: Float[np.ndarray, "T 3 3"], u: Float[np.ndarray, "T n d"],
    factor: Float[np.ndarray, " T"],
) -> Float[np.ndarray, "T n d"]:  # fmt: skip
    """Nodal forces over time, world components.

    Parameters
    ----------
    R : of the rigid-body motion of its body; u : displacement
    factor : of `Pattern.factor`
    """
    e, weights = shown_by(link, load.forces)
    out = np.zeros_like(u)
    if link.kind == "beam":
        angle = u[:, :, 2] @ weights[0]
        c, s = np.cos(angle), np.sin(angle)
        turn = np.moveaxis(np.array([[c, -s], [s, c]]), 2, 0)
        out[:, :, :2] = load.forces[:, :2] @ (R[:, :2, :2] @ turn).transpose(0, 2, 1)
        out[:, :, 2] = load.forces[:, 2]
        return np.asarray(factor[:, None, None] * out)
    y = e @ R.transpose(0, 2, 1)
    y[:, :, : link.d] += weights @ u
    Q = nearest_rotations(y.transpose(0, 2, 1) @ e)
    if load.share is not None:
        about, world = load.share
        factor = factor * (Q @ about @ world)
    return np.asarray(factor[:, None, None] * (load.forces @ Q[:, : link.d, : link.d].transpose(0, 2, 1)))


def shown_by(link: Link, forces: Float[np.ndarray, "n d"]) -> Shown:
    """Directions in the reference position, and weights of the link's functions on what they move by.

    Raises
    ------
    ValueError
        If the link has no frame of its own.
    """
    if link.fit is None:
        raise ValueError(f"link {link.name} must have a frame of its own")
    s = 2 if link.planar else 3
    if link.rigid:  # its field is affine
        return np.eye(3)[:s], np.linalg.pinv(np.column_stack([link.one, link.X[:, :s]]))[1:]
    if link.kind == "beam":
        share = np.abs(forces[:, :2]).sum(axis=1)
        return np.eye(3)[:1], share[None] / share.sum()
    if link.triples is not None:
        at_stations = (abs(link.triples) @ np.abs(forces).sum(axis=1)).reshape(-1, 3).sum(axis=1)
        share = at_stations / at_stations.sum()
        weights = np.stack([share @ link.triples[m::3].toarray() for m in (1, 2)])
        return weights @ link.X, weights
    return np.eye(3)[:s], np.linalg.solve((link.X.T @ link.fit)[:s, :s].T, link.fit.T[:s])
