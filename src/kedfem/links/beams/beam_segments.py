"""Beams divided into their elements, each with co-rotational frames."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.links.beams.beam import beam_link, planar_rigidities, shape_functions, strain_rows, tangent_fit
from kedfem.links.beams.beam_axis import Axis
from kedfem.links.beams.metric import beam_element
from kedfem.links.beams.spatial_beam import rigidities, spatial_beam_link
from kedfem.links.record import BeamPoint, Frame, Link, section_of
from kedfem.links.segments import Cut, Segments, corotational
from kedfem.links.surfaces.coupling_surfaces import joint_surface, port_weights
from kedfem.scene import Material


def beam_segments(link: Link, material: Material) -> Segments:
    """A planar beam divided into its elements, with a frame along the tangent at each Gauss point, [KED, eqs. (21)(22)].

    The strains there are exact at any deflection: ε = |x'| − 1, γ, ψ' along the rotated axis.
    """
    nodes = link.cells.shape[1]
    parts = []
    for cell in link.cells:
        part = beam_link(link.name, link.X[cell[:2]], section_of(link), material, 1, nodes)
        parts.append(replace(corotational(part), axes=link.axes, frames=_gauss_frames(part, material)))
    cuts = [
        Cut((i, j), link.X[link.cells[i][1:2]], (_unit(parts[i], -1), _unit(parts[j], 0)))
        for i, j in _neighbours(len(parts), link.cells[-1][1] == link.cells[0][0])
    ]
    return Segments(tuple(parts), tuple(cuts))


def _neighbours(count: int, closed: bool) -> list[tuple[int, int]]:
    """Pairs of elements that meet, in order along the beam."""
    pairs = list(pairwise(range(count)))
    return [*pairs, (count - 1, 0)] if closed else pairs


def _unit(part: Link, node: int) -> Float[np.ndarray, "1 n"]:
    """Weights of one end of an element, whose nodes are in order along it."""
    return np.eye(part.n)[[node]]


def _gauss_frames(part: Link, material: Material) -> tuple[Frame, ...]:
    x, rigidity = part.X[part.cells[0]][:, :2], planar_rigidities(section_of(part), material)
    place = np.argsort(part.cells[0])
    rows, rigidities, fits, tangents = [], [], [], []
    for r, w in zip(*np.polynomial.legendre.leggauss(len(x) - 1), strict=True):
        B, det_J = strain_rows(x, float(r))
        rows.append(B.reshape(3, -1, 3)[:, place].reshape(3, -1))
        rigidities.append(w * det_J * rigidity)
        fits.append(tangent_fit(x, float(r))[place])
        tangents.append(shape_functions(float(r), len(x))[1] @ x / det_J)
    shares = np.split(np.linalg.pinv(np.concatenate(rows)), len(rows), axis=1)
    return tuple(
        Frame(fit, (B.T * c) @ B, BeamPoint(t, B, c, share))
        for fit, t, c, B, share in zip(fits, tangents, rigidities, rows, shares, strict=True)
    )


def space_segments(link: Link, axis: Axis, material: Material) -> Segments:
    """A beam in space divided into its elements; neighbours share the whole field of the node between them.

    Parameters
    ----------
    axis : of the link
    """
    parts = [_space_part(link, axis, cell, material) for cell in axis.cells]
    cuts = [
        _node_cut(parts, pair, axis.frame[axis.cells[pair[0]][1], 0])
        for pair in _neighbours(len(parts), axis.node[-1] == axis.node[0])
    ]
    return Segments(tuple(parts), tuple(cuts))


def _space_part(link: Link, axis: Axis, cell: Int[np.ndarray, " m"], material: Material) -> Link:
    stations = np.sort(cell)
    node = np.arange(len(stations))
    rigid_node = axis.rigid_node[axis.node[stations]]
    section = section_of(link)
    own = Axis(axis.frame[stations], node, np.searchsorted(stations, cell)[None], rigid_node)
    part = spatial_beam_link(link.name, own, section, material)
    x, order = own.frame[own.cells[0]][:, [0, 2, 3]], own.node[own.cells[0]]
    rigidity = rigidities(section, material.youngs_modulus, material.shear_modulus)
    element = beam_element(x, part.X, part.one, order, rigidity)
    K0 = sp.csr_array((element.rows.T * element.stiffness) @ element.rows)
    return replace(corotational(part), axes=link.axes, K0=K0, element=element)


def _node_cut(parts: Sequence[Link], pair: tuple[int, int], point: Float[np.ndarray, "3"]) -> Cut:
    surfaces = [joint_surface(parts[k], f"links.{parts[k].name}", point, None) for k in pair]
    known = [d for d, spread in zip(surfaces[0].directions, surfaces[0].spread, strict=True) if spread > 0]
    off = surfaces[0].spread[0] * np.array(known)
    points = np.concatenate([point[None], point + off])
    return Cut(pair, points, (port_weights(surfaces[0], points), port_weights(surfaces[1], points)))
