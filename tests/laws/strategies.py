"""Random rotations, random valid hexahedra, quadrilaterals and beams: what the laws are tried on."""

import os
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from hypothesis import Phase, reject, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.section import Section, rectangle
from kedfem.links.plane import plane_link
from kedfem.links.record import Link
from kedfem.links.solid import solid_link
from kedfem.mesh import QuadMesh, SolidMesh, mesh_quality
from kedfem.mesh.elements.hexahedra import extruded, linear, quadratic, rectangle_quads, serendipity
from kedfem.mesh.elements.shape_functions import HEX27
from kedfem.mesh.elements.tetrahedra import tetrahedral
from kedfem.scene import Material


def examples(most: int) -> int:
    """How many random cases of a law are tried: `most` in .ci/run, two fifths of them else."""
    return most if os.environ.get("CI") else 2 * most // 5


# shrinking is left out: a smaller seed is no simpler mesh
LAW = settings(
    max_examples=examples(20), deadline=None, derandomize=True, database=None, phases=[Phase.explicit, Phase.generate]
)
VALID = 0.05  # least scaled Jacobian of a random element: det J > 0 at every node and Gauss point
# any material serves a law; this one is not close to a special case (ν = 0, ν = 1/2)
MATERIAL = Material(density=2700.0, youngs_modulus=70e9, poisson_ratio=0.33)
FORMS = {8: linear, 10: tetrahedral, 20: serendipity, 27: quadratic}

Mesh = TypeVar("Mesh", SolidMesh, QuadMesh)

seeds = st.integers(0, 2**32 - 1)
_angles = st.floats(-3.1, 3.1, allow_nan=False)  # up to half a revolution about any axis
rotations = st.tuples(_angles, _angles, _angles).map(lambda v: Rotation.from_rotvec(v).as_matrix())
planar_rotations = _angles.map(lambda a: Rotation.from_rotvec([0, 0, a]).as_matrix())
vectors = st.tuples(*[st.floats(-2.0, 2.0)] * 3).map(np.array)


@dataclass(frozen=True)
class Motion:
    """A rigid motion at one instant: x = R X + p, x' = ω × (x − p) + v."""

    R: np.ndarray
    p: np.ndarray
    omega: np.ndarray
    v: np.ndarray

    def moved(self, X: np.ndarray) -> np.ndarray:
        return X @ self.R.T + self.p

    def velocity(self, X: np.ndarray) -> np.ndarray:
        return np.cross(self.omega, X @ self.R.T) + self.v


motions = st.builds(Motion, rotations, vectors, vectors, vectors)


@st.composite
def hexahedra(draw: st.DrawFn, nodes: tuple[int, ...] = tuple(FORMS)) -> SolidMesh:
    """One element or a patch of 2 × 2 × 1, all nodes moved at random as far as det J allows."""
    random = np.random.default_rng(draw(seeds))
    along, across = draw(st.sampled_from([(1, 1), (2, 2)]))
    sides = random.uniform(0.3, 1.0, 3)
    mesh = extruded(*rectangle_quads(sides[0], sides[1], along, across), sides[2], 1)
    mesh = FORMS[draw(st.sampled_from(nodes))](mesh)
    spacing = sides / np.array([along, across, 1]) / (1 if mesh.cells.shape[1] == 8 else 2)
    return distorted(mesh, draw(st.floats(0.0, 0.5)) * spacing * random.uniform(-1, 1, mesh.points.shape))


@st.composite
def quadrilaterals(draw: st.DrawFn) -> QuadMesh:
    """One quad9 or a patch of 2 × 2, all nodes moved at random as far as det J allows, in a plane z = constant."""
    random = np.random.default_rng(draw(seeds))
    along, across = draw(st.sampled_from([(1, 1), (2, 2)]))
    sides = random.uniform(0.3, 1.0, 2)
    plane, cells = rectangle_quads(sides[0], sides[1], along, across)
    points = np.column_stack([plane, np.full(len(plane), random.uniform(-1, 1))])
    spacing = np.array([*(sides / np.array([along, across]) / 2), 0.0])
    mesh = QuadMesh(points, cells, random.uniform(0.01, 0.1))
    return distorted(mesh, draw(st.floats(0.0, 0.5)) * spacing * random.uniform(-1, 1, points.shape))


def plane(mesh: QuadMesh, axes: np.ndarray | None = None) -> Link:
    return plane_link("any", mesh, MATERIAL, np.eye(3) if axes is None else axes)


