"""Some forty parts as designers draw them, blends everywhere; ``python -m geometry.catalogue`` meshes them all.

Each is a function that draws one solid with gmsh's OpenCASCADE, in millimetres; the table goes to docs/catalogue.md.
"""

import re
import sys
from collections.abc import Callable
from math import cos, hypot, pi, radians, sin, tan
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from types import ModuleType

import gmsh

from geometry.drawing import Point, box, disc, joined, plate, prism, rounded, sharp_edges, strap, upright, without
from geometry.make import empty_model
from geometry.step_files import write_step
from kedfem.errors import MeshError
from kedfem.links.solid import solid_basis
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.mesh.cad.model import CadKeys
from kedfem.mesh.elements.bounds import determinant_bounds
from kedfem.mesh.isolated import LONGEST, PART, in_own_process
from kedfem.mesh.methods import made_mesh
from kedfem.output.mesh_picture import write_mesh_picture
from kedfem.scene import Cad, link_from

TURNED = re.compile("(swept about|carried along)[^;]*")
DOCS = Path(__file__).parents[1] / "docs"
Occ = ModuleType
PARTS: dict[str, Callable[[Occ], int]] = {}


def part(draw: Callable[[Occ], int]) -> Callable[[Occ], int]:
    """Takes a function into the catalogue, under its name."""
    PARTS[draw.__name__] = draw
    return draw


def rod(occ: Occ, at: Point, along: Point, radius: float) -> int:
    """A cylinder from a point along a vector."""
    return occ.addCylinder(*at, *along, radius)


def revolved(occ: Occ, outline: list[tuple[float, float]]) -> int:
    """A solid of revolution about x from its outline (x, r), in order."""
    points = [occ.addPoint(x, r, 0) for x, r in outline]
    lines = [occ.addLine(points[k - 1], points[k]) for k in range(len(points))]
    face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    made = occ.revolve([(2, face)], 0, 0, 0, 1, 0, 0, 2 * pi)
    occ.remove([(2, face)], recursive=True)
    return next(tag for dim, tag in made if dim == 3)


def chamfered(occ: Occ, tag: int, width: float, chosen: Callable[[Point, Point], bool]) -> int:
    """A solid with chamfers along the edges that are chosen by their middle and direction."""
    edges = [edge for edge, middle, along in sharp_edges(occ, tag) if chosen(middle, along)]
    faces = [int(gmsh.model.getAdjacencies(1, edge)[0][0]) for edge in edges]
    made, *_ = (occ.chamfer([tag], edges, faces, [width]),)
    return next(tag for dim, tag in made if dim == 3)


def swept(occ: Occ, radius: float, bends: list[Point], inner: float = 0.0) -> int:
    """A round bar, or a tube, along arcs in the plane z = 0: start, middle and end of each, in order, from x = 0 along
    y."""
    tags = []
    for r in (radius, inner):
        if r == 0:
            continue
        points = [occ.addPoint(*at) for at in bends]
        arcs = [
            occ.addCircleArc(points[k], points[k + 1], points[k + 2], center=False) for k in range(0, len(points) - 2, 2)
        ]
        wire = occ.addWire(arcs)
        face = occ.addDisk(*bends[0], r, r, zAxis=[0, 1, 0])
        made = occ.addPipe([(2, face)], wire)
        occ.remove([(2, face)], recursive=True)
        tags.append(next(tag for dim, tag in made if dim == 3))
    return tags[0] if len(tags) == 1 else without(occ, tags[0], tags[1:])


def anywhere(_: Point, __: Point) -> bool:
    """All edges."""
    return True


@part
def plate_with_chamfered_bores(occ: Occ) -> int:
    body = without(occ, box(occ, (0, 100), (0, 30), (0, 10)), [disc(occ, (x, 15, 6), (-1, 11)) for x in (20, 80)])
    return chamfered(occ, body, 1.0, lambda at, _: min(hypot(at[0] - x, at[1] - 15) for x in (20, 80)) < 7)


@part
def lever_with_rounded_edges(occ: Occ) -> int:
    body = strap(occ, (0, 0, 16), (90, 0, 11), (0, 12))
    body = without(occ, body, [disc(occ, (0, 0, 8), (-1, 13)), disc(occ, (90, 0, 5), (-1, 13))])
    return rounded(
        occ, body, 1.0, lambda at, along: abs(along[2]) < 0.5 and hypot(*at[:2]) > 9 and hypot(at[0] - 90, at[1]) > 6
    )


