"""The surfaces of a mechanism's links over an animation, from its frames: what a browser draws."""

import logging
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import OutputError
from kedfem.output.bars import LINES, THINNEST, heights, rims
from kedfem.output.derived import STEM, WORST
from kedfem.output.rendering import LIFT, QUADRILATERAL, SHARP, view
from kedfem.output.stress_files import ENVELOPE, KINDS

FRAMES, NODES = 120, 20_000
"""Most frames, and most nodes on the surfaces of all links: what a browser draws at once."""

HIGHEST = f"{KINDS[0]} stress [Pa]"
Places = Float[np.ndarray, "n 3"]


@dataclass(frozen=True, slots=True)
class Placement:
    """Where the rigid-body motion takes a link: x = p + R X.

    p : (3,) [m]
    R : (3, 3)
    """

    p: Float[np.ndarray, "3"]
    R: Float[np.ndarray, "3 3"]


@dataclass(slots=True)
class Surface:
    """One link's surface.

    name : of the link
    triangles : (t, 3) of its points
    points : (n, 3) each, first as drawn [m], then one a frame: in the link's axes, elastic displacement exaggerated
    stress : (n,) each, first the highest over all steps, then one a frame: von Mises [Pa]; nan where there is none
    placements : one a frame
    """

    name: str
    triangles: Int[np.ndarray, "t 3"]
    points: list[Places] = field(default_factory=list)
    stress: list[Float[np.ndarray, " n"]] = field(default_factory=list)
    placements: list[Placement] = field(default_factory=list)

    @property
    def stressed(self) -> bool:
        """Whether it has stress anywhere."""
        return any(np.isfinite(each).any() for each in self.stress)

    def world(self) -> Iterator[Places]:
        """(n, 3) its points as drawn, and where they are in each frame [m]."""
        yield self.points[0]
        for points, placed in zip(self.points[1:], self.placements, strict=True):
            yield placed.p + points @ placed.R.T


@dataclass(frozen=True, slots=True)
class Animated:
    """What the frames of a run show.

    times : (f,) of the frames [s]
    surfaces : of all links
    seen_from : (3,) unit vector towards an eye that sees the highest stress; None where it is not known
    thinned : what was left out to keep the page small, in words; empty if nothing was
    """

    times: Float[np.ndarray, " f"]
    surfaces: list[Surface]
    seen_from: Float[np.ndarray, "3"] | None
    thinned: tuple[str, ...]


def animated(folder: Path, deformation_scale: float) -> Animated | None:
    """The surfaces of a run's links in all its frames; of a run without animation as drawn; None without either.

    Parameters
    ----------
    folder : of the results
    deformation_scale : by which the frames exaggerate the elastic displacement [-]

    Raises
    ------
    OutputError
        A file is not one that kedfem wrote.
    """
    files = _frames(folder)
    count = min(len(files), FRAMES)
    shown = [files[k] for k in np.linspace(0, len(files) - 1, count).round().astype(int)]
    drawn = folder / ENVELOPE
    pattern = shown[0] if shown else folder / WORST if (folder / WORST).exists() else drawn
    if not pattern.exists():
        return None
    first = _read(pattern)
    reference = _read(drawn) if drawn.exists() else None
    sources, thinned = _sources(first, reference)
    times = []
    for path in shown:
        grid = _read(path)
        if grid.n_points != first.n_points:
            raise OutputError(
                f"{path}: must have the mesh of {pattern.name}, got another one: run the scene again"
            )
        times.append(float(grid.field_data["TimeValue"][0]))
        for source in sources:
            source.frame(grid, deformation_scale)
    if len(shown) < len(files):
        thinned += (f"{len(shown)} of {len(files)} frames are shown",)
    if not sources:
        return None
    worst = folder / WORST
    eye = view(_read(worst), np.zeros(3)).direction if worst.exists() else None
    return Animated(np.array(times), [source.surface for source in sources], eye, thinned)


def _frames(folder: Path) -> list[Path]:
    """Frames that the animation's list names, in its order."""
    import xml.etree.ElementTree as ET

    listed = folder / f"{STEM}.pvd"
    if not listed.exists():
        return []
    try:
        names = [each.attrib["file"] for each in ET.parse(listed).iter("DataSet")]
    except (ET.ParseError, KeyError, OSError) as error:
        raise OutputError(f"{listed}: must be a list of frames, got a damaged file") from error
    return [path for path in (folder / Path(name).name for name in names) if path.exists()]


def _read(path: Path) -> Any:
    """A VTU file.

    Raises
    ------
    OutputError
        It is not one of kedfem's, or damaged.
    """
    import pyvista

    wanted = f"{path}: must be a file of kedfem's"
    with _quiet():
        try:
            grid = pyvista.read(path)
            known = "link" in grid.cell_data and np.isfinite(grid.points).all()
        except Exception as error:
            raise OutputError(f"{wanted}, got one that cannot be read") from error
    if not grid.n_points or not known:
        raise OutputError(f"{wanted}, got one that is damaged or has no links")
    return grid


