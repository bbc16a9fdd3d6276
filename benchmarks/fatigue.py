"""Fatigue at 20,000 points over 720 instants: seconds of each criterion, from histories to damage."""

import os
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.pages import script, table, write_page
from kedfem.links.build import link_axes
from kedfem.links.recovery import StressRecovery, stress_recovery
from kedfem.links.solid import solid_link
from kedfem.mesh import link_mesh
from kedfem.results.fatigue.strength import strength_of
from kedfem.results.fatigue.surface import Period, SurfaceHistory
from kedfem.results.stresses.envelope import StressHistory
from kedfem.scene import Bar, Fatigue, FatigueData, LinkScene, Material, Meshing

ELEMENTS, INSTANTS, MODES, PERIOD = (120, 26, 2), 720, 30, 0.1
CRITERIA = {"signed von Mises": "signed_von_mises", "normal stress": "normal", "Findley": "findley"}


def bench_fatigue(folder: Path, quick: bool) -> None:
    """Seconds of each criterion; table to the folder."""
    recovery = _plate((30, 8, 2) if quick else ELEMENTS)
    kept = _history(recovery.stressed)
    rows = []
    for name, criterion in CRITERIA.items():
        took = []
        for threads in (1, 2):
            os.environ["OMP_NUM_THREADS"] = str(threads)
            since = perf_counter()
            look = _look(recovery, kept, criterion)
            look.field()
            took.append(perf_counter() - since)
        rows.append((name, f"{len(look.surface.places):,}", *(f"{each:.1f}" for each in took)))
    header = ("criterion", "points", "one thread [s]", "two threads [s]")
    write_page(folder, "performance/fatigue", [table(header, rows)])


def _look(recovery: StressRecovery, kept: StressHistory, criterion: str) -> SurfaceHistory:
    data = FatigueData.model_validate({"group": "steel", "tensile_strength": 8e8})
    asked = Fatigue.model_validate({"materials": {"steel": data}, "criterion": criterion})
    nowhere, period = [""] * recovery.points, Period(PERIOD, 2 * PERIOD, before=True)
    return SurfaceHistory(recovery, kept, nowhere, strength_of(data, 2.1e11), asked, period)


def _plate(elements: tuple[int, int, int]) -> StressRecovery:
    """A plate, 1 m x 0.22 m x 20 mm, of 20-node hexahedra."""
    shape = Bar(between=((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), width=0.22, thickness=0.02)
    scene = LinkScene(material="steel", shape=shape, mesh=Meshing(elements=elements), element="hex20")
    material = Material(density=7850.0, youngs_modulus=2.1e11, poisson_ratio=0.3)
    return stress_recovery(solid_link("plate", link_mesh("plate", scene, Path()), material, link_axes(scene)))


def _history(points: int) -> StressHistory:
    """Two periods of stress that is far from proportional: random modes, each with harmonics of its own."""
    rng = np.random.default_rng(1)
    times = np.linspace(0.0, 2 * PERIOD, 2 * INSTANTS + 1)
    k = np.array([1, 2, 3, 5, 8, 20])
    a, lag = rng.normal(size=(MODES, 6)) / k, rng.uniform(0, 6, (MODES, 6))
    C = (a * np.cos(2 * np.pi / PERIOD * k * times[:, None, None] + lag)).sum(axis=2)
    return StressHistory(1e7 * rng.normal(size=(points, 6, MODES)), times, C)


if __name__ == "__main__":
    script(bench_fatigue)
