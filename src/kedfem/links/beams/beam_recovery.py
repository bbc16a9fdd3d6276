"""Stress of a planar beam from the strains at its reduced Gauss points, where they are most accurate.

Within an element the bending moment is the polynomial through its values there, with one more degree from the shear
force, the derivative of the moment: it is exact under a constant force per length.

A probe interpolates the moment at the nearest four Gauss points by a cubic. Its error falls with the third power of the
elements' length, and with the fourth at nodes and half way between them, if the moment is smooth along a straight run of
elements, as under distributed loads. Joints, bodies, forces at a point and ends of forces per length (kinks) end a run.
In elements of more than five nodes the interpolation takes as many points as an element has.
"""

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.beams.beam import (
    lagrange,
    moment_correction,
    nearest_parameter,
    parent_nodes,
    shape_functions,
    strain_rows,
)
from kedfem.links.record import Link, section_of

THROUGH = 4  # Gauss points of a probe at least
STRAIGHT = 1e-9  # sine of the angle between elements of a run
ON_AXIS = 1e-6  # how near to a node or to the axis counts as on it, of an element's length
Points = Float[np.ndarray, "_ 3"]


def nearest_on_beam(link: Link, point: Float[np.ndarray, "3"]) -> tuple[float, int, float, float]:
    """Distance of a point from a beam [m], and the nearest element, parent coordinate and offset to the left of the axis.

    At a node between two elements it is the first of them.
    """
    half = link.section.height / 2 if link.section else 0.0
    found = []
    for e, cell in enumerate(link.cells):
        x = link.X[cell][:, :2]
        r = nearest_parameter(x, point[:2])
        N, dN = shape_functions(r, len(x))
        t, d = dN @ x / np.linalg.norm(dN @ x), point[:2] - N @ x
        offset, gap = float(t[0] * d[1] - t[1] * d[0]), abs(float(t @ d))
        found.append((float(np.hypot(gap, max(0.0, abs(offset) - half))), abs(offset), e, r, offset))
    beyond, _, e, r, offset = min(found)
    return beyond, e, r, offset


def fibre_row(link: Link, element: int, r: float, offset: float, kinks: Points | None = None) -> Float[np.ndarray, " k"]:
    """σ_xx = E (ε − offset κ) of a fibre (3n,): the strains at the nearest Gauss points, interpolated to r.

    Parameters
    ----------
    element, r : place on the axis; interpolation is within the straight run that has this element
    offset : to the left of the axis [m]
    kinks : places of joints, bodies and forces [m]; the element's own Gauss points alone if not given
    """
    run = np.array([element]) if kinks is None else straight_run(link, element, kinks)
    if len(run) == 1:
        return _within(link, element, r, offset)
    start, along = link.X[link.cells[element][0], :2], _side(link, element)
    length = np.linalg.norm(along)
    points = [(int(e), float(q)) for e in run for q in _gauss(link)]
    s = np.array([(_on_axis(link, e, q) - start) @ along for e, q in points]) / length
    at = float((_on_axis(link, element, r) - start) @ along / length)
    through = max(THROUGH, len(_gauss(link)))  # no fewer than the element has itself
    nearest = np.sort(np.argsort(np.abs(s - at), kind="stable")[:through])
    out = np.zeros((link.n, 3))
    for j, w in zip(nearest, lagrange(at, s[nearest]), strict=True):
        e, q = points[j]
        rows = strain_rows(link.X[link.cells[e]][:, :2], q)[0]
        out[link.cells[e]] += w * link.E * (rows[0] - offset * rows[2]).reshape(-1, 3)
    return out.ravel()


def _within(link: Link, element: int, r: float, offset: float) -> Float[np.ndarray, " k"]:
    """`fibre_row` of one element alone: M at its Gauss points, corrected between them by dM/ds = −κGA γ."""
    cell, section = link.cells[element], section_of(link)
    x, gauss = link.X[cell][:, :2], _gauss(link)
    points = [strain_rows(x, float(q)) for q in gauss]
    of_shear = section.shear_coefficient * link.lame[1] * section.area / (link.E * section.second_moment)
    out = np.zeros((link.n, 3))
    for (rows, det_J), w, more in zip(points, lagrange(r, gauss), moment_correction(r, len(cell)), strict=True):
        curvature = w * rows[2] - more * det_J * of_shear * rows[1]
        out[cell] += link.E * (w * rows[0] - offset * curvature).reshape(-1, 3)
    return out.ravel()


def straight_run(link: Link, element: int, kinks: Points) -> Int[np.ndarray, " e"]:
    """The elements of the straight run without kinks that has an element, in order along the axis."""
    within = [_between_ends(link, e, kinks) for e in range(len(link.cells))]
    run = [element]
    for step in (-1, 1):
        e = element
        while 0 <= e + step < len(link.cells) and not within[e] and not within[e + step]:
            if _bent(link, min(e, e + step), kinks):
                break
            e += step
            run.append(e)
    return np.array(sorted(run))


def beam_fibre(link: Link, offset: float) -> tuple[sp.csr_array, sp.csr_array]:
    """(n, 3n): σ_xx of a fibre at every node, in the first and in the last of the elements that meet there.

    They differ where a torque, a weld or a body acts on the axis.
    """
    first, last = np.zeros((link.n, 3 * link.n)), np.zeros((link.n, 3 * link.n))
    met = np.zeros(link.n, bool)
    for e, cell in enumerate(link.cells):
        for a, r in zip(cell, parent_nodes(len(cell)), strict=True):
            last[a] = fibre_row(link, e, r, offset)
            first[a] = first[a] if met[a] else last[a]
            met[a] = True
    return sp.csr_array(first), sp.csr_array(last)


def _gauss(link: Link) -> Float[np.ndarray, " q"]:
    return np.polynomial.legendre.leggauss(link.cells.shape[1] - 1)[0]


def _side(link: Link, element: int) -> Float[np.ndarray, "2"]:
    first, last = link.cells[element][:2]
    return np.asarray(link.X[last, :2] - link.X[first, :2])


def _on_axis(link: Link, element: int, r: float) -> Float[np.ndarray, "2"]:
    cell = link.cells[element]
    return np.asarray(shape_functions(r, len(cell))[0] @ link.X[cell, :2])


def _bent(link: Link, element: int, kinks: Points) -> bool:
    """Whether the axis changes its direction, ends or has a kink between an element and the next."""
    if link.cells[element][1] != link.cells[element + 1][0]:
        return True
    a, b = _side(link, element), _side(link, element + 1)
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    node = link.X[link.cells[element][1], :2]
    near = np.linalg.norm(kinks[:, :2] - node, axis=1) <= ON_AXIS * np.linalg.norm(a)
    return bool(near.any() or abs(a[0] * b[1] - a[1] * b[0]) > STRAIGHT * size or a @ b < 0)


def _between_ends(link: Link, element: int, kinks: Points) -> bool:
    """Whether there is a kink on an element, not at its ends."""
    along, start = _side(link, element), link.X[link.cells[element][0], :2]
    length = float(np.linalg.norm(along))
    d = (kinks[:, :2] - start) / length
    s, beside = d @ along / length, (d[:, 1] * along[0] - d[:, 0] * along[1]) / length
    return bool(np.any((np.abs(beside) <= ON_AXIS) & (s > ON_AXIS) & (s < 1 - ON_AXIS)))
