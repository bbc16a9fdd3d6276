"""Surfaces of beams, which are lines in a frame, from their sections."""

from typing import Any

import numpy as np

from kedfem.arrays import Float, Int

SECTION = "height, thickness, round"  # cell array of a frame with the sections of beams
THINNEST = 0.004  # least height and thickness of a beam in the picture, in diagonals
JOINED = 1e-6  # distance within which corners are joined, in diagonals
LINES = {3: 2, 21: 3}  # VTK's numbers of the line and the quadratic line, and their nodes
# sections of height and thickness 2
RECTANGLE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
ELLIPSE = np.column_stack([f(np.linspace(0, 2 * np.pi, 24, endpoint=False)) for f in (np.cos, np.sin)])
STATIONS = {2: 2, 3: 17}  # points along a beam of so many nodes


def heights(grid: Any) -> Float[np.ndarray, "e 2"]:
    """Height and thickness of each beam element in the reference position [m]."""
    lines = np.isin(grid.celltypes, list(LINES))
    least = np.full((lines.sum(), 2), THINNEST * grid.length)
    return np.maximum(grid.cell_data[SECTION][lines, :2], least) if SECTION in grid.cell_data else least


def bars(lines: Any, sizes: Float[np.ndarray, "e 2"]) -> Any:
    """Surfaces of beams in the xy plane, curved as they are bent, mitred where two elements of a link meet."""
    import pyvista

    points, faces, values = rims(lines, sizes)
    every = pyvista.PolyData(points, faces)
    every.point_data["MPa"] = values
    return every.clean(tolerance=JOINED, absolute=False)


def rims(
    lines: Any, sizes: Float[np.ndarray, "e 2"]
) -> tuple[Float[np.ndarray, "k 3"], list[int], Float[np.ndarray, " k"]]:
    """Points of the sections along beams, the faces between them in VTK's form, and the stress "MPa" of the points.

    The faces do not depend on the deformation.
    """
    round_ = lines.cell_data[SECTION][:, 2] > 0 if SECTION in lines.cell_data else np.zeros(len(sizes), bool)
    tangents, elements = end_tangents(lines)
    points, faces, values, first = [], list[int](), [], 0
    for kind, nodes in LINES.items():
        which = np.flatnonzero(lines.celltypes == kind)
        for e, cell in zip(which, lines.cells_dict.get(kind, ()), strict=True):
            r = np.linspace(-1.0, 1.0, STATIONS[nodes])
            weights = shape_functions(nodes, r)
            axis = weights @ lines.points[cell]
            along = np.gradient(axis, axis=0)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            across = np.column_stack([-along[:, 1], along[:, 0], 0 * along[:, 0]])
            for end, node in ((0, cell[0]), (-1, cell[1])):
                mitred = np.array([-tangents[node, 1], tangents[node, 0], 0.0])
                across[end] = mitred / max(0.5, mitred @ across[end])
            profile = (ELLIPSE if round_[e] else RECTANGLE) * sizes[e] / 2
            rim = axis[:, None] + profile[:, :1] * across[:, None] + profile[:, 1:] * [0.0, 0.0, 1.0]
            points.append(rim.reshape(-1, 3))
            values.append(np.repeat(weights @ lines.point_data["MPa"][cell], len(profile)))
            faces += swept(len(r), len(profile), [elements[node] == 1 for node in cell[:2]], first)
            first += len(points[-1])
    return np.concatenate(points), faces, np.concatenate(values)


def end_tangents(lines: Any) -> tuple[Float[np.ndarray, "n 3"], Int[np.ndarray, " n"]]:
    """Unit tangents at the ends of elements, the mean where elements meet, and the number of elements at each node."""
    out, count = np.zeros((lines.n_points, 3)), np.zeros(lines.n_points, int)
    for kind, nodes in LINES.items():
        for cell in lines.cells_dict.get(kind, np.zeros((0, nodes), int)):
            X = lines.points[cell]
            bent = np.outer([-2.0, 2.0], X[0] + X[1] - 2 * X[2]) if nodes == 3 else np.zeros((2, 3))
            for node, t in zip(cell[:2], X[1] - X[0] + bent, strict=True):
                out[node] += t / np.linalg.norm(t)
                count[node] += 1
    return out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12), count


def swept(stations: int, corners: int, closed: list[bool], start: int) -> list[int]:
    """Faces in VTK's form of a prism through `stations` rims of `corners` points, from point `start`; `closed` ends."""
    stop = start + (stations - 1) * corners
    first, last = range(start, start + corners), range(stop, stop + corners)
    sides = [
        (4, at + i, at + j, at + corners + j, at + corners + i)
        for at in range(0, (stations - 1) * corners, corners)
        for i, j in zip(first, (*first[1:], start), strict=True)
    ]
    ends = zip(((corners, *reversed(first)), (corners, *last)), closed, strict=True)
    return [x for face in (*sides, *(end for end, shut in ends if shut)) for x in face]


def shape_functions(nodes: int, r: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k m"]:
    """Lagrange polynomials on a line: ends, then the middle."""
    if nodes == 2:
        return np.column_stack([(1 - r) / 2, (1 + r) / 2])
    return np.column_stack([r * (r - 1) / 2, r * (r + 1) / 2, 1 - r * r])
