"""Planar isoparametric beams: [KED, eqs. (21)(22)], m nodes, m − 1 Gauss points: no shear locking."""

from functools import cache

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.beams.section import Section
from kedfem.links.record import Link, Mass, mass_constants, read_only
from kedfem.scene import Material

CELL_TYPES = {2: "line", 3: "line3"}
LEVEL = 1e-6  # least sine between a chord and `up`


def cell_type(nodes: int) -> str:
    """Name of a line element in meshio, or one of the same form where meshio has none."""
    return CELL_TYPES.get(nodes, f"line{nodes}")


@cache
def parent_nodes(nodes: int) -> Float[np.ndarray, " m"]:
    """Nodes of a line element on [-1, 1], the Lobatto points: ends first, inner nodes in order.

    Interpolation through them is well conditioned for any number of nodes; up to three they are equally spaced.
    """
    within = np.asarray(np.polynomial.legendre.Legendre.basis(nodes - 1).deriv().roots(), float)
    out = np.array([-1.0, 1.0, *(within - within[::-1]) / 2])  # symmetric to the last digit
    read_only(out)
    return out


def parent_weights(nodes: int) -> Float[np.ndarray, " m"]:
    """Lobatto's weights, with which values at the nodes are integrated over [-1, 1]."""
    last = np.polynomial.legendre.Legendre.basis(nodes - 1)
    return np.asarray(2 / (nodes * (nodes - 1) * last(parent_nodes(nodes)) ** 2))


@cache
def _by_legendre(nodes: int) -> Float[np.ndarray, "2 m m"]:
    """Coefficients of N_a and of dN_a/dr by Legendre's polynomials, a column for each function."""
    values = np.linalg.inv(np.polynomial.legendre.legvander(parent_nodes(nodes), nodes - 1))
    slopes = np.zeros_like(values)
    slopes[:-1] = np.polynomial.legendre.legder(values)
    return np.stack([values, slopes])


def shape_functions(r: float, nodes: int) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """N_a(r) and dN_a/dr of a line element on [-1, 1], ends first."""
    N, dN = np.polynomial.legendre.legvander(np.array([r]), nodes - 1)[0] @ _by_legendre(nodes)
    return N, dN


def lagrange(at: float, points: Float[np.ndarray, " q"]) -> Float[np.ndarray, " q"]:
    """Values at a place of the Lagrange polynomials of some points."""
    return np.array([np.prod([(at - q) / (p - q) for q in points if q != p]) for p in points])


def moment_correction(r: float, nodes: int) -> Float[np.ndarray, " q"]:
    """Weights of dM/ds at the q Gauss points in the correction of M at r, divided by det J.

    The correction c P_q(r) vanishes at the Gauss points; its derivative has the highest term of dM/ds, the shear force.
    With it M is exact under a constant force per length, even in elements with two Gauss points.
    """
    q = nodes - 1
    points, weights = np.polynomial.legendre.leggauss(q)
    last, before = (np.polynomial.legendre.Legendre.basis(k) for k in (q, q - 1))
    return np.asarray(last(r) * weights * before(points) / 2)


def nearest_parameter(x: Float[np.ndarray, "m d"], point: Float[np.ndarray, " d"]) -> float:
    """Parent coordinate in [-1, 1] of the point of a line element that is nearest to a point."""
    r = 0.0
    for _ in range(20):
        N, dN = shape_functions(r, len(x))
        tangent = dN @ x
        r = float(np.clip(r + tangent @ (point - N @ x) / (tangent @ tangent), -1, 1))
    return r


def node_places(elements: int, nodes: int) -> Float[np.ndarray, " n"]:
    """Places of the nodes of successive elements of length one."""
    within = (1 + np.sort(parent_nodes(nodes))[:-1]) / 2
    return np.append((np.arange(elements)[:, None] + within).ravel(), elements)


