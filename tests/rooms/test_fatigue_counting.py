"""Cycles, planes and strengths of fatigue: published series, closed forms, and pyLife beside our own."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.links.free_surface import surface_axes
from kedfem.results.fatigue.counting_kernel import counted
from kedfem.results.fatigue.planes import disproportion, dominant, findley_stresses, normal_stresses, signed_von_mises
from kedfem.results.fatigue.strength import collective, material_factors, reversed_collective, strength_of, verdict
from kedfem.scene import FatigueData

ASTM = np.array([-2.0, 1, -3, 5, -1, 3, -4, 4, -2])  # ASTM E1049-85, figure 6
T = 720
PHASE = 2 * np.pi * np.arange(T) / T
NORMALS = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "oblique": [0.6, -0.5, 0.8]}


def damage(h: np.ndarray, slope: float = 5.0, beyond: float = 9.0, M: float = 0.0) -> np.ndarray:
    """Damage and so on of histories, with an endurance amplitude of 1 at one cycle."""
    found = np.zeros((len(h), 4))
    counted(np.array(h, float), M, np.array([-1.0, 0, 1]), np.array([beyond, 0, -slope]), 0.0, found)
    return found


def histories(count: int) -> np.ndarray:
    """Of several harmonics about a mean, with noise."""
    rng = np.random.default_rng(3)
    k = np.array([1, 2, 3, 5, 8, 20])
    a, lag = rng.normal(size=(count, 6)) / np.sqrt(k), rng.uniform(0, 6, (count, 6))
    waves = (a[:, :, None] * np.cos(k[:, None] * PHASE + lag[:, :, None])).sum(axis=1)
    return waves + rng.normal(size=(count, 1)) + 0.01 * rng.normal(size=(count, T))


def test_pylife_counts_the_open_series_of_the_standard() -> None:
    """Loops whole, what is left by halves: ranges 3: 0.5, 4: 1.5, 6: 0.5, 8: 1, 9: 0.5 [ASTM E1049-85]."""
    from pylife.stress.rainflow import FourPointDetector, LoopValueRecorder

    counter = FourPointDetector(recorder=LoopValueRecorder()).process(ASTM)
    loops = counter.recorder.collective
    cycles: dict[float, float] = {}
    for each, count in (
        *((abs(b - a), 1.0) for a, b in loops[["from", "to"]].to_numpy()),
        *((abs(x), 0.5) for x in np.diff(counter.residuals)),
    ):
        cycles[float(each)] = cycles.get(float(each), 0.0) + count
    assert cycles == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}


@pytest.mark.parametrize("first", range(8))
def test_the_series_of_the_standard_repeats_itself_in_four_whole_cycles(first: int) -> None:
    """Ranges 3, 4, 7, 9, wherever it begins: pyLife's are they, and ours has the sums of their powers."""
    h = np.roll(ASTM[:-1], -first)
    assert sorted(collective(h)["range"]) == [3, 4, 7, 9]
    for power in (1.0, 2.0, 3.0, 4.0):
        expected = sum((r / 2) ** power for r in (3, 4, 7, 9))
        assert_allclose(damage(h[None], power, power)[0, 0], expected, rtol=1e-13)


def test_our_cycles_do_the_damage_of_pylifes() -> None:
    """Random histories with means, by two slopes, mean stress by Haigh's diagram: rounding of logarithms."""
    data = FatigueData(endurance_stress=1.0, slope=5, mean_stress_sensitivity=0.3, endurance_cycles=1e6)
    strength, many = strength_of(data, 2e11), histories(4)
    found = np.zeros((len(many), 4))
    counted(many, strength.M, strength.S, strength.N, strength.floor, found)
    for ours, h in zip(found, many, strict=True):
        assert_allclose(ours[0], verdict(h, strength, 0.0, 1.0, np.inf).damage, rtol=1e-11)
        worst = reversed_collective(collective(h), 0.3)["range"].max() / 2
        assert_allclose(ours[1], worst, rtol=1e-12)
        assert len(collective(h)) > 20


@pytest.mark.parametrize(("amplitude", "slope"), [(2.0, 5.0), (0.5, 9.0)])
def test_a_constant_amplitude_lives_as_basquin_says(amplitude: float, slope: float) -> None:
    """D = (a / S_D)^k / N_D, above and below the bend."""
    assert_allclose(damage(amplitude * np.cos(PHASE)[None])[0, 0], amplitude**slope, rtol=1e-12)


