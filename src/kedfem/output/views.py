"""The direction from which a picture shows a linkage."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.output.bars import LINES, THINNEST, heights
from kedfem.output.fields import BODY, SPRING, VON_MISES

LIFT = 1e-3  # distance between drawn planar links of one plane, in diagonals; each covers those before it
RAISED = 0.6  # slope of the direction to the viewer: 27° above the horizon
FLAT = 0.35  # ratio of the least extent to the second one below which a linkage is seen from its flat side


@dataclass(frozen=True, slots=True)
class View:
    """The view of a linkage.

    direction, across, up : (3,) unit vectors towards the viewer, to the right and upwards in the picture [-]
    cut : (3,) place of the highest stress if links hide it, whose parts in front of it are drawn translucent [m]; else
        None
    middle, size : (2,) centre, and width and height of the linkage in the picture [m]
    """

    direction: Float[np.ndarray, " 3"]
    across: Float[np.ndarray, " 3"]
    up: Float[np.ndarray, " 3"]
    middle: Float[np.ndarray, " 2"]
    size: Float[np.ndarray, " 2"]
    cut: Float[np.ndarray, " 3"] | None = None


def labels(grid: Any, what: str = BODY) -> dict[int, str]:
    """Labels of attached masses, or of springs, by their numbers."""
    names = [name for name in grid.field_data.keys() if name.startswith(what)]  # noqa: SIM118
    return {int(grid.field_data[name][0]): name.removeprefix(what) for name in names}


def hidden(grid: Any, direction: Float[np.ndarray, " 3"]) -> bool:
    """Whether something is in front of the highest stress."""
    solids = _opaque(grid)
    return solids is not None and _meets(grid, solids, direction)


def hiding(grid: Any, direction: Float[np.ndarray, " 3"]) -> set[int]:
    """Numbers of the links that are in front of the highest stress."""
    solids = _opaque(grid)
    if solids is None:
        return set()
    links = np.unique(solids.cell_data["link"])
    return {int(k) for k in links if _meets(grid, solids.extract_cells(solids.cell_data["link"] == k), direction)}


def _opaque(grid: Any) -> Any:
    """The cells that may hide the highest stress; None without any, or without stress."""
    before = ~np.isin(grid.celltypes, list(LINES))
    if apart := labels(grid) | labels(grid, SPRING):  # translucent or thin
        before &= ~np.isin(grid.cell_data["link"], list(apart))
    stressed = np.isfinite(grid.point_data[VON_MISES]).any()
    return grid.extract_cells(before) if before.any() and stressed else None


def _meets(grid: Any, solids: Any, direction: Float[np.ndarray, " 3"]) -> bool:
    """Whether a ray from the highest stress towards the viewer meets some cells."""
    place = grid.points[int(np.nanargmax(grid.point_data[VON_MISES]))]
    surface = solids.extract_surface(nonlinear_subdivision=1, algorithm=None).triangulate()
    ends = place + LIFT * grid.length * direction, place + 2 * grid.length * direction
    return len(surface.ray_trace(*ends)[0]) > 0


def view(grid: Any, gravity: Float[np.ndarray, " 3"]) -> View:
    """The view of a linkage, from the best side that shows the highest stress."""
    direction, upwards = sight(np.ptp(grid.points, axis=0), gravity)
    seen = next((each for each in sides(direction, upwards) if not hidden(grid, each)), None)
    cut = grid.points[int(np.nanargmax(grid.point_data[VON_MISES]))] if seen is None else None
    direction = direction if seen is None else seen
    across, up = picture_axes(direction, upwards, gravity)
    drawn = grid.points @ np.column_stack([across, up])
    low, high = drawn.min(axis=0), drawn.max(axis=0)
    edge = max(4 * THINNEST * grid.length, *heights(grid).max(axis=0, initial=0.0))
    return View(direction, across, up, (low + high) / 2, high - low + edge, cut)


def picture_axes(
    direction: Float[np.ndarray, " 3"], upwards: Float[np.ndarray, " 3"], gravity: Float[np.ndarray, " 3"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Unit vectors to the right and upwards in a picture: against gravity, unless it is along the view or unknown.

    Parameters
    ----------
    direction : towards the viewer
    upwards : approximate upward direction if gravity does not determine it
    """
    if np.linalg.norm(np.cross(gravity, direction)) > 0.5 * np.linalg.norm(gravity) > 0:
        upwards = -gravity
    across = np.cross(upwards, direction)
    across /= np.linalg.norm(across)
    return across, np.cross(direction, across)


def sides(direction: Float[np.ndarray, " 3"], upwards: Float[np.ndarray, " 3"]) -> list[Float[np.ndarray, " 3"]]:
    """A direction, then that from behind, then those mirrored at other axes, directions from below last."""
    mirrored = [direction * signs for signs in product((1.0, -1.0), repeat=3)]
    main = int(np.abs(direction).argmax())
    turned = [
        int(np.sum(each * direction < 0))
        - 0.5 * (each[main] * direction[main] < 0)
        + 3.0 * ((each @ upwards) * (direction @ upwards) < 0)
        for each in mirrored
    ]
    return [mirrored[k] for k in np.argsort(turned, kind="stable")]


def sight(
    extents: Float[np.ndarray, " 3"], gravity: Float[np.ndarray, " 3"]
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Unit vectors towards the viewer of a linkage, and upwards: a flat linkage is seen from its flat side, tilted.

    A linkage with similar extents is seen from a corner; if gravity is known, from slightly above.
    """
    x, y, z = np.eye(3)
    least, second, most = np.sort(extents)
    thin = extents <= max(1.01 * least, FLAT * second if second < FLAT * most else 0.0)
    if least > FLAT * second and second > FLAT * most:
        direction, up = 0.6 * x + 0.5 * y + z, y
        if (weight := np.linalg.norm(gravity)) > 0:
            up = -gravity / weight
            first, other = np.eye(3)[np.argsort(np.abs(up), kind="stable")[:2]]
            direction = first + 0.6 * other + RAISED * up
    elif thin[2]:
        direction, up = z + 0.3 * y, y
    else:
        direction, up = (-y if thin[1] else x) + 0.3 * z, z
    return direction / np.linalg.norm(direction), up
