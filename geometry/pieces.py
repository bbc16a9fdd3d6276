"""``python -m geometry.pieces``: which parts of the catalogue fall into pieces to sweep, cut along their own faces.

Each part that is not swept as a whole is cut along the planes of all its plane faces and the cylinders of its bores and
journals. A piece counts as one to sweep if its faces lie along a direction or across it, turn about one axis, are swept
by an end along lines and arcs, or are six with four edges; whether pieces could share their nodes is not looked at.
"""

import sys
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from geometry import catalogue
from kedfem.errors import KedfemError
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.solid_faces import cad_faces
from kedfem.mesh.cad.solids import CadFace, Solid
from kedfem.mesh.layered.layers import layer_directions
from kedfem.mesh.layered.sections import plan_axes
from kedfem.mesh.session import gmsh_copy
from kedfem.mesh.swept.path import path
from kedfem.mesh.swept.revolved import revolution
from kedfem.scene import Cad

LONGEST = 60  # [s] for a part
FILLET = np.radians(100)  # that a cylinder turns: what turns less is a fillet or a rounded edge, and no place to cut
PLACE = CadKeys("part", "solid")


def cutting_faces(solid: Solid) -> list[CadFace]:
    """Plane faces, bores and journals, of those on one surface the first."""
    found: list[CadFace] = []
    for face in solid.faces:
        if face.kind == "plane" or (face.kind == "cylinder" and face.area > FILLET * face.radius * face.length):
            found += [] if any(same_surface(face, other, solid.extent) for other in found) else [face]
    return found


def same_surface(a: CadFace, b: CadFace, extent: float) -> bool:
    """Whether two planes, or two cylinders, are one."""
    if a.kind != b.kind or np.linalg.norm(np.cross(a.direction, b.direction)) > 1e-5:
        return False
    apart = b.centre - a.centre
    along = apart @ a.direction
    if a.kind == "plane":
        return bool(abs(along) < 1e-6 * extent)
    off = max(np.linalg.norm(apart - along * a.direction), abs(a.radius - b.radius))
    return bool(off < 1e-6 * extent)


def surface(gmsh: ModuleType, face: CadFace, extent: float) -> list[tuple[int, int]]:
    """The plane or cylinder of a face, beyond the part, in its size."""
    occ, at, axes = gmsh.model.occ, face.centre / extent, plan_axes(face.direction)
    if face.kind == "plane":
        corners = [at + x * axes[0] + y * axes[1] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        points = [occ.addPoint(*corner) for corner in corners]
        lines = [occ.addLine(points[i - 1], points[i]) for i in range(4)]
        return [(2, occ.addPlaneSurface([occ.addCurveLoop(lines)]))]
    tag = occ.addCylinder(*(at - face.direction), *(2 * face.direction), face.radius / extent)
    occ.synchronize()
    sides = [s for s in gmsh.model.getBoundary([(3, tag)], oriented=False) if gmsh.model.getType(*s) == "Cylinder"]
    occ.remove([(3, tag)])
    return sides


def swept(gmsh: ModuleType, tag: int) -> bool:
    """Whether a piece is one to sweep, by its faces."""
    low, high = np.reshape(gmsh.model.getBoundingBox(3, tag), (2, 3))
    volume = float(gmsh.model.occ.getMass(3, tag))
    try:
        faces = cad_faces(gmsh, "piece", tag, float(np.linalg.norm(high - low)), {})
    except KedfemError:
        return False
    piece = Solid(tag, "piece", volume, low, high, faces)
    for way in (layer_directions, revolution, path):
        try:
            way(gmsh, piece)
        except KedfemError:
            continue
        return True
    edges = [len(gmsh.model.getBoundary([(2, face.tag)], oriented=False)) for face in faces]
    return edges == [4] * 6


def pieces(name: str) -> tuple[int, int, float]:
    """Of a part how many pieces it falls into, how many of them sweep, and their share of its volume."""
    with TemporaryDirectory() as folder:
        file, _ = catalogue.written(name, Path(folder))
        shape = Cad(file=file.name, scale=catalogue.UNITS.get(name))
        with solid_model(PLACE, file, name, shape) as (gmsh, solid), gmsh_copy(gmsh, 1 / solid.extent) as copy:
            occ = copy.model.occ
            whole = copy.model.getEntities(3)
            tools = [each for face in cutting_faces(solid) for each in surface(copy, face, solid.extent)]
            tags = [tag for dim, tag in occ.fragment(whole, tools)[1][0] if dim == 3]
            occ.synchronize()
            good = [swept(copy, tag) for tag in tags]
            volumes = np.array([occ.getMass(3, tag) for tag in tags])
    return len(tags), sum(good), float(volumes[good].sum() / volumes.sum())


def main() -> None:
    """Cut all parts that the table of the catalogue has as tetrahedra."""
    table = (catalogue.DOCS / "catalogue.md").read_text(encoding="utf-8").splitlines()
    for name in (line.split(" | ")[0].strip("| ") for line in table if "| tetrahedra:" in line):
        with get_context("spawn").Pool(1) as pool:
            try:
                count, good, share = pool.apply_async(pieces, (name,)).get(LONGEST)
                words = f"{good} of {count} pieces, {100 * share:.2f} % of the volume"
            except Exception as error:  # noqa: BLE001  (OpenCASCADE raises nothing more special, and may never end)
                words = f"none: {error or 'no end in time'}"
        sys.stdout.write(f"{name}: {words}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
