"""Which of several meshes of one area is taken: each relaxed, the first good one."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from kedfem.mesh.elements.quality import scaled_jacobian
from kedfem.mesh.planar.areas import PlaneQuads, Quads, pillowed
from kedfem.mesh.planar.relaxation import relaxed

GOOD = 0.5  # scaled Jacobian that is good enough: no more are tried
LARGE = 2000  # quadrilaterals from which time matters more than the last of quality
ITERATIONS = 150, 40  # of a relaxation at most, and of a large one
FAIR = 0.3  # scaled Jacobian below which subdivision, at four times the elements, is tried too


@dataclass(frozen=True, slots=True)
class Setting:
    """One way to let gmsh make quadrilaterals: its 2-D algorithm, recombination and subdivision."""

    algorithm: int
    recombination: int
    subdivision: int


#: All tried; the last, which leaves no triangles, if no other is fair. Not algorithm 11: it can hang.
SETTINGS = (*(Setting(plane, blossom, 0) for blossom in (3, 1) for plane in (6, 5, 8)), Setting(6, 1, 1))


@dataclass(frozen=True, slots=True)
class Candidate:
    """A relaxed mesh, the same before it was made quadratic, its worst scaled Jacobian and where it came from."""

    quality: float
    quads: Quads
    start: PlaneQuads
    tried: int

    @property
    def corners(self) -> PlaneQuads:
        """The relaxed mesh by its corners."""
        points, cells = self.quads
        count = len(self.start.points)
        return PlaneQuads(points[:count], cells[:, :4], self.start.rim, self.start.middles)


def best_quads(meshes: Iterable[PlaneQuads | None]) -> Candidate | None:
    """The mesh to take of those made under each of the settings, which may be None; None if all are.

    The first that is good; if none is, of those within a tenth of the best the one with the fewest elements.

    Parameters
    ----------
    meshes : in the order of SETTINGS; no more are asked for than needed
    """
    found: list[Candidate] = []
    for tried, mesh in enumerate(meshes):
        if mesh is not None:
            found += _relaxed_meshes(mesh, tried)
        best = max((candidate.quality for candidate in found), default=-1.0)
        if best >= GOOD or (tried == len(SETTINGS) - 2 and best >= FAIR):
            break
    enough = min(GOOD, best - 0.1 * abs(best)) if found else np.inf
    good = [candidate for candidate in found if candidate.quality >= enough]
    return min(good, key=lambda candidate: len(candidate.quads[1]), default=None)


def _relaxed_meshes(mesh: PlaneQuads, tried: int) -> list[Candidate]:
    """The mesh relaxed and, unless that is good, pillowed and relaxed."""
    found: list[Candidate] = []
    for start in (mesh, pillowed(mesh)):
        points, cells = relaxed(start, ITERATIONS[len(mesh.cells) > LARGE])
        quality = float(scaled_jacobian(points, cells).min())
        found.append(Candidate(quality, (points, cells), start, tried))
        if quality >= GOOD:
            break
    return found