@part
def casting(occ: Occ) -> int:
    base = box(occ, (0, 80), (0, 50), (0, 8))
    boss = occ.addCone(25, 25, 4, 0, 0, 36, 14, 10)
    rib = occ.addWedge(25, 22, 6, 45, 6, 30, ltx=5)
    body = joined(occ, [base, boss, rib])
    return without(occ, body, [disc(occ, (25, 25, 6), (-1, 50)), *(disc(occ, (70, y, 3), (-1, 9)) for y in (10, 40))])


@part
def ribbed_bell_crank(occ: Occ) -> int:
    web = joined(occ, [strap(occ, (0, 0, 14), (70, 0, 10), (-3, 3)), strap(occ, (0, 0, 14), (0, 55, 9), (-3, 3))])
    ribs = [occ.addWedge(0, -3, 3, 70, 6, 8, ltx=62), occ.addWedge(-3, 0, 3, 6, 55, 8, ltx=3)]
    hubs = [occ.addCone(*at, -8, 0, 0, 16, r, r - 1) for at, r in (((0, 0), 14), ((70, 0), 10), ((0, 55), 9))]
    body = joined(occ, [web, *ribs, *hubs])
    return without(
        occ, body, [disc(occ, (0, 0, 8), (-9, 13)), disc(occ, (70, 0, 5), (-9, 13)), disc(occ, (0, 55, 4.5), (-9, 13))]
    )


@part
def i_section_rod(occ: Occ) -> int:
    eyes = [disc(occ, (0, 0, 26), (-9, 9)), disc(occ, (120, 0, 15), (-9, 9))]
    shank = plate(occ, [(15, -12, 0), (112, -8, 0), (112, 8, 0), (15, 12, 0)], (-7, 7))
    pockets = [plate(occ, [(32, -7, 3), (100, -4.5, 3), (100, 4.5, 3), (32, 7, 3)], z) for z in ((2, 8), (-8, -2))]
    bosses = [box(occ, (-18, 14), (y - 7, y + 7), (-8, 8)) for y in (-26, 26)]
    body = joined(occ, [without(occ, shank, pockets), *eyes, *bosses])
    bolts = [rod(occ, (-20, y, 0), (36, 0, 0), 3.5) for y in (-27.5, 27.5)]
    body = without(occ, body, [disc(occ, (0, 0, 18), (-10, 10)), disc(occ, (120, 0, 9), (-10, 10)), *bolts])
    return rounded(occ, body, 1.0, lambda at, along: 40 < at[0] < 95 and abs(abs(at[2]) - 2) < 0.1)


@part
def bent_bracket(occ: Occ) -> int:
    corners = [(0, 0, 0), (60, 0, 5), (60, 40, 5), (100, 40, 0), (100, 43, 0), (57, 43, 2), (57, 3, 2), (0, 3, 0)]
    body = plate(occ, corners, (0, 50))
    occ.synchronize()
    holes = [rod(occ, (x, -1, 25), (0, 60, 0), r) for x, r in ((20, 6), (85, 5))]
    body = without(occ, body, [*holes, rod(occ, (50, 22, 25), (15, 0, 0), 7)])
    return rounded(occ, body, 6.0, lambda at, along: abs(along[1]) > 0.99 and (at[0] < 1 or at[0] > 99))


@part
def u_channel(occ: Occ) -> int:
    corners = [(-30, 40, 0), (-30, 0, 6), (30, 0, 6), (30, 40, 0), (27, 40, 0), (27, 3, 3), (-27, 3, 3), (-27, 40, 0)]
    body = plate(occ, corners, (0, 80))
    return without(occ, body, [rod(occ, (-40, 25, z), (80, 0, 0), 5) for z in (20, 60)])


@part
def slotted_sheet(occ: Occ) -> int:
    body = box(occ, (0, 120), (0, 60), (0, 1.5))
    slots = [strap(occ, (20, y, 3), (70, y, 3), (-1, 3)) for y in (15, 30, 45)]
    return without(occ, body, [*slots, disc(occ, (100, 30, 9), (-1, 3))])


