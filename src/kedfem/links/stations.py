"""Stations along a line of a link on which a joint slides, with cubic splines of the displacements between them.

Slopes of the shape functions jump between elements, which would accelerate a slider like an impact; a spline is twice
continuously differentiable. In a solid the displacement under a point force diverges as the mesh is refined; the
displacement of a station is therefore an affine mean over a ball whose radius is the distance between stations.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.links.beams.of_scene import FEWEST
from kedfem.links.record import Link

BESIDE = 1e-6  # of the link's size: nodes closer to a line are on it
SPARE = 2  # stations beyond the travel of the slider, where the link has them
MOST = 48
FAR = 10  # lengths of a rigid link without a shape, by which its stations extend beyond its joints
# relative: differences by rounding, as between the lengths of elements and the distance of stations, or at a cut
SAME = 1e-6
KNOWN = 1e-3  # of the ball: a smaller spread determines no gradient
Directed = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]
"""Origin and axis of a line."""
INDEPENDENT = 1e-3  # of the largest singular value of stations: 0.1 with two elements, 2e-6 with one, 1 of beams


@dataclass(frozen=True, slots=True)
class Stations:
    """Stations on a line of a link.

    s : (k,) places along the line from its origin, increasing [m]
    points : (k, 3) the same in the reference position [m]
    weights : (n,) for each station, of its displacement: u = weights @ state of its segment
    keys : segment of each station
    """

    s: Float[np.ndarray, " k"]
    points: Float[np.ndarray, "k 3"]
    weights: tuple[Float[np.ndarray, " _"], ...]
    keys: tuple[str, ...]

    def covers(self, s: float) -> bool:
        """Whether a place is between the first and the last station."""
        slack = BESIDE * float(np.ptp(self.s))
        return bool(self.s[0] - slack <= s <= self.s[-1] + slack)

    def at(self, s: Float[np.ndarray, " T"], rate: int = 0) -> Float[np.ndarray, "T k"]:
        """Weights of the stations in the displacement at other places: cardinal functions of the cubic spline,
        extrapolated linearly beyond its ends.

        Parameters
        ----------
        rate : order of the derivative by s
        """
        from scipy.interpolate import CubicSpline

        spline = CubicSpline(self.s, np.eye(len(self.s)))
        inside = np.clip(s, self.s[0], self.s[-1])
        beyond = (s - inside)[:, None]
        if rate > 1:
            return np.where(beyond == 0, spline(inside, rate), 0.0)
        return np.asarray(spline(inside, rate) + (beyond * spline(inside, 1) if rate == 0 else 0.0))


def stations(
    parts: Mapping[str, Link],
    where: str,
    line: Directed,
    travel: tuple[float, float],
    whole: bool = False,
    endless: bool = False,
) -> Stations:
    """Stations for a slider on a line of a link; on an elastic link their displacements are independent.

    Parameters
    ----------
    parts : the link's segments by their keys, or the link alone
    line : origin and axis of the line, in the reference position; axis a unit vector
    travel : least and greatest place of the slider along the line [m]
    whole : whether stations extend along all of the link, as the slider may move anywhere
    endless : whether a rigid link has no ends, as it has no shape

    Raises
    ------
    MeshError
        If the link does not extend along the slider's travel, or has too few deflections there.
    """
    full = {key: link if link.full is None or link.Q is None else link.full for key, link in parts.items()}
    meshed = next(iter(full.values())).meshed
    if not meshed and all(link.rigid for link in parts.values()):
        found = _between_nodes(full, where, line, travel, endless)
    else:
        found = (_in_balls if meshed else _at_nodes)(full, where, line, travel, whole)
    weights = list(found.weights)
    for key, link in parts.items():
        here = [k for k, each in enumerate(found.keys) if each == key]
        if meshed and not link.rigid:
            _check_independent(full[key], where, [weights[k] for k in here])
        if full[key] is not link:
            for k in here:
                weights[k] = weights[k] @ link.Q
            if not link.rigid:
                _check_independent(link, where, [weights[k] for k in here])
    return replace(found, weights=tuple(weights))


def _check_independent(link: Link, where: str, weights: list[Float[np.ndarray, " n"]]) -> None:
    """Refuse stations whose displacements depend on each other, between which forces are indeterminate."""
    if not weights:
        return
    size = np.linalg.svd(np.array(weights), compute_uv=False)
    determined = int((size > INDEPENDENT * size[0]).sum())
    if determined == len(weights):
        return
    more = "more basis functions" if link.Q is not None else "two elements along the line at least"
    raise MeshError(
        f"{where}: link '{link.name}' must have {len(weights)} independent deflections along its line, as many as there "
        f"are stations on it, got {determined}: give it {more}"
    )


def _at_nodes(
    parts: Mapping[str, Link], where: str, line: Directed, travel: tuple[float, float], whole: bool
) -> Stations:
    """Stations at the nodes of a beam on the line, of all its segments."""
    found, name, size = _nodes(parts, line), next(iter(parts.values())).name, _size(parts)
    if len(found) < FEWEST:
        raise MeshError(
            f"{where}: its line must run along the axis of beam '{name}' over {FEWEST} nodes at least, got "
            f"{len(found)} there: give a line along the beam, or the beam more elements, links.{name}.mesh.elements"
        )
    s = np.array([x[0] for x in found])
    _check_travel(where, name, (s[0], s[-1]), travel, BESIDE * size)
    every = np.unique(np.linspace(0, len(s) - 1, min(len(s), MOST)).round().astype(int))
    kept = every if whole else np.arange(len(s))[_near(s, travel)]
    on_link = [found[k][1:] for k in kept]
    weights = tuple(np.eye(1, parts[key].n, n)[0] for key, n in on_link)
    X = np.array([parts[key].X[n] for key, n in on_link])
    return Stations(s[kept], X, weights, tuple(key for key, _ in on_link))


def _between_nodes(
    parts: Mapping[str, Link], where: str, line: Directed, travel: tuple[float, float], endless: bool
) -> Stations:
    """Stations of a rigid line anywhere: two of its nodes determine all displacements."""
    found, name, size = _nodes(parts, line), next(iter(parts.values())).name, _size(parts)
    if len(found) < 2:
        wanted = f"the line of a slot must run along the axis of the rigid line '{name}'"
        raise MeshError(f"{where}: {wanted}, got {len(found)} of its nodes there: give a line along it")
    (first, key, one), (last, other, two) = found[0], found[-1]
    if endless:
        reach = (min(first, travel[0]) - FAR * size, max(last, travel[1]) + FAR * size)
    else:
        reach = (first, last)
        _check_travel(where, name, reach, travel, BESIDE * size)
    s, axis = np.linspace(*reach, FEWEST), line[1]
    share = (s - first) / (last - first)
    ends = np.eye(1, parts[key].n, one)[0], np.eye(1, parts[other].n, two)[0]
    weights = tuple((1.0 - part) * ends[0] + part * ends[1] for part in share)
    return Stations(s, parts[key].X[one] + np.outer(s - first, axis), weights, (key,) * FEWEST)


def _nodes(parts: Mapping[str, Link], line: Directed) -> list[tuple[float, str, int]]:
    """Nodes of a beam on a line, increasing: place along it [m], key of the segment, number there."""
    found: list[tuple[float, str, int]] = []
    for key, link in parts.items():
        along, off = _along(link.X, *line)
        on = np.flatnonzero((link.one != 0) & (off <= BESIDE * link.size))
        found += [(float(along[n]), key, int(n)) for n in on]
    found.sort()
    return [x for k, x in enumerate(found) if k == 0 or x[0] - found[k - 1][0] > BESIDE * _size(parts)]


def _size(parts: Mapping[str, Link]) -> float:
    """Size of the largest segment [m]."""
    return max(link.size for link in parts.values())


def _in_balls(
    parts: Mapping[str, Link], where: str, line: Directed, travel: tuple[float, float], whole: bool
) -> Stations:
    """Stations of a meshed link: means over balls that extend to the next station, and at least over the link's width or
    an element's length, as closer ones are nearly dependent. Each is a mean over the segment with most of its ball.
    """
    origin, axis = line
    on = {key: _material(link) for key, link in parts.items()}
    width, links = _width(np.concatenate([link.nodes for link in parts.values()]), axis), list(parts.values())
    reached, longs = [], []
    for key, link in parts.items():
        near = (_along(on[key].x, origin, axis)[1] <= width).any(axis=1)
        if near.any():
            corners = (link.X[link.cells[near]] - origin) @ axis
            reached += [corners.min(), corners.max()]
            longs.append(np.ptp(corners, axis=1))
    if not reached:
        got = "got one that is nowhere near it"
        raise MeshError(f"{where}: its line must run along link '{links[0].name}', {got}")
    reach = (float(min(reached)), float(max(reached)))
    _check_travel(where, links[0].name, reach, travel, BESIDE * max(link.size for link in links))
    apart = max(width, float(np.concatenate(longs).mean()))
    low, high = reach if whole else (max(reach[0], travel[0] - apart), min(reach[1], travel[1] + apart))
    count = int(np.clip(np.ceil((high - low) / apart - SAME) + 1, FEWEST, MOST))
    s = np.linspace(low, high, count)
    points = origin + np.outer(s, axis)
    radius = max(apart, float(s[1] - s[0]))
    keys, weights = [], []
    for point in points:
        shares = {key: float(_share(each, point, radius).sum()) for key, each in on.items()}
        keys.append(next(key for key, share in shares.items() if share >= (1 - SAME) * max(shares.values())))
        weights.append(_mean_at(on[keys[-1]], parts[keys[-1]], point, radius))
    gaps = [point for point, each in zip(points, weights, strict=True) if not each.any()]
    if gaps:
        got = f"got none at {gaps[0]} m"
        raise MeshError(f"{where}: link '{links[0].name}' must have material along its line, {got}")
    return Stations(s, points, tuple(weights), tuple(keys))


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
    """Weights of the value at a point of the affine field that best fits the displacement in a ball about it."""
    share = _share(on, point, radius)
    cells = np.flatnonzero(share.any(axis=1))
    if not len(cells):
        return np.zeros(link.n)
    share, r = share[cells], (on.x[cells] - point)[:, :, : link.d] / radius
    phi = np.concatenate([np.ones((*share.shape, 1)), r], axis=2)
    G = np.einsum("eqi,eqj,eq->ij", phi, phi, share)
    coefficients = np.linalg.pinv(G / G[0, 0], rcond=KNOWN**2, hermitian=True)[0] / G[0, 0]
    local = np.einsum("i,eqi,eq,eqm->em", coefficients, phi, share, on.N[cells])
    return np.bincount(on.dofs[cells].ravel(), weights=local.ravel(), minlength=link.n)


def _share(on: _Material, point: np.ndarray, radius: float) -> Float[np.ndarray, "e q"]:
    """Volumes of Gauss points, with weights that decrease from a point to zero at a radius."""
    away = np.linalg.norm(on.x - point, axis=2) / radius
    return np.asarray(on.dV * np.clip(1 - away**2, 0, None) ** 2)


def _width(nodes: Float[np.ndarray, "n 3"], axis: np.ndarray) -> float:
    """A link's width across a line: that of a bar with the same spread of nodes."""
    X = nodes - nodes.mean(axis=0)
    across = X - np.outer(X @ axis, axis)
    return float(np.sqrt(12) * np.linalg.svd(across / np.sqrt(len(X)), compute_uv=False)[0])


def _along(
    x: Float[np.ndarray, "... 3"], origin: np.ndarray, axis: np.ndarray
) -> tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]:
    """Places along a line and distances from it."""
    s = (x - origin) @ axis
    return s, np.linalg.norm(x - origin - s[..., None] * axis, axis=-1)


def _near(s: Float[np.ndarray, " k"], travel: tuple[float, float]) -> slice:
    """The stations within a slider's travel, and a few beyond."""
    first = max(int(np.searchsorted(s, travel[0], "right")) - 1 - SPARE, 0)
    end = min(int(np.searchsorted(s, travel[1], "left")) + 1 + SPARE, len(s))
    first = max(min(first, end - FEWEST), 0)
    return slice(first, max(end, first + FEWEST))


def _check_travel(where: str, name: str, reach: tuple[float, float], travel: tuple[float, float], slack: float) -> None:
    if travel[0] < reach[0] - slack or travel[1] > reach[1] + slack:
        raise MeshError(
            f"{where}: the pin must stay on link '{name}', which reaches from {reach[0]:.6g} to {reach[1]:.6g} m "
            f"along the line, got a travel from {travel[0]:.6g} to {travel[1]:.6g} m"
        )
