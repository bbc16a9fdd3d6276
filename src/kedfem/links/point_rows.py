"""Displacement and stress of a link at a point, such as a probe or a load, as rows on its state."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.errors import SceneError
from kedfem.links.beams.beam import shape_functions
from kedfem.links.beams.beam_recovery import fibre_row, nearest_on_beam
from kedfem.links.beams.section import nearest_in_section
from kedfem.links.beams.spatial_recovery import (
    beam_strains,
    element_frame,
    nearest_on_axis,
    section_stress,
    section_value,
)
from kedfem.links.record import Link, section_of
from kedfem.links.recovery import nodal_gradients, stress_of_gradient
from kedfem.links.surfaces.coupling_surfaces import rigid_link_surface
from kedfem.mesh.elements.shape_functions import barycentric

POINT_TOLERANCE = 1e-3  # of the link's size: distance of a probe outside its link that is accepted
ON_AXIS = 1e-6  # of a planar beam's size: its state determines no displacement farther off its axis


@dataclass(frozen=True, slots=True)
class PointRows:
    """Rows that give values at a point of a link from its state g (n, d), link frame.

    value : (n,) displacement = value @ g
    stress : (6, dn) stress components in link axes [Pa/m] = stress @ g.ravel()
    X : (3,) the point itself, moved into the link if it was slightly outside [m]
    """

    value: Float[np.ndarray, " n"]
    stress: sp.csr_array
    X: Float[np.ndarray, "3"]


def point_rows(
    link: Link, where: str, point: Float[np.ndarray, "3"], kinks: Float[np.ndarray, "_ 3"] | None = None
) -> PointRows:
    """The rows of a probe; its displacement is d = N g and f = N δ with the same N, [KED, eqs. (4b)(6)].

    Parameters
    ----------
    where : how messages name the point, e.g. ``output.probes.tip.at``
    point : reference position [m]
    kinks : of planar beams, where joints, bodies and forces sit: stress is interpolated over the elements between
        them [m]; within one element if not given

    Raises
    ------
    SceneError
        If the point is not in the link.
    """
    if link.full is not None and link.Q is not None:
        at = point_rows(link.full, where, point, kinks)
        return PointRows(at.value @ link.Q, _on_functions(at.stress, link.Q, link.d), at.X)
    if link.anywhere:
        value = rigid_link_surface(link, point).fit[0]
        return PointRows(value, sp.csr_array((6, link.unknowns)), np.asarray(point))
    match link.kind:
        case "spatial_beam":
            return _section_rows(link, where, point)
        case "beam":
            return _beam_rows(link, where, point, kinks)
        case _:
            return _solid_rows(link, where, point)


def stress_rows(
    link: Link, where: str, point: Float[np.ndarray, "3"], kinks: Float[np.ndarray, "_ 3"] | None = None
) -> PointRows:
    """`point_rows` of a point that must be in the material: not in the bore of a section, or beside its web."""
    of, at = link.full or link, point_rows(link, where, point, kinks)
    if of.kind == "spatial_beam":
        _, e, r, yz = nearest_on_axis(of, point)
        nearest = nearest_in_section(section_of(of), *yz)
        gap = float(np.hypot(nearest[0] - yz[0], nearest[1] - yz[1]))
        if gap > POINT_TOLERANCE * of.size:
            N, frame = shape_functions(r, of.cells.shape[1])[0], element_frame(of, e)
            place = np.array([1.0, *nearest]) @ np.einsum("m,mkc->kc", N, frame)
            raise SceneError(_outside(of, where, point, gap, place, "its material"))
    return at


def require_on_axis(
    link: Link,
    where: str,
    at: Float[np.ndarray, "3"],
    nearest: Float[np.ndarray, "3"],
    noun: str = "beam",
    purpose: str = "",
) -> None:
    """Refuse a point beside the axis of a planar beam; other links have points anywhere.

    Parameters
    ----------
    at, nearest : the point in the reference position, and the nearest of the link [m]
    noun, purpose : for the message: kind of the link, purpose of the point
    """
    beside = float(np.linalg.norm(nearest - at))
    if link.kind == "beam" and beside > ON_AXIS * link.size:
        wanted = f"must lie on the axis of {noun} '{link.name}'{purpose}"
        raise SceneError(f"{where}: {wanted}, got {beside:.3g} m beside it")


def _on_functions(stress: sp.csr_array, Q: Float[np.ndarray, "n s"], d: int) -> sp.csr_array:
    """Stress rows of an unreduced link on the modes of a reduced one: (6, dn) → (6, ds)."""
    columns = np.unique(stress.indices)
    dense, node, component = stress[:, columns].toarray(), *np.divmod(columns, d)
    out = np.zeros((6, Q.shape[1], d))
    for c in range(d):
        out[:, :, c] = dense[:, component == c] @ Q[node[component == c]]
    return sp.csr_array(out.reshape(6, -1))


def _solid_rows(link: Link, where: str, point: Float[np.ndarray, "3"]) -> PointRows:
    element, local = _element_at(link, where, point)
    N, _ = _shapes(link, local)
    dofs = link.basis.element_dofs[:, element]
    value = np.zeros(link.n)
    value[dofs] = N
    X = N @ link.X[dofs]
    touching = np.flatnonzero(np.isin(link.basis.element_dofs, dofs).any(axis=0))
    gradient = [sp.csr_array(value[None, :]) @ G for G in nodal_gradients(link, touching)]
    return PointRows(value, _stress_rows(link, gradient), X)


def _stress_rows(link: Link, gradient: list[sp.csr_array]) -> sp.csr_array:
    """(6, dn) rows from the d gradient rows (1, n) at a point."""
    columns = np.unique(np.concatenate([G.indices for G in gradient]))
    dense, d = np.stack([G[:, columns].toarray()[0] for G in gradient]), link.d  # (j, c)
    H = np.zeros((d * len(columns), d, d))
    for i in range(d):
        H[i::d, i, :] = dense.T
    stress = stress_of_gradient(H, link).T
    dofs = (d * columns[:, None] + np.arange(d)).ravel()
    out = sp.lil_array((6, link.unknowns))
    out[:, dofs] = stress
    return sp.csr_array(out)


def _shapes(link: Link, local: Float[np.ndarray, " d"]) -> tuple[np.ndarray, np.ndarray]:
    """N (m,) and dN (m, d) of an element at local coordinates."""
    pairs = [link.basis.elem.lbasis(local[:, None], i) for i in range(len(link.basis.element_dofs))]
    return np.array([float(np.ravel(N)[0]) for N, _ in pairs]), np.array([np.ravel(dN) for _, dN in pairs])


def _element_at(link: Link, where: str, point: Float[np.ndarray, "3"]) -> tuple[int, Float[np.ndarray, " d"]]:
    """The element that contains a point (or is nearest to it, in a plane link's plane) and the local coordinates."""
    whole, point = point, point[: link.d]
    corners = link.X[link.basis.element_dofs, : link.d]  # (m, e, d)
    low, high = corners.min(axis=0), corners.max(axis=0)
    outside = np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0), axis=1)
    size = np.ptp(link.X, axis=0).max()
    best, gap, at = -1, np.inf, np.full(link.d, 0.25)
    for element in np.argsort(outside, kind="stable")[:64]:
        if outside[element] > gap:
            break
        local = _local_coordinates(link, int(element), point)
        distance = float(np.linalg.norm(_shapes(link, local)[0] @ corners[:, element] - point))
        if distance < gap - 1e-12 * size:
            best, gap, at = int(element), distance, local
    if gap > POINT_TOLERANCE * size:
        nearest = _shapes(link, at)[0] @ link.X[link.basis.element_dofs[:, best]]
        raise SceneError(_outside(link, where, whole, gap, nearest))
    return best, at


