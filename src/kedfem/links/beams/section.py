"""Cross-sections of beams: area, second moments, torsion, shear, and the shear stresses of torsion."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from kedfem.scene import RectangleSection, RoundSection, SectionShape, TubeSection

TERMS = 200  # of the series of a rectangle in torsion: stress to 1e-5 on its edges, far better inside


@dataclass(frozen=True, slots=True)
class Section:
    """Cross-section of a beam in principal axes: y along its width, z along its thickness; a planar beam bends in xy.

    kind : whether the shear stresses of torsion are known, and how it is drawn.
    height, thickness : extents along y and z [m]: the outer fibres are at half of them.
    area : A [m²].
    second_moment, second_moment_z : I_y = ∫ y² dA and I_z = ∫ z² dA [m⁴].
    torsion_constant : J of Saint-Venant's torsion [m⁴].
    shear_coefficients : κ of κGA along y and along z [-].
    bore : inner diameter of a tube, else 0 [m].
    """

    kind: Literal["rectangle", "round", "tube", "constants"]
    height: float
    thickness: float
    area: float
    second_moment: float
    second_moment_z: float
    torsion_constant: float
    shear_coefficients: tuple[float, float]
    bore: float = 0.0

    @property
    def shear_coefficient(self) -> float:
        """κ of a beam that bends in its xy plane [-]."""
        return self.shear_coefficients[0]


def rectangle(height: float, thickness: float, shear_coefficient: float = 5 / 6) -> Section:
    """A rectangular section, height along y [m]."""
    h, t = height, thickness
    return Section(
        "rectangle", h, t, h * t, t * h**3 / 12, h * t**3 / 12, rectangle_torsion(h, t),
        (shear_coefficient, shear_coefficient),
    )  # fmt: skip


def tube(diameter: float, bore: float, shear_coefficient: float) -> Section:
    """A ring between two circles, solid if the bore is 0 [m]."""
    moment = np.pi / 64 * (diameter**4 - bore**4)
    return Section(
        "tube" if bore else "round", diameter, diameter, np.pi / 4 * (diameter**2 - bore**2), moment, moment,
        2 * moment, (shear_coefficient, shear_coefficient), bore,
    )  # fmt: skip


def scene_section(shape: SectionShape, shear_coefficient: float | None, poisson_ratio: float) -> Section:
    """A section of the scene.

    Parameters
    ----------
    shear_coefficient : for both directions, in place of the section's own; 5/6 for a rectangle, Cowper's for circles
    """
    k = shear_coefficient
    match shape:
        case RectangleSection():
            return rectangle(shape.width, shape.thickness, k or 5 / 6)
        case RoundSection():
            return tube(shape.diameter, 0.0, k or cowper(poisson_ratio, 0.0))
        case TubeSection():
            bore = shape.diameter - 2 * shape.wall
            return tube(shape.diameter, bore, k or cowper(poisson_ratio, bore / shape.diameter))
    both = (k, k) if k else (shape.shear_coefficient_width, shape.shear_coefficient_thickness)
    return Section(
        "constants", shape.width, shape.thickness, shape.area, shape.second_moment_width,
        shape.second_moment_thickness, shape.torsion_constant, both,
    )  # fmt: skip


def cowper(poisson_ratio: float, m: float) -> float:
    """Shear coefficient of a circle with a bore m times its diameter: Cowper, J. Appl. Mech. 33 (1966)."""
    ring = (1 + m**2) ** 2
    return (
        6 * (1 + poisson_ratio) * ring / ((7 + 6 * poisson_ratio) * ring + (20 + 12 * poisson_ratio) * m**2)
    )


def rectangle_torsion(height: float, thickness: float) -> float:
    """J of a rectangle by Saint-Venant's series: a b³/3 (1 − 192/π⁵ (b/a) Σ tanh(nπa/2b)/n⁵), n odd, b ≤ a [m⁴]."""
    b, a = sorted((height, thickness))
    n = np.arange(1, TERMS, 2)
    return float(
        a * b**3 / 3 * (1 - 192 / np.pi**5 * b / a * np.sum(np.tanh(n * np.pi * a / (2 * b)) / n**5))
    )


def torsion_stress(section: Section, y: float, z: float) -> tuple[float, float]:
    """Shear stresses (xy, xz) of torsion at a point of the section, per G and twist [m].

    Of a circle (−z, y); of a rectangle from Prandtl's stress function, (∂φ/∂z, −∂φ/∂y); of constants alone unknown: 0.
    """
    match section.kind:
        case "round" | "tube":
            return -z, y
        case "rectangle" if section.height >= section.thickness:
            along_z, along_y = _prandtl_slopes(section.height, section.thickness, y, z)
            return along_z, -along_y
        case "rectangle":
            along_y, along_z = _prandtl_slopes(section.thickness, section.height, z, y)
            return along_z, -along_y
        case _:
            return 0.0, 0.0


def _prandtl_slopes(a: float, b: float, s: float, t: float) -> tuple[float, float]:
    """∂φ/∂t and ∂φ/∂s of −∇²φ = 2 on a rectangle a × b, φ = 0 on its edges, t along the shorter side b."""
    n = np.arange(1, TERMS, 2)
    k = n * np.pi / b
    series = 8 * b / np.pi**2 * np.where(n % 4 == 1, 1.0, -1.0) / n**2
    edge = np.exp(-k * a)
    rise, fall = np.exp(k * (s - a / 2)), np.exp(-k * (s + a / 2))
    cosh, sinh = (rise + fall) / (1 + edge), (rise - fall) / (1 + edge)  # over cosh(k a/2), without overflow
    along_t = -2 * t + np.sum(series * cosh * np.sin(k * t))
    along_s = -np.sum(series * sinh * np.cos(k * t))
    return float(along_t), float(along_s)


def outline(section: Section) -> tuple[Float[np.ndarray, "c 2"], Int[np.ndarray, "q 4"]]:
    """Points (y, z) of a section and quadrilaterals between them, to draw it."""
    h, t = section.height / 2, section.thickness / 2
    if section.kind in {"rectangle", "constants"}:
        points = np.array(
            [[y, z] for z in (-t, 0.0, t) for y in (-h, 0.0, h)]
        )  # torsion is worst at middles of sides
        return points, np.array([[k, k + 1, k + 4, k + 3] for k in (0, 1, 3, 4)])
    count = 16
    angle = 2 * np.pi * np.arange(count) / count
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    inner, first = np.arange(count), np.arange(count)
    ring = np.stack([inner, inner + count, (first + 1) % count + count, (first + 1) % count], axis=1)
    core = section.bore / 2 if section.bore else h / 2
    points = np.concatenate([core * circle, h * circle])
    if section.bore:
        return points, ring
    middle = [[2 * count, 2 * k, 2 * k + 1, (2 * k + 2) % count] for k in range(count // 2)]
    return np.concatenate([points, np.zeros((1, 2))]), np.concatenate([ring, np.array(middle)])
