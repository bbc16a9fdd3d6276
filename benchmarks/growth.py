"""One link growing to half a million unknowns: assembling, factoring, solving, memory. Each size in its own process."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.memory import memory_held, most_memory
from benchmarks.pages import apart, script, seconds, table, write_loglog, write_page
from kedfem.mesh.memory_forecast import least_bytes

SIZES = ((40, 8, 2), (64, 14, 2), (110, 24, 2), (200, 44, 2))  # a plate, 1 m x 0.22 m x 20 mm


def bench_growth(folder: Path, quick: bool) -> None:
    """Time and memory against unknowns; table and plot go to the folder."""
    sizes = SIZES[:2] if quick else SIZES
    found = [apart("benchmarks.growth", "one_size", size) for size in sizes]
    rows = [
        (f"{f['unknowns']:,}", f"{f['assemble']:.2f}", f"{f['factor']:.2f}", f"{1e3 * f['solve']:.1f}",
         f"{f['assemble'] / f['factor']:.2f}", f"{f['memory'] / 1e9:.2f}", f"{forecast(f) / 1e9:.2f}",
         f"{forecast(f) / f['memory']:.2f}")
        for f in found
    ]  # fmt: skip
    header = ("unknowns", "assemble [s]", "factor [s]", "solve [ms]", "assemble / factor", "memory [GB]",
              "memory forecast before meshing [GB]", "ratio")  # fmt: skip
    slopes = [(key, f"{_slope(found, key):.2f}") for key in ("factor", "solve", "memory")]
    grown = table(("between the last two sizes", "power of the unknowns"), slopes)
    write_page(folder, "performance/growth", [table(header, rows), grown])
    N = [f["unknowns"] for f in found]
    curves = {name: (N, [f[name] for f in found]) for name in ("assemble", "factor", "solve")}
    write_loglog(folder, "growth", curves, ("unknowns in one link", "seconds"))


def forecast(measured: dict[str, float]) -> float:
    """Bytes that are forecast from the number of unknowns: more than the machine has is refused before it is meshed."""
    return sum(least_bytes(measured["unknowns"]))


def _slope(found: list[dict[str, float]], key: str) -> float:
    a, b = found[-2:]
    return float(np.log(b[key] / a[key]) / np.log(b["unknowns"] / a["unknowns"]))


def one_size(size: tuple[int, int, int]) -> dict[str, float]:
    """Measure one block of so many elements."""
    from kedfem.dynamics.matrices.cholesky import Cholesky
    from kedfem.dynamics.matrices.substructure import effective_matrix
    from kedfem.dynamics.stepping.scheme import generalised_alpha
    from kedfem.links.build import link_axes
    from kedfem.links.solid import solid_link
    from kedfem.mesh import link_mesh
    from kedfem.scene import Bar, LinkScene, Material, Meshing

    shape = Bar(between=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), width=0.22, thickness=0.02)
    scene = LinkScene(material="steel", shape=shape, mesh=Meshing(elements=size), element="hex27")
    material = Material(density=7850.0, youngs_modulus=2.1e11, poisson_ratio=0.3)
    mesh = link_mesh("block", scene, Path())
    kept: dict[str, Any] = {}
    held = memory_held()
    assemble = seconds(lambda: kept.update(link=solid_link("block", mesh, material, link_axes(scene))), 1)
    link = kept["link"]
    a0 = generalised_alpha(1e-4, 1.0).a0
    A = effective_matrix(link, a0, 1.0)
    factor = seconds(lambda: kept.update(factor=Cholesky(A, "block")), 1)
    b = np.random.default_rng(1).standard_normal(3 * link.n)
    solve = seconds(lambda: kept["factor"].solve(b), 5)
    memory = most_memory() - held
    return {"unknowns": 3 * link.n, "assemble": assemble, "factor": factor, "solve": solve, "memory": memory}


if __name__ == "__main__":
    script(bench_growth)
