"""The undamped four-bar as a chain of point masses, bars and hinges with springs, in explicit time steps.

It shares nothing with the exact beams but the data: extension between masses, curvature from the turn between
neighbouring bars, no shear and no rotary inertia, central differences. Second order in the bars' lengths.
"""

from dataclasses import dataclass

import numpy as np

from .four_bar import FLYWHEEL, LENGTHS, RHO, SIDE, E, Pose, pose, rigid


@dataclass(frozen=True, slots=True)
class Chain:
    """Masses from A to D and bars between them.

    X : (n, 2) [m]; m : (n, 1) [kg]; length : (n − 1,) of the bars [m]
    first : (3,) number of the first bar of each link
    bent : (k,) masses with a spring between the bars that meet there: all inner ones but B and C
    """

    X: np.ndarray
    m: np.ndarray
    length: np.ndarray
    first: np.ndarray
    bent: np.ndarray


def chain(at: Pose, bars: tuple[int, int, int]) -> Chain:
    """Chain of a rigid linkage's pose with so many bars a link."""
    corners = np.concatenate([[0], np.cumsum(bars)])
    k = np.arange(corners[-1] + 1)
    X = np.stack([np.interp(k, corners, at.points[:, axis]) for axis in range(2)], axis=1)
    length = np.repeat(np.array(LENGTHS) / bars, bars)
    m = np.zeros((len(X), 1))
    m[:-1, 0] += RHO * SIDE**2 * length / 2
    m[1:, 0] += RHO * SIDE**2 * length / 2
    return Chain(X, m, length, corners[:-1], np.setdiff1d(k[1:-1], corners))


def turn(x: np.ndarray) -> np.ndarray:
    """An angle brought between −π and π."""
    return (x + np.pi) % (2 * np.pi) - np.pi


def chain_forces(this: Chain, x: np.ndarray, root: float, flywheel: float) -> tuple[np.ndarray, float, float]:
    """Forces (n, 2), torque on the flywheel, and stress on the outer side of the rocker's midpoint [Pa].

    Parameters
    ----------
    root, flywheel : directions that the crank has at A, the rocker at D; springs half a bar long hold the bars there
    """
    EA, EI = E * SIDE**2, E * SIDE**4 / 12
    d = np.diff(x, axis=0)
    now = np.hypot(d[:, 0], d[:, 1])
    t = d / now[:, None]
    angle = np.arctan2(d[:, 1], d[:, 0])
    tension = EA * (now / this.length - 1)
    bend = turn(angle[this.bent] - angle[this.bent - 1])
    moment = EI * bend / ((this.length[this.bent] + this.length[this.bent - 1]) / 2)
    at_A = 2 * EI / this.length[0] * turn(angle[0] - root)
    at_D = 2 * EI / this.length[-1] * turn(angle[-1] - flywheel)
    torque = np.zeros(len(d))
    torque[this.bent] -= moment
    torque[this.bent - 1] += moment
    torque[0] -= at_A
    torque[-1] -= at_D
    force = tension[:, None] * t + (torque / now)[:, None] * np.stack([t[:, 1], -t[:, 0]], axis=1)
    total = np.zeros_like(x)
    total[:-1] += force
    total[1:] -= force
    middle = (this.first[2] + len(this.X) - 1) // 2
    axial = (tension[middle] + tension[middle - 1]) / 2 / EA
    curvature = moment[this.bent == middle][0] / EI
    return total, at_D, float(E * (axial - SIDE / 2 * curvature))


def chain_history(rpm: float, bars: tuple[int, int, int], h: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """t [s] and the rocker's outer stress [Pa] of links that begin rigid; an even number of bars in the rocker."""
    speed = rpm * 2 * np.pi / 60
    at = pose(0.0, speed)
    this, motions = chain(at, bars), rigid(at)
    link = np.repeat([0, *range(3)], [1, *bars])
    omega = motions.omega[link][:, None]
    x, v = this.X.copy(), motions.v[link] + omega * np.stack([-this.X[:, 1], this.X[:, 0]], axis=1)
    angle, rate = at.angle[2], at.omega[2]
    free = np.ones((len(x), 1))
    free[[0, -1]] = 0.0
    v *= free
    stresses = []
    for step in range(steps + 1):
        F, torque, stress = chain_forces(this, x, speed * step * h, angle)
        stresses.append(stress)
        part = h / 2 if step == 0 else h  # speeds live between the steps
        v += part * free * F / this.m
        rate += part * torque / FLYWHEEL
        x += h * v
        angle += h * rate
    return h * np.arange(steps + 1), np.array(stresses)
