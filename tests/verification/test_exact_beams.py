"""The oracle of large deflection against published numbers, closed forms and itself."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.exact.beams import Beams, Rod, internal_force, joined, kinetic_energy, momenta, strain_energy, strains, weight
from tests.exact.cases import CASES, at_rest, flying_rod
from tests.exact.chain import chain_history
from tests.exact.four_bar import four_bar, outer_stress, pose
from tests.exact.solve import Problem, State, Stepping, equilibrium, forces, motion, spinning_frequencies

from .large_deflection import (
    ELASTICA,
    ROTATING_CANTILEVER,
    UniformRod,
    chordwise,
    double_pendulum,
    double_pendulum_energy,
    history,
    pendulum_period,
    steady_stretch,
)

INEXTENSIBLE = Rod((0, 0), (1, 0), 1e7, 1e7, 1.0, 1.0, 1e-4, 16)
DRAWN = Rod((0.2, 0.1), (0.7, -0.4), 3.0, 2.0, 0.5, 1.3, 0.2, 3)


def clamped(beams: Beams) -> dict[int, float]:
    return {int(k): beams.q0[k] for k in beams.end(0, 0)}


@pytest.mark.parametrize("load", ELASTICA)
def test_a_cantilever_bends_into_the_elastica(load: float) -> None:
    beams = joined([INEXTENSIBLE])
    x, y, _ = beams.end(0, 1)
    F = np.zeros(beams.size)
    F[y] = load
    q = equilibrium(Problem(beams, clamped(beams), lambda t: t * F), 4)
    # six digits in print; stretch and shear of the finite stiffnesses 1e-6
    assert_allclose([q[y], 1 - q[x]], ELASTICA[load], atol=5e-6)


def test_an_end_moment_bends_a_circle() -> None:
    beams = joined([replace(INEXTENSIBLE, start=(1.0, 1.0), end=(1.6, 1.8), elements=4)])  # any direction
    F = np.zeros(beams.size)
    F[beams.end(0, 1)[2]] = 2 * np.pi
    q = equilibrium(Problem(beams, clamped(beams), lambda t: t * F), 8)
    assert_allclose(q[beams.end(0, 1)], [1.0, 1.0, 2 * np.pi], atol=1e-10)  # constant curvature: exact


def some_state(beams: Beams, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return beams.q0 + 0.3 * random.standard_normal(beams.size), random.standard_normal(beams.size)


@pytest.mark.parametrize("nodes", [2, 3, 5])
def test_the_force_is_the_gradient_of_the_energy(nodes: int) -> None:
    beams = joined([replace(DRAWN, nodes=nodes)])
    q, v = some_state(beams)
    step = 1e-6
    slope = (strain_energy(beams, q + step * v) - strain_energy(beams, q - step * v)) / (2 * step)
    assert_allclose(internal_force(beams, q)[0] @ v, slope, rtol=1e-7)  # central differences


def test_the_tangent_is_the_derivative_of_the_forces_damping_included() -> None:
    problem = four_bar_like()
    beams, step, rate = problem.beams, 1e-6, 7.0
    q, v = some_state(beams)
    dq = np.random.default_rng(4).standard_normal(beams.size)
    f, Ke = forces(problem, State(0.3, q, v, 0 * q), rate)
    ends = [forces(problem, State(0.3, q + s * dq, v + s * rate * dq, 0 * q))[0] for s in (-step, step)]
    tangent = np.bincount(beams.edof.ravel(), (Ke @ dq[beams.edof][..., None]).ravel(), beams.size)
    tangent += problem.alpha * rate * beams.lumps * dq
    assert_allclose(tangent, (ends[1] - ends[0]) / (2 * step), rtol=1e-6, atol=1e-6 * np.abs(f).max())


def four_bar_like() -> Problem:
    return replace(four_bar(300, 0.02, 2)[0], held={})


def test_rigid_body_motion_of_the_four_bar_is_not_damped() -> None:
    problem, first = four_bar(300, 0.05, 2)
    f, _ = forces(problem, first)
    assert np.abs(f).max() < 1e-9 * np.abs(problem.beams.M @ first.v).max() * problem.alpha + 1e-6


def test_the_rigid_four_bar_is_closed() -> None:
    step = 1e-6
    for phi in np.linspace(0, 6, 13):
        at, ahead, behind = (pose(phi + s, 2.0) for s in (0.0, step, -step))
        assert_allclose(np.hypot(*np.diff(at.points, axis=0).T), [0.3048, 0.9144, 0.762], rtol=1e-14)
        slope = (np.exp(1j * (ahead.angle - behind.angle))).imag / (2 * step) * 2.0
        assert_allclose(at.omega, slope, rtol=1e-8, atol=1e-8)  # central differences


@pytest.mark.long
@pytest.mark.parametrize("rpm", [300, 600])
def test_the_four_bar_moves_as_a_chain_of_masses_and_springs(rpm: float) -> None:
    """Another discretisation, with another time integration, tends to the same curve with the second power."""
    end, spacing, slender = 0.03, 5e-4, 1000.0
    problem, first = four_bar(rpm, 0.0, 16, slender=slender)
    _, exact, _ = motion(problem, first, Stepping(2.5e-5, 1200, 20), outer_stress(problem))
    errors = []
    for k, h in ((1, 1e-5), (2, 5e-6), (4, 2.5e-6)):
        _, found = chain_history(rpm, (4 * k, 12 * k, 10 * k), h, round(end / h))
        errors.append(np.abs(found[:: round(spacing / h)] - exact).max() / np.abs(exact).max())
    assert errors[2] < 0.03
    assert errors[0] / errors[2] > 8


def test_a_rigid_motion_does_not_strain() -> None:
    beams = joined([DRAWN])
    c, s = np.cos(2.5), np.sin(2.5)
    q = beams.q0.copy()
    dof = beams.dof[0]
    q[dof[:, :2]] = q[dof[:, :2]] @ np.array([[c, s], [-s, c]]) + [3.0, -1.0]
    q[dof[:, 2]] = 2.5
    assert np.abs(strains(beams, q).e).max() < 1e-13


def euler_bernoulli(slenderness: float) -> Problem:
    EI, EA = 1.0, slenderness**2
    beams = joined([Rod((0, 0), (1, 0), EA, 5e6, EI, 1.0, 1e-7, 4, 5)])
    return Problem(beams, clamped(beams))


@pytest.mark.parametrize("mu", [2.0, 4.0, 6.0, 8.0, 10.0])
def test_a_rotating_cantilever_is_stiffened(mu: float) -> None:
    chord, flap = ROTATING_CANTILEVER[mu]
    for slenderness, reference, cap in ((70.0, chord, 5e-3), (1000.0, chordwise(flap, mu), 2e-4)):
        problem = euler_bernoulli(slenderness)
        q = equilibrium(problem, 5, spin=mu)
        assert_allclose(spinning_frequencies(problem, q, mu)[0], reference, rtol=cap)


def test_a_bar_that_turns_stretches_as_its_equation_says() -> None:
    problem = euler_bernoulli(70.0)
    q = equilibrium(problem, 5, spin=8.0)
    stretch = q[problem.beams.end(0, 1)[0]] - 1
    assert_allclose(stretch, steady_stretch(1.0, 8.0, 70.0**2, 1.0), rtol=1e-6)


def test_the_spun_up_arm_ends_stretched() -> None:
    """Simo and Vu-Quoc (1986): 5.14e-4 at last; about 0.58 behind at most."""
    kept = history("spin_up")
    late = kept.t > 16
    assert_allclose(steady_stretch(10.0, 6.0, 2.8e7, 1.2), 5.14e-4, rtol=1e-3)
    assert_allclose(kept.values[late, 0].mean(), 5.14e-4, rtol=5e-3)  # it vibrates a little
    assert_allclose(kept.values[:, 1].min(), -0.5738, atol=1e-4)


def pendulum(angle: float, links: int = 1) -> tuple[Problem, float]:
    """Stiff rods of 1 kg and 1 m, hanging one from another, all at an angle from the vertical."""
    along = np.array([np.sin(angle), -np.cos(angle)])
    ends = [tuple(k * along) for k in range(links + 1)]
    section = 1e-4
    rods = [Rod(a, b, 1e7, 1e7, 1e5, 1.0, section, 2) for a, b in pairwise(ends)]
    beams = joined(rods, pins=[[(k, 1), (k + 1, 0)] for k in range(links - 1)])
    x, y, _ = beams.end(0, 0)
    g = weight(beams, (0.0, -9.81))
    return Problem(beams, {x: 0.0, y: 0.0}, lambda t: g), section


def test_a_stiff_pendulum_has_the_period_of_elliptic_integrals() -> None:
    problem, section = pendulum(np.pi / 2)
    period = pendulum_period(1.0, 0.5, 1 / 3 + section, np.pi / 2)
    first, angle = at_rest(problem), problem.beams.end(0, 1)[2]
    _, turned, _ = motion(problem, first, Stepping(period / 800, 800), lambda s: s.q[angle])
    # back where it started, |error of period| = √(2 · error of angle / angular acceleration)
    assert abs(turned[-1]) < 1e-3
    assert_allclose(turned[400], -np.pi, atol=1e-3)


def test_a_stiff_double_pendulum_moves_as_two_rigid_rods() -> None:
    problem, section = pendulum(np.pi / 2, links=2)
    rods = (UniformRod(1.0, 1.0, section), UniformRod(1.0, 1.0, section))
    angles = [problem.beams.end(k, 1)[2] for k in range(2)]
    found = []
    for steps in (1000, 2000):
        stepping = Stepping(2.0 / steps, steps, steps // 50)
        t, turned, _ = motion(problem, at_rest(problem), stepping, lambda s: s.q[angles])
        found.append(turned)
    rigid = double_pendulum(rods, (np.pi / 2, np.pi / 2), t)
    energy = double_pendulum_energy(rods, rigid)
    assert np.ptp(energy) < 1e-9  # of some 20 J
    extrapolated = (4 * found[1] - found[0]) / 3
    assert_allclose(extrapolated, rigid[:, :2] - np.pi / 2, atol=3e-4)


def test_a_free_rod_keeps_momentum_and_energy() -> None:
    """Linear momentum to rounding; spin and energy to the order of the scheme."""
    found = []
    for steps in (200, 400):
        this = flying_rod(4, 5)
        beams = this.problem.beams
        _, _, thrown = motion(this.problem, this.first, Stepping(0.1 / steps, steps), this.observed)

        def kept(state: State, beams: Beams = beams) -> np.ndarray:
            energy = kinetic_energy(beams, state.v) + strain_energy(beams, state.q)
            return np.array([energy, *momenta(beams, state.q, state.v)])

        _, values, _ = motion(this.problem, thrown, Stepping(0.1 / steps, 2 * steps, rho_inf=1.0), kept)
        assert_allclose(values[:, 1:3], np.broadcast_to([0.1, 0.2], (len(values), 2)), rtol=1e-5)  # ∫F dt
        found.append(np.ptp(values[:, [0, 3]], axis=0) / np.abs(values[0, [0, 3]]))
    assert np.all(found[1] < 5e-4)
    assert np.all(found[1] < 0.3 * found[0])


QUICK = {
    "four_bar_600_damped": (20, 0.02, 0.08),
    "spin_up": (20, 6.0, 5e-3),
    "flying_rod": (8, 0.05, 1e-3),
    "snap_through": (8, 0.02, 1e-3),
    "dead_point": (8, 0.1, 1e-2),
    "whip": (8, 0.2, 1e-3),
    "sudden_stop": (10, 0.05, 1e-3),
}


@pytest.mark.parametrize("name", QUICK)
def test_kept_histories_are_what_the_oracle_finds(name: str) -> None:
    """The beginning with a coarse step and mesh."""
    factor, end, cap = QUICK[name]
    case, kept = CASES[name], history(name)
    this, h = case.build(4, 5), factor * case.h
    stepping = Stepping(h, round(end / h), round(case.spacing / h))
    t, values, _ = motion(this.problem, this.first, stepping, this.observed)
    assert kept.difference(t, values).max() < cap


@pytest.mark.parametrize("name", CASES)
def test_kept_histories_are_converged(name: str) -> None:
    kept = history(name)
    cap = 3e-3 if "undamped" in name else 5e-4
    assert max(kept.step_error.max(), kept.mesh_error.max()) < cap


def test_a_history_is_compared_at_its_own_times() -> None:
    kept = history("spin_up")
    assert_allclose(kept.difference(kept.t[:5], kept.values[:5]), 0)
    with pytest.raises(ValueError, match="away from the other's next"):
        kept.difference(kept.t[:5] * 1.01, kept.values[:5])
