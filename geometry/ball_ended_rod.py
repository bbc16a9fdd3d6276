"""Ball-ended rod: a turned body about x with a ball at the origin and another at (150, 0), spanner flats in the middle.

Necks and shoulders are turned with radii; a hole of 5 mm crosses the middle along z for a locking pin.
"""

from math import pi, sqrt
from types import ModuleType

from geometry.drawing import box, disc, without

LENGTH = 150.0
BALL, NECK, SHANK = 12.0, 7.0, 9.0  # radii; the same ball at both ends
NECK_LENGTH, NECK_RADIUS = 9.0, 8.0  # straight part of the neck, and the arc from neck to shank
FLATS, FLATS_LENGTH = 15.0, 16.0  # across the flats, and along x
PIN = 5.0


def shape(occ: ModuleType) -> int:
    """The rod's solid."""
    face = occ.addPlaneSurface([_half_section(occ)])
    made = occ.revolve([(2, face)], 0, 0, 0, 1, 0, 0, 2 * pi)
    occ.remove([(2, face)], recursive=True)
    body = next(tag for dim, tag in made if dim == 3)
    x = ((LENGTH - FLATS_LENGTH) / 2, (LENGTH + FLATS_LENGTH) / 2)
    sides = [(-SHANK - 1, -FLATS / 2), (FLATS / 2, SHANK + 1)]
    flats = [box(occ, x, y, (-SHANK - 1, SHANK + 1)) for y in sides]
    return without(occ, body, [*flats, disc(occ, (LENGTH / 2, 0, PIN / 2), (-SHANK - 1, SHANK + 1))])


def _half_section(occ: ModuleType) -> int:
    """The turned outline above the axis, from ball to ball."""
    leaves = sqrt(BALL**2 - NECK**2)
    half, rise = LENGTH / 2, SHANK - NECK
    run = sqrt(NECK_RADIUS**2 - (NECK_RADIUS - rise) ** 2)
    profile = [(-BALL, 0.0), (leaves, NECK), (leaves + NECK_LENGTH, NECK), (leaves + NECK_LENGTH + run, SHANK)]
    centres: list[tuple[float, float] | None] = [(0.0, 0.0), None, (leaves + NECK_LENGTH, NECK + NECK_RADIUS), None]
    profile += [(2 * half - x, y) for x, y in reversed(profile)]
    centres += [centre and (2 * half - centre[0], centre[1]) for centre in reversed(centres[:-1])]
    points = [occ.addPoint(x, y, 0) for x, y in profile]
    edges = []
    for k, centre in enumerate(centres):
        if centre is None:
            edges.append(occ.addLine(points[k], points[k + 1]))
        else:
            middle = occ.addPoint(*centre, 0)
            edges.append(occ.addCircleArc(points[k], middle, points[k + 1]))
            occ.remove([(0, middle)])
    return occ.addCurveLoop([*edges, occ.addLine(points[-1], points[0])])
