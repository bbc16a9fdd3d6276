"""Beams in space: Timoshenko's frequencies, bent and curved cantilevers by Castigliano, twisted beams, solids beside."""

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.optimize

from kedfem.links.beams.beam_axis import Axis, smooth_axis, straight_axis
from kedfem.links.beams.section import Section, rectangle, tube
from kedfem.links.beams.spatial_beam import spatial_beam_link
from kedfem.links.record import Link
from kedfem.scene import Material

from .cases import Row, case
from .linear import deflection, free_map, frequencies, held, modes, vector_mass
from .meshes import box, mapped_link, model
from .statics import MACNEAL
from .vibrations import AXIAL, BENDING, DEEP, NAFEMS, STEEL, TORSION

ALLOY = Material(density=2700, youngs_modulus=70e9, poisson_ratio=0.33)
ROOT = np.arange(12)  # all unknowns of the first node, a hub
FLAT = rectangle(0.03, 0.02)


def straight(points: list[list[float]], section: Section, elements: int, nodes: int = 3) -> Link:
    """A beam of straight segments."""
    return spatial_beam_link("beam", straight_axis(np.array(points, float), elements, nodes, None), section, ALLOY)


def text_of(link: Link, elements: str) -> str:
    return f"{elements}, {link.unknowns:,} unknowns"


def tip_displacement(link: Link, force: np.ndarray) -> np.ndarray:
    """Of the last node under a force there, the first node clamped."""
    f = np.zeros((link.n, 3))
    tip = np.flatnonzero(link.one)[-1]
    f[tip] = force
    return deflection(link, free_map(link, ROOT), f)[tip]


# -- frequencies --------------------------------------------------------------------------------------------


def clamped_timoshenko(n: int, length: float, section: Section, material: Material, about_z: bool) -> float:
    """Frequency n of a cantilever with shear and rotary inertia [Hz], from the roots of its transfer matrix.

    w' = θ + V/κGA, θ' = M/EI, M' = −V − ρI ω² θ, V' = −ρA ω² w; w = θ = 0 at the root, M = V = 0 at the tip.

    about_z : bending along y, the section's height
    """
    E, rho, A, L = material.youngs_modulus, material.density, section.area, length
    k1, k2 = section.shear_coefficients
    I, k = (section.second_moment, k1) if about_z else (section.second_moment_z, k2)  # noqa: E741
    shear = E * I / (k * material.shear_modulus * A * L**2)

    def closed(x: float) -> float:
        """Of ω = x √(EI/ρA)/L²."""
        M = np.array([[0, 1, 0, shear], [0, 0, 1, 0], [0, -(x**2) * I / (A * L**2), 0, -1], [-(x**2), 0, 0, 0]])
        return float(np.linalg.det(scipy.linalg.expm(M)[2:, 2:]))

    trial = np.linspace(0.5, (n + 0.5) ** 2 * np.pi**2, 400 * n)
    signs = np.sign([closed(x) for x in trial])
    root = np.flatnonzero(np.diff(signs))[n - 1]
    x = scipy.optimize.brentq(closed, trial[root], trial[root + 1], xtol=1e-13)
    return float(x * np.sqrt(E * I / (rho * A)) / L**2 / (2 * np.pi))


def cantilever_modes(link: Link, count: int, near: float) -> dict[str, list[float]]:
    """Frequencies of a clamped beam along x by what moves: bending along y and z, torsion, axial."""
    found, vectors = modes(link, free_map(link, ROOT), count, near)
    M, value = vector_mass(link), link.one != 0
    masks = {name: np.zeros((link.n, 3)) for name in ("along y", "along z", "torsion", "axial")}
    for name, component in (("axial", 0), ("along y", 1), ("along z", 2)):
        masks[name][value, component] = 1
    masks["torsion"][~value, 1:] = 1
    out: dict[str, list[float]] = {name: [] for name in masks}
    for f, v in zip(found, vectors.T, strict=True):
        energy = {name: (v * mask.ravel()) @ M @ (v * mask.ravel()) for name, mask in masks.items()}
        out[max(energy, key=lambda name: energy[name])].append(float(f))
    return out


def wanted_modes(length: float, section: Section) -> dict[str, list[float]]:
    """The lowest three exact frequencies of each kind [Hz]."""
    polar = section.second_moment + section.second_moment_z
    torsion = np.sqrt(ALLOY.shear_modulus * section.torsion_constant / (ALLOY.density * polar)) / (4 * length)
    axial = np.sqrt(ALLOY.youngs_modulus / ALLOY.density) / (4 * length)
    bending = {
        name: [clamped_timoshenko(n, length, section, ALLOY, about_z) for n in (1, 2, 3)]
        for name, about_z in (("along y", True), ("along z", False))
    }
    return {**bending, "torsion": [torsion, 3 * torsion], "axial": [axial]}


