"""Assembly of links that are given slightly apart: the smallest rigid motions that close all joints."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.errors import MotionError
from kedfem.motion.closed import RigidDisplacement, closed_scene
from kedfem.motion.constraints import GAP, ConstraintEquation, Rows, stacked
from kedfem.motion.joint_equations import GROUND, scene_centre, undriven_rows
from kedfem.motion.linkage import scene_size
from kedfem.motion.newton import cross_matrix, rotation
from kedfem.motion.period import over_one_period
from kedfem.motion.released_motions import RANK_TOLERANCE
from kedfem.motion.values import Poses, features, jacobian, residuals
from kedfem.scene import Scene

MOST = 0.01  # of the linkage's size: larger misfits are mistakes in the scene
CLOSED = 1e-12  # of the size, and in radians: tolerance of closed joints
ROUNDING = 1e-13  # of the size, and in radians: smaller motions are rounding, as out of a linkage's plane
ITERATIONS = 60
Change = Float[np.ndarray, "n 6"]


@dataclass(frozen=True, slots=True)
class Assembly:
    """Motions of links that closed their joints; empty if no links were given apart.

    misfits : by joint [m], how far its links were given apart in the directions that it constrains
    moved : by link, largest displacement of its joints' points [m], and rotation [rad]
    """

    misfits: dict[str, float] = field(default_factory=dict)
    moved: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def worst(self) -> tuple[str, float]:
        """The joint whose links were given farthest apart, and how far [m]."""
        return max(self.misfits.items(), key=lambda each: each[1])


def assembled(scene: Scene) -> tuple[Scene, Assembly]:
    """A scene for analysis, with all joints closed, and their assembly; of a steady motion over its period.

    Raises
    ------
    MotionError
        Joints that cannot be closed.
    SceneError
        A steady motion that has no period.
    """
    closed, assembly = _closed(scene)
    return over_one_period(closed), assembly


def _closed(scene: Scene) -> tuple[Scene, Assembly]:
    """A scene with all joints closed; the scene itself where no links are given apart.

    Links are moved as rigid bodies with everything attached, by the motions that satisfy the equations of joints and
    couplings with the least Σ |d|²/size² + |θ|², d the displacement of the mean of a link's joints, θ its rotation. The
    drive's angle then counts from the closed position.

    Raises
    ------
    MotionError
        A misfit above 1 % of the linkage's size, joints that no small motions close, or plane shapes that would have
        to be tilted.
    """
    if not any(joint.open for joint in scene.joints.values()):
        return scene, Assembly()
    rows, size = undriven_rows(scene), scene_size(scene)
    misfits = _misfits(scene, rows)
    if too_far := [name for name, misfit in misfits.items() if misfit > MOST * size]:
        wanted = f"must be one point for both links, up to 1 % of the linkage's size {size:.6g} [m]"
        raise MotionError("\n".join(_refusal(scene, name, wanted, misfits[name]) for name in too_far))
    centres = _centres(scene)
    change, left = least_change(stacked(rows), centres, size)
    open_rows = np.flatnonzero(~(left <= CLOSED))
    if len(open_rows):
        still = ", ".join(dict.fromkeys(rows[k].joint for k in open_rows))
        wanted = f"must be a point to which small motions of the links bring both [m] (open still: {still})"
        raise MotionError("\n".join(_refusal(scene, name, wanted, misfit) for name, misfit in misfits.items()))
    middle = scene_centre(scene)
    shifts = {
        name: RigidDisplacement(c + middle, size * x[:3], x[3:])
        for name, c, x in zip(scene.links, centres, change, strict=True)
    }
    moved = {}
    for name, shift in shifts.items():
        went = [float(np.linalg.norm(np.subtract(shift.point(at), at))) for at in _points(scene, name)]
        moved[name] = max(went, default=0.0), float(np.linalg.norm(shift.theta))
    return closed_scene(scene, shifts), Assembly(misfits, moved)


def assembly_warning(assembly: Assembly) -> tuple[str, ...]:
    """The warning of links that were moved; empty without any."""
    if not assembly.misfits:
        return ()
    (joint, misfit), way = assembly.worst, max(assembly.moved.values())[0]
    several = "" if len(assembly.misfits) == 1 else f", the most of {len(assembly.misfits)} joints"
    return (
        f"joints.{joint}: its links are given {misfit:.3g} m apart{several}; "
        f"closed by moving links up to {way:.3g} m (kedfem check shows which)",
    )


def least_change(rows: Rows, centres: Float[np.ndarray, "n 3"], size: float) -> tuple[Change, Float[np.ndarray, " m"]]:
    """Least-norm displacements (of centres, in units of size) and rotation vectors of n bodies that satisfy all rows.

    Each iteration solves J(x) x⁺ = J(x) x − r(x) with least |x⁺|. At convergence r = 0 and x is in the span of Jᵀ.

    Returns
    -------
    (n, 6); and (m,) residuals of the rows, in units of size and radians, infinite where iterations have not converged
    """
    x, scale = np.zeros((len(centres), 6)), rows.scale(size)[: rows.count]
    for _ in range(ITERATIONS):
        J, r = _linearised(rows, x, centres, size)
        if not np.isfinite(J).all() or np.abs(x).max() > 1:
            return x, np.full(rows.count, np.inf)
        new = scipy.linalg.lstsq(J, J @ x.ravel() - r, cond=RANK_TOLERANCE)[0].reshape(x.shape)
        step, x = float(np.abs(new - x).max()), new
        if step <= ROUNDING / 100:
            break
    x = np.where(np.abs(x) < ROUNDING, 0.0, x)
    f = features(rows, _poses(x, centres, size))
    return x, np.asarray(np.abs(residuals(rows, f, np.zeros((1, 0)))[0] * scale))


def _linearised(
    rows: Rows, x: Change, centres: Float[np.ndarray, "n 3"], size: float
) -> tuple[Float[np.ndarray, "m k"], Float[np.ndarray, " m"]]:
    """Derivatives of scaled rows by displacements and rotation vectors, and their values."""
    poses = _poses(x, centres, size)
    f = features(rows, poses)
    J = jacobian(rows, f, len(x) + 1, size)[0].reshape(rows.count, len(x), 6)
    turning = _rotation_rates(x[:, 3:])  # ω = T θ', and v = d' − ω × R c
    arms = cross_matrix((poses[0][0, 1:] @ centres[..., None])[..., 0] / size)
    by_theta = np.einsum("mbi,bij->mbj", J[..., :3], arms @ turning)
    by_theta += np.einsum("mbi,bij->mbj", J[..., 3:], turning)
    values = residuals(rows, f, np.zeros((1, 0)))[0] * rows.scale(size)[: rows.count]
    return np.concatenate([J[..., :3], by_theta], axis=2).reshape(rows.count, -1), values


def _poses(x: Change, centres: Float[np.ndarray, "n 3"], size: float) -> Poses:
    """Poses of all bodies, the ground first."""
    R = np.concatenate([np.eye(3)[None], rotation(x[:, 3:])])
    p = np.zeros((len(x) + 1, 3))
    p[1:] = size * x[:, :3] - ((R[1:] - np.eye(3)) @ centres[..., None])[..., 0]
    return R[None], p[None]


def _rotation_rates(theta: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """T of ω = T θ', for exp([θ]×): I + (1 − cos θ)/θ² [θ]× + (θ − sin θ)/θ³ [θ]×²."""
    angle, W = np.linalg.norm(theta, axis=1)[:, None, None], cross_matrix(theta)
    safe = np.maximum(angle, 1e-3)
    one = np.where(angle < 1e-3, 1 / 2 - angle**2 / 24, (1 - np.cos(safe)) / safe**2)
    two = np.where(angle < 1e-3, 1 / 6 - angle**2 / 120, (safe - np.sin(safe)) / safe**3)
    return np.asarray(np.eye(3) + one * W + two * (W @ W))


