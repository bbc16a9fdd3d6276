"""References for large deflection: published and analytic numbers, and histories of exact beams.

`history(name)` reads a history that ``python -m tests.exact`` computed with geometrically exact beams (Reissner
1972; Simo and Vu-Quoc 1986), converged in step and mesh; the data of each are in `tests.exact.cases`, its errors in
the head of its file. All SI.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipk

DATA = Path(__file__).parent / "data"

# Cantilever with a dead tip load, inextensible and without shear: P L²/EI → w/L, shortening u/L.
# Mattiasson, Int. J. Num. Meth. Eng. 17 (1981), elliptic integrals.
ELASTICA = {1.0: (0.301721, 0.056433), 2.0: (0.493457, 0.160642), 5.0: (0.713792, 0.387628), 10.0: (0.810609, 0.554996)}

# Rotating cantilever clamped on the axis, first frequencies over √(EI/ρAL⁴) for μ = Ω/√(EI/ρAL⁴), L √(A/I) = 70:
# chordwise, flapwise. Hamza-Cherif and Houmat, ICAS 2004, table 2. With Coriolis forces, without shear, without the
# elongation L → L (1 + μ²/(3 · 70²)), which counts in the chordwise ones: exact Euler–Bernoulli beams are lower by
# 0.02, 0.09, 0.18, 0.29, 0.43 % up to μ = 10, and by 10 % at μ = 50. Square sections of ν = 0.3 with shear and
# rotary inertia are lower by 0.24, 0.37, 0.61, 0.95, 1.4 %.
ROTATING_CANTILEVER = {
    2.0: (3.6195, 4.1373),
    4.0: (3.888, 5.5850),
    6.0: (4.2393, 7.3603),
    8.0: (4.6105, 9.2568),
    10.0: (4.97, 11.2023),
    50.0: (7.3362, 51.0805),
}


def chordwise(flapwise: float, mu: float) -> float:
    """Chordwise frequency of a slender beam (L √(A/I) → ∞), where Coriolis forces vanish: √(flapwise² − μ²)."""
    return float(np.sqrt(flapwise**2 - mu**2))


def steady_stretch(length: float, speed: float, EA: float, rhoA: float) -> float:
    """Stretch of a bar's tip that turns about its other end, u = sin(αx)/(α cos αL) − x, α = ω √(ρA/EA) [m]."""
    alpha = speed * np.sqrt(rhoA / EA)
    return float(np.tan(alpha * length) / alpha - length)


def pendulum_period(mass: float, arm: float, inertia: float, amplitude: float, gravity: float = 9.81) -> float:
    """Period of a compound pendulum, 4 √(I/mgd) K(sin(θ0/2)) [s].

    Parameters
    ----------
    arm : from the pivot to the centre of mass [m]
    inertia : about the pivot [kg m²]
    amplitude : from the vertical [rad]
    """
    return float(4 * np.sqrt(inertia / (mass * gravity * arm)) * ellipk(np.sin(amplitude / 2) ** 2))


@dataclass(frozen=True, slots=True)
class UniformRod:
    """A rigid rod: mass [kg] and length [m], its inertia that of a line m L²/12 plus `section` [kg m²]."""

    mass: float
    length: float
    section: float = 0.0


def double_pendulum(
    rods: tuple[UniformRod, UniformRod], angles: tuple[float, float], t: np.ndarray, gravity: float = 9.81
) -> np.ndarray:
    """Angles of two rods from the vertical below, let go at rest; (T, 4) with their rates, to about 1e-11 [rad, rad/s].

    Lagrange's equations, Dormand and Prince of order 8 at a tolerance of 1e-13.
    """
    first, second = rods
    m1, l1, m2, l2 = first.mass, first.length, second.mass, second.length
    I1, I2 = m1 * l1**2 / 3 + first.section + m2 * l1**2, m2 * l2**2 / 3 + second.section
    c = m2 * l1 * l2 / 2

    def rate(_: float, y: np.ndarray) -> list[float]:
        a, b, da, db = y
        cos, sin = np.cos(a - b), np.sin(a - b)
        f = -c * sin * db**2 - (m1 / 2 + m2) * gravity * l1 * np.sin(a)
        g = c * sin * da**2 - m2 * gravity * l2 / 2 * np.sin(b)
        det = I1 * I2 - (c * cos) ** 2
        return [da, db, (I2 * f - c * cos * g) / det, (I1 * g - c * cos * f) / det]

    found = solve_ivp(rate, (0.0, t[-1]), [*angles, 0.0, 0.0], "DOP853", t, rtol=1e-13, atol=1e-13)
    return np.asarray(found.y.T)


def double_pendulum_energy(rods: tuple[UniformRod, UniformRod], state: np.ndarray, gravity: float = 9.81) -> np.ndarray:
    """Kinetic and potential energy (T,) of states (T, 4), zero at the pivot's height [J]."""
    first, second = rods
    m1, l1, m2, l2 = first.mass, first.length, second.mass, second.length
    a, b, da, db = state.T
    kinetic = (m1 * l1**2 / 3 + first.section + m2 * l1**2) * da**2 / 2
    kinetic += (m2 * l2**2 / 3 + second.section) * db**2 / 2 + m2 * l1 * l2 / 2 * np.cos(a - b) * da * db
    potential = -gravity * ((m1 / 2 + m2) * l1 * np.cos(a) + m2 * l2 / 2 * np.cos(b))
    return np.asarray(kinetic + potential)


@dataclass(frozen=True, slots=True)
class History:
    """A kept history.

    t : (T,) [s]; values : (T, c); columns : their names and units
    step_error, mesh_error : (c,) largest errors by step and by mesh, of the column's largest value
    """

    t: np.ndarray
    values: np.ndarray
    columns: tuple[str, ...]
    step_error: np.ndarray
    mesh_error: np.ndarray

    def difference(self, t: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Largest differences (c,) of another history from this, of its largest values.

        The other must have points at this one's times, which it may go beyond or stop short of.
        """
        both = self.t <= t[-1] * (1 + 1e-9)
        k = np.searchsorted(t, self.t[both] * (1 - 1e-9))
        gap = np.abs(t[k] - self.t[both]).max()
        if gap > 1e-6 * (self.t[1] - self.t[0]):
            raise ValueError(f"a time of the reference is {gap:.3g} s away from the other's next")
        return np.asarray(np.abs(values[k] - self.values[both]).max(axis=0) / np.abs(self.values).max(axis=0))


def history(name: str) -> History:
    """A history of tests/verification/data: of four_bar_600_damped and so on, see `tests.exact.cases.CASES`."""
    lines = (DATA / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    columns = tuple(lines[len(comments)].split(","))[1:]
    rows = np.loadtxt(lines[len(comments) + 1 :], delimiter=",")

    def numbers(label: str) -> np.ndarray:
        return np.array([float(x) for c in comments if label in c for x in c.split(":")[1].split(",")])

    return History(rows[:, 0], rows[:, 1:], columns, numbers("by the step"), numbers("by the mesh"))


def largest_difference(name: str, t: np.ndarray, values: np.ndarray) -> float:
    """The largest of `History.difference` of a kept history, of its only or all columns."""
    return float(history(name).difference(t, values.reshape(len(t), -1)).max())
