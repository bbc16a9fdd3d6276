"""Geometric stiffening: columns under their Euler load, cantilevers that turn."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.optimize
import scipy.sparse as sp

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.beam_axis import straight_axis
from kedfem.links.beams.section import Section, rectangle, tube
from kedfem.links.beams.spatial_beam import spatial_beam_link
from kedfem.links.bodies import flywheel_tensor, with_body
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.stress_stiffness import rotated_directions, stress_stiffness
from kedfem.links.surfaces.coupling_surfaces import joint_surface
from kedfem.scene import Material, Scene, scene_from, time_grid

from .cases import Row, case
from .linear import deflection, free_map, held, vector_mass
from .meshes import box, mapped_link, mapped_plane
from .spatial_beams import ROOT

ROTATING = "Hamza-Cherif, Houmat: rotating beams by a hierarchical finite element, ICAS 2004, table 2"
LENGTH, SLENDERNESS = 1.0, 70.0  # L √(A/I)
HEIGHT = LENGTH * np.sqrt(12) / SLENDERNESS
RUBBER = Material(density=1000, youngs_modulus=1e9, poisson_ratio=0.0)
TABLE = {  # μ = Ω √(ρA L⁴/EI): chordwise and flapwise frequency in the same unit
    2: (3.6195, 4.1373),
    4: (3.888, 5.5850),
    6: (4.2393, 7.3603),
    8: (4.6105, 9.2568),
    10: (4.97, 11.2023),
    50: (7.3362, 51.0805),
}
Supported = tuple[Link, sp.csr_array, str]  # a cantilever along x, its free unknowns, mesh in words


def square(shear_coefficient: float = 5 / 6) -> Section:
    return rectangle(HEIGHT, HEIGHT, shear_coefficient)


def line() -> np.ndarray:
    return np.array([[0.0, 0, 0], [LENGTH, 0, 0]])


def planar_beam(elements: int = 16, section: Section | None = None) -> Supported:
    link = beam_link("beam", line(), section or square(), RUBBER, elements)
    return link, free_map(link, np.arange(3)), f"{elements} beam3, {link.unknowns} unknowns"


def thin_beam() -> Supported:
    """The beam of the table's theory, without shear and rotary inertia."""
    link, T, text = planar_beam(16, square(1e3))
    return replace(link, mass=(*link.mass[:2], 1e-3 * link.mass[2])), T, text


def spatial_beam(elements: int = 16, section: Section | None = None) -> Supported:
    axis = straight_axis(line(), elements, 3, None)
    link = spatial_beam_link("beam", axis, section or square(), RUBBER)
    return link, free_map(link, ROOT), f"{elements} beam3, {link.unknowns} unknowns"


def plane(elements: int = 24) -> Supported:
    link = mapped_plane((elements, 1), lambda r, s: (LENGTH * r, HEIGHT * (s - 0.5)), HEIGHT, RUBBER)
    T = free_map(link, held((link.X[:, 0] < 1e-9, "xy"), d=2))
    return link, T, f"quad9 {elements}×1, {link.unknowns} unknowns"


def solid(elements: int = 16) -> Supported:
    lengths = (LENGTH, HEIGHT, HEIGHT)
    link = mapped_link((elements, 1, 1), box(lengths, (0, -HEIGHT / 2, -HEIGHT / 2)), RUBBER, 20)
    T = free_map(link, held((link.X[:, 0] < 1e-9, "xyz")))
    return link, T, f"hex20 {elements}×1×1, {link.unknowns} unknowns"


def stressed(link: Link, g: np.ndarray) -> sp.csr_array:
    """k ⊗ P, (dn, dn), of the stresses in a state g."""
    return sp.kron(stress_stiffness(link)(g), rotated_directions(link), format="csr")


# -- columns ------------------------------------------------------------------------------------------------


def critical(link: Link, T: sp.csr_array, force: np.ndarray) -> float:
    """The least factor of a load, positive in pressure, at which K + k is singular."""
    k = T.T @ stressed(link, deflection(link, T, force)) @ T
    K = T.T @ link.K0 @ T
    return float(1 / scipy.linalg.eigh(-k.toarray(), K.toarray(), eigvals_only=True).max())


