"""Nodal forces of distributed forces along the axis of a beam, ∫ N_a q ds, for the beam as a whole or its segments."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import SceneError
from kedfem.links.beams.beam import nearest_parameter, shape_functions
from kedfem.links.beams.spatial_recovery import element_frame
from kedfem.links.record import Link, section_of
from kedfem.links.surfaces.missing import shown

NEAR = 1e-3  # of a beam's size: how far from its axis, or from a side of its section, a point may be
SAME = 1e-9  # cosine and sine between neighbours along one side: rounding
Place = tuple[int, float]
"""Number of an element along the beam, and parent coordinate in [-1, 1]."""


@dataclass(frozen=True, slots=True)
class AxisElement:
    """An element of a beam's axis.

    key, link, number : the beam or segment that has it, unreduced, and its number there
    x : (m, 3) its nodes [m]
    """

    key: str
    link: Link
    number: int
    x: Float[np.ndarray, "m 3"]

    @property
    def frame(self) -> Float[np.ndarray, "3 3"]:
        """Tangent and the section's directions at its middle, as rows."""
        along = shape_functions(0.0, len(self.x))[1] @ self.x
        t = along / np.linalg.norm(along)
        if self.link.triples is None:
            return np.array([t, [-t[1], t[0], 0.0], [0.0, 0.0, 1.0]])
        return np.stack([t, *(shape_functions(0.0, len(self.x))[0] @ self.directions.swapaxes(0, 1))])

    @property
    def directions(self) -> Float[np.ndarray, "m 2 3"]:
        """The section's directions at its nodes; of a beam in space."""
        return element_frame(self.link, self.number)[:, 1:]


def axis_elements(parts: Mapping[str, Link]) -> list[AxisElement]:
    """The elements of a beam in order along it, from the beam or from its segments."""
    out = []
    for key, part in parts.items():
        link = part.full or part
        for number, cell in enumerate(link.cells):
            x = link.X[cell] if link.triples is None else element_frame(link, number)[:, 0]
            out.append(AxisElement(key, link, number, x))
    return out


def axis_weights(
    parts: Mapping[str, Link], where: str, between: Sequence[Sequence[float]] | None = None
) -> dict[str, Float[np.ndarray, "n 2"]]:
    """∫ N_a (1 − f) ds and ∫ N_a f ds [m] for a beam's functions, f from 0 to 1 along the loaded part of its axis.

    Parameters
    ----------
    where : how messages name the part, e.g. ``loads.wind.between``
    between : beginning and end of the part, the whole axis if not given; on a closed line in its direction

    Raises
    ------
    SceneError
        If a point is not on the axis.
    """
    along = axis_elements(parts)
    stretches: list[tuple[Place, Place]] = [((0, -1.0), (len(along) - 1, 1.0))]
    turned = False
    if between is not None:
        start, end = (_place(along, f"{where}[{i}]", np.asarray(P, float)) for i, P in enumerate(between))
        turned = end < start and not _closed(along)
        whole = stretches[0]
        stretches = [(end, start)] if turned else [(start, end)]
        if end < start and not turned:
            stretches = [(start, whole[1]), (whole[0], end)]
    found: dict[str, Float[np.ndarray, "s 2"]] = {}
    done = 0.0
    for k, r in _pieces(stretches):
        weights, length = _integrals(along[k], r, done)
        _add(found, along[k], weights)
        done += length
    out = {key: _on_functions(parts[key], weights / [1.0, done]) for key, weights in found.items()}
    return {key: np.stack([w[:, 0] - w[:, 1], w[:, 1]][:: -1 if turned else 1], axis=1) for key, w in out.items()}


def side_forces(parts: Mapping[str, Link], where: str, at: Float[np.ndarray, "3"]) -> dict[str, Float[np.ndarray, "n 3"]]:
    """Nodal forces of a unit pressure on a flat side of a beam, along the straight run of its axis there.

    Parameters
    ----------
    where : how messages name the point
    at : a point of the side, in the reference position [m]

    Raises
    ------
    SceneError
        If it is not on one side of the section.
    """
    along = axis_elements(parts)
    k, r = _nearest(along, at)
    push, width = _side(along[k], where, at, r)
    found: dict[str, Float[np.ndarray, "s 2"]] = {}
    for i in _run(along, k):
        _add(found, along[i], _integrals(along[i], (-1.0, 1.0), 0.0)[0])
    return {key: np.outer(_on_functions(parts[key], w)[:, 0], width * push) for key, w in found.items()}


def _pieces(stretches: Sequence[tuple[Place, Place]]) -> Iterator[tuple[int, tuple[float, float]]]:
    """Elements of stretches of the axis in order, and the range of parent coordinates of each."""
    for (first, start), (last, end) in stretches:
        for k in range(first, last + 1):
            low, high = start if k == first else -1.0, end if k == last else 1.0
            if high > low:
                yield k, (low, high)


