"""Cross-sections of beams: area, second moments, torsion, shear, and the shear stresses of torsion."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.scene import BoxSection, ISection, RectangleSection, RoundSection, SectionShape, TubeSection

EDGE = 1e-9  # of a wall: points on its edge are in it
CORNER = 4 * (1 - 0.5587)  # wall thicknesses by which the shear flow round four corners is shorter than the middle line
ROUND = 0.41  # squares of the wall thickness by which it encloses less area, measured (tests/laws/test_sections.py)
TERMS = 200  # of the series of a rectangle in torsion: relative error of stress 1e-5 on its edges, less inside


@dataclass(frozen=True, slots=True)
class Section:
    """Cross-section of a beam in principal axes: y along its width, z along its thickness; a planar beam bends in xy.

    kind : its shape, by which it is drawn; with `constants` alone the shear stresses of torsion are unknown.
    height, thickness : extents along y and z [m]: the outer fibres are at half of them.
    area : A [m²].
    second_moment, second_moment_z : I_y = ∫ y² dA and I_z = ∫ z² dA [m⁴].
    torsion_constant : J of Saint-Venant's torsion [m⁴].
    shear_coefficients : κ of κGA along y and along z [-].
    bore : inner diameter of a tube, else 0 [m].
    walls : thickness of the walls along y and of those along z, of a box or an I, else 0 [m].
    """

    kind: Literal["rectangle", "round", "tube", "box", "i", "constants"]
    height: float
    thickness: float
    area: float
    second_moment: float
    second_moment_z: float
    torsion_constant: float
    shear_coefficients: tuple[float, float]
    bore: float = 0.0
    walls: tuple[float, float] = (0.0, 0.0)

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


def box(height: float, thickness: float, wall: float, shear_coefficients: tuple[float, float]) -> Section:
    """A rectangular tube with sharp corners, height along y [m]; torsion by Bredt, and of the walls by themselves.

    EN 10210-2 has the same without `CORNER` and `ROUND`: 2 to 5 % too soft with walls of a tenth of the sides.
    """
    h, t, w = height, thickness, wall
    inner_h, inner_t = h - 2 * w, t - 2 * w
    area, around = _flow(h, t, w)
    own = w**3 * 2 * (h + t - 2 * w) / 3
    return Section(
        "box", h, t, h * t - inner_h * inner_t, (t * h**3 - inner_t * inner_h**3) / 12,
        (h * t**3 - inner_h * inner_t**3) / 12, own + 4 * area**2 * w / around, shear_coefficients,
        walls=(w, w),
    )  # fmt: skip


def i_profile(
    height: float, thickness: float, web: float, flange: float, shear_coefficients: tuple[float, float]
) -> Section:
    """Two flanges and a web between them, height along y over both [m]; torsion by El Darwish and Johnston, free to warp.

    M. El Darwish, B. Johnston, Torsion of structural shapes, J. Struct. Div. ASCE 91 (1965): b t³/3 of each wall, with
    corrections at the flanges' ends and where web and flange meet.
    """
    h, b, s, f = height, thickness, web, flange
    inner = h - 2 * f
    ratio = s / f
    meeting = -0.042 + 0.2204 * ratio - 0.0725 * ratio**2
    torsion = 2 / 3 * b * f**3 * (1 - 0.63 * f / b) + inner * s**3 / 3 + 2 * meeting * (f + s**2 / (4 * f)) ** 4
    return Section(
        "i", h, b, 2 * b * f + inner * s, (b * h**3 - (b - s) * inner**3) / 12,
        (2 * f * b**3 + inner * s**3) / 12, torsion, shear_coefficients, walls=(s, f),
    )  # fmt: skip


def _flow(h: float, t: float, wall: float) -> tuple[float, float]:
    """Area that the shear flow round a box encloses [m²], and its length [m]."""
    return (h - wall) * (t - wall) - ROUND * wall**2, 2 * (h + t - 2 * wall) - CORNER * wall


def scene_section(shape: SectionShape, shear_coefficient: float | None, poisson_ratio: float) -> Section:
    """A section of the scene.

    Parameters
    ----------
    shear_coefficient : for both directions, in place of the section's own; 5/6 for a rectangle, Cowper's for circles,
        boxes and along the web of an I; across it the flanges' 5/6
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
        case BoxSection(width=h, thickness=t, wall=w):
            own = (cowper_box(poisson_ratio, h - w, t - w), cowper_box(poisson_ratio, t - w, h - w))
            return box(h, t, w, (k, k) if k else own)
        case ISection(width=h, thickness=b, web=s, flange=f):
            flanges = 5 / 6 * 2 * b * f / (2 * b * f + (h - 2 * f) * s)
            return i_profile(h, b, s, f, (k, k) if k else (cowper_i(poisson_ratio, h - f, b, s, f), flanges))
    both = (k, k) if k else (shape.shear_coefficient_width, shape.shear_coefficient_thickness)
    return Section(
        "constants", shape.width, shape.thickness, shape.area, shape.second_moment_width,
        shape.second_moment_thickness, shape.torsion_constant, both,
    )  # fmt: skip


