"""A slider-crank engine, an assembly of crank, rod and slider in its reference position.

Main axis along z through the origin, slider along x. Crank radius 40 mm, rod 140 mm, the crank drawn at 60 degrees.
"""

from math import asin, cos, pi, radians, sin
from pathlib import Path

from geometry import connecting_rod, crank
from geometry.make import drawn, empty_model
from geometry.step_files import write_step

NAME = "engine"
ANGLE = radians(60)
CRANK_PIN = (crank.RADIUS * cos(ANGLE), crank.RADIUS * sin(ANGLE))
SWING = asin(CRANK_PIN[1] / connecting_rod.LENGTH)  # of the rod, towards the crank pin, about the slider's pin
SLIDER_PIN = (CRANK_PIN[0] + connecting_rod.LENGTH * cos(SWING), 0.0)
SOLIDS = {"crank": "crank", "rod": "connecting_rod", "slider": "slider"}


def write(folder: Path) -> None:
    """Write the assembly's STEP file into a folder."""
    with empty_model() as occ:
        tags = {solid: drawn(part, occ) for solid, part in SOLIDS.items()}
        occ.rotate([(3, tags["crank"])], 0, 0, 0, 0, 0, 1, ANGLE)
        occ.rotate([(3, tags["rod"])], 0, 0, 0, 0, 0, 1, pi - SWING)
        for solid in ("rod", "slider"):
            occ.translate([(3, tags[solid])], *SLIDER_PIN, 0)
        occ.synchronize()
        order = sorted(tags, key=tags.__getitem__)
        write_step(folder / f"{NAME}.step", order)
