"""A part from CAD on its own: its mesh, its faces, its quality."""

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.mesh import HexMesh, mesh_quality
from kedfem.mesh.hexahedra import Face
from kedfem.report.links import ELEMENTS
from kedfem.report.words import with_prefix


def mesh_tables(name: str, mesh: HexMesh) -> list[Table]:
    """A part on its own: how it was meshed, its faces that a joint can sit on, the quality of its elements."""
    quality = mesh_quality(mesh)
    table = Table(title=Text(name), show_header=False)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    x, y, z = quality.centre
    table.add_row("way", Text(mesh.way))
    table.add_row("elements", f"{len(mesh.cells)} {ELEMENTS[mesh.cell_type]}")
    table.add_row("unknowns", str(3 * len(mesh.points)))
    table.add_row("extent", " × ".join(with_prefix(float(side), "m") for side in high - low))
    table.add_row("worst scaled Jacobian", f"{quality.least:.3f} at ({x:.4g}, {y:.4g}, {z:.4g})")
    seats = Table(
        title="Faces that joints can sit on", caption="of planes: the outward normal; all lengths in m"
    )
    for column in ("face", "kind", "radius", "position", "axis"):
        seats.add_column(column, justify="left" if column in ("face", "kind") else "right")
    for face in sorted(mesh.faces, key=lambda face: (face.kind != "cylinder", face.kind != "sphere")):
        if face.kind != "other":
            seats.add_row(Text(face.name), _face_kind(face), *_face_place(face))
    counts, edges = np.histogram(quality.scaled_jacobian, bins=10, range=(0.0, 1.0))
    bars = Table(title="Scaled Jacobian of the elements", show_header=False)
    for count, low_end in zip(counts, edges, strict=False):
        if count:
            bars.add_row(f"{low_end:.1f}", str(count), "█" * int(np.ceil(40 * count / counts.max())))
    return [table, *([seats] if seats.row_count else []), bars]


def _face_kind(face: Face) -> str:
    words = {"cylinder": ("journal", "bore"), "sphere": ("ball", "ball seat")}
    return words[face.kind][face.inward] if face.kind in words else face.kind


def _face_place(face: Face) -> tuple[str, str, str]:
    """Radius, position and direction in words."""
    x, y, z = face.centre
    radius = "" if np.isnan(face.radius) else f"{face.radius:.5g}"
    axis = (
        "" if np.isnan(face.direction).any() else "({:.4g}, {:.4g}, {:.4g})".format(*(face.direction + 0.0))
    )
    return radius, f"({x:.5g}, {y:.5g}, {z:.5g})", axis