def _centres(scene: Scene) -> Float[np.ndarray, "n 3"]:
    """Mean of the points of each link's joints, from the linkage's centre [m]."""
    points = [list(_points(scene, name)) for name in scene.links]
    middle = scene_centre(scene)
    return np.array([np.mean(each, axis=0) - middle if each else np.zeros(3) for each in points])


def _points(scene: Scene, link: str) -> Iterator[tuple[float, float, float]]:
    """Points of the joints on a link [m]."""
    return (joint.on(link) for joint in scene.joints.values() if link in joint.links)


def _misfits(scene: Scene, rows: list[ConstraintEquation]) -> dict[str, float]:
    """Misfit of each joint whose links are given apart, in the directions that it constrains [m]."""
    bodies, square = (GROUND, *scene.links), {name: 0.0 for name, joint in scene.joints.items() if joint.open}
    for row in rows:
        if row.joint in square and row.kind == GAP and not row.plus:
            joint = scene.joints[row.joint]
            gap = np.subtract(joint.on(bodies[row.i]), joint.on(bodies[row.j]))
            square[row.joint] += float(gap @ row.b) ** 2
    return {name: float(np.sqrt(each)) for name, each in square.items()}


def _refusal(scene: Scene, name: str, wanted: str, misfit: float) -> str:
    """The refusal of one joint, with both of its points."""
    points = (
        f"({', '.join(f'{part:.6g}' for part in point)}) on {link!r}" for link, point in scene.joints[name].points.items()
    )
    return f"joints.{name}.at: {wanted}, got {' and '.join(points)}, {misfit:.4g} apart"
