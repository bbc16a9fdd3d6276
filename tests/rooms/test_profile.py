"""The matrix of interface unknowns and constraints by its profile, beside numpy's of the same matrix in full."""

import numpy as np
import pytest

from kedfem.dynamics.matrices.profile import Profile, profile_of
from kedfem.dynamics.matrices.profile_kernel import profile_factored, profile_solved

EACH = 6  # unknowns of a body, three at each of its ends


def chain(n: int, rng: np.random.Generator) -> tuple[Profile, np.ndarray, np.ndarray]:
    """Bodies in a closed chain whose ends three constraints hold together: matrix of their unknowns, gradients."""
    names = rng.permutation(EACH * n)  # unknowns in any order
    bodies = [names[EACH * i : EACH * (i + 1)] for i in range(n)]
    joints = [np.concatenate([bodies[i][3:], bodies[(i + 1) % n][:3]]) for i in range(n)]
    groups = [joint for joint in joints for _ in range(3)]
    H, C = np.zeros((EACH * n, EACH * n)), np.zeros((3 * n, EACH * n))
    for body in bodies:
        A = rng.normal(size=(EACH, EACH))
        H[np.ix_(body, body)] += A @ A.T + np.eye(EACH)
    for a, group in enumerate(groups):
        C[a, group] = rng.normal(size=EACH)
    return profile_of(bodies, groups, EACH * n), H, C


def solution(of: Profile, H: np.ndarray, C: np.ndarray, compliance: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Unknowns and multipliers by the profile, in the order of H and C."""
    k = len(H)
    row = np.concatenate([of.unknown[of.number], of.constraint])
    full = np.zeros((len(row), len(row)))
    full[np.ix_(row, row)] = np.block([[H, C.T], [C, -np.diag(compliance)]])
    assert not any(full[i, : of.first[i]].any() for i in range(len(row)))  # nothing is left out
    K = np.concatenate([full[i, of.first[i] : i + 1] for i in range(len(row))])
    x, inverse = np.zeros(len(row)), np.zeros(len(row))
    x[row] = right
    profile_factored.py_func(K, of.first, of.at, of.multiplier, inverse)
    assert (inverse[row[:k]] > 0).all()
    assert (inverse[row[k:]] <= 0).all()
    profile_solved.py_func(K, of.first, of.at, inverse, x)
    return np.asarray(x[row])


@pytest.mark.parametrize("seed", range(3))
def test_unknowns_and_multipliers_are_those_of_the_full_matrix(seed: int) -> None:
    rng = np.random.default_rng(seed)
    of, H, C = chain(5, rng)
    compliance = np.where(rng.random(len(C)) < 0.5, 0.0, rng.random(len(C)))
    right = rng.normal(size=len(H) + len(C))
    wanted = np.linalg.solve(np.block([[H, C.T], [C, -np.diag(compliance)]]), right)
    found = solution(of, H, C, compliance, right)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())  # rounding


@pytest.mark.parametrize("seed", range(8))
def test_a_constraint_that_repeats_others_has_no_force(seed: int) -> None:
    """Constraint 2 is a sum of 0 and 1 of the same joint, met where these are; the rest is as without it."""
    rng = np.random.default_rng(seed)
    of, H, C = chain(4, rng)
    C[2] = 2.0 * C[0] - 0.5 * C[1]
    right = rng.normal(size=len(H) + len(C))
    k, kept = len(H), np.arange(len(H) + len(C)) != len(H) + 2
    right[k + 2] = 2.0 * right[k] - 0.5 * right[k + 1]
    found = solution(of, H, C, np.zeros(len(C)), right)
    full = np.block([[H, C.T], [C, np.zeros((len(C), len(C)))]])[np.ix_(kept, kept)]
    wanted = np.linalg.solve(full, right[kept])
    assert found[k + 2] == 0.0
    np.testing.assert_allclose(found[kept], wanted, rtol=0, atol=1e-11 * np.abs(wanted).max())  # rounding


def test_the_profile_grows_with_the_number_of_bodies() -> None:
    sizes = [int(chain(n, np.random.default_rng(0))[0].at[-1]) for n in (20, 80)]
    assert sizes[1] < 4.5 * sizes[0]
