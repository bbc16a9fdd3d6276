"""The ParaView animation: one VTU file per frame with all links in it, and a PVD file that lists them."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import OutputError
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.output.bars import SECTION
from kedfem.results.files import ready_folder, reason, replacing

STRESS_COMPONENTS = ("XX", "YY", "ZZ", "XY", "YZ", "XZ")


@dataclass(frozen=True, slots=True)
class LinkField:
    """One link in one frame of the animation.

    Parameters
    ----------
    name
        The link's name.
    cell_type
        meshio's name: ``hexahedron27``, ``hexahedron20``, ``hexahedron``, ``line``, ``line3``.
    cells : (e, k) [-]
        Node numbers in VTK's order.
    points : (n, 3) [m]
        Where the nodes are drawn: rigid motion plus the exaggerated elastic displacement.
    displacement : (n, 3) [m]
        Elastic displacement δ, world components, not exaggerated.
    stress : (n, 6) [Pa]
        xx, yy, zz, xy, yz, zx in the link's axes.
    von_mises : (n,) [Pa]
    section : height and thickness [m] of a beam that is drawn as a line, and whether they are diameters of an ellipse
    """

    name: str
    cell_type: str
    cells: Int[np.ndarray, "e k"]
    points: Float[np.ndarray, "n 3"]
    displacement: Float[np.ndarray, "n 3"]
    stress: Float[np.ndarray, "n 6"]
    von_mises: Float[np.ndarray, " n"]
    section: tuple[float, float, bool] | None = None


@dataclass(frozen=True, slots=True)
class RigidField:
    """One rigid link in one frame of the animation.

    Parameters
    ----------
    name, cell_type, cells, points
        As of :class:`LinkField`; cells are surfaces, lines or a vertex.
    velocity, acceleration : (n, 3) [m/s, m/s²]
        World components.
    """

    name: str
    cell_type: str
    cells: Int[np.ndarray, "e k"]
    points: Float[np.ndarray, "n 3"]
    velocity: Float[np.ndarray, "n 3"]
    acceleration: Float[np.ndarray, "n 3"]


Fields = Sequence[LinkField | RigidField]


class AnimationWriter:
    """Writes frames as they are made; each is whole, and so is the list of them, at any moment.

    The first frame removes the frames that an earlier run left under the same stem, and nothing else.

    Parameters
    ----------
    folder
        Where ``STEM.pvd`` and ``STEM_0000.vtu``, ``STEM_0001.vtu``, … go.
    stem
        Beginning of the names.

    Raises
    ------
    OutputError
        From :meth:`add`: the folder or a file cannot be written.
    """

    REMEMBERED = ("times",)

    def __init__(self, folder: Path, stem: str) -> None:
        self.folder = Path(folder)
        self.stem = stem
        self.times: list[float] = []

    @property
    def missing(self) -> Path | None:
        """A frame that was written and is there no more."""
        every = (self.folder / _frame_name(self.stem, k) for k in range(len(self.times)))
        return next((path for path in every if not path.is_file()), None)

    def add(self, time: float, fields: Fields) -> Path:
        """Write the next frame.

        Parameters
        ----------
        time : [s]
        fields
            The links in this frame.

        Returns
        -------
        The VTU file.
        """
        if not self.times:
            remove_animation(self.folder, self.stem)
        path = self.folder / _frame_name(self.stem, len(self.times))
        with replacing(path) as part:
            _write_vtu(part, time, fields)
        self.times.append(float(time))
        write_collection(self.folder, self.stem, self.times)
        return path


def write_collection(folder: Path, stem: str, times: Sequence[float]) -> None:
    """The PVD file that lists frames ``STEM_0000.vtu``, … at their times [s].

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with replacing(folder / f"{stem}.pvd") as part:
        part.write_text(_collection(stem, times), encoding="utf-8")


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """A mesh as a VTU file, with the scaled Jacobian of its elements.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
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
    """Links as drawn with values at their points.

    Parameters
    ----------
    parts : name, points (n, 3), elements (e, m) and their type
    values : of all points of all parts, one after the other

    Raises
    ------
    OutputError
        The file cannot be written.
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
        said = f"<UnstructuredGrid><FieldData>{_numbers(names)}</FieldData>".encode()
        part.write_bytes(part.read_bytes().replace(b"<UnstructuredGrid>", said, 1))


