"""A part from CAD on its own: its mesh, its faces, its quality."""

import numpy as np
from jaxtyping import Float
from rich.table import Table
from rich.text import Text

from kedfem.links.rounds import CLOSED
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.mesh.hexahedra import Face
from kedfem.mesh.places import in_mm
from kedfem.output.words import with_prefix
from kedfem.report.links import ELEMENTS

KINDS = ("bore", "journal", "ball seat", "ball", "plane", "part of a cylinder")


def mesh_tables(name: str, mesh: SolidMesh) -> list[Table]:
    """A part on its own: how it was meshed, its faces that a joint can sit on, the quality of its elements."""
    quality = mesh_quality(mesh)
    table = Table(title=Text(name), show_header=False)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    table.add_row("way", Text(mesh.way))
    table.add_row("elements", f"{len(mesh.cells)} {ELEMENTS[mesh.cell_type]}")
    table.add_row("unknowns", str(3 * len(mesh.points)))
    table.add_row("extent", " × ".join(with_prefix(float(side), "m") for side in high - low))
    table.add_row("worst scaled Jacobian", f"{quality.least:.3f} at {in_mm(quality.centre)}")
    bars = Table(title="Scaled Jacobian of the elements", show_header=False)
    edges, counts = quality.histogram()
    for count, low_end in zip(counts, edges, strict=False):
        if count:
            bars.add_row(f"{low_end:.1f}", str(count), "█" * int(np.ceil(40 * count / counts.max())))
    return [table, *([_seats(mesh)] if mesh.faces else []), bars]


def _seats(mesh: SolidMesh) -> Table:
    """Faces with a form, those first that a joint finds by itself."""
    table = Table(
        title="Faces", caption="lengths in mm; for joints.NAME.faces, where a joint does not find its own"
    )
    for column in ("face", "kind", "radius", "position", "axis or normal"):
        left = column in ("face", "kind")
        whole = column == "face"  # names are there to be copied: what is too wide breaks elsewhere
        table.add_column(column, justify="left" if left else "right", no_wrap=whole, overflow="fold")
    rows = [(face_kind(mesh, face), face) for face in mesh.faces if face.kind != "other"]
    for kind, face in sorted(rows, key=lambda row: KINDS.index(row[0])):
        radius = "" if np.isnan(face.radius) else f"{1e3 * face.radius:.4g}"
        direction = "" if np.isnan(face.direction).any() else _shown(face.direction, 3)
        table.add_row(Text(face.name), kind, radius, _shown(1e3 * face.centre, 2), direction)
    return table


def face_kind(mesh: SolidMesh, face: Face) -> str:
    """What a joint can take a face for: cylinders only where they are closed."""
    if face.kind != "cylinder":
        return ("ball seat" if face.inward else "ball") if face.kind == "sphere" else "plane"
    r = mesh.points[face.sides].mean(axis=1) - face.centre
    r -= np.outer(r @ face.direction, face.direction)
    if np.linalg.norm(r.mean(axis=0)) > CLOSED * face.radius:
        return "part of a cylinder"
    return "bore" if face.inward else "journal"


def _shown(x: Float[np.ndarray, "3"], digits: int) -> str:
    """A point or direction without the noise of rounding."""
    return "({:g}, {:g}, {:g})".format(*(np.round(x, digits) + 0.0))
