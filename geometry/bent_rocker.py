"""Bent rocker: a hub on a keyed shaft at the origin, one arm to a bore at (78, 26), one to a roller bore at (-62, 30).

The arms make an angle of about 136 degrees; hub, web and ends are of different thickness.
"""

from types import ModuleType

from geometry.drawing import box, disc, joined, rounded, strap, upright, without

HUB, HUB_EYE, HUB_BORE = 44.0, 54.0, 25.0  # diameters
KEYWAY = (8.0, 15.8)  # width, and from the axis to its bottom
RIGHT, RIGHT_EYE, RIGHT_BOSS, RIGHT_BORE = (78.0, 26.0), 32.0, 25.0, 14.0
LEFT, LEFT_EYE, LEFT_BORE = (-62.0, 30.0), 28.0, 12.0
HALF_HUB, HALF_WEB, HALF_BOSS, HALF_LEFT = 18.0, 7.0, 11.0, 4.0  # heights
LEFT_CHEEK = 36.0  # diameter of the recess for the roller's fork
WINDOW = 0.40, 0.62  # a slot in the right arm: fractions of its length
WINDOW_WIDTH = 12.0
FILLET = 16.0


def shape(occ: ModuleType) -> int:
    """The rocker's solid."""
    z = (-HALF_WEB, HALF_WEB)
    arms = [
        strap(occ, (0, 0, 19), (*RIGHT, RIGHT_EYE / 2), z),
        strap(occ, (0, 0, 17), (*LEFT, LEFT_EYE / 2), z),
        disc(occ, (0, 0, HUB_EYE / 2), z),
    ]
    rocker = rounded(occ, joined(occ, arms), FILLET, upright)
    bosses = [
        disc(occ, (0, 0, HUB / 2), (-HALF_HUB, HALF_HUB)),
        disc(occ, (*RIGHT, RIGHT_BOSS / 2), (-HALF_BOSS, HALF_BOSS)),
    ]
    return without(occ, joined(occ, [rocker, *bosses]), _taken(occ))


def _taken(occ: ModuleType) -> list[int]:
    """Bores, keyway, window and the recesses of the roller's end."""
    z = (-HALF_HUB, HALF_HUB)
    width, bottom = KEYWAY
    (x, y), (a, b) = RIGHT, WINDOW
    r = WINDOW_WIDTH / 2
    return [
        disc(occ, (0, 0, HUB_BORE / 2), z),
        box(occ, (-width / 2, width / 2), (-bottom, 0), z),
        disc(occ, (*RIGHT, RIGHT_BORE / 2), z),
        disc(occ, (*LEFT, LEFT_BORE / 2), z),
        strap(occ, (a * x, a * y, r), (b * x, b * y, r), z),
        disc(occ, (*LEFT, LEFT_CHEEK / 2), (HALF_LEFT, HALF_WEB)),
        disc(occ, (*LEFT, LEFT_CHEEK / 2), (-HALF_WEB, -HALF_LEFT)),
    ]
