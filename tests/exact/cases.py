"""Motions with large deflection whose histories are kept as references; all data in SI units."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from . import four_bar
from .beams import Beams, Lump, Rod, joined, kinetic_energy, momenta, strain_energy
from .solve import Law, Observed, Problem, State, start


@dataclass(frozen=True, slots=True)
class Bar:
    """A rectangular bar: height in the plane of bending [m], thickness across it [m], material [Pa, kg/m³]."""

    height: float
    thickness: float
    youngs_modulus: float
    shear_modulus: float
    density: float
    shear_coefficient: float = 5 / 6

    def rod(self, begin: tuple[float, float], end: tuple[float, float], elements: int, nodes: int) -> Rod:
        """The bar between two points."""
        area, moment = self.height * self.thickness, self.thickness * self.height**3 / 12
        E, G, rho = self.youngs_modulus, self.shear_modulus, self.density
        shear = self.shear_coefficient * G * area
        return Rod(begin, end, E * area, shear, E * moment, rho * area, rho * moment, elements, nodes)


@dataclass(frozen=True, slots=True)
class Motion:
    """A problem, its first state, and what is kept of each state."""

    problem: Problem
    first: State
    observed: Observed


@dataclass(frozen=True, slots=True)
class Case:
    """A history to be kept.

    build : (elements, nodes) per link → the motion
    columns : names and units of what is kept
    end, spacing : of the history [s]
    h : finest step [s]; twice and four times it are run too
    elements, nodes : finest mesh; half the elements are run too
    """

    build: Callable[[int, int], Motion]
    columns: tuple[str, ...]
    end: float
    spacing: float
    h: float
    elements: int = 16
    nodes: int = 5
    rho_inf: float = 0.9


def at_rest(problem: Problem) -> State:
    """The reference state, its speeds those of what is held."""
    return start(problem, problem.beams.q0, np.zeros(problem.beams.size))


def turned_about(beams: Beams, omega: float) -> np.ndarray:
    """Rates (N,) of a rigid rotation about the origin [rad/s]."""
    v = np.zeros(beams.size)
    for dof in beams.dof:
        x, y = beams.q0[dof[:, 0]], beams.q0[dof[:, 1]]
        v[dof[:, 0]], v[dof[:, 1]], v[dof[:, 2]] = -omega * y, omega * x, omega
    return v


def driven(beams: Beams, law: Law) -> dict[int, Law | float]:
    """The start of the first rod held in the origin and turned by a law."""
    x, y, theta = (int(k) for k in beams.end(0, 0))
    return {x: 0.0, y: 0.0, theta: law}


def positions(beams: Beams, *ends: tuple[int, int]) -> Observed:
    """x, y of the ends of rods."""
    dofs = np.concatenate([beams.end(*end)[:2] for end in ends])
    return lambda state: state.q[dofs]


# -- the four-bar of Nath and Ghosh -------------------------------------------------------------------------


def four_bar_motion(rpm: float, ratio: float, elements: int, nodes: int) -> Motion:
    problem, first = four_bar.four_bar(rpm, ratio, elements, nodes)
    stress = four_bar.outer_stress(problem)
    return Motion(problem, first, lambda state: np.atleast_1d(stress(state)))


# -- Simo and Vu-Quoc 1986: a flexible robot arm, spun up ---------------------------------------------------

SPIN_UP = Rod((0, 0), (10, 0), 2.8e7, 1.0e7, 1.4e4, 1.2, 6e-4)
SPIN_UP_TIME, SPIN_UP_SPEED = 15.0, 6.0


def spin_up_law(t: float) -> tuple[float, float, float]:
    """θ = 6/15 [t²/2 + (15/2π)² (cos 2πt/15 − 1)] to t = 15 s, then 6 t − 45 [rad]."""
    T, w = SPIN_UP_TIME, SPIN_UP_SPEED
    k = 2 * np.pi / T
    if t >= T:
        return w * t - w * T / 2, w, 0.0
    return (
        w / T * (t * t / 2 + (np.cos(k * t) - 1) / k**2),
        w / T * (t - np.sin(k * t) / k),
        w / T * (1 - np.cos(k * t)),
    )


def spin_up(elements: int, nodes: int) -> Motion:
    r = SPIN_UP
    beams = joined([Rod(r.start, r.end, r.EA, r.GA, r.EI, r.rhoA, r.rhoI, elements, nodes)])
    problem = Problem(beams, driven(beams, spin_up_law))
    tip = beams.end(0, 1)

    def deflection(state: State) -> np.ndarray:
        angle = spin_up_law(state.t)[0]
        (x, y), c, s = state.q[tip[:2]], np.cos(angle), np.sin(angle)
        return np.array([c * x + s * y - r.length, -s * x + c * y, state.q[tip[2]] - angle])

    return Motion(problem, at_rest(problem), deflection)


# -- a rod thrown through space -----------------------------------------------------------------------------

FLYING = Bar(0.002, 0.02, 7e10, 2.7e10, 2700.0)
FLYING_LENGTH, FLYING_FORCE, FLYING_PULSE = 1.0, (2.0, 4.0), 0.1


def flying_load(beams: Beams, t: float) -> np.ndarray:
    """A force on the start that rises linearly to its value and falls to zero again."""
    F = np.zeros(beams.size)
    F[beams.end(0, 0)[:2]] = np.array(FLYING_FORCE) * max(0.0, 1 - abs(2 * t / FLYING_PULSE - 1))
    return F


def flying_rod(elements: int, nodes: int) -> Motion:
    beams = joined([FLYING.rod((0, 0), (FLYING_LENGTH, 0), elements, nodes)])
    problem = Problem(beams, {}, partial(flying_load, beams))
    places = positions(beams, (0, 0), (0, 1))

    def observed(state: State) -> np.ndarray:
        energy = kinetic_energy(beams, state.v) + strain_energy(beams, state.q)
        return np.concatenate([places(state), [energy, momenta(beams, state.q, state.v)[2]]])

    return Motion(problem, at_rest(problem), observed)


# -- a shallow arch of two bars -----------------------------------------------------------------------------

ARCH = Bar(0.02, 0.01, 7e10, 2.7e10, 2700.0)
ARCH_SPAN, ARCH_RISE, ARCH_MASS, ARCH_FORCE = 0.5, 0.02, 1.0, -500.0  # half span; on the apex


def snap_through(elements: int, nodes: int) -> Motion:
    """Pins at (±span, 0) and at the apex (0, rise); a force put on at once pushes it through."""
    ends = ((-ARCH_SPAN, 0.0), (0.0, ARCH_RISE), (ARCH_SPAN, 0.0))
    rods = [ARCH.rod(a, b, elements, nodes) for a, b in pairwise(ends)]
    beams = joined(rods, pins=[[(0, 1), (1, 0)]], lumps=[Lump((0, 1), mass=ARCH_MASS)])
    left, right = beams.end(0, 0), beams.end(1, 1)
    F = np.zeros(beams.size)
    F[beams.end(0, 1)[1]] = ARCH_FORCE
    held = {left[0]: -ARCH_SPAN, left[1]: 0.0, right[0]: ARCH_SPAN, right[1]: 0.0}
    problem = Problem(beams, held, lambda t: F)
    apex = beams.end(0, 1)[1]
    return Motion(problem, at_rest(problem), lambda state: state.q[[apex]])


# -- a slider-crank that passes its dead points under a force on the slider -----------------------------------

DEAD_POINT = Bar(0.001, 0.02, 2.1e11, 8e10, 7800.0)
CRANK, CONNECTING_ROD = 0.1, 0.3
CRANK_INERTIA, SLIDER_MASS, SLIDER_FORCE, CRANK_SPEED = 5e-3, 0.05, -4.0, -30.0
DEAD_POINT_BETA = 1e-5


def dead_point(elements: int, nodes: int) -> Motion:
    """Nobody drives: the crank, drawn upright, starts with a speed and a flywheel on its shaft.

    All rates at t = 0 are those of the rigid linkage, where the rod moves along x without turning.
    """
    B, C = (0.0, CRANK), (float(np.sqrt(CONNECTING_ROD**2 - CRANK**2)), 0.0)
    rods = [DEAD_POINT.rod((0.0, 0.0), B, elements, nodes), DEAD_POINT.rod(B, C, elements, nodes)]
    lumps = [Lump((0, 0), inertia=CRANK_INERTIA), Lump((1, 1), mass=SLIDER_MASS)]
    beams = joined(rods, pins=[[(0, 1), (1, 0)]], lumps=lumps)
    x, y, angle = beams.end(0, 0)
    slider = beams.end(1, 1)
    F = np.zeros(beams.size)
    F[slider[0]] = SLIDER_FORCE
    problem = Problem(beams, {x: 0.0, y: 0.0, slider[1]: 0.0}, lambda t: F, beta=DEAD_POINT_BETA)
    v = np.zeros(beams.size)
    v[beams.dof[1][:, 0]] = -CRANK_SPEED * CRANK
    crank = beams.dof[0]
    v[crank[:, 0]], v[crank[:, 2]] = -CRANK_SPEED * beams.q0[crank[:, 1]], CRANK_SPEED
    first = start(problem, beams.q0, v)
    kept = np.array([angle, *beams.end(0, 1)[:2], slider[0]])
    return Motion(problem, first, lambda state: state.q[kept])


# -- a thin arm that whips, and an arm stopped at once ------------------------------------------------------

WHIP = Bar(0.002, 0.01, 2e9, 7.5e8, 1150.0)
WHIP_LENGTH, WHIP_ANGLE, WHIP_RISE, WHIP_BETA = 1.0, np.pi, 0.5, 2e-4
ARM = Bar(0.02, 0.01, 7e10, 2.7e10, 2700.0)
ARM_LENGTH, ARM_SPEED, ARM_STOPS, ARM_STOPPING = 1.0, 15.0, 0.02, 0.005


def cycloidal(angle: float, rise: float, t: float) -> tuple[float, float, float]:
    """A rise by x − sin(2πx)/2π, x = t/rise, that stops there."""
    x, w = min(t / rise, 1.0), 2 * np.pi
    return (angle * (x - np.sin(w * x) / w), angle / rise * (1 - np.cos(w * x)), angle / rise**2 * w * np.sin(w * x))


def stopping(t: float) -> tuple[float, float, float]:
    """A constant speed ω to t1, from there ω (1 + cos πx)/2, x = (t − t1)/T, to a stop at t1 + T."""
    w, T, x = ARM_SPEED, ARM_STOPPING, min(max((t - ARM_STOPS) / ARM_STOPPING, 0.0), 1.0)
    angle = w * min(t, ARM_STOPS) + w * T / 2 * (x + np.sin(np.pi * x) / np.pi)
    return angle, w / 2 * (1 + np.cos(np.pi * x)), -w * np.pi / (2 * T) * np.sin(np.pi * x)


def whip(elements: int, nodes: int) -> Motion:
    beams = joined([WHIP.rod((0, 0), (WHIP_LENGTH, 0), elements, nodes)])
    law = partial(cycloidal, WHIP_ANGLE, WHIP_RISE)
    problem = Problem(beams, driven(beams, law), beta=WHIP_BETA)
    return Motion(problem, at_rest(problem), positions(beams, (0, 1)))


def sudden_stop(elements: int, nodes: int) -> Motion:
    """All rates at t = 0 are those of the rigid arm; it is not deflected then."""
    beams = joined([ARM.rod((0, 0), (ARM_LENGTH, 0), elements, nodes)])
    problem = Problem(beams, driven(beams, stopping))
    first = start(problem, beams.q0, turned_about(beams, ARM_SPEED))
    return Motion(problem, first, positions(beams, (0, 1)))


def _four_bar(rpm: float, ratio: float, end: float, h: float, elements: int = 8) -> Case:
    return Case(partial(four_bar_motion, rpm, ratio), ("stress [Pa]",), end, 5e-4 if rpm == 600 else 1e-3, h, elements)


TIP = ("x [m]", "y [m]")
CASES: dict[str, Case] = {
    "four_bar_600_damped": _four_bar(600, 0.02, 0.3, 1.25e-5),
    "four_bar_600_undamped": _four_bar(600, 0.0, 0.3, 1.5625e-6, 16),
    "four_bar_400_damped": _four_bar(400, 0.02, 0.45, 2.5e-5),
    "four_bar_300_damped": _four_bar(300, 0.02, 0.6, 2.5e-5),
    "four_bar_150_damped": _four_bar(150, 0.02, 1.2, 2.5e-5),
    "four_bar_60_damped": _four_bar(60, 0.02, 1.0, 2.5e-5),
    "spin_up": Case(spin_up, ("u1 [m]", "u2 [m]", "rotation [rad]"), 20.0, 0.05, 1.25e-3, 8),
    "flying_rod": Case(
        flying_rod, ("x0 [m]", "y0 [m]", "x1 [m]", "y1 [m]", "energy [J]", "spin [N m s]"), 0.5, 1e-3, 2.5e-5
    ),
    "snap_through": Case(snap_through, ("y [m]",), 0.06, 1e-4, 2.5e-6, 4),
    "dead_point": Case(dead_point, ("crank [rad]", "xB [m]", "yB [m]", "slider [m]"), 0.5, 1e-3, 2.5e-5, 8),
    "whip": Case(whip, TIP, 1.0, 2e-3, 5e-5),
    "sudden_stop": Case(sudden_stop, TIP, 0.3, 1e-3, 1e-5, 8),
}
