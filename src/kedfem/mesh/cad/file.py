"""CAD files, read into gmsh's model as solids in metres; nothing is printed, and every failure is a MeshError."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Literal

import numpy as np

from kedfem.errors import MeshError
from kedfem.mesh.cad.text import iges_unit, step_text, step_unit
from kedfem.mesh.places import in_mm
from kedfem.mesh.session import boundary, connected_groups, gmsh_options
from kedfem.processes import at_most

Format = Literal["STEP", "IGES", "BREP"]
ENDINGS: dict[str, Format] = {
    ".step": "STEP", ".stp": "STEP", ".iges": "IGES", ".igs": "IGES", ".brep": "BREP", ".brp": "BREP",
}  # fmt: skip

#: OpenCASCADE reads STEP and IGES in millimetres, where its tolerances of 1e-7 are small against any part. The model
#: is scaled to metres afterwards, tolerances with it; cylinders stay exact. If it were read in metres at once
#: (Geometry.OCCTargetUnit), all tolerances would be 0.1 µm, and IGES does not take the unit in a new session.
_MILLIMETRE = 1e-3
_BREP_UNIT = 1e-3
SMALLEST, LARGEST = 1e-5, 1e3  # [m], diagonal of a part's bounding box; beyond these the unit must be wrong
# seconds of processor time that reading may take, and seconds more per megabyte of the file
_READING, _READING_MB = 20.0, 10.0
_ENDLESS = 1e50  # size of the bounding box that OpenCASCADE gives a face without edges
_GAPS = (1e-4, 3e-4, 1e-3)  # of the part's size: wider gaps that mending closes, which is reported
_SEWING = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5)  # [m], gaps between faces that sewing closes, tried in turn


@dataclass(frozen=True, slots=True)
class CadFile:
    """A file to be read: `where` for messages; `scale` is the length of its unit [m], None for the stated one."""

    where: str
    path: Path
    format: Format
    scale: float | None


def cad_file(where: str, path: Path, scale: float | None) -> CadFile:
    """A file that can be opened and has the format that its ending says.

    Raises
    ------
    MeshError
        No such file, a folder, an unknown ending, empty, not readable, of another format, or broken off.
    """
    wanted = "must be a CAD file (" + ", ".join(ENDINGS) + ")"
    if not path.is_file():
        raise MeshError(f"{where}: {wanted}, got {'a folder' if path.is_dir() else 'nothing'} at {path}")
    if path.suffix.lower() not in ENDINGS:
        raise MeshError(f"{where}: {wanted}, got {path}")
    form = ENDINGS[path.suffix.lower()]
    try:
        text = path.read_bytes()
    except OSError as error:
        raise MeshError(f"{where}: must be a file that can be read, got {path}: {error.strerror or error}") from error
    if not text.strip():
        raise MeshError(f"{where}: {wanted}, got an empty file at {path}")
    _check_form(where, path, form, text)
    return CadFile(where, path, form, scale)


def _check_form(where: str, path: Path, form: Format, text: bytes) -> None:
    """Refuse a text of another format, or a truncated one: OpenCASCADE would read what is there without a warning."""
    begins, whole = {
        "STEP": (b"ISO-10303-21" in text[:2000], b"END-ISO-10303-21" in text[-2000:]),
        "IGES": (text[72:73] in (b"S", b"F", b"C"), text.rstrip().splitlines()[-1][72:73] == b"T"),
        "BREP": (b"CASCADE Topology" in text[:2000], _whole_brep(text)),
    }[form]
    if not begins:
        raise MeshError(f"{where}: must hold {form}, as its ending says, got another text in {path}")
    if not whole:
        raise MeshError(f"{where}: must be a whole file of {form}, got one that breaks off: {path}")


def _whole_brep(text: bytes) -> bool:
    """Whether a BREP file has all shapes that it announces: OpenCASCADE would wait for missing ones for ever."""
    count = re.search(rb"^TShapes (\d+)", text, re.MULTILINE)
    shapes = re.findall(rb"^(?:Ve|Ed|Wi|Fa|Sh|So|CS|Co)\s*$", text, re.MULTILINE)
    return count is not None and int(count[1]) == len(shapes) and text.split()[-1] == b"0"


def read_solids(gmsh: ModuleType, file: CadFile) -> tuple[list[int], str]:
    """The tags of a file's solids, now in gmsh's model in metres, and what was mended, in words.

    Faces that enclose a volume are made a solid. A worker that takes too long is ended: OpenCASCADE hangs at some
    damaged files in one process and not in the next.

    Raises
    ------
    MeshError
        OpenCASCADE cannot read the file, or there is no solid in it.
    """
    with at_most(_READING + _READING_MB * file.path.stat().st_size / 1e6):
        return _solids(gmsh, file)


def _solids(gmsh: ModuleType, file: CadFile) -> tuple[list[int], str]:
    scaling = _scaling(file)
    imported(gmsh, file, scaling, sewing=None)
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    if solids:
        return solids, ""
    if not gmsh.model.getEntities(2):
        raise _refusal(gmsh, file)
    boxes = np.array([gmsh.model.getBoundingBox(2, tag) for tag in _faces(gmsh)])
    extent = 0.0
    if np.abs(boxes).max() < _ENDLESS:
        extent = float(np.linalg.norm(boxes[:, 3:].max(axis=0) - boxes[:, :3].min(axis=0)))
        check_size(file, "its faces", extent)
    for gap in _SEWING:
        gmsh.model.remove()
        gmsh.model.add("kedfem")  # tags begin anew
        imported(gmsh, file, scaling, sewing=gap)
        if not _free_edges(gmsh, _faces(gmsh)):
            break
    solids = _closed_solids(gmsh)
    if solids:
        return solids, ""
    refusal = _refusal(gmsh, file)
    for gap in (share * extent for share in _GAPS):  # not read again: see _healed
        if _healed(gmsh, gap) and not _free_edges(gmsh, _faces(gmsh)):
            return [tag for _, tag in gmsh.model.getEntities(3)], f"faces up to {1e3 * gap:.2g} mm apart sewn"
    raise refusal


def _healed(gmsh: ModuleType, tolerance: float) -> bool:
    """Whether there are solids once OpenCASCADE has mended wires, tiny edges and gaps of all shapes in the model [m].

    It is called with growing tolerances on one import, because OpenCASCADE may hang when it reads a damaged file again.
    """
    try:
        with silent():
            gmsh.model.occ.healShapes([], tolerance=tolerance)
            gmsh.model.occ.synchronize()
    except Exception:  # noqa: BLE001  (gmsh raises nothing more special)
        return False
    return bool(gmsh.model.getEntities(3))


def check_size(file: CadFile, what: str, extent: float) -> None:
    """Refuse a size [m] outside of SMALLEST to LARGEST."""
    if not SMALLEST <= extent <= LARGEST:
        raise MeshError(
            f"{file.where}: must hold a part between {SMALLEST:g} and {LARGEST:g} [m] across, got {extent:.3g} "
            f"for {what} in {file.path}; set `scale`, the metres per unit of the file"
        )


def _scaling(file: CadFile) -> float:
    """The factor on OpenCASCADE's coordinates."""
    if file.format == "BREP":
        return _BREP_UNIT if file.scale is None else file.scale
    if file.scale is None:
        return _MILLIMETRE
    unit = iges_unit(file.path) if file.format == "IGES" else step_unit(step_text(file.path))
    if unit is None:
        raise MeshError(
            f"{file.where}: must say its unit of length once for `scale` to replace it, got none or several "
            f"in {file.path}"
        )
    return _MILLIMETRE * file.scale / unit


