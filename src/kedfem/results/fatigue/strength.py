"""Fatigue strength of a material: S-N curves from data, the FKM guideline's steps for local stresses, by pyLife."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.results.files import of_extra
from kedfem.scene import FatigueData, StrainLife

EXTRA = "fatigue"
GROUPS = {
    "steel": "Steel", "forged_steel": "Forg_Steel", "cast_steel": "GS", "aluminium": "Al_wrought",
    "cast_aluminium": "Al_cast",
}  # fmt: skip
"""As pyLife calls the guideline's groups."""

SLOPE, CYCLES = 5.0, 1e6  # of the guideline's curves for normal stress, not welded
BEYOND_ALUMINIUM, LAST_ALUMINIUM = 15.0, 1e8  # slope beyond, up to the endurance limit there
LIVES = np.logspace(0, 12, 121)  # cycles of strain-life data in a table
ENDLESS = 1e-12  # of the endurance stress: where an amplitude does no damage on any curve
POLISHED = 1e-6  # m, Rz
NEAR = 1e-6  # of an amplitude: mean stresses of pulsating compression


@dataclass(frozen=True, slots=True)
class Strength:
    """An S-N curve for alternating stress, of the surface without a stress gradient.

    S, N : (m,) logarithms of amplitudes [Pa], rising, and of cycles; straight on beyond both ends
    floor : amplitude below which nothing is damaged [Pa]
    M : mean stress sensitivity
    endurance, cycles : amplitude [Pa] at the bend and the cycles there
    slope, beyond : k above and below the bend; nan of strain-life data, infinite where there is nothing below
    endless : share of `endurance` that is endured for ever, as far as that is known
    data : as the scene has it
    """

    S: Float[np.ndarray, " m"]
    N: Float[np.ndarray, " m"]
    floor: float
    M: float
    endurance: float
    cycles: float
    slope: float
    beyond: float
    endless: float
    data: FatigueData

    def without_mean(self) -> "Strength":
        """The same for amplitudes that include the effect of mean stress."""
        return replace(self, M=0.0, data=self.data.model_copy(update={"mean_stress_sensitivity": 0.0}))

    @property
    def words(self) -> str:
        """The curve in words, for tables."""
        known = self.data
        if known.strain_life is not None:
            source = "strain-life data with Neuber's rule"
        elif known.group is not None:
            rough = f"Rz {1e6 * known.roughness:.3g} µm" if known.roughness > POLISHED else "polished"
            source = f"FKM {known.group.replace('_', ' ')}, Rm {1e-6 * (known.tensile_strength or 0):.4g} MPa, {rough}"
        else:
            source = "S-N curve as given"
        return f"{source}: {1e-6 * self.endurance:.4g} MPa at {self.cycles:.3g} cycles, M = {self.M:.3g}"


def require_fatigue() -> None:
    """OutputError unless the packages for fatigue are installed."""
    of_extra("pylife", "fatigue", EXTRA)


def strength_of(data: FatigueData, youngs_modulus: float) -> Strength:
    """The curve of a material's data."""
    if data.strain_life is not None:
        return _of_strains(data, data.strain_life, youngs_modulus)
    slope = data.slope or SLOPE
    aluminium = data.group is not None and "aluminium" in data.group
    usual = BEYOND_ALUMINIUM if aluminium else 2 * slope - 1
    beyond = usual if data.slope_beyond is None else data.slope_beyond
    below = np.inf if beyond == "endless" else float(beyond)
    if data.group is not None:
        material = material_factors(data)
        endurance, M, cycles = 1e6 * float(material["Swk"]), float(material["M"]), CYCLES
    else:
        endurance, M, cycles = float(data.endurance_stress or 0.0), 0.0, data.endurance_cycles
    M = M if data.mean_stress_sensitivity is None else data.mean_stress_sensitivity
    S = np.log(endurance) + np.array([-1.0, 0.0, 1.0])
    N = np.log(cycles) + np.array([below if np.isfinite(below) else 1.0, 0.0, -slope])
    floor = endurance * (1.0 if np.isinf(below) else ENDLESS)
    endless = (CYCLES / LAST_ALUMINIUM) ** (1 / below) if aluminium else 1.0
    return Strength(S, N, floor, M, endurance, cycles, slope, below, endless, data)


