"""The moving parts of a single-cylinder engine, with blends: an assembly of seven solids at top dead centre.

Main axis along z through the origin, cylinder along x, crank radius 40 mm, rod 140 mm. `throw`: crank pin, two webs with
counterweights, two main journals. `rod`: I-section, its big end split, the cap drawn on with its bolts (bolted = welded).
`piston` with three grooves, hollow `pin`, and one `ring` of a gap each in the grooves.
"""

from itertools import pairwise
from math import cos, hypot, pi, radians, sin
from pathlib import Path
from types import ModuleType

import gmsh

from geometry.drawing import box, common, disc, joined, plate, rounded, strap, upright, without
from geometry.make import empty_model
from geometry.step_files import write_step
from kedfem.mesh.session import gmsh_options

NAME = "crank_train"
RADIUS, LENGTH = 40.0, 140.0
WRIST = RADIUS + LENGTH  # x of the piston's pin
CRANK_PIN, JOURNAL = 36.0, 40.0  # diameters
WEB, WEB_END, SHAFT_END = 12.0, 26.0, 52.0  # heights where webs begin and end, and the journals end
PIN_FILLET, WEB_EDGE = 2.0, 1.5
WEIGHT, WEIGHT_HALF_ANGLE = 62.0, radians(62)
BIG_EYE, SMALL_EYE, SMALL_BORE = 52.0, 36.0, 22.0  # diameters of the rod
HALF_EYE, HALF_FLANGE, HALF_WEB = 10.0, 8.0, 2.5  # heights
BOLT, BOLT_HEAD, BOLT_AT = 7.0, 11.0, 26.0  # diameters, and how far from the crank pin's axis
PISTON, BORE = 78.0, 78.6  # diameters
SKIRT, CEILING, CROWN = -28.0, 27.0, 36.0  # x from the pin's axis
GROOVES = ((14.0, 3.0), (21.0, 2.0), (27.0, 2.0))  # x from the pin's axis and width of a groove: oil ring, two others
GROOVE_DEPTH, RING_BEHIND, RING_GAP, RING_PLAY = 3.5, 0.2, 0.4, 0.05
WALL, LAND, HALF_GAP, BOSS = 4.5, 4.0, 12.5, 34.0
PIN_HOLE, PIN_HALF = 12.0, 33.0
SOLIDS = ("throw", "rod", "piston", "pin", "ring_1", "ring_2", "ring_3")


def write(folder: Path) -> None:
    """Write the assembly's STEP file into a folder."""
    with empty_model() as occ:
        solids = [throw(occ), rod(occ), piston(occ), pin(occ), *(ring(occ, *groove) for groove in GROOVES)]
        occ.synchronize()
        order = [name for _, name in sorted(zip(solids, SOLIDS, strict=True))]
        write_step(folder / f"{NAME}.step", order)


def throw(occ: ModuleType) -> int:
    """Crank throw: webs with counterweights, rounded, fillets where pin and journals leave them."""
    webs = [_web(occ, z) for z in ((WEB, WEB_END), (-WEB_END, -WEB))]
    shafts = [disc(occ, (0, 0, JOURNAL / 2), z) for z in ((-SHAFT_END, -WEB_END), (WEB_END, SHAFT_END))]
    whole = joined(occ, [*webs, disc(occ, (RADIUS, 0, CRANK_PIN / 2), (-WEB, WEB)), *shafts])

    def root(at: tuple[float, float, float], _: object) -> bool:
        on_pin = abs(abs(at[2]) - WEB) < 0.1 and abs(hypot(at[0] - RADIUS, at[1]) - CRANK_PIN / 2) < 0.1
        return on_pin or (abs(abs(at[2]) - WEB_END) < 0.1 and abs(hypot(*at[:2]) - JOURNAL / 2) < 0.1)

    whole = rounded(occ, whole, PIN_FILLET, root)
    return rounded(occ, whole, WEB_EDGE, lambda at, _: abs(abs(at[2]) - SHAFT_END) < 0.1)


