"""Load cases of one part with its mesh as a deck for Abaqus and CalculiX, and as VTU files and a table.

A deck has one step for each instant. The nodal forces are in balance. Six statically determinate supports prevent rigid
motion; their reactions are the residual of the balance.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np
import scipy.linalg

from kedfem.arrays import Float
from kedfem.links.record import Link
from kedfem.output.vtu import complete, write_vtu
from kedfem.results.files import replacing
from kedfem.results.forces.load_cases import LoadCase
from kedfem.results.table import text_file, write_rows
from kedfem.scene import Material
from kedfem.vectors import cross

Forces = Float[np.ndarray, "n 3"]
# Abaqus' names by meshio's, with the same order of nodes; CalculiX has no 27-node hexahedra
ELEMENTS = {"hexahedron": "C3D8", "hexahedron20": "C3D20", "tetra10": "C3D10"}
LINE = 15  # numbers on a line after the first


def supports(link: Link) -> list[tuple[int, int]]:
    """Six supports (node, component) that constrain all rigid motions of a link, well conditioned."""
    _, _, order = scipy.linalg.qr(_rigid(link).T, mode="economic", pivoting=True)
    return sorted((int(k // 3), int(k % 3)) for k in order[:6])


def reactions(link: Link, held: Sequence[tuple[int, int]], forces: Forces) -> Float[np.ndarray, "6"]:
    """Reactions of the supports to forces at a link's nodes, by statics [N]."""
    modes = _rigid(link)
    rows = [3 * node + component for node, component in held]
    return np.asarray(-np.linalg.solve(modes[rows].T, modes.T @ forces.ravel()))


def _rigid(link: Link) -> Float[np.ndarray, "c 6"]:
    """Small rigid motions of the nodes: translations, and rotations about the middle over the link's size."""
    X = link.X - link.X.mean(axis=0)
    turns = [np.cross(axis, X / np.abs(X).max()).ravel() for axis in np.eye(3)]
    return np.column_stack([*(np.tile(e, len(X)) for e in np.eye(3)), *turns])


def write_deck(path: Path, link: Link, material: Material, cases: Sequence[LoadCase], comments: Iterable[str]) -> None:
    """Write the deck, with lines of comment at its beginning."""
    held = supports(link)
    with text_file(path) as file:
        file.writelines(f"** {line}\n" for line in comments)
        file.write("*NODE, NSET=NALL\n")
        file.writelines(f"{k}, {_numbers(X)}\n" for k, X in enumerate(link.X, start=1))
        file.write(f"*ELEMENT, TYPE={ELEMENTS[link.cell_type]}, ELSET=EALL\n")
        for k, nodes in enumerate(link.cells + 1, start=1):
            words = [str(k), *map(str, nodes)]
            lines = [", ".join(words[i : i + LINE + 1]) for i in range(0, len(words), LINE + 1)]
            file.write(",\n".join(lines) + "\n")
        file.write("*NSET, NSET=SUPPORTS\n")
        file.writelines(f"{node + 1}\n" for node in sorted({node for node, _ in held}))
        elastic = f"{material.youngs_modulus:.9e}, {material.poisson_ratio:.9e}"
        file.write(f"*MATERIAL, NAME=LINK\n*ELASTIC\n{elastic}\n")
        file.write(f"*DENSITY\n{material.density:.9e}\n*SOLID SECTION, ELSET=EALL, MATERIAL=LINK\n")
        file.write("** six supports, statically determinate: their reactions are the residual of the balance\n")
        file.write("*BOUNDARY\n")
        file.writelines(f"{node + 1}, {component + 1}, {component + 1}\n" for node, component in held)
        for case in cases:
            _write_step(file, case)


def _write_step(file: TextIO, case: LoadCase) -> None:
    file.write(f"** time {case.time:.9g} s, drive at {case.angle:.9g}\n*STEP\n*STATIC\n*CLOAD, OP=NEW\n")
    for node, force in enumerate(case.total, start=1):
        file.writelines(f"{node}, {c}, {f:.9e}\n" for c, f in enumerate(force, start=1) if f != 0)
    file.write("*NODE FILE\nU, RF\n*EL FILE\nS\n*NODE PRINT, NSET=SUPPORTS\nRF\n*END STEP\n")


def _numbers(x: Float[np.ndarray, " k"]) -> str:
    return ", ".join(f"{value:.12e}" for value in x)


def write_case(path: Path, link: Link, case: LoadCase) -> None:
    """Write a load case for ParaView: the undeformed link; forces by kind, displacement, acceleration and stress."""
    fields = {f"{name} [N]": x for name, x in case.parts.items()} | {
        "all forces [N]": case.total, "displacement [m]": case.displacement,
        "acceleration [m/s^2]": case.acceleration, "von Mises [Pa]": case.von_mises,
        "von Mises by statics [Pa]": case.static_von_mises, "stress [Pa]": case.stress,
    }  # fmt: skip
    with replacing(path) as part:
        values = {name: np.ascontiguousarray(x) for name, x in fields.items()}
        write_vtu(part, link.X, [(link.cell_type, link.cells)], point_data=values)
        complete(part)


def resultants(
    X: Forces, case: LoadCase, about: Mapping[str, Float[np.ndarray, "3"]]
) -> dict[str, tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"], Float[np.ndarray, "3"]]]:
    """Point [m], force [N] and moment about the point [N m] of each kind of force; the point is the origin by default."""
    out = {}
    for name, forces in case.parts.items():
        at = np.asarray(about.get(name, np.zeros(3)))
        out[name] = at, forces.sum(axis=0), cross(X - at, forces).sum(axis=0)
    return out


def write_resultants(
    path: Path, X: Forces, cases: Sequence[LoadCase], about: Mapping[str, Float[np.ndarray, "3"]], drive: str
) -> None:
    """Write force and moment of each kind at each instant as CSV."""
    vectors = ("point", "m"), ("force", "N"), ("moment", "N m")
    columns = [f"{what} {c} [{unit}]" for what, unit in vectors for c in "xyz"]
    every = ((case, each) for case in cases for each in resultants(X, case, about).items())
    rows = ([case.time, case.angle, name, *np.concatenate(found)] for case, (name, found) in every)
    write_rows(path, ["time [s]", drive, "what", *columns], rows)
