"""Rigid motion of spatial and over-constrained linkages; the closed forms are cases of kinematics.py."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.motion.linkage import linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene
from tests.linkages import (
    RISE,
    JointTable,
    body,
    cardan,
    denavit_hartenberg,
    four_bar,
    linkage_scene,
    motion_at,
    place,
    revolute_loop,
    rssr,
    slider_crank,
    spatial_slider_crank,
    turned,
)
from tests.spatial_linkages import (
    double_cardan,
    inverted_slider_crank,
    offset_cardan,
    oldham,
    quick_return,
    universal_rssr,
    universal_slider_crank,
)

RIGHT = np.pi / 2
# central differences of order 8, e.g. Fornberg, Math. Comp. 51 (1988) 699, table 1
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])


def threefold_bricard() -> JointTable:
    """Equal lengths, twists ±90°, at θ = 0.6; the second angle from cos θ + cos φ + cos θ cos φ = 0."""
    second = np.arccos(-np.cos(0.6) / (1 + np.cos(0.6)))
    return revolute_loop(np.full(6, 0.3), np.array([RIGHT, -RIGHT] * 3), np.array([0.6, second] * 3))


LINKAGES: dict[str, Callable[[], JointTable]] = {
    "four-bar": lambda: four_bar(0.3048, 0.9144, 0.762, 0.9144, 1.0),
    "slider-crank": lambda: slider_crank(0.1, 0.3, 0.7),
    "spatial slider-crank": lambda: spatial_slider_crank(0.3),
    "cardan": lambda: cardan(0.6),
    "rssr": lambda: rssr(1.0),
    "bricard": threefold_bricard,
    "quick-return, slot": lambda: quick_return(0.1, 0.25, 0.4),
    "quick-return, block": lambda: quick_return(0.1, 0.25, 0.4, block=True),
    "inverted slider-crank": lambda: inverted_slider_crank(0.1, 0.3, 1.2),
    "universal slider-crank": lambda: universal_slider_crank(0.3),
    "universal rssr": lambda: universal_rssr(1.0),
    "double cardan": lambda: double_cardan(0.6, crossed=True),
    "oldham": lambda: oldham(0.04, 0.5, "planar"),
    "rccc": lambda: offset_cardan(0.6),
}


@pytest.fixture(params=LINKAGES)
def scene(request: pytest.FixtureRequest) -> Scene:
    """Each linkage, driven by 1 rad within 1 s: speed and acceleration of the drive both vary."""
    joints = LINKAGES[request.param]()
    sliders = ("slider",) if "guide" in joints else ()
    return linkage_scene(joints, motion={**RISE, "angle": 1.0}, sliders=sliders)


def test_velocities_and_accelerations_are_the_differences_of_the_motion(scene: Scene) -> None:
    """Order 8 at 5 ms: truncation (ωh)⁸/630 ~ 1e-11 with ω ~ 4π, rounding 1e-15/h² ~ 4e-11."""
    h = 5e-3
    t = np.arange(4, 197) * h  # all stencils inside the smooth law
    m = motion_at(scene, t)
    inner = slice(4, -4)

    def differences(x: np.ndarray, stencil: np.ndarray) -> np.ndarray:
        count = len(x)
        return sum(c * x[k : count - 8 + k] for k, c in enumerate(stencil))

    scale = np.abs(m.R2).max()
    assert_allclose(differences(m.R, SECOND) / h**2, m.R2[inner], atol=1e-9 * scale)
    assert_allclose(differences(m.p, SECOND) / h**2, m.p2[inner], atol=1e-9 * scale)
    assert_allclose(differences(m.p, FIRST) / h, m.v[inner], atol=1e-10 * scale)
    spin = np.cross(m.omega[:, :, None, :], np.swapaxes(m.R, 2, 3))[inner]  # rows: ω × columns of R
    assert_allclose(differences(m.R, FIRST) / h, np.swapaxes(spin, 2, 3), atol=1e-10 * scale)
    assert_allclose(differences(m.omega, FIRST) / h, m.alpha[inner], atol=1e-10 * scale)


def test_joints_stay_closed_and_links_rigid(scene: Scene) -> None:
    """Both links of a joint agree on its point, axis and their rates at all times, to rounding."""
    m = motion_at(scene, np.linspace(0, 1, 101))
    identity = m.R @ np.swapaxes(m.R, 2, 3)
    assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-13)
    for joint in scene.joints.values():
        one, other = (body(scene, name) if name != "ground" else 0 for name in joint.links)
        apart = np.subtract(*(place(m, k, np.array(joint.at)) for k in (one, other)))  # and its rates
        R_i, R_j = m.R[:, one], m.R[:, other]
        if joint.kind in {"revolute", "spherical", "universal"}:
            assert_allclose(apart, np.zeros_like(apart), atol=1e-11)  # accelerations of up to 100 m/s²
        if joint.kind == "universal":
            assert joint.axes is not None
            a, b = R_i @ np.array(joint.axes[0]), R_j @ np.array(joint.axes[1])
            assert_allclose(np.einsum("tk,tk->t", a, b), np.zeros(len(a)), atol=1e-13)
        if joint.kind == "prismatic":
            assert_allclose(R_i, R_j, atol=1e-13)
        if joint.axis is None:
            continue
        axis = R_j @ np.array(joint.axis)
        if joint.kind != "slot":
            assert_allclose(R_i @ np.array(joint.axis), axis, atol=1e-13)
        if joint.kind in {"prismatic", "cylindrical", "slot"}:
            assert_allclose(np.cross(apart[0], axis), np.zeros_like(axis), atol=1e-13)
        if joint.kind == "planar":
            assert_allclose(np.einsum("tk,tk->t", apart[0], axis), np.zeros(len(axis)), atol=1e-13)


def test_a_million_steps_do_not_drift() -> None:
    """Quick-return at 3° a step, 8333 revolutions: every 487th step, and all of the last one, against the closed form."""
    step, r, d = np.radians(3.0), 0.1, 0.25
    k = np.union1d(np.arange(0, 10**6 + 1, 487), np.arange(10**6 - 120, 10**6 + 1))
    scene = linkage_scene(quick_return(r, d, 0.4, block=True))
    m = motion_at(scene, k * step)
    pin = 1j * d + r * np.exp(1j * (0.4 + (k % 120) * step))  # whole revolutions are taken off exactly
    arm, block = (body(scene, name) for name in ("arm", "block"))
    angle = np.angle(pin / pin[0])
    rounded = 2 * np.spacing(1e6 * step)  # of the angle of the drive at the end: 1e-11 rad
    assert_allclose(turned(m, arm, np.array([0, 0, 1.0])), angle, atol=rounded)
    drawn = np.array(scene.joints["B"].at)
    where = place(m, block, drawn)[0]
    assert_allclose(where[:, 0] + 1j * where[:, 1], pin, atol=r * rounded)
    assert_allclose(m.R[:, block], m.R[:, arm], atol=1e-14)
    assert_allclose(place(m, body(scene, "crank"), drawn)[0], where, atol=1e-15)


def trihedral(a: np.ndarray) -> np.ndarray:
    """Joint angles that close a loop of lengths a and twists ±90°, by Newton from the equal-sided one; or nan."""
    alpha = np.array([RIGHT, -RIGHT] * 3)
    theta = np.array([0.6, np.arccos(-np.cos(0.6) / (1 + np.cos(0.6)))] * 3)

    def gap(angles: np.ndarray) -> np.ndarray:
        end = denavit_hartenberg(a, alpha, angles)[-1]
        skew = [end[2, 1] - end[1, 2], end[0, 2] - end[2, 0], end[1, 0] - end[0, 1]]
        return np.concatenate([end[:3, 3], skew])

    for _ in range(60):
        h = 1e-7
        columns = [(gap(theta + h * e) - gap(theta - h * e)) / (2 * h) for e in np.eye(6)]
        theta = theta - np.linalg.lstsq(np.stack(columns, axis=1), gap(theta), rcond=1e-6)[0]
    return theta


def test_a_trihedral_bricard_of_unequal_lengths_moves() -> None:
    """Mobile for a1² + a3² + a5² = a2² + a4² + a6² (Bricard 1927), though Kutzbach counts 0 degrees of freedom."""
    a = np.array([0.30, 0.32, 0.34, 0.29, 0.28, 0.0])
    a[5] = np.sqrt(a[0] ** 2 + a[2] ** 2 + a[4] ** 2 - a[1] ** 2 - a[3] ** 2)
    joints = revolute_loop(a, np.array([RIGHT, -RIGHT] * 3), trihedral(a))
    scene = linkage_scene(joints, motion={**RISE, "angle": 0.3})
    m = motion_at(scene, np.linspace(0, 1, 21))
    F = body(scene, "link5")
    assert_allclose(place(m, F, np.array(joints["F"][3]))[0], np.tile(joints["F"][3], (21, 1)), atol=1e-13)
    assert linkage(scene).redundant  # 5 × 6 rows hold 30 − 1 motions


def test_the_drive_law_enters_by_the_chain_rule() -> None:
    """The same poses at the same angle whatever the law; v ∝ φ', p'' = p_φφ φ'² + p_φ φ''."""
    joints = four_bar(0.3048, 0.9144, 0.762, 0.9144, 1.0)
    t = np.linspace(0.1, 0.9, 33)
    law = linkage_scene(joints, motion={**RISE, "angle": 2.0})
    m = motion_at(law, t)
    steady: RigidMotion = motion_at(linkage_scene(joints), m.phi)  # at 1 rad/s time is the angle
    w = 2 * np.pi
    speed, acceleration = 2 * (1 - np.cos(w * t)), 2 * w * np.sin(w * t)  # cycloidal law, by hand
    assert_allclose(m.R, steady.R, atol=1e-13)
    assert_allclose(m.v, steady.v * speed[:, None, None], atol=1e-12)
    wanted = steady.p2 * speed[:, None, None] ** 2 + steady.v * acceleration[:, None, None]
    assert_allclose(m.p2, wanted, atol=1e-11)
