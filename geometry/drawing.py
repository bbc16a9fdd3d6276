"""What the parts are drawn with: outlines, bosses, bores, fillets; gmsh's OpenCASCADE, millimetres."""

from collections.abc import Callable, Iterable, Sequence
from math import acos, atan2, cos, hypot, pi, sin, sqrt
from types import ModuleType

import gmsh

Point = tuple[float, float, float]
Corner = tuple[float, float, float]  # x, y and the radius it is rounded with, 0 for a sharp one
Circle = tuple[float, float, float]  # x, y of the centre, radius
Piece = tuple[Point, Point | None]  # where it ends, and a point that it goes through if it is an arc

SMOOTH = 1e-4  # sine of the angle between two faces below which there is no edge to see


def prism(occ: ModuleType, pieces: Sequence[Piece], z: tuple[float, float]) -> int:
    """A closed outline of lines and arcs, extruded between two heights."""
    points = [occ.addPoint(*end[:2], z[0]) for end, _ in pieces]
    edges = []
    for k, (_, via) in enumerate(pieces):
        if via is None:
            edges.append(occ.addLine(points[k - 1], points[k]))
        else:
            middle = occ.addPoint(*via[:2], z[0])
            edges.append(occ.addCircleArc(points[k - 1], middle, points[k], center=False))
            occ.remove([(0, middle)])
    face = occ.addPlaneSurface([occ.addCurveLoop(edges)])
    made = occ.extrude([(2, face)], 0, 0, z[1] - z[0])
    occ.remove([(2, face)], recursive=True)
    return next(tag for dim, tag in made if dim == 3)


def plate(occ: ModuleType, corners: Sequence[Corner], z: tuple[float, float]) -> int:
    """A polygon with rounded corners, extruded between two heights."""
    pieces: list[Piece] = []
    for k, corner in enumerate(corners):
        pieces += _rounded_corner(corners[k - 1], corner, corners[(k + 1) % len(corners)])
    return prism(occ, pieces, z)


def _rounded_corner(before: Corner, corner: Corner, after: Corner) -> list[Piece]:
    """The line to a corner and the arc round it."""
    x, y, radius = corner
    if radius == 0:
        return [((x, y, 0), None)]
    (ax, ay), (bx, by) = _direction(corner, before), _direction(corner, after)
    half = acos(max(-1.0, min(1.0, ax * bx + ay * by))) / 2
    along, middle = radius * cos(half) / sin(half), radius / sin(half) - radius
    mx, my = _direction((0, 0, 0), (ax + bx, ay + by, 0))
    start, end = (x + along * ax, y + along * ay, 0.0), (x + along * bx, y + along * by, 0.0)
    return [(start, None), (end, (x + middle * mx, y + middle * my, 0))]


def _direction(a: Corner, b: Corner) -> tuple[float, float]:
    length = hypot(b[0] - a[0], b[1] - a[1])
    return (b[0] - a[0]) / length, (b[1] - a[1]) / length


def strap(occ: ModuleType, first: Circle, second: Circle, z: tuple[float, float]) -> int:
    """Two circles and what lies between their outer tangents: an arm with round ends."""
    (x1, y1, r1), (x2, y2, r2) = first, second
    towards = atan2(y2 - y1, x2 - x1)
    side = acos((r1 - r2) / hypot(x2 - x1, y2 - y1))

    def on(circle: Circle, angle: float) -> Point:
        return circle[0] + circle[2] * cos(angle), circle[1] + circle[2] * sin(angle), 0.0

    pieces: list[Piece] = [
        (on(first, towards - side), on(first, towards + pi)),
        (on(second, towards - side), None),
        (on(second, towards + side), on(second, towards)),
        (on(first, towards + side), None),
    ]
    return prism(occ, pieces, z)


def disc(occ: ModuleType, circle: Circle, z: tuple[float, float]) -> int:
    """A round boss, or what a bore takes away."""
    return occ.addCylinder(circle[0], circle[1], z[0], 0, 0, z[1] - z[0], circle[2])


def box(occ: ModuleType, x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> int:
    """A box between two corners."""
    return occ.addBox(x[0], y[0], z[0], x[1] - x[0], y[1] - y[0], z[1] - z[0])


def joined(occ: ModuleType, tags: Sequence[int]) -> int:
    """One solid of several that touch."""
    return _one(occ.fuse([(3, tags[0])], [(3, tag) for tag in tags[1:]])[0])


def without(occ: ModuleType, tag: int, tools: Iterable[int]) -> int:
    """A solid less others."""
    return _one(occ.cut([(3, tag)], [(3, tool) for tool in tools])[0])


def common(occ: ModuleType, tag: int, other: int) -> int:
    """What two solids share."""
    return _one(occ.intersect([(3, tag)], [(3, other)])[0])


def rounded(occ: ModuleType, tag: int, radius: float, chosen: Callable[[Point, Point], bool]) -> int:
    """A solid with fillets along the edges that are chosen by their middle and direction."""
    edges = [edge for edge, middle, along in sharp_edges(occ, tag) if chosen(middle, along)]
    if not edges:
        raise ValueError(f"fillet of {radius}: must have edges, got none")
    return _one(occ.fillet([tag], edges, [radius]))


def upright(_: Point, along: Point) -> bool:
    """Edges along z, those of the plan."""
    return abs(along[2]) > 1 - SMOOTH


def sharp_edges(occ: ModuleType, tag: int) -> list[tuple[int, Point, Point]]:
    """The edges of a solid where two faces meet at an angle: tag, middle, direction there."""
    occ.synchronize()
    faces = [face for _, face in gmsh.model.getBoundary([(3, tag)], oriented=False)]
    sides: dict[int, list[int]] = {}
    for face in faces:
        for _, edge in gmsh.model.getBoundary([(2, face)], oriented=False):
            sides.setdefault(edge, []).append(face)
    found = []
    for edge, pair in sides.items():
        middle, along = _middle(edge)
        if len(pair) == 2 and _sine(pair, middle) > SMOOTH:
            found.append((edge, middle, along))
    return found


def _middle(edge: int) -> tuple[Point, Point]:
    low, high = gmsh.model.getParametrizationBounds(1, edge)
    parameter = [(low[0] + high[0]) / 2]
    x, y, z = gmsh.model.getDerivative(1, edge, parameter)
    length = sqrt(x * x + y * y + z * z)
    return tuple(gmsh.model.getValue(1, edge, parameter)), (x / length, y / length, z / length)


def _sine(faces: list[int], at: Point) -> float:
    """Sine of the angle between two faces at a point."""
    a, b = (gmsh.model.getNormal(face, gmsh.model.getParametrization(2, face, list(at))) for face in faces)
    return hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _one(made: list[tuple[int, int]]) -> int:
    solids = [tag for dim, tag in made if dim == 3]
    if len(solids) != 1:
        raise ValueError(f"part: must be one solid, got {len(solids)}")
    return solids[0]
