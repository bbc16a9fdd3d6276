"""``python -m benchmarks.roads``: plates meshed as shapes of a scene, and the same plates as parts from CAD.

A plate link has a structured mesh, an extrusion one of its outline, a part from CAD one of its sections
(docs/meshing.md); all at their usual sizes. Errors are of the first free frequencies, against a mesh of the shape
with six elements across and two layers.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from types import ModuleType

import gmsh
import numpy as np
from geometry.drawing import box, disc, joined, without
from geometry.make import empty_model

from benchmarks.pages import script, table, write_page
from benchmarks.parts import STEEL, frequencies
from kedfem.links.solid import solid_link
from kedfem.mesh import SolidMesh, link_mesh, mesh_quality
from kedfem.mesh.cad.model import CadKeys
from kedfem.mesh.elements.tetrahedra import FORMS
from kedfem.mesh.methods import made_mesh
from kedfem.scene import Cad, Extrusion, LinkScene, Meshing, PlateLink, link_from

NEAR = 3000.0  # Hz, of the order of the first frequencies
FINE = Meshing(elements_across=6, layers=2)
HOLE = tuple[float, float, float]


def plate(length: float, width: float, thickness: float, bore: float) -> PlateLink:
    """A stadium with a bore at each end."""
    ends = ((0.0, 0.0, 0.0), (length, 0.0, 0.0))
    return PlateLink(between=ends, width=width, thickness=thickness, bore_diameter=bore)


def extrusion(corners: tuple[tuple[float, float], ...], thickness: float, holes: tuple[HOLE, ...]) -> Extrusion:
    """A polygon with holes (x, y, diameter)."""
    raw = {
        "kind": "extrusion", "outline": [[x, y, 0.0] for x, y in corners], "thickness": thickness,
        "holes": [{"at": [x, y, 0.0], "diameter": d} for x, y, d in holes],
    }  # fmt: skip
    shape = link_from({"material": "steel", "shape": raw}).shape
    if not isinstance(shape, Extrusion):
        raise TypeError("an extrusion was described")
    return shape


SHAPES: dict[str, PlateLink | Extrusion] = {
    "plate link 100 × 30 mm": plate(0.1, 0.03, 0.005, 0.015),
    "plate link 300 × 40 mm": plate(0.3, 0.04, 0.01, 0.02),
    "plate link 50 × 40 mm": plate(0.05, 0.04, 0.01, 0.02),
    "angle with three bores": extrusion(
        ((0, 0), (0.1, 0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.1), (0, 0.1)), 0.01,
        ((0.015, 0.015, 0.012), (0.085, 0.015, 0.01), (0.015, 0.085, 0.01))),
    "triangle with three bores": extrusion(
        ((0, 0), (0.12, 0), (0.06, 0.1)), 0.01,
        ((0.025, 0.015, 0.012), (0.095, 0.015, 0.012), (0.06, 0.075, 0.012))),
    "tapered rocker": extrusion(
        ((0, -0.015), (0.2, -0.03), (0.25, 0), (0.2, 0.03), (0, 0.015)), 0.012,
        ((0.0125, 0, 0.01), (0.2, 0, 0.02), (0.1, 0, 0.015))),
    "square with three bores": extrusion(
        ((0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)), 0.02,
        ((0.03, 0.03, 0.02), (0.07, 0.07, 0.02), (0.03, 0.07, 0.01))),
}  # fmt: skip


def drawn(occ: ModuleType, shape: PlateLink | Extrusion) -> None:
    """The same plate in OpenCASCADE, in metres."""
    half = shape.thickness / 2
    if isinstance(shape, PlateLink):
        (x, y, _), (end, *_) = shape.between
        bores = [(x, y, shape.bore_diameter), (end, y, shape.bore_diameter)]
        sides = (-shape.width / 2, shape.width / 2)
        eyes = [disc(occ, (at, y, shape.width / 2), (-half, half)) for at in (x, end)]
        body = joined(occ, [box(occ, (x, end), sides, (-half, half)), *eyes])
    else:
        bores = [(hole.at[0], hole.at[1], hole.diameter) for hole in shape.holes]
        points = [occ.addPoint(*corner[:2], -half) for corner in shape.outline if isinstance(corner, tuple)]
        lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
        face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        (body,) = (tag for kind, tag in occ.extrude([(2, face)], 0, 0, shape.thickness) if kind == 3)
    without(occ, body, [disc(occ, (x, y, d / 2), (-2 * half, 2 * half)) for x, y, d in bores])


@dataclass(frozen=True, slots=True)
class Meshed:
    """A mesh, and the processor time that it took [s]."""

    mesh: SolidMesh
    seconds: float

    def cells(self, exact: np.ndarray) -> tuple[str, ...]:
        """Unknowns, worst scaled Jacobian, seconds, greatest error of the frequencies."""
        error = np.abs(natural(self.mesh) / exact - 1).max()
        unknowns, least = 3 * len(self.mesh.points), mesh_quality(self.mesh).least
        return f"{unknowns:,}", f"{least:.2f}", f"{self.seconds:.2f}", f"{100 * error:.2g}"


def natural(mesh: SolidMesh) -> np.ndarray:
    """The first free frequencies [Hz]."""
    return frequencies(solid_link("plate", mesh, STEEL, np.eye(3)), NEAR)


def as_shape(link: LinkScene) -> Meshed:
    """As a shape of a scene."""
    start = process_time()
    made = link_mesh("plate", link, Path())
    return Meshed(made, process_time() - start)


def as_part(shape: PlateLink | Extrusion, folder: Path) -> Meshed:
    """As a part from CAD, in this process."""
    file = folder / "plate.brep"
    with empty_model() as occ:
        drawn(occ, shape)
        occ.synchronize()
        gmsh.write(str(file))
    cad = Cad(file=file.name, scale=1.0)
    link, start = LinkScene(material="steel", shape=cad), process_time()
    made = made_mesh(CadKeys(file.name, "solid"), "plate", link, cad, file)
    return Meshed(FORMS[str(link.element)](made), process_time() - start)


def roads(folder: Path, quick: bool) -> None:
    """The page performance/roads.md."""
    rows = []
    with TemporaryDirectory() as parts:
        for name, shape in list(SHAPES.items())[: 2 if quick else None]:
            exact = natural(as_shape(LinkScene(material="steel", shape=shape, mesh=FINE)).mesh)
            one, other = as_shape(LinkScene(material="steel", shape=shape)), as_part(shape, Path(parts))
            rows.append((name, *one.cells(exact), *other.cells(exact)))
    figures = ("unknowns", "least scaled Jacobian", "seconds", "error of frequencies [%]")
    header = ("plate", *(f"shape: {x}" for x in figures), *(f"CAD: {x}" for x in figures))
    write_page(folder, "performance/roads", [table(header, rows)])


if __name__ == "__main__":
    script(roads)