def _integrals(of: AxisElement, r: tuple[float, float], done: float) -> tuple[Float[np.ndarray, "m 2"], float]:
    """∫ N ds and ∫ N s ds over a range of an element, s from `done` on; and the length of the range [m]."""
    m = len(of.x)
    points, weights = np.polynomial.legendre.leggauss(m + 2)
    half = (r[1] - r[0]) / 2
    out, length = np.zeros((m, 2)), 0.0
    speed = [float(np.linalg.norm(shape_functions(r[0] + half * (p + 1), m)[1] @ of.x)) for p in points]
    # s at the points: ∫ of the polynomial through the speeds at them
    poly = np.polynomial.legendre.Legendre.fit(points, speed, len(points) - 1, domain=[-1, 1]).integ(lbnd=-1)
    for p, w, v in zip(points, weights, speed, strict=True):
        N = shape_functions(r[0] + half * (p + 1), m)[0]
        out += half * w * v * np.outer(N, [1.0, done + half * float(poly(p))])
        length += half * w * v
    return out, length


def _add(found: dict[str, Float[np.ndarray, "s 2"]], of: AxisElement, weights: Float[np.ndarray, "m 2"]) -> None:
    """Add weights of an element's nodes or stations to those of its beam or segment."""
    stations = of.link.n if of.link.triples is None else of.link.triples.shape[0] // 3
    here = found.setdefault(of.key, np.zeros((stations, 2)))
    np.add.at(here, of.link.cells[of.number], weights)


def _on_functions(part: Link, weights: Float[np.ndarray, "s 2"]) -> Float[np.ndarray, "n 2"]:
    """Weights of a beam's functions, reduced or not, from those of its nodes or stations."""
    full = part.full or part
    if full.triples is not None:
        weights = full.triples[::3].T @ weights
    return np.asarray(weights if part.Q is None else part.Q.T @ weights)


def _nearest(along: Sequence[AxisElement], at: Float[np.ndarray, "3"]) -> Place:
    """The place of an axis nearest to a point; between two elements it is in the first."""
    places = [(k, nearest_parameter(each.x, at)) for k, each in enumerate(along)]
    gaps = [_gap(along, place, at) for place in places]
    return places[int(np.argmin(np.array(gaps) > min(gaps) + SAME * _size(along)))]


def _gap(along: Sequence[AxisElement], place: Place, at: Float[np.ndarray, "3"]) -> float:
    x = along[place[0]].x
    return float(np.linalg.norm(shape_functions(place[1], len(x))[0] @ x - at))


def _size(along: Sequence[AxisElement]) -> float:
    return float(np.ptp(np.concatenate([each.x for each in along]), axis=0).max())


def _closed(along: Sequence[AxisElement]) -> bool:
    return float(np.linalg.norm(along[0].x[0] - along[-1].x[1])) <= SAME * _size(along)


def _place(along: Sequence[AxisElement], where: str, at: Float[np.ndarray, "3"]) -> Place:
    """The place of a point on the axis."""
    place = _nearest(along, at)
    gap = _gap(along, place, at)
    if gap > NEAR * _size(along):
        name = along[0].link.name
        raise SceneError(f"{where}: must lie on the axis of beam '{name}', got {shown(at)}, {gap:.3g} m beside it")
    return place


def _side(of: AxisElement, where: str, at: Float[np.ndarray, "3"], r: float) -> tuple[Float[np.ndarray, "3"], float]:
    """Direction of a pressure on the side at a point, and the width of the side [m]."""
    section, frame = section_of(of.link), of.frame
    d = at - shape_functions(r, len(of.x))[0] @ of.x
    near = NEAR * max(section.height, section.thickness) + 1e-9 * float(np.linalg.norm(at))
    sides = [(d @ frame[1], section.height, frame[1], section.thickness)]
    if of.link.triples is not None and section.kind != "i":
        sides.append((d @ frame[2], section.thickness, frame[2], section.height))
    on = [(n * -np.sign(y), width) for y, extent, n, width in sides if abs(abs(y) - extent / 2) <= near]
    within = all(abs(y) <= extent / 2 + near for y, extent, _, _ in sides) and abs(d @ frame[0]) <= near
    if len(on) != 1 or not within:
        wanted = f"must lie on one flat side along beam '{of.link.name}'"
        got = "one on an edge" if within and len(on) > 1 else "one on none"
        raise SceneError(f"{where}: {wanted} (half of its width or thickness off its axis), got {shown(at)}, {got}")
    return on[0]


def _run(along: Sequence[AxisElement], k: int) -> list[int]:
    """The elements in line with one and with the same directions of the section."""
    count, frame, closed = len(along), along[k].frame, _closed(along)
    out = [k]
    for step in (-1, 1):
        i = k + step
        while len(out) < count and (closed or 0 <= i < count):
            if np.abs(along[i % count].frame - frame).max() > SAME:
                break
            out.append(i % count)
            i += step
    return out
