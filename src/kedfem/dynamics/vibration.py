"""The least damped vibration about a steady motion over a period: its link, frequency and shape."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Snapshot, bent
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.period.search import Periodic
from kedfem.dynamics.system.ready import displacements
from kedfem.dynamics.system.starts.instant import TURN, Flat
from kedfem.dynamics.system.steps import Steps
from kedfem.links.record import Link, mass_times
from kedfem.motion.rigid import joined

FRAMES = 48  # over a period
SMALL = 1e-4  # of the size of the state: differences by which it is found where states are no sums

Rows = Float[np.ndarray, "f n d"]


@dataclass(frozen=True, slots=True)
class Vibration:
    """A vibration about a steady motion.

    frequency : [Hz], from what moves and how fast
    shares : name of a link → its part of the vibration's kinetic energy, largest first
    snapshots : over a period, without the steady motion's own deflection; of any amplitude
    """

    frequency: float
    shares: Mapping[str, float]
    snapshots: tuple[Snapshot, ...]

    @property
    def words(self) -> str:
        """Its frequency, and the link that moves most."""
        name, share = next(iter(self.shares.items()))
        mostly = (
            f"{100 * share:.0f} % of its kinetic energy in link {name!r}" if len(self.shares) > 1 else f"of link {name!r}"
        )
        return f"at about {self.frequency:.4g} Hz, {mostly}"


def vibration(over: PeriodMap, solver: Steps, found: Periodic) -> Vibration:
    """The vibration of the multiplier of largest magnitude, from the difference that it makes in a march over the period.

    Parameters
    ----------
    solver : whose steps the map takes
    """
    x, model = over.vector(found.state), solver.model
    at = np.unique(np.round(np.linspace(1, over.steps, FRAMES)).astype(int)) - 1
    by = 1.0 if over.linear else SMALL * over.size(x) / over.size(found.shape)
    motion, *base, frames = _states(over, solver, x, at)
    _, *moved, _ = _states(over, solver, over.possible(x + by * found.shape), at)
    u, v, g = ([after - before for after, before in zip(*each, strict=True)] for each in zip(moved, base, strict=True))
    largest = max(float(np.linalg.norm(each, axis=-1).max()) for each in u) or 1.0
    snapshots = tuple(
        Snapshot(int(at[f]) + 1, motion, f, [
            replace(bent(each[f] / largest, R[f]), g=deformed[f] / largest)
            for each, deformed, R in zip(u, g, frames, strict=True)
        ])
        for f in range(len(at))
    )  # fmt: skip
    moving, still = ([_mass_product(link, x) for link, x in zip(model.links, of, strict=True)] for of in (v, u))
    energy = dict.fromkeys((link.name for link in model.links), 0.0)
    for link, part in zip(model.links, moving, strict=True):
        energy[link.name] += part
    total = sum(energy.values()) or 1.0
    shares = {name: part / total for name, part in sorted(energy.items(), key=lambda each: -each[1])}
    squared = total / (sum(still) or 1.0) - (np.log(max(found.growth, 1e-300)) / over.period) ** 2
    return Vibration(float(np.sqrt(max(squared, 0.0))) / TURN, shares, snapshots)


def _mass_product(link: Link, x: Rows) -> float:
    """Σ x M x over time."""
    return sum(float(np.vdot(each, mass_times(link.mass, each))) for each in x)


def _states(over: PeriodMap, solver: Steps, x: Flat, at: Int[np.ndarray, " f"]) -> tuple[Any, ...]:
    """What a march over the period passes through at some steps: the rigid motion, and of all links displacements, rates,
    deformations (f, n, d) and frames (f, d, d)."""
    motions, out, done, links = [], [], 0, solver.links
    for motion, found in over.histories(x):
        here = at[(at >= done) & (at < done + len(motion.t))] - done
        done += len(motion.t)
        motions.append(motion.at(here))
        out.append([
            [*(displacements(over.of, k, each[here]) for each in (found.u, found.v)),
             solver.deformation(k, found)[here], found.R[here, k, : link.d, : link.d]]
            for k, link in enumerate(links)
        ])  # fmt: skip
    every = [[np.concatenate([part[k][j] for part in out]) for k in range(len(links))] for j in range(4)]
    return joined(motions) if len(motions) > 1 else motions[0], *every
