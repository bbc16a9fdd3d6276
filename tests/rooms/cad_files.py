"""CAD files for tests, drawn with gmsh: a lever with two bores, three boxes."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kedfem.errors import MeshError
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.solids import Solid
from kedfem.mesh.session import gmsh_model
from kedfem.scene.records.shapes import Cad

FORMATS = ("step", "igs", "brep")
# of a plate 60 × 20 × 8 with a boss of radius 8 and height 14 at (50, 10), bored with 4, and a bore of 3 at (10, 10)
VOLUME = 60 * 20 * 8 + math.pi * (8**2 * 6 - 4**2 * 14 - 3**2 * 8)
MM = 1e-3

KEYS = CadKeys("links.rod.shape.file", "links.rod.shape.solid")


def lever(occ: Any) -> None:
    plate, boss = occ.addBox(0, 0, 0, 60, 20, 8), occ.addCylinder(50, 10, 0, 0, 0, 14, 8)
    whole, _ = occ.fuse([(3, plate)], [(3, boss)])
    bores = [occ.addCylinder(x, 10, -1, 0, 0, 20, r) for x, r in ((50, 4), (10, 3))]
    occ.cut(whole, [(3, bore) for bore in bores])


def boxes(occ: Any) -> None:
    for i in (1, 2, 3):
        occ.addBox(20 * i, 0, 0, 10, 10, 10 * i)


def written(folder: Path, name: str, draw: Callable[[Any], None], formats: tuple[str, ...] = FORMATS) -> None:
    """A drawing, in files of several formats."""
    with gmsh_model() as gmsh:
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        for ending in formats:
            gmsh.write(str(folder / f"{name}.{ending}"))


def read(path: Path, name: str = "rod", **shape: Any) -> Solid:
    with solid_model(KEYS, path, name, Cad(file=path.name, **shape)) as (_, solid):
        return solid


def refused(path: Path, name: str = "rod", **shape: Any) -> str:
    import gmsh

    with pytest.raises(MeshError) as caught:
        read(path, name, **shape)
    assert not gmsh.isInitialized()
    return str(caught.value).replace(f"{path}", "FILE")


def parts_in(folder: Path) -> Path:
    """The lever and three boxes, in all formats."""
    written(folder, "lever", lever)
    written(folder, "boxes", boxes)
    return folder


def edited(source: Path, *changes: tuple[str, str], name: str = "edited") -> Path:
    """A copy of a file with some text replaced."""
    text = source.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = source.parent / f"{name}{source.suffix}"
    path.write_text(text)
    return path
