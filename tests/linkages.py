"""Linkages as scenes, for tests of the rigid motion: the shapes of their links play no part in it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from kedfem.motion.batch import solved_motion
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import Path, path, predicted, target_on_path
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import Scene, path_parameter, scene_from

JointTable = Mapping[str, tuple[Any, ...]]  # name: kind, link, link, at[, axis; of a universal joint both axes]
UNIT_SPEED = {"kind": "constant_speed", "speed": 1.0}  # rad/s: time is the drive angle
RISE = {"kind": "cycloidal", "rise": 1.0}  # with an angle: a drive that speeds up and slows down within 1 s
Z = (0.0, 0.0, 1.0)


def linkage_scene(
    joints: JointTable,
    drive: str | None = "A",
    motion: Mapping[str, Any] | None = None,
    sliders: tuple[str, ...] = (),
    sections: Mapping[str, Any] | None = None,
    **analysis: Any,
) -> Scene:
    """A scene of joints alone; every link is a small bar at its first joint, sliders are rigid; drive may be None.

    sections : further sections of the scene, such as gears or drives
    """
    names = dict.fromkeys(link for joint in joints.values() for link in joint[1:3] if link != "ground")
    first = {link: np.asarray(j[3], float) for j in reversed(joints.values()) for link in j[1:3]}
    return scene_from(
        {
            "links": {name: {"model": "rigid"} if name in sliders else bar(first[name]) for name in names},
            "joints": {name: {**joint(*fields[:5]), **dict(*fields[5:])} for name, fields in joints.items()},
            "analysis": {"end_time": 1.0, "step": 0.01, **analysis},
            **(sections or {}),
            **({} if drive is None else {"drive": {"joint": drive, "motion": dict(motion or UNIT_SPEED)}}),
        }
    )


def bar(at: np.ndarray) -> dict[str, Any]:
    between = [list(at), list(at + np.array([0.1, 0.0, 0.0]))]
    return {"material": "steel", "shape": {"kind": "bar", "between": between, "width": 0.01, "thickness": 0.01}}


def joint(kind: str, one: str, other: str, at: Any, axis: Any = None) -> dict[str, Any]:
    fields = {"kind": kind, "links": [one, other], "at": [float(x) for x in at]}
    if axis is None:
        return fields
    if kind == "universal":
        return {**fields, "axes": [[float(x) for x in each] for each in axis]}
    return {**fields, "axis": [float(x) for x in axis]}


def moved_scene(joints: JointTable, R: np.ndarray, p: np.ndarray) -> dict[str, tuple[Any, ...]]:
    """The same joints, everything turned by R and shifted by p."""
    return {
        name: (kind, one, other, R @ np.asarray(at) + p, *(np.asarray(a) @ R.T for a in axis))
        for name, (kind, one, other, at, *axis) in joints.items()
    }


def motion_at(scene: Scene, t: np.ndarray) -> RigidMotion:
    """The rigid motion of a scene at given times."""
    drive = path_parameter(scene, t)
    link = linkage(scene)
    return rigid_motion(link, path(link, min(drive[0].min(), 0.0), max(drive[0].max(), 0.0)), t, drive)


def drive_rates(link: Linkage, along: Path, tau: np.ndarray, drive: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Rates of all bodies at places of a path per unit rate of one drive: v of what is drawn at the origin, and ω."""
    q = np.zeros((len(tau), len(link.drives)))
    q[:, drive] = 1.0
    got = solved_motion(link, along.rows, predicted(along, tau), target_on_path(link, along, tau), (q, 0 * q))
    v, omega = got.first
    return v - np.cross(omega, got.poses[0] @ link.centre), omega


def body(scene: Scene, name: str) -> int:
    """Number of a link in the motion, ground first."""
    return 1 + list(scene.links).index(name)