@part
def pipe_tee(occ: Occ) -> int:
    outer = joined(occ, [rod(occ, (-50, 0, 0), (100, 0, 0), 16), rod(occ, (0, 0, 0), (0, 45, 0), 12)])
    return without(occ, outer, [rod(occ, (-51, 0, 0), (102, 0, 0), 13), rod(occ, (0, 0, 0), (0, 46, 0), 9)])


@part
def crossing_bores(occ: Occ) -> int:
    tools = [
        rod(occ, (-1, 20, 20), (62, 0, 0), 8),
        rod(occ, (30, -1, 20), (0, 42, 0), 8),
        rod(occ, (30, 20, 10), (0, 0, 31), 5),
    ]
    return without(occ, box(occ, (0, 60), (0, 40), (0, 40)), tools)


@part
def stepped_shaft(occ: Occ) -> int:
    body = joined(
        occ,
        [rod(occ, (0, 0, 0), (40, 0, 0), 10), rod(occ, (40, 0, 0), (50, 0, 0), 15), rod(occ, (90, 0, 0), (30, 0, 0), 8)],
    )
    return rounded(
        occ,
        body,
        2.0,
        lambda at, _: (abs(at[0] - 40) < 0.1 and hypot(*at[1:]) < 11) or (abs(at[0] - 90) < 0.1 and hypot(*at[1:]) < 9),
    )


@part
def keyed_shaft(occ: Occ) -> int:
    body = joined(occ, [rod(occ, (0, 0, 0), (60, 0, 0), 12), rod(occ, (60, 0, 0), (30, 0, 0), 9)])
    key = strap(occ, (12, 0, 4), (42, 0, 4), (7.5, 15))
    return chamfered(occ, without(occ, body, [key]), 1.0, lambda at, along: at[0] < 0.1 or at[0] > 89.9)


@part
def splined_shaft(occ: Occ) -> int:
    teeth = []
    for k in range(12):
        tooth = box(occ, (0, 40), (9, 12.5), (-1.6, 1.6))
        occ.rotate([(3, tooth)], 0, 0, 0, 1, 0, 0, k * pi / 6)
        teeth.append(tooth)
    return joined(occ, [rod(occ, (0, 0, 0), (90, 0, 0), 10), rod(occ, (40, 0, 0), (30, 0, 0), 14), *teeth])


@part
def crank_throw(occ: Occ) -> int:
    webs = [strap(occ, (0, 0, 22), (35, 0, 18), z) for z in ((20, 32), (58, 70))]
    pins = [disc(occ, (0, 0, 14), (0, 20)), disc(occ, (35, 0, 12), (32, 58)), disc(occ, (0, 0, 14), (70, 90))]
    body = joined(occ, [*webs, *pins])
    body = rounded(occ, body, 1.5, lambda at, _: abs(at[2] - 32) < 0.1 and hypot(at[0] - 35, at[1]) < 12.5)
    return chamfered(occ, body, 1.0, lambda at, along: abs(at[2]) < 0.1 or abs(at[2] - 90) < 0.1)


@part
def crank_with_counterweight(occ: Occ) -> int:
    sector = without(occ, disc(occ, (0, 0, 45), (0, 14)), [box(occ, (-60, 60), (-10, 60), (-1, 15))])
    web = strap(occ, (0, 0, 18), (32, 20, 15), (0, 14))
    body = joined(occ, [sector, web, disc(occ, (32, 20, 9), (14, 40)), disc(occ, (0, 0, 14), (-25, 0))])
    return rounded(occ, body, 1.0, lambda at, _: abs(at[2] - 14) < 0.1 and hypot(at[0] - 32, at[1] - 20) < 9.5)


@part
def fork(occ: Occ) -> int:
    body = joined(
        occ,
        [
            box(occ, (0, 40), (-15, 15), (-14, 14)),
            rod(occ, (0, -15, 0), (0, 30, 0), 14),
            rod(occ, (40, 0, 0), (50, 0, 0), 9),
        ],
    )
    body = without(occ, body, [box(occ, (-20, 26), (-8, 8), (-20, 20)), rod(occ, (0, -20, 0), (0, 40, 0), 6)])
    return rounded(occ, body, 2.5, lambda at, along: abs(at[0] - 26) < 0.1 and abs(abs(along[2])) > 0.9)


