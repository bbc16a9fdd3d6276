"""STEP files with names and a header that stays the same: gmsh's own carry neither."""

import re
from collections.abc import Sequence
from pathlib import Path

import gmsh

HEADER = """FILE_DESCRIPTION(('{name}, drawn for kedfem'),'2;1');
FILE_NAME('{name}.step','2026-01-01T00:00:00',('kedfem'),('kedfem'),'kedfem','kedfem','');
FILE_SCHEMA("""


def write_step(path: Path, names: Sequence[str]) -> None:
    """Write the model's solids, in the order of their tags, under these names; several are an assembly."""
    solids = gmsh.model.getEntities(3)
    if len(solids) != len(names):
        raise ValueError(f"{path.name}: must hold {len(names)} solids, got {len(solids)}")
    for (_, tag), name in zip(solids, names, strict=True):
        if gmsh.model.occ.getMass(3, tag) <= 0:
            raise ValueError(f"{path.name}: volume of {name} must be positive")
    gmsh.write(str(path))
    path.write_text(_named(path.read_text(encoding="utf-8"), path.stem, names), encoding="utf-8")


def _named(text: str, title: str, names: Sequence[str]) -> str:
    """The text of a STEP file with a neutral header and the products' names."""
    text = re.sub(r"FILE_NAME\(.*?FILE_SCHEMA\(", HEADER.format(name=title), text, count=1, flags=re.DOTALL)
    products = iter([title, *names] if len(names) > 1 else names)
    pattern = r"PRODUCT\(\s*'Open CASCADE[^']*',\s*'Open CASCADE[^']*'"
    text = re.sub(pattern, lambda _: "PRODUCT('{0}','{0}'".format(next(products)), text)
    solids, places = iter(names), iter(names)
    text = re.sub(r"MANIFOLD_SOLID_BREP\(''", lambda _: f"MANIFOLD_SOLID_BREP('{next(solids)}'", text)
    pattern = r"NEXT_ASSEMBLY_USAGE_OCCURRENCE\('\d+',''"
    return re.sub(pattern, lambda _: "NEXT_ASSEMBLY_USAGE_OCCURRENCE('{0}','{0}'".format(next(places)), text)