def write_frame(path: Path, time: float, fields: Fields) -> None:
    """One frame on its own.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with replacing(path) as part:
        _write_vtu(part, time, fields)


def write_cells(
    path: Path, parts: Sequence[tuple[np.ndarray, np.ndarray, str]], name: str, values: Sequence[np.ndarray]
) -> None:
    """Elements as drawn with one value each.

    Parameters
    ----------
    parts : points (n, 3), elements (e, m) and their type
    name : of the values
    values : (e,) of each part

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    import meshio
    from meshio import vtu

    first = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    cells = [(kind, (of + n).astype(np.int32)) for (_, of, kind), n in zip(parts, first, strict=False)]
    points = np.concatenate([points for points, _, _ in parts])
    content = meshio.Mesh(points, cells, cell_data={name: list(values)})
    with replacing(path) as part:
        vtu.write(str(part), content, binary=True, compression="zlib")


def remove_animation(folder: Path, stem: str) -> None:
    """Delete the animation of an earlier run: ``STEM.pvd`` and its frames, and nothing else.

    Raises
    ------
    OutputError
        The folder cannot be written, or a file in it cannot be removed.
    """
    ready_folder(folder)
    frame = re.compile(re.escape(stem) + r"_\d{4,}\.vtu")
    try:
        (folder / f"{stem}.pvd").unlink(missing_ok=True)
        for path in folder.iterdir():
            if frame.fullmatch(path.name):
                path.unlink()
    except OSError as error:
        got = f"{Path(error.filename).name} that cannot be removed ({reason(error)})"
        raise OutputError(f"{folder}: must be free of the frames of an earlier run, got {got}") from error


def _frame_name(stem: str, index: int) -> str:
    return f"{stem}_{index:04d}.vtu"


def _collection(stem: str, times: Sequence[float]) -> str:
    """The PVD file."""
    frames = "".join(
        f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(_frame_name(stem, index))}/>\n'
        for index, time in enumerate(times)
    )
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
    return head + frames + "  </Collection>\n</VTKFile>\n"


def _write_vtu(path: Path, time: float, fields: Fields) -> None:
    """One frame: zlib-compressed binary through meshio, with the field data that meshio leaves out."""
    from meshio import vtu

    vtu.write(str(path), _merged(fields), binary=True, compression="zlib")
    stress = f'Name="stress" NumberOfComponents="{len(STRESS_COMPONENTS)}"'
    named = "".join(f' ComponentName{i}="{name}"' for i, name in enumerate(STRESS_COMPONENTS))
    text = path.read_bytes()
    text = text.replace(b"<UnstructuredGrid>", b"<UnstructuredGrid>" + _field_data(time, fields).encode(), 1)
    path.write_bytes(text.replace(stress.encode(), (stress + named).encode(), 1))


def _merged(fields: Fields) -> Any:
    """All links as one mesh of meshio."""
    import meshio

    first = np.cumsum([0, *(len(field.points) for field in fields)])
    return meshio.Mesh(
        np.concatenate([field.points for field in fields]),
        [
            (field.cell_type, (field.cells + n0).astype(np.int32))
            for field, n0 in zip(fields, first, strict=False)
        ],
        point_data={
            name: np.ascontiguousarray(np.concatenate([getattr(field, name) for field in fields]))
            for name in (
                ("velocity", "acceleration")
                if isinstance(fields[0], RigidField)
                else ("displacement", "von_mises", "stress")
            )
        },
        cell_data={"link": [np.full(len(field.cells), i, np.int32) for i, field in enumerate(fields)]}
        | _sections(fields),
    )


def _sections(fields: Fields) -> dict[str, list[np.ndarray]]:
    """Of beams drawn as lines height, thickness [m] and whether they are round; 0 elsewhere."""
    every = [getattr(field, "section", None) for field in fields]
    if not any(every):
        return {}
    rows = [np.array(section or (0, 0, 0), float) for section in every]
    return {SECTION: [np.tile(row, (len(field.cells), 1)) for row, field in zip(rows, fields, strict=True)]}


def _field_data(time: float, fields: Fields) -> str:
    """The frame's time, and which number in the cell data is which link."""
    numbers = _numbers([field.name for field in fields])
    moment = f'<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{float(time)!r}'
    return f"<FieldData>{moment}</DataArray>{numbers}</FieldData>"


def _numbers(names: Sequence[str]) -> str:
    return "".join(
        f'<DataArray type="Int32" Name={quoteattr("link " + name)} NumberOfTuples="1" format="ascii">'
        f"{index}</DataArray>"
        for index, name in enumerate(names)
    )
