"""A draft of a scene for an assembly from CAD: its solids as links, joints as comments to confirm."""

import os
import re
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import SceneError
from kedfem.mesh.cad.assembly import AssemblyJoint, AssemblySolid, assembly_joints, assembly_solids
from kedfem.scene import GROUND, ChosenFace, link_from, scene_from
from kedfem.scene.read.including import toml_string

FRAME = re.compile(r"ground|frame|base|housing|casing|chassis|bed|gestell|gehäuse|rahmen", re.IGNORECASE)
_BARE = re.compile(r"[A-Za-z0-9_-]+")  # names that stand without quotes in TOML
_LONGEST = 80  # letters of a link's name: those of one name get a number more
_HEAD = """\
# Made by `kedfem new --from` of {file}: every solid of the assembly is a link, where the assembly has it.
# Lines that begin with "#" and no blank are proposals: look at each, then remove the "#" of those that you
# confirm. Numbers without a unit are SI (m, kg, s, N, Pa, rad). All keys: docs/scene.md.
"""
_ROUND = """
# Joints where round faces of two parts meet. revolute: a hinge; where the parts slide along the axis write
# cylindrical or prismatic instead, where they are fixed to each other weld.
"""
_NO_FRAME = """
# The parts are an open chain, and none is called a frame: which is held is yours to write, as
# links = ["ground", NAME] in a joint of your own. Then [drive] turns a hinge of the ground.
"""
_SEVERAL = """
# These two meet in {several} places: to turn they need one hinge; or they are bolted together (weld), or one slides
# along the other (prismatic)."""
_ANALYSIS = """
[analysis]
end_time = "1 s"
step = "1 ms"     # with a drive leave it out: kedfem chooses the step, meshes and elements
"""


def draft_scene(assembly: Path, folder: Path, scale: float | None) -> str:
    """The text of a scene for a CAD file, to be written into a folder.

    Parameters
    ----------
    scale : metres per unit of the file; None: the unit that the file states

    Raises
    ------
    MeshError
        The file cannot be read, or one of its solids is not one to mesh.
    SceneError
        The file's name or the scale is not valid in a scene.
    """
    scaled = {} if scale is None else {"scale": scale}
    link_from({"shape": {"file": assembly.name, **scaled}})
    text = scene_text(assembly_solids(assembly, scale), _relative(assembly, folder), scale)
    scene_from(tomllib.loads(text), folder)
    return text


def scene_text(solids: Sequence[AssemblySolid], file: str, scale: float | None) -> str:
    """A scene with a link for each solid of a file; joints where they meet, ground and drive as a comment."""
    names = link_names([solid.name for solid in solids])
    found = assembly_joints(solids)
    ground = ground_solid(solids, found)
    found = sorted(found, key=lambda each: _order(each, ground, solids))
    links = (_link(name, solid, file, scale) for name, solid in zip(names, solids, strict=True))
    head = f"{_HEAD.format(file=_shown(file))}\ntitle = {_quoted(Path(file).stem)}\n"
    tables = (_as_frame(x, names[i]) if i == ground else f"\n{x}" for i, x in enumerate(links))
    return "".join([head, *tables, *_joints(found, names, ground), _ANALYSIS])


def link_names(names: Sequence[str]) -> list[str]:
    """Unique names for the links of a scene, of letters, digits and underscores, none of them the ground's.

    >>> link_names(["Crank #1", "crank 1", "ground", "~"])
    ['Crank_1', 'crank_1_2', 'ground_2', 'part']
    """
    found: list[str] = []
    taken = {GROUND}
    for name in names:
        plain = re.sub(r"[\W_]+", "_", unicodedata.normalize("NFC", name)).strip("_")[:_LONGEST].strip("_")
        plain = own = plain or "part"
        number = 1
        while own.casefold() in taken:
            number += 1
            own = f"{plain}_{number}"
        taken.add(own.casefold())
        found.append(own)
    return found


def ground_solid(solids: Sequence[AssemblySolid], found: Sequence[AssemblyJoint]) -> int | None:
    """The solid that is probably the frame: the largest with a frame's name, else the largest in a closed loop.

    None of a solid without contact to others, or in an open chain, where any may be the frame.
    """
    pairs = {frozenset(each.solids) for each in found}
    named = [i for i in sorted({i for pair in pairs for i in pair}) if FRAME.search(solids[i].name)]
    while open_ends := {i for i, count in Counter(i for pair in pairs for i in pair).items() if count == 1}:
        pairs = {pair for pair in pairs if not pair & open_ends}
    looped = sorted({i for pair in pairs for i in pair})
    return max(named or looped, key=lambda i: solids[i].extent, default=None)


def _order(found: AssemblyJoint, ground: int | None, solids: Sequence[AssemblySolid]) -> tuple[bool, bool, float]:
    """Sorting key: hinges of the ground first, among these that of the shortest link, which may be the crank."""
    others = [solids[i].extent for i in found.solids if i != ground]
    return found.ball, ground not in found.solids, min(others)


