"""Tableaux of the benchmark of orders in time: conditions of their orders (Butcher 1963), and what their names say."""

import re

import numpy as np
import pytest
from benchmarks.orders_schemes import SCHEMES, Scheme

STAGED = [scheme for scheme in SCHEMES if scheme.tableau is not None]


@pytest.mark.parametrize("scheme", STAGED, ids=lambda scheme: scheme.name)
def test_stages_satisfy_the_conditions_of_their_order(scheme: Scheme) -> None:
    assert scheme.tableau is not None
    A, b, c = scheme.tableau
    named = re.search(r"order (\d)", scheme.name)
    order = int(named.group(1)) if named else 4  # Suzuki's composition
    conditions = [
        (1, b.sum(), 1), (2, b @ c, 1 / 2), (3, b @ c**2, 1 / 3), (3, b @ A @ c, 1 / 6), (4, b @ c**3, 1 / 4),
        (4, b @ (c * (A @ c)), 1 / 8), (4, b @ A @ c**2, 1 / 12), (4, b @ A @ A @ c, 1 / 24),
    ]  # fmt: skip
    np.testing.assert_allclose(A.sum(axis=1), c, atol=1e-14)
    for of, found, asked in conditions:
        if of <= order:
            assert found == pytest.approx(asked, abs=1e-9)  # published fractions of up to twelve digits


@pytest.mark.parametrize("scheme", [s for s in STAGED if "L-stable" in s.name], ids=lambda scheme: scheme.name)
def test_l_stable_stages_damp_what_a_step_cannot_resolve(scheme: Scheme) -> None:
    """R(z) = 1 + z bᵀ (1 − z A)⁻¹ 1 goes to zero (Hairer and Wanner, Solving ODEs II, IV.3)."""
    assert scheme.tableau is not None
    A, b, _ = scheme.tableau
    z = -1e8
    assert abs(1 + z * b @ np.linalg.solve(np.eye(len(b)) - z * A, np.ones(len(b)))) < 1e-6