def _web(occ: ModuleType, z: tuple[float, float]) -> int:
    """A web and its counterweight, corners and outer edges rounded."""
    far = 1.3 * WEIGHT / cos(WEIGHT_HALF_ANGLE)
    x, y = -far * cos(WEIGHT_HALF_ANGLE), far * sin(WEIGHT_HALF_ANGLE)
    sector = common(occ, disc(occ, (0, 0, WEIGHT), z), plate(occ, [(0, 0, 0), (x, y, 0), (x, -y, 0)], z))
    web = joined(occ, [strap(occ, (0, 0, 27), (RADIUS, 0, 25), z), sector])
    web = rounded(occ, web, 5.0, lambda at, along: upright(at, along) and hypot(*at[:2]) > WEIGHT - 1)
    web = rounded(occ, web, 8.0, lambda at, along: upright(at, along) and hypot(*at[:2]) < WEIGHT - 10)
    return rounded(occ, web, WEB_EDGE, lambda _, along: abs(along[2]) < 0.1)


def rod(occ: ModuleType) -> int:
    """Connecting rod with its cap and bolts, an I-section between the eyes."""
    z = (-HALF_FLANGE, HALF_FLANGE)
    shank = plate(occ, [(RADIUS, -13, 0), (WRIST, -9.5, 0), (WRIST, 9.5, 0), (RADIUS, 13, 0)], z)
    small, big = (disc(occ, circle, z) for circle in ((WRIST, 0, SMALL_EYE / 2), (RADIUS, 0, BIG_EYE / 2)))
    lugs = box(occ, (RADIUS - 12, RADIUS + 12), (-BOLT_AT - 8, BOLT_AT + 8), z)  # what the bolts hold together
    body = joined(occ, [shank, small, big, lugs])
    body = rounded(occ, body, 6.0, lambda at, along: upright(at, along) and (at[0] > RADIUS + 13 or _at_lug(at)))
    bosses = [(WRIST, 0.0, SMALL_EYE / 2 - 2), (RADIUS, 0.0, BIG_EYE / 2 - 2)]
    body = joined(occ, [body, *(disc(occ, circle, (-HALF_EYE, HALF_EYE)) for circle in bosses)])
    pockets = [_pocket(occ, side) for side in ((HALF_WEB, HALF_FLANGE + 1), (-HALF_FLANGE - 1, -HALF_WEB))]
    bores = [(WRIST, 0.0, SMALL_BORE / 2), (RADIUS, 0.0, CRANK_PIN / 2)]
    body = without(occ, body, [*pockets, *(disc(occ, bore, (-20, 20)) for bore in bores)])
    body = rounded(occ, body, 2.0, lambda at, along: _pocket_floor(at) and abs(along[2]) < 0.1)
    bolts = [_bolt(occ, y) for y in (-BOLT_AT, BOLT_AT)]
    return joined(occ, [body, *bolts])


def _at_lug(at: tuple[float, float, float]) -> bool:
    """Whether an upright edge is an outer corner of the lugs."""
    return abs(at[1]) > BOLT_AT + 7 and abs(abs(at[0] - RADIUS) - 12) < 0.1


def _pocket_floor(at: tuple[float, float, float]) -> bool:
    return abs(abs(at[2]) - HALF_WEB) < 0.1 and RADIUS + 30 < at[0] < WRIST - 20


def _pocket(occ: ModuleType, z: tuple[float, float]) -> int:
    """What makes the shank an I-section on one side."""
    x0, x1 = RADIUS + 34, WRIST - 26
    return plate(occ, [(x0, -8.2, 4), (x1, -6.2, 4), (x1, 6.2, 4), (x0, 8.2, 4)], z)


def _bolt(occ: ModuleType, y: float) -> int:
    """A bolt's head below the cap and its nut above the lug."""
    head = occ.addCylinder(RADIUS - 17, y, 0, 5.5, 0, 0, BOLT_HEAD / 2)
    nut = occ.addCylinder(RADIUS + 11.5, y, 0, 4.5, 0, 0, BOLT_HEAD / 2)
    end = occ.addCylinder(RADIUS + 15.5, y, 0, 3.5, 0, 0, BOLT / 2)
    return joined(occ, [joined(occ, [nut, end]), occ.addCylinder(RADIUS - 12, y, 0, 24, 0, 0, BOLT / 2), head])


