"""The ParaView animation as one VTKHDF file: an unstructured grid over time whose mesh is stored once.

Points have their rigid-body positions, so that Warp By Vector with ``displacement [m]`` draws the deflection at any
scale. Each frame is appended, after which the file is complete.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.errors import OutputError
from kedfem.output.fields import JointField, LinkField, numbered
from kedfem.results.files import ready_folder, reason, require_space

VERSION = (2, 3)  # of the format: field data over time

Blocks = Sequence[LinkField | JointField]
TYPES = {
    "vertex": 1, "line": 3, "quad": 9, "hexahedron": 12, "line3": 21, "tetra10": 24, "hexahedron20": 25,
    "quad9": 28, "hexahedron27": 29,
}  # fmt: skip
"""VTK's numbers of meshio's names."""

SPARE = 1_000_000  # bytes for HDF5's own tables


class AnimationFile:
    """Frames of a run in one file.

    path : the file; the first frame replaces an older file
    drive : name of the drive's position with its unit, a field of each frame
    """

    REMEMBERED = ("written",)

    def __init__(self, path: Path, drive: str) -> None:
        self.path, self.drive = Path(path), drive
        self.written = 0

    @property
    def missing(self) -> Path | None:
        """The file if it lacks frames that were written; else None."""
        import h5py

        if not self.written:
            return None
        try:
            with h5py.File(self.path, "r") as file:
                there = int(file["VTKHDF/Steps"].attrs["NSteps"]) >= self.written
        except (OSError, KeyError):
            there = False
        return None if there else self.path

    def add(self, time: float, angle: float, fields: Blocks) -> None:
        """Append a frame.

        Parameters
        ----------
        time : [s]
        angle : angle of the drive [rad], or its travel [m]
        fields : the links in this frame, points at their rigid-body positions; and the forces of joints
        """
        import h5py

        arrays = _point_data(fields)
        points = np.concatenate([field.points for field in fields]).astype(np.float32)
        try:
            ready_folder(self.path.parent)
            size = points.nbytes + sum(x.nbytes for x in arrays.values())
            require_space(self.path.parent, size + SPARE)
            with h5py.File(self.path, "r+" if self.written else "w") as file:
                root = file["VTKHDF"] if self.written else _laid_out(file, fields, arrays, self.drive)
                self._append(root, time, angle, {"Points": points, **_in("PointData", arrays)})
        except (OSError, RuntimeError) as error:
            got = f"must be a file that can be written, got {reason(error)}"
            raise OutputError(f"{self.path}: {got}") from error
        self.written += 1

    def _append(self, root: Any, time: float, angle: float, arrays: dict[str, np.ndarray]) -> None:
        """Append a frame after `written` ones; it overwrites frames that a killed run left."""
        k, n = self.written, len(arrays["Points"])
        for name, x in arrays.items():
            root[name].resize((k + 1) * n, axis=0)
            root[name][k * n :] = x
        field, sizes = f"FieldData/{self.drive}", f"Steps/FieldDataSizes/{self.drive}"
        steps = {"Steps/Values": time, field: angle, sizes: (1, 1), "Steps/PartOffsets": 0}
        steps |= {"Steps/NumberOfParts": 1, "Steps/PointOffsets": k * n, "Steps/CellOffsets": 0}
        steps |= {"Steps/ConnectivityIdOffsets": 0}
        steps |= {f"Steps/PointDataOffsets/{name}": k * n for name in root["PointData"]}
        steps |= {f"Steps/CellDataOffsets/{name}": 0 for name in root["CellData"]}
        steps |= {f"Steps/FieldDataOffsets/{self.drive}": k}
        for name in (name for name in root["FieldData"] if name != self.drive):  # the numbers of links
            steps |= {f"Steps/FieldDataOffsets/{name}": 0, f"Steps/FieldDataSizes/{name}": (1, 1)}
        for name, value in steps.items():
            root[name].resize(k + 1, axis=0)
            root[name][k] = value
        root["Steps"].attrs["NSteps"] = k + 1


def _in(group: str, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {f"{group}/{name}": x for name, x in arrays.items()}


def _point_data(fields: Blocks) -> dict[str, np.ndarray]:
    """Values of each node of all links in a frame; vectors that a block lacks are zero, scalars nan."""
    every = [field.arrays() for field in fields]
    shapes = {name: x.shape[1:] for each in every for name, x in each.items()}
    out = {}
    for name, shape in shapes.items():
        none = 0.0 if shape == (3,) else np.nan
        empty = [np.full((len(field.points), *shape), none) for field in fields]
        parts = [each.get(name, nothing) for each, nothing in zip(every, empty, strict=True)]
        out[name] = np.concatenate(parts).astype(np.float32)
    return out


def _laid_out(file: Any, fields: Blocks, arrays: dict[str, np.ndarray], drive: str) -> Any:
    """Lay out the file without frames: the mesh, and empty arrays that grow."""
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array(VERSION)
    root.attrs.create("Type", np.bytes_("UnstructuredGrid"))
    first = np.cumsum([0, *(len(field.points) for field in fields)])
    cells = [field.cells + n0 for field, n0 in zip(fields, first, strict=False)]
    sizes = np.concatenate([np.full(len(each), each.shape[1]) for each in cells])
    root["Connectivity"] = np.concatenate([each.ravel() for each in cells])
    root["Offsets"] = np.concatenate([[0], np.cumsum(sizes)])
    kinds = [np.full(len(field.cells), TYPES[field.cell_type], np.uint8) for field in fields]
    root["Types"] = np.concatenate(kinds)
    counts = {"Points": first[-1], "Cells": len(sizes), "ConnectivityIds": sizes.sum()}
    for name, count in counts.items():
        root[f"NumberOf{name}"] = np.array([count])
    numbers = [np.full(len(field.cells), k, np.int32) for k, field in enumerate(fields)]
    root.create_group("CellData")["link"] = np.concatenate(numbers)
    n, steps = int(first[-1]), root.create_group("Steps")
    for name, x in {"Points": np.zeros((n, 3), np.float32), **_in("PointData", arrays)}.items():
        _growing(root, name, x.dtype, x.shape[1:], max(min(n, 100_000), 1))
    counted = ("PartOffsets", "NumberOfParts", "PointOffsets", "CellOffsets", "ConnectivityIdOffsets")
    of_data = (f"PointDataOffsets/{x}" for x in arrays)
    for name in (*counted, *of_data, "CellDataOffsets/link", f"FieldDataOffsets/{drive}"):
        _growing(steps, name, np.int64)
    _growing(steps, f"FieldDataSizes/{drive}", np.int64, (2,))
    _growing(steps, "Values", np.float64)
    _growing(root, f"FieldData/{drive}", np.float64)
    for field, number in _numbers(fields):
        root[f"FieldData/{field}"] = np.array([number], float)
        for group, shape in (("FieldDataOffsets", ()), ("FieldDataSizes", (2,))):
            _growing(steps, f"{group}/{field}", np.int64, shape)
    return root


def _numbers(fields: Blocks) -> Iterator[tuple[str, int]]:
    """Names and numbers of links for the field data; "/" is replaced, because it would begin a group."""
    return ((numbered(field).replace("/", "_"), k) for k, field in enumerate(fields))


def _growing(group: Any, name: str, kind: Any, shape: tuple[int, ...] = (), rows: int = 256) -> None:
    """Create an empty array to which rows are appended."""
    packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    whole = {"maxshape": (None, *shape), "chunks": (rows, *shape)}
    group.create_dataset(name, (0, *shape), kind, **whole, **packed)
