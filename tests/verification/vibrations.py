"""Natural frequencies: NAFEMS FV32, FV52 and FV5, a nearly incompressible cube, the ring of SDLS109."""

import numpy as np
import scipy.linalg

from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.section import Section, rectangle
from kedfem.links.record import Link
from kedfem.scene import Material

from .cases import Row, case
from .linear import free_map, frequencies, frequency_of, held, mean_support
from .meshes import box, mapped_link, model

STEEL = Material(density=8000, youngs_modulus=200e9, poisson_ratio=0.3)  # of all NAFEMS FV tests used here
NAFEMS = "Abbassian, Dawswell, Knowles: Selected benchmarks for natural frequency analysis, NAFEMS R0015 (1987)"
CUBE = Material(density=1, youngs_modulus=1, poisson_ratio=0.499)


def rows(names: list[str], targets: list[float], got: np.ndarray, cap: float, text: str) -> list[Row]:
    """One row per frequency, all with the same cap."""
    return [Row(f"{n} [Hz]", t, float(g), cap, text) for n, t, g in zip(names, targets, got, strict=True)]


@case("NAFEMS FV32: tapered membrane", f"{NAFEMS}, test FV32")
def tapered_membrane() -> list[Row]:
    """Length 10, width 5 to 1, clamped at the wide end; half the thickness, symmetric about z = 0."""
    counts = (16, 8, 1)
    link = mapped_link(counts, lambda r, s, t: (10 * r, (s - 0.5) * (5 - 4 * r), 0.025 * t), STEEL)
    x, _, z = link.X.T
    got = frequencies(link, free_map(link, held((x == 0, "xyz"), (z == 0, "z"))), 6, 44.6)
    targets = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
    return rows([f"mode {k}" for k in range(1, 7)], targets, got, 0.0015, model(counts, link))


def plate(counts: tuple[int, int, int]) -> Link:
    """The plate 10 × 10 × 1 of FV52."""
    return mapped_link(counts, box((10, 10, 1)), STEEL)


@case("NAFEMS FV52: plate on its bottom edges", f"{NAFEMS}, test FV52; 20-node result: V2.03.502 of code_aster")
def plate_on_its_edges() -> list[Row]:
    """On the mesh that the test requires, 4 × 4 × 1.

    A line cannot support a solid: the deflection under a line force is infinite, so the frequencies of the
    out-of-plane modes sink without limit, though slowly (log h), as the mesh is refined. The target is plate
    theory; the second set of references is NAFEMS's own result with 20-node elements on the same mesh.
    """
    counts = (4, 4, 1)
    link = plate(counts)
    x, y, z = link.X.T
    edge = (z == 0) & ((x == 0) | (x == 10) | (y == 0) | (y == 10))
    got = frequencies(link, free_map(link, held((edge, "z"))), 10, 44.6)[3:]
    text = model(counts, link)
    names = ["mode 4", "mode 5", "mode 6", "mode 7", "mode 8 (in plane)", "mode 9", "mode 10"]
    targets = [45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19]
    twenty = [44.762, 110.52, 110.52, 169.08, 193.93, 206.64, 206.64]
    also = rows([f"{n}, against 20-node elements" for n in names], twenty, got, 0.018, text)
    return rows(names, targets, got, 0.028, text) + also


def plate_on_its_sides_exactly(m: int, n: int) -> float:
    """Lowest frequency [Hz] of the solid plate with m and n half waves, sides holding u_z and u_tangential.

    u = U(z) cos Ax sin By, v = V(z) sin Ax cos By, w = W(z) sin Ax sin By meets the sides exactly
    (Srinivas, Rao, Rao, J. Sound Vib. 12 (1970)); U, V, W by Galerkin with ten Legendre polynomials.
    """
    z, weight = np.polynomial.legendre.leggauss(20)
    N = np.polynomial.legendre.legvander(z, 9).T
    D = 2 * np.stack([np.polynomial.legendre.legval(z, np.polynomial.legendre.legder(e)) for e in np.eye(10)])
    A, B, o = m * np.pi / 10, n * np.pi / 10, 0 * N
    strains = [(-A * N, o, o), (o, -B * N, o), (o, o, D), (B * N, A * N, o), (o, D, B * N), (D, o, A * N)]
    e = np.array([np.concatenate(parts) for parts in strains])  # xx, yy, zz, xy, yz, zx
    lam, mu = STEEL.lame()
    C = np.diag([2 * mu] * 3 + [mu] * 3)
    C[:3, :3] += lam
    K = np.einsum("iaq,ij,jbq,q->ab", e, C, e, weight)
    M = STEEL.density * np.kron(np.eye(3), (N * weight) @ N.T)
    return float(np.sqrt(scipy.linalg.eigvalsh(K, M)[0]) / (2 * np.pi))


