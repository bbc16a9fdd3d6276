"""VTU files of meshes, of links with values, and of animation frames."""

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.output.bars import SECTION
from kedfem.output.fields import STRESS, Block, JointField, numbered
from kedfem.results.files import replacing

STRESS_COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")
GRID = b"<UnstructuredGrid>"
Points = Float[np.ndarray, "n 3"]
Cells = tuple[str, Int[np.ndarray, "e m"]]  # elements of one type: its name in meshio, and their nodes


def write_vtu(path: Path, points: Points, cells: Sequence[Cells], **values: Any) -> None:
    """Write points and elements with meshio's `point_data` and `cell_data`: binary, compressed by zlib."""
    import meshio
    from meshio import vtu

    whole = [(kind, of.astype(np.int32)) for kind, of in cells]
    vtu.write(str(path), meshio.Mesh(points, whole, **values), binary=True, compression="zlib")


def complete(path: Path, fields: str = "") -> None:
    """Add to a file what meshio does not write: field data, and names of stress components."""
    stress = f'Name="{STRESS}" NumberOfComponents="{len(STRESS_COMPONENTS)}"'
    named = "".join(f' ComponentName{i}="{name}"' for i, name in enumerate(STRESS_COMPONENTS))
    head = GRID + f"<FieldData>{fields}</FieldData>".encode() if fields else GRID
    text = path.read_bytes().replace(GRID, head, 1)
    path.write_bytes(text.replace(stress.encode(), (stress + named).encode(), 1))


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """Write a mesh as a VTU file, with the scaled Jacobian of its elements."""
    quality = mesh_quality(mesh).scaled_jacobian
    with replacing(path) as part:
        cells = [(mesh.cell_type, mesh.cells)]
        write_vtu(part, mesh.points, cells, cell_data={"scaled_jacobian": [quality]})


def write_points(path: Path, parts: Sequence[tuple[str, Points, Cells]], values: Mapping[str, np.ndarray]) -> None:
    """Write links in the reference position with values at their points.

    Parameters
    ----------
    parts : name, points and elements of each link
    values : values of all points, part after part, by name
    """
    names = list(dict.fromkeys(name for name, *_ in parts))
    link = [np.full(len(of), names.index(name), np.int32) for name, _, (_, of) in parts]
    whole = _together([(points, cells) for _, points, cells in parts])
    fields = {name: x.astype(np.float32) for name, x in values.items()}
    with replacing(path) as part:
        write_vtu(part, *whole, point_data=fields, cell_data={"link": link})
        complete(part, "".join(_number(f"link {name}", k) for k, name in enumerate(names)))


def write_cells(path: Path, parts: Sequence[tuple[Points, Cells]], name: str, values: Sequence[np.ndarray]) -> None:
    """Write elements in the reference position, with a value `name` for each; `parts` are points and cells."""
    with replacing(path) as part:
        write_vtu(part, *_together(parts), cell_data={name: [x.astype(np.float32) for x in values]})


def _together(parts: Sequence[tuple[Points, Cells]]) -> tuple[Points, list[Cells]]:
    """Points of all parts in one array, and elements with their numbers there."""
    first = np.cumsum([0, *(len(points) for points, _ in parts)])
    cells = [(kind, of + n) for (_, (kind, of)), n in zip(parts, first, strict=False)]
    return np.concatenate([points for points, _ in parts]), cells


def write_frame(path: Path, time: float, fields: Sequence[Block]) -> None:
    """Write a single frame, with all links in one grid."""
    with replacing(path) as part:
        write_blocks(part, {"TimeValue": float(time)}, fields)


def write_blocks(path: Path, now: Mapping[str, float], fields: Sequence[Block], first: int = 0) -> None:
    """Write a frame, or some blocks of it.

    Parameters
    ----------
    now : the frame's time, and the drive's position if there is one, by name
    first : number of the first block
    """
    points, cells = _together([(field.points, (field.cell_type, field.cells)) for field in fields])
    every = [field.arrays() for field in fields]
    whole = {name: np.concatenate([each[name] for each in every]) for name in every[0]}
    values = {name: x.astype(np.float32, order="C") for name, x in whole.items()}
    link = [np.full(len(field.cells), i, np.int32) for i, field in enumerate(fields, start=first)]
    of_cells = {"link": link} | _sections(fields)
    write_vtu(path, points.astype(np.float32), cells, point_data=values, cell_data=of_cells)
    complete(path, _field_data(now, fields, first))


def _sections(fields: Sequence[Block]) -> dict[str, list[np.ndarray]]:
    """Height and thickness [m] of planar beams, and whether they are round; 0 for other elements."""
    every = [getattr(field, "section", None) for field in fields]
    if not any(every):
        return {}
    rows = [np.array(section or (0, 0, 0), np.float32) for section in every]
    return {SECTION: [np.tile(row, (len(field.cells), 1)) for row, field in zip(rows, fields, strict=True)]}


def _field_data(now: Mapping[str, float], fields: Sequence[Block], first: int) -> str:
    """The frame's time and drive, and the numbers of links in the cell data and of joints among the points."""
    out = [_number(name, x, "Float64") for name, x in now.items()]
    for number, field in enumerate(fields, start=first):
        if isinstance(field, JointField):
            out += [_number(f"joint {name}", k) for k, name in enumerate(field.names)]
        else:
            out.append(_number(numbered(field), number))
    return "".join(out)


def _number(name: str, x: float, kind: str = "Int32") -> str:
    what = f'type="{kind}" Name="{escape(name)}" NumberOfTuples="1" format="ascii"'
    return f"<DataArray {what}>{x!r}</DataArray>"