def cowper(poisson_ratio: float, m: float) -> float:
    """Shear coefficient of a circle with a bore m times its diameter: Cowper, J. Appl. Mech. 33 (1966)."""
    ring = (1 + m**2) ** 2
    return 6 * (1 + poisson_ratio) * ring / ((7 + 6 * poisson_ratio) * ring + (20 + 12 * poisson_ratio) * m**2)


def cowper_box(poisson_ratio: float, height: float, thickness: float) -> float:
    """Shear coefficient along the height of a box with equal thin walls, by its middle line: Cowper (1966)."""
    nu, m = poisson_ratio, thickness / height
    return _thin_walled(nu, m, 10 * m**2 * ((3 + nu) * m + 3 * m**2))


def cowper_i(poisson_ratio: float, height: float, thickness: float, web: float, flange: float) -> float:
    """Shear coefficient along the web of an I with thin walls, height between the flanges' middles: Cowper (1966)."""
    nu, m, n = poisson_ratio, 2 * thickness * flange / (height * web), thickness / height
    return _thin_walled(nu, m, 30 * n**2 * (m + m**2) + 5 * nu * n**2 * (8 * m + 9 * m**2))


def _thin_walled(nu: float, m: float, across: float) -> float:
    """The common part of Cowper's coefficients of a box and an I; `across`: the share of their flanges' width."""
    walls = 12 + 72 * m + 150 * m**2 + 90 * m**3 + nu * (11 + 66 * m + 135 * m**2 + 90 * m**3)
    return 10 * (1 + nu) * (1 + 3 * m) ** 2 / (walls + across)


def rectangle_torsion(height: float, thickness: float) -> float:
    """J of a rectangle by Saint-Venant's series: a b³/3 (1 − 192/π⁵ (b/a) Σ tanh(nπa/2b)/n⁵), n odd, b ≤ a [m⁴]."""
    b, a = sorted((height, thickness))
    n = np.arange(1, TERMS, 2)
    return float(a * b**3 / 3 * (1 - 192 / np.pi**5 * b / a * np.sum(np.tanh(n * np.pi * a / (2 * b)) / n**5)))


