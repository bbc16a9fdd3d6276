"""Solid links of hexahedra or tetrahedra: mass and stiffness from six scalar forms.

[KED, eqs. (4), (9), (11), (13)]; the same functions interpolate geometry and displacement (isoparametric).
Only this module and `surface` import scikit-fem.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem

from kedfem.arrays import Float, Int
from kedfem.links.record import Link, LinkFace, Mass, mass_constants, read_only
from kedfem.mesh import SolidMesh
from kedfem.mesh.elements.hexahedra import CELL_TYPES
from kedfem.scene import Material

#: 2³, 3³ and 14 Gauss points: exact volume of distorted elements, and ∫ ∂_i N_a of curved tetrahedra.
QUADRATURE_ORDER = {8: 3, 10: 5, 20: 5, 27: 5}


class HexS2(skfem.ElementHexS2):  # type: ignore[misc]
    """The 20-node element with cached values: scikit-fem evaluates its functions at the same points many times."""

    def lbasis(self, X: Float[np.ndarray, "3 q"], i: int) -> tuple[np.ndarray, np.ndarray]:
        """The i-th function and its gradient in the reference element."""
        return _serendipity(X.tobytes(), X.shape, i)


@lru_cache(maxsize=400)
def _serendipity(points: bytes, shape: tuple[int, ...], i: int) -> tuple[np.ndarray, np.ndarray]:
    found: tuple[np.ndarray, np.ndarray] = skfem.ElementHexS2().lbasis(np.frombuffer(points).reshape(shape), i)
    read_only(*found)
    return found


class CachedMapping(skfem.MappingIsoparametric):  # type: ignore[misc]
    """An isoparametric mapping with its inverse gradient cached: scikit-fem asks for it for every function."""

    _last: tuple[Any, Any, np.ndarray] = (None, None, np.zeros(0))

    def invDF(self, X: np.ndarray, tind: np.ndarray | None = None) -> np.ndarray:
        """∂ξ/∂x, (3, 3, e, q)."""
        if X is not self._last[0] or tind is not self._last[1]:
            self._last = X, tind, super().invDF(X, tind)
        return self._last[2]


@dataclass(repr=False)
class MeshHexS2(skfem.MeshHex1):  # type: ignore[misc]
    """20-node hexahedra with serendipity geometry, which scikit-fem lacks: on its 27-node geometry the 20 functions
    do not contain x, y, z, so that a rigid rotation would cause strain."""

    elem: type[skfem.Element] = HexS2

    def _mapping(self) -> skfem.MappingIsoparametric:
        if not hasattr(self, "_cached_mapping"):
            self._cached_mapping = CachedMapping(self, self.elem(), self.bndelem)
        return self._cached_mapping


MESHES = {8: skfem.MeshHex1, 10: skfem.MeshTet2, 20: MeshHexS2, 27: skfem.MeshHex2}


def vtk_order(nodes: int) -> list[int]:
    """Position in VTK's order of each node of an element in scikit-fem's; the same for tetrahedra."""
    from skfem.io.meshio import HEX_MAPPING  # which loads meshio, a fifth of a second

    return list(range(10)) if nodes == 10 else list(HEX_MAPPING[:nodes])


def solid_basis(mesh: SolidMesh) -> skfem.Basis:
    """Isoparametric function space of a mesh, [KED, eqs. (4a)(4b)]."""
    nodes = mesh.cells.shape[1]
    order = np.argsort(vtk_order(nodes))
    fem_mesh = MESHES[nodes](np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.cells.T[order]))
    return skfem.Basis(fem_mesh, fem_mesh.elem(), intorder=QUADRATURE_ORDER[nodes])


def vtk_cells(basis: skfem.Basis) -> Int[np.ndarray, "e m"]:
    """Elements as rows of function numbers in VTK's node order."""
    dofs = basis.element_dofs
    return np.ascontiguousarray(dofs[vtk_order(len(dofs))].T)


@dataclass(frozen=True, slots=True)
class SparsityPattern:
    """The common sparsity pattern of all scalar matrices of a basis.

    indices, indptr : CSR structure
    slot : position of each local entry: columns, then rows, then elements
    """

    indices: Int[np.ndarray, " nnz"]
    indptr: Int[np.ndarray, " n1"]
    slot: Int[np.ndarray, " k"]

    def assembled(self, local: Float[np.ndarray, "e m m"]) -> sp.csr_array:
        """The matrices of all elements as one sparse array, with its zero entries."""
        data = np.bincount(self.slot, weights=local.transpose(2, 1, 0).ravel(), minlength=len(self.indices))
        n = len(self.indptr) - 1
        return sp.csr_array((data, self.indices, self.indptr), shape=(n, n))


def sparsity_pattern(basis: skfem.Basis) -> SparsityPattern:
    """Sparsity pattern of a basis."""
    dofs, n = basis.element_dofs.astype(np.int64), basis.N
    keys = (dofs[None, :, :] * n + dofs[:, None, :]).ravel()  # entry (j, i, e): row i, column j
    found, slot = np.unique(keys, return_inverse=True)
    indptr = np.searchsorted(found, n * np.arange(n + 1)).astype(np.int32)
    return SparsityPattern((found % n).astype(np.int32), indptr, slot)


