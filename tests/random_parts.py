"""Parts of random dimensions, in families that a designer draws, easy and hard: what a mesher must mesh or refuse.

Millimetres, gmsh's OpenCASCADE, drawn in the model that is open.
"""

from collections.abc import Callable
from math import cos, pi, sin
from types import ModuleType

import numpy as np
from geometry.drawing import box, disc, joined, plate, rounded, strap, upright, without

Rng = np.random.Generator
Family = Callable[[ModuleType, Rng], int]


def random_part(occ: ModuleType, rng: Rng) -> tuple[str, int]:
    """A part of a family by chance: the family's name and the solid's tag."""
    kind = str(rng.choice(sorted(FAMILIES)))
    tag = FAMILIES[kind](occ, rng)
    occ.rotate([(3, tag)], 0, 0, 0, *_axis(rng), _between(rng, 0, 2 * pi) if rng.random() < 0.5 else 0.0)
    occ.synchronize()
    return kind, tag


def _between(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _axis(rng: Rng) -> list[float]:
    vector = rng.normal(size=3)
    return [float(x) for x in vector / np.linalg.norm(vector)]


def _box(occ: ModuleType, rng: Rng) -> int:
    return box(occ, (0, _between(rng, 20, 200)), (0, _between(rng, 2, 50)), (0, _between(rng, 2, 50)))


def _tapered_bar(occ: ModuleType, rng: Rng) -> int:
    length, a, b = _between(rng, 60, 250), _between(rng, 4, 25), _between(rng, 4, 25)
    return plate(occ, [(0, -a, 0), (length, -b, 0), (length, b, 0), (0, a, 0)], (0, _between(rng, 3, 30)))


def _bored_plate(occ: ModuleType, rng: Rng) -> int:
    """One to five bores in a row, now and then a wall of 5 % of a bore to the edge."""
    count, radius, height = int(rng.integers(1, 6)), _between(rng, 3, 15), _between(rng, 2, 25)
    half, pitch = radius * _between(rng, 1.1, 2.5), radius * _between(rng, 2.2, 5)
    end = radius * _between(rng, 1.1, 2.5)
    corner = min(half, end) * _between(rng, 0, 0.9)
    x0, x1 = -end, (count - 1) * pitch + end
    corners = [(x0, -half, corner), (x1, -half, corner), (x1, half, corner), (x0, half, corner)]
    body = plate(occ, corners, (0, height))
    return without(occ, body, [disc(occ, (k * pitch, 0, radius), (-1, height + 1)) for k in range(count)])


def _bossed_plate(occ: ModuleType, rng: Rng) -> int:
    """Two bosses, thicker or thinner than the arm, of the arm's ends' width or less."""
    length, half = _between(rng, 50, 180), _between(rng, 2, 10)
    eyes = [(0.0, 0.0, _between(rng, 10, 22)), (length, 0.0, _between(rng, 8, 20))]
    body = strap(occ, eyes[0], eyes[1], (-half, half))
    heights = [half * _between(rng, 1.1, 2.5) for _ in eyes]
    share = _between(rng, 0.7, 0.95)
    bosses = [disc(occ, (x, y, share * r), (-h, h)) for (x, y, r), h in zip(eyes, heights, strict=True)]
    bores = [disc(occ, (x, y, r * _between(rng, 0.3, 0.6)), (-50, 50)) for x, y, r in eyes]
    return without(occ, joined(occ, [body, *bosses]), bores)


def _pocketed_plate(occ: ModuleType, rng: Rng) -> int:
    """Pockets from one side or both, walls and floor as thin as 1 mm."""
    a, b, height = _between(rng, 40, 150), _between(rng, 20, 80), _between(rng, 6, 25)
    wall, floor, r = _between(rng, 1, 6), _between(rng, 1, 0.4 * height), _between(rng, 1, 5)
    body = plate(occ, [(0, 0, r + wall), (a, 0, r + wall), (a, b, r + wall), (0, b, r + wall)], (0, height))
    inner = [(wall, wall, r), (a - wall, wall, r), (a - wall, b - wall, r), (wall, b - wall, r)]
    pockets = [plate(occ, inner, ((height + floor) / 2, height))]
    if rng.random() < 0.6:
        pockets.append(plate(occ, inner, (0, (height - floor) / 2)))
    return without(occ, body, pockets)


def _stepped_shaft(occ: ModuleType, rng: Rng) -> int:
    z, pieces = 0.0, []
    for _ in range(int(rng.integers(2, 6))):
        length = _between(rng, 8, 60)
        pieces.append(disc(occ, (0, 0, _between(rng, 5, 25)), (z, z + length)))
        z += length
    shaft = joined(occ, pieces)
    return without(occ, shaft, [disc(occ, (0, 0, 3), (-1, z + 1))]) if rng.random() < 0.4 else shaft


def _tube(occ: ModuleType, rng: Rng) -> int:
    """A tube with a bore across both walls, which are 1.5 mm thick or more."""
    radius, length = _between(rng, 10, 30), _between(rng, 30, 150)
    inner, cross = radius - _between(rng, 1.5, 0.5 * radius), radius * _between(rng, 0.15, 0.6)
    tools = [disc(occ, (0, 0, inner), (-1, length + 1))]
    tools.append(occ.addCylinder(-2 * radius, 0, length * _between(rng, 0.35, 0.65), 4 * radius, 0, 0, cross))
    return without(occ, disc(occ, (0, 0, radius), (0, length)), tools)


def _bell_crank(occ: ModuleType, rng: Rng) -> int:
    """Two arms at an angle, filleted in the corner, three bores and a boss."""
    angle, half = _between(rng, 0.9, 2.4), _between(rng, 3, 10)
    first, second = _between(rng, 60, 140), _between(rng, 60, 120)
    ends = [(first, 0.0), (second * cos(angle), second * sin(angle))]
    eyes = [_between(rng, 9, 15), _between(rng, 9, 15)]
    arms = [strap(occ, (0, 0, 18), (*end, r), (-half, half)) for end, r in zip(ends, eyes, strict=True)]
    body = rounded(occ, joined(occ, arms), _between(rng, 2, 8), upright)
    body = joined(occ, [body, disc(occ, (0, 0, 15), (-half - 5, half + 5))])
    bores = [disc(occ, (*end, 0.5 * r), (-50, 50)) for end, r in zip(ends, eyes, strict=True)]
    return without(occ, body, [*bores, disc(occ, (0, 0, 8), (-50, 50))])


def _clevis(occ: ModuleType, rng: Rng) -> int:
    r, gap, lug = _between(rng, 8, 20), _between(rng, 3, 10), _between(rng, 3, 10)
    reach, length, top = r * _between(rng, 1.2, 2), _between(rng, 20, 80), gap + lug
    fork = joined(occ, [disc(occ, (0, 0, r), (-top, top)), box(occ, (-reach - 8, 0), (-r, r), (-top, top))])
    w = r * _between(rng, 0.5, 0.9)
    shank = box(occ, (-reach - 8 - length, -reach - 8), (-w, w), (-w, w) if w < top else (-top, top))
    tools = [box(occ, (-reach, r + 1), (-r - 1, r + 1), (-gap, gap))]
    tools.append(disc(occ, (0, 0, r * _between(rng, 0.35, 0.75)), (-top - 1, top + 1)))
    return without(occ, joined(occ, [fork, shank]), tools)


def _filleted_block(occ: ModuleType, rng: Rng) -> int:
    """All twelve edges rounded, up to nearly half the least side."""
    sides = [_between(rng, 10, 80) for _ in range(3)]
    body = box(occ, (0, sides[0]), (0, sides[1]), (0, sides[2]))
    return rounded(occ, body, min(sides) * _between(rng, 0.05, 0.45), lambda at, along: True)


def _bracket(occ: ModuleType, rng: Rng) -> int:
    """Two plates at right angles, bores in both, with or without a fillet in the corner."""
    a, b, width, t = _between(rng, 30, 90), _between(rng, 30, 90), _between(rng, 20, 60), _between(rng, 2, 9)
    body = joined(occ, [box(occ, (0, a), (0, width), (0, t)), box(occ, (0, t), (0, width), (0, b))])
    if rng.random() < 0.6:
        inner = _between(rng, 1, 8)
        body = rounded(occ, body, inner, lambda at, _: abs(at[0] - t) + abs(at[2] - t) < 1e-6)
    r = _between(rng, 2.5, 7)
    upper = occ.addCylinder(-1, width / 2, t + 0.6 * (b - t), t + 2, 0, 0, r)
    return without(occ, body, [disc(occ, (t + 0.6 * (a - t), width / 2, r), (-1, t + 1)), upper])


def _ball_rod(occ: ModuleType, rng: Rng) -> int:
    ball, length = _between(rng, 8, 20), _between(rng, 60, 160)
    neck = ball * _between(rng, 0.35, 0.8)
    rod = [occ.addSphere(0, 0, 0, ball), occ.addCylinder(0, 0, 0, length, 0, 0, neck)]
    if rng.random() < 0.5:
        rod.append(occ.addSphere(length, 0, 0, ball * _between(rng, 0.8, 1.2)))
    return joined(occ, rod)


def _bent_bar(occ: ModuleType, rng: Rng) -> int:
    """A round or square bar turned about an axis by some angle, with a straight end."""
    bend, half = _between(rng, 15, 60), _between(rng, 3, 12)
    if rng.random() < 0.5:
        face = occ.addDisk(bend, 0, 0, half, half)
    else:
        face = occ.addRectangle(bend - half, -half, 0, 2 * half, 2 * half)
    straight = occ.extrude([(2, face)], 0, 0, -_between(rng, 20, 100))
    turned = occ.revolve([(2, face)], 0, 0, 0, 0, 1, 0, -_between(rng, 0.4, 2.6))
    occ.remove([(2, face)], recursive=True)
    return joined(occ, [tag for dim, tag in [*straight, *turned] if dim == 3])


def _frustum(occ: ModuleType, rng: Rng) -> int:
    r1, r2, height = _between(rng, 5, 40), _between(rng, 5, 40), _between(rng, 5, 80)
    cone = occ.addCone(0, 0, 0, 0, 0, height, r1, r2 + 0.1 * r1)
    if rng.random() < 0.5:
        return cone
    return without(occ, cone, [disc(occ, (0, 0, min(r1, r2) * _between(rng, 0.2, 0.8)), (-1, height + 1))])


FAMILIES: dict[str, Family] = {
    "ball-ended rod": _ball_rod,
    "bell crank": _bell_crank,
    "bent bar": _bent_bar,
    "bored plate": _bored_plate,
    "bossed plate": _bossed_plate,
    "box": _box,
    "bracket": _bracket,
    "clevis": _clevis,
    "filleted block": _filleted_block,
    "frustum": _frustum,
    "pocketed plate": _pocketed_plate,
    "stepped shaft": _stepped_shaft,
    "tapered bar": _tapered_bar,
    "tube": _tube,
}