@case("Cantilevers in space", "Timoshenko's equations with the section's κ, solved exactly; Saint-Venant's torsion")
def cantilevers() -> list[Row]:
    """A rectangle and a tube, 20 sections long."""
    out = []
    for name, section in (("rectangle", FLAT), ("tube", tube(0.03, 0.02, 0.6))):
        link = straight([[0, 0, 0], [0.5, 0, 0]], section, 16)
        wanted = wanted_modes(0.5, section)
        if name == "tube":  # both planes alike, so that its modes are reported by neither
            found = frequencies(link, free_map(link, ROOT), 2, 80)
            out += [
                Row(f"{name}, bending 1 [Hz]", wanted["along y"][0], float(f), 1e-5, text_of(link, "16 beam3"))
                for f in found
            ]
            continue
        got = cantilever_modes(link, 14, 80)
        out += [
            Row(f"{name}, {kind} {k + 1} [Hz]", f, got[kind][k], 2.5e-4, text_of(link, "16 beam3"))
            for kind, exact in wanted.items()
            for k, f in enumerate(exact)
        ]
    return out


@case("NAFEMS FV5: deep beam, beam elements in space", f"{NAFEMS}, test FV5")
def deep_beam_in_space() -> list[Row]:
    """Supports as of the solid: (u, v, w) and the rotation about x at one end, (v, w) at the other."""
    axis = straight_axis(np.array([[0.0, 0, 0], [10, 0, 0]]), 40, 3, None)
    link = spatial_beam_link("beam", axis, DEEP, STEEL)
    number = np.arange(link.n)
    left, right = (number == 0), (number == link.n - 4)
    T = free_map(link, held((left, "xyz"), (number == 2, "z"), (number == 3, "y"), (right, "yz")))
    got = frequencies(link, T, 8, 42.6)
    names = ["bending 1", "bending 1", "torsion 1", "axial 1", "bending 2", "bending 2", "torsion 2", "bending 3"]
    targets = [BENDING[0], BENDING[0], TORSION, AXIAL, BENDING[1], BENDING[1], 3 * TORSION, BENDING[2]]
    return [
        Row(f"{n} [Hz]", t, float(g), 1e-3 if "torsion" in n else 5e-5, text_of(link, "40 beam3"))
        for n, t, g in zip(names, targets, got, strict=True)
    ]


# -- statics ------------------------------------------------------------------------------------------------


def bent_cantilever(a: float, b: float, section: Section) -> dict[str, float]:
    """Tip compliances of a beam a along x, then b along y, by Castigliano with shear and extension [m/N]."""
    E, G, A = ALLOY.youngs_modulus, ALLOY.shear_modulus, section.area
    (k1, k2), Iy, Iz = section.shear_coefficients, section.second_moment, section.second_moment_z
    return {
        "x": (a * b**2 + b**3 / 3) / (E * Iy) + a / (E * A) + b / (k1 * G * A),
        "y": a**3 / (3 * E * Iy) + a / (k1 * G * A) + b / (E * A),
        "z": (a**3 + b**3) / (3 * E * Iz) + a * b**2 / (G * section.torsion_constant) + (a + b) / (k2 * G * A),
    }


@case("Bent cantilever", "Castigliano's theorem with shear and extension")
def bent() -> list[Row]:
    """An L of 0.5 m and 0.3 m, section 30 × 20 mm: one element per leg has the exact tip displacement of the cubic."""
    link = straight([[0, 0, 0], [0.5, 0, 0], [0.5, 0.3, 0]], FLAT, 1)
    out = []
    for axis, exact in bent_cantilever(0.5, 0.3, FLAT).items():
        k = "xyz".index(axis)
        got = tip_displacement(link, np.eye(3)[k])[k]
        out.append(Row(f"force along {axis} [m/N]", exact, float(got), 1e-5, text_of(link, "1 beam3 a leg")))
    return out


def quarter_circle(radius: float, section: Section) -> dict[str, float]:
    """Tip compliances of a quarter circle from its root along x to its tip along y, by Castigliano [m/N]."""
    E, G, A, R = ALLOY.youngs_modulus, ALLOY.shear_modulus, section.area, radius
    (k1, k2), Iy, Iz = section.shear_coefficients, section.second_moment, section.second_moment_z
    quarter = np.pi / 4
    return {
        "x": quarter * R**3 / (E * Iy) + quarter * R / (E * A) + quarter * R / (k1 * G * A),
        "y": (3 * quarter - 2) * R**3 / (E * Iy) + quarter * R / (E * A) + quarter * R / (k1 * G * A),
        "z": quarter * R**3 / (E * Iz)
        + (3 * quarter - 2) * R**3 / (G * section.torsion_constant)
        + 2 * quarter * R / (k2 * G * A),
    }


