"""VTU files: meshes, links with values, frames of an animation."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.output.array_names import STRESS
from kedfem.output.bars import SECTION
from kedfem.output.fields import Block, JointField
from kedfem.results.files import replacing

STRESS_COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """A mesh as a VTU file, with the scaled Jacobian of its elements."""
    import meshio
    from meshio import vtu

    quality = mesh_quality(mesh).scaled_jacobian
    cells = [(mesh.cell_type, mesh.cells.astype(np.int32))]
    content = meshio.Mesh(mesh.points, cells, cell_data={"scaled_jacobian": [quality]})
    with replacing(path) as part:
        vtu.write(str(part), content, binary=True, compression="zlib")


def write_points(
    path: Path, parts: Sequence[tuple[str, np.ndarray, np.ndarray, str]], values: Mapping[str, np.ndarray]
) -> None:
    """Links in the reference position with values at their points.

    Parameters
    ----------
    parts : name, points (n, 3), elements (e, m) and their type
    values : of all points of all parts, one after the other
    """
    import meshio
    from meshio import vtu

    first = np.cumsum([0, *(len(points) for _, points, _, _ in parts)])
    cells = [(kind, (of + n).astype(np.int32)) for (_, _, of, kind), n in zip(parts, first, strict=False)]
    names = list(dict.fromkeys(name for name, *_ in parts))
    link = [np.full(len(of), names.index(name), np.int32) for name, _, of, _ in parts]
    points = np.concatenate([points for _, points, _, _ in parts])
    content = meshio.Mesh(points, cells, point_data=dict(values), cell_data={"link": link})
    with replacing(path) as part:
        vtu.write(str(part), content, binary=True, compression="zlib")
        numbers = "".join(_number(f"link {name}", k) for k, name in enumerate(names))
        head = f"<UnstructuredGrid><FieldData>{numbers}</FieldData>".encode()
        part.write_bytes(part.read_bytes().replace(b"<UnstructuredGrid>", head, 1))


def write_frame(path: Path, time: float, fields: Sequence[Block]) -> None:
    """One frame on its own, all links in one grid."""
    with replacing(path) as part:
        write_blocks(part, {"TimeValue": float(time)}, fields)


def write_cells(
    path: Path, parts: Sequence[tuple[np.ndarray, np.ndarray, str]], name: str, values: Sequence[np.ndarray]
) -> None:
    """Elements in the reference position with one value each.

    Parameters
    ----------
    parts : points (n, 3), elements (e, m) and their type
    name : of the values
    values : (e,) of each part
    """
    import meshio
    from meshio import vtu

    first = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    cells = [(kind, (of + n).astype(np.int32)) for (_, of, kind), n in zip(parts, first, strict=False)]
    points = np.concatenate([points for points, _, _ in parts])
    content = meshio.Mesh(points, cells, cell_data={name: list(values)})
    with replacing(path) as part:
        vtu.write(str(part), content, binary=True, compression="zlib")


def write_blocks(path: Path, now: Mapping[str, float], fields: Sequence[Block], first: int = 0) -> None:
    """A frame, or one block of it: zlib-compressed binary through meshio, with the field data that meshio leaves out.

    Parameters
    ----------
    now : the frame's time, and the drive's position if there is one
    first : number of the first block
    """
    from meshio import vtu

    vtu.write(str(path), _merged(fields, first), binary=True, compression="zlib")
    stress = f'Name="{STRESS}" NumberOfComponents="{len(STRESS_COMPONENTS)}"'
    named = "".join(f' ComponentName{i}="{name}"' for i, name in enumerate(STRESS_COMPONENTS))
    text, head = path.read_bytes(), _field_data(now, fields, first).encode()
    text = text.replace(b"<UnstructuredGrid>", b"<UnstructuredGrid>" + head, 1)
    path.write_bytes(text.replace(stress.encode(), (stress + named).encode(), 1))


def _merged(fields: Sequence[Block], number: int) -> Any:
    """All blocks as one mesh of meshio."""
    import meshio

    first = np.cumsum([0, *(len(field.points) for field in fields)])
    every = [field.arrays() for field in fields]
    return meshio.Mesh(
        np.concatenate([field.points for field in fields]).astype(np.float32),
        [
            (field.cell_type, (field.cells + n0).astype(np.int32))
            for field, n0 in zip(fields, first, strict=False)
        ],
        point_data={
            name: np.concatenate([each[name] for each in every]).astype(np.float32, order="C")
            for name in every[0]
        },
        cell_data={
            "link": [np.full(len(field.cells), i, np.int32) for i, field in enumerate(fields, start=number)]
        }
        | _sections(fields),
    )


def _sections(fields: Sequence[Block]) -> dict[str, list[np.ndarray]]:
    """Of beams drawn as lines height, thickness [m] and whether they are round; 0 elsewhere."""
    every = [getattr(field, "section", None) for field in fields]
    if not any(every):
        return {}
    rows = [np.array(section or (0, 0, 0), float) for section in every]
    return {SECTION: [np.tile(row, (len(field.cells), 1)) for row, field in zip(rows, fields, strict=True)]}


def _field_data(now: Mapping[str, float], fields: Sequence[Block], first: int) -> str:
    """The frame's time and drive, and which number in the cell data is which link, or which point which joint."""
    numbers = "".join(
        "".join(_number(f"joint {name}", k) for k, name in enumerate(field.names))
        if isinstance(field, JointField)
        else _number(f"link {field.name}", number)
        for number, field in enumerate(fields, start=first)
    )
    moments = "".join(
        f'<DataArray type="Float64" Name={quoteattr(name)} NumberOfTuples="1" format="ascii">{x!r}</DataArray>'
        for name, x in now.items()
    )
    return f"<FieldData>{moments}{numbers}</FieldData>"


def _number(name: str, number: int) -> str:
    return f'<DataArray type="Int32" Name={quoteattr(name)} NumberOfTuples="1" format="ascii">{number}</DataArray>'