def imported(gmsh: ModuleType, file: CadFile, scaling: float, sewing: float | None) -> None:
    """Add the file's shapes to the model, coordinates times `scaling`; sew faces that are at most `sewing` [m] apart."""
    try:
        with _options(gmsh, scaling, sewing), silent():
            gmsh.model.occ.importShapes(str(file.path), highestDimOnly=False)
            gmsh.model.occ.synchronize()
    except Exception as error:
        reason = " ".join(str(error).split()) or "it gave up without a word"
        raise MeshError(
            f"{file.where}: must be a file that OpenCASCADE can read as {file.format}, got {file.path}: {reason}"
        ) from error


@contextmanager
def _options(gmsh: ModuleType, scaling: float, sewing: float | None) -> Iterator[None]:
    """gmsh's options for one import; they are restored afterwards."""
    wanted = {"Geometry.OCCScaling": scaling, "Geometry.OCCSewFaces": float(sewing is not None)}
    if sewing is not None:
        wanted["Geometry.Tolerance"] = sewing
    unit = gmsh.option.getString("Geometry.OCCTargetUnit")
    gmsh.option.setString("Geometry.OCCTargetUnit", "")
    try:
        with gmsh_options(gmsh, wanted):
            yield
    finally:
        gmsh.option.setString("Geometry.OCCTargetUnit", unit)


@contextmanager
def silent() -> Iterator[None]:
    """Discard what OpenCASCADE itself writes to the terminal: gmsh's options do not control it."""
    kept = [os.dup(stream) for stream in (1, 2)]
    try:
        with Path(os.devnull).open("w") as nowhere:
            for stream in (1, 2):
                os.dup2(nowhere.fileno(), stream)
            yield
    finally:
        for stream, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, stream)
            os.close(copy)


def _faces(gmsh: ModuleType) -> list[int]:
    """The tags of all faces."""
    return [tag for _, tag in gmsh.model.getEntities(2)]


def _free_edges(gmsh: ModuleType, faces: list[int]) -> list[int]:
    """The edges that belong to only one of the faces."""
    return [tag for _, tag in gmsh.model.getBoundary([(2, face) for face in faces], oriented=False)]


def _closed_solids(gmsh: ModuleType) -> list[int]:
    """Solids made of the connected groups of faces that are closed."""
    occ, faces, solids = gmsh.model.occ, _faces(gmsh), []
    for shell in connected_groups([boundary(gmsh, 2, face) for face in faces]):
        group = [faces[i] for i in shell]
        if not _free_edges(gmsh, group):
            solids.append(occ.addVolume([occ.addSurfaceLoop(group, sewing=False)]))
    occ.synchronize()
    return solids


def _refusal(gmsh: ModuleType, file: CadFile) -> MeshError:
    """The error for a file without a solid: what is in it instead."""
    faces = _faces(gmsh)
    if not faces:
        curves = len(gmsh.model.getEntities(1))
        got = f"{curves} curves" if curves else "nothing"
        return MeshError(f"{file.where}: must hold a solid, got {got} and no faces in {file.path}")
    free = _free_edges(gmsh, faces)
    X = gmsh.model.occ.getCenterOfMass(1, free[0]) if free else (0.0, 0.0, 0.0)
    return MeshError(
        f"{file.where}: must hold a solid, got faces that do not close ({len(faces)} of them, "
        f"{len(free)} free edges, one at {in_mm(X)}) in {file.path}; "
        "close them, or export the part as a solid"
    )
