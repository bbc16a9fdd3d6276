"""Records of fatigue: data of materials and links, and the evaluation of damage by stresses of a periodic motion."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, StrictBool, TypeAdapter, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import LinkName, MaterialName, Record, refuse
from kedfem.scene.records.units import PositivePressure, PositiveTime, Quantity

STRENGTHS = {"steel": (300e6, 2000e6), "aluminium": (80e6, 800e6)}
"""Tensile strengths for which the guideline's formulas hold: below, mean stress sensitivity would be negative [Pa]."""

Factor = Annotated[float, Quantity("1", above=0.0)]
Exponent = Annotated[float, Quantity("1", below=0.0)]
Sensitivity = Annotated[float, Quantity("1", least=0.0, below=1.0)]
Group = Literal["steel", "forged_steel", "cast_steel", "aluminium", "cast_aluminium"]


SLOPE: TypeAdapter[float] = TypeAdapter(Factor)


def slope_or_endless(value: object) -> float | str:
    """A slope, or the word for a fatigue limit, below which nothing is damaged."""
    return "endless" if value == "endless" else SLOPE.validate_python(value)


class StrainLife(Record):
    """Strain-life data: ε_a = σ'_f/E (2N)^b + ε'_f (2N)^c."""

    strength_coefficient: PositivePressure
    """σ'_f"""
    strength_exponent: Exponent
    """b, negative"""
    ductility_coefficient: Factor
    """ε'_f"""
    ductility_exponent: Exponent
    """c, negative"""


class FatigueData(Record):
    """Fatigue strength of a material or a link: a group of the FKM guideline, an S-N curve or strain-life data."""

    group: Group | None = None
    """of the FKM guideline: strength, sensitivity to mean stress, influence of roughness and slope follow from
    `tensile_strength`"""
    tensile_strength: PositivePressure | None = None
    """Rm; required with a group"""
    roughness: Annotated[float, Quantity("m", least=1e-6, most=1e-3)] = 25e-6
    """with a group: Rz of the surface; 1 µm of a polished one"""
    endurance_stress: PositivePressure | None = None
    """of an S-N curve: the amplitude with mean 0 at `endurance_cycles`, of the surface as it is"""
    endurance_cycles: Annotated[float, Quantity("1", least=1e3)] = 1e6
    """where the curve bends"""
    slope: Factor | None = None
    """k of N ~ amplitude^-k above; 5 with a group"""
    slope_beyond: Annotated[float | Literal["endless"], BeforeValidator(slope_or_endless)] | None = None
    """k below; `"endless"`: smaller amplitudes do no damage. If not given 2 k - 1, with a group of aluminium 15"""
    mean_stress_sensitivity: Sensitivity | None = None
    """M: by how much endurable amplitudes fall with the mean stress; of the group if not given, else required"""
    strain_life: StrainLife | None = None
    """instead of a group or an S-N curve"""

    @model_validator(mode="after")
    def _one_of_three(self) -> Self:
        kinds = ("group", "endurance_stress", "strain_life")
        given = [key for key in kinds if getattr(self, key) is not None]
        if len(given) != 1:
            got = " and ".join(given) or "none of them"
            refuse([Fault((), f"must have one of group, endurance_stress, strain_life, got {got}")])
        faults = [*self._missing(given[0]), *self._impossible()]
        refuse(faults)
        return self

    def _missing(self, kind: str) -> Iterator[Fault]:
        """Faults of keys that the kind of data requires or does not have."""
        required = {
            "group": ("tensile_strength",),
            "endurance_stress": ("slope", "mean_stress_sensitivity"),
            "strain_life": ("mean_stress_sensitivity",),
        }
        foreign = {
            "group": ("endurance_cycles",),
            "endurance_stress": ("roughness",),
            "strain_life": ("slope", "slope_beyond", "roughness"),
        }
        for key in required[kind]:
            if getattr(self, key) is None:
                yield Fault((key,), f"is required with {kind}, got nothing")
        for key in foreign[kind]:
            # keys with their default value are allowed, since a stored scene has every key
            if getattr(self, key) != type(self).model_fields[key].default:
                yield Fault((key,), f"must be left out with {kind}, got one")

    def _impossible(self) -> Iterator[Fault]:
        """Faults of numbers that contradict each other."""
        Rm = self.tensile_strength
        if self.group is not None and Rm is not None:
            least, most = STRENGTHS["aluminium" if "aluminium" in self.group else "steel"]
            if not least <= Rm <= most:
                wanted = f"must be between {least:.4g} and {most:.4g} [Pa] for {self.group}"
                yield Fault(("tensile_strength",), f"{wanted}, where the guideline's formulas hold, got {Rm:.6g}")
        strength = self.endurance_stress
        if Rm is not None and strength is not None and strength >= Rm:
            wanted = f"must be below the tensile strength, {Rm:.6g} [Pa]"
            yield Fault(("endurance_stress",), f"{wanted}, got {strength:.6g}")
        if isinstance(self.slope_beyond, float) and self.slope is not None and self.slope_beyond < self.slope:
            wanted = f"must be at least the slope above, {self.slope:g}"
            yield Fault(("slope_beyond",), f"{wanted}, got {self.slope_beyond:g}: smaller amplitudes last longer")
        data = self.strain_life
        if data is not None and data.ductility_exponent >= data.strength_exponent:
            wanted = f"must be below strength_exponent, {data.strength_exponent:g}"
            got = f"got {data.ductility_exponent:g}: plastic strains fall faster with life"
            yield Fault(("strain_life", "ductility_exponent"), f"{wanted}, {got}")


class Fatigue(Record):
    """Damage at the surfaces of elastic links by the stresses of the last period of a periodic motion."""

    materials: dict[MaterialName, FatigueData] = Field(default_factory=dict)
    """data by name of the material of links"""
    links: dict[LinkName, FatigueData] = Field(default_factory=dict)
    """data of single links, before those of their material"""
    period: PositiveTime | None = None
    """after which stresses repeat; if not given after which linkage, drive and loads are where they were, as for a steady
    motion; required without a drive, with several, and with one that does not rotate continuously or return"""
    criterion: Literal["auto", "signed_von_mises", "normal", "findley"] = "auto"
    """auto: signed von Mises stress where loading is proportional, elsewhere normal: range of the normal stress on the
    critical plane of those at right angles to the surface; findley: shear range with the largest normal stress"""
    proportional_within: Annotated[float, Quantity("1", above=0.0, below=1.0)] = 0.1
    """what is left of the stresses when the best proportional history is taken away, of the highest, up to which loading
    is proportional"""
    findley_factor: Annotated[float, Quantity("1", above=0.0, most=1.0)] = 0.3
    """k of Findley's shear amplitude + k times the largest normal stress"""
    safety_factor: Annotated[float, Quantity("1", least=1.0)] = 1.5
    """of utilisations"""
    required_life: PositiveTime | None = None
    """for which utilisations hold, such as `"20000 h"`; endless if not given"""
    near_joints: StrictBool = False
    """whether points near corners, point forces, surfaces of joints and cuts count, where stress is uncertain"""

    @model_validator(mode="after")
    def _some_data(self) -> Self:
        if not self.materials and not self.links:
            wanted = "is required, or links: data of at least one of them"
            refuse([Fault(("materials",), f"{wanted}, got nothing")])
        return self