def scalar_mass(basis: skfem.Basis, on: SparsityPattern, density: float) -> sp.csr_array:
    """Scalar Gram matrix m_ab = ∫ ρ N_a N_b det(J), [KED, eqs. (9)(11)] [kg]."""
    N = np.stack([np.asarray(shape[0]) for shape in basis.basis], axis=1) * np.sqrt(density * basis.dx)[:, None]
    return on.assembled(N @ N.transpose(0, 2, 1))


def gradient_products(basis: skfem.Basis, on: SparsityPattern) -> dict[tuple[int, int], sp.csr_array]:
    """The scalar matrices D_ij = ∫ ∂_i N_a ∂_j N_b, i ≤ j, all on one sparsity pattern [m; in a plane: -]."""
    # the root of the weights is on both factors, so that D_ii is exactly symmetric
    axes, root = range(basis.mesh.dim()), np.sqrt(basis.dx)[:, None]
    dN = [np.stack([np.asarray(shape[0].grad)[k] for shape in basis.basis], axis=1) * root for k in axes]
    return {(i, j): on.assembled(dN[i] @ dN[j].transpose(0, 2, 1)) for i, j in combinations_with_replacement(axes, 2)}


def elastic_stiffness(D: dict[tuple[int, int], sp.csr_array], lame: tuple[float, float]) -> sp.csr_array:
    """K0 from scalar matrices: block(i, j) = λ D_ij + μ D_ji + μ δ_ij Σ_k D_kk, [KED, eqs. (13)(14)].

    Parameters
    ----------
    D : scalar matrices of `gradient_products`: six in space, three in a plane [m; in a plane: -]
    lame : Lamé's (λ, μ) [Pa; in a plane times the thickness: N/m]

    Returns
    -------
    (dn, dn) in the link frame, dof d·node + component [N/m]
    """
    lam, mu = lame
    like = D[0, 0]
    transposed = transposition(like)
    n, d = like.shape[0], 1 + max(j for _, j in D)
    data = {(i, j): D[i, j].data if i <= j else D[j, i].data[transposed] for i in range(d) for j in range(d)}
    laplace = mu * sum(data[k, k] for k in range(d))
    blocks = np.empty((like.nnz, d, d))
    for i in range(d):
        for j in range(d):
            blocks[:, i, j] = lam * data[i, j] + mu * data[j, i]
        blocks[:, i, i] += laplace
    return sp.csr_array(sp.bsr_array((blocks, like.indices, like.indptr), shape=(d * n, d * n)).tocsr())


def transposition(like: sp.csr_array) -> Int[np.ndarray, " nnz"]:
    """Position of the transposed entry of each entry of a structurally symmetric matrix."""
    number = sp.csr_array((np.arange(like.nnz), like.indices, like.indptr), shape=like.shape)
    turned = sp.csr_array(number.T.tocsr())
    turned.sort_indices()
    return np.asarray(turned.data)


def link_faces(basis: skfem.Basis, mesh: SolidMesh) -> tuple[LinkFace, ...]:
    """Named faces of a mesh as facets of its function space, whose first functions are those of corners."""
    if not mesh.faces:
        return ()
    corners = np.unique(mesh.cells[:, : basis.elem.refdom.nnodes])
    facets = basis.mesh.boundary_facets()
    keys = np.sort(basis.mesh.facets[:, facets].T, axis=1)
    number = {tuple(key): int(facet) for key, facet in zip(keys.tolist(), facets, strict=True)}
    out = []
    for face in mesh.faces:
        sides = np.sort(np.searchsorted(corners, face.sides), axis=1).tolist()
        found = np.array([number[tuple(side)] for side in sides if tuple(side) in number], dtype=np.int64)
        out.append(LinkFace(face, found))
    return tuple(out)


def solid_link(name: str, mesh: SolidMesh, material: Material, axes: Float[np.ndarray, "3 3"]) -> Link:
    """The record of a solid link; columns of `axes` are the link axes."""
    basis = solid_basis(mesh)
    return meshed_link(
        name, basis, basis.doflocs.T, material, material.lame(), kind="solid", axes=axes, cells=vtk_cells(basis),
        cell_type=CELL_TYPES[len(basis.element_dofs)], faces=link_faces(basis, mesh), method=mesh.method,
    )  # fmt: skip


def meshed_link(
    name: str, basis: skfem.Basis, X: Float[np.ndarray, "n 3"], material: Material, lame: tuple[float, float],
    thickness: float = 1.0, **given: Any,
) -> Link:  # fmt: skip
    """The record of a solid or plane link from its function space, with mass and stiffness and all that is given."""
    on, X, one = sparsity_pattern(basis), np.ascontiguousarray(X), np.ones(len(X))
    m = scalar_mass(basis, on, material.density * thickness)
    mass: Mass = (m,) * basis.mesh.dim()
    m1, mX = mass_constants(mass, one, X * [1, 1, len(mass) - 2])
    read_only(X, one, given["cells"], m1, mX)
    lam, mu = (thickness * x for x in lame)
    return Link(
        name=name, X=X, one=one, mass=mass, K0=elastic_stiffness(gradient_products(basis, on), (lam, mu)), m1=m1, mX=mX,
        volume=m1[:, 0] / material.density, E=material.youngs_modulus, lame=lame, basis=basis, thickness=thickness,
        **given,
    )  # fmt: skip
