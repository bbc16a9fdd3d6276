"""Cross checks of the analysis and its drive."""

from __future__ import annotations

from collections.abc import Iterator

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Entry, Parts
from kedfem.scene.questions.laws import table_noise
from kedfem.scene.questions.timing import cycle, turning_speed
from kedfem.scene.records.analysis import WITHOUT_VIBRATION
from kedfem.scene.records.drives import ConstantSpeed, Cycloidal, Polynomial, Ramp, Table

ROUGH = 0.05  # share of a table's acceleration that may be noise


def analysis_faults(parts: Parts) -> Iterator[Fault]:
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
        yield from open_model_faults(parts)
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


def open_model_faults(parts: Parts) -> Iterator[Fault]:
    """Models left open without saying for which accuracy."""
    for link in parts.links.values():
        if link.word("model") == "auto" and parts.analysis.word("accuracy") == "quick":
            yield link.fault("model", "needs an analysis.accuracy, e.g. 0.01, got 'quick' for 'auto'")


def drive_and_analysis_faults(parts: Parts, drive: Entry) -> Iterator[Fault]:
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
) -> Iterator[Fault]:  # fmt: skip
    """Turns that are asked for where there are none, and a step that is not given."""
    analysis = parts.analysis
    for key, instead in (("revolutions", "end_time"), ("steps_per_revolution", "step")):
        if analysis.has(key):
            yield analysis.fault(key, f"needs {wanted} (else {instead} [s]), got {got}")
    stated = any(analysis.has(key) for key in ("step", "steps_per_revolution"))
    if not stated and analysis.word("accuracy") == "quick":
        yield analysis.fault("step", f"is required with {doing} [s], got {got}")


def drive_table_faults(parts: Parts, drive: Entry) -> Iterator[Fault]:
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