def curved_cantilever(radius: float, section: Section, points: int) -> Link:
    """The quarter circle as a smooth curve through so many points, one element between them."""
    angle = np.linspace(0, np.pi / 2, points)
    P = radius * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    return spatial_beam_link("arc", smooth_axis(P, 1, 3, None), section, ALLOY)


@case("Curved cantilever", "Castigliano's theorem with shear and extension, for a thin curve")
def curved() -> list[Row]:
    """A quarter circle of 0.5 m, section 30 × 20 mm, by a spline through 17 points."""
    link = curved_cantilever(0.5, FLAT, 17)
    out = []
    for axis, exact in quarter_circle(0.5, FLAT).items():
        k = "xyz".index(axis)
        got = tip_displacement(link, np.eye(3)[k])[k]
        out.append(Row(f"force along {axis} [m/N]", exact, float(got), 1e-4, text_of(link, "16 beam3")))
    return out


@case("MacNeal–Harder: twisted beam, beam elements in space", MACNEAL)
def twisted_in_space() -> list[Row]:
    """Their 12 elements; the directions of the section rotate by 90° along the axis."""
    s = np.arange(25)
    angle = s / 24 * np.pi / 2
    frame = np.zeros((25, 4, 3))
    frame[:, 0, 0], frame[:, 1, 0] = 12 * s / 24, 1
    frame[:, 2, 1], frame[:, 2, 2] = np.cos(angle), np.sin(angle)
    frame[:, 3] = np.cross(frame[:, 1], frame[:, 2])
    cells = np.stack([s[:-1:2], s[2::2], s[1::2]], axis=1)
    material = Material(density=1, youngs_modulus=29e6, poisson_ratio=0.22)
    link = spatial_beam_link("beam", Axis(frame, s, cells, s % 24 == 0), rectangle(1.1, 0.32), material)
    got = [tip_displacement(link, np.eye(3)[k])[k] for k in (1, 2)]
    names, targets = ("along the root's width", "along the root's thickness"), (1.7532e-3, 5.4245e-3)
    # not the solid's: 0.2 % is what the section's shape is worth beside Timoshenko's theory
    return [Row(n, t, float(g), 0.0025, text_of(link, "12 beam3")) for n, t, g in zip(names, targets, got, strict=True)]


# -- solids -------------------------------------------------------------------------------------------------


def mitred(a: float, b: float, height: float, thickness: float) -> Callable[..., tuple[np.ndarray, ...]]:
    """The unit cube as an L whose axis goes a along x, then b along y, cut at 45° in the corner, r = 5/8."""

    def mapping(r: np.ndarray, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
        o, corner = height * (s - 0.5), 5 / 8
        first = np.minimum(r / corner, 1.0)
        second = np.maximum((r - corner) / (1 - corner), 0.0)
        return first * (a - o), o + second * (b - o), thickness * (t - 0.5)

    return mapping


@case("Beams in space beside solids", "27-node hexahedra of the same bar, clamped on its end face")
def beside_solids() -> list[Row]:
    """First frequencies, 50 and 80 sections long.

    The solid is stiffer: its clamped face cannot contract (ν = 0.33), and its corner has a width, which matters most
    in the fourth mode of the L.
    """
    height, thickness = 0.01, 0.008
    section = rectangle(height, thickness)
    out = []
    shapes = {
        "bar": ([[0, 0, 0], [0.5, 0, 0]], (60, 2, 2), box((0.5, height, thickness), (0, -height / 2, -thickness / 2))),
        "L": ([[0, 0, 0], [0.5, 0, 0], [0.5, 0.3, 0]], (96, 3, 3), mitred(0.5, 0.3, height, thickness)),
    }
    for name, (points, counts, mapping) in shapes.items():
        solid = mapped_link(counts, mapping, ALLOY)
        beam = straight(points, section, 8)
        wanted = frequencies(solid, free_map(solid, held((solid.X[:, 0] < 1e-9, "xyz"))), 4, 20)
        got = frequencies(beam, free_map(beam, ROOT), 4, 20)
        text = f"8 beam3 a leg; {model(counts, solid)}"
        out += [
            Row(f"{name}, mode {k + 1} [Hz]", float(w), float(g), 0.012 if name == "L" and k == 3 else 0.005, text)
            for k, (w, g) in enumerate(zip(wanted, got, strict=True))
        ]
    return out