def _of_strains(data: FatigueData, known: StrainLife, E: float) -> Strength:
    """Elastic amplitudes S of given lives by Neuber's rule, S² = E σ ε; σ is E times the elastic part of the strain."""
    reversals = 2 * LIVES
    stress = known.strength_coefficient * reversals**known.strength_exponent
    strain = stress / E + known.ductility_coefficient * reversals**known.ductility_exponent
    S = np.log(np.sqrt(E * stress * strain))
    cycles = data.endurance_cycles
    endurance = float(np.exp(np.interp(np.log(cycles), np.log(LIVES), S)))
    M = data.mean_stress_sensitivity or 0.0
    falling, N = S[::-1].copy(), np.log(LIVES)[::-1].copy()
    return Strength(falling, N, ENDLESS * endurance, M, endurance, cycles, np.nan, np.nan, 1.0, data)


def material_factors(data: FatigueData, gradient: float = 0.0, cycle: tuple[float, float] = (1.0, 0.0)) -> Any:
    """The steps of the FKM guideline for local stresses, chapter 4, as pyLife takes them: a table's only row.

    Parameters
    ----------
    gradient : related stress gradient normal to the surface [1/m], for Stieler's support factor
    cycle : amplitude and mean of the stress [Pa], for the factor of mean stress
    """
    import pandas as pd
    from pylife.strength.fkm_linear import fkm_linear_factors as fkm

    group, (amplitude, mean) = GROUPS[str(data.group)], cycle
    if abs(mean + amplitude) <= NEAR * amplitude:  # R = −∞, which pyLife takes for tension
        mean = -(1 + 2 * NEAR) * amplitude
    settings = pd.Series(
        {
            "fkm_chapter": "chap4", "MatGroupFKM": group, "MatGroupFKM_Temp": "None", "Profile": "Rod",
            "Diameter": 20.0, "Condition": None, "sup_method": "Stieler",
        }
    )  # fmt: skip
    row = {
        "Rm": 1e-6 * (data.tensile_strength or 0.0), "Rz": 1e6 * data.roughness, "S_Type": "normal",
        "Temperature": 20.0, "HardProc": "None", "GJL_Mat": "None", "Kf_method": "Table",
        "Finish": "None" if data.roughness > POLISHED else "polished", "G0": 1e-3 * gradient,
        "amplitude": 1e-6 * amplitude, "meanstress": 1e-6 * mean,
    }  # fmt: skip
    found = fkm.calc_input_parameters_material(settings, pd.DataFrame([row]))
    if data.mean_stress_sensitivity is not None:
        found["M"] = data.mean_stress_sensitivity
    return fkm.fatigue_limit_local_chap4(fkm.calc_input_parameters_stress(settings, found)).iloc[0]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Evaluation of one history by pyLife.

    damage : in a period
    cycles : in a period
    utilisation : of the endurable amplitude, with the safety factor
    support : the factor by which the stress gradient raises the endurable amplitude; 1 without one
    """

    damage: float
    cycles: int
    utilisation: float
    support: float


def collective(h: Float[np.ndarray, " T"]) -> Any:
    """The cycles of a periodic history, counted by pyLife: range, mean and cycles."""
    import pandas as pd
    from pylife.stress.rainflow import FourPointDetector, LoopValueRecorder

    k = int(np.abs(h).argmax())
    counter = FourPointDetector(recorder=LoopValueRecorder())
    counter.process(np.concatenate([h[k:], h[: k + 1]]))
    loops = counter.recorder.collective
    ends = np.column_stack([loops["from"], loops["to"]]).reshape(-1, 2)
    if counter.residuals.size > 1:  # from the largest value to the other extreme and back
        ends = np.vstack([ends, counter.residuals[:2]])
    span = np.abs(ends[:, 1] - ends[:, 0])
    some = span > 0
    return pd.DataFrame({"range": span[some], "mean": ends[some].mean(axis=1), "cycles": 1.0})


def reversed_collective(cycles: Any, M: float) -> Any:
    """The same with mean 0, by the Haigh diagram of the FKM guideline."""
    from pylife.strength.meanstress import HaighDiagram

    segments = {(1.0, np.inf): 0.0, (-np.inf, 0.0): M, (0.0, 0.5): M / 3, (0.5, 1.0): 0.0}
    return HaighDiagram.from_dict(segments).transform(cycles, -1.0)


def verdict(h: Float[np.ndarray, " T"], strength: Strength, gradient: float, safety: float, periods: float) -> Verdict:
    """Damage and utilisation of a history at a hot spot.

    Parameters
    ----------
    gradient : related stress gradient normal to the surface [1/m]
    safety : factor
    periods : required number of them; infinite for ever
    """
    counted = collective(h)
    if not len(counted):
        return Verdict(0.0, 0, 0.0, 1.0)
    alternating = reversed_collective(counted, strength.M)
    amplitudes = alternating["range"].to_numpy() / 2
    worst = int(amplitudes.argmax())
    cycle = (float(counted["range"].iloc[worst]) / 2, float(counted["mean"].iloc[worst]))
    endurable, support = _endured(strength, gradient, cycle, float(amplitudes[worst]))
    used = safety * cycle[0] / (endurable * _for_life(strength, amplitudes, periods))
    return Verdict(_damage(strength, alternating), len(counted), used, support)


def _damage(strength: Strength, alternating: Any) -> float:
    """Miner's sum by pyLife's curve; of strain-life data by the table, which pyLife has no curve for."""
    amplitudes = alternating["range"].to_numpy() / 2
    if np.isnan(strength.slope):
        return float(np.exp(-_interpolated(strength, np.log(amplitudes))).sum())
    import pandas as pd
    import pylife.stress.collective  # noqa: F401 - the accessor
    from pylife.strength import Fatigue

    curve = {"k_1": strength.slope, "k_2": strength.beyond, "ND": strength.cycles, "SD": strength.endurance}
    return float(Fatigue(pd.Series(curve)).damage(alternating.load_collective).sum())


def _interpolated(strength: Strength, x: Float[np.ndarray, " c"]) -> Float[np.ndarray, " c"]:
    """Logarithms of the cycles that amplitudes are endured, straight on beyond the ends of the table."""
    S, N = strength.S, strength.N
    j = np.clip(np.searchsorted(S, x), 1, len(S) - 1)
    return np.asarray(N[j - 1] + (N[j] - N[j - 1]) / (S[j] - S[j - 1]) * (x - S[j - 1]))


def _endured(strength: Strength, gradient: float, cycle: tuple[float, float], alternating: float) -> tuple[float, float]:
    """The amplitude [Pa] that is endured with the mean of a cycle, and the support factor."""
    if strength.data.group is None:
        return strength.endurance * cycle[0] / alternating, 1.0
    row = material_factors(strength.data, gradient, cycle)
    return 1e6 * float(row["SDFKM"]), float(row["n"])


def _for_life(strength: Strength, amplitudes: Float[np.ndarray, " c"], periods: float) -> float:
    """The guideline's factor of service strength K_BK: how much more is endured in a limited life, or less for ever.

    Miner's elementary rule with the effective damage sum; at least what is endured for ever.
    """
    if not np.isfinite(periods) or np.isnan(strength.slope):
        return strength.endless
    import pandas as pd
    import pylife.stress.collective  # noqa: F401 - the accessor
    from pylife.strength.miner import MinerElementary, effective_damage_sum

    curve = {"k_1": strength.slope, "ND": strength.cycles, "SD": strength.endurance}
    cycles = pd.DataFrame({"range": 2 * amplitudes, "mean": 0.0, "cycles": periods})
    multiple = MinerElementary(pd.Series(curve)).lifetime_multiple(cycles.load_collective)
    ratio = multiple * effective_damage_sum(multiple) * strength.cycles / (periods * len(amplitudes))
    slope = strength.slope if ratio >= 1 else strength.beyond
    return float(max(ratio ** (1 / slope), strength.endless)) if np.isfinite(slope) else 1.0