@part
def ball_seat(occ: Occ) -> int:
    body = joined(occ, [box(occ, (-20, 20), (-20, 20), (0, 30)), rod(occ, (0, 0, -30), (0, 0, 30), 8)])
    return without(occ, body, [occ.addSphere(0, 0, 32, 15)])


@part
def rod_end_with_thread(occ: Occ) -> int:
    outline = [(14, 0), (60, 0), (60, 5)]
    for k in range(18):
        x = 58 - 2 * k
        outline += [(x, 6), (x - 0.5, 6), (x - 1.1, 5.2), (x - 1.4, 5.2)]
    outline += [(20, 6), (14, 6)]
    eye = without(
        occ,
        joined(occ, [occ.addSphere(0, 0, 0, 17), revolved(occ, outline)]),
        [box(occ, (-20, 13), (-20, 20), z) for z in ((8, 20), (-20, -8))],
    )
    return without(occ, eye, [disc(occ, (0, 0, 9), (-20, 20))])


@part
def rod_end(occ: Occ) -> int:
    body = joined(occ, [disc(occ, (0, 0, 16), (-8, 8)), rod(occ, (0, 0, 0), (60, 0, 0), 6)])
    body = without(occ, body, [disc(occ, (0, 0, 9), (-9, 9))])
    return rounded(occ, body, 1.0, lambda at, along: hypot(*at[:2]) < 17 and abs(at[2]) < 6.5 and at[0] > 12)


@part
def housing(occ: Occ) -> int:
    shell = without(occ, plate(occ, [(0, 0, 8), (90, 0, 8), (90, 60, 8), (0, 60, 8)], (0, 40)),
                    [plate(occ, [(5, 5, 4), (85, 5, 4), (85, 55, 4), (5, 55, 4)], (5, 41))])  # fmt: skip
    body = joined(
        occ,
        [
            shell,
            *(disc(occ, (x, y, 6), (0, 40)) for x in (9, 81) for y in (9, 51)),
            rod(occ, (-8, 30, 22), (20, 0, 0), 14),
        ],
    )
    holes = [disc(occ, (x, y, 2.5), (20, 41)) for x in (9, 81) for y in (9, 51)]
    return without(occ, body, [*holes, rod(occ, (-9, 30, 22), (30, 0, 0), 9)])


@part
def spur_gear(occ: Occ) -> int:
    teeth, module = 24, 3.0
    pitch, corners = teeth * module / 2, []
    for k in range(teeth):
        for angle, r in ((-0.27, pitch - 3.7), (-0.13, pitch + 2.9), (0.13, pitch + 2.9), (0.27, pitch - 3.7)):
            phi = (2 * pi * k + 2 * pi * angle) / teeth
            corners.append((r * cos(phi), r * sin(phi), 0.0))
    body = plate(occ, corners, (0, 15))
    return without(occ, body, [disc(occ, (0, 0, 10), (-1, 16)), box(occ, (9, 13), (-2.5, 2.5), (-1, 16))])


@part
def v_pulley(occ: Occ) -> int:
    outline = [
        (-10, 8),
        (10, 8),
        (10, 15),
        (5, 15),
        (5, 32),
        (12, 32),
        (12, 48),
        (9, 48),
        (3, 37),
        (-3, 37),
        (-9, 48),
        (-12, 48),
        (-12, 32),
        (-5, 32),
        (-5, 15),
        (-10, 15),
    ]
    return revolved(occ, outline)


@part
def spoked_wheel(occ: Occ) -> int:
    rim = without(occ, disc(occ, (0, 0, 60), (0, 16)), [disc(occ, (0, 0, 50), (-1, 17))])
    spokes = [plate(occ, [(14 * cos(a) - 5 * sin(a), 14 * sin(a) + 5 * cos(a), 0), (14 * cos(a) + 5 * sin(a), 14 * sin(a) - 5 * cos(a), 0),
                          (54 * cos(a) + 3 * sin(a), 54 * sin(a) - 3 * cos(a), 0), (54 * cos(a) - 3 * sin(a), 54 * sin(a) + 3 * cos(a), 0)], (4, 12))
              for a in (2 * pi * k / 5 for k in range(5))]  # fmt: skip
    return without(occ, joined(occ, [rim, disc(occ, (0, 0, 18), (-4, 20)), *spokes]), [disc(occ, (0, 0, 9), (-5, 21))])


