"""Displacements and stresses of a link from its state, at points and at nodes, in link axes.

Stress = elasticity : sym(gradient). The gradient operator is scalar: d matrices (n, n). Gradients are evaluated at the
superconvergent (reduced) Gauss points, extrapolated linearly to the nodes and averaged there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import skfem

from kedfem.arrays import Float, Int
from kedfem.links.beams.beam import line_pairs
from kedfem.links.beams.beam_recovery import beam_fibre
from kedfem.links.beams.spatial_recovery import section_solid
from kedfem.links.record import Link
from kedfem.mesh.elements.shape_functions import barycentric

COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  # xx, yy, zz, xy, yz, zx


def nodal_state(link: Link, g: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "_ d"]:
    """The state of a link at its nodes: of a reduced link that of the link it was made from."""
    return g if link.Q is None else link.Q @ g


def nodal_gradients(link: Link, elements: Int[np.ndarray, " e"] | None = None) -> tuple[sp.csr_array, ...]:
    """Scalar matrices G_k: nodal ∂_k of a field in a meshed link, averaged over the elements that meet at a node [1/m].

    Parameters
    ----------
    elements : restrict to these; exact at the nodes all of whose elements are among them
    """
    mesh_dofs = link.basis.element_dofs
    points, extension = _gauss_points(link)
    quadrature = (points, np.ones(points.shape[1]))
    at_gauss = skfem.Basis(link.basis.mesh, link.basis.elem, elements=elements, quadrature=quadrature)
    dofs = mesh_dofs if elements is None else mesh_dofs[:, elements]  # (m, e)
    count = np.maximum(np.bincount(dofs.ravel(), minlength=link.n), 1)
    rows = np.repeat(dofs.T[:, :, None], len(dofs), axis=2)
    columns = np.repeat(dofs.T[:, None, :], len(dofs), axis=1)
    out = []
    for k in range(link.d):
        grad = np.stack([np.asarray(shape[0].grad)[k] for shape in at_gauss.basis])  # (b, e, q)
        local = np.einsum("aq,beq->eab", extension, grad, optimize=True) / count[rows]
        entries = local.ravel(), (rows.ravel(), columns.ravel())
        out.append(sp.csr_array(sp.coo_array(entries, shape=(link.n, link.n))))
    return tuple(out)


def stress_of_gradient(H: Float[np.ndarray, "p d d"], link: Link) -> Float[np.ndarray, "p 6"]:
    """Stresses in link axes from displacement gradients H_ij = ∂_j u_i in reference axes: λ tr(ε) 1 + 2 μ ε [Pa].

    In plane stress λ is λ*, and the components zz, yz, zx are zero.
    """
    return np.asarray(H.reshape(len(H), -1) @ _stress_of_unit_gradients(link))


def _stress_of_unit_gradients(link: Link) -> Float[np.ndarray, "dd 6"]:
    """Stresses of the gradients H with a single component 1, row by row."""
    (lam, mu), d = link.lame, link.d
    H = link.axes[:d, :d].T @ np.eye(d * d).reshape(-1, d, d) @ link.axes[:d, :d]
    stress = np.zeros((len(H), 3, 3))
    stress[:, :d, :d] = mu * (H + H.transpose(0, 2, 1))
    stress[:, :d, :d] += lam * np.trace(H, axis1=1, axis2=2)[:, None, None] * np.eye(d)
    return _components(stress)


def _components(S: Float[np.ndarray, "p 3 3"]) -> Float[np.ndarray, "p 6"]:
    return np.stack([S[:, i, j] for i, j in COMPONENTS], axis=1)


@dataclass(frozen=True, slots=True)
class StressRecovery:
    """Stresses all over a link, at its nodes or, of a spatial beam, at points of its sections.

    link, matrices : the link; gradients of a meshed link or stress rows of a beam
    cells, cell_type : elements between the points, VTK order
    values : (p, n) displacement of the points from the state; None if they are the nodes
    """

    link: Link
    matrices: tuple[sp.csr_array, ...]
    cells: Int[np.ndarray, "e m"]
    cell_type: str
    values: sp.csr_array | None = None

    @property
    def points(self) -> int:
        """Number of points."""
        return self.link.n if self.values is None else self.values.shape[0]

    @property
    def stressed(self) -> int:
        """Number of places with a stress of their own: of planar beams four per node, two fibres in two elements."""
        return len(self.matrices) * self.points if self.link.kind == "beam" else self.points

    def at_points(self, state: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "p d"]:
        """Values at the points of coefficients (of position, of displacement)."""
        return state if self.values is None else np.asarray(self.values @ state)


def stress_recovery(link: Link) -> StressRecovery:
    """Prepare nodal stresses of a link; of a reduced one those of the unreduced link."""
    if link.full is not None:
        return stress_recovery(link.full)
    if link.meshed:
        return StressRecovery(link, nodal_gradients(link), link.cells, link.cell_type)
    if link.kind == "spatial_beam":
        values, stresses, cells = section_solid(link)
        return StressRecovery(link, stresses, cells, "hexahedron", values)
    half = link.section.height / 2 if link.section else 0.0
    fibres = (*beam_fibre(link, half), *beam_fibre(link, -half))
    if link.cells.shape[1] <= 3:
        return StressRecovery(link, fibres, link.cells, link.cell_type)
    return StressRecovery(link, fibres, line_pairs(link.cells), "line")


def nodal_stress(recovery: StressRecovery, g: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "p 6"]:
    """Stresses at the nodes in link axes [Pa]; of a planar beam σ_xx where it is largest in size, of both outer fibres.

    Of a spatial beam at the points of its sections, in the axes (tangent, n1, n2) of the section.

    Parameters
    ----------
    g : (n, d) nodal displacement in the link frame, of a reduced link `nodal_state` [m; ψ: rad]
    """
    if recovery.link.meshed:
        H = np.stack([G @ g for G in recovery.matrices], axis=2)  # (n, i, j)
        return stress_of_gradient(H, recovery.link)
    if recovery.link.kind == "spatial_beam":
        sections = np.zeros((recovery.matrices[0].shape[0], 6))
        sections[:, [0, 3, 5]] = np.stack([m @ g.ravel() for m in recovery.matrices], axis=1)
        return sections
    fibres = np.stack([m @ g.ravel() for m in recovery.matrices])
    out = np.zeros((recovery.link.n, 6))
    out[:, 0] = np.take_along_axis(fibres, np.abs(fibres).argmax(axis=0)[None], axis=0)[0]
    return out


def extreme_stresses(
    recovery: StressRecovery, g: Float[np.ndarray, "n d"]
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "p 2"]]:
    """Von Mises stress, smallest and largest principal stress [Pa]; at a node of a planar beam of its two outer fibres.

    Parameters
    ----------
    g : (n, d) as for `nodal_stress`
    """
    stress = nodal_stress(recovery, g)
    if recovery.link.kind != "beam":
        return von_mises(stress), principal_stresses(stress)
    fibres = np.stack([m @ g.ravel() for m in recovery.matrices] + [np.zeros(len(stress))])
    return von_mises(stress), np.stack([fibres.min(axis=0), fibres.max(axis=0)], axis=1)


def stress_modes(recovery: StressRecovery, link: Link, modes: Float[np.ndarray, "r k"]) -> Float[np.ndarray, "p 6 r"]:
    """Stresses of states (r, dn) of a link, full or reduced, at all places of `recovery.stressed` at once.

    Returns
    -------
    (p, 6, r) [Pa]: five deviatoric components, whose norm is the von Mises stress (√3/2 (xx − yy), (2 zz − xx − yy)/2,
    √3 xy, √3 yz, √3 zx), then the mean of xx, yy, zz
    """
    of, r = recovery.link, len(modes)
    states = modes.reshape(r, link.n, link.d).transpose(1, 2, 0)
    if link.Q is not None:
        states = (link.Q @ states.reshape(link.n, -1)).reshape(of.n, link.d, r)
    if of.meshed:
        return _meshed_modes(recovery, np.ascontiguousarray(states))
    flat = states.reshape(-1, r)
    if of.kind == "spatial_beam":
        xx, xy, zx = (m @ flat for m in recovery.matrices)
    else:
        xx = np.concatenate([m @ flat for m in recovery.matrices])
        xy = zx = np.zeros_like(xx)
    return _deviatoric([xx, 0 * xx, 0 * xx, xy, 0 * xx, zx])


def _meshed_modes(recovery: StressRecovery, states: Float[np.ndarray, "n d r"]) -> Float[np.ndarray, "n 6 r"]:
    """`stress_modes` of a meshed link: λ tr(ε) 1 + 2 μ ε, in reference axes, as invariants are the same in all axes."""
    of, (n, d, r) = recovery.link, states.shape
    lam, mu = of.lame
    H = [(G @ states.reshape(n, -1)).reshape(n, d, r) for G in recovery.matrices]
    trace = lam * np.sum([H[i][:, i] for i in range(d)], axis=0)
    zero = np.zeros((n, r))
    direct = [2 * mu * H[i][:, i] + trace if i < d else zero for i in range(3)]
    shear = [mu * (H[i][:, j] + H[j][:, i]) if max(i, j) < d else zero for i, j in COMPONENTS[3:]]
    return _deviatoric([*direct, *shear])


def _deviatoric(stress: Sequence[Float[np.ndarray, "p r"]]) -> Float[np.ndarray, "p 6 r"]:
    """Five components whose norm is the von Mises stress, and the mean of xx, yy, zz."""
    xx, yy, zz, xy, yz, zx = stress
    root = np.sqrt(3.0)
    out = np.empty((len(xx), 6, xx.shape[1]))
    out[:, 0], out[:, 1] = root / 2 * (xx - yy), zz - (xx + yy) / 2
    out[:, 2], out[:, 3], out[:, 4] = root * xy, root * yz, root * zx
    out[:, 5] = (xx + yy + zz) / 3
    return out


def von_mises(stress: Float[np.ndarray, "p 6"]) -> Float[np.ndarray, " p"]:
    """Equivalent stress from xx, yy, zz, xy, yz, zx [same unit]."""
    xx, yy, zz, xy, yz, zx = stress.T
    normal = ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2
    return np.asarray(np.sqrt(normal + 3 * (xy**2 + yz**2 + zx**2)))


def rotated_stress(stress: Float[np.ndarray, "p 6"], T: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "p 6"]:
    """Stresses xx, yy, zz, xy, yz, zx after the transformation of components T S Tᵀ [same unit]."""
    units = np.zeros((6, 3, 3))
    for k, (i, j) in enumerate(COMPONENTS):
        units[k, i, j] = units[k, j, i] = 1.0
    return np.asarray(stress @ _components(T @ units @ T.T))


def principal_stresses(stress: Float[np.ndarray, "p 6"]) -> Float[np.ndarray, "p 2"]:
    """Smallest and largest principal stress by the angle of Lode, from xx, yy, zz, xy, yz, zx [same unit]; nan of nan."""
    mean, vm = stress[:, :3].mean(axis=1), von_mises(stress)
    size = np.where(vm > 1e-150, vm, 1.0)  # squares of smaller numbers are subnormal
    xx, yy, zz = (stress[:, :3].T - mean) / size
    xy, yz, zx = stress[:, 3:].T / size
    third = xx * (yy * zz - yz**2) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    angle = np.arccos(np.clip(13.5 * third, -1.0, 1.0)) / 3
    radius = 2 / 3 * vm
    return np.stack([mean + radius * np.cos(angle + 2 * np.pi / 3), mean + radius * np.cos(angle)], axis=1)


def _gauss_points(link: Link) -> tuple[Float[np.ndarray, "d q"], Float[np.ndarray, "m q"]]:
    """Reduced Gauss points of the reference element, and the matrix that extrapolates values there to the nodes."""
    d, at_nodes = link.d, np.asarray(link.basis.elem.doflocs)  # (m, d)
    if link.cell_type == "tetra10":
        b = np.full((4, 4), (5 - np.sqrt(5)) / 20) + np.eye(4) / np.sqrt(5)  # barycentric, of degree 2
        return b[:, 1:].T, barycentric(at_nodes) @ np.linalg.inv(b)
    if len(at_nodes) == 2**d:
        return np.full((d, 1), 0.5), np.ones((len(at_nodes), 1))
    a = np.array([0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)])
    points = np.stack(np.meshgrid(*[a] * d, indexing="ij")).reshape(d, -1)
    x = at_nodes.T[:, :, None]
    factors = np.where(points[:, None] == a[0], a[1] - x, x - a[0]) / (a[1] - a[0])
    return points, np.prod(factors, axis=0)
