"""Contents of mesh files: nodes, cells, sets of sides and of nodes, read by gmsh or meshio."""

import io
import re
import warnings
from contextlib import chdir
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import MeshError
from kedfem.mesh.session import gmsh_model, numbered_nodes
from kedfem.scene.questions.geometry_files import INCLUDE
from kedfem.scene.records.shapes import MESH_ENDINGS

THROUGH_MESHIO = (".inp", ".vtu", ".vtk", ".xdmf", ".xmf", ".e", ".exo")
THROUGH_GMSH = tuple(each for each in MESH_ENDINGS if each not in THROUGH_MESHIO)
_NUMBERED = (".bdf", ".nas")  # surfaces by numbers of properties
#: Number of corners of the solid cells that files may hold, by meshio's names.
CORNERS = {"tetra": 4, "hexahedron": 8, "wedge": 6, "pyramid": 5}
_FLAT = {"triangle": 3, "quad": 4}
#: Abaqus' elements of plane strain and stress with which programs write surfaces, and which meshio lacks.
_PLANE = {
    "CPS6": "triangle6", "CPS8": "quad8", "CPE3": "triangle", "CPE4": "quad", "CPE8": "quad8",
    "S6": "triangle6",
}  # fmt: skip
#: Kinds that some of meshio's readers return and its record of a mesh does not know, with their dimension.
_QUADRATIC = {"wedge15": 3, "wedge18": 3, "pyramid13": 3, "pyramid14": 3, "quad8": 2, "quad9": 2}
#: Corners of the sides S1, S2 … of Abaqus' hexahedra and tetrahedra.
_ABAQUS_SIDES = {
    8: ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    4: ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
}  # fmt: skip


#: A *SURFACE block of Abaqus: its options, and its lines; the name among its options.
_SURFACES = r"(?im)^\*SURFACE\s*,([^\n]*)\n((?:(?!\*)[^\n]+\n?)*)"
_NAME = r"(?i)\bNAME\s*=\s*\"?([^,\"\s]+)"


@dataclass(frozen=True, slots=True)
class RawMesh:
    """The contents of a mesh file.

    points : (n, k) [the file's unit]
    cells : solid cells in VTK's order, by meshio's names
    others : number of solid cells of each unknown kind
    sides : corners of the triangles (t, 3) and quadrilaterals (q, 4) of each set, by its name ("surface 3" where files
        have numbers)
    nodes : nodes of each set, by its name
    """

    points: Float[np.ndarray, "n k"]
    cells: dict[str, Int[np.ndarray, "_ _"]]
    others: dict[str, int] = field(default_factory=dict)
    sides: dict[str, list[Int[np.ndarray, "_ _"]]] = field(default_factory=dict)
    nodes: dict[str, Int[np.ndarray, " _"]] = field(default_factory=dict)


def read_mesh(path: Path) -> RawMesh:
    """The contents of a mesh file; to be called where a library may hang or crash.

    Raises
    ------
    MeshError
        The library cannot read the file; the message is its own.
    """
    ending = path.suffix.lower()
    try:
        return _through_gmsh(path) if ending in THROUGH_GMSH else _through_meshio(path)
    except (MeshError, MemoryError):
        raise
    except (Exception, SystemExit) as error:  # each of the readers fails in its own way
        raise MeshError(" ".join(str(error).split())[:300] or type(error).__name__) from error


def _through_gmsh(path: Path) -> RawMesh:
    """The contents of a file that gmsh reads."""
    with gmsh_model() as gmsh:
        gmsh.merge(str(path))
        points, tags = numbered_nodes(gmsh)
        cells: dict[str, Any] = {}
        others: dict[str, int] = {}
        for kind, found in _elements(gmsh, 3, -1):
            if _family(kind) in CORNERS:
                cells[kind] = np.searchsorted(tags, found)
            else:
                others[kind] = len(found)
        sides = {}
        for name, entities in _groups(gmsh, path.suffix.lower() in _NUMBERED).items():
            blocks = [block for entity in entities for block in _elements(gmsh, 2, entity)]
            flat = [(kind, found) for kind, found in blocks if _family(kind) in _FLAT]
            sides[name] = [np.searchsorted(tags, found[:, : _FLAT[_family(kind)]]) for kind, found in flat]
        nodes = {
            _name(gmsh, 0, tag): np.searchsorted(tags, gmsh.model.mesh.getNodesForPhysicalGroup(0, tag)[0])
            for _, tag in gmsh.model.getPhysicalGroups(0)
        }
        return RawMesh(points, cells, others, sides, nodes)


