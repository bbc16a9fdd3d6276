"""Slotted link: a bore at the origin, and a slot 16 wide with a raised rim from (60, 0) to (130, 0) for a sliding pin."""

from types import ModuleType

from geometry.drawing import disc, joined, rounded, strap, upright, without

BORE, BOSS, EYE = 18.0, 28.0, 36.0  # diameters
SLOT = (60.0, 130.0)  # centres of its ends along x
SLOT_WIDTH, RIM_WIDTH, PLATE_WIDTH = 16.0, 28.0, 38.0
HALF_PLATE, HALF_RIM, HALF_BOSS = 5.0, 8.0, 10.0  # heights
NECK = 11.0  # half width between bore and slot
FILLET = 20.0


def shape(occ: ModuleType) -> int:
    """The link's solid."""

    def long_hole(width: float, half: float) -> int:
        (a, b), r = SLOT, width / 2
        return strap(occ, (a, 0, r), (b, 0, r), (-half, half))

    z = (-HALF_PLATE, HALF_PLATE)
    neck = strap(occ, (0, 0, NECK), (SLOT[0], 0, NECK + 1), z)
    body = joined(occ, [neck, disc(occ, (0, 0, EYE / 2), z), long_hole(PLATE_WIDTH, HALF_PLATE)])
    body = rounded(occ, body, FILLET, upright)
    boss = disc(occ, (0, 0, BOSS / 2), (-HALF_BOSS, HALF_BOSS))
    body = joined(occ, [body, boss, long_hole(RIM_WIDTH, HALF_RIM)])
    return without(occ, body, [disc(occ, (0, 0, BORE / 2), (-HALF_BOSS, HALF_BOSS)), long_hole(SLOT_WIDTH, HALF_RIM)])