def _local_coordinates(link: Link, element: int, point: Float[np.ndarray, " d"]) -> Float[np.ndarray, " d"]:
    """Newton for the isoparametric map, kept within the element."""
    x = link.X[link.basis.element_dofs[:, element], : link.d]
    tetrahedra = link.cell_type == "tetra10"
    local = np.full(link.d, 0.25 if tetrahedra else 0.5)
    for _ in range(30):
        N, dN = _shapes(link, local)
        change = np.linalg.lstsq(x.T @ dN, point - N @ x, rcond=None)[0]
        moved = _within(local + change) if tetrahedra else np.clip(local + change, 0.0, 1.0)
        if np.abs(moved - local).max() < 1e-14:
            break
        local = moved
    return local


def _within(local: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """The place in the reference tetrahedron with the nearest barycentric coordinates."""
    b = barycentric(local)
    falling = np.sort(b)[::-1]
    excess = (np.cumsum(falling) - 1) / np.arange(1, 5)
    return np.asarray(np.maximum(b - excess[np.flatnonzero(falling > excess)[-1]], 0.0)[1:])


def _beam_rows(
    link: Link, where: str, point: Float[np.ndarray, "3"], kinks: Float[np.ndarray, "_ 3"] | None
) -> PointRows:
    if link.section is None:
        raise SceneError(f"{where}: link '{link.name}' has no section")
    beyond, e, r, offset = nearest_on_beam(link, point)
    if beyond > POINT_TOLERANCE * np.ptp(link.X, axis=0).max():
        nearest = shape_functions(r, link.cells.shape[1])[0] @ link.X[link.cells[e]]
        raise SceneError(_outside(link, where, point, beyond, nearest))
    value = np.zeros(link.n)
    value[link.cells[e]] = shape_functions(r, link.cells.shape[1])[0]
    half = link.section.height / 2
    row = fibre_row(link, e, r, float(np.clip(offset, -half, half)), kinks)
    stress = sp.csr_array(sp.vstack([row[None, :], np.zeros((5, 3 * link.n))]))
    return PointRows(value, stress, value @ link.X)


def _section_rows(link: Link, where: str, point: Float[np.ndarray, "3"]) -> PointRows:
    beyond, e, r, (y, z) = nearest_on_axis(link, point)
    if beyond > POINT_TOLERANCE * link.size:
        nearest = shape_functions(r, link.cells.shape[1])[0] @ element_frame(link, e)[:, 0]
        raise SceneError(_outside(link, where, point, beyond, nearest))
    value = section_value(link, e, r, y, z)
    stress = np.zeros((6, 3 * link.n))
    stress[[0, 3, 5]] = section_stress(link, beam_strains(link, e, r), *nearest_in_section(section_of(link), y, z))
    return PointRows(value, sp.csr_array(stress), value @ link.X)


def _outside(
    link: Link, where: str, point: Float[np.ndarray, "3"], gap: float, nearest: Float[np.ndarray, "3"],
    what: str = "its axis",
) -> str:  # fmt: skip
    """The message for a point outside a link, with the nearest place of the link, of a beam of its axis."""
    shown, instead = (", ".join(f"{v + 0.0:.6g}" for v in np.round(x, 9)) for x in (point, nearest))
    near = f"{what} is nearest at ({instead})" if link.section is not None else f"({instead}) is the nearest"
    advice = f"take a point of its material, {near}"
    if link.meshed and where.startswith("output"):
        advice += ", or for a motion the centre of a bore with a joint"
    return f"{where}: must lie in link '{link.name}', got ({shown}), {gap:.3g} m outside it: {advice}"
