"""`kedfem frequencies PART` and `--link`: FV32, plates, the ring of SDLS109, beams free at both ends."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from scipy.optimize import brentq

from kedfem.dynamics.modes.link_modes import link_modes
from kedfem.frequencies import Part, link_of_scene, part_from_file
from kedfem.mesh import SolidMesh
from kedfem.output.vtu import write_mesh
from kedfem.scene import Material, link_from, scene_from
from kedfem.scene.read.scenes import face_from

from .cases import Row, case
from .meshes import box, mapped_mesh
from .vibrations import BENDING, DEEP, NAFEMS, STEEL, ring_mapping, rows

FREE_PLATE = [1.622, 2.360, 2.922]  # bending; the next two are equal
CANTILEVER_PLATE = [0.421, 1.029, 2.582, 3.306, 3.753, 6.555]


def of_mesh(mesh: SolidMesh, material: Material, *faces: str) -> Part:
    """A mesh as a part from a mesh file, faces clamped that are chosen by what they are."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "part.vtu"
        write_mesh(mesh, file)
        given = link_from({"shape": {"kind": "mesh", "file": file.name}, "element": "hex27"})
        return part_from_file(file, given, material, [face_from("--hold", each) for each in faces])


def of_bar(length: float, side: float, joints: dict[str, Any], **link: Any) -> Part:
    """A square steel bar of NAFEMS's along x, held at joints."""
    shape = {"kind": "bar", "between": [[0, 0], [length, 0]], "width": side, "thickness": side}
    raw = {
        "materials": {"m": {"density": 8000, "youngs_modulus": 200e9, "poisson_ratio": 0.3}},
        "links": {"bar": {"material": "m", "shape": shape, "shear_coefficient": DEEP.shear_coefficient, **link}},
        "joints": joints,
        "analysis": {"end_time": 1, "step": 0.1},
    }
    return link_of_scene(scene_from(raw), "bar", list(joints))


def found(part: Part, count: int) -> np.ndarray:
    """Its lowest natural frequencies [Hz]."""
    return np.asarray(link_modes(part.link, part.support, count).frequencies)


def text(part: Part) -> str:
    return f"{part.link.unknowns:,} unknowns"


@case("Free square plate, as a part from a mesh file", f"{NAFEMS}, test FV12")
def free_plate() -> list[Row]:
    """Plate 10 × 10 × 0.05 without supports: the six rigid-body modes are left out."""
    part = of_mesh(mapped_mesh((12, 12, 1), box((10, 10, 0.05))), STEEL)
    got = found(part, 3)
    return rows(["mode 7", "mode 8", "mode 9"], FREE_PLATE, got, 0.006, text(part))


@case("Cantilever square plate, as a part from a mesh file with a face clamped", f"{NAFEMS}, test FV16")
def cantilever_plate() -> list[Row]:
    """The same plate, its side x = 0 clamped."""
    mesh = mapped_mesh((12, 12, 1), box((10, 10, 0.05)))
    part = of_mesh(mesh, STEEL, "{ plane = 'x', near = [0, 5, 0] }")
    names = [f"mode {k}" for k in range(1, 7)]
    return rows(names, CANTILEVER_PLATE, found(part, 6), 0.011, text(part))


@case("SDLS109: free thick ring, as a part from a mesh file", "code_aster V2.03.109, solid elements")
def ring_part() -> list[Row]:
    """The same ring as above."""
    material = Material(density=7800, youngs_modulus=185e9, poisson_ratio=0.3)
    part = of_mesh(mapped_mesh((36, 2, 2), lambda r, s, t: ring_mapping(1 - r, s, t), closed=True), material)
    targets = [205.89, 205.89, 210.55, 210.55, 587.92, 587.92, 588.88, 588.88]
    names = [f"mode {k}" for k in range(7, 15)]
    return rows(names, targets, found(part, 8), 0.003, text(part))


