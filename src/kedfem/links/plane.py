"""Plane links: quadrilaterals in plane stress, with a thickness; the forms of `solid` in two dimensions.

Mass is ρ t ∫ N_a N_b dA, the stiffness made of four scalar matrices: there is no third dimension.
"""

import numpy as np
import skfem
from jaxtyping import Float

from kedfem.links.record import Link, Mass, mass_constants, read_only
from kedfem.links.solid import elastic_stiffness, gradient_products, pattern, scalar_mass
from kedfem.mesh import QuadMesh
from kedfem.scene import Material

QUADRATURE_ORDER = 5  # 3² Gauss points: the area of a distorted element is exact


def plane_basis(mesh: QuadMesh) -> skfem.Basis:
    """Isoparametric function space of a quadrilateral mesh, [KED, eqs. (4a)(4b)], in x and y alone.

    Parameters
    ----------
    mesh : 9-node quadrilaterals [m]
    """
    fem_mesh = skfem.MeshQuad2(np.ascontiguousarray(mesh.points[:, :2].T), np.ascontiguousarray(mesh.cells.T))
    return skfem.Basis(fem_mesh, skfem.ElementQuad2(), intorder=QUADRATURE_ORDER)


def plane_stress(lame: tuple[float, float]) -> tuple[float, float]:
    """The (λ*, μ) with which σ = λ* tr(ε) 1 + 2 μ ε holds in a plane with σ_zz = 0: λ* = 2 μ λ / (λ + 2 μ) [Pa]."""
    lam, mu = lame
    return 2 * mu * lam / (lam + 2 * mu), mu


def plane_link(name: str, mesh: QuadMesh, material: Material, axes: Float[np.ndarray, "3 3"]) -> Link:
    """The record of a plane link, rows (u, v).

    Parameters
    ----------
    name : key of the link in the scene
    mesh : quadrilaterals in the reference position
    material : ρ, E, ν
    axes : (3, 3) columns are the link axes, the third along z
    """
    basis, t = plane_basis(mesh), mesh.thickness
    on = pattern(basis)
    m = scalar_mass(basis, on, material.density * t)
    mass: Mass = (m, m)
    lam, mu = plane_stress(material.lame())
    X = np.column_stack([basis.doflocs.T, np.full(basis.N, mesh.points[0, 2])])
    one, cells = np.ones(len(X)), np.ascontiguousarray(basis.element_dofs.T)  # VTK's order, too
    m1, mX = mass_constants(mass, one, X * [1, 1, 0])
    read_only(X, one, cells, m1, mX)
    return Link(
        name=name, kind="plane", X=X, one=one, cells=cells, cell_type="quad9", axes=axes, mass=mass,
        K0=elastic_stiffness(gradient_products(basis, on), (t * lam, t * mu)), m1=m1, mX=mX,
        volume=m1[:, 0] / material.density, E=material.youngs_modulus, lame=(lam, mu), basis=basis, thickness=t,
        method=mesh.method,
    )  # fmt: skip