def distorted(mesh: Mesh, moves: np.ndarray) -> Mesh:
    """The mesh with its nodes moved, less far until it is valid."""
    for part in 0.5 ** np.arange(20):
        changed = replace(mesh, points=mesh.points + part * moves)
        if mesh_quality(changed).least >= VALID:
            return changed
    return reject()  # a drawing whose mesh is not valid as it is


def solid(mesh: SolidMesh, axes: np.ndarray | None = None) -> Link:
    return solid_link("any", mesh, MATERIAL, np.eye(3) if axes is None else axes)


def rotated(mesh: Mesh, motion: Motion) -> Mesh:
    return replace(mesh, points=motion.moved(mesh.points))


def patch(nodes: int, random: np.random.Generator) -> SolidMesh:
    """2 × 2 × 2 elements of a block, all nodes moved at random."""
    mesh = FORMS[nodes](extruded(*rectangle_quads(1.0, 0.8, 2, 2), 0.6, 2))
    return distorted(mesh, 0.06 * random.uniform(-1, 1, mesh.points.shape))


def ring(nodes: int = 27, around: int = 8) -> SolidMesh:
    """Hexahedra about a bore of radius 0.1 along z, outer radius 0.25, thickness 0.2."""
    radii = np.linspace(0.1, 0.25, 3)
    angle = np.arange(2 * around) * np.pi / around
    plane = np.stack([np.outer(np.cos(angle), radii), np.outer(np.sin(angle), radii)], axis=-1).reshape(-1, 2)
    quad9 = HEX27[[*range(4), *range(8, 12), 24]][:, :2]  # VTK: corners, middles of sides, middle
    middle = 2 * np.arange(around)[:, None] + 1
    cells = (middle + quad9[:, 1]) % (2 * around) * 3 + 1 + quad9[:, 0]
    return FORMS[nodes](extruded(plane, cells, 0.2, 1))


@st.composite
def rings(draw: st.DrawFn) -> SolidMesh:
    """Rings of quadratic elements whose nodes off the bore are moved at random."""
    random = np.random.default_rng(draw(seeds))
    mesh = ring(draw(st.sampled_from([20, 27])))
    off_bore = np.hypot(*mesh.points[:, :2].T) > 0.11
    moves = draw(st.floats(0.0, 0.03)) * random.uniform(-1, 1, mesh.points.shape)
    return distorted(mesh, np.where(off_bore[:, None], moves, 0.0))


@dataclass(frozen=True)
class Beam:
    """What a planar beam is made from; the link is made in the test (strategies must not run checked code)."""

    points: np.ndarray
    section: Section
    elements: int
    nodes: int

    def link(self, R: np.ndarray | None = None) -> Link:
        points = self.points if R is None else self.points @ R.T
        return beam_link("any", points, self.section, MATERIAL, self.elements, self.nodes)

    @property
    def length(self) -> float:
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())


@st.composite
def beams(draw: st.DrawFn) -> Beam:
    """One to three straight segments, elements of 2 to 5 nodes."""
    random = np.random.default_rng(draw(seeds))
    steps = random.uniform(0.3, 1.0, (draw(st.integers(1, 3)), 1)) * np.array([[1.0, 0.0, 0.0]])
    steps[:, 1] = random.uniform(-0.5, 0.5, len(steps))
    points = np.concatenate([random.uniform(-1, 1, (1, 3)), steps]).cumsum(axis=0)
    section = rectangle(*random.uniform(0.01, 0.1, 2).tolist())
    return Beam(points, section, draw(st.integers(1, 2)), draw(st.sampled_from([2, 3, 5])))


# Lobatto's points in closed form, ends first: Abramowitz and Stegun, table 25.6
LOBATTO = {
    2: [-1.0, 1.0],
    3: [-1.0, 1.0, 0.0],
    4: [-1.0, 1.0, -(5**-0.5), 5**-0.5],
    5: [-1.0, 1.0, -((3 / 7) ** 0.5), 0.0, (3 / 7) ** 0.5],
}


@st.composite
def curved_elements(draw: st.DrawFn) -> np.ndarray:
    """Nodes (m, 2) of one beam element: 2 nodes, or up to 5 on a curve that does not turn back."""
    random = np.random.default_rng(draw(seeds))
    r = np.array(LOBATTO[draw(st.sampled_from([2, 3, 4, 5]))])
    length = random.uniform(0.2, 2.0)
    nodes = np.outer((1 + r) / 2, [length, 0.0])
    bend = draw(st.floats(0.0, 0.2)) * length * random.uniform(-1, 1, 2)
    nodes += np.outer(1 - r * r, bend)
    turn = Rotation.from_rotvec([0, 0, random.uniform(-3, 3)]).as_matrix()[:2, :2]
    return nodes @ turn.T + random.uniform(-1, 1, 2)
