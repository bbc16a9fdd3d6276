"""Plane links: quadrilaterals in plane stress, with a thickness; the forms of `solid` in two dimensions.

The mass is ρ t ∫ N_a N_b dA; four scalar matrices make the stiffness.
"""

import numpy as np
import skfem

from kedfem.arrays import Float
from kedfem.links.record import Link
from kedfem.links.solid import meshed_link
from kedfem.mesh import QuadMesh
from kedfem.scene import Material

QUADRATURE_ORDER = 5  # 3² Gauss points: the area of a distorted element is exact


def plane_basis(mesh: QuadMesh) -> skfem.Basis:
    """Isoparametric function space of a quadrilateral mesh, [KED, eqs. (4a)(4b)], in x and y alone."""
    fem_mesh = skfem.MeshQuad2(np.ascontiguousarray(mesh.points[:, :2].T), np.ascontiguousarray(mesh.cells.T))
    return skfem.Basis(fem_mesh, skfem.ElementQuad2(), intorder=QUADRATURE_ORDER)


def plane_stress(lame: tuple[float, float]) -> tuple[float, float]:
    """The (λ*, μ) with which σ = λ* tr(ε) 1 + 2 μ ε holds in a plane with σ_zz = 0: λ* = 2 μ λ / (λ + 2 μ) [Pa]."""
    lam, mu = lame
    return 2 * mu * lam / (lam + 2 * mu), mu


def plane_link(name: str, mesh: QuadMesh, material: Material, axes: Float[np.ndarray, "3 3"]) -> Link:
    """The record of a plane link, rows (u, v); columns of `axes` are the link axes, the third along z."""
    basis = plane_basis(mesh)
    X = np.column_stack([basis.doflocs.T, np.full(basis.N, mesh.points[0, 2])])
    cells = np.ascontiguousarray(basis.element_dofs.T)  # VTK's order, too
    return meshed_link(
        name, basis, X, material, plane_stress(material.lame()), mesh.thickness, kind="plane", axes=axes, cells=cells,
        cell_type="quad9", method=mesh.method,
    )  # fmt: skip
