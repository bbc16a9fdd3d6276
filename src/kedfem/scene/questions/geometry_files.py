"""Files from which links have their geometry: CAD, parts, meshes, and what mesh files name in their turn."""

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from kedfem.scene.records.scene import Scene
from kedfem.scene.records.shapes import Cad, MeshFile, Part

INCLUDE = re.compile(r"(?im)^[ \t]*\*INCLUDE[ \t]*,[ \t]*INPUT[ \t]*=[ \t]*\"?([^\",\n\0]+?)\"?[ \t\r]*$")
"""A line of Abaqus in place of which a file is read, and its name."""
_DATA = re.compile(r"<DataItem\b[^>]*\bFormat\s*=\s*[\"'](?:HDF|Binary)[\"'][^>]*>\s*([^<:\0]+?)\s*[:<]")
"""A file of numbers in XDMF."""


def geometry_files(scene: Scene) -> dict[str, list[Path]]:
    """The files of a scene's links by their names in it, each followed by those that it names."""
    shapes = (link.shape for link in scene.links.values())
    named = sorted({str(x.file) for x in shapes if isinstance(x, Cad | MeshFile | Part)})
    return {name: list(with_named(scene.folder / name)) for name in named}


def with_named(path: Path) -> Iterator[Path]:
    """A file and what it names relative to its folder: Abaqus' includes, which may include others, and data of XDMF."""
    found, ending = [path], path.suffix.lower()
    for file in found:
        yield file
        if (ending == ".inp" or (file is path and ending in {".xdmf", ".xmf"})) and file.is_file():
            with suppress(OSError):  # what cannot be read is refused where it is needed
                names = (INCLUDE if ending == ".inp" else _DATA).findall(file.read_text(errors="replace"))
                found += [each for name in dict.fromkeys(names) if (each := file.parent / name) not in found]