def pressed(link: Link) -> np.ndarray:
    """A unit load along −x, spread over the tip as σ = constant is."""
    f = np.zeros((link.n, link.d))
    if link.kind in {"beam", "spatial_beam"}:
        f[(link.one != 0) & (np.abs(link.X[:, 0] - LENGTH) < 1e-9), 0] = -1.0
        return f
    g = np.zeros((link.n, link.d))
    g[:, 0] = -link.X[:, 0] / (RUBBER.youngs_modulus * HEIGHT**2)  # ν = 0
    f = (link.K0 @ g.ravel()).reshape(g.shape)
    f[link.X[:, 0] < LENGTH / 2] = 0.0
    return f


@case("Euler's column", "P = π² EI/(4 L²) of a cantilever, with shear P/(1 + P/κGA) (Engesser)")
def columns() -> list[Row]:
    """K + P k is singular; L √(A/I) = 70."""
    E, A = RUBBER.youngs_modulus, HEIGHT**2
    euler = np.pi**2 * E * HEIGHT**4 / 12 / (4 * LENGTH**2)
    exact = euler / (1 + euler / (5 / 6 * RUBBER.shear_modulus * A))
    found: dict[str, Callable[[], Supported]] = {
        "planar beam": planar_beam, "beam in space": spatial_beam, "plane": plane, "solid": solid
    }  # fmt: skip
    out = []
    for name, made in found.items():
        link, T, text = made()
        out.append(Row(f"{name} [N]", exact, critical(link, T, pressed(link)), 1.5e-3, text))
    return out


@case(
    "Torsional column buckling", "P = GJ A/(I_y + I_z), free warping (Timoshenko, Gere: Theory of Elastic Stability, 5.5)"
)
def twisted_column() -> list[Row]:
    """A flat strip in compression: work of an axial force on sections whose rotation varies linearly along the beam."""
    section = rectangle(0.1, 0.004)
    link, T, text = spatial_beam(16, section)
    x = np.asarray(link.triples @ link.X).reshape(-1, 3, 3)
    twisted = np.stack([0 * x[:, 0], x[:, :1, 0] * x[:, 2], -x[:, :1, 0] * x[:, 1]], axis=1)
    u = np.linalg.lstsq(link.triples.toarray(), twisted.reshape(-1, 3), rcond=None)[0].ravel()
    k = stressed(link, deflection(link, T, pressed(link)))
    polar = section.second_moment + section.second_moment_z
    exact = RUBBER.shear_modulus * section.torsion_constant * section.area / polar
    return [Row("P [N]", exact, float(-(u @ link.K0 @ u) / (u @ k @ u)), 1e-6, text)]


# -- cantilevers that turn ----------------------------------------------------------------------------------


def turning_frequencies(link: Link, T: sp.csr_array, mu: float) -> np.ndarray:
    """Frequencies of the link frame in units of √(EI/ρA L⁴), of a cantilever that turns about z with μ.

    M (g'' + 2 ω × g' + ω × (ω × g)) + (K0 + k) g = 0 on the lowest modes at rest; k of the static state under −M R0''.
    """
    omega = mu * np.sqrt(RUBBER.youngs_modulus * HEIGHT**2 / 12 / RUBBER.density) / LENGTH**2
    spin, square = np.zeros((link.d, link.d)), np.zeros((link.d, link.d))
    spin[1, 0], spin[0, 1] = omega, -omega
    square[0, 0] = square[1, 1] = -(omega**2)
    force = np.zeros((link.n, link.d))
    force[:, :2] = omega**2 * link.mX[:, :2]
    k = stressed(link, deflection(link, T, force))
    M, K0 = (T.T @ vector_mass(link) @ T).toarray(), (T.T @ link.K0 @ T).toarray()
    V = scipy.linalg.eigh(K0, M, subset_by_index=[0, min(59, len(M) - 1)])[1]
    B = T @ V

    def inertia(A: np.ndarray) -> np.ndarray:
        return np.asarray(B.T @ (vector_mass(link) @ sp.kron(sp.eye_array(link.n), A) @ B))

    K = B.T @ ((link.K0 + k) @ B) + inertia(square)
    zero, one = np.zeros_like(K), np.eye(len(K))
    values = scipy.linalg.eigvals(np.block([[zero, one], [-K, -2 * inertia(spin)]]))
    return np.sort(values.imag[values.imag > 0]) * mu / omega


@case("Rotating cantilever, chordwise", ROTATING)
def thin_cantilever() -> list[Row]:
    """A thin planar beam, as in the table, at all speeds; at μ = 50 the strain at the root is 26 %."""
    link, T, text = thin_beam()
    return [
        Row(f"μ = {mu}", chord, float(turning_frequencies(link, T, mu)[0]), 1e-3, text)
        for mu, (chord, _) in TABLE.items()
    ]


