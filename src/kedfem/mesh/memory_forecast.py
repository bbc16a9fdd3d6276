"""Memory that a link takes, forecast from its number of unknowns, before anything of that size is made."""

import os
import re
from pathlib import Path

from kedfem.errors import MeshError

#: Of a link of N unknowns, `benchmarks.growth` and slender bars (27-node hexahedra, CHOLMOD): bytes of the factor
#: over N^1.5, of what is kept over N, and of what is there while one link is assembled.
FACTOR_BYTES, LINK_BYTES, ASSEMBLY_BYTES = 22.0, 5e3, 1.5e4
PLANE_FILL = 0.1  # of the factor that a plane mesh has, from 18,000 to 240,000 unknowns
#: New nodes to each element of a large mesh of hexahedra, and of tetrahedra that divide them.
MOST_ELEMENTS = 2_000_000
NODES_EACH = {"hex8": 1, "hex20": 4, "hex27": 8, "tet10": 8}


def memory() -> float:
    """Bytes of this machine."""
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")) if hasattr(os, "sysconf") else 8e9


def free_memory() -> float:
    """Bytes of it that can be had now; all where the system does not say."""
    try:
        said = re.search(r"^MemAvailable: +(\d+) kB$", Path("/proc/meminfo").read_text(encoding="ascii"), re.MULTILINE)
    except OSError:
        return memory()
    return 1024.0 * float(said[1]) if said else memory()


def least_bytes(unknowns: float, factored: bool = True, plane: bool = False) -> tuple[float, float]:
    """Bytes of a link's matrices, and of their factor; parameters as of `check_room`."""
    return LINK_BYTES * unknowns, FACTOR_BYTES * unknowns**1.5 * (PLANE_FILL if plane else 1.0) * factored


def unknowns_that_fit(unknowns: float, factor: float, free: float) -> float:
    """Unknowns, to two digits, of the mesh whose factor takes the free memory, where `unknowns` take `factor` [bytes].

    The factor grows by the power 1.5 at most.
    """
    return float(f"{unknowns * (free / factor) ** (1 / 1.5):.2g}")


def check_room(where: str, unknowns: float, factored: bool = True, plane: bool = False) -> None:
    """Refuse a link that the free memory cannot hold: the least that its matrices and their factor take.

    Parameters
    ----------
    where : the link, for messages
    unknowns : of its mesh, or at least so many
    factored : whether its effective matrix is; that of a rigid link is not
    plane : whether it is a plane mesh
    """
    kept, factor = least_bytes(unknowns, factored, plane)
    free = free_memory()
    if kept + factor > free:
        fits = unknowns
        while sum(least_bytes(fits, factored, plane)) > free:
            fits *= 0.95
        raise MeshError(
            f"{where}: must fit in the free memory of {free / 1e9:.3g} GB, got about {unknowns:,.0f} unknowns, "
            f"which take at least {(kept + factor) / 1e9:,.3g} GB (matrices {kept / 1e9:,.3g}, their factor "
            f"{factor / 1e9:,.3g}); take larger elements (mesh.size, mesh.elements, mesh.unknowns): at most about "
            f"{float(f'{fits:.2g}'):,.0f} unknowns would fit"
        )


def size_key(where: str, given: float | None) -> str:
    """The key that the length of a link's elements comes from: `mesh.size` as given, or `mesh.elements_across`."""
    return f"{where}.mesh.{'elements_across' if given is None else 'size'}"


def check_size(where: str, given: float | None, size: float, extent: float) -> None:
    """Refuse elements that are longer than the whole link [m]."""
    if size > extent:
        wanted = f"must be below the link's own size {extent:.6g} [m]"
        raise MeshError(f"{size_key(where, given)}: {wanted}, got {size:.6g}")


def check_count(key: str, count: float) -> None:
    """Refuse meshes that no computer here could solve, before they are made."""
    if count > MOST_ELEMENTS:
        got = f"got about {count:,.0f}; take a coarser mesh"
        raise MeshError(f"{key}: must give at most {MOST_ELEMENTS:,} elements, {got}")
