"""One part, drawn or written."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType

import gmsh

from geometry.step_files import write_step

HERE = Path(__file__).parent


@contextmanager
def empty_model() -> Iterator[ModuleType]:
    """OpenCASCADE's kernel of an empty model, silent, on one thread; gmsh is closed if it was opened here."""
    opened_here = not gmsh.isInitialized()
    if opened_here:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.model.add("part")
    try:
        yield gmsh.model.occ
    finally:
        gmsh.model.remove()
        if opened_here:
            gmsh.finalize()


def drawn(name: str, occ: ModuleType) -> int:
    """The solid of a part of this folder, drawn in the model that is open."""
    tag: int = import_module(f"geometry.{name}").shape(occ)
    occ.synchronize()
    return tag


def write_part(name: str, folder: Path) -> None:
    """Write a part's STEP file into a folder."""
    with empty_model() as occ:
        drawn(name, occ)
        write_step(folder / f"{name}.step", [name])
