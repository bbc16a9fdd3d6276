"""Stations along a line of a link on which something slides: displacements there, and between them by cubic splines.

A slider that feels the elements' own functions gets a kick whenever it passes a border between two of them, where slopes
jump. A spline through stations is twice continuously differentiable, so that it passes without noticing. In a solid the
displacement of a point under a point force grows without bounds as the mesh is refined; a station is therefore the affine
mean of the material in a ball about it, as wide as the stations are apart.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.links.record import Link

BESIDE = 1e-6  # of the link's size: nodes so far off a line are on it
SPARE = 2  # stations beyond the travel of the slider, where the link has them
FEWEST, MOST = 4, 48
KNOWN = 1e-3  # of the ball: a spread below cannot determine a gradient
APART = 1e-3  # of the largest singular value of stations that move apart: 0.1 of two elements, 2e-6 of one, 1 of beams


@dataclass(frozen=True, slots=True)
class Stations:
    """Stations on a line of a link.

    s : (k,) places along the line from its origin, increasing [m]
    points : (k, 3) the same in the reference position [m]
    weights : (k, n) scalar weights of the displacement at each, u = weights @ state
    """

    s: Float[np.ndarray, " k"]
    points: Float[np.ndarray, "k 3"]
    weights: Float[np.ndarray, "k n"]

    def at(self, s: Float[np.ndarray, " T"], rate: int = 0) -> Float[np.ndarray, "T k"]:
        """Weights of the stations in the displacement at other places: cardinal functions of the cubic spline.

        Parameters
        ----------
        rate : their derivative by s of that order
        """
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(self.s, np.eye(len(self.s)))(s, rate))


def stations(
    link: Link,
    where: str,
    origin: Float[np.ndarray, "3"],
    axis: Float[np.ndarray, "3"],
    travel: tuple[float, float],
) -> Stations:
    """Stations for a slider on a line of a link; each of one that bends can move without the others.

    Parameters
    ----------
    origin, axis : of the line, in the reference position; axis a unit vector
    travel : least and greatest place of the slider along the line [m]

    Raises
    ------
    MeshError
        If the link does not reach along the line as far as the slider goes, or cannot bend there.
    """
    full, rigid = link.full, link.rigid
    if full is None or link.Q is None:
        found = _along_line(link, where, origin, axis, travel)
        return found if rigid or not link.meshed else _apart(link, where, found)
    found = _along_line(full, where, origin, axis, travel)
    if full.meshed and not rigid:
        _apart(full, where, found)
    own = Stations(found.s, found.points, found.weights @ link.Q)
    return own if rigid else _apart(link, where, own)


def _along_line(
    link: Link, where: str, origin: np.ndarray, axis: np.ndarray, travel: tuple[float, float]
) -> Stations:
    return (_in_balls if link.meshed else _at_nodes)(link, where, origin, axis, travel)


def _apart(link: Link, where: str, found: Stations) -> Stations:
    """Stations, each of which can move without the others: what dependent ones bear is rounding."""
    size = np.linalg.svd(found.weights, compute_uv=False)
    determined = int((size > APART * size[0]).sum())
    if determined == len(found.s):
        return found
    instead = (
        "give it more basis functions"
        if link.Q is not None
        else "give it two elements along the line at least"
    )
    raise MeshError(
        f"{where}: link '{link.name}' must be able to bend along its line in {len(found.s)} ways, as many as there are "
        f"stations on it, got {determined}: {instead}"
    )


def _at_nodes(
    link: Link, where: str, origin: np.ndarray, axis: np.ndarray, travel: tuple[float, float]
) -> Stations:
    """Of a beam: its nodes on the line."""
    along, off = _along(link.X, origin, axis)
    on = np.flatnonzero((link.one != 0) & (off <= BESIDE * link.size))
    on = on[np.argsort(along[on])]
    if len(on) < FEWEST:
        raise MeshError(
            f"{where}: its line must run along the axis of beam '{link.name}' over {FEWEST} nodes at least, got "
            f"{len(on)} there: draw it along the beam, or give this more elements"
        )
    _check_travel(link, where, (along[on[0]], along[on[-1]]), travel)
    on = on[_near(along[on], travel)]
    weights = np.zeros((len(on), link.n))
    weights[np.arange(len(on)), on] = 1.0
    return Stations(along[on], link.X[on], weights)


def _in_balls(
    link: Link, where: str, origin: np.ndarray, axis: np.ndarray, travel: tuple[float, float]
) -> Stations:
    """Of a meshed link: means over balls that reach to the next station, as far as the link is wide, or an element long.

    Closer ones would be as good as dependent on each other.
    """
    on = _material(link)
    along, off = _along(on.x, origin, axis)
    width = _width(link, axis)
    near = off <= width
    if not near.any():
        raise MeshError(
            f"{where}: its line must run along link '{link.name}', got one that nowhere comes near it"
        )
    reach = (float(along[near].min()), float(along[near].max()))
    _check_travel(link, where, reach, travel)
    long = np.ptp(link.X[link.cells[near.any(axis=1)]] @ axis, axis=1).mean()
    apart = max(width, float(long))
    low, high = max(reach[0], travel[0] - apart), min(reach[1], travel[1] + apart)
    count = int(np.clip(np.ceil((high - low) / apart) + 1, FEWEST, MOST))
    s = np.linspace(low, high, count)
    points = origin + np.outer(s, axis)
    radius = max(apart, float(s[1] - s[0]))
    weights = np.array([_mean_at(on, link, point, radius) for point in points])
    if not weights.any(axis=1).all():
        gap = points[~weights.any(axis=1)][0]
        raise MeshError(f"{where}: link '{link.name}' must have material along its line, got none at {gap} m")
    return Stations(s, points, weights)


@dataclass(frozen=True, slots=True)
class _Material:
    """Gauss points of a meshed link: x (e, q, 3) [m], dV (e, q), N (e, q, m), dofs (e, m)."""

    x: Float[np.ndarray, "e q 3"]
    dV: Float[np.ndarray, "e q"]
    N: Float[np.ndarray, "e q m"]
    dofs: Int[np.ndarray, "e m"]


def _material(link: Link) -> _Material:
    basis = link.basis
    dofs, dV = np.asarray(basis.element_dofs).T, np.asarray(basis.dx)
    N = np.stack([np.broadcast_to(np.asarray(f[0]), dV.shape) for f in basis.basis], axis=2)
    return _Material(np.einsum("eqm,emk->eqk", N, link.X[dofs]), dV, N, dofs)


def _mean_at(on: _Material, link: Link, point: np.ndarray, radius: float) -> Float[np.ndarray, " n"]:
    """Weights of the value at a point of the affine field that fits the material in a ball about it best."""
    share = on.dV * np.clip(1 - (np.linalg.norm(on.x - point, axis=2) / radius) ** 2, 0, None) ** 2
    cells = np.flatnonzero(share.any(axis=1))
    if not len(cells):
        return np.zeros(link.n)
    share, r = share[cells], (on.x[cells] - point)[:, :, : link.d] / radius
    phi = np.concatenate([np.ones((*share.shape, 1)), r], axis=2)
    G = np.einsum("eqi,eqj,eq->ij", phi, phi, share)
    coefficients = np.linalg.pinv(G / G[0, 0], rcond=KNOWN**2, hermitian=True)[0] / G[0, 0]
    local = np.einsum("i,eqi,eq,eqm->em", coefficients, phi, share, on.N[cells])
    return np.bincount(on.dofs[cells].ravel(), weights=local.ravel(), minlength=link.n)


def _width(link: Link, axis: np.ndarray) -> float:
    """The link's width across a line: that of a bar whose nodes spread as much."""
    X = link.nodes - link.nodes.mean(axis=0)
    across = X - np.outer(X @ axis, axis)
    return float(np.sqrt(12) * np.linalg.svd(across / np.sqrt(len(X)), compute_uv=False)[0])


def _along(
    x: Float[np.ndarray, "... 3"], origin: np.ndarray, axis: np.ndarray
) -> tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]:
    """Places along a line and distances from it."""
    s = (x - origin) @ axis
    return s, np.linalg.norm(x - origin - s[..., None] * axis, axis=-1)


def _near(s: Float[np.ndarray, " k"], travel: tuple[float, float]) -> slice:
    """The stations that a slider meets, and a few beyond."""
    first = max(int(np.searchsorted(s, travel[0], "right")) - 1 - SPARE, 0)
    end = min(int(np.searchsorted(s, travel[1], "left")) + 1 + SPARE, len(s))
    first = max(min(first, end - FEWEST), 0)
    return slice(first, max(end, first + FEWEST))


def _check_travel(link: Link, where: str, reach: tuple[float, float], travel: tuple[float, float]) -> None:
    slack = BESIDE * link.size
    if travel[0] < reach[0] - slack or travel[1] > reach[1] + slack:
        raise MeshError(
            f"{where}: the pin must stay on link '{link.name}', which reaches from {reach[0]:.6g} to {reach[1]:.6g} m "
            f"along the line, got a travel from {travel[0]:.6g} to {travel[1]:.6g} m"
        )
