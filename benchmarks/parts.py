"""Parts to compare elements by: deflection and stress under a load, free frequencies, without any singularity.

A force spread over one coupling surface is balanced by the mean reactions of the other, as a joint's forces are.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import LinearOperator, eigsh

from benchmarks.pages import seconds
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.matrices.substructure import effective_matrix
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.links.build import link_axes
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link, mass_times
from kedfem.links.recovery import von_mises
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, joint_surface
from kedfem.mesh import SolidMesh, link_mesh
from kedfem.mesh.elements.hexahedra import linear, quadratic, serendipity
from kedfem.mesh.elements.tetrahedra import tetrahedral
from kedfem.scene import Arc, Bar, Extrusion, LinkScene, Material, Meshing, PlateLink

STEEL = Material(density=7850.0, youngs_modulus=2.1e11, poisson_ratio=0.3)
FORMS = {"hex27": quadratic, "hex20": serendipity, "tet10": tetrahedral, "hex8": linear}
MODES = 3  # frequencies that are compared
MANY = 20_000  # unknowns from which factoring is timed but once
RIGID = 6

Size = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class BenchPart:
    """A part, how it is loaded and which meshes it gets.

    name : in tables
    shape : from one coupling surface, that reacts, to the other, that is loaded
    ends : the coupling surfaces of an extrusion [m]; of others where the shape says
    force : (3,) its direction
    stressed : (3,) where the stress is read [m]
    near : of the order of the first free frequency [Hz]
    sizes : meshes of each element: along, across, through of a bar; across and through of a plate
    reference : mesh of hex27 whose results are taken as exact
    moved : how far corners inside the mesh are moved at random, of the elements' sides
    """

    name: str
    shape: Bar | PlateLink | Extrusion
    force: tuple[float, float, float]
    stressed: tuple[float, float, float]
    near: float
    sizes: dict[str, tuple[Size, ...]]
    reference: Size
    moved: float = 0.0
    ends: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """What a mesh answers [m, Hz, Pa], and its work: unknowns, seconds to factor the effective matrix and to solve."""

    values: dict[str, Float[np.ndarray, " k"]]
    unknowns: int
    factor: float
    solve: float

    def errors(self, exact: "Answer") -> dict[str, float]:
        """Greatest relative error of each quantity."""
        return {name: float(np.abs(found / exact.values[name] - 1).max()) for name, found in self.values.items()}


def answer(part: BenchPart, element: str, size: Size, repeats: int) -> Answer:
    """Mesh, solve and time a part."""
    link = part_link(part, element, size)
    deflection, u = loaded(part, link)
    stress = von_mises((point_rows(link, "stress", np.asarray(part.stressed)).stress @ u.ravel())[None])
    values = {"deflection": np.array([deflection]), "frequencies": frequencies(link, part.near), "stress": stress}
    return Answer(values, 3 * link.n, *_work(link, repeats))


def part_link(part: BenchPart, element: str, size: Size) -> Link:
    """The record of a part, meshed."""
    scene = LinkScene(material="steel", shape=part.shape, mesh=_meshing(size), element="hex27")
    mesh = link_mesh(part.name, scene, Path())
    if part.moved:
        mesh = _moved(linear(mesh), part.moved, size)
    return solid_link(part.name, FORMS[element](mesh), STEEL, link_axes(scene))


def _meshing(size: Size) -> Meshing:
    if len(size) == 3:
        return Meshing(elements=size)
    return Meshing(elements_across=size[0], layers=size[1])


def _moved(mesh: SolidMesh, part: float, counts: Size) -> SolidMesh:
    """A box's hex8 mesh with its corners moved at random, within the faces that they lie on."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    spacing = (high - low) / counts
    inside = (mesh.points > low + 1e-6 * spacing) & (mesh.points < high - 1e-6 * spacing)
    moves = part * spacing * np.random.default_rng(1).uniform(-1, 1, mesh.points.shape)
    return SolidMesh(mesh.points + inside * moves, mesh.cells)