@pytest.mark.parametrize(
    ("mean", "equal"),
    [(-3, 0.7), (-1, 0.7), (-0.5, 0.85), (0.5, 1.15), (1, 1.3), (2, 1.3 * 1.2 / 1.1), (3, 1.3**2 / 1.1),
     (9, 1.3**2 / 1.1)],
)  # fmt: skip
def test_mean_stress_counts_as_haighs_diagram_of_the_guideline(mean: float, equal: float) -> None:
    """M = 0.3 up to R = 0, a third of it up to R = 0.5, none beyond and under compression; amplitude 1."""
    assert_allclose(damage(mean + np.cos(PHASE)[None], M=0.3)[0, 1], equal, rtol=1e-12)


def surface_stress(normal: list[float], xx: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """H (1, 6, T) of plane stress xx, xy in a surface with a normal, and the surface's axes."""
    axes = surface_axes(np.array([normal], float))
    tangent = np.stack([axes[0, 0], axes[0, 1]], axis=1)
    S = np.einsum("ia,tab,jb->tij", tangent, np.array([[xx, xy], [xy, 0 * xx]]).transpose(2, 0, 1), tangent)
    mean = np.trace(S, axis1=1, axis2=2) / 3
    root = np.sqrt(3.0)
    H = [root / 2 * (S[:, 0, 0] - S[:, 1, 1]), 1.5 * (S[:, 2, 2] - mean), root * S[:, 0, 1],
         root * S[:, 1, 2], root * S[:, 2, 0], mean]  # fmt: skip
    return np.array(H)[None], axes


def principal(H: np.ndarray) -> np.ndarray:
    return dominant(H @ H.transpose(0, 2, 1) / T, H.mean(axis=2))


def amplitudes(h: np.ndarray) -> np.ndarray:
    return np.ptp(h, axis=2)[0] / 2


@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS)
def test_tension_and_torsion_in_phase_and_a_quarter_out_of_it(normal: list[float]) -> None:
    """Largest normal amplitude σ/2 + √(σ²/4 + τ²), and max √((σ cos²φ)² + (τ sin 2φ)²); planes are 5° apart."""
    s, t = 100.0, 90.0
    H, axes = surface_stress(normal, s * np.cos(PHASE), t * np.cos(PHASE))
    assert_allclose(amplitudes(normal_stresses(H, axes)).max(), s / 2 + np.hypot(s / 2, t), rtol=2.5e-3)
    assert disproportion(H, principal(H))[0] < 1e-6
    assert_allclose(np.ptp(signed_von_mises(H, principal(H))[0]) / 2, np.sqrt(s**2 + 3 * t**2), rtol=1e-12)
    H, axes = surface_stress(normal, s * np.cos(PHASE), t * np.sin(PHASE))
    phi = np.linspace(0, np.pi, 20001)
    expected = np.hypot(s * np.cos(phi) ** 2, t * np.sin(2 * phi)).max()
    assert expected > 1.05 * s
    assert_allclose(amplitudes(normal_stresses(H, axes)).max(), expected, rtol=2.5e-3)
    assert disproportion(H, principal(H))[0] > 0.6


@pytest.mark.parametrize("normal", NORMALS.values(), ids=NORMALS)
def test_findley_is_the_amplitude_of_alternating_tension(normal: list[float]) -> None:
    """τ_a + k σ_max over all planes: uniaxial (σ/2)(√(1 + k²) + k), pure shear t √(1 + k²); R = 0 is worse."""
    k, s = 0.3, 100.0
    scale = 2 / (np.sqrt(1 + k * k) + k)
    for xx, xy, expected in (
        (s * np.cos(PHASE), 0 * PHASE, s),
        (0 * PHASE, s * np.cos(PHASE), s * np.sqrt(1 + k * k) * scale),
        (s + s * np.cos(PHASE), 0 * PHASE, s / 2 * (np.sqrt(1 + 4 * k * k) + 2 * k) * scale),
    ):
        H, axes = surface_stress(normal, xx, xy)
        assert_allclose(amplitudes(findley_stresses(H, axes, k)).max(), expected, rtol=5e-3)


def test_equal_tension_in_two_directions_shears_inclined_planes() -> None:
    """No plane at right angles to the surface is sheared; those inclined are as by tension in one direction."""
    H, axes = surface_stress(NORMALS["oblique"], np.cos(PHASE), 0 * PHASE)
    H = H + _uniaxial(axes[0, 1])
    found = amplitudes(findley_stresses(H, axes, 0.3))
    assert found[:36].max() < 1e-12
    assert_allclose(found[36:], 1.0, rtol=1e-9)


def _uniaxial(e: np.ndarray) -> np.ndarray:
    """H (1, 6, T) of alternating tension along e."""
    S, root = np.outer(e, e), np.sqrt(3.0)
    of = [root / 2 * (S[0, 0] - S[1, 1]), 1.5 * (S[2, 2] - 1 / 3), root * S[0, 1], root * S[1, 2],
          root * S[2, 0], 1 / 3]  # fmt: skip
    return np.outer(of, np.cos(PHASE))[None]


