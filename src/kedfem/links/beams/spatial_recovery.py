"""Displacement weights and stresses of a spatial beam at points of its section, and its surface for pictures."""

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.beams.beam import (
    lagrange,
    line_pairs,
    moment_correction,
    nearest_parameter,
    parent_nodes,
    shape_functions,
)
from kedfem.links.beams.section import Section, outline, torsion_stress
from kedfem.links.beams.spatial_beam import STRAIGHT, rigidities, space_strains
from kedfem.links.record import Link, section_of


def element_frame(link: Link, element: int) -> Float[np.ndarray, "m 3 3"]:
    """Position and the section's directions at an element's nodes."""
    return np.asarray((_triples(link, link.cells[element]) @ link.X).reshape(-1, 3, 3))


def section_value(link: Link, element: int, r: float, y: float, z: float) -> Float[np.ndarray, " n"]:
    """Weights of the displacement of a point of the section: u + y p + z q."""
    N, _ = shape_functions(r, link.cells.shape[1])
    return np.asarray(np.outer(N, [1.0, y, z]).ravel() @ _triples(link, link.cells[element]))


def beam_strains(link: Link, element: int, r: float) -> Float[np.ndarray, "6 k"]:
    """Rows (6, 3n) of (ε, γ1, γ2, κ1, κ2, τ): those of the reduced Gauss points, extended to r.

    In a straight element bending moments between these are corrected by the shear forces, dM1/ds = κ1 GA γ1.
    """
    x = element_frame(link, element)
    gauss = np.polynomial.legendre.leggauss(len(x) - 1)[0]
    points = [space_strains(x, float(p)) for p in gauss]
    rows = sum(w * of for w, (of, _) in zip(lagrange(r, gauss), points, strict=True))
    if np.ptp(x[:, 1:], axis=0).max() < STRAIGHT:
        rigidity = rigidities(section_of(link), link.E, link.lame[1])
        for more, (of, det_J) in zip(moment_correction(r, len(x)), points, strict=True):
            rows[3:5] += more * det_J * (rigidity[1:3] / rigidity[3:5])[:, None, None, None] * of[1:3]
    triples = _triples(link, link.cells[element])
    out = np.einsum("smfc,mfn->snc", rows, triples.reshape(len(x), 3, link.n))
    return np.asarray(out.reshape(6, -1))


def section_stress(link: Link, strains: Float[np.ndarray, "6 k"], y: float, z: float) -> Float[np.ndarray, "3 k"]:
    """Rows of σ_xx = E (ε + y κ1 + z κ2) and of the shear stresses of torsion σ_xy, σ_zx, axes (tangent, n1, n2)."""
    xy, zx = torsion_stress(section_of(link), y, z)
    twist = link.lame[1] * strains[5]
    return np.stack([link.E * (strains[0] + y * strains[3] + z * strains[4]), xy * twist, zx * twist])


def nearest_on_axis(link: Link, point: Float[np.ndarray, "3"]) -> tuple[float, int, float, tuple[float, float]]:
    """Distance of a point from the beam [m], and the nearest element, parent coordinate and (y, z) of its section."""
    found = []
    for e in range(len(link.cells)):
        x = element_frame(link, e)
        r = nearest_parameter(x[:, 0], point)
        N, dN = shape_functions(r, len(x))
        d, t = point - N @ x[:, 0], dN @ x[:, 0] / np.linalg.norm(dN @ x[:, 0])
        y, z = float(d @ (N @ x[:, 1])), float(d @ (N @ x[:, 2]))
        beyond = float(np.hypot(d @ t, _outside_section(section_of(link), y, z)))
        found.append((beyond, np.hypot(y, z), e, r, (y, z)))
    beyond, _, e, r, yz = min(found)
    return beyond, e, r, yz


def section_solid(link: Link) -> tuple[sp.csr_array, tuple[sp.csr_array, ...], Int[np.ndarray, "c 8"]]:
    """The beam as a solid: values of its section's points at all stations, stresses σ_xx, σ_xy, σ_zx, hexahedra."""
    points, quads = outline(section_of(link))
    stations = link.cells.max() + 1
    count = np.bincount(link.cells.ravel(), minlength=stations)
    values = np.zeros((stations, len(points), link.n))
    stress = np.zeros((3, stations, len(points), 3 * link.n))
    for e, cell in enumerate(link.cells):
        for s, r in zip(cell, parent_nodes(len(cell)), strict=True):
            strains = beam_strains(link, e, r)
            for k, (y, z) in enumerate(points):
                values[s, k] = section_value(link, e, r, y, z)
                stress[:, s, k] += section_stress(link, strains, y, z) / count[s]
    pairs = line_pairs(link.cells)
    corners = pairs[:, None, :, None] * len(points) + quads[None, :, None, :]
    matrices = tuple(sp.csr_array(rows.reshape(-1, 3 * link.n)) for rows in stress)
    return sp.csr_array(values.reshape(-1, link.n)), matrices, corners.reshape(-1, 8)


def _triples(link: Link, stations: Int[np.ndarray, " m"]) -> Float[np.ndarray, "k n"]:
    if link.triples is None:
        raise TypeError(f"links.{link.name}: is no spatial beam")
    rows = (3 * stations[:, None] + np.arange(3)).ravel()
    return np.asarray(link.triples[rows].toarray())


def _outside_section(section: Section, y: float, z: float) -> float:
    if section.kind in {"round", "tube"}:
        return max(0.0, float(np.hypot(y, z)) - section.height / 2)
    return float(np.hypot(max(0.0, abs(y) - section.height / 2), max(0.0, abs(z) - section.thickness / 2)))