def loaded(part: BenchPart, link: Link) -> tuple[float, Float[np.ndarray, "n 3"]]:
    """Mean deflection of the loaded coupling surface under a unit force, along it, as seen from the other; and the link's
    state."""
    fixed, moved = (joint_surface(link, "coupling surface", np.asarray(end), None) for end in ends(part))
    force = np.outer(moved.fit[0], np.asarray(part.force) / np.linalg.norm(part.force))
    modes = _rigid_modes(link, fixed.origin)
    u = _free_solution(link, modes, force + _reaction(fixed, modes, force))
    seen = np.linalg.lstsq(_fits(fixed, modes), (fixed.fit @ u).ravel(), rcond=None)[0]
    return float((force * (u - modes @ seen)).sum()), u


def ends(part: BenchPart) -> tuple[tuple[float, float, float], ...]:
    """The coupling surfaces, the loaded one last."""
    return part.ends if isinstance(part.shape, Extrusion) else part.shape.between


def _rigid_modes(link: Link, origin: Float[np.ndarray, "3"]) -> Float[np.ndarray, "n 3 6"]:
    """Translations along, and turns about, x, y, z through a point."""
    turns = [np.cross(axis, link.X - origin) for axis in np.eye(3)]
    return np.stack([*(np.tile(axis, (link.n, 1)) for axis in np.eye(3)), *turns], axis=2)


def _fits(surface: CouplingSurface, modes: Float[np.ndarray, "n 3 6"]) -> Float[np.ndarray, "12 6"]:
    """Value and gradient at a coupling surface of the rigid modes."""
    return np.asarray(np.einsum("cn,nik->cik", surface.fit, modes).reshape(-1, RIGID))


