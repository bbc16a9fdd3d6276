"""What the time integration hands on: all links over a block of time points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.stepping.state import ForcingAt
from kedfem.motion.rigid import RigidMotion


@dataclass(frozen=True, slots=True)
class Forcing:
    """What rigid motion and loads do to one link over T time points.

    R : (T, d, d) orientation, link to world
    F : (T, n, d) P − M R0'', world components [N]
    stress : (T, m) factors of the link's stress modes; None without stiffening
    """

    R: Float[np.ndarray, "T d d"]
    F: Float[np.ndarray, "T n d"]
    stress: Float[np.ndarray, "T m"] | None = None

    def at(self, k: int) -> ForcingAt:
        """At the k-th of the times."""
        return ForcingAt(self.R[k], self.F[k], None if self.stress is None else self.stress[k])

    def first(self, T: int) -> "Forcing":
        """Over the first of the times."""
        return Forcing(self.R[:T], self.F[:T], None if self.stress is None else self.stress[:T])


@dataclass(frozen=True, slots=True)
class Products:
    """Products with the state that a solver has at hand anyway; all (T, n, d), those that are not needed (T, 0, 0).

    Mv : M δ', world components [kg m/s]
    Kg, Cg : K0 g [N] and C0 g [N s], link frame; Cg is None without damping,
        or where the mass is 1 and K0 g shows it
    """

    Mv: Float[np.ndarray, "T _ _"]
    Kg: Float[np.ndarray, "T _ _"]
    Cg: Float[np.ndarray, "T _ _"] | None

    def part(self, first: int, end: int) -> "Products":
        """The time points from one number up to another."""
        Cg = None if self.Cg is None else self.Cg[first:end]
        return Products(self.Mv[first:end], self.Kg[first:end], Cg)


@dataclass(frozen=True, slots=True)
class LinkHistory:
    """Elastic motion of one link over T time points.

    u, v, a : (T, n, d) δ, δ', δ'', world components [m, m/s, m/s²; third row of a beam: ψ]
    g : (T, n, d) δ in the link frame
    R, F : as in `Forcing`
    port_forces : (T, q) λ on the link at its ports, link frame [N]
    strain : (T,) strain energy ½ gᵀ K0 g, [KED, eq. (13)] [J]
    products : of a solver of large links; None where they are cheap to make
    """

    u: Float[np.ndarray, "T n d"]
    v: Float[np.ndarray, "T n d"]
    a: Float[np.ndarray, "T n d"]
    g: Float[np.ndarray, "T n d"]
    R: Float[np.ndarray, "T d d"]
    F: Float[np.ndarray, "T n d"]
    port_forces: Float[np.ndarray, "T q"]
    strain: Float[np.ndarray, " T"]
    products: Products | None = None

    def part(self, first: int, end: int) -> "LinkHistory":
        """The time points from one number up to another."""
        products = None if self.products is None else self.products.part(first, end)
        return replace(self.every(slice(first, end)), products=products)

    def every(self, which: slice | Int[np.ndarray, " k"]) -> "LinkHistory":
        """Some of the time points, without products."""
        names = [each.name for each in fields(self) if each.name != "products"]
        return LinkHistory(**{name: getattr(self, name)[which] for name in names})


def joined(parts: Sequence[list[LinkHistory]]) -> list[LinkHistory]:
    """Histories of all links over successive time points, one after the other, without products."""
    if len(parts) < 2:
        return parts[0] if parts else []
    names = [each.name for each in fields(LinkHistory) if each.name != "products"]
    every: list[dict[str, Any]] = [
        {name: np.concatenate([getattr(x, name) for x in each]) for name in names}
        for each in zip(*parts, strict=True)
    ]
    return [LinkHistory(**each) for each in every]


@dataclass(frozen=True, slots=True)
class LinkMoment:
    """`LinkHistory` at one time point, without the first dimension."""

    u: Float[np.ndarray, "n d"]
    v: Float[np.ndarray, "n d"]
    a: Float[np.ndarray, "n d"]
    g: Float[np.ndarray, "n d"]
    R: Float[np.ndarray, "d d"]
    F: Float[np.ndarray, "n d"]
    port_forces: Float[np.ndarray, " q"]
    strain: float


def bent(u: Float[np.ndarray, "n d"], R: Float[np.ndarray, "d d"]) -> LinkMoment:
    """A link that is bent and does not move; u in world components."""
    none = np.zeros_like(u)
    return LinkMoment(u, none, none, u @ R, R, none, np.zeros(0), 0.0)


@dataclass(frozen=True, slots=True)
class Exerted:
    """What constraint equations and force laws exert over T time points, where bodies are; world components.

    wrench : (T, J, 3, 3) of joints by constraint equations, in the order of the model's: force on link i, moment about
        its point there, and that point
    effort : (T, J) along the coordinate of a joint's drive, and of gears along that of their first joint
    spring : (T, 2, s) deflection and force of the springs of bushings and shafts; stiffness, damping : (s,) of each
    element : (T, 3, A) coordinate, its rate and force along it of motors and springs, in the order of `force_elements`
    ends : (T, A, 2, 2, 3) force and moment about the world's origin at both ends of each
    ports : (T, m) forces on interface points of joints by constraint equations, side by side
    """

    wrench: Float[np.ndarray, "T J 3 3"]
    effort: Float[np.ndarray, "T J"]
    spring: Float[np.ndarray, "T 2 s"]
    element: Float[np.ndarray, "T 3 A"]
    ends: Float[np.ndarray, "T A 2 2 3"]
    ports: Float[np.ndarray, "T m"]
    stiffness: Float[np.ndarray, " s"]
    damping: Float[np.ndarray, " s"]

    def every(self, which: slice | Int[np.ndarray, " k"]) -> "Exerted":
        """Some of the time points."""
        return replace(self, **{name: getattr(self, name)[which] for name in OVER_TIME})


OVER_TIME = ("wrench", "effort", "spring", "element", "ends", "ports")


def exerted_together(
    parts: Sequence[Exerted | None], how: Callable[[list[np.ndarray]], Float[np.ndarray, "..."]]
) -> Exerted | None:
    """One of several, each array by the same formula; None if there is none."""
    known = [each for each in parts if each is not None]
    if len(known) < len(parts) or not known:
        return None
    return replace(known[0], **{name: how([getattr(x, name) for x in known]) for name in OVER_TIME})


@dataclass(frozen=True, slots=True)
class Block:
    """Everything at T successive time points.

    step : number of the first
    motion : rigid motion at them
    links : per link
    levels : the same time points as each level has them (`dynamics.stepping.levels`), coarsest first; none of one march
    fine : whether these are not the time points of the analysis, but all those of the finest level, numbered in its steps
    exerted : what constraint equations and force laws exert, of solvers that know it themselves
    """

    step: int
    motion: RigidMotion
    links: Sequence[LinkHistory]
    levels: tuple["Block", ...] = ()
    fine: bool = False
    exerted: Exerted | None = None

    def __len__(self) -> int:
        return len(self.motion.t)

    def part(self, first: int, end: int) -> "Block":
        """The time points from one number up to another."""
        if (first, end) == (0, len(self)):
            return self
        links = [each.part(first, end) for each in self.links]
        levels = tuple(each.part(first, end) for each in self.levels)
        exerted = None if self.exerted is None else self.exerted.every(slice(first, end))
        return Block(self.step + first, self.motion.part(first, end), links, levels, self.fine, exerted)

    def every(self, stride: int) -> "Block":
        """Some of its time points, the first and each so many further on; without products."""
        return self.chosen(slice(None, None, stride))

    def chosen(self, which: slice | Int[np.ndarray, " k"]) -> "Block":
        """Some of its time points; without products and levels."""
        links = [link.every(which) for link in self.links]
        exerted = None if self.exerted is None else self.exerted.every(which)
        return Block(self.step, self.motion.at(which), links, exerted=exerted)

    def at(self, k: int) -> "Snapshot":
        """The k-th of its time points."""
        moments = [
            LinkMoment(**{f.name: getattr(each, f.name)[k] for f in fields(LinkMoment)})
            for each in self.links
        ]
        return Snapshot(self.step + k, self.motion, k, moments)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything at one time point: number of the step, rigid motion (entry k of a block), elastic states."""

    step: int
    motion: RigidMotion
    k: int
    states: list[LinkMoment]

    def copied(self) -> "Snapshot":
        """The same in arrays of its own, which keep nothing else alive."""
        motion = self.motion.at(np.array([self.k]))
        names = [f.name for f in fields(LinkMoment) if f.name != "strain"]
        states = [replace(x, **{name: getattr(x, name).copy() for name in names}) for x in self.states]
        return Snapshot(self.step, motion, 0, states)

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self.motion.t[self.k])

    @property
    def phi(self) -> float:
        """Drive angle [rad]."""
        return float(self.motion.phi[self.k])
