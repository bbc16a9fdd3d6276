"""What gmsh does not return of a CAD file, read from its text: the unit, names of bodies and of faces."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kedfem.arrays import Float

_PREFIX = {
    "EXA": 1e18, "PETA": 1e15, "TERA": 1e12, "GIGA": 1e9, "MEGA": 1e6, "KILO": 1e3, "HECTO": 1e2,
    "DECA": 1e1, "DECI": 1e-1, "CENTI": 1e-2, "MILLI": 1e-3, "MICRO": 1e-6, "NANO": 1e-9, "PICO": 1e-12,
}  # fmt: skip
_IGES_UNITS = {
    1: 0.0254, 2: 1e-3, 4: 0.3048, 5: 1609.344, 6: 1.0, 7: 1e3, 8: 25.4e-6, 9: 1e-6, 10: 1e-2, 11: 25.4e-9,
}  # fmt: skip
_IGES_NAMES = {
    "IN": 1, "INCH": 1, "MM": 2, "FT": 4, "MI": 5, "M": 6, "KM": 7, "MIL": 8, "UM": 9, "CM": 10, "UIN": 11,
}  # fmt: skip
_INSTANCE = re.compile(r"#(\d+)\s*=\s*((?:'(?:[^']|'')*'|[^';])*);")
_REFERENCE = re.compile(r"#(\d+)")
_STRING = re.compile(r"'((?:[^']|'')*)'")
_NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:[Ee][-+]?\d+)?")
_NO_NAME = {"", "none", "$", "unnamed"}
_TRANSLATOR = "Open CASCADE STEP translator"  # OpenCASCADE's name for a product without one


@dataclass(frozen=True, slots=True)
class Body:
    """A solid in a STEP file: its name, and the name and mean corner of each face, in the file's order.

    Corners are in the file's unit and the body's own frame; nan for a face without corners.
    """

    name: str
    faces: tuple[str, ...]
    corners: Float[np.ndarray, "f 3"]


@dataclass(frozen=True, slots=True)
class StepText:
    """The instances of a STEP file: the text after the equals sign by #number."""

    instances: dict[int, str]

    def refers(self, number: int) -> list[int]:
        """The numbers of the instances to which one refers, in order."""
        text = _STRING.sub("''", self.instances.get(number, ""))
        return [int(found) for found in _REFERENCE.findall(text)]

    def kind(self, number: int) -> str:
        """An instance's keyword."""
        return self.instances.get(number, "").partition("(")[0].strip()

    def name(self, number: int) -> str:
        """An instance's first string, which is its name; empty without one."""
        found = _STRING.search(self.instances.get(number, ""))
        return _decoded(found[1]) if found else ""


def step_text(path: Path) -> StepText:
    """The instances of a STEP file; none if the file is not STEP."""
    text = path.read_text(encoding="latin-1")
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)
    return StepText({int(number): body for number, body in _INSTANCE.findall(text)})


def step_unit(step: StepText) -> float | None:
    """Metres per unit of a STEP file; None if it states no unit or several."""
    contexts = [body for body in step.instances.values() if "GLOBAL_UNIT_ASSIGNED_CONTEXT" in body]
    given = re.compile(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\((.*?)\)", re.DOTALL)
    parts = (part for body in contexts for part in given.findall(body))
    used = {int(number) for part in parts for number in _REFERENCE.findall(part)}
    units = {_length(step, number) for number in used if "LENGTH_UNIT" in step.instances.get(number, "")}
    return units.pop() if len(units) == 1 else None


def _length(step: StepText, number: int) -> float | None:
    """Metres of a length unit: metres with a prefix, or a multiple of another unit."""
    text = step.instances[number]
    metres = re.search(r"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.", text)
    if metres:
        return _PREFIX.get(metres[1]) if metres[1] else 1.0
    converted = re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'[^']*'\s*,\s*#(\d+)", text)
    if not converted:
        return None
    measure = step.instances.get(int(converted[1]), "")
    factor = re.search(r"LENGTH_MEASURE\s*\(\s*([-+.\dEe]+)", measure)
    base = _REFERENCE.findall(measure)
    below = _length(step, int(base[-1])) if base and int(base[-1]) in step.instances else None
    return float(factor[1]) * below if factor and below else None