def _reaction(
    surface: CouplingSurface, modes: Float[np.ndarray, "n 3 6"], force: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """The forces in a coupling surface's mean value and gradient that balance a load."""
    resultant = np.einsum("ni,nik->k", force, modes)
    amounts = np.linalg.lstsq(_fits(surface, modes).T, -resultant, rcond=None)[0]
    return np.asarray(surface.fit.T @ amounts.reshape(-1, 3))


def _free_solution(
    link: Link, modes: Float[np.ndarray, "n 3 6"], force: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """K0 u = force of a load in equilibrium, six components held, in which no reactions arise."""
    held = scipy.linalg.qr(modes.reshape(-1, RIGID).T, mode="r", pivoting=True)[1][:RIGID]
    free = np.setdiff1d(np.arange(3 * link.n), held)
    u = np.zeros(3 * link.n)
    u[free] = Cholesky(sp.csr_array(link.K0[free][:, free]), link.name).solve(force.ravel()[free])
    return u.reshape(-1, 3)


def frequencies(link: Link, near: float) -> Float[np.ndarray, " k"]:
    """The first elastic frequencies of the free part [Hz], by Lanczos' method on what is free of rigid motion."""
    shift = (0.3 * 2 * np.pi * near) ** 2  # below zero: a free body needs no supports
    factor = Cholesky(effective_matrix(link, shift, 1.0), link.name)
    rigid, momenta = _rigid_motions(link)

    def inverse(b: np.ndarray) -> np.ndarray:
        x = np.array(factor.solve(np.ravel(b)))
        return np.asarray(x - rigid @ (momenta.T @ x))

    shape, start = link.K0.shape, np.random.default_rng(1).standard_normal(link.K0.shape[0])
    M = LinearOperator(shape, lambda v: mass_times(link.mass, v.reshape(-1, 3)).ravel(), dtype=float)
    squares = eigsh(
        link.K0, MODES + 1, M, sigma=-shift, OPinv=LinearOperator(shape, inverse, dtype=float),
        v0=inverse(start), tol=1e-9, return_eigenvectors=False,
    )  # fmt: skip
    return np.asarray(np.sqrt(np.sort(squares)[:MODES]) / (2 * np.pi))


def _rigid_motions(link: Link) -> tuple[Float[np.ndarray, "N 6"], Float[np.ndarray, "N 6"]]:
    """Six rigid motions Q with Qᵀ M Q = 1, and M Q."""
    Q = _rigid_modes(link, link.X.mean(axis=0)).reshape(-1, RIGID)
    MQ = np.stack([mass_times(link.mass, q.reshape(-1, 3)).ravel() for q in Q.T], axis=1)
    turned = np.linalg.inv(np.linalg.cholesky(Q.T @ MQ)).T
    return Q @ turned, MQ @ turned


def _work(link: Link, repeats: int) -> tuple[float, float]:
    """Median seconds to factor the effective matrix of a step of 0.1 ms, and to solve with it."""
    A = effective_matrix(link, generalised_alpha(1e-4, 1.0).a0, 1.0)
    kept: dict[str, Cholesky] = {}
    b = np.random.default_rng(1).standard_normal(A.shape[0])
    factor = seconds(lambda: kept.update(factor=Cholesky(A, link.name)), repeats if len(b) < MANY else 1)
    return factor, seconds(lambda: kept["factor"].solve(b), 10 * repeats)


BAR = BenchPart(
    "slender bar",
    Bar(between=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)), width=0.02, thickness=0.02),
    force=(0.0, 1.0, 0.0),
    stressed=(0.15, 0.01, 0.0),
    near=1100.0,
    sizes=dict.fromkeys(
        ("hex27", "hex20", "tet10"), ((2, 1, 1), (4, 1, 1), (8, 1, 1), (12, 2, 2), (24, 3, 3), (36, 4, 4))
    )
    | {"hex8": ((12, 2, 2), (24, 4, 4), (48, 6, 6), (72, 8, 8))},
    reference=(44, 5, 5),
)
#: A bar 40 mm high that steps down to 20 mm with fillets of 6 mm, anticlockwise from below left.
_MIDDLE = 0.006 * (1 - np.sqrt(0.5))
_SHOULDER = (
    (0.0, -0.02, 0.0),
    (0.06, -0.02, 0.0),
    (0.06, -0.016, 0.0),
    Arc(via=(0.06 + _MIDDLE, -0.01 - _MIDDLE, 0.0), to=(0.066, -0.01, 0.0)),
    (0.14, -0.01, 0.0),
    (0.14, 0.01, 0.0),
    (0.066, 0.01, 0.0),
    Arc(via=(0.06 + _MIDDLE, 0.01 + _MIDDLE, 0.0), to=(0.06, 0.016, 0.0)),
    (0.06, 0.02, 0.0),
    (0.0, 0.02, 0.0),
)
PARTS = (
    BAR,
    replace(
        BAR,
        name="slender bar, distorted mesh",
        moved=0.25,
        sizes={element: sizes for element, sizes in BAR.sizes.items() if element != "tet10"},  # they would fold
    ),
    BenchPart(
        "plate with bores",
        PlateLink(between=((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)), width=0.03, thickness=0.005, bore_diameter=0.015),
        force=(1.0, 0.0, 0.0),
        stressed=(-0.015, 0.0, 0.0),
        near=2000.0,
        sizes=dict.fromkeys(("hex27", "hex20", "tet10"), ((2, 1), (4, 1), (6, 2), (9, 2), (12, 3)))
        | {"hex8": ((4, 1), (8, 2), (16, 3), (20, 4))},
        reference=(16, 3),
    ),
    BenchPart(
        "bar with shoulder fillets",
        Extrusion(outline=_SHOULDER, thickness=0.01),
        force=(0.0, 1.0, 0.0),
        stressed=(0.066 - 0.006 * np.sin(np.pi / 8), 0.016 - 0.006 * np.cos(np.pi / 8), 0.0),
        near=5000.0,
        sizes=dict.fromkeys(("hex27", "hex20", "tet10"), ((1, 1), (2, 1), (3, 2), (4, 2), (6, 3)))
        | {"hex8": ((2, 1), (4, 2), (8, 4), (12, 6))},
        reference=(10, 4),
        ends=((0.0, 0.0, 0.0), (0.14, 0.0, 0.0)),
    ),
    BenchPart(
        "thin plate",
        Bar(between=((0.0, 0.0, 0.0), (0.2, 0.0, 0.0)), width=0.1, thickness=0.002),
        force=(0.0, 0.0, 1.0),
        stressed=(0.1, 0.0, 0.001),
        near=250.0,
        sizes=dict.fromkeys(
            ("hex27", "hex20", "tet10"), ((2, 1, 1), (4, 2, 1), (8, 4, 1), (16, 8, 1), (32, 16, 1), (40, 20, 1))
        )
        | {"hex8": ((16, 8, 1), (32, 16, 1), (64, 32, 1), (96, 48, 1))},
        reference=(48, 24, 2),
    ),
)
