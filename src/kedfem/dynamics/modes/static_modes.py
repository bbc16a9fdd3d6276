"""Modes in which a link takes every static deflection that its joints, its frame and its loads give it.

In its frame a link that is at rest, or accelerates as a rigid body, balances K0 g = Σ φ ⊗ a: a vector a each for the
weights φ of its ports and of its frame, for m {1, x, y, z} and for the components of its loads. The solutions of all
balanced sums are few. They do not change, so that a balance on their components is that of the whole link.
"""

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.matrices.substructure import anchored
from kedfem.dynamics.modes.reduction import energy_product
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import mass_orthonormal, rigid_body_functions, rigid_modes

BALANCED = 1e-9  # of unit forces: resultants of fewer directions are rounding
REPEATED = 1e-11  # of the largest: modes below repeat others


def static_modes(link: Link, joint: Attachment, loads: Sequence[Float[np.ndarray, "n d"]]) -> Float[np.ndarray, "n s"]:
    """1, the position, and all components of static deflections.

    Parameters
    ----------
    loads : nodal forces whose components act in any direction

    Raises
    ------
    SolveError
        If K0 is not that of an elastic body.
    """
    g = _deflections(link, _forces(link, joint, loads))
    rigid = mass_orthonormal(link, rigid_body_functions(link))
    S = g.reshape(link.n, -1)
    S = S - rigid @ (rigid.T @ np.asarray(link.mass[0] @ S))
    weight = np.sqrt(energy_product(link).diagonal())[:, None]
    U, size, _ = np.linalg.svd(weight * S, full_matrices=False)
    return np.concatenate([rigid, U[:, size > REPEATED * size.max(initial=0.0)] / weight], axis=1)


def _forces(link: Link, joint: Attachment, loads: Sequence[Float[np.ndarray, "n d"]]) -> Float[np.ndarray, "k c"]:
    """All forces, each of unit size."""
    d, unit = link.d, np.eye(link.d)
    shapes = [np.asarray(link.mass[0] @ link.one), *np.asarray(link.mass[0] @ link.X[:, :d]).T]
    shapes += [each for load in loads for each in load.T]
    out = [port_columns(joint, link.n), *(np.outer(each, e).reshape(-1, 1) for each in shapes for e in unit)]
    if link.fit is not None:  # f is corrected by a × fit
        turns = ((0, 1), (1, 2), (2, 0))[: 1 if d == 2 else 3]
        couples = np.zeros((len(turns), link.n, d))
        for couple, (i, j) in zip(couples, turns, strict=True):
            couple[:, i], couple[:, j] = -link.fit[:, j], link.fit[:, i]
        out.append(couples.reshape(len(turns), -1).T)
    every = np.concatenate(out, axis=1)
    size = np.linalg.norm(every, axis=0)
    return np.asarray(every[:, size > 0] / size[size > 0])


def _deflections(link: Link, forces: Float[np.ndarray, "k c"]) -> Float[np.ndarray, "k b"]:
    """Of all sums of forces in balance, of unit strain energy, about the link's mean rigid motion."""
    factor, anchors, kappa = anchored(link, 0.0, 1.0)
    rigid = rigid_modes(link)
    resultants = np.linalg.qr(rigid)[0].T @ forces
    right = forces @ scipy.linalg.null_space(resultants, rcond=BALANCED)
    E = np.zeros((link.unknowns, len(anchors)))
    E[anchors, np.arange(len(anchors))] = 1.0
    g = factor.solve_many(np.concatenate([right, E], axis=1))
    g, Y = g[:, : right.shape[1]], g[:, right.shape[1] :]
    # what the anchors take is given back: forces in balance need none of it
    g = g + Y @ np.linalg.lstsq(np.diag(1 / kappa) - Y[anchors], g[anchors], rcond=BALANCED)[0]
    M = np.stack([mass_times(link.mass, x.reshape(link.n, link.d)).ravel() for x in rigid.T], axis=1)
    g -= rigid @ np.linalg.solve(rigid.T @ M, M.T @ g)
    G = g.T @ np.asarray(link.K0 @ g)
    return np.asarray(g / np.sqrt(np.diag(G)))