def _groups(gmsh: ModuleType, numbered: bool) -> dict[str, list[int]]:
    """Surfaces in gmsh's model by the names of their physical groups, or by numbers in formats without names."""
    found: dict[str, list[int]] = {}
    for _, tag in gmsh.model.getPhysicalGroups(2):
        on = [int(each) for each in gmsh.model.getEntitiesForPhysicalGroup(2, tag)]
        found.setdefault(_name(gmsh, 2, tag), []).extend(on)
    if numbered and not found:
        return {f"surface {tag}": [int(tag)] for _, tag in gmsh.model.getEntities(2)}
    return found


def _name(gmsh: ModuleType, dimension: int, tag: int) -> str:
    return gmsh.model.getPhysicalName(dimension, tag).strip() or f"group {tag}"


def _elements(gmsh: ModuleType, dimension: int, entity: int) -> list[tuple[str, np.ndarray]]:
    """Kinds and gmsh's node numbers, in VTK's order, of the elements of one entity, or of all (-1) of a dimension."""
    from meshio.gmsh.common import _gmsh_to_meshio_order, _gmsh_to_meshio_type

    kinds, _, nodes = gmsh.model.mesh.getElements(dimension, entity)
    out = []
    for number, flat in zip(kinds, nodes, strict=True):
        name, _, _, count, *_ = gmsh.model.mesh.getElementProperties(number)
        kind = _gmsh_to_meshio_type.get(int(number), name)
        out.append((kind, _gmsh_to_meshio_order(kind, np.reshape(flat, (-1, count)).astype(np.int64))))
    return out


def _through_meshio(path: Path) -> RawMesh:
    """The contents of a file that meshio reads; the caller must expect it to print, warn and end the program."""
    import meshio
    from meshio import _mesh
    from meshio.abaqus import _abaqus

    _abaqus.abaqus_to_meshio_type.update(_PLANE)
    _mesh.topological_dimension.update(_QUADRATIC)
    abaqus = path.suffix.lower() == ".inp"
    text = _with_sets(_whole_text(path)) if abaqus else ""
    with warnings.catch_warnings(), chdir(path.parent):  # relative to which XDMF names its data
        warnings.simplefilter("ignore")
        raw = _abaqus.read_buffer(io.StringIO(text)) if abaqus else meshio.read(path.name)
    return from_meshio(raw, text)


def _whole_text(path: Path, within: tuple[Path, ...] = ()) -> str:
    """An Abaqus text with those of the files that it includes, relative to its folder."""

    def included(line: re.Match[str]) -> str:
        file = path.parent / line[1]
        if file in (*within, path) or not file.is_file():
            got = "one that is being read" if file.is_file() else "nothing"
            raise MeshError(f"*INCLUDE in {path.name} must name another file, got {got} at {file}")
        return _whole_text(file, (*within, path)).rstrip()

    return INCLUDE.sub(included, path.read_text(errors="replace"))


