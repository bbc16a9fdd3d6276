"""Connecting rod with an I-section: small end at the origin, big end at (140, 0), symmetric about z = 0.

Length 140 mm between the axes. Small end: bore 20 for the slider's pin; big end: bore 30 for the crank's pin.
"""

from types import ModuleType

from geometry.drawing import disc, joined, plate, rounded, upright, without

LENGTH = 140.0
SMALL_BORE, SMALL_BOSS, SMALL_EYE = 20.0, 28.0, 34.0  # diameters
BIG_BORE, BIG_BOSS, BIG_EYE = 30.0, 42.0, 50.0
HALF_BOSS, HALF_FLANGE, HALF_WEB = 12.0, 9.0, 3.0  # heights
SHANK = (9.0, 13.0)  # half widths at the axes of the small and the big end
RIM = 4.0  # width of the I-section's flanges
POCKET = (27.0, 105.0)  # from where to where along x
FILLET, POCKET_CORNER = 18.0, 4.0


def shape(occ: ModuleType) -> int:
    """The rod's solid."""
    z = (-HALF_FLANGE, HALF_FLANGE)
    (a, b), end = SHANK, LENGTH
    shank = plate(occ, [(0, -a, 0), (end, -b, 0), (end, b, 0), (0, a, 0)], z)
    rod = joined(occ, [shank, disc(occ, (0, 0, SMALL_EYE / 2), z), disc(occ, (end, 0, BIG_EYE / 2), z)])
    rod = rounded(occ, rod, FILLET, upright)
    ends = [(0.0, 0.0, SMALL_BOSS / 2), (end, 0.0, BIG_BOSS / 2)]
    rod = joined(occ, [rod, *(disc(occ, circle, (-HALF_BOSS, HALF_BOSS)) for circle in ends)])
    bores = [(0.0, 0.0, SMALL_BORE / 2), (end, 0.0, BIG_BORE / 2)]
    pockets = [_pocket(occ, (HALF_WEB, HALF_FLANGE)), _pocket(occ, (-HALF_FLANGE, -HALF_WEB))]
    return without(occ, rod, [*(disc(occ, circle, (-HALF_BOSS, HALF_BOSS)) for circle in bores), *pockets])


def _pocket(occ: ModuleType, z: tuple[float, float]) -> int:
    """What makes the shank an I-section on one side: parallel to the shank's sides, a flange's width inside."""

    def half(x: float) -> float:
        return SHANK[0] + (SHANK[1] - SHANK[0]) * x / LENGTH - RIM

    (x0, x1), r = POCKET, POCKET_CORNER
    return plate(occ, [(x0, -half(x0), r), (x1, -half(x1), r), (x1, half(x1), r), (x0, half(x0), r)], z)