@case("NAFEMS FV32: tapered membrane, as a plane link welded at its end", f"{NAFEMS}, test FV32")
def tapered_link() -> list[Row]:
    """A plane link given by its outline; its weld keeps the shape of the wide end (`coupling = "rigid"`)."""
    outline = [[0, -2.5], [10, -0.5], [10, 0.5], [0, 2.5]]
    raw = {
        "materials": {"m": {"density": 8000, "youngs_modulus": 200e9, "poisson_ratio": 0.3}},
        "links": {
            "membrane": {
                "material": "m",
                "model": "plane",
                "shape": {"kind": "extrusion", "outline": outline, "thickness": 0.05},
                "mesh": {"size": 0.5},
            }
        },
        "joints": {"end": {"kind": "weld", "links": ["ground", "membrane"], "at": [0, 0], "coupling": "rigid"}},
        "analysis": {"end_time": 1, "step": 0.1},
    }
    part = link_of_scene(scene_from(raw), "membrane", ["end"])
    targets = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
    return rows([f"mode {k}" for k in range(1, 7)], targets, found(part, 6), 0.0025, text(part))


@case("NAFEMS FV5: deep beam, as a link on hinges at both ends", f"{NAFEMS}, test FV5")
def hinged_beam() -> list[Row]:
    """Bending modes are those of the test; hinges at both ends constrain the beam along its axis too, √(E/ρ)/2L."""
    hinge = {"kind": "revolute", "links": ["ground", "bar"]}
    joints = {"left": hinge | {"at": [0, 0]}, "right": hinge | {"at": [10, 0]}}
    part = of_bar(10.0, 2.0, joints, model="beam", mesh={"elements": 40})
    targets = [*BENDING[:2], 250.0, BENDING[2]]
    names = ["bending 1", "bending 2", "axial 1", "bending 3"]
    return rows(names, targets, found(part, 4), 1e-5, text(part))


def free_timoshenko(near: float, length: float = 10.0) -> float:
    """A frequency of FV5's beam free at both ends [Hz]: Timoshenko's equations as y' = A y, y = (w, ψ, M, Q).

    w' = ψ + Q/κGA, ψ' = M/EI, M' = −Q − ρI ω² ψ, Q' = −ρA ω² w. What M and Q at one end are of w and ψ at the other,
    where M = Q = 0, is singular at a natural frequency.
    """
    E, kGA = STEEL.youngs_modulus, DEEP.shear_coefficient * STEEL.shear_modulus * DEEP.area
    A, I, rho = DEEP.area, DEEP.second_moment, STEEL.density  # noqa: E741
    unit = E * I  # forces in EI, so that entries are of one size

    def left(f: float) -> float:
        w2 = (2 * np.pi * f) ** 2
        rates = np.array(
            [[0, 1, 0, unit / kGA], [0, 0, 1, 0], [0, -rho * I * w2 / unit, 0, -1], [-rho * A * w2 / unit, 0, 0, 0]]
        )
        return float(np.linalg.det(scipy.linalg.expm(rates * length)[2:, :2]))

    return float(brentq(left, 0.97 * near, 1.03 * near, xtol=1e-9 * near))


@case("Deep beam free at both ends", "Timoshenko's equations, transfer matrix; slender: Euler and Bernoulli")
def free_beam() -> list[Row]:
    """FV5's beam without supports, and one 1,000 times as long as thick, cos kL cosh kL = 1."""
    deep = of_bar(10.0, 2.0, {}, model="beam", mesh={"elements": 40})
    got = found(deep, 2)
    exact = [free_timoshenko(float(f)) for f in got]
    slender = of_bar(1.0, 1e-3, {}, model="beam", mesh={"elements": 40})
    kL = np.array([4.7300407449, 7.8532046241, 10.995607838])
    euler = kL**2 * np.sqrt(200e9 * 1e-6 / 12 / 8000) / (2 * np.pi)
    names = [f"slender, bending {k}" for k in (1, 2, 3)]
    return [
        *rows(["deep, bending 1", "deep, bending 2"], exact, got, 1e-5, text(deep)),
        *rows(names, list(euler), found(slender, 3), 2e-5, text(slender)),
    ]