def test_the_sign_of_von_mises_is_pylifes() -> None:
    """That of the trace: (−100, 20, 0; xy 30) is −122.88205727."""
    from pylife.stress.equistress import signed_mises_trace

    xx, yy, xy = -100.0, 20.0, 30.0
    root, mean = np.sqrt(3.0), (xx + yy) / 3
    state = np.array([root / 2 * (xx - yy), -1.5 * mean, root * xy, 0, 0, mean])
    H = np.outer(state, 1 + 0.2 * np.cos(PHASE))[None]
    expected = float(signed_mises_trace(xx, yy, 0.0, xy, 0.0, 0.0))
    assert_allclose(expected, -122.88205727, rtol=1e-10)
    assert_allclose(signed_von_mises(H, principal(H))[0], expected * (1 + 0.2 * np.cos(PHASE)), rtol=1e-12)


def test_strain_life_data_are_neubers_rule() -> None:
    """An amplitude of which σ ε E is the square lives as long as its strain."""
    data = {"strength_coefficient": 9e8, "strength_exponent": -0.09, "ductility_coefficient": 0.3,
            "ductility_exponent": -0.6}  # fmt: skip
    E, life = 2.1e11, 3e4
    elastic = 9e8 / E * (2 * life) ** -0.09
    S = E * np.sqrt(elastic * (elastic + 0.3 * (2 * life) ** -0.6))
    strength = strength_of(FatigueData(strain_life=data, mean_stress_sensitivity=0.1), E)
    h = S * np.cos(PHASE)
    found = np.zeros((1, 4))
    counted(h[None], 0.1, strength.S, strength.N, strength.floor, found)
    assert_allclose([found[0, 0], verdict(h, strength, 0.0, 1.0, np.inf).damage], 1 / life, rtol=2e-3)


def test_the_steps_of_the_guideline_by_hand() -> None:
    """Steel and aluminium: strength, roughness, design factor, mean stress, Stieler's support [FKM 2012, chapter 4]."""
    steel = material_factors(FatigueData(group="steel", tensile_strength=6e8), 2000.0, (1e8, 2e8))  # 2 per millimetre
    K_R = 1 - 0.22 * np.log10(25) * np.log10(2 * 600 / 400)
    n = 1 + 2**0.25 * 10 ** -(0.5 + 600 / 2700)
    M = 0.35 * 0.6 - 0.1
    limit = 0.45 * 600 * n / (1 + 0.5 * (1 / K_R - 1)) * (3 + M) / ((1 + M) * (3 + 2 * M))
    assert_allclose([steel["Kr"], steel["n"], steel["M"], steel["SDFKM"]], [K_R, n, M, limit], rtol=1e-12)
    wrought = FatigueData(group="aluminium", tensile_strength=3e8, roughness=1e-6)
    curve = strength_of(wrought, 7e10)
    assert_allclose([curve.endurance, curve.M], [0.3 * 3e8, 0.26], rtol=1e-12)
    used = verdict(4.5e7 * np.cos(PHASE), curve, 0.0, 1.5, np.inf).utilisation
    assert_allclose(used, 1.5 * 0.5 * 100 ** (1 / 15), rtol=1e-12)  # endured 1e8 times and more


def test_a_required_life_uses_what_it_needs() -> None:
    """Of one amplitude for 1e4 cycles K_BK = (D_m 1e6 / 1e4)^(1/5), with the effective damage sum 1; for 1e9 it is 1."""
    curve = strength_of(
        FatigueData(endurance_stress=1e8, slope=5, slope_beyond="endless", mean_stress_sensitivity=0), 2e11
    )
    h = 1.5e8 * np.cos(PHASE)
    assert_allclose(verdict(h, curve, 0.0, 1.0, 1e4).utilisation, 1.5 / 100**0.2, rtol=1e-12)
    assert_allclose(verdict(h, curve, 0.0, 1.0, 1e9).utilisation, 1.5, rtol=1e-12)
    assert verdict(0.99e8 * np.cos(PHASE), curve, 0.0, 1.0, np.inf).damage == 0.0


@pytest.mark.parametrize("mean", [-3, -1.0000001, -1, -0.5, 0, 1, 2, 5])
def test_a_utilisation_is_that_of_the_amplitude_with_mean_0(mean: float) -> None:
    """Pulsating compression, R = −∞, too."""
    curve, h = (strength_of(FatigueData(group="steel", tensile_strength=9e8), 2e11), 1e8 * (mean + np.cos(PHASE)))
    equal = damage(h[None] / 1e8, M=curve.M)[0, 1] * 1e8
    assert_allclose(verdict(h, curve, 0.0, 1.5, np.inf).utilisation, 1.5 * equal / curve.endurance, rtol=3e-6)