def place(motion: RigidMotion, number: int, X: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration (T, 3) of the point of a body that is drawn at X."""
    r = motion.R[:, number] @ X
    velocity = motion.v[:, number] + np.cross(motion.omega[:, number], r)
    return motion.p[:, number] + r, velocity, motion.p2[:, number] + motion.R2[:, number] @ X


def turned(motion: RigidMotion, number: int, axis: np.ndarray, other: int = 0) -> np.ndarray:
    """Angle (T,) by which a body has turned against another about an axis drawn in both, made continuous in time."""
    R = np.swapaxes(motion.R[:, other], 1, 2) @ motion.R[:, number]
    skew = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1) / 2
    return np.unwrap(np.arctan2(skew @ axis, (np.trace(R, axis1=1, axis2=2) - 1) / 2))


# -- planar -------------------------------------------------------------------------------------------------


def four_bar(a: float, b: float, c: float, d: float, angle: float) -> dict[str, tuple[Any, ...]]:
    """Crank a, coupler b, rocker c, frame d along x [m]; drawn at a crank angle [rad], C to the left of B → D."""
    A, D = np.zeros(3), np.array([d, 0.0, 0.0])
    B = a * np.array([np.cos(angle), np.sin(angle), 0.0])
    span = np.linalg.norm(D - B)
    along = (b**2 - c**2 + span**2) / (2 * span)
    e = (D - B) / span
    C = B + along * e + np.sqrt(b**2 - along**2) * np.array([-e[1], e[0], 0.0])
    return {
        "A": ("revolute", "ground", "crank", A, Z),
        "B": ("revolute", "crank", "coupler", B, Z),
        "C": ("revolute", "coupler", "rocker", C, Z),
        "D": ("revolute", "rocker", "ground", D, Z),
    }


def slider_crank(r: float, rod: float, angle: float) -> dict[str, tuple[Any, ...]]:
    """Crank r about the origin, slider on the x axis [m]; drawn at a crank angle [rad]."""
    B = r * np.array([np.cos(angle), np.sin(angle), 0.0])
    C = np.array([B[0] + np.sqrt(rod**2 - B[1] ** 2), 0.0, 0.0])
    return {
        "A": ("revolute", "ground", "crank", np.zeros(3), Z),
        "B": ("revolute", "crank", "rod", B, Z),
        "C": ("revolute", "rod", "slider", C, Z),
        "guide": ("prismatic", "slider", "ground", C, (1.0, 0.0, 0.0)),
    }


# -- in space -----------------------------------------------------------------------------------------------


def denavit_hartenberg(a: np.ndarray, alpha: np.ndarray, theta: np.ndarray) -> list[np.ndarray]:
    """Frames (4, 4) at the joints of a loop without offsets: Rz(θ) Tx(a) Rx(α) from one to the next; the last closes."""
    frames = [np.eye(4)]
    for length, twist, angle in zip(a, alpha, theta, strict=True):
        c, s, ct, st = np.cos(angle), np.sin(angle), np.cos(twist), np.sin(twist)
        step = np.array(
            [[c, -s * ct, s * st, length * c], [s, c * ct, -c * st, length * s], [0, st, ct, 0], [0, 0, 0, 1]]
        )
        frames.append(frames[-1] @ step)
    return frames


def revolute_loop(a: np.ndarray, alpha: np.ndarray, theta: np.ndarray) -> dict[str, tuple[Any, ...]]:
    """A closed loop of revolutes A, B, C…; link1 is between A and B, the last link is the ground."""
    frames = denavit_hartenberg(a, alpha, theta)
    gap = np.abs(frames[-1] - np.eye(4)).max()
    if gap > 1e-12:
        raise ValueError(f"the loop is open by {gap:.3g}")
    links = ["ground", *(f"link{k}" for k in range(1, len(a))), "ground"]
    return {
        "ABCDEF"[k]: ("revolute", links[k], links[k + 1], frame[:3, 3], frame[:3, 2])
        for k, frame in enumerate(frames[:-1])
    }


def bennett(alpha: float, beta: float, theta: float) -> tuple[dict[str, tuple[Any, ...]], float, float]:
    """Four skew revolutes, a = 0.3 m, a / sin α = b / sin β, and θ1: their table, θ2 and tan(θ1/2) tan(θ2/2)."""
    a, b = 0.3, 0.3 * np.sin(beta) / np.sin(alpha)
    K = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    t2 = 2 * np.arctan2(K * np.cos(theta / 2), np.sin(theta / 2))
    every = np.array([[a, b, a, b], [alpha, beta, alpha, beta], [theta, t2, -theta, -t2]])
    return revolute_loop(*every), t2, K


def cardan(beta: float) -> dict[str, tuple[Any, ...]]:
    """Shafts along x and at β to it in the xy plane; the cross's arm in the first fork drawn within that plane."""
    out = np.array([np.cos(beta), np.sin(beta), 0.0])
    centre = np.zeros(3)
    return {
        "A": ("revolute", "ground", "shaft1", -np.array([0.2, 0, 0]), (1.0, 0.0, 0.0)),
        "B": ("revolute", "shaft1", "cross", centre, (0.0, 1.0, 0.0)),
        "C": ("revolute", "cross", "shaft2", centre, Z),
        "D": ("revolute", "shaft2", "ground", 0.2 * out, out),
    }


def spatial_slider_crank(angle: float) -> dict[str, tuple[Any, ...]]:
    """Crank 0.08 about an axis along x at heights y = 0.1, z = 0.12; rod 0.3; slider on the x axis [m]."""
    B = np.array([0.0, 0.1 - 0.08 * np.sin(angle), 0.12 + 0.08 * np.cos(angle)])
    C = np.array([np.sqrt(0.3**2 - B @ B), 0.0, 0.0])
    y = np.array([0.0, 1.0, 0.0])
    across = np.cross(y, C - B)
    return {
        "A": ("revolute", "ground", "crank", (0.0, 0.1, 0.12), (1.0, 0.0, 0.0)),
        "B": ("spherical", "crank", "rod", B),
        "C1": ("revolute", "rod", "cross", C, across),
        "C2": ("revolute", "cross", "slider", C, y),
        "guide": ("prismatic", "slider", "ground", C, (1.0, 0.0, 0.0)),
    }


RSSR_CRANK, RSSR_ROCKER, RSSR_PIVOT = 0.1, 0.25, np.array([0.3, -0.1, 0.25])


def rssr_points(phi: np.ndarray, psi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ball centres of crank (about z at the origin) and rocker (about x at its pivot), (..., 3) [m]."""
    zero = np.zeros_like(phi)
    P = RSSR_CRANK * np.stack([np.cos(phi), np.sin(phi), zero], axis=-1)
    Q = RSSR_PIVOT + RSSR_ROCKER * np.stack([zero, np.cos(psi), np.sin(psi)], axis=-1)
    return P, Q


def rssr(psi: float, ball: bool = False) -> dict[str, tuple[Any, ...]]:
    """Revolute, ball, universal joint (a cross body; or a second ball), revolute; drawn at φ = 0 and a rocker angle."""
    P, Q = rssr_points(np.zeros(()), np.asarray(psi))
    arm = np.cross(Q - P, [0.0, 0.0, 1.0])
    ends: dict[str, tuple[Any, ...]] = {
        "C1": ("revolute", "coupler", "cross", Q, arm),
        "C2": ("revolute", "cross", "rocker", Q, np.cross(arm, Q - P)),
    }
    if ball:
        ends = {"C": ("spherical", "coupler", "rocker", Q)}
    return {
        "A": ("revolute", "ground", "crank", np.zeros(3), Z),
        "B": ("spherical", "crank", "coupler", P),
        **ends,
        "D": ("revolute", "rocker", "ground", RSSR_PIVOT, (1.0, 0.0, 0.0)),
    }