def step_products(step: StepText) -> list[str]:
    """The names of the products in a STEP file, without nameless ones."""
    names = [own_name(step.name(number)) for number in step.instances if step.kind(number) == "PRODUCT"]
    return [name for name in names if name]


def step_bodies(step: StepText) -> Iterator[Body]:
    """The solids of a STEP file, in its order."""
    for number in step.instances:
        if step.kind(number) not in ("MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS"):
            continue
        faces = [face for shell in step.refers(number) for face in _faces(step, shell)]
        corners = np.array([_corner_mean(step, face) for face in faces]).reshape(-1, 3)
        yield Body(own_name(step.name(number)), tuple(own_name(step.name(face)) for face in faces), corners)


def _faces(step: StepText, shell: int) -> list[int]:
    """The faces of a shell, or of the shell to which an oriented shell refers."""
    if step.kind(shell) == "ORIENTED_CLOSED_SHELL":
        return [face for inner in step.refers(shell) for face in _faces(step, inner)]
    return [face for face in step.refers(shell) if step.kind(face) in ("ADVANCED_FACE", "FACE_SURFACE")]


def _corner_mean(step: StepText, face: int) -> Float[np.ndarray, "3"]:
    """The mean of the different vertices of a face."""
    level, vertices = step.refers(face), set()
    while level:
        at = level.pop()
        match step.kind(at):
            case "VERTEX_POINT":
                vertices.add(at)
            case "FACE_BOUND" | "FACE_OUTER_BOUND" | "EDGE_LOOP" | "VERTEX_LOOP" | "ORIENTED_EDGE" | "EDGE_CURVE":
                level += step.refers(at)
    points = [_point(step, point) for vertex in vertices for point in step.refers(vertex)]
    return np.mean(points, axis=0) if points else np.full(3, np.nan)


def _point(step: StepText, number: int) -> Float[np.ndarray, "3"]:
    """The coordinates of a point."""
    numbers = _NUMBER.findall(_STRING.sub("", step.instances.get(number, "")))
    return np.array([float(x) for x in numbers]) if len(numbers) == 3 else np.full(3, np.nan)


def own_name(name: str) -> str:
    """A name that a user gave; empty for placeholders."""
    name = name.strip()
    return "" if name.lower() in _NO_NAME or name.startswith(_TRANSLATOR) else name


def _decoded(text: str) -> str:
    r"""A string of a STEP file with its escapes decoded, such as \X2\00E4\X0\ for ä."""
    text = re.sub(r"\\X2\\((?:[0-9A-Fa-f]{4})+)\\X0\\", lambda found: bytes.fromhex(found[1]).decode("utf-16-be"), text)
    text = re.sub(r"\\X\\([0-9A-Fa-f]{2})", lambda found: chr(int(found[1], 16)), text)
    return text.replace("''", "'").replace("\\\\", "\\")


def iges_unit(path: Path) -> float | None:
    """Metres per unit of an IGES file; None if it states none."""
    lines = path.read_text(encoding="latin-1").splitlines()
    fields = _iges_fields("".join(line[:72].ljust(72) for line in lines if line[72:73] == "G"))
    if len(fields) < 15:
        return None
    flag = int(fields[13]) if fields[13].strip().isdigit() else 1
    flag = _IGES_NAMES.get(fields[14].strip().upper(), 0) if flag == 3 else flag
    return _IGES_UNITS.get(flag)


def _iges_fields(text: str) -> list[str]:
    """The fields of an IGES file's global section; strings carry their length, as 4HUNIT."""
    separator, start, fields = ",", 0, list[str]()
    if text.startswith("1H"):
        separator, start, fields = text[2], 4, [text[2]]
    while start < len(text) and len(fields) < 26:
        string = re.match(r"\s*(\d+)H", text[start:])
        end = start + (string.end() + int(string[1]) if string else 0)
        stop = text.find(separator, end)
        stop = len(text) if stop < 0 else stop
        fields.append(text[start + string.end() : end] if string else text[start:stop])
        start = stop + 1
    return fields
