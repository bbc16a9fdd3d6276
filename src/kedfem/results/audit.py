"""The energy account of a run, kept step by step.

With the absolute rate R0' + δ' the general equation, [KED, eq. (20)], gives exactly

    d/dt (T + V) = loads + supports − g'ᵀ C0 g' − Σ ω · Σ δ × K δ − (damping on the rigid-body motion)

because T K0 Tᵀ rotates with the rigid-body motion, not with the bent link: its forces have the moment Σ δ × K δ, which a
real link's internal forces do not have. This geometric error of the equation is a separate term. The residual is that of
the integration: of second order in the step, and the dissipation of numerical damping (ρ∞ < 1).

Geometric stiffening stores ½ Σ g · k g P, part of the strain energy here, and its forces R (k g P) do work on the
rigid-body motion; that, and the work of the stresses as they change, by loads that shorten bent links, is separate, too.

Supports also do work on the elastic motion where joints are enforced by constraint equations with directions that vary
in time. Springs in joints, bushings and shafts store energy and dampers dissipate it, which is no work of supports.

Work is the trapezoidal sum of powers; that of damping is taken with means over a step, h ġᵀ C0 ġ with ġ = (g1 − g0)/h.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Block, LinkHistory
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.loads import applied
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.stiffening import Stiffening
from kedfem.motion.rigid import RigidMotion
from kedfem.results.balance import Balance, Flow, fields_of, flow, prescribed_fields, stress
from kedfem.results.channels import Channel
from kedfem.results.forces.constraint_forces import joint_spring_work
from kedfem.results.forces.damping_work import PreviousPoint, damping_work, previous_of, products
from kedfem.results.forces.force_elements import ElementForces
from kedfem.results.forces.moments import Constants, RigidRates, constants, rates_of_bodies
from kedfem.scene import percentage

Rows = Float[np.ndarray, "T c"]
GROUP = 12  # links whose moments are computed together: those of a thousand time points fit into a cache
LITTLE = 1e-3  # of the kinetic energy: if less is exchanged, shares of it would be meaningless
UNBALANCED = 0.02  # resolved motion leaves 1e-6 to 3e-3, too long steps 0.1 (docs/theory/evaluation.md)
ENERGIES = (
    ("kinetic", ("kinetic",), "kinetic energy of the absolute motion of all links"),
    ("strain", ("strain",), "strain energy of all links, [KED, eq. (13)], and of springs in joints"),
    ("work", ("loads", "supports"), "work done by the loads, motors and springs; by the drive and the other supports"),
    ("dissipated", ("dissipated",), "energy dissipated by damping"),
    ("neglected", ("neglected",), "work of the elastic forces' moment on bent links, which the equation neglects"),
    ("residual", ("residual",), "residual energy of the integration"),
)  # fmt: skip
NONE = np.zeros(0, int)
NO_PORTS = Attachment(NONE, np.zeros((0, 0)), 3, np.zeros((0, 3)), (), NONE, NONE, np.zeros((0, 0)), 0)


@dataclass
class _Sums:
    """Time integrals over successive blocks: of rates by the trapezoidal rule, and sums of energy dissipated in steps."""

    t: float
    rates: Float[np.ndarray, " r"]
    work: Float[np.ndarray, " r"]
    taken: Float[np.ndarray, " s"]

    def add(
        self, t: Float[np.ndarray, " T"], rates: Float[np.ndarray, "T r"], taken: Float[np.ndarray, "T s"]
    ) -> tuple[Float[np.ndarray, "T r"], Float[np.ndarray, "T s"]]:
        """Add the next block; both integrals at its time points."""
        before = np.concatenate([self.rates[None], rates[:-1]])
        h = np.diff(t, prepend=self.t)
        work = self.work + np.cumsum(0.5 * h[:, None] * (rates + before), axis=0)
        total = self.taken + np.cumsum(taken, axis=0)
        self.t, self.rates, self.work, self.taken = t[-1], rates[-1], work[-1], total[-1]
        return work, total


class Account:
    """Energy of all links from the first block on; a block that does not continue the last one starts anew."""

    REMEMBERED = ("_next", "_sums", "_start", "_stored", "_last", "_springs", "_largest")

    def __init__(
        self, model: Model, force_elements: ElementForces | None = None,
        stresses: Callable[[], Stiffening | None] = lambda: None,
    ) -> None:  # fmt: skip
        self.model, self.force_elements, self.stresses = model, force_elements, cache(stresses)
        joined = zip(model.links, model.joints, model.bodies, strict=True)
        self.of = [constants(*each, model.damping) for each in joined]
        self.prescribed = [constants(x.link, NO_PORTS, x.body, Rayleigh()) for x in model.prescribed]
        self._groups = [group for k in (2, 3) for group in _grouped(self.of, k)]
        self._prescribed_groups = [group for k in (2, 3) for group in _grouped(self.prescribed, k)]
        self._block: Block | None = None
        self._displaced = any(link.fit is not None for link in model.links)
        self._begin()

    def _begin(self) -> None:
        self._next = -1
        self._sums: _Sums | None = None
        self._start = self._stored = 0.0
        self._last: list[PreviousPoint | None] = [None] * len(self._groups)
        self._springs: tuple[float, np.ndarray, np.ndarray] | None = None
        self._largest = np.zeros(4)

    def rows(self, block: Block) -> dict[str, Rows]:
        """The channels over a block; the same block again is not counted twice.

        Beside them `driven`: work of the drives alone, that of the supports on the rigid-body motion; all of it where
        constraints go with displaced bodies.
        """
        if block is not self._block:
            if block.step != self._next:
                self._begin()
            self._rows = self._added(block)
            self._block, self._next = block, block.step + len(block)
        return self._rows

    @property
    def balance(self) -> Balance:
        """The largest residuals so far."""
        exchanged, *left = self._largest.tolist()
        return Balance(*(x / exchanged if exchanged else 0.0 for x in left))

    def _added(self, block: Block) -> dict[str, Rows]:
        """Energies and sums of the next block."""
        flow, taken = self._flows(block)
        strain = np.sum([link.strain for link in block.links], axis=0)
        springs = joint_spring_work(block, self._springs) if self.model.rows else None
        pushed = np.zeros(len(block))
        if springs is not None:
            # what springs push is no support's work: they store it or take it
            strain, pushed, self._springs = strain + springs.stored, springs.pushed, springs.last
            taken = taken + springs.dissipated[:, None] * [1, 0]
        taken = np.column_stack([taken, pushed])
        power, stored = self._stress(block)
        strain = strain + stored
        energy = flow.kinetic + strain
        flow = replace(flow, neglected=flow.neglected + power)
        rates = np.stack([flow.loads, flow.supports, flow.neglected, flow.constraint_joints, flow.mass_damping], axis=1)
        if self._sums is None:
            self._sums = _Sums(float(block.motion.t[0]), rates[0], np.zeros(5), np.zeros(3))
            self._start, self._stored = float(energy[0]), float(stored[0])
        work, total = self._sums.add(block.motion.t, rates, taken)
        loads, supports, neglected, joints, damped = work.T
        neglected = neglected - (stored - self._stored)
        dissipated, drag, pushed = total.T
        driven, supports = supports - joints, supports - pushed
        if self._displaced:  # constraints along directions of displaced bodies do no work in all
            driven = supports
        change = energy - self._start
        left = change - loads - supports + dissipated + drag + neglected
        exchanged = change, strain, loads, supports, dissipated, LITTLE * flow.kinetic
        found = tuple(np.abs(x).max() for x in (exchanged, left, neglected, damped))
        self._largest = np.maximum(self._largest, found)
        rows = {
            "kinetic": flow.kinetic, "strain": strain, "dissipated": dissipated, "neglected": neglected + drag,
            "residual": left, "driven": driven,
        }  # fmt: skip
        return {name: x[:, None] for name, x in rows.items()} | {"work": np.stack([loads, supports], axis=1)}

    def _stress(self, block: Block) -> Float[np.ndarray, "2 T"]:
        """Power [W] and energy [J] of geometric stiffening; zero without it."""
        stresses, found = self.stresses(), np.zeros((2, len(block)))
        if stresses is None:
            return found
        factors = stresses.over(forcings(self.model, block.motion), block.motion)
        at = rates_of_bodies(block.motion)
        for group in self._groups:
            of, links = [self.of[i] for i in group], [block.links[i] for i in group]
            made = [(stresses.modes[i], factors[i]) for i in group]
            found += stress(of, links, made, at.of(_bodies(of), of[0].k))
        return found

    def _flows(self, block: Block) -> tuple[Flow, Float[np.ndarray, "T 2"]]:
        """Energy and power of all links, and the energy that damping dissipates in each step."""
        motion, at, flows, taken = block.motion, rates_of_bodies(block.motion), [], np.zeros((len(block), 2))
        for k, group in enumerate(self._groups):
            of, links = [self.of[i] for i in group], [block.links[i] for i in group]
            found, lost = self._flow_of(k, of, links, motion, at)
            flows.append(found)
            taken += lost
        for group in self._prescribed_groups:
            of, loaded = [self.prescribed[i] for i in group], [self.model.prescribed[i] for i in group]
            forces = [applied(x.link, x.loads, motion, x.body) for x in loaded]
            flows.append(flow(of, prescribed_fields(of, forces), at.of(_bodies(of), of[0].k)))
        found = sum(flows[1:], start=flows[0])
        if self.force_elements is not None and self.prescribed:
            power = self.force_elements.power({x.link.name for x in self.model.prescribed}, block)
            found = replace(found, loads=found.loads + power, supports=found.supports - power)
        return found, taken

    def _flow_of(
        self, k: int, of: list[Constants], links: Sequence[LinkHistory], motion: RigidMotion, at: RigidRates
    ) -> tuple[Flow, Float[np.ndarray, "T 2"] | float]:
        """Energy and power of the links of a group, and their dissipation."""
        turns = [x.link.fit is None for x in of]
        made = [products(*each) for each in zip(of, links, turns, strict=True)]
        bodies = _bodies(of)
        rows_work = bool(self.model.rows)
        found = flow(of, fields_of(of, links, made, turns, rows_work), at.of(bodies, of[0].k))
        if not self.model.damping.present:
            return found, 0.0
        last = self._last[k] or previous_of(motion.t, at, of, links, made, 0)
        lost = damping_work(of, links, made, turns, (motion.t, at), last)
        self._last[k] = previous_of(motion.t, at, of, links, made, -1)
        return found, np.stack(lost, axis=1)


def energy_channels(account: Account) -> list[tuple[Channel, Callable[[Block], Rows]]]:
    """Energies over time, and the residual of the integration."""

    def rows(name: str, block: Block) -> Rows:
        return account.rows(block)[name]

    channels = [Channel(f"energy/{name}", columns, "J", "", text) for name, columns, text in ENERGIES]
    return [(each, partial(rows, each.name.removeprefix("energy/"))) for each in channels]


def balance_warning(found: Balance) -> tuple[str, ...]:
    """A warning where the time integration loses or creates energy."""
    if found.energy <= UNBALANCED:
        return ()
    return (
        f"the residual of the balance is {percentage(found.energy)} of energy: the steps are too long for the motion, or "
        "numerical damping takes vibrations that they do not resolve; take shorter ones",
    )


def _grouped(of: Sequence[Constants], k: int) -> list[list[int]]:
    """Numbers of the links in k dimensions, a few at a time."""
    which = [i for i, x in enumerate(of) if x.k == k]
    return [which[i : i + GROUP] for i in range(0, len(which), GROUP)]


def _bodies(of: Sequence[Constants]) -> Int[np.ndarray, " S"]:
    return np.array([x.body for x in of])