def torsion_stress(section: Section, y: float, z: float) -> tuple[float, float]:
    """Shear stresses (xy, xz) of torsion at a point of the section, per G and twist [m].

    Of a circle (−z, y); of a rectangle from Prandtl's stress function, (∂φ/∂z, −∂φ/∂y); of a box or an I along its walls,
    0 at the corners of a box; of constants alone unknown: 0.
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
        case "box" | "i":
            return _wall_stress(section, y, z)
        case _:
            return 0.0, 0.0


def _wall_stress(section: Section, y: float, z: float) -> tuple[float, float]:
    """Shear stresses in a wall: 2 A / s by the shear flow of a box, and twice the distance from its middle line."""
    along_y, along_z = section.walls
    from_flange = abs(y) - (section.height - along_z) / 2  # of the middle of a wall along z
    in_flange = from_flange >= -along_z / 2 * (1 + EDGE)
    if section.kind == "i":
        return (0.0, 2 * np.sign(y) * from_flange) if in_flange else (-2 * z, 0.0)
    area, around = _flow(section.height, section.thickness, along_y)
    from_web = abs(z) - (section.thickness - along_y) / 2
    in_web = from_web >= -along_y / 2 * (1 + EDGE)
    if in_flange == in_web:  # a corner, or inside
        return 0.0, 0.0
    flow = 2 * area / around
    if in_flange:
        return 0.0, float(np.sign(y) * (flow + 2 * from_flange))
    return float(-np.sign(z) * (flow + 2 * from_web)), 0.0


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


def nearest_in_section(section: Section, y: float, z: float) -> tuple[float, float]:
    """The point (y, z) of the material nearest to a given one [m]; on the axis itself, even where that is hollow."""
    half_y, half_z = section.height / 2, section.thickness / 2
    if np.hypot(y, z) <= EDGE * (half_y + half_z):
        return y, z
    if section.kind in {"round", "tube"}:
        along = np.clip(np.hypot(y, z), section.bore / 2, half_y) / np.hypot(y, z)
        return float(y * along), float(z * along)
    found = [(float(np.clip(y, *ys)), float(np.clip(z, *zs))) for ys, zs in _walls(section, half_y, half_z)]
    return min(found, key=lambda point: np.hypot(point[0] - y, point[1] - z))


def _walls(section: Section, h: float, t: float) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Rectangles of which a section with corners consists, as ranges of y and of z."""
    along_y, along_z = section.walls
    if section.kind not in {"box", "i"}:
        return [((-h, h), (-t, t))]
    flanges = [((-h, along_z - h), (-t, t)), ((h - along_z, h), (-t, t))]
    if section.kind == "i":
        return [*flanges, ((-h, h), (-along_y / 2, along_y / 2))]
    return [*flanges, ((-h, h), (-t, along_y - t)), ((-h, h), (t - along_y, t))]


def outline(section: Section) -> tuple[Float[np.ndarray, "c 2"], Int[np.ndarray, "q 4"]]:
    """Points (y, z) of a section and quadrilaterals between them, to draw it."""
    h, t = section.height / 2, section.thickness / 2
    if section.kind in {"rectangle", "constants"}:
        # torsion is worst at middles of sides
        points = np.array([[y, z] for z in (-t, 0.0, t) for y in (-h, 0.0, h)])
        return points, np.array([[k, k + 1, k + 4, k + 3] for k in (0, 1, 3, 4)])
    if section.kind == "box":
        return _box_outline(h, t, section.walls[0])
    if section.kind == "i":
        return _i_outline(h, t, *section.walls)
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


def _box_outline(h: float, t: float, wall: float) -> tuple[Float[np.ndarray, "c 2"], Int[np.ndarray, "q 4"]]:
    """Corners and middles of sides, outside and inside; h and t are half the extents."""
    round_it = np.array([[1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], float)
    k = np.arange(8)
    ring = np.stack([k + 8, k, (k + 1) % 8, (k + 1) % 8 + 8], axis=1)
    return np.concatenate([round_it * [h, t], round_it * [h - wall, t - wall]]), ring


def _i_outline(h: float, t: float, web: float, flange: float) -> tuple[Float[np.ndarray, "c 2"], Int[np.ndarray, "q 4"]]:
    """Both edges of the flanges at their ends and at the web, and the web's middle; h and t are half the extents."""
    columns, rows = (-t, -web / 2, web / 2, t), (-h, flange - h, h - flange, h)
    points = [[y, z] for y in rows for z in columns] + [[0.0, -web / 2], [0.0, web / 2]]
    flanges = [[k, k + 4, k + 5, k + 1] for first in (0, 8) for k in range(first, first + 3)]
    return np.array(points), np.array([*flanges, [5, 16, 17, 6], [16, 9, 10, 17]])