def _with_sets(text: str) -> str:
    """An Abaqus text with sets of elements in place of the single elements that its *SURFACE blocks number."""
    sets: dict[str, list[str]] = {}

    def of_sets(block: re.Match[str]) -> str:
        name = re.search(_NAME, block[1])
        lines: dict[str, None] = {}  # in their order, once each
        for line in block[2].splitlines(keepends=True):
            line_of_set = line
            match = re.fullmatch(r"\s*(\d+)\s*,\s*[Ss](\d)\s*,?\s*", line)
            if name and match:
                of_side = f"{name[1]}:S{match[2]}"
                sets.setdefault(of_side, []).append(match[1])
                line_of_set = f"{of_side}, S{match[2]}\n"
            lines[line_of_set] = None
        return block[0].replace(block[2], "".join(lines)) if lines else block[0]

    changed = re.sub(_SURFACES, of_sets, text)
    added = [f"*ELSET, ELSET={name}\n" + ",\n".join(numbers) + "\n" for name, numbers in sets.items()]
    return "\n".join([changed.rstrip("\n"), *added]) if added else text


def from_meshio(raw: Any, abaqus: str = "") -> RawMesh:
    """The contents of a meshio mesh; `abaqus` is the text of its file, whose surfaces meshio ignores."""
    blocks: dict[str, list[np.ndarray]] = {}
    others: dict[str, int] = {}
    for block in raw.cells:
        if block.dim == 3 and _family(block.type) in CORNERS:
            blocks.setdefault(block.type, []).append(_whole(block.data))
        elif block.dim == 3:
            others[block.type] = others.get(block.type, 0) + len(block.data)
    nodes = {str(name): _whole(members) for name, members in (raw.point_sets or {}).items()}
    cells = {kind: np.concatenate(each) for kind, each in blocks.items()}
    return RawMesh(np.asarray(raw.points, dtype=float), cells, others, _sides(raw, abaqus), nodes)


def _sides(raw: Any, abaqus: str) -> dict[str, list[np.ndarray]]:
    """Sets of triangles and quadrilaterals, and of sides of solid elements."""
    found: dict[str, list[np.ndarray]] = {}
    names = {int(number): name for name, (number, dim) in raw.field_data.items() if dim == 2}
    sets = {name: members for name, members in raw.cell_sets.items() if not name.startswith("gmsh:")}
    for i, block in enumerate(raw.cells):
        if _family(block.type) not in _FLAT:
            continue
        corners = _whole(block.data)[:, : _FLAT[_family(block.type)]]
        if "gmsh:physical" in raw.cell_data:
            numbers = np.asarray(raw.cell_data["gmsh:physical"][i]).astype(int)
            for number in np.unique(numbers[numbers > 0]).tolist():
                found.setdefault(names.get(number, f"group {number}"), []).append(corners[numbers == number])
        for name, members in sets.items():
            on = members[i] if i < len(members) else None
            if on is not None and len(on) and name not in names.values():
                found.setdefault(name, []).append(corners[_whole(on)])
    for name, of_set, side in _abaqus_surfaces(abaqus):
        for block, members in zip(raw.cells, sets.get(of_set, ()), strict=False):
            tables = _ABAQUS_SIDES.get(CORNERS.get(_family(block.type), 0), ())
            if members is not None and len(members) and side < len(tables):
                found.setdefault(name, []).append(_whole(block.data)[_whole(members)][:, tables[side]])
    return found


def _abaqus_surfaces(text: str) -> list[tuple[str, str, int]]:
    """Lines of *SURFACE blocks that take one side of all elements of a set: name, set, number of the side from 0."""
    found = []
    for options, lines in re.findall(_SURFACES, text):
        name = re.search(_NAME, options)
        for line in lines.splitlines():
            match = re.fullmatch(r"\s*\"?([^,\"\s]+)\"?\s*,\s*[Ss](\d)\s*,?\s*", line)
            if name and match and int(match[2]) > 0:
                found.append((name[1], match[1], int(match[2]) - 1))
    return found


def _family(kind: str) -> str:
    """A kind without its number of nodes: ``tetra`` for ``tetra10``."""
    return kind.rstrip("0123456789")


def _whole(numbers: Any) -> Int[np.ndarray, "..."]:
    """Numbers of nodes or cells as 64-bit integers."""
    try:
        return np.asarray(numbers).astype(np.int64)
    except (OverflowError, ValueError, TypeError):
        raise MeshError("must number its nodes with whole numbers of at most 18 digits, got others") from None
