"""The ParaView animation: a VTU file per link and frame, and a PVD file that lists them as named blocks."""

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float, Int

from kedfem.errors import OutputError
from kedfem.folders import PART
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.output.array_names import (
    ACCELERATION,
    DISPLACEMENT,
    JOINTS,
    LARGEST,
    SMALLEST,
    STRESS,
    VELOCITY,
    VON_MISES,
)
from kedfem.output.bars import SECTION
from kedfem.processes import threads
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
        xx, yy, zz, xy, yz, zx in the world's axes; nan of beams, whose stress is known along their axis.
    von_mises : (n,) [Pa]
    principal : (n, 2) [Pa]
        Smallest and largest principal stress.
    section : height and thickness [m] of a beam that is drawn as a line, and whether they are diameters of an ellipse
    """

    name: str
    cell_type: str
    cells: Int[np.ndarray, "e k"]
    points: Float[np.ndarray, "n 3"]
    displacement: Float[np.ndarray, "n 3"]
    stress: Float[np.ndarray, "n 6"]
    von_mises: Float[np.ndarray, " n"]
    principal: Float[np.ndarray, "n 2"]
    section: tuple[float, float, bool] | None = None

    def arrays(self) -> dict[str, np.ndarray]:
        """What each node has, by names with units."""
        least, most = self.principal.T
        return {
            DISPLACEMENT: self.displacement,
            VON_MISES: self.von_mises,
            STRESS: self.stress,
            LARGEST: most,
            SMALLEST: least,
        }


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

    def arrays(self) -> dict[str, np.ndarray]:
        """What each node has, by names with units."""
        return {VELOCITY: self.velocity, ACCELERATION: self.acceleration}


@dataclass(frozen=True, slots=True)
class JointField:
    """What joints and drives exert in one frame, at points for arrows.

    Parameters
    ----------
    names
        Of the joints.
    points : (n, 3) [m]
        Where they are in the rigid-body motion.
    vectors
        (n, 3) by names with units: world components.
    """

    names: tuple[str, ...]
    points: Float[np.ndarray, "n 3"]
    vectors: Mapping[str, Float[np.ndarray, "n 3"]]
    name: str = JOINTS
    cell_type: str = "vertex"

    @property
    def cells(self) -> Int[np.ndarray, "n 1"]:
        """Each point is one."""
        return np.arange(len(self.points))[:, None]

    def arrays(self) -> dict[str, np.ndarray]:
        """What each joint has, by names with units."""
        return dict(self.vectors)


Block = LinkField | RigidField | JointField


class AnimationWriter:
    """Writes frames as they are made; each is whole, and so is the list of them, at any moment.

    The first frame removes the frames that an earlier run left under the same stem, and nothing else.

    Parameters
    ----------
    folder
        Where ``STEM.pvd`` goes, and the folder ``STEM`` with ``NAME_0000.vtu``, ``NAME_0001.vtu``, … of each link.
    stem
        Beginning of the names.
    drive
        What the drive's position is called, with its unit; empty without one.

    Raises
    ------
    OutputError
        From :meth:`add`: the folder or a file cannot be written.
    """

    REMEMBERED = ("entries", "count")

    def __init__(self, folder: Path, stem: str, drive: str = "") -> None:
        self.folder, self.stem, self.drive = Path(folder), stem, drive
        self.entries: list[Entry] = []
        self.count = 0

    @property
    def missing(self) -> Path | None:
        """A frame that was written and is there no more."""
        return next((path for _, _, name in self.entries if not (path := self.folder / name).is_file()), None)

    def add(self, time: float, fields: Sequence[Block], angle: float = 0.0) -> list[Path]:
        """Write the next frame.

        Parameters
        ----------
        time : [s]
        fields
            The links in this frame, and what joints exert.
        angle : of the drive [rad], or travel [m]

        Returns
        -------
        The VTU files.
        """
        if not self.count:
            remove_animation(self.folder, self.stem)
        now = {"TimeValue": float(time)} | ({self.drive: float(angle)} if self.drive else {})
        files = [f"{self.stem}/{name}_{self.count:04d}.vtu" for name in _file_names(fields)]
        ready_folder(self.folder / self.stem)

        def write(k: int) -> None:
            with replacing(self.folder / files[k]) as part:
                _write_vtu(part, now, [fields[k]], k)

        # most of it is compression, which lets other threads go on
        with ThreadPoolExecutor(threads()) as pool:
            list(pool.map(write, range(len(fields))))
        self.entries += [(float(time), field.name, name) for field, name in zip(fields, files, strict=True)]
        self.count += 1
        write_collection(self.folder, self.stem, self.entries)
        return [self.folder / name for name in files]


Entry = tuple[float, str, str]
"""Of a list of frames: time [s], name of the block, file beside the list."""


def write_collection(folder: Path, stem: str, entries: Sequence[Entry]) -> None:
    """The PVD file ``STEM.pvd`` that lists VTU files at their times.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with replacing(folder / f"{stem}.pvd") as part:
        part.write_text(_collection(entries), encoding="utf-8")


