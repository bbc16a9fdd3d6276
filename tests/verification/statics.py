"""Deflection and stress at rest: NAFEMS LE10, the beams of MacNeal and Harder."""

import numpy as np

from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.section import rectangle
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.recovery import nodal_stress, stress_recovery
from kedfem.links.surfaces.coupling_surfaces import face_surface, surface_weights
from kedfem.scene import Material

from .cases import Row, case
from .linear import deflection, free_map, held, mean_support
from .meshes import Mapping, between_ellipses, box, mapped_link, model

MACNEAL = "MacNeal, Harder: A proposed standard set of problems to test finite element accuracy, FEAD 1 (1985) 3–20"
LE10 = "The Standard NAFEMS Benchmarks, TNSB rev. 3 (1990), test LE10"
PLATE = Material(density=1, youngs_modulus=210e9, poisson_ratio=0.3)
D = np.array([2.0, 0.0, 0.6])


def thick_plate(counts: tuple[int, int, int]) -> tuple[Link, np.ndarray]:
    """LE10's quarter plate between two ellipses and its deflection under 1 MPa.

    counts : elements from ellipse to ellipse, around, through the thickness
    """

    link = mapped_link(counts, lambda r, s, t: (*between_ellipses(r, s), 0.6 * t), PLATE)
    x, y, z = link.X.T
    outer = np.abs((x / 3.25) ** 2 + (y / 2.75) ** 2 - 1) < 1e-9
    middle = outer & (np.abs(z - 0.3) < 1e-9)
    T = free_map(link, held((np.abs(y) < 1e-9, "y"), (np.abs(x) < 1e-9, "x"), (outer, "xy"), (middle, "z")))
    top = face_surface(link, "top", np.array([2.6, 0.1, 0.6]))
    return link, deflection(link, T, np.outer(surface_weights(link, top), [0, 0, -1e6]))


def stress_at_D(counts: tuple[int, int, int], cap: float) -> list[Row]:
    """σyy at D, by a probe and by the nodal field."""
    link, u = thick_plate(counts)
    probe = (point_rows(link, "D", D).stress @ u.ravel())[1] / 1e6
    nodal = nodal_stress(stress_recovery(link), u)[np.linalg.norm(link.X - D, axis=1).argmin(), 1] / 1e6
    text = model(counts, link)
    names = ("σyy at D, probe [MPa]", "σyy at D, nodal field [MPa]")
    return [Row(n, -5.38, float(s), cap, text) for n, s in zip(names, (probe, nodal), strict=True)]


@case("NAFEMS LE10: thick plate", LE10)
def thick_plate_stress() -> list[Row]:
    """6 elements around, 4 across, 2 through the thickness, and one refinement."""
    return stress_at_D((4, 6, 2), 0.025) + stress_at_D((8, 12, 4), 0.006)


@case("NAFEMS LE10: thick plate, fine", LE10, long=True)
def thick_plate_stress_fine() -> list[Row]:
    """Two refinements."""
    return stress_at_D((16, 24, 8), 0.002)


SLENDER = Material(density=1, youngs_modulus=1e7, poisson_ratio=0.3)


def leaning(x: np.ndarray, y: np.ndarray, lean: tuple[float, ...]) -> np.ndarray:
    """x with the cross-sections at x = 0…6 leaning at 45° one way or the other."""
    return x + np.interp(x, np.arange(7), lean) * y


