"""A part from CAD on its own: its mesh, its faces, its quality."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from rich.table import Table
from rich.text import Text

from kedfem.links.surfaces.part_candidates import Offer, axis_in_words
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.mesh.places import in_mm
from kedfem.output.words import with_prefix
from kedfem.results.modelled import ELEMENTS


def mesh_tables(name: str, mesh: SolidMesh, found: Sequence[Offer]) -> list[Table]:
    """A part on its own: how it was meshed, its faces that a joint can sit on, the quality of its elements."""
    quality = mesh_quality(mesh)
    table = Table(title=Text(name), show_header=False)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    table.add_row("method", Text(mesh.method))
    table.add_row("elements", f"{len(mesh.cells)} {ELEMENTS[mesh.cell_type]}")
    table.add_row("unknowns", str(3 * len(mesh.points)))
    table.add_row("extent", " × ".join(with_prefix(float(side), "m") for side in high - low))
    table.add_row("worst scaled Jacobian", f"{quality.least:.3f} at {in_mm(quality.centre)}")
    bars = Table(title="Scaled Jacobian of the elements", show_header=False)
    edges, counts = quality.histogram()
    for count, low_end in zip(counts, edges, strict=False):
        if count:
            bars.add_row(f"{low_end:.1f}", str(count), "█" * int(np.ceil(40 * count / counts.max())))
    return [table, *([_surfaces(found)] if found else []), bars]


def _surfaces(found: Sequence[Offer]) -> Table:
    """What a joint can sit on, by the numbers in the picture."""
    table = Table(
        title="What joints can sit on",
        caption="mm; numbers as in the picture; what a joint finds that is put there, of round faces about their axis. "
        "Others by joints.NAME.faces: the face's name, or what it is: "
        '{ cylinder = "8 mm", axis = "z", near = [0.05, 0, 0] }',
    )
    for column in ("no", "face", "what", "⌀", "at", "axis", "finds"):
        whole = column == "face"  # names are there to be copied: what is too wide breaks elsewhere
        right = column in ("no", "⌀", "at")
        table.add_column(column, justify="right" if right else "left", no_wrap=whole, overflow="fold")
    for each in found:
        diameter = "" if np.isnan(each.face.radius) else f"{2e3 * each.face.radius:.4g}"
        axis = "" if np.isnan(each.face.direction).any() else axis_in_words(each.face)
        at = _shown(1e3 * each.at, 1 if each.kind == "plane" else 2)
        table.add_row(str(each.number), Text(each.face.name), each.kind, diameter, at, axis, each.finds)
    return table


def _shown(x: Float[np.ndarray, "3"], digits: int) -> str:
    """A point or direction without the noise of rounding."""
    return "({:g}, {:g}, {:g})".format(*(np.round(x, digits) + 0.0))
