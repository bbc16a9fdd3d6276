"""The surfaces of a mechanism's links in the frames of an animation, for a browser."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.output.bars import LINES, THINNEST, heights, rims
from kedfem.output.fields import BODY, DISPLACEMENT, LINK, SPRING, VON_MISES
from kedfem.output.rendering import QUADRILATERAL, SHARP
from kedfem.output.stress_files import KINDS
from kedfem.output.views import LIFT
from kedfem.vectors import nearest_rotations

NODES = 20_000  # most nodes on the surfaces of all links that a browser draws quickly
HIGHEST = f"{KINDS[0]} stress [Pa]"
Places = Float[np.ndarray, "n 3"]


@dataclass(frozen=True, slots=True)
class Placement:
    """Rigid-body position of a link: x = p + R X.

    p : (3,) [m]
    R : (3, 3)
    """

    p: Float[np.ndarray, "3"]
    R: Float[np.ndarray, "3 3"]


@dataclass(slots=True)
class Surface:
    """One link's surface.

    name : name of the link
    triangles : (t, 3) numbers of its points
    points : (n, 3) in the reference position [m], then in the link's axes for each frame, elastic displacement scaled
    stress : (n,) highest von Mises stress over all steps [Pa], then that of each frame; nan without stress
    placements : rigid-body position for each frame
    spring : whether it is a spring, which stretches
    """

    name: str
    triangles: Int[np.ndarray, "t 3"]
    points: list[Places] = field(default_factory=list)
    stress: list[Float[np.ndarray, " n"]] = field(default_factory=list)
    placements: list[Placement] = field(default_factory=list)
    spring: bool = False

    @property
    def stressed(self) -> bool:
        """Whether any point has a stress."""
        return any(np.isfinite(each).any() for each in self.stress)

    def world(self) -> Iterator[Places]:
        """Its points (n, 3) in the reference position, then in each frame [m]."""
        yield self.points[0]
        for points, placed in zip(self.points[1:], self.placements, strict=True):
            yield placed.p + points @ placed.R.T


class _Source:
    """The source of a link's surface: its points in the frames, and the relation of surface points to them.

    name : name by :func:`links_of`
    part : its elements
    ids : (m,) numbers of its points in a frame
    X : (m, 3) these points in the reference position [m]
    lift : displacement along z that separates planar links of one plane [m]
    """

    def __init__(self, name: str, part: Any, ids: Int[np.ndarray, " m"], X: Places, lift: float) -> None:
        self.part, self.ids, self.X, self.lift = part, ids, X, lift
        self.elastic = DISPLACEMENT in part.point_data
        self.beams = self.elastic and bool(np.isin(part.celltypes, list(LINES)).all())
        self.sizes = heights(part) if self.beams else np.zeros((0, 2))
        self.tube: Places | None = None
        self.kept = np.zeros(0, int)
        plain = next(name.removeprefix(what) for what in (LINK, BODY, SPRING) if name.startswith(what))
        self.surface = Surface(plain, np.zeros((0, 3), int), spring=name.startswith(SPRING))

    def outline(self, halvings: int) -> int:
        """Determine the surface, quadratic faces halved `halvings` times; returns its number of points."""
        outer = self._outer(halvings).triangulate()
        if not outer.n_cells:
            return 0
        return self._keep(outer.compute_normals(cell_normals=False, split_vertices=True, feature_angle=SHARP))

    def _outer(self, halvings: int) -> Any:
        """The surface in the reference position, with the numbers of its source points; empty for a single point."""
        import pyvista

        part = self.part.copy()
        part.points = self.X
        if self.beams:
            part.point_data["MPa"] = np.zeros(part.n_points)
            points, faces, _ = rims(part, self.sizes)
            outer = pyvista.PolyData(points, faces)
        else:
            part.point_data["id"] = np.arange(part.n_points)
            outer = part.extract_surface(nonlinear_subdivision=halvings, algorithm="dataset_surface")
            if outer.n_lines:  # a rigid link without a section
                outer = outer.tube(radius=THINNEST * part.length, capping=True)
                self.tube = np.asarray(outer.points, float)
        if self.beams or self.tube is not None:
            outer.point_data["id"] = np.arange(outer.n_points)
        outer.verts = np.zeros(0, int)
        return outer

    def thin(self, share: float) -> int:
        """Leave out points of flat parts until about a share of all is left; returns their number."""
        import pyvista

        faces = np.column_stack([np.full(len(self.surface.triangles), 3), self.surface.triangles])
        outer = pyvista.PolyData(self._shape(self.X, np.zeros(len(self.X)))[0], faces.ravel())
        outer.point_data["id"] = self.kept
        return self._keep(outer.decimate_pro(1.0 - share, preserve_topology=True))

    def _keep(self, outer: Any) -> int:
        self.kept = np.asarray(outer.point_data["id"])
        # VTK's may be `longlong`
        self.surface.triangles = np.asarray(outer.faces).reshape(-1, 4)[:, 1:].astype(np.int64)
        return len(self.kept)

    def drawn(self, highest: Float[np.ndarray, " n"]) -> None:
        """Add the link in the reference position, with the highest stresses over all steps."""
        self._add(self.X, highest[self.ids])

    def frame(self, grid: Any, scale: float) -> None:
        """Add the link in a frame with scaled displacements."""
        x = np.asarray(grid.points)[self.ids]
        moved, stress = np.zeros_like(x), np.full(len(x), np.nan)
        if self.elastic:
            moved = scale * np.asarray(grid.point_data[DISPLACEMENT])[self.ids]
            stress = np.asarray(grid.point_data[VON_MISES])[self.ids]
        placed = placement(self.X, x - moved, flat=self.beams)
        # a spring has its length in the frame, not that of the reference position
        self._add((x - placed.p) @ placed.R if self.surface.spring else self.X + moved @ placed.R, stress)
        self.surface.placements.append(placed)

    def _add(self, points: Places, stress: Float[np.ndarray, " m"]) -> None:
        shape, stress = self._shape(points, stress)
        self.surface.points.append(shape)
        self.surface.stress.append(stress)

    def _shape(
        self, points: Places, stress: Float[np.ndarray, " m"]
    ) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, " k"]]:
        """The surface's points and their stress, from those of the link."""
        if self.tube is not None:
            return self.tube[self.kept], np.full(len(self.kept), np.nan)
        if self.beams:
            self.part.points, self.part.point_data["MPa"] = points, stress
            points, _, stress = rims(self.part, self.sizes)
        return points[self.kept] + [0.0, 0.0, self.lift], stress[self.kept]