@part
def flanged_pipe(occ: Occ) -> int:
    body = joined(
        occ,
        [rod(occ, (0, 0, 0), (80, 0, 0), 20), rod(occ, (0, 0, 0), (10, 0, 0), 40), rod(occ, (70, 0, 0), (10, 0, 0), 36)],
    )
    bolts = [rod(occ, (-1, 31 * cos(k * pi / 3), 31 * sin(k * pi / 3)), (12, 0, 0), 4) for k in range(6)]
    body = without(occ, body, [rod(occ, (-1, 0, 0), (82, 0, 0), 16), *bolts])
    return rounded(occ, body, 3.0, lambda at, _: hypot(*at[1:]) < 21 and hypot(*at[1:]) > 19 and 9 < at[0] < 71)


@part
def pipe_elbow(occ: Occ) -> int:
    return swept(occ, 12, [(0, 0, 0), (40 - 40 * cos(pi / 4), 40 * sin(pi / 4), 0), (40, 40, 0)], 9)


@part
def bent_bar(occ: Occ) -> int:
    return swept(occ, 6, [(0, 0, 0), (50 - 50 * cos(pi / 4), 50 * sin(pi / 4), 0), (50, 50, 0)])


@part
def hook(occ: Occ) -> int:
    arc = [(25 - 25 * cos(a), 25 * sin(a), 0) for a in (k * pi / 8 for k in range(11))]
    bar = swept(occ, 6, arc)
    return joined(occ, [bar, rod(occ, (0, 0.5, 0), (0, -40.5, 0), 6), rod(occ, (-10, -40, 0), (20, 0, 0), 9)])


@part
def chamfered_bushing(occ: Occ) -> int:
    return revolved(occ, [(0, 10), (1, 9), (29, 9), (30, 10), (30, 13), (29, 14), (6, 14), (6, 18), (0, 18)])


@part
def hexagon_bolt(occ: Occ) -> int:
    head = plate(occ, [(11 * cos(k * pi / 3), 11 * sin(k * pi / 3), 0) for k in range(6)], (0, 8))
    cone = occ.addCone(0, 0, -1, 0, 0, 9.2, 14, 8.8)
    head = next(tag for dim, tag in occ.intersect([(3, head)], [(3, cone)])[0] if dim == 3)
    body = joined(occ, [head, rod(occ, (0, 0, 0), (0, 0, -50), 6)])
    return rounded(occ, body, 0.6, lambda at, _: abs(at[2]) < 0.1 and hypot(*at[:2]) < 6.5)


@part
def hexagon_nut(occ: Occ) -> int:
    body = plate(occ, [(11 * cos(k * pi / 3), 11 * sin(k * pi / 3), 0) for k in range(6)], (0, 10))
    body = without(occ, body, [disc(occ, (0, 0, 5), (-1, 11))])
    return chamfered(occ, body, 0.8, lambda at, _: hypot(*at[:2]) < 5.5)


@part
def drafted_knob(occ: Occ) -> int:
    body = joined(occ, [occ.addCone(0, 0, 0, 0, 0, 25, 18, 15), occ.addCone(0, 0, 25, 0, 0, 20, 8, 7)])
    body = rounded(occ, body, 2.0, lambda at, _: abs(at[2] - 25) < 0.1)
    return without(occ, body, [disc(occ, (0, 0, 4), (-1, 30))])


@part
def piston_with_rings(occ: Occ) -> int:
    outline = [(0, 0), (45, 0), (45, 30), (42, 30)]
    for x in (41, 37, 33):
        outline += [(x, 30), (x, 27), (x - 2, 27), (x - 2, 30)]
    outline += [(0, 30), (0, 26), (30, 26), (36, 20), (36, 0)]
    outline = [(x, r) for x, r in outline if (x, r) != (0, 0)]
    body = revolved(occ, outline)
    pins = [rod(occ, (14, 0, z), (0, 0, s * 16), 11) for z, s in ((12, 1), (-12, -1))]
    body = joined(occ, [body, *pins])
    return without(occ, body, [rod(occ, (14, 0, -40), (0, 0, 80), 7)])