@case("Rotating cantilever with shear and rotary inertia", ROTATING)
def thick_cantilevers() -> list[Row]:
    """Chordwise and flapwise bending of other links, with shear and rotary inertia, which the table neglects: some 0.2 %
    at slenderness 70. At μ = 50 strains of 26 % at the root are no longer small beside 1. The result then depends on
    the measure of strain that is linear, and the chordwise frequency differs by up to 2 %. It is not listed.
    """
    out = []
    for name, made in {"beam in space": spatial_beam, "solid": solid, "plane": plane}.items():
        link, T, text = made()
        for mu, (chord, flap) in TABLE.items():
            got = turning_frequencies(link, T, mu)
            if mu <= 10:
                out.append(Row(f"{name}, chord, μ = {mu}", chord, float(got[0]), 5e-3, text))
            if link.d == 3:
                out.append(Row(f"{name}, flap, μ = {mu}", flap, float(got[1]), 5e-3, text))
    return out


@case("Rotating cantilever without geometric stiffening", "√(3.516² − μ²), thin beam, chordwise")
def unstiffened_cantilever() -> list[Row]:
    """The result of equation (20) alone, unstable above μ = 3.516. It includes axial motion, at 1/70 of its rate."""
    link, T, text = thin_beam()
    soft = replace(link, E=0.0)  # no stress, K0 stays
    return [
        Row(f"μ = {mu}", float(np.sqrt(3.5160153**2 - mu**2)), float(turning_frequencies(soft, T, mu)[0]), 2e-3, text)
        for mu in (1, 2, 3)
    ]


def turning_scene(mu: float, beam: str, force: list[float], stiffening: bool = True) -> Scene:
    """A cantilever driven about its root, a small force on its tip put on at once, about eight periods of vibration."""
    unit = np.sqrt(RUBBER.youngs_modulus * HEIGHT**2 / 12 / RUBBER.density) / LENGTH**2
    period = 2 * np.pi / (unit * np.hypot(3.5, mu if beam == "spatial" else 0.3 * mu))
    shape = {"kind": "bar", "between": ["A", "B"], "width": HEIGHT, "thickness": HEIGHT}
    link = {"material": "m", "model": "beam", "beam": beam, "shape": shape, "mesh": {"elements": 6}}
    return scene_from(
        {
            "materials": {"m": {"density": 1000, "youngs_modulus": 1e9, "poisson_ratio": 0.0}},
            "points": {"A": [0.0, 0.0], "B": [LENGTH, 0.0]},
            "links": {"arm": link},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A", "axis": [0, 0, 1]}},
            "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": mu * unit}},
            "loads": {"tip": {"kind": "force", "link": "arm", "at": "B", "vector": force, "frame": "link"}},
            "analysis": {
                "end_time": 8 * period, "step": period / 200, "stiffening": stiffening, "rho_inf": 0.9
            },
        }
    )  # fmt: skip


def vibration(scene: Scene, component: int) -> float:
    """Circular frequency of the tip, link frame, from a least-squares fit of the strongest line of its spectrum."""
    ready = meshed(scene)
    solver = steps_of(scene, ready.model)
    at = point_rows(ready.model.links[0], "tip", np.array([LENGTH, 0, 0])).value
    blocks = transient(scene, ready.linkage, ready.path, ready.model, solver)
    y = np.concatenate([np.einsum("n,tnd->td", at, block.links[0].g)[:, component] for block in blocks])
    t = time_grid(scene).step * np.arange(len(y))

    def left(omega: float) -> float:
        columns = np.stack([np.ones_like(t), np.cos(omega * t), np.sin(omega * t)], axis=1)
        return float(np.linalg.norm(y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]))

    lines = np.abs(np.fft.rfft(y - y.mean()))
    near = 2 * np.pi / t[-1] * (lines.argmax() + np.array([-1.0, 1.0]))
    options = {"xatol": 1e-6 * near[1]}
    return float(scipy.optimize.minimize_scalar(left, bounds=near, method="bounded", options=options).x)


