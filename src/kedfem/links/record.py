"""The record of a link, the same for all models; the dynamics use nothing else of a link.

A link is a scalar function space {N_a} with a vector at each function. Its state is an array (n, d), its mass scalar
matrices, its stiffness K0 constant in the link frame: [KED, eqs. (9)(11)-(14)]. d is 3, for plane links 2.
"""

from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.links.beams.section import Section
from kedfem.mesh.elements.hexahedra import Face

Matrix: TypeAlias = Any  # sp.csr_array, or np.ndarray of a reduced link
Mass = tuple[Matrix, ...]
Kind = Literal["solid", "plane", "beam", "spatial_beam"]


@dataclass(frozen=True, slots=True)
class BeamPoint:
    """A Gauss point of a planar beam, whose frame follows the tangent there.

    tangent : (2,) in the reference position
    strains : (3, 3n) rows of ε, γ, κ from the deformation in the frame
    rigidity : (3,) EA, κGA, EI times the length of the point's Gauss weight
    share : (3n, 3) contribution of ε, γ, κ here to the deformation of the segment, for stresses
    """

    tangent: Float[np.ndarray, "2"]
    strains: Float[np.ndarray, "3 k"]
    rigidity: Float[np.ndarray, "3"]
    share: Float[np.ndarray, "k 3"]


@dataclass(frozen=True, slots=True)
class BeamElement:
    """An element in space with E Gauss points, m nodes, K gradient functions and s strains: `links.beams.metric`.

    tangents : (E, n) x' at the Gauss points from the position; gradients : (K, n) the g_k of all nodes from it
    node, drawn : (K,) their nodes, (K, 3) their values in the reference position
    directors : (m, 2, 3) n1, n2 in the reference position
    N, D : (E, m) interpolation and its derivative by arc length; bend : (E, 4) n1'·t, n2'·t, n1'·n2, n2'·n1 in the
        reference position
    pairs : (P, 2) pairs of gradient functions of the strains within sections
    stiffness : (s,) of the strains, times the lengths of the Gauss weights; s = 6 E + P
    drawn_strains : (s,) values of the formulas in the reference position
    rows, share : (s, 3n) strains of small displacements; (3n, s) a displacement with given strains
    """

    tangents: Float[np.ndarray, "E n"]
    gradients: Float[np.ndarray, "K n"]
    node: Int[np.ndarray, " K"]
    drawn: Float[np.ndarray, "K 3"]
    directors: Float[np.ndarray, "m 2 3"]
    N: Float[np.ndarray, "E m"]
    D: Float[np.ndarray, "E m"]
    bend: Float[np.ndarray, "E 4"]
    pairs: Int[np.ndarray, "P 2"]
    stiffness: Float[np.ndarray, " s"]
    drawn_strains: Float[np.ndarray, " s"]
    rows: Float[np.ndarray, "s k"]
    share: Float[np.ndarray, "k s"]


@dataclass(frozen=True, slots=True)
class Frame:
    """A part of a segment's strain energy, ½ gᵀ K0 g, in a frame fitted to a part of the segment's shape.

    fit : (n, 3) weights of the frame's rotation: that of Σ x_a ⊗ fit_a
    K0 : (dn, dn) [N/m]
    point : of a planar beam, one of its Gauss points
    """

    fit: Float[np.ndarray, "n 3"]
    K0: Matrix
    point: BeamPoint | None = None


@dataclass(frozen=True, slots=True)
class LinkFace:
    """A named face of a solid link.

    face : its geometry, with sides of the mesh that the link was made from
    facets : facets of the link's basis on it; of a segment its own
    """

    face: Face
    facets: Int[np.ndarray, " f"]


