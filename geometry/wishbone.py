"""Wishbone: two bushing eyes along x at (-90, 0, 0) and (90, 0, 0), and a ball seat at (25, 240, 18).

Forged: legs of round, tapering section to the boss of the ball joint, fillets at both ends, a cross brace welded on. The
coupling surface is a sphere of radius 15, open towards +z.
"""

from math import pi
from types import ModuleType

from geometry.drawing import Point, disc, joined, rounded, without

EYES = (-90.0, 90.0)
EYE, EYE_BORE, EYE_WIDTH = 42.0, 24.0, 50.0
SEAT: Point = (25.0, 240.0, 18.0)
SEAT_RADIUS, SEAT_BOSS = 15.0, 54.0
SEAT_HEIGHTS = (-25.0, 8.0)  # of the boss, from the ball's centre
LEG = (12.5, 9.5)  # radii at the eye and at the boss
ASIDE = 5.0  # how far from the boss's axis the legs end, so that their fillets stay apart
BRACE_AT, BRACE_RADIUS = 0.42, 8.0  # where along the legs, from the eyes
BOSS_FILLET, EYE_FILLET = 4.0, 4.0


def shape(occ: ModuleType) -> int:
    """The wishbone's solid."""
    axes = [_axis(x) for x in EYES]
    legs = [occ.addCone(*start, *_between(start, end), *LEG) for start, end in axes]
    left, right = (
        tuple(a + BRACE_AT * way for a, way in zip(start, _between(start, end), strict=True)) for start, end in axes
    )
    brace = occ.addCylinder(*left, *_between(left, right), BRACE_RADIUS)
    low, high = (SEAT[2] + height for height in SEAT_HEIGHTS)
    boss = disc(occ, (SEAT[0], SEAT[1], SEAT_BOSS / 2), (low, high))
    occ.rotate([(3, boss)], *SEAT, 0, 0, 1, pi / 2)  # its seam away from the legs
    eyes = [occ.addCylinder(x - EYE_WIDTH / 2, 0, 0, EYE_WIDTH, 0, 0, EYE / 2) for x in EYES]
    body = joined(occ, [*legs, brace, boss, *eyes])
    body = rounded(occ, body, BOSS_FILLET, lambda at, _: at[1] > 150 and not _rim(at))
    body = rounded(occ, body, EYE_FILLET, lambda at, _: 10 < at[1] < 60)
    bores = [occ.addCylinder(x - EYE_WIDTH, 0, 0, 2 * EYE_WIDTH, 0, 0, EYE_BORE / 2) for x in EYES]
    return without(occ, body, [*bores, occ.addSphere(*SEAT, SEAT_RADIUS)])


def _axis(x: float) -> tuple[Point, Point]:
    """Where a leg starts, at an eye, and ends, in the boss."""
    aside = ASIDE if x > 0 else -ASIDE
    return (x, 0.0, 0.0), (SEAT[0] + aside, SEAT[1], SEAT[2] + sum(SEAT_HEIGHTS) / 2)


def _between(start: Point, end: Point) -> Point:
    return end[0] - start[0], end[1] - start[1], end[2] - start[2]


def _rim(at: Point) -> bool:
    """The circles at the ends of the coupling surface's boss."""
    return any(abs(at[2] - SEAT[2] - height) < 0.1 for height in SEAT_HEIGHTS)
