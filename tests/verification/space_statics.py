"""Beams in space under dead loads, bent far: elements of `links.beams.metric` against closed forms and exact rods.

`Rod` solves their balance by Newton, tangents by differences; `exact_rod` the differential equations of a Cosserat rod
by collocation, which shares nothing with the elements.
"""

from collections.abc import Sequence

import numpy as np
from scipy.integrate import solve_bvp
from scipy.linalg import eigvalsh

from kedfem.links.beams.beam_axis import Axis, smooth_axis, straight_axis
from kedfem.links.beams.metric import beam_element, pulled_back, strains_of
from kedfem.links.beams.section import Section, rectangle
from kedfem.links.beams.spatial_beam import functions, rigidities
from kedfem.links.record import BeamElement
from kedfem.scene import Material

from .cases import Row, case
from .spatial_beams import ALLOY, FLAT, bent_cantilever

STEP = 1e-6  # of differences, of the length and of directions


class Rod:
    """A beam clamped at its first node, its elements sharing their nodes."""

    def __init__(self, axis: Axis, section: Section, material: Material) -> None:
        self.X, self.one, _ = functions(axis)
        first = np.append(np.flatnonzero(self.one), len(self.one))
        self.tip = int(first[-2])
        x, rigidity = (axis.frame[:, [0, 2, 3]], rigidities(section, material.youngs_modulus, material.shear_modulus))
        self.elements: list[tuple[np.ndarray, BeamElement]] = []
        for cell in axis.cells:
            stations = np.sort(cell)
            of = np.concatenate([np.arange(first[k], first[k + 1]) for k in axis.node[stations]])
            made = beam_element(x[cell], self.X[of], self.one[of], np.searchsorted(stations, cell), rigidity)
            self.elements.append((of, made))
        self.length = float(np.ptp(self.X[self.one != 0], axis=0).max())
        self.free = np.arange(12, self.X.size)

    def force(self, y: np.ndarray) -> np.ndarray:
        """Internal forces (n, 3)."""
        f = np.zeros_like(y)
        for of, element in self.elements:
            f[of] += pulled_back(element, y[of], element.stiffness * strains_of(element, y[of]))
        return f

    def tangent(self, y: np.ndarray) -> np.ndarray:
        """Tangent stiffness of the free unknowns."""
        K = np.zeros((y.size, y.size))
        for of, element in self.elements:
            size = np.where(self.one[of] != 0, self.length, 1.0).repeat(3) * STEP
            ways = np.diag(size).reshape(-1, len(of), 3)
            pushed = [
                pulled_back(element, z, element.stiffness * strains_of(element, z)) for z in (y[of] + ways, y[of] - ways)
            ]
            own = ((pushed[0] - pushed[1]).reshape(len(size), -1) / (2 * size[:, None])).T
            dofs = (3 * of[:, None] + np.arange(3)).ravel()
            K[np.ix_(dofs, dofs)] += (own + own.T) / 2
        return K[np.ix_(self.free, self.free)]

    def stiffness(self) -> np.ndarray:
        """K0 of all unknowns, for small displacements."""
        K = np.zeros((self.X.size, self.X.size))
        for of, element in self.elements:
            dofs = (3 * of[:, None] + np.arange(3)).ravel()
            K[np.ix_(dofs, dofs)] += (element.rows.T * element.stiffness) @ element.rows
        return K

    def scaled(self, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A matrix with a unit diagonal, and what scales it: values and directions differ by lengths squared."""
        scale = 1 / np.sqrt(np.abs(np.diag(K)))
        return scale[:, None] * K * scale, scale

    def loaded(self, force: np.ndarray, shares: int) -> np.ndarray:
        """Positions (n, 3) under a dead force at the tip, put on in equal shares; raises if one takes 20 iterations."""
        y, wanted = self.X.copy(), np.zeros_like(self.X)
        for k in range(1, shares + 1):
            wanted[self.tip] = force * k / shares
            for _ in range(20):
                K, scale = self.scaled(self.tangent(y))
                residual = (wanted - self.force(y)).ravel()[self.free]
                change = np.zeros(y.size)
                change[self.free] = scale * np.linalg.solve(K, scale * residual)
                y = y + change.reshape(y.shape)
                if np.abs(change.reshape(y.shape)[self.one != 0]).max() < 1e-8 * self.length:
                    break
            else:
                raise AssertionError(f"share {k} of {shares} does not converge")
        return y


def exact_rod(
    r0: np.ndarray, frame: np.ndarray, bend: np.ndarray, length: float, rigidity: np.ndarray, force: np.ndarray
) -> np.ndarray:
    """Tip of a clamped Cosserat rod under a dead force there, put on in ten shares.

    r' = Q (1 + N/EA, V1/GA1, V2/GA2), Q' = Q [k + k0]×, M' = −r' × F; Q as columns t, n1, n2, all of them unknown.

    Parameters
    ----------
    frame, bend : Q (3, 3) at the clamp, and its rate k0 (3,) in the reference position, own components
    rigidity : EA, κ1 GA, κ2 GA, E I_y, E I_z, GJ of `rigidities`
    """
    EA, GA1, GA2, EI1, EI2, GJ = rigidity
    s = np.linspace(0, length, 41)

    def rates(P: np.ndarray) -> np.ndarray:
        def right(_: np.ndarray, x: np.ndarray) -> np.ndarray:
            Q, M = x[3:12].reshape(3, 3, -1), x[12:]
            n, m = np.einsum("ijp,i->jp", Q, P), np.einsum("ijp,ip->jp", Q, M)
            r1 = np.einsum("ijp,jp->ip", Q, n / np.array([EA, GA1, GA2])[:, None] + np.array([[1.0], [0], [0]]))
            # n1 bends by κ1 = −θ'·n2, n2 by κ2 = θ'·n1
            k = m / np.array([GJ, EI2, EI1])[:, None] + bend[:, None]
            Q1 = np.stack([k[2] * Q[:, 1] - k[1] * Q[:, 2], k[0] * Q[:, 2] - k[2] * Q[:, 0],
                           k[1] * Q[:, 0] - k[0] * Q[:, 1]], axis=1)  # fmt: skip
            return np.concatenate([r1, Q1.reshape(9, -1), -np.cross(r1, P, axis=0)])

        return right

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.concatenate([a[:3] - r0, a[3:12] - frame.ravel(), b[12:]])

    x = np.zeros((15, len(s)))
    x[:3], x[3:12] = r0[:, None], frame.ravel()[:, None]
    for share in np.arange(0, 11) / 10:
        found = solve_bvp(rates(share * force), ends, s, x, tol=1e-8, max_nodes=20_000)
        if not found.success:
            raise AssertionError(found.message)
        s, x = found.x, found.y
    return np.asarray(x[:3, -1])


def error(rod: Rod, y: np.ndarray, tip: np.ndarray) -> float:
    """Distance of a tip from where it should be, of how far it has moved."""
    return float(np.linalg.norm(y[rod.tip] - tip) / np.linalg.norm(tip - rod.X[rod.tip]))


# -- a cantilever of Princeton's kind ------------------------------------------------------------------------

STRIP = rectangle(0.0123, 0.0032)
METAL = Material(density=2700, youngs_modulus=71.7e9, poisson_ratio=0.31)
PRINCETON = 0.508


def slanted(elements: int, load: float, angle: float) -> tuple[Rod, np.ndarray]:
    """The strip along x, its wide side upright, and its shape under a tip load that leans from the upright."""
    axis = straight_axis(np.array([[0.0, 0, 0], [PRINCETON, 0, 0]]), elements, 3, np.array([0.0, 1, 0]))
    rod = Rod(axis, STRIP, METAL)
    return rod, rod.loaded(leaning(load, angle), 4)


def leaning(load: float, angle: float) -> np.ndarray:
    return load * np.array([0.0, np.sin(angle), -np.cos(angle)])


def exact_slanted(load: float, angle: float) -> np.ndarray:
    frame = straight_axis(np.array([[0.0, 0, 0], [1, 0, 0]]), 1, 3, np.array([0.0, 1, 0])).frame[0, 1:].T
    return exact_rod(
        np.zeros(3),
        frame,
        np.zeros(3),
        PRINCETON,
        rigidities(STRIP, METAL.youngs_modulus, METAL.shear_modulus),
        leaning(load, angle),
    )


@case("Cantilever strip under an oblique tip load", "Cosserat rod by collocation (tests/verification/space_statics.py)")
def princeton() -> list[Row]:
    """After the Princeton experiment (Dowell and Traybar 1975), 508 × 12.3 × 3.2 mm: bending about both axes and
    torsion."""
    out = []
    for angle in (30, 60):
        rod, y = slanted(4, 13.345, np.radians(angle))
        tip = exact_slanted(13.345, np.radians(angle))
        out += [
            Row(f"tip {name}, 13.345 N leaning by {angle}° [m]", float(w), float(g), 1e-3, "4 beam3")
            for name, w, g in zip("xyz", tip, y[rod.tip], strict=True)
        ]
    return out


# -- 45° bend ------------------------------------------------------------------------------------------------

SOFT = Material(density=1.0, youngs_modulus=1e7, poisson_ratio=0.0)


@case("45° bend under 600 lb", "Bathe, Bolourchi (1979); Sonneville, Cardona, Brüls: CMAME 268 (2014)")
def forty_five() -> list[Row]:
    """An arc of radius 100 in, section 1 × 1 in, E 1e7 psi, ν 0, a dead load out of its plane, in ten equal
    increments."""
    angle = np.linspace(0, np.pi / 4, 9)
    points = 100 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    rod = Rod(smooth_axis(points, 1, 3, np.array([0.0, 0, 1])), rectangle(1.0, 1.0), SOFT)
    tip = rod.loaded(np.array([0.0, 0, 600]), 10)[rod.tip]
    return [
        Row(f"tip {name} [in]", wanted, float(got), 5e-4, "8 beam3")
        for name, wanted, got in zip(("y", "x", "z"), (15.56, 46.89, 53.61), tip[[1, 0, 2]], strict=True)
    ]


# -- lateral buckling ----------------------------------------------------------------------------------------

THIN = rectangle(0.03, 0.001)  # 30 mm high: bending in its plane is 900 times stiffer than out of it


def critical_load(elements: int) -> float:
    """Tip load in its plane at which a clamped strip of 1 m first has no stiffness out of it [N], by bisection."""
    axis = straight_axis(np.array([[0.0, 0, 0], [1, 0, 0]]), elements, 3, np.array([0.0, 1, 0]))
    rod, high = Rod(axis, THIN, METAL), 2 * lateral(1.0)
    low = 0.0
    for _ in range(12):
        load = (low + high) / 2
        y = rod.loaded(np.array([0.0, 0, -load]), 2)
        steady = eigvalsh(rod.scaled(rod.tangent(y))[0], subset_by_index=[0, 0])[0] > 0
        low, high = (load, high) if steady else (low, load)
    return (low + high) / 2


def lateral(length: float) -> float:
    """4.0126 √(EI GJ)/L², Timoshenko and Gere, Theory of Elastic Stability, §6.3."""
    rigidity = rigidities(THIN, METAL.youngs_modulus, METAL.shear_modulus)
    return float(4.0126 * np.sqrt(rigidity[3:5].min() * rigidity[5]) / length**2)


@case("Lateral buckling of a cantilever strip", "4.0126 √(EI GJ)/L², Timoshenko and Gere (1961), §6.3")
def buckling() -> list[Row]:
    """1 m × 30 mm × 1 mm; deflection in its plane, which the formula neglects, adds some 1 − EI/EI' = 0.1 %."""
    return [Row("critical load [N]", lateral(1.0), critical_load(4), 0.01, "4 beam3")]


# -- ends and corners -------------------------------------------------------------------------------------------------


def hinge_error(elements: int) -> float:
    """How much further the tip goes under a load along z if a hinge about z, not a clamp, holds the root's moment."""
    axis = straight_axis(np.array([[0.0, 0, 0], [0.5, 0, 0]]), elements, 3, None)
    rod = Rod(axis, FLAT, ALLOY)
    along_x, along_z = (1 + int(np.abs(rod.X[1:4, k]).argmax()) for k in (0, 2))
    pinned = np.array([0, 1, 2, *(3 * along_z + np.arange(3)), 3 * along_x + 1])  # two points on z, no turn about it
    K, place = rod.stiffness(), 3 * rod.tip + 2
    moved = []
    for held in (pinned, np.arange(12)):
        free = np.setdiff1d(np.arange(len(K)), held)
        A, scale = rod.scaled(K[np.ix_(free, free)])
        load = (free == place) * scale
        moved.append(float(load @ np.linalg.solve(A, load)))
    return moved[0] / moved[1] - 1


def corner_errors(elements: int) -> Sequence[float]:
    """Tip compliances of an L with so many elements a leg, less Castigliano's, of these."""
    axis = straight_axis(np.array([[0.0, 0, 0], [0.5, 0, 0], [0.5, 0.3, 0]]), elements, 3, None)
    rod = Rod(axis, FLAT, ALLOY)
    K = rod.stiffness()
    A, scale = rod.scaled(K[np.ix_(rod.free, rod.free)])
    place = 3 * rod.tip + np.arange(3) - 12
    found = scale[:, None] * np.linalg.solve(A, np.diag(scale)[:, place])
    exact = bent_cantilever(0.5, 0.3, FLAT)
    return [float(found[place[k], k] / exact["xyz"[k]] - 1) for k in range(3)]


@case("Bent cantilever, elements of any frame", "Castigliano's theorem with shear and extension")
def corners() -> list[Row]:
    """The L of 0.5 m and 0.3 m: its corner does not soften, however fine the mesh."""
    return [
        Row(f"compliance along {name}: error, {n} a leg", 0.0, e, 1e-7, f"{n} beam3 a leg")
        for n in (1, 64)
        for name, e in zip("xyz", corner_errors(n), strict=True)
    ]
