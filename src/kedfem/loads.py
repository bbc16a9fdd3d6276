"""Loads of joints and drives, from a results file: tables and polar diagrams for suppliers of bearings and motors."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.prepared import moving
from kedfem.arrays import Bool
from kedfem.errors import KedfemError, OutputError
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.output.load_files import write_drive_load, write_joint_load, write_polar, write_summary
from kedfem.results import Results, read_results, ready_folder, results_file
from kedfem.results.forces.loads import (
    DriveLoad,
    JointLoad,
    drive_loads,
    drive_summary,
    joint_loads,
    last_revolutions,
    summary,
)
from kedfem.scene import Scene, path_parameter, scene_from

JOINTS, DRIVES = "joints.csv", "drives.csv"


@dataclass(frozen=True, slots=True)
class Loads:
    """The outcome of `loads`.

    folder : where tables and diagrams are
    joints, drives : name → numbers, by what they are with their unit
    warnings : what is not known, and why
    """

    folder: FilePath
    joints: Mapping[str, Mapping[str, float]]
    drives: Mapping[str, Mapping[str, float]]
    warnings: tuple[str, ...]


def loads(file: FilePath, last: float | None = None, folder: FilePath | None = None) -> Loads:
    """Write the loads of all joints and drives of a run, or of `kedfem kinematics`.

    Parameters
    ----------
    file : `results.h5`, or the folder that has it
    last : revolutions of the drive at the end that count; all if not given
    folder : where all goes; `loads` beside the results if not given

    Raises
    ------
    KedfemError
        With a message for the user.
    """
    path = results_file(file)
    results = read_results(path)
    _refuse(path, results, last)
    scene = scene_from(json.loads(results.scene_json), path.parent.parent)
    rows = last_revolutions(results, last)
    joints, drives, why = loads_of(scene, results)
    if not joints and not drives:
        raise OutputError(f"{path}: must have forces of joints or of a drive, got none")
    target = ready_folder(folder or path.parent / "loads")
    for joint in joints:
        write_joint_load(target / f"joint {joint.joint}.csv", joint, results, rows)
        write_polar(target / f"joint {joint.joint}.png", joint, rows)
    for drive in drives:
        write_drive_load(target / f"drive {drive.name}.csv", drive, results, rows)
    tables = summaries(joints, drives, results, rows)
    write_summary(target / JOINTS, "joint", tables[0])
    write_summary(target / DRIVES, "drive", tables[1])
    return Loads(target, *tables, (*why, *_missing(scene, joints), *_partial(results)))


def loads_of(scene: Scene, results: Results) -> tuple[list[JointLoad], list[DriveLoad], tuple[str, ...]]:
    """Of all joints and drives whose forces the results show, over time; and what is not known of them, and why."""
    moved, why = _moved(scene, results)
    return joint_loads(scene, results, moved), drive_loads(scene, results, moved), why


def summaries(
    joints: list[JointLoad], drives: list[DriveLoad], results: Results, rows: Bool[np.ndarray, " T"]
) -> tuple[dict[str, Mapping[str, float]], dict[str, Mapping[str, float]]]:
    """Numbers of all joints and drives."""
    return (
        {each.joint: summary(each, results, rows) for each in joints},
        {each.name: drive_summary(each, results, rows) for each in drives},
    )


def _refuse(path: FilePath, results: Results, last: float | None) -> None:
    """Results without rows; revolutions of what makes none."""
    if not len(results.time):
        raise OutputError(f"{path}: must have rows, got none: the run was {results.status}")
    if missing := thinned(results):
        raise OutputError(f"{path}: {missing}")
    if last is None:
        return
    if not last > 0:
        raise OutputError(f"--last: must be positive, got {last:g}")
    if results.drive.unit != "rad":
        raise OutputError("--last: counts revolutions of the drive, got a drive that slides: leave it out")


def thinned(results: Results) -> str:
    """Why loads of results are not found that have not the rows of all steps; "" of others."""
    if results.every == 1:
        return ""
    wanted = "must have the rows of all steps for loads, which are means and extremes"
    return f"{wanted}, got those of one step in {results.every} (output.every)"


def _moved(scene: Scene, results: Results) -> tuple[tuple[Linkage, RigidMotion] | None, tuple[str, ...]]:
    """The rigid motion at the rows of the results; None where it is not known, with the reason."""
    left = "loads are in the world's axes alone, without bearing loads and power"
    if scene.driven is None:
        return None, (f"without a drive the links' orientation is not in the results: {left}",)
    try:
        linked, along = moving(scene)
        if linked.mobility:
            return None, (f"beside the drive links move freely ({linked.mobility}): {left}",)
        motion = rigid_motion(linked, along, results.time, path_parameter(scene, results.time))
    except KedfemError as error:
        return None, (f"the rigid motion cannot be found again ({error}): {left}",)
    return (linked, motion), ()


def _missing(scene: Scene, found: list[JointLoad]) -> tuple[str, ...]:
    """Joints whose force is not reported."""
    left = sorted(set(scene.joints) - {each.joint for each in found})
    return (f"forces of joints {', '.join(left)} are not in the results, or not whole",) if left else ()


def _partial(results: Results) -> tuple[str, ...]:
    """Of a run that was not whole."""
    if results.status == "complete":
        return ()
    why = f" ({results.reason})" if results.reason else ""
    return (f"the run is {results.status} after {len(results.time)} rows{why}: loads are of these",)