def line_cells(first: Int[np.ndarray, " e"], nodes: int) -> Int[np.ndarray, "e m"]:
    """Elements from the numbers of their first nodes: ends first."""
    return np.asarray(first[:, None] + np.array([0, nodes - 1, *range(1, nodes - 1)]))


def line_pairs(cells: Int[np.ndarray, "e m"]) -> Int[np.ndarray, "p 2"]:
    """Pairs of neighbouring nodes of line elements, by which elements of many nodes are drawn."""
    in_order = cells[:, [0, *range(2, cells.shape[1]), 1]]
    return np.stack([in_order[:, :-1].ravel(), in_order[:, 1:].ravel()], axis=1)


def strain_rows(x: Float[np.ndarray, "m 2"], r: float) -> tuple[Float[np.ndarray, "3 k"], float]:
    """Rows of axial strain ε, shear strain γ and curvature κ over the element's (u, v, ψ), and det J [m].

    ε = t·u_s, γ = n·u_s − ψ, κ = ψ_s with s the arc length, det J = √(x_r² + y_r²), [KED, eq. (22)].
    """
    N, dN = shape_functions(r, len(x))
    tangent = dN @ x
    det_J = float(np.hypot(*tangent))
    t = tangent / det_J
    rows = np.zeros((3, len(x), 3))
    rows[0, :, :2] = np.outer(dN, t) / det_J
    rows[1, :, :2] = np.outer(dN, [-t[1], t[0]]) / det_J
    rows[1, :, 2] = -N
    rows[2, :, 2] = dN / det_J
    return rows.reshape(3, -1), det_J


def tangent_fit(x: Float[np.ndarray, "m 2"], r: float) -> Float[np.ndarray, "m 3"]:
    """Weights of nodes in the rotation of an element's axis at r: Σ x_a ⊗ fit_a = x' ⊗ t, t the undeformed tangent."""
    _, dN = shape_functions(r, len(x))
    tangent = dN @ x
    return np.asarray(np.outer(dN, [*tangent, 0.0]) / (tangent @ tangent))


def element_stiffness(x: Float[np.ndarray, "m 2"], rigidity: Float[np.ndarray, "3"]) -> Float[np.ndarray, "k k"]:
    """Stiffness of one element by reduced integration (m − 1 Gauss points), [KED, eqs. (13)(21)].

    Parameters
    ----------
    rigidity : (EA, κGA, EI) [N, N, N m²]
    """
    K = np.zeros((3 * len(x), 3 * len(x)))
    for r, w in zip(*np.polynomial.legendre.leggauss(len(x) - 1), strict=True):
        B, det_J = strain_rows(x, r)
        K += w * det_J * (B.T * rigidity) @ B
    return K


def element_mass(x: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "m m"]:
    """∫ N_a N_b det J of one element [m], to be multiplied by (ρA, ρA, ρI), [KED, eq. (22)]."""
    m = np.zeros((len(x), len(x)))
    for r, w in zip(*np.polynomial.legendre.leggauss(len(x) + 1), strict=True):
        N, dN = shape_functions(r, len(x))
        m += w * np.hypot(*(dN @ x)) * np.outer(N, N)
    return m


def planar_rigidities(section: Section, material: Material) -> Float[np.ndarray, "3"]:
    """(EA, κGA, E I) [N, N, N m²]."""
    E, G, A = material.youngs_modulus, material.shear_modulus, section.area
    return np.array([E * A, section.shear_coefficient * G * A, E * section.second_moment])


def beam_mesh(
    points: Float[np.ndarray, "p 3"], elements: int, nodes: int
) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, "e m"]]:
    """Nodes and elements along a polyline: the same number of elements on each of its segments.

    A closed polyline has a single node where it ends and begins.
    """
    s = node_places((len(points) - 1) * elements, nodes) / elements
    X = np.stack([np.interp(s, np.arange(len(points)), points[:, k]) for k in range(3)], axis=1)
    cells = line_cells(np.arange(0, len(X) - 1, nodes - 1), nodes)
    return (X[:-1], cells % (len(X) - 1)) if is_closed(points) else (X, cells)


