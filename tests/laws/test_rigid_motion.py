"""Laws of the rigid motion: it does not know where the scene lies, nor how often the crank has turned."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from kedfem.motion.newton import orthonormal, rotation
from tests.laws.strategies import LAW, examples, rotations, vectors
from tests.linkages import (
    JointTable,
    cardan,
    four_bar,
    linkage_scene,
    motion_at,
    moved_scene,
    rssr,
    slider_crank,
    spatial_slider_crank,
)

T = np.linspace(0.0, 2 * np.pi, 25)
joint_tables = st.sampled_from(
    [
        four_bar(0.3048, 0.9144, 0.762, 0.9144, 1.0),
        slider_crank(0.1, 0.3, 0.7),
        spatial_slider_crank(0.3),
        cardan(0.6),
        rssr(1.0),
    ]
)


def sliders(joints: JointTable) -> tuple[str, ...]:
    return ("slider",) if "guide" in joints else ()


@settings(LAW, max_examples=examples(5))  # each follows two linkages over a revolution
@given(joint_tables, rotations, vectors)
def test_the_motion_does_not_depend_on_where_the_scene_lies(joints: JointTable, Q: np.ndarray, s: np.ndarray) -> None:
    """Drawn at Q X + s, a link turns by Q R Qᵀ; vectors turn with Q; p' = Q p + s − (Q R Qᵀ) s."""
    here = motion_at(linkage_scene(joints, sliders=sliders(joints)), T)
    there = motion_at(linkage_scene(moved_scene(joints, Q, s), sliders=sliders(joints)), T)
    # accelerations of up to 10 m/s² behind a condition number of about 100
    assert_allclose(there.R, Q @ here.R @ Q.T, atol=1e-12)
    assert_allclose(there.omega, here.omega @ Q.T, atol=1e-12)
    assert_allclose(there.alpha, here.alpha @ Q.T, atol=1e-11)
    assert_allclose(there.p, here.p @ Q.T + s - there.R @ s, atol=1e-12)
    assert_allclose(there.p2, here.p2 @ Q.T - there.R2 @ s, atol=1e-11)


@settings(LAW, max_examples=examples(5))  # each follows two linkages over a revolution
@given(joint_tables, st.integers(1, 1000), st.floats(0.0, 6.28))
def test_every_turn_is_the_same(joints: JointTable, revolutions: int, phase: float) -> None:
    scene = linkage_scene(joints, sliders=sliders(joints))
    later = 2 * np.pi * revolutions + phase
    first, last = motion_at(scene, np.array([phase])), motion_at(scene, np.array([later]))
    off = later - 2 * np.pi * revolutions - phase  # how far the sum is rounded
    cap = 1e-12 + 10 * abs(off) + 1e-15 * later
    assert_allclose(last.R, first.R, atol=cap)
    assert_allclose(last.p, first.p, atol=cap)
    assert_allclose(last.p2, first.p2, atol=100 * cap)


@LAW
@given(vectors)
def test_rotation_is_orthogonal_and_turns_about_its_vector(theta: np.ndarray) -> None:
    """Rodrigues: R θ = θ, det 1, trace 1 + 2 cos |θ|; exact also for the smallest angles."""
    for scale in (1.0, 1e-3, 1e-6):
        v = scale * theta
        R = rotation(v)
        assert_allclose(R @ v, v, atol=1e-15)
        assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
        assert_allclose(np.trace(R), 1 + 2 * np.cos(np.linalg.norm(v)), atol=1e-14)
        assert np.linalg.det(R) > 0


@LAW
@given(rotations, vectors, vectors)
def test_orthonormal_mends_small_errors_to_second_order(R: np.ndarray, a: np.ndarray, b: np.ndarray) -> None:
    """R (3 − Rᵀ R)/2 leaves an error of order ε²: 1e-6 becomes 1e-11 at most (|a||b| ≤ 12)."""
    mended = orthonormal(R + 1e-6 * np.outer(a, b))
    assert_allclose(mended.T @ mended, np.eye(3), atol=2e-10)


@LAW
@given(rotations, vectors, vectors)
def test_orthonormal_mends_errors_of_some_percent_to_rounding(R: np.ndarray, a: np.ndarray, b: np.ndarray) -> None:
    """As of poses that are predicted a few grid points ahead: 2 · 3 % → 3e-3 → 6e-6 → 3e-11 → rounding."""
    size = max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1.0)
    mended = orthonormal(R + 0.03 / size * np.outer(a, b))
    assert_allclose(mended.T @ mended, np.eye(3), atol=1e-14)