@case("FV52's plate, sides supported as in plate theory", f"{NAFEMS}, test 21 (same closed form); Srinivas et al. 1970")
def plate_on_its_sides() -> list[Row]:
    """u_z and the displacement along the side are zero on the sides: supports for which the target is exact.

    The remaining difference is that between Mindlin's plate theory and the solid: the second set is the solid's
    exact solution.
    """
    counts = (12, 12, 2)
    link = plate(counts)
    x, y, _ = link.X.T
    fixed = held(((x == 0) | (x == 10), "yz"), ((y == 0) | (y == 10), "xz"))
    got = frequencies(link, free_map(link, fixed), 6, 44.6)[[0, 1, 2, 5]]  # modes 4 and 5 are in-plane shear
    text, names = model(counts, link), ["mode 1", "mode 2", "mode 3", "mode 4"]
    exact = [plate_on_its_sides_exactly(m, n) for m, n in ((1, 1), (1, 2), (2, 1), (2, 2))]
    theory = rows([f"{n}, plate theory" for n in names], [45.897, 109.44, 109.44, 167.89], got, 0.007, text)
    return theory + rows([f"{n}, solid" for n in names], exact, got, 0.0015, text)


BENDING, TORSION, AXIAL = [42.6449, 148.1493, 283.4684], 71.2, 125.0  # exact (Timoshenko), FV5


def timoshenko(n: int, length: float, section: Section, material: Material) -> float:
    """Frequency n of a pinned beam with shear and rotary inertia [Hz]: Timoshenko, Phil. Mag. 41 (1921).

    EI k⁴ − ρA ω² [1 + k² (I/A)(1 + E/κG)] + ρ²I/(κG) ω⁴ = 0 with k = nπ/L.
    """
    E, G, rho = material.youngs_modulus, section.shear_coefficient * material.shear_modulus, material.density
    A, I, k = section.area, section.second_moment, n * np.pi / length  # noqa: E741
    b = rho * A * (1 + k**2 * I / A * (1 + E / G))
    a, c = rho**2 * I / G, E * I * k**4
    return float(np.sqrt(2 * c / (b + np.sqrt(b**2 - 4 * a * c))) / (2 * np.pi))


DEEP = rectangle(2.0, 2.0, shear_coefficient=10 * (1 + 0.3) / (12 + 11 * 0.3))  # Cowper's κ gives FV5's numbers


def pinned_beam(elements: int, nodes: int = 3) -> tuple[Link, np.ndarray]:
    """FV5's beam as planar beam elements, with its held unknowns: u, v at the left end, v at the right."""
    link = beam_link("beam", np.array([[0.0, 0, 0], [10, 0, 0]]), DEEP, STEEL, elements, nodes)
    x = link.X[:, 0]
    return link, held((x == 0, "xy"), (x == 10, "y"))


@case("NAFEMS FV5: deep beam, planar beam elements", f"{NAFEMS}, test FV5")
def deep_beam() -> list[Row]:
    """Pinned beam 10 × 2 × 2: bending and axial modes."""
    link, fixed = pinned_beam(40)
    got = frequencies(link, free_map(link, fixed), 4, 42.6)  # in ascending order
    names, targets = ["bending 1", "axial 1", "bending 2", "bending 3"], [BENDING[0], AXIAL, *BENDING[1:]]
    return [
        Row(f"{n} [Hz]", t, float(g), 1e-5, f"40 beam3, {3 * link.n} unknowns")
        for n, t, g in zip(names, targets, got, strict=True)
    ]