@dataclass(frozen=True, slots=True)
class Link:
    """A link as the dynamics sees it; all arrays are for the reference position, R = I.

    name : key of the link in the scene.
    kind : ``solid``, ``spatial_beam``: rows of a state are (u, v, w); ``plane``: (u, v); ``beam``: (u, v, ψ),
        [KED, eq. (21)].
    X : (n, 3) coefficients of position, Σ N_a X_a = x: of nodal functions their nodes [m], of slopes directions [-].
    one : (n,) coefficients of the constant, Σ N_a one_a = 1 [-].
    cells, cell_type : elements in VTK order and their meshio name; of a spatial beam by stations (`triples`).
    axes : (3, 3) columns are the link axes (x along the link) in the reference position.
    mass : one scalar (n, n) matrix per component [kg; ψ: kg m²]; all the same object, except of planar beams.
    K0 : (dn, dn) stiffness in the link frame, dof d·node + component [N/m].
    m1 : (n, d) mass times one, component by component [kg].
    mX : (n, 3) mass times position [kg m].
    volume : (n,) ∫ N_a dV of the link alone, without attached bodies [m³].
    E, lame : Young's modulus and Lamé's (λ, μ) [Pa], for stresses; of a plane link those of plane stress.
    section : of a beam, else None.
    basis : scikit-fem basis of a solid or plane link (for this room only), else None.
    triples : of a spatial beam, (3s, n): (u, p, q) at each station of its axis from the state; else None.
    thickness : of a plane link [m], else one: what integrals over its area or edges are multiplied by.
    full, Q : of a reduced link the link that it was made from and its functions there, (n_full, n); its matrices are
        dense. Else None.
    rigid : whether the link only moves rigidly; then it has no stress
    anywhere : whether any point in space is a point of the link, as of one without a shape
    fit : (n, 3) of a segment with a co-rotational frame: weights of its rotation, that of Σ x_a ⊗ fit_a; else None
    frames : of a segment with several co-rotational frames: its strain energy in parts, K0 their sum
    element : of a segment of a beam in space: its strains, exact for any rotation, K0 their linearisation
    faces : named faces, of a solid from CAD or from a mesh file with groups
    method : how the mesh was made, in words
    cuts : (c,) facets of the basis between two segments: no surface of the link
    """

    name: str
    kind: Kind
    X: Float[np.ndarray, "n 3"]
    one: Float[np.ndarray, " n"]
    cells: Int[np.ndarray, "e m"]
    cell_type: str
    axes: Float[np.ndarray, "3 3"]
    mass: Mass
    K0: Matrix
    m1: Float[np.ndarray, "n d"]
    mX: Float[np.ndarray, "n 3"]
    volume: Float[np.ndarray, " n"]
    E: float
    lame: tuple[float, float]
    section: Section | None = None
    basis: Any = None
    triples: Matrix | None = None
    thickness: float = 1.0
    full: "Link | None" = None
    Q: Float[np.ndarray, "_ n"] | None = None
    rigid: bool = False
    anywhere: bool = False
    fit: Float[np.ndarray, "n 3"] | None = None
    frames: tuple[Frame, ...] = ()
    element: BeamElement | None = None
    faces: tuple[LinkFace, ...] = ()
    method: str = ""
    cuts: Int[np.ndarray, " c"] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def n(self) -> int:
        """Number of scalar functions; the link has d·n unknowns."""
        return len(self.X)

    @property
    def d(self) -> int:
        """Components of a row of the state."""
        return len(self.mass)

    @property
    def unknowns(self) -> int:
        """d·n."""
        return self.d * self.n

    @property
    def nodes(self) -> Float[np.ndarray, "k 3"]:
        """Nodes of the link: coefficients of position of functions that are values, not slopes [m]."""
        return np.asarray(self.X[self.one != 0])

    @property
    def size(self) -> float:
        """Largest extent along a reference axis [m]; of a reduced link that of the link it was made from."""
        return float(np.ptp((self.full or self).nodes, axis=0).max())

    @property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Centre of mass in the reference position, with attached bodies [m]."""
        return np.asarray(self.one @ self.mX / (self.one @ self.m1[:, 0]))

    @property
    def planar(self) -> bool:
        """Whether the link moves in a plane z = constant only."""
        return self.kind in {"plane", "beam"}

    @property
    def meshed(self) -> bool:
        """Whether the link is a mesh with bores and faces, not a line."""
        return self.kind in {"solid", "plane"}


def section_of(link: Link) -> Section:
    """The section of a beam; TypeError of another link."""
    if link.section is None:
        raise TypeError(f"links.{link.name}: has no section")
    return link.section


def as_rows(link: Link, vectors: Float[np.ndarray, "*k 3"]) -> Float[np.ndarray, "*k d"]:
    """Forces or accelerations in space as rows of a link's state: of a planar link their components in the plane."""
    match link.kind:
        case "beam":
            return vectors * [1.0, 1.0, 0.0]  # the third row is a moment
        case _:
            return vectors[..., : link.d]


def in_space(link: Link, rows: Float[np.ndarray, "*k d"]) -> Float[np.ndarray, "*k 3"]:
    """Translations or forces in space from rows of a link's state."""
    match link.kind:
        case "beam":
            return rows * [1.0, 1.0, 0.0]
        case "plane":
            return np.concatenate([rows, np.zeros((*rows.shape[:-1], 1))], axis=-1)
        case _:
            return rows


def mass_times(mass: Mass, u: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
    """M u for a state u, component by component: M = m ⊗ I3, [KED, eqs. (9)(11)]."""
    if all(m is mass[0] for m in mass):
        return np.asarray(mass[0] @ u)
    out = np.empty_like(u)
    for k, m in enumerate(mass):
        out[:, k] = m @ np.ascontiguousarray(u[:, k])
    return out


def mass_times_over(mass: Mass, u: Float[np.ndarray, "T n d"]) -> Float[np.ndarray, "T n d"]:
    """M u for states u at many times."""
    T, n, d = u.shape
    columns = u.transpose(1, 2, 0)  # (n, d, T)
    if all(m is mass[0] for m in mass):
        out = np.asarray(mass[0] @ columns.reshape(n, d * T)).reshape(n, d, T)
    else:
        out = np.stack([m @ np.ascontiguousarray(columns[:, k]) for k, m in enumerate(mass)], axis=1)
    return np.ascontiguousarray(out.transpose(2, 0, 1))


def mass_constants(
    mass: Mass, one: Float[np.ndarray, " n"], X: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n d"], Float[np.ndarray, "n 3"]]:
    """(m·1, m·X) [kg, kg m], by which a link's inertia load −M R0'' is determined, [KED, eq. (17)]."""
    m1 = mass_times(mass, np.repeat(one[:, None], len(mass), axis=1))
    mX = np.asarray(mass[0] @ X)
    return m1, mX


def read_only(*arrays: np.ndarray) -> None:
    """Mark arrays of a record as constant."""
    for a in arrays:
        a.setflags(write=False)