@contextmanager
def _quiet() -> Iterator[None]:
    """VTK, and those who tell its messages again, say nothing on the terminal."""
    import pyvista

    with pyvista.vtk_verbosity("off"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        logging.disable()
        try:
            yield
        finally:
            logging.disable(logging.NOTSET)


class _Source:
    """Where a link's surface is in the frames: its points there, and how surface points follow from them.

    Parameters
    ----------
    part : its elements
    ids : (m,) which points of a frame are its own
    X : (m, 3) where these are as drawn [m]
    lift : along z, so that planar links that lie in one plane do not flicker through each other [m]
    """

    def __init__(self, name: str, part: Any, ids: Int[np.ndarray, " m"], X: Places, lift: float) -> None:
        self.part, self.ids, self.X, self.lift = part, ids, X, lift
        self.elastic = "displacement" in part.point_data
        self.beams = self.elastic and bool(np.isin(part.celltypes, list(LINES)).all())
        self.sizes = heights(part) if self.beams else np.zeros((0, 2))
        self.tube: Places | None = None
        self.kept = np.zeros(0, int)
        self.surface = Surface(name, np.zeros((0, 3), int))

    def outline(self, halvings: int) -> int:
        """Find the surface, faces of quadratic elements halved so many times; how many points it has."""
        outer = self._outer(halvings).triangulate()
        if not outer.n_cells:
            return 0
        return self._keep(outer.compute_normals(cell_normals=False, split_vertices=True, feature_angle=SHARP))

    def _outer(self, halvings: int) -> Any:
        """The surface as drawn, with the numbers of the points that it is made of; empty of a point."""
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
            if outer.n_lines:  # of a rigid link that has no section
                outer = outer.tube(radius=THINNEST * part.length, capping=True)
                self.tube = np.asarray(outer.points, float)
        if self.beams or self.tube is not None:
            outer.point_data["id"] = np.arange(outer.n_points)
        outer.verts = np.zeros(0, int)
        return outer

    def thin(self, share: float) -> int:
        """Leave out points where the surface is flat, so that about a share of them stays."""
        import pyvista

        faces = np.column_stack([np.full(len(self.surface.triangles), 3), self.surface.triangles])
        outer = pyvista.PolyData(self._shape(self.X, np.zeros(len(self.X)))[0], faces.ravel())
        outer.point_data["id"] = self.kept
        return self._keep(outer.decimate_pro(1.0 - share, preserve_topology=True))

    def _keep(self, outer: Any) -> int:
        self.kept = np.asarray(outer.point_data["id"])
        self.surface.triangles = np.asarray(outer.faces.reshape(-1, 4)[:, 1:])
        return len(self.kept)

    def drawn(self, highest: Float[np.ndarray, " n"]) -> None:
        """The link as drawn, with the highest stresses over all steps."""
        self._add(self.X, highest[self.ids])

    def frame(self, grid: Any, scale: float) -> None:
        """The link in a frame, whose displacements are exaggerated."""
        x = np.asarray(grid.points)[self.ids]
        moved, stress = np.zeros_like(x), np.full(len(x), np.nan)
        if self.elastic:
            moved = scale * np.asarray(grid.point_data["displacement"])[self.ids]
            stress = np.asarray(grid.point_data["von_mises"])[self.ids]
        placed = placement(self.X, x - moved, flat=self.beams)
        self._add(self.X + moved @ placed.R, stress)
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
    flat : whether they stay in a plane z = constant; points on a line do not tell how they turn about it
    """
    if flat:
        up = np.array([0.0, 0.0, float(np.ptp(X, axis=0).max()) or 1.0])
        X, x = np.concatenate([X, X + up]), np.concatenate([x, x + up])
    centre, there = X.mean(axis=0), x.mean(axis=0)
    U, _, Vt = np.linalg.svd((X - centre).T @ (x - there))
    R = Vt.T @ np.diag([1.0, 1.0, np.linalg.det(Vt.T @ U.T)]) @ U.T
    return Placement(there - R @ centre, R)


def _sources(first: Any, reference: Any) -> tuple[list[_Source], tuple[str, ...]]:
    """The links of a frame with surfaces that are small enough, and what was left out."""
    X = np.array(first.points, float)
    highest = np.full(first.n_points, np.nan)
    if reference is not None and reference.n_points <= first.n_points:
        known = reference.n_points  # sliders without a shape are not in the envelope
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
    """Make surfaces small enough for a browser; what was left out, in words."""
    total = sum(len(source.kept) for source in sources)
    if total <= NODES:
        return ()
    fewer = sum(source.outline(0) for source in sources)
    if fewer > NODES:
        fewer = sum(source.thin(NODES / fewer) for source in sources)
    return (f"{fewer:,} of {total:,} nodes on the links' surfaces are drawn",)


def links_of(grid: Any) -> Iterator[tuple[str, Int[np.ndarray, " e"]]]:
    """Names of the links in a file, and their elements."""
    for key in grid.field_data.keys():  # noqa: SIM118
        if key.startswith("link "):
            cells = np.flatnonzero(grid.cell_data["link"] == int(grid.field_data[key][0]))
            if len(cells):
                yield key.removeprefix("link "), cells


def extent(surfaces: Sequence[Surface]) -> Float[np.ndarray, "3"]:
    """What all links take up along x, y and z, as drawn and in all frames [m]."""
    low, high = bounds(surfaces, np.eye(3))
    return np.asarray(high - low)


def bounds(
    surfaces: Sequence[Surface], axes: Float[np.ndarray, "3 3"]
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Lowest and highest coordinates of all links along axes, the rows, as drawn and in all frames [m]."""
    every = [points @ axes.T for each in surfaces for points in each.world()]
    low, high = [x.min(axis=0) for x in every], [x.max(axis=0) for x in every]
    return np.asarray(np.min(low, axis=0)), np.asarray(np.max(high, axis=0))