def piston(occ: ModuleType) -> int:
    """Piston: hollow, three grooves, bowl in the crown, bosses about the pin, edges rounded."""
    body = without(occ, _turned(occ, _outside()), [_hollow(occ)])
    bosses = []
    for z in ((HALF_GAP, PISTON / 2 - 1), (1 - PISTON / 2, -HALF_GAP)):
        rib = box(occ, (WRIST, WRIST + CEILING + 2), (-BOSS / 2, BOSS / 2), z)
        eye = joined(occ, [disc(occ, (WRIST, 0, BOSS / 2), z), rib])
        length = CEILING + 4 - SKIRT
        bosses.append(
            common(occ, eye, occ.addCylinder(WRIST + SKIRT, 0, 0, length, 0, 0, PISTON / 2 - GROOVE_DEPTH - 0.5))
        )
    bowl = occ.addSphere(WRIST + CROWN + 87, 0, 0, 90)
    whole = without(occ, joined(occ, [body, *bosses]), [bowl, disc(occ, (WRIST, 0, SMALL_BORE / 2), (-PISTON, PISTON))])
    return rounded(occ, whole, 1.0, lambda at, _: abs(at[0] - WRIST - CROWN) < 0.1 and hypot(*at[1:]) > PISTON / 2 - 1)


def pin(occ: ModuleType) -> int:
    """Hollow pin of the piston, its outside in three faces: what the bosses hold and what the rod turns on."""
    cuts = (-PIN_HALF, -HALF_GAP + 0.5, HALF_GAP - 0.5, PIN_HALF)
    pieces = [disc(occ, (WRIST, 0, SMALL_BORE / 2), (low, high)) for low, high in pairwise(cuts)]
    with gmsh_options(gmsh, {"Geometry.OCCUnionUnify": 0.0}):
        whole = joined(occ, pieces)
        whole = without(occ, whole, [disc(occ, (WRIST, 0, PIN_HOLE / 2), (-40, 40))])
        return rounded(occ, whole, 1.0, lambda at, _: abs(abs(at[2]) - PIN_HALF) < 0.1)


def ring(occ: ModuleType, x: float, width: float) -> int:
    """A piston ring in its groove, with its gap on the side of -y, edges rounded."""
    low, high = WRIST + x + RING_PLAY, WRIST + x + width - RING_PLAY
    inner = PISTON / 2 - GROOVE_DEPTH + RING_BEHIND
    whole = without(
        occ,
        occ.addCylinder(low, 0, 0, high - low, 0, 0, BORE / 2),
        [
            occ.addCylinder(low, 0, 0, high - low, 0, 0, inner),
            box(occ, (low - 1, high + 1), (-50, 0), (-RING_GAP / 2, RING_GAP / 2)),
        ],
    )
    return rounded(occ, whole, 0.3, lambda at, along: abs(along[0]) < 0.1 and hypot(*at[1:]) > BORE / 2 - 0.1)


def _outside() -> list[tuple[float, float]]:
    """x and radius of the turned outside, from the skirt's end to the crown."""
    outline = [(SKIRT, 0.0), (SKIRT, PISTON / 2)]
    for x, width in GROOVES:
        bottom = PISTON / 2 - GROOVE_DEPTH
        outline += [(x, PISTON / 2), (x, bottom), (x + width, bottom), (x + width, PISTON / 2)]
    return [*outline, (CROWN, PISTON / 2), (CROWN, 0.0)]


def _turned(occ: ModuleType, outline: list[tuple[float, float]]) -> int:
    """The solid of revolution about x of an outline whose x counts from the pin's axis."""
    points = [occ.addPoint(WRIST + x, y, 0) for x, y in outline]
    loop = occ.addCurveLoop([occ.addLine(points[k - 1], point) for k, point in enumerate(points)])
    face = occ.addPlaneSurface([loop])
    made = occ.revolve([(2, face)], WRIST, 0, 0, 1, 0, 0, 2 * pi)
    occ.remove([(2, face)], recursive=True)
    return next(tag for dim, tag in made if dim == 3)


def _hollow(occ: ModuleType) -> int:
    """The inside, narrower behind the grooves, rounded at the ceiling."""
    inner, narrow = PISTON / 2 - WALL, PISTON / 2 - WALL - LAND
    outline = [(SKIRT - 1, 0.0), (SKIRT - 1, inner), (GROOVES[0][0] - 8, inner), (GROOVES[0][0] - 1, narrow)]
    hollow = _turned(occ, [*outline, (CEILING, narrow), (CEILING, 0.0)])
    return rounded(occ, hollow, 4.0, lambda at, _: abs(at[0] - WRIST - CEILING) < 0.1)
