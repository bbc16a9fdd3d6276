"""Cross checks of the analysis and its drive, and of files; each yields fault lines."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kedfem.errors import SceneError
from kedfem.scene.drives import ConstantSpeed, Cycloidal, Polynomial, Ramp, Table
from kedfem.scene.files import part_geometry
from kedfem.scene.parts import Parts
from kedfem.scene.shapes import MeshFile, Part
from kedfem.scene.timing import turning_speed


def analysis_faults(parts: Parts) -> Iterator[str]:
    """An analysis whose end or step is missing, given twice or impossible with the drive."""
    analysis = parts.analysis
    if not analysis.raw:
        return
    if analysis.has("turns") and analysis.has("end_time"):
        yield analysis.fault("turns", "must stand without end_time, got both")
    if not analysis.has("turns") and not analysis.has("end_time"):
        yield analysis.fault("turns", "is required, or end_time [s], got neither")
    if analysis.has("step") and analysis.has("steps_per_turn"):
        yield analysis.fault("step", "must stand without steps_per_turn, got both")
    if parts.drive.record is not None:
        yield from drive_and_analysis_faults(parts)


def drive_and_analysis_faults(parts: Parts) -> Iterator[str]:
    """An analysis that does not suit the law of motion."""
    analysis, motion = parts.analysis, parts.drive.record.motion
    if turning_speed(motion) == 0.0:
        still = isinstance(motion, (ConstantSpeed, Ramp))
        got = "speed 0" if still else f"{motion.kind!r}"
        for key in ("turns", "steps_per_turn"):
            if analysis.has(key):
                instead = "end_time" if key == "turns" else "step"
                yield analysis.fault(
                    key, f"needs a drive that goes on turning (else {instead} [s]), got {got}"
                )
        if not analysis.has("step") and not analysis.has("steps_per_turn"):
            yield analysis.fault(
                "step", f"is required with a drive that does not go on turning [s], got {got}"
            )
    if isinstance(motion, Table) and motion.time:
        yield from table_faults(parts, motion)
    stays = isinstance(motion, (Cycloidal, Polynomial)) and motion.return_time is None
    if stays and motion.dwell_after > 0.0:
        yield "drive.motion.dwell_after: must stand with return_time, got no return"


def table_faults(parts: Parts, motion: Table) -> Iterator[str]:
    """A motion table that does not cover the analysis."""
    if motion.time[0] > 0.0:
        yield f"drive.motion.time: must begin at 0 or before [s], got {motion.time[0]:.6g}"
    end = parts.analysis.record.end_time if parts.analysis.record is not None else None
    if end is not None and end > motion.time[-1] * (1.0 + 1e-9):
        wanted = f"must reach the end of the analysis {end:.6g} [s]"
        yield f"drive.motion.time: {wanted}, got {motion.time[-1]:.6g}"


def file_faults(parts: Parts) -> Iterator[str]:
    """Files of shapes that are missing, and parts that do not fit between their points."""
    for link in parts.links.values():
        shape = link.record.shape if link.record is not None else None
        if isinstance(shape, MeshFile) and not (parts.folder / shape.file).is_file():
            yield link.fault(
                "shape", f"must be a mesh file, got nothing at {parts.folder / shape.file}", "file"
            )
        if isinstance(shape, Part):
            try:
                part = part_geometry(parts.folder / shape.file)
            except SceneError as error:
                yield from (link.fault("shape", fault, "file") for fault in error.faults)
                continue
            wanted, got = math.dist(*shape.between), math.dist(part.origin, part.x_point)
            if abs(wanted - got) > 1e-6 * got:
                message = (
                    f"must be as far apart as origin and x_point of the part {got:.9g} [m], got {wanted:.9g}"
                )
                yield link.fault("shape", message, "between")
