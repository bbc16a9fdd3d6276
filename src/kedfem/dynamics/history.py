"""Records that the time integration returns: states and forces of all links over a block of time points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.motion.rigid import RigidMotion


@dataclass(frozen=True, slots=True)
class Forcing:
    """Rigid motion and loads of one link over T time points.

    R : (T, d, d) orientation, link to world
    F : (T, n, d) P − M R0'', world components [N]
    """

    R: Float[np.ndarray, "T d d"]
    F: Float[np.ndarray, "T n d"]

    def part(self, first: int, end: int) -> "Forcing":
        """The time points from one number up to another."""
        return Forcing(self.R[first:end], self.F[first:end])


@dataclass(frozen=True, slots=True)
class Products:
    """Products of matrices with the state, which a solver has computed; all (T, n, d), unneeded ones (T, 0, 0).

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
        {name: np.concatenate([getattr(x, name) for x in each]) for name in names} for each in zip(*parts, strict=True)
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
    """A link with a constant deflection u (world components) and no rates."""
    none = np.zeros_like(u)
    return LinkMoment(u, none, none, u @ R, R, none, np.zeros(0), 0.0)


@dataclass(frozen=True, slots=True)
class Multipliers:
    """Multipliers of constraints and laws over T time points of a march; `dynamics.system.forces` has their forces.

    system : whose march that is; None where nothing was marched
    z : (T, k) interface unknowns
    e, rate, multiplier : (T, c) coordinates, their rates, and forces along them
    """

    system: Any
    z: Float[np.ndarray, "T k"]
    e: Float[np.ndarray, "T c"]
    rate: Float[np.ndarray, "T c"]
    multiplier: Float[np.ndarray, "T c"]

    def every(self, which: slice | Int[np.ndarray, " k"]) -> "Multipliers":
        """Some of the time points."""
        return multipliers_together([self], lambda each: each[0][which])


NONE = Multipliers(None, *np.zeros((4, 0, 0)))


def multipliers_together(
    parts: Sequence[Multipliers], how: Callable[[list[np.ndarray]], Float[np.ndarray, "..."]]
) -> Multipliers:
    """One of several, each array by the same formula."""
    names = ("z", "e", "rate", "multiplier")
    return Multipliers(parts[0].system, *(how([getattr(x, name) for x in parts]) for name in names))


@dataclass(frozen=True, slots=True)
class Block:
    """Everything at T successive time points.

    step : number of the first
    motion : rigid motion at them
    links : per link
    levels : the same time points as each level has them (`dynamics.stepping.levels`), coarsest first; none of one march
    fine : whether these are not the time points of the analysis, but all those of the finest level, numbered in its steps
    multipliers : of the march that took these steps
    """

    step: int
    motion: RigidMotion
    links: Sequence[LinkHistory]
    levels: tuple["Block", ...] = ()
    fine: bool = False
    multipliers: Multipliers = NONE

    def __len__(self) -> int:
        return len(self.motion.t)

    def part(self, first: int, end: int) -> "Block":
        """The time points from one number up to another."""
        if (first, end) == (0, len(self)):
            return self
        links = [each.part(first, end) for each in self.links]
        levels = tuple(each.part(first, end) for each in self.levels)
        multipliers = self.multipliers.every(slice(first, end))
        return Block(self.step + first, self.motion.part(first, end), links, levels, self.fine, multipliers)

    def chosen(self, which: slice | Int[np.ndarray, " k"]) -> "Block":
        """Some of its time points; without products and levels."""
        links = [link.every(which) for link in self.links]
        return Block(self.step, self.motion.at(which), links, multipliers=self.multipliers.every(which))

    def at(self, k: int) -> "Snapshot":
        """The k-th of its time points."""
        moments = [LinkMoment(**{f.name: getattr(each, f.name)[k] for f in fields(LinkMoment)}) for each in self.links]
        return Snapshot(self.step + k, self.motion, k, moments, self.multipliers.every(slice(k, k + 1)))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Everything at one time point: number of the step, rigid motion (entry k of a block), states, multipliers."""

    step: int
    motion: RigidMotion
    k: int
    states: list[LinkMoment]
    multipliers: Multipliers = NONE

    def copied(self) -> "Snapshot":
        """The same in arrays of its own, which keep nothing else alive."""
        motion = self.motion.at(np.array([self.k]))
        names = [f.name for f in fields(LinkMoment) if f.name != "strain"]
        states = [replace(x, **{name: getattr(x, name).copy() for name in names}) for x in self.states]
        multipliers = multipliers_together([self.multipliers], lambda each: each[0].copy())
        return Snapshot(self.step, motion, 0, states, multipliers)

    @property
    def t(self) -> float:
        """Time [s]."""
        return float(self.motion.t[self.k])

    @property
    def phi(self) -> float:
        """Drive angle [rad]."""
        return float(self.motion.phi[self.k])