def is_closed(points: Float[np.ndarray, "p 3"]) -> bool:
    """Whether a line ends where it begins."""
    return bool((points[0] == points[-1]).all())


def beam_link(name: str, points: Float[np.ndarray, "p 3"], section: Section, material: Material,
              elements: int = 1, nodes: int = 3) -> Link:  # fmt: skip
    """The record of a planar beam in a plane z = constant, rows (u, v, ψ).

    Parameters
    ----------
    points : (p, 3) corners of its axis in the reference position [m]
    elements : per straight segment
    nodes : per element
    """
    X, cells = beam_mesh(points, elements, nodes)
    rigidity = planar_rigidities(section, material)
    gram = assembled([element_mass(X[c, :2]) for c in cells], cells, len(X))
    K0 = assembled([element_stiffness(X[c, :2], rigidity) for c in cells], dofs(cells), 3 * len(X))
    translation = material.density * section.area * gram
    rotation = material.density * section.second_moment * gram
    mass: Mass = (translation, translation, rotation)
    one = np.ones(len(X))
    m1, mX = mass_constants(mass, one, X * [1, 1, 0])
    read_only(X, one, cells, m1, mX)
    return Link(
        name=name, kind="beam", X=X, one=one, cells=cells, cell_type=cell_type(nodes),
        axes=chord_axes(points), mass=mass, K0=K0, m1=m1, mX=mX, volume=m1[:, 0] / material.density,
        E=material.youngs_modulus, lame=material.lame(), section=section,
    )  # fmt: skip


def chord_axes(points: Float[np.ndarray, "p 3"], up: Float[np.ndarray, "3"] | None = None) -> Float[np.ndarray, "3 3"]:
    """Link axes of a polyline as columns: x from its start to its end, or along the first segment of a closed one; z as
    close as possible to `up`, if given and not along x."""
    axes = line_axes(points[0], points[1 if is_closed(points) else -1])
    level = up is not None and np.linalg.norm(np.cross(up, axes[:, 0])) > LEVEL * np.linalg.norm(up)
    return directions(axes[:, 0], up).T if level else axes


def directions(along: Float[np.ndarray, "3"], up: Float[np.ndarray, "3"] | None) -> Float[np.ndarray, "3 3"]:
    """`section_axes` of a line; as `line_axes` chooses if `up` is None."""
    return line_axes(np.zeros(3), along).T if up is None else section_axes(along / np.linalg.norm(along), up)


def line_axes(start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Link axes as columns: x from start to end, z as close as possible to the world's z, or x if the link is along z."""
    x = (end - start) / np.linalg.norm(end - start)
    return section_axes(x, np.eye(3)[2 if abs(x[2]) < 0.9 else 0]).T


def section_axes(x: Float[np.ndarray, "3"], up: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Unit vectors as rows: along a line, the section's y, and the section's z, as close as possible to `up`."""
    y = np.cross(up, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def dofs(numbers: Int[np.ndarray, "e m"]) -> Int[np.ndarray, "e k"]:
    """Degrees of freedom of elements: three for each function, one function after the other."""
    return (3 * numbers[:, :, None] + np.arange(3)).reshape(len(numbers), 3 * numbers.shape[1])


def assembled(blocks: list[np.ndarray], at: Int[np.ndarray, "e k"], size: int) -> sp.csr_array:
    """The global matrix: element matrices added at their degrees of freedom."""
    if not blocks:
        return sp.csr_array((size, size))
    rows = np.repeat(at, at.shape[1], axis=1).ravel()
    columns = np.tile(at, (1, at.shape[1])).ravel()
    entries = np.concatenate([b.ravel() for b in blocks]), (rows, columns)
    return sp.csr_array(sp.coo_array(entries, shape=(size, size)))
