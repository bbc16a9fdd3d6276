"""Plane links: NAFEMS FV32 and LE1, a cantilever, and a four-bar of plates against its solid twin."""

import tomllib
from functools import cache
from pathlib import Path

import numpy as np

from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import face_surface
from kedfem.links.surfaces.surface import surface_quadrature
from kedfem.scene import Material, scene_from

from .cases import Row, case
from .linear import deflection, free_map, frequencies, held
from .mechanisms import difference, histories
from .meshes import between_ellipses, mapped_plane, model
from .vibrations import NAFEMS, STEEL, rows

LE1 = "The Standard NAFEMS Benchmarks, TNSB rev. 3 (1990), test LE1"
GOODIER = "Timoshenko, Goodier: Theory of Elasticity, art. 21"
FLEXIBLE = Material(density=1, youngs_modulus=210e9, poisson_ratio=0.3)


@case("NAFEMS FV32: tapered membrane, plane elements", f"{NAFEMS}, test FV32")
def tapered_membrane() -> list[Row]:
    """The mesh of the solid above without its third dimension."""
    counts = (16, 8)
    link = mapped_plane(counts, lambda r, s: (10 * r, (s - 0.5) * (5 - 4 * r)), 0.05, STEEL)
    T = free_map(link, held((link.X[:, 0] == 0, "xy"), d=2))
    got = frequencies(link, T, 6, 44.6)
    targets = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
    return rows([f"mode {k}" for k in range(1, 7)], targets, got, 1e-4, model(counts, link, "quad9"))


def elliptic_membrane(counts: tuple[int, int]) -> Row:
    """σ_yy at D of LE1's quarter of a plate between two ellipses, pulled outwards with 10 MPa on the outer one."""
    link = mapped_plane(counts, between_ellipses, 0.1, FLEXIBLE)
    x, y, _ = link.X.T
    T = free_map(link, held((np.abs(y) < 1e-9, "y"), (np.abs(x) < 1e-9, "x"), d=2))
    u = deflection(link, T, 1e7 * pressure(link, np.array([3.25, 2.75, 0]) * np.sqrt(0.5)))
    stress = point_rows(link, "D", np.array([2.0, 0, 0])).stress @ u.ravel()
    return Row("σyy at D [MPa]", 92.7, float(stress[1]) / 1e6, 0.0, model(counts, link, "quad9"))


def pressure(link: Link, point: np.ndarray) -> np.ndarray:
    """(n, 2) nodal forces of a unit pull along the outward normal on the curved side through a point."""
    facets = face_surface(link, "side", point).facets
    on = surface_quadrature(link, facets)
    normal = on.x[..., :2] / np.array([3.25, 2.75]) ** 2  # of the ellipse
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    local = np.einsum("fqm,fq,fqi->fmi", on.N, on.dA, normal)
    forces = [np.bincount(on.dofs.ravel(), local[..., i].ravel(), link.n) for i in (0, 1)]
    return np.stack(forces, axis=1)


@case("NAFEMS LE1: elliptic membrane", LE1)
def elliptic_membranes() -> list[Row]:
    """D is a corner in the steepest part of the stress: its nodal value comes from gradients within one element."""
    found = [(elliptic_membrane(counts), cap) for counts, cap in (((8, 12), 0.025), ((32, 48), 0.005))]
    return [Row(r.quantity, r.reference, r.got, cap, r.model) for r, cap in found]


LENGTH, DEPTH, LOAD = 2.0, 0.5, 1e6


