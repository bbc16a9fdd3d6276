"""Parts from CAD: mass properties of bodies of known answer, free frequencies of one part by two ways."""

from functools import cache
from pathlib import Path

import numpy as np

from kedfem.links.record import Link
from kedfem.links.solid import solid_link
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.solids import Sizing
from kedfem.mesh.layered.layers import layered_mesh
from kedfem.mesh.tetrahedral import tetrahedral_mesh
from kedfem.scene import Cad, Material

from .cases import Row, case
from .linear import free_map, frequencies, held

GEOMETRY = Path(__file__).parents[2] / "geometry"
STEEL = Material(density=7850, youngs_modulus=2.1e11, poisson_ratio=0.3)
WAYS = {"layers": layered_mesh, "tetrahedra": tetrahedral_mesh}
PART, FIRST = "crank", 4000.0  # Hz, of the order of its first free frequency
REFERENCE = ("layers", 0.003)


@cache
def meshed(way: str, size: float | None = None) -> Link:
    """The part by one way, in 27-node hexahedra or 10-node tetrahedra."""
    path = GEOMETRY / f"{PART}.step"
    with solid_model(CadKeys(path.name, "solid"), path, PART, Cad(file=path.name)) as (gmsh, solid):
        mesh = WAYS[way](gmsh, solid, Sizing(size=size))
    return solid_link(PART, mesh, STEEL, np.eye(3))


@cache
def free(way: str, size: float | None = None) -> np.ndarray:
    """Its first six elastic frequencies [Hz], nothing held."""
    link = meshed(way, size)
    return frequencies(link, free_map(link, held()), 12, FIRST)[6:]


@case("Free frequencies of a crank from CAD", "layers of 3 mm elements, 199,332 unknowns", long=True)
def crank() -> list[Row]:
    """Hub, web, counterweight and pin: layers of 6 mm elements, and 10-node tetrahedra of 3.5 mm."""
    exact = free(*REFERENCE)
    return [
        Row(
            f"mode {k + 1} [Hz], {way[0]}",
            float(exact[k]),
            float(free(*way)[k]),
            5e-3,
            f"{meshed(*way).unknowns:,} unknowns",
        )
        for way in (("layers", 0.006), ("tetrahedra", 0.0035))
        for k in range(6)
    ]
