"""The four-bar of Nath and Ghosh (1980), the general equation's worked example, started as rigid links move."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .beams import Lump, Rod, Strains, joined, station, strains
from .solve import Problem, RigidMotions, State, Stepping, motion, start

CRANK, COUPLER, ROCKER, FRAME = 0.3048, 0.9144, 0.762, 0.9144  # m
RHO, E, G, SIDE = 2796.0, 7.031e10, 2.712e10, 0.0254  # kg/m³, Pa, Pa, m
FLYWHEEL = 8.065e-2  # kg m² on the rocker's shaft
LENGTHS = (CRANK, COUPLER, ROCKER)


@dataclass(frozen=True, slots=True)
class Pose:
    """The rigid linkage at one time.

    points : (4, 2) A, B, C, D; angle, omega : (3,) of crank, coupler (B to C) and rocker (C to D)
    """

    points: np.ndarray
    angle: np.ndarray
    omega: np.ndarray


def pose(phi: float, speed: float) -> Pose:
    """Crank at an angle [rad] with a speed [rad/s]; C to the left of B → D."""
    A, D = np.zeros(2), np.array([FRAME, 0.0])
    B = CRANK * np.array([np.cos(phi), np.sin(phi)])
    span = np.linalg.norm(D - B)
    x = (COUPLER**2 - ROCKER**2 + span**2) / (2 * span)
    e = (D - B) / span
    C = B + x * e + np.sqrt(COUPLER**2 - x**2) * np.array([-e[1], e[0]])
    sides = np.diff([A, B, C, D], axis=0)
    normal = np.stack([-sides[:, 1], sides[:, 0]], axis=1)
    omega = np.linalg.solve(normal[1:].T, -speed * normal[0])  # Σ ω × side = 0
    angle = np.arctan2(sides[:, 1], sides[:, 0])
    return Pose(np.array([A, B, C, D]), angle, np.array([speed, *omega]))


def rigid(at: Pose) -> RigidMotions:
    """Its links as motions of the plane."""
    B, D = at.points[1], at.points[3]
    crank, coupler, rocker = at.omega
    v_B = crank * np.array([-B[1], B[0]])
    through_B = v_B - coupler * np.array([-B[1], B[0]])
    return RigidMotions(np.array([[0, 0], through_B, -rocker * np.array([-D[1], D[0]])]), at.omega)


def rayleigh(ratio: float, low: float = 20.0, high: float = 200.0) -> tuple[float, float]:
    """α [1/s], β [s] of one damping ratio at two frequencies [Hz]: α + β ω² = 2 ratio ω."""
    a, b = 2 * np.pi * low, 2 * np.pi * high
    return 2 * ratio * a * b / (a + b), 2 * ratio / (a + b)


def four_bar(rpm: float, ratio: float, elements: int, nodes: int = 3, slender: float = 1.0) -> tuple[Problem, State]:
    """The problem and its state at t = 0: undeformed, with the rates of the rigid linkage.

    Parameters
    ----------
    rpm : speed of the crank
    ratio : damping ratio at 20 and 200 Hz
    elements, nodes : per link, per element
    slender : shear stiffness multiplied and rotary inertia divided by it
    """
    speed = rpm * 2 * np.pi / 60
    first = pose(0.0, speed)
    A, I = SIDE**2, SIDE**4 / 12  # noqa: E741
    shear, rotary = 5 / 6 * G * A * slender, RHO * I / slender
    rods = [
        Rod(tuple(a), tuple(b), E * A, shear, E * I, RHO * A, rotary, elements, nodes)
        for a, b in zip(first.points[:-1], first.points[1:], strict=True)
    ]
    beams = joined(rods, pins=[[(0, 1), (1, 0)], [(1, 1), (2, 0)]], lumps=[Lump((2, 1), inertia=FLYWHEEL)])
    x, y, theta = beams.end(0, 0)
    at_D = beams.end(2, 1)[:2]
    held = {x: 0.0, y: 0.0, theta: lambda t: (speed * t, speed, 0.0), at_D[0]: FRAME, at_D[1]: 0.0}
    alpha, beta = rayleigh(ratio)
    problem = Problem(beams, held, None, alpha, beta, lambda t: rigid(pose(speed * t, speed)))
    motions, v = rigid(first), np.zeros(beams.size)
    for k, dof in enumerate(beams.dof):
        X, w = beams.q0[dof[:, :2]], motions.omega[k]
        v[dof[:, 0]], v[dof[:, 1]], v[dof[:, 2]] = (motions.v[k, 0] - w * X[:, 1], motions.v[k, 1] + w * X[:, 0], w)
    return problem, start(problem, beams.q0, v)


def outer_stress(problem: Problem) -> Callable[[State], np.ndarray]:
    """σ = E (ε − y κ) on the outer side (y = 12.7 mm, to the left of C → D) of the rocker's midpoint [Pa]."""
    at = station(problem.beams, 2, 0.5)

    def stress(state: State) -> np.ndarray:
        here: Strains = strains(problem.beams, state.q)
        axial, _, curvature = at.strains(here)
        return np.asarray(E * (axial - SIDE / 2 * curvature))

    return stress


def stress_history(
    rpm: float, ratio: float, stepping: Stepping, elements: int, nodes: int = 3
) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and the rocker's outer stress [Pa]."""
    problem, first = four_bar(rpm, ratio, elements, nodes)
    t, stress, _ = motion(problem, first, stepping, outer_stress(problem))
    return t, stress