@part
def poppet_valve(occ: Occ) -> int:
    return revolved(
        occ,
        [
            (0, 0),
            (90, 0),
            (90, 3),
            (86, 3.5),
            (84, 3),
            (82, 3),
            (80, 3.5),
            (18, 3.5),
            (12, 4.5),
            (7, 8),
            (3.5, 14),
            (1.5, 16),
            (0, 16),
        ],
    )


@part
def cam(occ: Occ) -> int:
    body = joined(occ, [strap(occ, (0, 0, 20), (22, 0, 8), (0, 12)), disc(occ, (0, 0, 16), (-10, 22))])
    body = without(occ, body, [disc(occ, (0, 0, 10), (-11, 23)), box(occ, (-13, -8), (-2.5, 2.5), (-11, 23))])
    return chamfered(occ, body, 0.5, lambda at, along: abs(along[2]) < 0.5 and hypot(*at[:2]) > 18)


@part
def forged_rocker(occ: Occ) -> int:
    body = joined(
        occ,
        [
            box(occ, (-45, 45), (-7, 7), (-9, 9)),
            rod(occ, (0, -14, 0), (0, 28, 0), 16),
            occ.addSphere(-45, 0, 0, 11),
            rod(occ, (45, 0, -14), (0, 0, 24), 9),
        ],
    )
    body = rounded(occ, body, 2.0, lambda at, along: abs(along[0]) > 0.99)
    return without(
        occ,
        body,
        [rod(occ, (0, -15, 0), (0, 30, 0), 9), rod(occ, (45, 0, -15), (0, 0, 26), 5), occ.addSphere(-48, 0, 6, 7)],
    )


@part
def cylinder_barrel(occ: Occ) -> int:
    body = joined(
        occ,
        [
            rod(occ, (0, 0, 0), (120, 0, 0), 30),
            rod(occ, (-16, 0, -12), (0, 0, 24), 18),
            *(rod(occ, (x, 0, 25), (0, 0, 14), 9) for x in (25, 100)),
        ],
    )
    return without(
        occ,
        body,
        [
            rod(occ, (8, 0, 0), (120, 0, 0), 25),
            rod(occ, (-16, 0, -13), (0, 0, 26), 9),
            *(rod(occ, (x, 0, 10), (0, 0, 40), 4) for x in (25, 100)),
        ],
    )


@part
def gusseted_mount(occ: Occ) -> int:
    body = joined(
        occ,
        [box(occ, (0, 80), (0, 60), (0, 8)), box(occ, (0, 8), (0, 60), (0, 60)), *(prism_xz(occ, y) for y in (5, 49))],
    )
    holes = [disc(occ, (x, y, 4), (-1, 9)) for x in (40, 70) for y in (20, 40)]
    return without(occ, body, [rod(occ, (-1, 30, 35), (10, 0, 0), 12), *holes])


def prism_xz(occ: Occ, y: float) -> int:
    """A triangular gusset 6 mm thick."""
    tag = prism(occ, [((7, 7, 0), None), ((60, 7, 0), None), ((7, 55, 0), None)], (0, 6))
    occ.rotate([(3, tag)], 0, 0, 0, 1, 0, 0, pi / 2)
    occ.translate([(3, tag)], 0, y + 6, 0)
    return tag


@part
def impeller(occ: Occ) -> int:
    blades = []
    for k in range(6):
        blade = occ.addWedge(8, -1.5, 4, 32, 3, 22, ltx=16)
        occ.rotate([(3, blade)], 0, 0, 0, 0, 0, 1, k * pi / 3)
        blades.append(blade)
    hub = occ.addCone(0, 0, 0, 0, 0, 28, 14, 9)
    return without(occ, joined(occ, [disc(occ, (0, 0, 42), (0, 5)), hub, *blades]), [disc(occ, (0, 0, 5), (-1, 30))])


@part
def tubular_wishbone(occ: Occ) -> int:
    ends = [(0.0, 60.0), (0.0, -60.0)]
    arms = [rod(occ, (120, 0, 0), (x - 120, y, 0), 9) for x, y in ends]
    eyes = [rod(occ, (x - 16, y, 0), (32, 0, 0), 14) for x, y in ends]
    body = joined(occ, [*arms, *eyes, disc(occ, (120, 0, 18), (-14, 14))])
    return without(
        occ, body, [*(rod(occ, (x - 17, y, 0), (34, 0, 0), 9) for x, y in ends), disc(occ, (120, 0, 11), (-15, 15))]
    )


