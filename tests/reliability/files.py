"""Files damaged by bytes, truncation and lines: results, tables of motion, cache entries, meshes and parts from CAD.

What is read is what was written, or refused; a damaged cache entry is made anew; a part gives a mesh or a sentence.
"""

import os
import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from kedfem.accuracy.reduction import prepared
from kedfem.analysis import analyse
from kedfem.mesh import SolidMesh, link_mesh, mesh_quality
from kedfem.results import read_results
from kedfem.scene import link_from, scene_from, time_grid
from kedfem.store import entries
from tests.reliability.mutations import DAMAGES, damaged, short
from tests.reliability.tally import Tally, apart
from tests.rooms.cad_files import FORMATS, lever, written
from tests.rooms.test_dynamics import four_bar
from tests.rooms.test_mesh_files import box
from tests.scenes import example

READING, REDUCING = (2.0, 20.0)  # seconds of processor time that one may take; what meshes runs in a process of its own
MESHES = ("msh", "unv", "bdf", "med", "mesh", "vtk", "inp", "vtu", "xdmf")


def damaged_files(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """So many in all: of ten, four results, three tables of motion, two cache entries, one mesh or part."""
    results(tally, 4 * count // 10, seed, folder)
    tables(tally, 3 * count // 10, seed, folder)
    cache_entries(tally, 2 * count // 10, seed, folder)
    parts(tally, count // 10, seed, folder)


def results(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """Results files: what is read is what was written."""
    run = analyse(scene_from(short(example("four_bar_beams")), folder))
    good, path = run.results, folder / "damaged.h5"
    content = (run.folder / "results.h5").read_bytes()

    def read() -> str:
        found = read_results(path)
        same = all(np.array_equal(found.channels[name][1], x) for name, (_, x) in good.channels.items())
        return "accepted" if same and np.array_equal(found.time, good.time) else "read other numbers"

    for number in range(count):
        path.write_bytes(damaged(content, random.Random(f"results {seed} {number}")))
        tally.tried("results", f"{seed} {number}", lambda: apart(read), READING)


def tables(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """Tables of motion: a scene with one is accepted or refused."""
    table, raw = folder / "motion.csv", example("four_bar_beams")
    raw["drive"] = {"joint": raw["drive"]["joint"], "motion": {"kind": "curve", "file": table.name}}
    raw["analysis"] = {"end_time": 0.1, "step": 1e-3}
    lines = "t [s], angle [rad]\n" + "\n".join(f"{k / 50}, {(k / 50) ** 2}" for k in range(51))

    def read() -> str:
        return "accepted" if time_grid(scene_from(raw, folder)).steps == 100 else "other steps"

    for number in range(count):
        table.write_bytes(damaged(lines.encode(), random.Random(f"table {seed} {number}")))
        tally.tried("table", f"{seed} {number}", read, READING)


@contextmanager
def cached_in(folder: Path) -> Iterator[None]:
    """Another cache folder."""
    before = os.environ.get("KEDFEM_CACHE")
    os.environ["KEDFEM_CACHE"] = str(folder)
    try:
        yield
    finally:
        if before is None:
            del os.environ["KEDFEM_CACHE"]
        else:
            os.environ["KEDFEM_CACHE"] = before


def cache_entries(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """Entries of reduced links: a damaged one is made anew, without a word."""
    raw = four_bar("bar", revolutions=0.1)
    for link in raw["links"].values():
        link["reduction"] = "modal"
    scene = scene_from(raw)

    def made() -> list[np.ndarray]:
        return [link.K0.toarray() if hasattr(link.K0, "toarray") else link.K0 for link in prepared(scene)[0].model.links]

    with cached_in(folder / "cache"):
        good = made()
        if not (kept := sorted(entries(folder / "cache"))):
            raise AssertionError("no entries are there to be damaged")
        contents = {path: path.read_bytes() for path in kept}

        def again() -> str:
            same = all(np.array_equal(a, b) for a, b in zip(good, made(), strict=True))
            whole = all(path.read_bytes() == content for path, content in contents.items())
            return "accepted" if same and whole else "other matrices" if whole else "an entry stays damaged"

        for number in range(count):
            rng = random.Random(f"cache {seed} {number}")
            path = rng.choice(kept)
            path.write_bytes(damaged(contents[path], rng))
            tally.tried("cache entry", f"{seed} {number}", again, REDUCING)
            path.write_bytes(contents[path])


def sound_parts(folder: Path) -> Path:
    """A part and a mesh in all forms, as `part.ENDING` in a folder."""
    import meshio

    written(folder, "part", lever)
    for ending in MESHES[:7]:
        box(folder / f"part.{ending}")
    raw = meshio.read(folder / "part.vtk")
    solid = meshio.Mesh(raw.points, [("tetra10", raw.cells_dict["tetra10"])])
    for ending in MESHES[7:]:
        solid.write(folder / f"part.{ending}", **({"data_format": "XML"} if ending == "xdmf" else {}))
    return folder


def parts(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """Parts from CAD and meshes of other programs: a mesh whose elements are sound, or a sentence."""
    sound, place = folder / "sound", folder / "parts"
    sound.mkdir()
    place.mkdir()
    sound_parts(sound)

    def meshed(ending: str) -> str:
        cad = ending in FORMATS
        shape = {"kind": "cad" if cad else "mesh", "file": f"part.{ending}"}
        raw = {"material": "steel", "shape": shape, "mesh": {"size": 0.02} if cad else {}}
        mesh = link_mesh("arm", link_from(raw), place)
        if not isinstance(mesh, SolidMesh) or not np.isfinite(mesh.points).all():
            return "points that are not finite"
        return "accepted" if mesh_quality(mesh).least > 0 else "elements that are inside out"

    for number in range(count):
        ending = (*FORMATS, *MESHES)[number % (len(FORMATS) + len(MESHES))]
        rng = random.Random(f"part {seed} {number}")
        path = place / f"part.{ending}"
        path.write_bytes(rng.choice((*DAMAGES, damaged))((sound / path.name).read_bytes(), rng))
        tally.tried("part", f"{ending} {seed} {number}", lambda e=ending: meshed(e), READING)  # type: ignore[misc]
        path.unlink()
