"""Beams in space with frames of their own are too stiff where an element bends much: what a run shows of that.

Their strains are linear in one mean frame of each element. An element of length l that bends by ψ strains its axis by
about ψ²/2, which one of radius of gyration r cannot bear beside its bending: p = ψ l / r tells. Measured on a whipping
arm of 125 times its height, against planar beams: 2, 4, 8, 16 elements bend too little by 78, 56, 15, 0.9 %, with p
of 4.1, 2.1, 0.86, 0.26 in the run itself. So the error is about 0.12 p² while that is small. The 45° bend of Bathe and
Bolourchi needs 32 elements (p = 0.2).
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from kedfem.dynamics.history import Block
from kedfem.dynamics.model import Model
from kedfem.links.record import Link

STIFFER = 0.12  # of p²: part by which an element is too stiff
TOLD = 0.02  # part from which a warning says so


@dataclass(frozen=True, slots=True)
class _Element:
    """A beam in space with a frame of its own, as drawn in that frame.

    nodes : functions that are values at its nodes; along : (m,) where these are from end to end, 0 to 1
    across : (3, 3) onto the plane across the chord; length [m]
    spread : (3, 3) second moments of its mass about the centre, per mass [m²]
    """

    k: int
    name: str
    nodes: Int[np.ndarray, " m"]
    along: Float[np.ndarray, " m"]
    across: Float[np.ndarray, "3 3"]
    length: float
    spread: Float[np.ndarray, "3 3"]


@dataclass
class Locking:
    """Largest p² of every link over a run, block after block."""

    model: Model
    largest: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        every = enumerate(self.model.links)
        self.elements = [
            made
            for k, x in every
            if x.kind == "spatial_beam" and x.fit is not None
            for made in [_element(k, x)]
            if made
        ]

    def add(self, block: Block) -> None:
        """The time points of one more block."""
        for each in self.elements:
            g = block.links[each.k].g[:, each.nodes]
            chord = (1 - each.along)[:, None] * g[:, :1] + each.along[:, None] * g[:, -1:]
            sag = (g - chord) @ each.across
            size = np.linalg.norm(sag, axis=2)
            k = np.unravel_index(size.argmax(), size.shape)
            if size[k] > 0.0:
                way = sag[k] / size[k]
                psi = 8 * size[k] / each.length
                p2 = float((psi * each.length) ** 2 / (way @ each.spread @ way))
                self.largest[each.name] = max(self.largest.get(each.name, 0.0), p2)

    def warnings(self) -> tuple[str, ...]:
        """Links that are too stiff, and how many elements they need."""
        out = []
        for name, p2 in self.largest.items():
            if STIFFER * p2 > TOLD:
                now = sum(each.name == name for each in self.elements)
                needed = int(np.ceil(now * (STIFFER * p2 / TOLD) ** 0.25))
                part = min(100 * STIFFER * p2, 99.0)
                out.append(
                    f"links.{name}: its beams in space are too stiff by some {part:.0f} % where they bend "
                    f"(with frames that follow, {now} element{'s' * (now > 1)}): take {needed} elements or more, "
                    "or planar beams where the link moves in a plane"
                )
        return tuple(out)


def _element(k: int, link: Link) -> _Element | None:
    """A segment as it is looked at; None of one without an inner node."""
    nodes = np.flatnonzero(np.abs(link.one) > 0.5)
    if len(nodes) < 3:
        return None
    chord = np.linalg.svd(link.X[nodes] - link.X[nodes].mean(axis=0))[2][0]
    s = link.X[nodes] @ chord
    nodes, s = nodes[np.argsort(s)], np.sort(s)
    length = float(s[-1] - s[0])
    mass = float(link.one @ link.m1[:, 0])
    moments = link.X.T @ np.asarray(link.mass[0] @ link.X) / mass
    centre = link.one @ link.mX / mass
    across = np.eye(3) - np.outer(chord, chord)
    return _Element(
        k, link.name, nodes, (s - s[0]) / length, across, length, moments - np.outer(centre, centre)
    )