def placement(X: Places, x: Places, flat: bool = False) -> Placement:
    """The rigid-body motion that takes points X to x, by least squares [Kabsch 1976].

    Parameters
    ----------
    flat : whether they stay in a plane z = constant, since points on a line do not determine the rotation about it
    """
    centre, there = X.mean(axis=0), x.mean(axis=0)
    R = nearest_rotations((x - there).T @ (X - centre), flat)
    return Placement(there - R @ centre, R)


def sources_of(first: Any, reference: Any) -> tuple[list[_Source], tuple[str, ...]]:
    """The links of a frame with sufficiently small surfaces, and descriptions of what was left out."""
    X = np.array(first.points, float)
    highest = np.full(first.n_points, np.nan)
    if reference is not None and reference.n_points <= first.n_points:
        known = reference.n_points
        X[:known] = reference.points
        if HIGHEST in reference.point_data:
            highest[:known] = reference.point_data[HIGHEST]
    sources: list[_Source] = []
    for name, cells in links_of(first):
        part = first.extract_cells(cells)
        ids = np.asarray(part.point_data["vtkOriginalPointIds"])
        lift = len(sources) * LIFT * first.length if QUADRILATERAL in set(part.celltypes) else 0.0
        source = _Source(name, part, ids, X[ids], lift)
        if source.outline(1):
            sources.append(source)
    thinned = _thinned(sources)
    for source in sources:
        source.drawn(highest)
    return sources, thinned


def _thinned(sources: Sequence[_Source]) -> tuple[str, ...]:
    """Make surfaces small enough for a browser; returns descriptions of what was left out."""
    total = sum(len(source.kept) for source in sources)
    if total <= NODES:
        return ()
    fewer = sum(source.outline(0) for source in sources)
    if fewer > NODES:
        fewer = sum(source.thin(NODES / fewer) for source in sources)
    return (f"{fewer:,} of {total:,} nodes on the links' surfaces are drawn",)


def links_of(grid: Any) -> Iterator[tuple[str, Int[np.ndarray, " e"]]]:
    """Names of links, masses and springs in a file, with their first word there, and their elements."""
    for key in grid.field_data.keys():  # noqa: SIM118
        if key.startswith((LINK, BODY, SPRING)):
            cells = np.flatnonzero(grid.cell_data["link"] == int(grid.field_data[key][0]))
            if len(cells):
                yield key, cells
