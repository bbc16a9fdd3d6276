"""Bell crank: pivot at the origin, bores at (90, 0) and (-18, 64), not in line; bosses, and pockets on both sides."""

from types import ModuleType

from geometry.drawing import disc, joined, plate, rounded, strap, upright, without

PIVOT = (0.0, 0.0, 20.0, 32.0, 42.0)  # x, y and the diameters of bore, boss and eye
LONG = (90.0, 0.0, 12.0, 20.0, 28.0)
SHORT = (-18.0, 64.0, 14.0, 22.0, 30.0)
HALF_PIVOT, HALF_BOSS, HALF_WEB, HALF_FLOOR = 16.0, 11.0, 8.0, 3.0  # heights
BRACE = [(0.0, 0.0, 0.0), (78.0, -4.0, 0.0), (-8.0, 62.0, 0.0)]  # triangle between the arms
POCKET = [(23.0, 13.0, 5.0), (55.0, 6.5, 4.0), (12.0, 42.0, 5.0), (11.0, 23.0, 5.0)]
FILLET = 14.0


def shape(occ: ModuleType) -> int:
    """The bell crank's solid."""
    z = (-HALF_WEB, HALF_WEB)
    arms = [strap(occ, (0, 0, PIVOT[4] / 2), (x, y, eye / 2), z) for x, y, _, _, eye in (LONG, SHORT)]
    body = rounded(occ, joined(occ, [*arms, plate(occ, BRACE, z)]), FILLET, upright)
    halves = [(PIVOT, HALF_PIVOT), (LONG, HALF_BOSS), (SHORT, HALF_BOSS)]
    bosses = [disc(occ, (x, y, boss / 2), (-half, half)) for (x, y, _, boss, _), half in halves]
    bores = [disc(occ, (x, y, bore / 2), (-half, half)) for (x, y, bore, _, _), half in halves]
    pockets = [plate(occ, POCKET, (HALF_FLOOR, HALF_WEB)), plate(occ, POCKET, (-HALF_WEB, -HALF_FLOOR))]
    return without(occ, joined(occ, [body, *bosses]), [*bores, *pockets])