def bent(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact (u, v) of a cantilever of unit thickness under a parabolic shear at x = LENGTH, plane stress."""
    E, nu, L, D = FLEXIBLE.youngs_modulus, FLEXIBLE.poisson_ratio, LENGTH, DEPTH
    c = LOAD / (6 * E * D**3 / 12)
    u = -c * y * ((6 * L - 3 * x) * x + (2 + nu) * (y**2 - D**2 / 4))
    v = c * (3 * nu * y**2 * (L - x) + (4 + 5 * nu) * D**2 * x / 4 + (3 * L - x) * x**2)
    return u, v


def cantilever(counts: tuple[int, int]) -> tuple[Link, np.ndarray]:
    """The cantilever's deflection: root as in the exact solution, its shear on the tip."""
    link = mapped_plane(counts, lambda r, s: (LENGTH * r, DEPTH * (s - 0.5)), 1.0, FLEXIBLE)
    x, y, _ = link.X.T
    on = surface_quadrature(link, face_surface(link, "tip", np.array([LENGTH, 0, 0])).facets)
    shear = 1.5 * LOAD / DEPTH * (1 - (2 * on.x[..., 1] / DEPTH) ** 2)
    local = np.einsum("fqm,fq,fq->fm", on.N, on.dA, shear)
    force = np.stack([np.zeros(link.n), np.bincount(on.dofs.ravel(), local.ravel(), link.n)], axis=1)
    root = np.where(x[:, None] == 0, np.stack(bent(x, y), axis=1), 0.0)
    T = free_map(link, held((x == 0, "xy"), d=2))
    inner = force - (link.K0 @ root.ravel()).reshape(-1, 2)
    return link, root + deflection(link, T, inner)


def energy_error(counts: tuple[int, int]) -> float:
    """Error of the cantilever's nodal displacements in the energy's norm, relative."""
    link, u = cantilever(counts)
    exact = np.stack(bent(*link.X.T[:2]), axis=1)
    e = (u - exact).ravel()
    return float(np.sqrt(e @ link.K0 @ e / (exact.ravel() @ link.K0 @ exact.ravel())))


@case("Cantilever of a plane link", f"{GOODIER}: exact in plane stress; beam theory with Cowper's κ")
def cantilevers() -> list[Row]:
    """Length 4 depths, the root constrained as in the exact solution, which beam theory does not represent.
    Beam theory has P L³/(3EI) + P L/(κGA) with κ = 10(1 + ν)/(12 + 11ν).
    """
    counts, nu = (8, 2), FLEXIBLE.poisson_ratio
    link, u = cantilever(counts)
    text = model(counts, link, "quad9")
    tip = point_rows(link, "tip", np.array([LENGTH, 0, 0])).value @ u
    EI = FLEXIBLE.youngs_modulus * DEPTH**3 / 12
    kappa = 10 * (1 + nu) / (12 + 11 * nu)
    beam = LOAD * (LENGTH**3 / (3 * EI) + LENGTH / (kappa * FLEXIBLE.shear_modulus * DEPTH))
    stress = point_rows(link, "side", np.array([LENGTH / 2, DEPTH / 2, 0])).stress @ u.ravel()
    exact = float(bent(np.array(LENGTH), np.array(0.0))[1])
    return [
        Row("tip deflection, exact [m]", exact, float(tip[1]), 2e-4, text),
        Row("tip deflection, beam theory [m]", beam, float(tip[1]), 0.006, text),
        Row("σxx half way, side [Pa]", -LOAD * LENGTH / 2 * DEPTH / 2 * 12 / DEPTH**3, float(stress[0]), 1e-5, text),
    ]  # fmt: skip


SCENE = Path(__file__).parents[2] / "examples" / "four_bar_solids" / "scene.toml"
CHANNELS = {
    "stress, rocker's outer side": "probes/rocker_outer/stress",
    "displacement, coupler's middle": "probes/coupler_middle/displacement",
    "force of joint A": "joints/A/force",
    "force of joint C": "joints/C/force",
    "drive torque": "drive/torque",
}


@cache
def four_bar(kind: str, thickness: float) -> list[np.ndarray]:
    """Channels of the example's four-bar over a revolution of 90 steps at 150 rpm, on the same quadrilaterals."""
    raw = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    raw["analysis"] |= {"revolutions": 1, "steps_per_revolution": 90}
    for link in raw["links"].values():
        link["model"], link["shape"]["thickness"] = kind, thickness
        link["element"] = {"plane": "quad9", "solid": "hex27"}[kind]
    return histories(scene_from(raw, SCENE.parent), *CHANNELS.values())[1]


@case("Four-bar of plates: plane against solid", "hex27 on the same quadrilaterals, one layer; 150 rpm", long=True)
def against_solids() -> list[Row]:
    """Largest difference over a revolution, for the example's plates, as thick as wide, and for thinner ones.

    The remaining difference is due to the assumption of plane stress, which near the bores is valid for thin plates
    only: the difference of the displacements falls about as the square of the thickness.
    """
    out = []
    for thickness, caps in ((0.0254, (5e-4, 2e-3, 2e-4, 2e-4, 2e-4)), (0.006, (1e-4, 2e-4, 1e-4, 1e-4, 1e-4))):
        pairs = zip(four_bar("plane", thickness), four_bar("solid", thickness), strict=True)
        for name, cap, (flat, solid) in zip(CHANNELS, caps, pairs, strict=True):
            error = difference(flat, solid[:, : flat.shape[1]])
            out.append(Row(f"{name}, difference / peak", 0.0, error, cap, f"{1e3 * thickness:g} mm thick"))
    return out
