"""Overhung crank: hub with the main bore at the origin, web, counterweight, and the crank pin at (40, 0).

Radius 40 mm. The pin (diameter 30) goes from the web's face at z = -14 to z = 14, through the connecting rod in the
plane z = 0; web and hub lie below, z = -40 to -14.
"""

from math import cos, radians, sin
from types import ModuleType

from geometry.drawing import common, disc, joined, plate, rounded, strap, upright, without

RADIUS = 40.0
BORE, HUB, SHOULDER = 24.0, 42.0, 54.0  # diameters about the main axis
PIN, PIN_EYE = 30.0, 44.0  # diameters about the pin
FACE, BACK, HUB_END, RIM_END = -14.0, -30.0, -40.0, -36.0  # heights
PIN_END = 14.0
WEIGHT, RIM = 60.0, 38.0  # counterweight: outer radius, and where its thicker rim begins
WEIGHT_HALF_ANGLE = radians(58)
CORNER, FILLET = 6.0, 10.0


def shape(occ: ModuleType) -> int:
    """The crank's solid."""
    web = strap(occ, (0, 0, SHOULDER / 2), (RADIUS, 0, PIN_EYE / 2), (BACK, FACE))
    whole = joined(occ, [web, _weight(occ, (RIM_END, FACE))])
    whole = rounded(occ, whole, CORNER, lambda at, along: upright(at, along) and at[0] < -24)
    whole = rounded(occ, whole, FILLET, lambda at, along: upright(at, along) and at[0] > -24)
    whole = without(occ, whole, [disc(occ, (0, 0, RIM), (RIM_END, BACK))])
    hub = disc(occ, (0, 0, HUB / 2), (HUB_END, BACK))
    pin = disc(occ, (RADIUS, 0, PIN / 2), (FACE, PIN_END))
    return without(occ, joined(occ, [whole, hub, pin]), [disc(occ, (0, 0, BORE / 2), (HUB_END, FACE))])


def _weight(occ: ModuleType, z: tuple[float, float]) -> int:
    """Sector of the counterweight, without rounded corners."""
    far = 1.3 * WEIGHT / cos(WEIGHT_HALF_ANGLE)
    x, y = -far * cos(WEIGHT_HALF_ANGLE), far * sin(WEIGHT_HALF_ANGLE)
    return common(occ, disc(occ, (0, 0, WEIGHT), z), plate(occ, [(0, 0, 0), (x, y, 0), (x, -y, 0)], z))
