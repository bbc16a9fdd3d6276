"""Forecast of a link's memory from its number of unknowns, before anything of that size is made."""

import os
import re
from pathlib import Path

from kedfem.errors import MeshError

#: For a link of N unknowns, from `benchmarks.growth` and slender bars (27-node hexahedra, CHOLMOD): bytes of the
#: factor over N^1.5, of the matrices over N, and of all during the assembly over N.
FACTOR_BYTES, LINK_BYTES, ASSEMBLY_BYTES = 22.0, 5e3, 1.5e4
PLANE_FILL = 0.1  # share of these bytes for a plane mesh, from 18,000 to 240,000 unknowns
MOST_ELEMENTS = 2_000_000
#: New nodes for each element of a large mesh of hexahedra, and of tetrahedra that divide them.
NODES_EACH = {"hex8": 1, "hex20": 4, "hex27": 8, "tet10": 8}


def memory() -> float:
    """Memory of this machine [bytes]."""
    return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")) if hasattr(os, "sysconf") else 8e9


def free_memory() -> float:
    """Memory that is available now [bytes]; all of it where the system does not say."""
    try:
        said = re.search(r"^MemAvailable: +(\d+) kB$", Path("/proc/meminfo").read_text(encoding="ascii"), re.MULTILINE)
    except OSError:
        return memory()
    return 1024.0 * float(said[1]) if said else memory()


def least_bytes(unknowns: float, factored: bool = True, plane: bool = False) -> tuple[float, float]:
    """Memory of a link's matrices and of their factor [bytes]; parameters as of `check_memory`."""
    return LINK_BYTES * unknowns, FACTOR_BYTES * unknowns**1.5 * (PLANE_FILL if plane else 1.0) * factored


def unknowns_that_fit(unknowns: float, factor: float, free: float) -> float:
    """Unknowns, to two digits, of the mesh whose factor takes `free` bytes, if that of `unknowns` takes `factor`.

    The factor grows with at most the power 1.5 of the unknowns.
    """
    return float(f"{unknowns * (free / factor) ** (1 / 1.5):.2g}")


def check_memory(where: str, unknowns: float, factored: bool = True, plane: bool = False) -> None:
    """Refuse a link whose matrices and factor do not fit in the free memory.

    Parameters
    ----------
    where : the link, for messages
    unknowns : number in its mesh, or a lower bound of it
    factored : whether its effective matrix is factored, which that of a rigid link is not
    plane : whether it is a plane mesh

    Raises
    ------
    MeshError
        More than the free memory is needed.
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
    """The key that determines the length of a link's elements: `mesh.size` if given, else `mesh.elements_across`."""
    return f"{where}.mesh.{'elements_across' if given is None else 'size'}"


def check_size(where: str, given: float | None, size: float, extent: float) -> None:
    """Refuse an element size above the size of the whole link [m]."""
    if size > extent:
        wanted = f"must be below the link's own size {extent:.6g} [m]"
        raise MeshError(f"{size_key(where, given)}: {wanted}, got {size:.6g}")


def check_count(key: str, count: float) -> None:
    """Refuse, before it is made, a mesh of more than MOST_ELEMENTS elements."""
    if count > MOST_ELEMENTS:
        got = f"got about {count:,.0f}; take a coarser mesh"
        raise MeshError(f"{key}: must give at most {MOST_ELEMENTS:,} elements, {got}")