@case("NAFEMS FV5: deep beam, solid", f"{NAFEMS}, test FV5")
def deep_solid() -> list[Row]:
    """The mean displacement of the end faces is constrained: (u, v, w) and the rotation about x at one end, (v, w) at
    the other. Timoshenko's beam differs from the solid: by 0.25 % in the third bending mode, a wave 3 depths long.
    """
    counts = (20, 4, 4)
    link = mapped_link(counts, box((10, 2, 2), (0, -1, -1)), STEEL)
    left, right = [(0, "xyz"), (1, "z"), (2, "y")], [(0, "yz")]
    T = mean_support(link, (np.zeros(3), left), (np.array([10.0, 0, 0]), right))
    got = frequencies(link, T, 9, 42.6)
    names = ["bending 1", "bending 1", "torsion 1", "axial 1", "bending 2", "bending 2", "torsion 2"]
    targets = [BENDING[0], BENDING[0], TORSION, AXIAL, BENDING[1], BENDING[1], 3 * TORSION]
    names, targets = [*names, "bending 3", "bending 3"], [*targets, BENDING[2], BENDING[2]]
    return rows(names, targets, got, 0.004, model(counts, link))


def lame_mode(material: Material) -> float:
    """Frequency of the unit cube's equivoluminal mode u = (cos πx sin πy, −sin πx cos πy, 0) [Hz].

    Lamé's exact solution: free of traction on all faces, ω = π √(2G/ρ) for any ν.
    """
    return float(np.sqrt(material.shear_modulus / (2 * material.density)))


def lame_shape(X: np.ndarray) -> np.ndarray:
    """(n, 3) that mode at points of the unit cube."""
    x, y, _ = np.pi * X.T
    return np.stack([np.cos(x) * np.sin(y), -np.sin(x) * np.cos(y), 0 * x], axis=1)


@case("Unit cube, ν = 0.499, free", "converged value, E = ρ = 1; Lamé's exact equivoluminal mode")
def soft_cube() -> list[Row]:
    """Volumetric locking shows: on an 8 × 8 × 8 mesh of 8-node elements the Lamé mode is 9.6 % too high."""
    counts = (6, 6, 6)
    link = mapped_link(counts, box((1, 1, 1)), CUBE)
    first = float(frequencies(link, free_map(link, held()), 8, 0.26)[6])
    text = model(counts, link)
    return [
        Row("first elastic [Hz]", 0.26260, first, 0.001, text),
        Row("Lamé mode [Hz]", lame_mode(CUBE), frequency_of(link, lame_shape(link.X), 30, 0.26), 0.0025, text),
    ]


def ring_mapping(r: np.ndarray, s: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The unit cube as a ring of mean radius 0.369, thickness 0.048, length 0.05."""
    angle, radius = -2 * np.pi * r, 0.369 + 0.048 * (t - 0.5)
    return radius * np.cos(angle), radius * np.sin(angle), 0.05 * (s - 0.5)


@case("SDLS109: free thick ring", "code_aster V2.03.109, solid elements")
def ring() -> list[Row]:
    """Mean radius 0.369, thickness 0.048, length 0.05.

    The references are results of a mesh and lie above the converged values (205.58, 210.06, 586.5, 587.8).
    """
    counts = (36, 2, 2)
    material = Material(density=7800, youngs_modulus=185e9, poisson_ratio=0.3)

    link = mapped_link(counts, ring_mapping, material, closed=True)
    got = frequencies(link, free_map(link, held()), 14, 200)[6:]
    names = [f"{what} {n}" for n in (2, 3) for what in ("in plane, n =", "out of plane, n =") for _ in range(2)]
    targets = [205.89, 205.89, 210.55, 210.55, 587.92, 587.92, 588.88, 588.88]
    return rows(names, targets, got, 0.003, model(counts, link))