@case("Rotating cantilever, by the transient solver", ROTATING, long=True)
def turning_by_steps() -> list[Row]:
    """μ = 6: a sudden load on the tip, 200 steps per period."""
    unit = np.sqrt(RUBBER.youngs_modulus * HEIGHT**2 / 12 / RUBBER.density) / LENGTH**2
    chord, flap = TABLE[6]
    found = {
        "chord, planar beam": (chord, "planar", [0, 1e-3, 0], 1),
        "chord, beam in space": (chord, "spatial", [0, 1e-3, 0], 1),
        "flap, beam in space": (flap, "spatial", [0, 0, 1e-3], 2),
    }
    return [
        Row(name, wanted, vibration(turning_scene(6.0, beam, force), c) / unit, 5e-3, "6 beam3")
        for name, (wanted, beam, force, c) in found.items()
    ]


# -- rotors -------------------------------------------------------------------------------------------------

SHAFT = tube(0.02, 0.0, 1e3)  # without shear, as the reference
SPIN = np.diag([0.0, -1.0, -1.0])  # [e]×² about x
CROSS = np.array([[0.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # [e]×


def whirl(omega: float, mass: float, polar: float) -> np.ndarray:
    """Whirl of a thin disc on the tip of a massless shaft that spins [rad/s], backward ones negative (Stodola, Green).

    (K − w² diag(m, I_d) + w ω diag(0, I_p)) (y, θ) = 0 with y + iz, θ_z − iθ_y ~ exp(iwt), I_d = I_p/2.
    """
    K = (
        RUBBER.youngs_modulus
        * SHAFT.second_moment
        / LENGTH**3
        * np.array([[12, -6 * LENGTH], [-6 * LENGTH, 4 * LENGTH**2]])
    )
    M, G = np.diag([mass, polar / 2]), np.diag([0, polar])
    zero, one = np.zeros((2, 2)), np.eye(2)
    right = scipy.linalg.block_diag(one, M)
    return np.sort(scipy.linalg.eigvals(np.block([[zero, one], [K, omega * G]]), right).real)


def whirl_of_link(omega: float, mass: float, polar: float, stiffened: bool = True) -> np.ndarray:
    """The same of a beam in space of hardly any mass, from its own equation in the link frame, seen from the world."""
    light = Material(density=1e-3, youngs_modulus=RUBBER.youngs_modulus, poisson_ratio=0.0)
    bare = spatial_beam_link("shaft", straight_axis(line(), 4, 3, None), SHAFT, light)
    tip, axis = np.array([LENGTH, 0, 0]), np.array([1.0, 0, 0])
    surface = joint_surface(bare, "disc", tip, axis)
    link = with_body(bare, surface, mass, tip, flywheel_tensor(surface, axis, polar))
    T, M = free_map(link, ROOT), vector_mass(link)
    k = stressed(link, deflection(link, T, -(omega**2) * link.mX @ SPIN.T)) * float(stiffened)
    each = sp.eye_array(link.n)
    K = (T.T @ (link.K0 + k + omega**2 * M @ sp.kron(each, SPIN)) @ T).toarray()
    C = (T.T @ (2 * omega * M @ sp.kron(each, CROSS)) @ T).toarray()
    m = (T.T @ M @ T).toarray()
    zero, one = np.zeros_like(K), np.eye(len(K))
    values, vectors = scipy.linalg.eig(np.block([[zero, one], [-K, -C]]), scipy.linalg.block_diag(one, m))
    tips = (T @ vectors[: len(K)]).reshape(link.n, 3, -1)
    turning = np.einsum("n,ncv->cv", surface.fit[0], tips)
    # y + iz ~ exp(iwt): z = −i y; in the link frame the frequency is lower by ω
    forward = np.abs(turning[2] + 1j * turning[1]) < 1e-3 * np.abs(turning[1])
    w = values.imag[forward] + omega
    return w[np.argsort(np.abs(w))][:4]


@case("Whirl of a disc on an overhung shaft", "Stodola; Green: gyroscopic effect of a thin disc on a massless shaft")
def overhung_disc() -> list[Row]:
    """0.5 kg, I_p = 0.05 kg m² on 1 m; without stress stiffness the angular momentum of the tilting disc is lost."""
    out = []
    for omega in (50.0, 200.0, 500.0):
        wanted, got = whirl(omega, 0.5, 0.05), np.sort(whirl_of_link(omega, 0.5, 0.05))
        out += [
            Row(f"spin {omega:g} rad/s, whirl {i + 1} [rad/s]", float(w), float(g), 1e-5, "4 beam3, a disc")
            for i, (w, g) in enumerate(zip(wanted, got, strict=True))
        ]
    return out
