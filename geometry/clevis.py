"""Clevis: two lugs with a pin bore along z at the origin, and a square shank towards -x with a bolt hole along z."""

from types import ModuleType

from geometry.drawing import box, disc, joined, plate, rounded, upright, without

BORE, EYE, BOSS = 16.0, 40.0, 29.0  # diameters
HALF_GAP, HALF_FORK, HALF_BOSS = 9.0, 19.0, 21.5  # heights
GAP_END, ROOT, END = -24.0, -42.0, -105.0  # along x: bottom of the gap, end of the fork, end of the shank
SHANK, HALF_SHANK = 24.0, 12.0  # width and half thickness of the shank
BOLT, BOLT_AT = 9.0, -88.0
CORNER, FILLET = 4.0, 3.0


def shape(occ: ModuleType) -> int:
    """The clevis's solid."""
    z, r, w = (-HALF_FORK, HALF_FORK), EYE / 2, SHANK / 2
    block = plate(occ, [(ROOT, -r, CORNER), (0, -r, 0), (0, r, 0), (ROOT, r, CORNER)], z)
    fork = joined(occ, [block, disc(occ, (0, 0, r), z)])
    outline = [(END, -w, CORNER), (ROOT + 9, -w, 0), (ROOT + 9, w, 0), (END, w, CORNER)]
    whole = joined(occ, [fork, plate(occ, outline, (-HALF_SHANK, HALF_SHANK))])
    whole = rounded(occ, whole, FILLET, upright)
    whole = joined(occ, [whole, disc(occ, (0, 0, BOSS / 2), (-HALF_BOSS, HALF_BOSS))])
    gap = box(occ, (GAP_END, EYE), (-EYE, EYE), (-HALF_GAP, HALF_GAP))
    holes = [disc(occ, (0, 0, BORE / 2), (-30, 30)), disc(occ, (BOLT_AT, 0, BOLT / 2), (-30, 30))]
    return without(occ, whole, [gap, *holes])
