"""Piston: turned about x, pin bore along z at the origin, crown towards +x; it fits the connecting rod of the engine.

Hollow, with two ring grooves, a shallow bowl in the crown and bosses about the pin (bore 20, gap |z| < 13).
"""

from math import pi
from types import ModuleType

from geometry.drawing import box, common, disc, joined, rounded, without

BORE, BOSS, HALF_GAP = 20.0, 32.0, 13.0
RADIUS, WALL = 39.0, 4.5
SKIRT, INSIDE, CROWN = -28.0, 26.0, 36.0  # along x: open end, ceiling of the hollow, crown
GROOVES, GROOVE_WIDTH, GROOVE_DEPTH = (22.0, 29.0), 3.0, 3.0
LAND = 5.0  # wall behind the grooves is thicker than the skirt by this
BOWL = (90.0, 3.0)  # radius of the sphere, depth
INNER_FILLET = 4.0


def shape(occ: ModuleType) -> int:
    """The piston's solid."""
    body = without(occ, _turned(occ, _outside()), [_hollow(occ)])
    sides = [(HALF_GAP, RADIUS - 1), (1 - RADIUS, -HALF_GAP)]
    bosses = []
    for z in sides:
        rib = box(occ, (0, CROWN - 8), (-BOSS / 2, BOSS / 2), z)
        eye = joined(occ, [disc(occ, (0, 0, BOSS / 2), z), rib])
        bosses.append(common(occ, eye, occ.addCylinder(SKIRT, 0, 0, CROWN - 6 - SKIRT, 0, 0, RADIUS - 4)))
    depth = BOWL[0] - BOWL[1]
    bowl = occ.addSphere(CROWN + depth, 0, 0, BOWL[0])
    return without(occ, joined(occ, [body, *bosses]), [bowl, disc(occ, (0, 0, BORE / 2), (-RADIUS, RADIUS))])


def _outside() -> list[tuple[float, float]]:
    """x and radius of the turned outside, from the skirt's end to the crown."""
    outline = [(SKIRT, 0.0), (SKIRT, RADIUS)]
    for x in GROOVES:
        bottom = RADIUS - GROOVE_DEPTH
        outline += [(x, RADIUS), (x, bottom), (x + GROOVE_WIDTH, bottom), (x + GROOVE_WIDTH, RADIUS)]
    return [*outline, (CROWN, RADIUS), (CROWN, 0.0)]


def _turned(occ: ModuleType, outline: list[tuple[float, float]]) -> int:
    points = [occ.addPoint(x, y, 0) for x, y in outline]
    loop = occ.addCurveLoop([occ.addLine(points[k - 1], point) for k, point in enumerate(points)])
    face = occ.addPlaneSurface([loop])
    made = occ.revolve([(2, face)], 0, 0, 0, 1, 0, 0, 2 * pi)
    occ.remove([(2, face)], recursive=True)
    return next(tag for dim, tag in made if dim == 3)


def _hollow(occ: ModuleType) -> int:
    """The inside, narrower behind the grooves, rounded at the ceiling."""
    inner, narrow = RADIUS - WALL, RADIUS - WALL - LAND
    outline = [(SKIRT - 1, 0.0), (SKIRT - 1, inner), (GROOVES[0] - 10, inner), (GROOVES[0] - 2, narrow)]
    hollow = _turned(occ, [*outline, (INSIDE, narrow), (INSIDE, 0.0)])
    return rounded(occ, hollow, INNER_FILLET, lambda at, _: abs(at[0] - INSIDE) < 0.1)
