"""Cross checks of plane links and their plane, of the analysis and its drive, of files; each yields fault lines."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kedfem.errors import SceneError
from kedfem.scene.analysis import WITHOUT_VIBRATION
from kedfem.scene.checks import NOUNS
from kedfem.scene.drives import ConstantSpeed, Cycloidal, Polynomial, Ramp, Table
from kedfem.scene.files import part_geometry
from kedfem.scene.laws import table_noise
from kedfem.scene.parts import Entry, Parts, fidelity
from kedfem.scene.planes import FLAT, leaving, off_plane, spring_ends, vector
from kedfem.scene.shapes import Bar, Cad, MeshFile, Part
from kedfem.scene.timing import cycle, turning_speed

ROUGH = 0.05  # share of a table's acceleration that may be noise


def planar_faults(parts: Parts) -> Iterator[str]:
    """What leaves the plane of a scene with plane links."""
    here = f"a scene of {NOUNS['plane']}s"
    if not any(fidelity(link) == "plane" for link in parts.links.values()):
        return
    for joint in parts.joints.values():
        axis = joint.record.axis if joint.record is not None else None
        if axis is None:
            continue
        off = max(abs(axis[0]), abs(axis[1]))
        if joint.record.kind == "revolute" and off > FLAT:
            yield joint.fault("axis", f"must be along z in {here}, got {vector(axis)}")
        if joint.record.kind in {"prismatic", "slot"} and abs(axis[2]) > FLAT:
            yield joint.fault("axis", f"must lie in the xy plane in {here}, got {vector(axis)}")
    if parts.gravity[2] != 0.0:
        yield f"gravity: must lie in the xy plane in {here} [m/s^2], got {vector(parts.gravity)}"
    for load in parts.loads.values():
        yield from leaving(load, f"in {here}")
    for link in parts.links.values():
        shape = getattr(link.record, "shape", None)
        if fidelity(link) == "plane" and isinstance(shape, Bar) and math.hypot(*shape.upward[:2]) > FLAT:
            yield link.fault("shape", f"must be along z in {here}, got {vector(shape.upward)}", "up")
    yield from plane_faults(parts, here)


def plane_faults(parts: Parts, here: str) -> Iterator[str]:
    """Points of joints and plane links that are not in the z plane of the first; those of other links may be."""
    others = {link.name for link in parts.links.values() if fidelity(link) in {"solid", "beam"}}
    entries = [
        entry
        for section in (parts.joints, parts.links, parts.loads, parts.bodies, parts.probes, parts.springs)
        for item in section.values()
        for entry in (spring_ends(item) if section is parts.springs else [item])
        if entry.record is not None and link_of(entry) not in others
    ]
    yield from off_plane(entries, f"the other points of {here}")


def link_of(entry: Entry) -> str | None:
    """The link that an entry is, or is on; none for a joint."""
    if entry.where[0] == "springs":
        return str(entry.record.link)
    return entry.name if entry.where[0] == "links" else entry.word("link")


def analysis_faults(parts: Parts) -> Iterator[str]:
    """An analysis whose end or step is missing, given twice or impossible with the drive."""
    analysis = parts.analysis
    if not analysis.raw and analysis.record is None:
        return
    if analysis.has("revolutions") and analysis.has("end_time"):
        yield analysis.fault("revolutions", "cannot be combined with end_time, got both")
    if not analysis.has("revolutions") and not analysis.has("end_time") and not _repeats(parts):
        key, wanted = (
            ("revolutions", "is required, or end_time [s]")
            if parts.driven
            else ("end_time", "is required [s]")
        )
        yield analysis.fault(key, f"{wanted}, got {'neither' if parts.driven else 'nothing'}")
    if analysis.has("step") and analysis.has("steps_per_revolution"):
        yield analysis.fault("step", "cannot be combined with steps_per_revolution, got both")
    if parts.driven:
        yield from open_fidelity_faults(parts)
    drives = [drive for drive in parts.all_drives if drive.record is not None]
    for drive in drives:
        yield from drive_table_faults(parts, drive)
    if len(parts.all_drives) == 1:
        for drive in drives:
            yield from drive_and_analysis_faults(parts, drive)
    elif drives:
        got = f"{len(parts.all_drives)} drives"
        yield from steps_faults(parts, got, "one drive that goes on turning", "several drives")


def _repeats(parts: Parts) -> bool:
    """Whether the end need not be given: of a structure in static balance, or where the drive's law says after which time
    it repeats itself, and the motion of one period is asked for.
    """
    if not parts.all_drives:
        return parts.analysis.word("kind") == "static"
    drives = [drive.record for drive in parts.all_drives]
    known = len(drives) == 1 and drives[0] is not None and cycle(drives[0].motion) is not None
    return parts.analysis.word("kind") in {"steady", *WITHOUT_VIBRATION} and known


def open_fidelity_faults(parts: Parts) -> Iterator[str]:
    """Links left open without saying for which accuracy."""
    for link in parts.links.values():
        if link.word("fidelity") == "auto" and parts.analysis.word("accuracy") == "quick":
            yield link.fault("fidelity", "needs an analysis.accuracy, e.g. 0.01, got 'quick' for 'auto'")


def drive_and_analysis_faults(parts: Parts, drive: Entry) -> Iterator[str]:
    """An analysis that does not suit the law of motion of the only drive."""
    motion, joint = drive.record.motion, parts.joints.get(drive.record.joint)
    if joint is not None and joint.word("kind") == "prismatic":
        yield from steps_faults(parts, "one on a prismatic joint")
    elif turning_speed(motion) == 0.0:
        still = isinstance(motion, (ConstantSpeed, Ramp))
        yield from steps_faults(parts, "speed 0" if still else f"{motion.kind!r}")


def steps_faults(
    parts: Parts, got: str, wanted: str = "a drive that goes on turning",
    doing: str = "a drive that does not go on turning",
) -> Iterator[str]:  # fmt: skip
    """Turns that are asked for where there are none, and a step that is not given."""
    analysis = parts.analysis
    for key, instead in (("revolutions", "end_time"), ("steps_per_revolution", "step")):
        if analysis.has(key):
            yield analysis.fault(key, f"needs {wanted} (else {instead} [s]), got {got}")
    stated = any(analysis.has(key) for key in ("step", "steps_per_revolution"))
    if not stated and analysis.word("accuracy") == "quick":
        yield analysis.fault("step", f"is required with {doing} [s], got {got}")


def drive_table_faults(parts: Parts, drive: Entry) -> Iterator[str]:
    """A motion table that does not cover the analysis or is too rough for it; a dwell without a return."""
    motion = drive.record.motion
    stays = isinstance(motion, (Cycloidal, Polynomial)) and motion.return_time is None
    if stays and motion.dwell_after > 0.0:
        yield drive.fault("motion", "must be combined with return_time, got no return", "dwell_after")
    if not isinstance(motion, Table) or not motion.time:
        return
    if motion.time[0] > 0.0:
        wanted = f"must begin at 0 or before [s], got {motion.time[0]:.6g}"
        yield drive.fault("motion", wanted, "time")
    end = parts.analysis.record.end_time if parts.analysis.record is not None else None
    if end is not None and end > motion.time[-1] * (1.0 + 1e-9):
        wanted = f"must reach the end of the analysis {end:.6g} [s]"
        yield drive.fault("motion", f"{wanted}, got {motion.time[-1]:.6g}", "time")
    noise, share = table_noise(motion)
    if motion.smooth is None and share > ROUGH:
        key, unit = ("travel", "m") if motion.travel else ("angle", "rad")
        wanted = "must be smooth enough for its acceleration to shake nothing (more digits, or smooth"
        got = f"got values that scatter by {noise:.2g} [{unit}], {100 * share:.0f} % of the acceleration"
        yield drive.fault("motion", f"{wanted} = {2 * noise:.1g}), {got}", key)


def file_faults(parts: Parts) -> Iterator[str]:
    """Files of shapes that are missing, and parts that do not fit between their points."""
    for link in parts.links.values():
        shape = link.record.shape if link.record is not None else None
        if isinstance(shape, MeshFile) and not (parts.folder / shape.file).is_file():
            yield link.fault(
                "shape", f"must be a mesh file, got nothing at {parts.folder / shape.file}", "file"
            )
        if isinstance(shape, Cad) and not (parts.folder / shape.file).is_file():
            key, inner = ("step", ()) if link.has("step") else ("shape", ("file",))
            yield link.fault(key, f"must be a CAD file, got nothing at {parts.folder / shape.file}", *inner)
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
