"""What rigid couplings change: a plate link with two bores on three meshes, distributing against rigid; how stiff is
enough."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from benchmarks.pages import script, table, write_page
from benchmarks.parts import PARTS, BenchPart, Size, ends, frequencies, loaded, part_link
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.matrices.substructure import effective_matrix
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.links.record import Link
from kedfem.links.recovery import nodal_gradients, stress_of_gradient, von_mises
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, joint_surface
from kedfem.links.surfaces.rigid_coupling import STIFF, surface_gram, surface_radius, with_rigid_coupling

PLATE = next(part for part in PARTS if part.name == "plate with bores")
LOADS = {"pull": (1.0, 0.0, 0.0), "bend": (0.0, 1.0, 0.0)}
SIZES: tuple[Size, ...] = ((2, 1), (4, 1), (8, 2))
TRIED = (1e1, 1e2, 1e3, 1e4, 1e5, 1e6)
NEAR = 2.0  # radii of a bore: where its peak stress is looked for
FORCE = 1e3  # [N]
STEP = 1e-4  # [s], of the effective matrix whose conditioning is reported
ROUNDS = 40  # of power iteration


@dataclass(frozen=True, slots=True)
class _Found:
    """Deflection [m] and peak equivalent stress near the loaded bore [Pa] by load, first free frequency [Hz]; how far the
    pulled bore is out of round, root mean square [m]."""

    deflection: dict[str, float]
    stress: dict[str, float]
    frequency: float
    out_of_round: float


def bench_ports(folder: Path, quick: bool) -> None:
    """Both kinds of port on all meshes, then stiff ones of other stiffness; two tables go to the folder."""
    rows = []
    sizes = SIZES[:1] if quick else SIZES
    for size in sizes:
        link = part_link(PLATE, "hex20", size)
        averaged, stiff = _found(link), _found(_stiffened(link, STIFF))
        pairs = [(1e6 * a.deflection[load], 1e6 * b.deflection[load]) for a, b in [(averaged, stiff)] for load in LOADS]
        pairs += [(averaged.frequency, stiff.frequency)]
        pairs += [(1e-6 * averaged.stress[load], 1e-6 * stiff.stress[load]) for load in LOADS]
        rows.append(("×".join(map(str, size)), f"{link.unknowns:,}", *(_change(*pair) for pair in pairs)))
    header = (
        "mesh", "unknowns", *(f"{load}: deflection [µm]" for load in LOADS), "first frequency [Hz]",
        *(f"{load}: peak stress [MPa]" for load in LOADS),
    )  # fmt: skip
    write_page(folder, "ports", [table(header, rows), _by_stiffness(sizes[-1])])


def _stiffened(link: Link, times: float) -> Link:
    for surface in _bores(link):
        link = with_rigid_coupling(link, surface, times)
    return link


def _bores(link: Link) -> list[CouplingSurface]:
    return [joint_surface(link, "coupling surface", np.asarray(end), None) for end in ends(PLATE)]


def _found(link: Link) -> _Found:
    deflection, stress, round_ = {}, {}, 0.0
    for load, direction in LOADS.items():
        part: BenchPart = replace(PLATE, force=direction)
        moved, u = loaded(part, link)
        deflection[load], stress[load] = FORCE * moved, FORCE * _peak_stress(link, u)
        if load == "pull":
            round_ = FORCE * _out_of_round(link, _bores(link)[1], u)
    return _Found(deflection, stress, float(frequencies(link, PLATE.near)[0]), round_)


def _peak_stress(link: Link, u: Float[np.ndarray, "n 3"]) -> float:
    """The highest equivalent stress of a node near the loaded bore."""
    surface = _bores(link)[1]
    H = np.stack([G @ u for G in nodal_gradients(link)], axis=2)
    near = np.linalg.norm((link.X - surface.origin)[:, :2], axis=1) <= NEAR * surface_radius(surface)
    return float(von_mises(stress_of_gradient(H[near], link)).max())


def _out_of_round(link: Link, surface: CouplingSurface, u: Float[np.ndarray, "n 3"]) -> float:
    """Root mean square, over a bore, of what no rigid motion of it is."""
    nodes, G = surface_gram(link, surface.facets)  # type: ignore[arg-type]
    r = link.X[nodes] - surface.origin
    turns = [np.cross(axis, r) for axis in np.eye(3)]
    B = np.stack([*(np.tile(axis, (len(r), 1)) for axis in np.eye(3)), *turns], axis=2).reshape(-1, 6)
    root = np.kron(np.linalg.cholesky(G.toarray()).T, np.eye(3))
    v = root @ u[nodes].ravel()
    left = v - root @ B @ np.linalg.lstsq(root @ B, v, rcond=None)[0]
    return float(np.linalg.norm(left) / np.sqrt(G.sum()))


def _condition(link: Link) -> float:
    """Of the effective matrix of a step, by power iteration from both ends."""
    A = sp.csr_array(effective_matrix(link, generalised_alpha(STEP, 1.0).a0, 1.0))
    factor = Cholesky(A, link.name)
    x = y = np.random.default_rng(1).standard_normal(A.shape[0])
    largest = least = 1.0
    for _ in range(ROUNDS):
        x, y = A @ x, factor.solve(np.ascontiguousarray(y)).copy()
        largest, least = float(np.linalg.norm(x)), float(np.linalg.norm(y))
        x, y = x / largest, y / least
    return largest * least


def _by_stiffness(size: Size) -> list[str]:
    """Rigid couplings of several stiffnesses."""
    link = part_link(PLATE, "hex20", size)
    averaged, base = _found(link), _condition(link)
    tried = {times: _stiffened(link, times) for times in TRIED}
    found = {times: _found(each) for times, each in tried.items()}
    limit = found[TRIED[-1]].deflection["pull"]
    rows = [
        (f"{times:.0e}{' (default)' if times == STIFF else ''}", f"{each.out_of_round / averaged.out_of_round:.1e}",
         f"{each.deflection['pull'] / limit - 1:.1e}", f"{_condition(tried[times]) / base:.2g}")
        for times, each in found.items()
    ]  # fmt: skip
    return table(("STIFF", "out of round", "deflection", "condition"), rows)


def _change(averaged: float, stiff: float) -> str:
    return f"{averaged:.4g}, {stiff:.4g}: {100 * (stiff / averaged - 1):+.1f} %"


if __name__ == "__main__":
    script(bench_ports)