def read_collection(path: Path) -> list[tuple[float, list[Path]]]:
    """Frames that a PVD file lists, in its order: time [s] and the files of its blocks that are there.

    Raises
    ------
    OutputError
        It is damaged.
    """
    import xml.etree.ElementTree as ET

    out: dict[float, list[Path]] = {}
    try:
        for each in ET.parse(path).iter("DataSet"):
            file = (path.parent / each.attrib["file"]).resolve()
            if file.is_relative_to(path.parent.resolve()) and file.exists():
                out.setdefault(float(each.attrib["timestep"]), []).append(file)
    except (ET.ParseError, KeyError, ValueError, OSError) as error:
        raise OutputError(f"{path}: must be a list of frames, got a damaged file") from error
    return list(out.items())


def _file_names(fields: Sequence[Block]) -> list[str]:
    """Names for files, all different whatever the letters of the blocks' own."""
    out: list[str] = []
    for field in fields:
        name = re.sub(r"[^A-Za-z0-9.-]", "_", field.name)
        same = (f"{name}{k}" if k else name for k in count())
        out.append(next(x for x in same if x.lower() not in {y.lower() for y in out}))
    return out


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
        numbers = "".join(_number(f"link {name}", k) for k, name in enumerate(names))
        said = f"<UnstructuredGrid><FieldData>{numbers}</FieldData>".encode()
        part.write_bytes(part.read_bytes().replace(b"<UnstructuredGrid>", said, 1))


def write_frame(path: Path, time: float, fields: Sequence[Block]) -> None:
    """One frame on its own, all links in one grid.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with replacing(path) as part:
        _write_vtu(part, {"TimeValue": float(time)}, fields)


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
    """Delete the animation of an earlier run: ``STEM.pvd``, the frames in folder ``STEM``, whole or not, no more.

    Raises
    ------
    OutputError
        The folder cannot be written, or a file in it cannot be removed.
    """
    ready_folder(folder)
    frame, inside = re.compile(r".+_\d{4,}\.vtu"), folder / stem
    try:
        (folder / f"{stem}.pvd").unlink(missing_ok=True)
        if not inside.is_dir():
            return
        for path in inside.iterdir():
            if frame.fullmatch(path.name) or PART.fullmatch(path.name):
                path.unlink()
        if not any(inside.iterdir()):
            inside.rmdir()
    except OSError as error:
        got = f"{Path(error.filename).name} that cannot be removed ({reason(error)})"
        raise OutputError(f"{folder}: must be free of the frames of an earlier run, got {got}") from error


def _collection(entries: Sequence[Entry]) -> str:
    """The PVD file; parts are numbered within their time."""
    rows, last, part = [], None, 0
    for time, name, file in entries:
        part, last = (part + 1 if time == last else 0), time
        at = f'timestep="{time!r}" part="{part}" name={quoteattr(name)} file={quoteattr(file)}'
        rows.append(f"    <DataSet {at}/>\n")
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
    return head + "".join(rows) + "  </Collection>\n</VTKFile>\n"


def _write_vtu(path: Path, now: Mapping[str, float], fields: Sequence[Block], first: int = 0) -> None:
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
    text, said = path.read_bytes(), _field_data(now, fields, first).encode()
    text = text.replace(b"<UnstructuredGrid>", b"<UnstructuredGrid>" + said, 1)
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