@part
def dovetail_slide(occ: Occ) -> int:
    w = 8 * tan(radians(30))
    corners = [
        (0, 0, 0),
        (80, 0, 0),
        (80, 20, 0),
        (55 + w, 20, 0),
        (55, 12, 0.5),
        (25, 12, 0.5),
        (25 - w, 20, 0),
        (0, 20, 0),
    ]
    corners[3], corners[4] = (55, 20, 0), (55 + w, 12, 0.5)
    corners[5], corners[6] = (25 - w, 12, 0.5), (25, 20, 0)
    body = plate(occ, corners, (0, 60))
    return chamfered(occ, body, 0.5, lambda at, along: upright(at, along) and at[1] < 0.1)


@part
def plate_with_a_tiny_step(occ: Occ) -> int:
    body = joined(occ, [box(occ, (0, 50), (0, 30), (0, 6)), box(occ, (50, 90), (0, 30), (0, 6.05))])
    return without(occ, body, [disc(occ, (x, 15, 6), (-1, 8)) for x in (15, 75)])


@part
def plate_with_a_tiny_edge(occ: Occ) -> int:
    body = plate(occ, [(0, 0, 0), (80, 0, 0), (80.03, 0.03, 0), (80.03, 40, 3), (0, 40, 3)], (0, 8))
    return without(occ, body, [disc(occ, (20, 20, 8), (-1, 9))])


@part
def wedge_with_a_sliver(occ: Occ) -> int:
    body = prism(occ, [((0, 0, 0), None), ((90, 0, 0), None), ((90, 18, 0), None), ((0, 0.4, 0), None)], (0, 30))
    return without(occ, body, [rod(occ, (70, -1, 15), (0, 30, 0), 6)])


@part
def shaft_with_a_small_step(occ: Occ) -> int:
    body = joined(occ, [rod(occ, (0, 0, 0), (50, 0, 0), 12), rod(occ, (50, 0, 0), (50, 0, 0), 12.1)])
    return chamfered(occ, body, 0.5, lambda at, _: at[0] < 0.1 or at[0] > 99.9)


@part
def conical_adapter(occ: Occ) -> int:
    body = joined(occ, [occ.addCone(0, 0, 0, 60, 0, 0, 25, 14), rod(occ, (60, 0, 0), (20, 0, 0), 14)])
    tool = joined(occ, [occ.addCone(-1, 0, 0, 62, 0, 0, 22, 11), rod(occ, (60, 0, 0), (30, 0, 0), 11)])
    return without(occ, body, [tool])


@part
def angled_arm(occ: Occ) -> int:
    arm = box(occ, (0, 70), (-6, 6), (-4, 4))
    occ.rotate([(3, arm)], 0, 0, 0, 0, 1, 0, -radians(25))
    top = (70 * cos(radians(25)), 0.0, 70 * sin(radians(25)))
    body = joined(occ, [arm, rod(occ, (0, 0, -10), (0, 0, 20), 12), rod(occ, (top[0], -9, top[2]), (0, 18, 0), 9)])
    return without(occ, body, [rod(occ, (0, 0, -11), (0, 0, 22), 7), rod(occ, (top[0], -10, top[2]), (0, 20, 0), 5)])


@part
def bored_block_in_inches(occ: Occ) -> int:
    body = without(occ, box(occ, (0, 3), (0, 1.5), (0, 1)), [disc(occ, (x, 0.75, 0.25), (-1, 2)) for x in (0.75, 2.25)])
    return rounded(occ, body, 0.0625, lambda at, along: abs(along[0]) > 0.99)


@part
def boom_in_metres(occ: Occ) -> int:
    shell = without(
        occ, box(occ, (0, 2.4), (-0.1, 0.1), (-0.15, 0.15)), [box(occ, (-1, 3), (-0.085, 0.085), (-0.135, 0.135))]
    )
    body = joined(occ, [shell, *(rod(occ, (x, -0.12, 0.15), (0, 0.24, 0), 0.07) for x in (0.3, 2.1))])
    return without(occ, body, [rod(occ, (x, -0.13, 0.15), (0, 0.26, 0), 0.04) for x in (0.3, 2.1)])


