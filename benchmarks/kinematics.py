"""Rigid motion of all time points together, against Newton from one time point to the next, in one run."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.pages import script, table, write_page
from kedfem.motion.batch import RowSelection, newton_solution
from kedfem.motion.linkage import Linkage, linkage, resting_poses
from kedfem.motion.newton import target
from kedfem.motion.path import Path as MotionPath
from kedfem.motion.path import path
from kedfem.motion.rigid import rigid_motion
from kedfem.motion.values import features
from kedfem.scene import Scene, scene_from

POINTS, LITERAL_POINTS, REPEATS = 20_000, 300, 9
Z, X = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]


def bench_kinematics(folder: Path, quick: bool) -> None:
    """Microseconds a time point of three linkages, and the greatest difference of accelerations; table to the folder."""
    rows = []
    scenes = {"four-bar": four_bar, "RSSR": rssr, "six links, two loops": six_bar}
    for name, scene in scenes.items():
        got = _measured(scene(), POINTS // 10 if quick else POINTS)
        rows.append((
            name, str(got.unknowns), str(got.rows), f"{got.batch:.1f}", f"{got.monolithic:.0f}",
            f"{got.monolithic / got.batch:.0f}", f"{1e3 * got.path:.0f}", f"{got.difference:.0e}",
        ))  # fmt: skip
    header = ("linkage", "unknowns", "rows", "together [µs/point]", "one by one [µs/point]", "ratio", "path [ms]",
              "accelerations differ by")  # fmt: skip
    write_page(folder, "performance/kinematics", [table(header, rows)])


@dataclass(frozen=True, slots=True)
class _Measured:
    """Sizes, microseconds a point of both ways, seconds of the path, relative difference of accelerations."""

    unknowns: int
    rows: int
    batch: float
    monolithic: float
    path: float
    difference: float


def _measured(scene: Scene, points: int) -> _Measured:
    link = linkage(scene)
    along = path(link, 0.0, 6.3)
    followed = min(_time(partial(path, link, 0.0, 6.3 + k)) for k in range(1, REPEATS))  # none is kept
    tau = np.linspace(0.0, 2 * np.pi, points)
    drive = (tau, np.ones(points), np.zeros(points))
    batch = min(_time(lambda: rigid_motion(link, along, tau, drive)) for _ in range(REPEATS)) / points
    few = np.linspace(0.0, 2 * np.pi * LITERAL_POINTS / 720, LITERAL_POINTS)
    monolithic = _time(lambda: _one_by_one(link, along, few)) / LITERAL_POINTS
    motion = rigid_motion(link, along, few, (few, np.ones(len(few)), np.zeros(len(few))))
    slow = _one_by_one(link, along, few)
    difference = float(np.abs(slow - motion.alpha).max() / np.abs(motion.alpha).max())
    unknowns = 6 * (len(link.bodies) - 1)
    return _Measured(unknowns, link.rows.count, 1e6 * batch, 1e6 * monolithic, followed, difference)


def _time(work: Callable[[], object]) -> float:
    since = process_time()
    work()
    return process_time() - since


def _one_by_one(link: Linkage, along: MotionPath, tau: np.ndarray) -> np.ndarray:
    """Angular accelerations by Newton from each point to the next."""
    poses, near, out = resting_poses(len(link.bodies)), along.near[:1], []
    for each in tau:
        at = np.array([each])
        got = newton_solution(link, RowSelection(link.rows), poses, target(link, at, near), link.drives.at(at)[1:])
        poses, near = got.poses, features(link.rows, got.poses, near).value[link.rows.angles].T
        out.append(got.second[1][0])
    return np.stack(out)


# -- linkages ---------------------------------------------------------------------------------------------------


def _scene(joints: dict[str, tuple[Any, ...]]) -> Scene:
    """Small bars; joints as kind, link, link, place and further keys."""
    names = dict.fromkeys(link for joint in joints.values() for link in joint[1:3] if link != "ground")
    bar = {"kind": "bar", "between": [[0, 0, 0], [0.1, 0, 0]], "width": 0.01, "thickness": 0.01}
    return scene_from({
        "links": {name: {"material": "steel", "shape": bar} for name in names},
        "joints": {
            name: {"kind": kind, "links": [one, other], "at": [float(x) for x in at], **keys}
            for name, (kind, one, other, at, keys) in joints.items()
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1.0}},
        "analysis": {"revolutions": 1},
    })  # fmt: skip


def _dyad(P: np.ndarray, Q: np.ndarray, a: float, b: float) -> np.ndarray:
    """The point at distances a and b from P and Q, to the left of P → Q, z = 0."""
    d = Q - P
    s = np.linalg.norm(d)
    along = (a**2 - b**2 + s**2) / (2 * s)
    return np.asarray(P + along * d / s + np.sqrt(a**2 - along**2) * np.cross(Z, d) / s)


def _loop() -> dict[str, tuple[Any, ...]]:
    B, D = np.array([0.16, 0.26, 0.0]), np.array([0.9144, 0.0, 0.0])
    C = _dyad(B, D, 0.9144, 0.762)
    return {
        "A": ("revolute", "ground", "crank", np.zeros(3), {"axis": Z}),
        "B": ("revolute", "crank", "coupler", B, {"axis": Z}),
        "C": ("revolute", "coupler", "rocker", C, {"axis": Z}),
        "D": ("revolute", "rocker", "ground", D, {"axis": Z}),
    }


def four_bar() -> Scene:
    """Crank 0.305 m, coupler 0.9144 m, rocker 0.762 m, frame 0.9144 m: planar, in space, three rows too many."""
    return _scene(_loop())


def six_bar() -> Scene:
    """The same with a second dyad from the middle of its coupler to the ground: five moving links, six rows too many."""
    joints = _loop()
    E, F = (np.asarray(joints["B"][3]) + joints["C"][3]) / 2, np.array([0.3, 1.2, 0.0])
    G = _dyad(E, F, 0.7, 0.6)
    return _scene({
        **joints,
        "E": ("revolute", "coupler", "rod", E, {"axis": Z}),
        "G": ("revolute", "rod", "lever", G, {"axis": Z}),
        "F": ("revolute", "lever", "ground", F, {"axis": Z}),
    })  # fmt: skip


def rssr() -> Scene:
    """Crank 0.1 m about z, rocker 0.25 m about x; a ball at the crank, a cross at the rocker."""
    P, pivot = np.array([0.1, 0.0, 0.0]), np.array([0.3, -0.1, 0.25])
    Q = pivot + 0.25 * np.array([0.0, np.cos(1.0), np.sin(1.0)])
    arm = np.cross(Q - P, Z)
    axes = [[float(x) for x in arm], [float(x) for x in np.cross(arm, Q - P)]]
    return _scene({
        "A": ("revolute", "ground", "crank", np.zeros(3), {"axis": Z}),
        "B": ("spherical", "crank", "coupler", P, {}),
        "C": ("universal", "coupler", "rocker", Q, {"axes": axes}),
        "D": ("revolute", "rocker", "ground", pivot, {"axis": X}),
    })  # fmt: skip


if __name__ == "__main__":
    script(bench_kinematics)
