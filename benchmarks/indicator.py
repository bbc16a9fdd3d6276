"""``python -m benchmarks.indicator``: the indicator of a mesh's error beside the error itself, on parts of the catalogue.

Each part is pulled apart by its own inertia along its longest axis, a load that is in balance and smooth, so that no
support adds an error of its own. The truth is what the energy of a mesh of some eight times the unknowns has more, and
what that one's own indicator says is left.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import scipy.sparse as sp
from geometry.catalogue import meshed, written
from jaxtyping import Float

from benchmarks.pages import script, table, write_page
from benchmarks.parts import STEEL
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.links.indicator import indicator
from kedfem.links.record import Link
from kedfem.links.segments import longest_axis
from kedfem.links.solid import solid_link

PARTS = (
    "plate_with_chamfered_bores", "lever_with_rounded_edges", "casting", "ribbed_bell_crank", "bent_bracket", "pipe_tee",
    "crossing_bores", "housing", "forged_rocker", "angled_arm",
)  # fmt: skip
MOST = 150_000  # unknowns of the fine mesh
SOFT = 1e-8  # of (E/ρ) / L²: what holds rigid motions, to which the load does nothing


@dataclass(frozen=True, slots=True)
class Judged:
    """A part's mesh, its indicator and its error in the energy norm [-]."""

    name: str
    way: str
    unknowns: int
    indicated: float
    true: float

    @property
    def effectivity(self) -> float:
        """How much of the error is indicated."""
        return self.indicated / self.true


def judged(name: str, folder: Path) -> Judged:
    """The indicator of a part at its default sizes beside the error."""
    file, _ = written(name, folder)
    coarse = solid_link(name, meshed(file), STEEL, np.eye(3))
    unknowns = min(8 * coarse.unknowns, MOST)
    fine = solid_link(name, meshed(file, unknowns=unknowns), STEEL, np.eye(3))
    found = []
    for link in (coarse, fine):
        u, compliance = pulled_apart(link)
        found.append((indicator(link, u).eta, compliance))
    (eta, soft), (left, stiff) = found
    true = float(np.sqrt(max(1 - soft / stiff, 0.0) + left**2))
    return Judged(name, coarse.method.split(";")[0], coarse.unknowns, eta, true)


def pulled_apart(link: Link) -> tuple[Float[np.ndarray, "n 3"], float]:
    """The state of a free part under ρ s e along its longest axis of inertia e, s from its centre, and its compliance."""
    mass, e = link.mass[0], longest_axis(link)
    force = np.outer(mass @ (link.X @ e - link.one * (link.centre @ e)), e)
    held = SOFT * STEEL.youngs_modulus / STEEL.density / link.size**2
    u = Cholesky(sp.csr_array(link.K0 + held * sp.kron(mass, sp.eye_array(3))), "K0").solve(force.ravel())
    return u.reshape(-1, 3), float(force.ravel() @ u)


def indicators(folder: Path, quick: bool) -> None:
    """The page performance/indicator.md."""
    with TemporaryDirectory() as parts:
        every = [judged(name, Path(parts)) for name in PARTS[: 2 if quick else None]]
    header = ("part", "mesh", "unknowns", "indicated [%]", "true [%]", "indicated / true")
    rows = [
        (each.name.replace("_", " "), each.way, f"{each.unknowns:,}", f"{100 * each.indicated:.2g}",
         f"{100 * each.true:.2g}", f"{each.effectivity:.2f}")
        for each in every
    ]  # fmt: skip
    write_page(folder, "performance/indicator", [table(header, rows)])


if __name__ == "__main__":
    script(indicators)