def _link(name: str, solid: AssemblySolid, file: str, scale: float | None) -> str:
    """A link's table."""
    keys = f"file = {_quoted(file)}, solid = {_quoted(solid.name)}"
    if scale is not None:
        keys += f", scale = {scale!r}"
    head = f"[links.{_key(name)}]  # {_shown(solid.name)} of the assembly"
    return f'{head}\nmaterial = "steel"\nshape = {{ {keys} }}\n'


def _as_frame(table: str, name: str) -> str:
    """The table of the possible frame, as a comment."""
    phrase = (
        f'\n# {name} may be the frame: joints below call it "{GROUND}", and it needs no link. If it shall bend too,\n'
        f'# take this link, put its name in place of "{GROUND}", and weld it to the ground.\n'
    )
    return phrase + "".join(f"# {line}\n" for line in table.splitlines())


def _joints(found: Sequence[AssemblyJoint], names: Sequence[str], ground: int | None) -> Iterator[str]:
    """The joints' tables and a drive's, all as comments."""
    if not found:
        none = "No pin in a bore, no bores in a line, no ball in its socket"
        yield f"\n# {none}: joints are yours to write, [joints.NAME].\n"
        return
    yield _ROUND
    if ground is None:
        yield _NO_FRAME
    often = Counter(frozenset(each.solids) for each in found)
    for number, each in enumerate(found, start=1):
        yield _joint(f"J{number}", each, names, ground, often[frozenset(each.solids)])
    if ground in found[0].solids and not found[0].ball:
        yield '\n#[drive]\n#joint = "J1"\n#motion = { kind = "ramp", speed = "60 rpm", time = "0.1 s" }\n'


def _joint(name: str, found: AssemblyJoint, names: Sequence[str], ground: int | None, several: int) -> str:
    """A joint's table, as a comment."""
    links = [_quoted(GROUND if i == ground else names[i]) for i in found.solids]
    lines = [
        f"[joints.{name}]",
        f'kind = "{"spherical" if found.ball else "revolute"}"',
        f"links = [{', '.join(links)}]",
        f"at = [{', '.join(_quoted(_mm(x)) for x in found.at)}]",
    ]
    if not found.ball:
        lines.append(f"axis = {_axis(found.faces[0].direction)}")
    chosen = [
        f"{link} = {ChosenFace(cylinder=2 * face.radius, axis=_xyz(face.direction), near=_xyz(found.at)).label}"
        for i, link, face in zip(found.solids, links, found.faces, strict=True)
        if found.hidden[found.solids.index(i)] and i != ground
    ]
    if chosen:
        lines.append(f"faces = {{ {', '.join(chosen)} }}  # else the bore about the same axis")
    phrase = _in_words(found, [names[i] for i in found.solids])
    if several > 1:
        phrase += _SEVERAL.format(several=several)
    return f"\n# {phrase}\n" + "".join(f"#{line}\n" for line in lines)


def _in_words(found: AssemblyJoint, links: Sequence[str]) -> str:
    """Faces in contact: ``bore of radius 6 mm of rod, pin of radius 6 mm of crank, together along 10 mm``."""
    faces = [_face(face.inward, face.kind, face.radius) for face in found.faces]
    phrase = ", ".join(f"{face} of {link}" for face, link in zip(faces, links, strict=True))
    if found.ball:
        return phrase
    where = ": their pin is not drawn" if found.two_bores else f", together along {_mm(found.overlap)}"
    return phrase + where


def _face(inward: bool, kind: str, radius: float) -> str:
    """``bore of radius 6 mm``."""
    words = ("ball seat" if inward else "ball") if kind == "sphere" else "bore" if inward else "pin"
    return f"{words} of radius {_mm(radius)}"


def _axis(direction: Float[np.ndarray, "3"]) -> str:
    """A letter where the axis is along one, else its components."""
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        if abs(direction @ axis) > 1 - 1e-9:
            return f'"{name}"'
    return f"[{', '.join(f'{x:.9g}' for x in direction + 0.0)}]"


def _xyz(x: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
    a, b, c = (round(float(each), 9) + 0.0 for each in x)
    return a, b, c


def _mm(x: float) -> str:
    """A length, rounded to a nanometre."""
    return f"{round(1e3 * float(x), 6) + 0.0:.10g} mm"


def _relative(file: Path, folder: Path) -> str:
    """A file's path as a scene in a folder names it."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _quoted(name)


def _quoted(text: str) -> str:
    """A text as TOML writes it; SceneError of an unpaired surrogate."""
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise SceneError(f"--from: must have names of whole letters, got {text!r}") from error
    return toml_string(text)


def _shown(text: str) -> str:
    """A text in a comment: on one line, without characters that TOML forbids there."""
    return _quoted(text)[1:-1].replace('\\"', '"')
