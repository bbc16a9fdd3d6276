"""One part, drawn or written."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import ModuleType

from geometry.step_files import write_step
from kedfem.mesh.session import gmsh_model

HERE = Path(__file__).parent


@contextmanager
def empty_model() -> Iterator[ModuleType]:
    """OpenCASCADE's kernel of an empty model, silent, on one thread; gmsh is closed if it was opened here."""
    with gmsh_model() as gmsh:
        yield gmsh.model.occ


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
