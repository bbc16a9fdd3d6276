"""The links' rigid motion as a table."""

from pathlib import Path

from kedfem.accuracy.prepared import moving
from kedfem.accuracy.variants import moved
from kedfem.dynamics.rigid_body import all_motions
from kedfem.export.files import require_ending
from kedfem.motion.assembly import assembled, assembly_warning
from kedfem.motion.counted_revolutions import require_counted
from kedfem.output.motion_file import write_motion
from kedfem.scene import Scene


def export_motion(scene: Scene, path: Path) -> tuple[int, tuple[str, ...]]:
    """Write the rigid-body motion of all links at all time points as comma-separated values; rows, warnings.

    Raises
    ------
    KedfemError
        The file does not end in .csv or cannot be written, the scene has no drive, or the mechanism cannot move so far.
    """
    require_ending(path, (".csv",))
    scene, assembly = assembled(moved(scene))
    linked, along = moving(scene)
    require_counted(scene, linked, along)
    count = write_motion(path, scene, linked, (motion for _, motion in all_motions(scene, linked, along)))
    held = f"free motions ({linked.mobility}) are held in the reference position"
    free = (held,) if linked.mobility else ()
    return count, (*assembly_warning(assembly), *free)
