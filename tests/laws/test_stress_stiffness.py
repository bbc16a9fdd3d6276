"""Stress stiffness: what turns with a link, and what it takes from a nonlinear strain energy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from kedfem.links.beams.beam import beam_link, shape_functions
from kedfem.links.beams.section import rectangle
from kedfem.links.beams.spatial_beam import space_strains
from kedfem.links.beams.spatial_stress import metric
from kedfem.links.record import Link
from kedfem.links.reduced import reduced, rigid, rigid_body_functions
from kedfem.links.stress_stiffness import rotated_directions, stress_stiffness
from kedfem.motion.newton import cross_matrix
from kedfem.scene import Material
from tests.verification.meshes import mapped_link, mapped_plane
from tests.verification.spatial_beams import FLAT, straight

SOFT = Material(density=1000, youngs_modulus=1e9, poisson_ratio=0.3)
BENT = np.array([[0.0, 0, 0], [0.5, 0.1, 0], [0.5, 0.6, 0]])


def links() -> dict[str, Link]:
    out = {
        f"hex{n}": mapped_link((2, 2, 1), lambda r, s, t: (r + 0.1 * s * t, s / 2 + 0.1 * r * r, t / 5), SOFT, n)
        for n in (8, 10, 20, 27)
    }
    out["plane"] = mapped_plane((3, 2), lambda r, s: (r + 0.1 * s * s, s / 2 + 0.1 * r), 0.01, SOFT)
    out["beam in space"] = straight([[0, 0, 0], [0.5, 0.1, 0.2], [0.5, 0.6, 0.1]], FLAT, 2)
    rng = np.random.default_rng(0)
    for name in ("hex20", "plane", "beam in space"):
        more = rng.standard_normal((out[name].n, 3))
        out[f"{name}, reduced"] = reduced(out[name], np.hstack([rigid_body_functions(out[name]), more]))
        out[f"{name}, rigid"] = rigid(out[name])
    return out


def state(link: Link) -> np.ndarray:
    return 1e-4 * np.random.default_rng(1).standard_normal((link.n, link.d))


def dense(k: object) -> np.ndarray:
    return k.toarray() if hasattr(k, "toarray") else np.asarray(k)


@pytest.mark.parametrize("name", list(links()))
def test_forces_turn_with_a_link_that_turns(name: str) -> None:
    """k X = K0 g, so k (θ × X) = θ × K0 g; translations do nothing."""
    link = links()[name]
    g = state(link)
    k = dense(stress_stiffness(link)(g))
    force = (link.K0 @ g.ravel()).reshape(g.shape)
    rounding = 1e-12 * np.abs(force).max()
    assert_allclose(k @ link.X[:, : link.d], force, rtol=0, atol=rounding)
    assert_allclose(k @ link.one, 0, rtol=0, atol=1e-12 * np.abs(k).max())
    assert_allclose(k, k.T, rtol=0, atol=1e-13 * np.abs(k).max())
    assert_allclose(rotated_directions(link), np.eye(link.d), rtol=0, atol=0)


@pytest.mark.parametrize("kind", ["solid", "plane"])
def test_stress_stiffness_is_what_green_lagrange_strain_adds_to_the_energy(kind: str) -> None:
    """∫ σ : ½ (∇uᵀ ∇u) dV, the part of ∫ σ : E(u) that is quadratic in u, by differences of the energy itself.

    W(u) = ½ ∫ (λ tr(E)² + 2 μ E : E) dV of E = ½ (H + Hᵀ + Hᵀ H); ∂³W/∂u∂u∂g at rest is k and what g adds to the strains'
    own derivative, which vanishes for a g that stretches evenly and u that are small against it in strain: turns.
    """
    link = links()["hex27" if kind == "solid" else "plane"]
    rng = np.random.default_rng(2)
    A = rng.standard_normal((link.d, link.d))
    g = 1e-5 * link.X[:, : link.d] @ (A + A.T)
    W = rng.standard_normal((link.d, link.d))
    u = 1e-5 * link.X[:, : link.d] @ (W - W.T)

    def energy(x: np.ndarray) -> float:
        """E is affine in X here and so exact with one value: g and u are linear in X."""
        H = np.linalg.lstsq(link.X[:, : link.d], x, rcond=None)[0].T
        E = (H + H.T + H.T @ H) / 2
        lam, mu = link.lame
        return float(link.volume.sum() * (lam * np.trace(E) ** 2 / 2 + mu * (E * E).sum()))

    k = stress_stiffness(link)(g)
    wanted = (energy(g + u) + energy(g - u) - 2 * energy(g)) / 2
    # to first order in g's strain: 1e-5
    assert_allclose(np.vdot(u, k @ u) / 2, wanted, rtol=1e-4)


def test_a_straight_planar_beam_is_stiffened_across_its_axis_only() -> None:
    link = beam_link("beam", np.array([[0.0, 0, 0], [0.6, 0.8, 0]]), rectangle(0.02, 0.01), SOFT, 4)
    t = np.array([0.6, 0.8, 0.0])
    P = rotated_directions(link)
    assert_allclose(P, np.diag([1.0, 1.0, 0.0]) - np.outer(t, t), rtol=0, atol=1e-14)
    bent = beam_link("beam", BENT, rectangle(0.02, 0.01), SOFT, 4)
    assert_allclose(rotated_directions(bent), np.diag([1.0, 1.0, 0.0]), rtol=0, atol=0)


@pytest.mark.parametrize("made", ["full", "rigid"])
def test_a_tie_pulls_back_across_its_axis_with_its_force_over_its_length(made: str) -> None:
    """A string with the force N and the length L, one end moved across: N/L."""
    link = beam_link("beam", np.array([[0.0, 0, 0], [0.6, 0.8, 0]]), rectangle(0.02, 0.01), SOFT, 3)
    N, t, n = 100.0, np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    g = np.zeros((link.n, 3))
    g[:, :2] = N / (1e9 * 2e-4) * (link.X[:, :2] @ t)[:, None] * t
    across = np.zeros((link.n, 3))
    across[:, :2] = np.outer(link.X[:, :2] @ t, n)
    if made == "rigid":
        full, link = link, rigid(link)
        force = link.Q.T @ (full.K0 @ g.ravel()).reshape(g.shape)
        g = np.linalg.lstsq(link.K0, force.ravel(), rcond=1e-12)[0].reshape(-1, 3)
        across = np.linalg.lstsq(link.Q, across, rcond=None)[0]
    k = stress_stiffness(link)(g)
    P = rotated_directions(link)
    assert_allclose(np.vdot(across, k @ across @ P), N * 1.0, rtol=1e-6)  # N L θ², L = θ = 1


def test_strains_of_a_beam_in_space_are_changes_of_scalar_products() -> None:
    """Σ c_αβ e_α · δe_β is the linear strain, on an element that is curved and twisted."""
    rng = np.random.default_rng(3)
    s = np.array([0.0, 1.0, 0.5])
    n1, n2 = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
    x = np.zeros((3, 3, 3))
    for node, at in enumerate(s):
        turn = expm(cross_matrix(np.array([0.4 * at, 0.3 * at, -0.5 * at])))
        x[node] = [[at, 0.2 * at**2, -0.1 * at**2], turn @ n1, turn @ n2]
    r, u = 0.3, rng.standard_normal((3, 3, 3))
    rows, det_J = space_strains(x, r)
    N, dN = shape_functions(r, 3)
    weights = np.zeros((5, 3, 3))
    weights[0, :, 0] = weights[3, :, 1] = weights[4, :, 2] = dN / det_J
    weights[1, :, 1] = weights[2, :, 2] = N
    e, change = (np.einsum("amf,mfc->ac", weights, y) for y in (x, u))
    wanted = np.einsum("imfc,mfc->i", rows, u)
    assert_allclose(np.einsum("iab,ac,bc->i", metric(e), e, change), wanted, rtol=1e-12)