def rectangular(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return x


def trapezoidal(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return leaning(x, y, (0, 1, -1, 1, -1, 1, 0))


def parallelogram(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return leaning(x, y, (0, 1, 1, 1, 1, 1, 0))


SHAPES = {"rectangular": rectangular, "trapezoidal": trapezoidal, "parallelogram": parallelogram}


def straight_beam(counts: tuple[int, int, int], shape: str = "rectangular", nodes: int = 27) -> Link:
    """The beam 6 × 0.2 × 0.1, with MacNeal and Harder's shapes of elements."""
    straight: Mapping = box((6, 0.2, 0.1), (0, -0.1, -0.05))

    def mapping(r: np.ndarray, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
        x, y, z = straight(r, s, t)
        return SHAPES[shape](x, y), y, z

    return mapped_link(counts, mapping, SLENDER, nodes)


def tip_deflections(link: Link) -> np.ndarray:
    """(4,) extension, in-plane and out-of-plane deflection, twist of the tip: unit forces and a unit couple.

    The root is held as beam theory has it, in the mean: free to contract and to warp.
    """
    T = mean_support(link, (np.zeros(3), [(0, "xyz"), (1, "xz"), (2, "xy")]))
    surface = face_surface(link, "tip", np.array([6.0, 0, 0]))
    area = surface_weights(link, surface)
    loads = [np.outer(area / area.sum(), axis) for axis in np.eye(3)]
    loads.append(np.stack([0 * area, -surface.fit[3] / 2, surface.fit[2] / 2], axis=1))  # work = mean rotation about x
    return np.array([(f * deflection(link, T, f)).sum() for f in loads])


def saint_venant_twist() -> float:
    """T L / (G J) of the beam 6 × 0.2 × 0.1 under a unit couple.

    Timoshenko and Goodier, Theory of Elasticity, art. 109.
    """
    a, b, n = 0.2, 0.1, np.arange(1, 40, 2)
    J = a * b**3 / 3 * (1 - 192 / np.pi**5 * b / a * (np.tanh(n * np.pi * a / (2 * b)) / n**5).sum())
    return float(6 / (SLENDER.shear_modulus * J))


LOADS = ["extension", "in-plane shear", "out-of-plane shear"]
PUBLISHED = [3.0e-5, 0.1081, 0.4321]


@case("MacNeal–Harder: straight beam", MACNEAL)
def straight_beams() -> list[Row]:
    """Their six elements in three shapes, and a finer mesh.

    The published twist, 0.03208, is 6 % less than Saint-Venant's exact solution, 0.03411, to which the solid
    converges.
    """
    out = []
    for shape, cap in (("rectangular", 0.008), ("trapezoidal", 0.02), ("parallelogram", 0.02)):
        link = straight_beam((6, 1, 1), shape)
        got, text = tip_deflections(link), model((6, 1, 1), link)
        caps = (1e-8, cap, cap)  # extension is linear, so every mesh must have it to rounding
        for name, target, value, limit in zip(LOADS, PUBLISHED, got, caps, strict=False):
            out.append(Row(f"{name}, {shape}", target, float(value), limit, text))
    counts = (24, 4, 4)
    link = straight_beam(counts)
    got, text = tip_deflections(link), model(counts, link)
    out += [Row(n, t, float(g), 0.0005, text) for n, t, g in zip(LOADS, PUBLISHED, got, strict=False)]
    twist = [("twist, published", 0.03208, 0.065), ("twist, Saint-Venant", saint_venant_twist(), 0.003)]
    return out + [Row(n, t, float(got[3]), cap, text) for n, t, cap in twist]


@case("MacNeal–Harder: straight beam, planar beam elements", MACNEAL)
def straight_planar_beams() -> list[Row]:
    """Six elements, bent about either axis (slenderness 30, 60): full integration of the shear would lock."""
    out = []
    for name, target, section in zip(LOADS[1:], PUBLISHED[1:], (rectangle(0.2, 0.1), rectangle(0.1, 0.2)), strict=True):
        for nodes, cap in ((2, 0.008), (3, 0.0005)):
            link = beam_link("beam", np.array([[0.0, 0, 0], [6, 0, 0]]), section, SLENDER, 6, nodes)
            force = np.outer(link.X[:, 0] == 6, [0.0, 1.0, 0.0])
            v = deflection(link, free_map(link, held((link.X[:, 0] == 0, "xyz"))), force)
            out.append(Row(name, target, float((force * v).sum()), cap, f"6 beam{nodes}, {3 * link.n} unknowns"))
    return out


def twisted_beam(counts: tuple[int, int, int]) -> tuple[Link, np.ndarray]:
    """The beam 12 × 1.1 × 0.32, twisted by 90°, clamped; its tip under unit forces.

    The forces are along the width and the thickness that the beam has at its root.
    """

    def mapping(r: np.ndarray, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
        y, z, c, d = 1.1 * (s - 0.5), 0.32 * (t - 0.5), np.cos(np.pi / 2 * r), np.sin(np.pi / 2 * r)
        return 12 * r, y * c - z * d, y * d + z * c

    link = mapped_link(counts, mapping, Material(density=1, youngs_modulus=29e6, poisson_ratio=0.22))
    T = free_map(link, held((link.X[:, 0] < 1e-9, "xyz")))
    area = surface_weights(link, face_surface(link, "tip", np.array([12.0, 0, 0])))
    loads = [np.outer(area / area.sum(), axis) for axis in np.eye(3)[1:]]
    return link, np.array([(f * deflection(link, T, f)).sum() for f in loads])


@case("MacNeal–Harder: twisted beam", MACNEAL)
def twisted_beams() -> list[Row]:
    """Their mesh, 12 × 2 × 1, and one refinement."""
    out = []
    for counts, cap in (((12, 2, 1), 0.006), ((24, 4, 2), 0.002)):
        link, got = twisted_beam(counts)
        text = model(counts, link)
        names, targets = ("along the root's width", "along the root's thickness"), (1.7532e-3, 5.4245e-3)
        out += [Row(n, t, float(g), cap, text) for n, t, g in zip(names, targets, got, strict=True)]
    return out
