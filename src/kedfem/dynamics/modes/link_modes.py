"""Natural frequencies and mode shapes of a single link, free or constrained.

    K0 x = ω² M x,   G x = 0

G are the mean displacements and rotations of coupling surfaces that joints constrain; points of clamped faces have no
unknowns. K0 + s M is factored once (again where s is far from the first ω²), as for frozen linkages.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Bool, Float, Int
from kedfem.dynamics.elastic_model import with_scene_body
from kedfem.dynamics.joints.places import surface_of
from kedfem.dynamics.joints.rigid_couplings import with_rigid_couplings
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.matrices.substructure import mass_matrix
from kedfem.dynamics.modes.frozen import FIRST, NEAR, RIGID_MOTIONS, Modes
from kedfem.dynamics.modes.lanczos import Block, lanczos
from kedfem.links.build import bare_link
from kedfem.links.record import Link
from kedfem.links.reduced import rigid_modes, wave_frequency
from kedfem.links.surfaces.coupling_surfaces import port_weights, surface_couples
from kedfem.links.surfaces.rigid_coupling import surface_gram
from kedfem.scene import Scene

NONE = 1e-9  # of the largest row: what a link in a plane or a flat face cannot do
HOLDS = 1e-7  # of the firmest hold on a rigid-body motion: less is rounding


@dataclass(frozen=True, slots=True)
class Support:
    """The support of a link.

    rows : (m, dn) G, each constrained to zero
    clamped : (n,) functions without unknowns
    """

    rows: Float[np.ndarray, "m k"]
    clamped: Bool[np.ndarray, " n"]


def free(link: Link) -> Support:
    """Nothing."""
    return Support(np.zeros((0, link.unknowns)), np.zeros(link.n, dtype=bool))


def clamped_on(link: Link, facets: Int[np.ndarray, " f"]) -> Support:
    """All points of some facets of a meshed link."""
    out = np.zeros(link.n, dtype=bool)
    if len(facets):
        out[surface_gram(link, facets)[0]] = True
    return Support(np.zeros((0, link.unknowns)), out)


def held_at(scene: Scene, joint: str, link: Link, turns: Float[np.ndarray, "r 3"]) -> Support:
    """The coupling surface of a joint: its mean displacement at the joint's point, and its mean rotation about axes.

    Parameters
    ----------
    turns : (r, 3) directions about which it cannot turn

    Raises
    ------
    MeshError
        If the joint finds no coupling surface on the link.
    """
    surface, at = surface_of(scene, joint, link), np.asarray(scene.joints[joint].on(link.name))
    if link.kind == "beam":  # rows u, v and ψ of its node
        one = surface.fit[0]
        unit = np.eye(3)[: 3 if len(turns) and np.abs(turns[:, 2]).max() > NONE else 2]
        return Support(np.array([np.outer(one, e).ravel() for e in unit]), np.zeros(link.n, dtype=bool))
    weights = port_weights(surface, at[None])[0]
    shifts = [np.outer(weights, e).ravel() for e in np.eye(link.d)]
    couples = surface_couples(link, surface, f"joints.{joint}").reshape(3, -1)
    about = turns @ couples
    size = np.abs(couples).max()
    rows = [*shifts, *(row for row in about if np.abs(row).max() > NONE * size)]
    return Support(np.array(rows), np.zeros(link.n, dtype=bool))


def together(link: Link, supports: list[Support]) -> Support:
    """Several supports as one."""
    every = [free(link), *supports]
    return Support(np.concatenate([x.rows for x in every]), np.any([x.clamped for x in every], axis=0))


def single_link(scene: Scene, name: str) -> Link:
    """A link of a scene unreduced, with its rigid couplings and attached bodies.

    Raises
    ------
    MeshError
        If it cannot be meshed, or a joint or body finds no coupling surface.
    SceneError
        If a body does not fit it.
    """
    links = with_rigid_couplings(scene, {name: bare_link(scene, name)})
    for key, body in scene.bodies.items():
        if body.link == name:
            links[name] = with_scene_body(scene, f"bodies.{key}", body, links)[1]
    return links[name]


def link_modes(link: Link, support: Support, count: int) -> Modes:
    """The lowest modes of a link, those of motions without strain beside `count` others.

    Raises
    ------
    SolveError
        K0 is not that of an elastic body.
    """
    low, high = NEAR
    still = motions_without_strain(link, support)
    shift = FIRST * wave_frequency(link) ** 2
    lowest, shapes = _lowest(link, support, count + still, shift)
    first = lowest[still : still + 1]
    if len(first) and not low <= first[0] / shift <= high:
        shift = float(first[0])
        lowest, shapes = _lowest(link, support, count + still, shift)
    omega = np.sqrt(np.maximum(lowest, 0.0)) * (np.arange(len(lowest)) >= still)
    return Modes(omega, (shapes.reshape(-1, link.n, link.d),), still)


def motions_without_strain(link: Link, support: Support) -> int:
    """Rigid-body motions of a link that its support releases."""
    B = rigid_modes(link)
    B = B / np.sqrt(np.einsum("kr,kr->r", B, mass_matrix(link) @ B))
    clamped = B[np.repeat(support.clamped, link.d)]
    hold = np.concatenate([clamped / max(np.abs(clamped).max(initial=0.0), 1e-300), _independent(support.rows) @ B])
    if not len(hold):
        return int(B.shape[1])
    values = np.linalg.svd(hold / np.abs(hold).max(), compute_uv=False)
    return int(B.shape[1] - (values > HOLDS * values[0]).sum())


def _lowest(
    link: Link, support: Support, count: int, shift: float
) -> tuple[Float[np.ndarray, " f"], Float[np.ndarray, "f k"]]:
    """ω² in rising order, and shapes on all unknowns of the link."""
    kept = np.repeat(~support.clamped, link.d)
    M = sp.csr_array(mass_matrix(link)[kept][:, kept])
    A = sp.csr_array(sp.csr_array(link.K0)[kept][:, kept] + shift * M)
    factor, rows = Cholesky(A, f"links.{link.name}"), _independent(support.rows[:, kept])
    Y = factor.solve_many(rows.T)
    S = rows @ Y

    def answer(r: Block) -> Block:
        x = factor.solve_many(r)
        return x - Y @ np.linalg.solve(S, rows @ x) if len(rows) else x

    theta, x = lanczos(answer, lambda x: np.asarray(M @ x), len(M.indptr) - 1, count, RIGID_MOTIONS)
    shapes = np.zeros((len(theta), link.unknowns))
    shapes[:, kept] = x.T
    return 1 / theta - shift, shapes


def _independent(rows: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "r k"]:
    """An orthonormal basis of rows: those of two joints on one surface are the same."""
    if not len(rows):
        return rows
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    scaled = rows[sizes[:, 0] > 0] / sizes[sizes[:, 0] > 0]
    _, values, basis = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(basis[values > NONE * values.max(initial=0.0)])
