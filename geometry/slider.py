"""Crosshead slider: pin bore along z at the origin, sliding along x, its guide faces at y = -32 and y = 32.

A fork of two cheeks (gap |z| < 13 for the connecting rod, bore 20) and a head towards +x.
"""

from types import ModuleType

from geometry.drawing import box, disc, joined, plate, without

BORE, BOSS = 20.0, 34.0  # diameters
TAIL, HEAD = -30.0, 56.0  # ends along x
HALF_WIDTH = 32.0
GAP_END, HALF_GAP = 22.0, 13.0  # how deep and how wide the fork is
HALF_CHEEK, HALF_BOSS = 26.0, 30.0  # heights
CORNER = 8.0
RELIEF = (-8.0, 38.0, 21.0)  # relief of the guide faces: from, to, and half width there


def shape(occ: ModuleType) -> int:
    """The slider's solid."""
    z = (-HALF_CHEEK, HALF_CHEEK)
    body = joined(occ, [plate(occ, _outline(), z), disc(occ, (0, 0, BOSS / 2), (-HALF_BOSS, HALF_BOSS))])
    far = HALF_WIDTH + 1
    gap = box(occ, (TAIL - 1, GAP_END), (-far, far), (-HALF_GAP, HALF_GAP))
    return without(occ, body, [gap, disc(occ, (0, 0, BORE / 2), (-HALF_BOSS, HALF_BOSS))])


def _outline() -> list[tuple[float, float, float]]:
    """Anticlockwise: a block whose guide faces are relieved in the middle."""
    start, end, inner = RELIEF
    h, r = HALF_WIDTH, CORNER
    lower = [(TAIL, -h, r), (start, -h, 3), (start + 6, -inner, r), (end - 6, -inner, r), (end, -h, 3)]
    right = [(HEAD, -h, r), (HEAD, h, r)]
    return [*lower, *right, *((x, -y, radius) for x, y, radius in reversed(lower))]