#: Parts that are drawn in other units: metres to one of them; they come as BREP, which has no unit.
UNITS = {"bored_block_in_inches": 0.0254, "boom_in_metres": 1.0}


def written(name: str, folder: Path) -> tuple[Path, float]:
    """A part's file and its volume in CAD [m³]."""
    unit = UNITS.get(name, 1e-3)
    with empty_model() as occ:
        volume = unit**3 * float(occ.getMass(3, PARTS[name](occ)))
        occ.synchronize()
        brep = folder / f"{name}.brep"
        gmsh.write(str(brep))
    if name in UNITS:
        return brep, volume
    file = folder / f"{name}.step"
    with empty_model() as occ:
        occ.importShapes(str(brep), highestDimOnly=True)  # the wires of sweeps stay behind
        occ.synchronize()
        write_step(file, [name])
    return file, volume


def meshed(file: Path, **keys: object) -> SolidMesh:
    """The mesh of a part's file, in this process: at default sizes unless keys of the link's mesh ask for others."""
    shape = {"kind": "cad", "file": file.name} | ({"scale": UNITS[file.stem]} if file.stem in UNITS else {})
    link = link_from({"shape": shape, "material": "steel"} | ({"mesh": keys} if keys else {}))
    if not isinstance(link.shape, Cad):
        raise TypeError("a part of the catalogue comes from CAD")
    return made_mesh(CadKeys(file.name, "solid"), file.stem, link, link.shape, file)


def timed(file: Path) -> tuple[SolidMesh, float]:
    """The mesh of a part's file, and the processor time that it took [s]."""
    start = process_time()
    mesh = meshed(file)
    return mesh, process_time() - start


def row(name: str, folder: Path) -> tuple[str, SolidMesh | None]:
    """A line of the table, and the mesh."""
    file, exact = written(name, folder)
    try:
        mesh, seconds = in_own_process(file.name, PART, LONGEST, timed, file)
    except MeshError as error:
        return f"| {name} | refused: {error} | | | | | |", None
    lower, _ = determinant_bounds(mesh.points, mesh.cells)
    off = float(solid_basis(mesh).dx.sum()) / exact - 1
    kind = "tetrahedra" if mesh.tetrahedra else "hexahedra"
    figures = f"{3 * len(mesh.points):,} | {seconds:.1f} | {mesh_quality(mesh).least:.3f} | {lower.min():.3f} | {100 * off:+.3f}"
    return f"| {name} | {kind}: {mesh.method} | {figures} |", mesh


HEAD = """# Parts as designers draw them, meshed at default sizes

Written by `python -m geometry.catalogue`: each part is drawn by geometry/catalogue.py, written to STEP (two to BREP, in
inches and in metres) and meshed as it comes. Seconds are of processor time. det J is the least proven in
any element, over its mean there. {summary}

![Swept about an axis, or along lines and arcs](pictures/swept.png)

| part | outcome | unknowns | seconds | worst scaled Jacobian | least det J | volume against CAD [%] |
|---|---|---:|---:|---:|---:|---:|
"""


def main() -> None:
    """Draw, mesh and measure all parts."""
    lines, meshes = [], []
    with TemporaryDirectory() as folder:
        for name in PARTS:
            line, mesh = row(name, Path(folder))
            lines.append(line)
            meshes.append((name, mesh))
            sys.stdout.write(line + "\n")
            sys.stdout.flush()
    sizes = sorted(3 * len(mesh.points) for _, mesh in meshes if mesh)
    swept = sum(not mesh.tetrahedra for _, mesh in meshes if mesh)
    summary = (
        f"{len(sizes)} of {len(PARTS)} parts meshed, {swept} with hexahedra; median {sizes[len(sizes) // 2]:,} unknowns, "
        f"most {sizes[-1]:,}."
    )
    titled = [(f"{name}\n{found[0]}", mesh) for name, mesh in meshes if mesh and (found := TURNED.search(mesh.method))]
    write_mesh_picture(titled, DOCS / "pictures" / "swept.png", "Swept about an axis, or along lines and arcs")
    (DOCS / "catalogue.md").write_text(HEAD.format(summary=summary) + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
