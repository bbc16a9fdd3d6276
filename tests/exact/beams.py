"""Geometrically exact planar beams (Reissner 1972; Simo and Vu-Quoc 1986) joined at their ends.

Unknowns per node are the position (x, y) in the world and the rotation θ of the section since the reference
state, in which beams are straight and ψ = ψ0 + θ is the direction of the axis. With ' = d/ds along the reference

    ε = cos ψ x' + sin ψ y' − 1,   γ = −sin ψ x' + cos ψ y',   κ = θ'

    W = ½ ∫ (EA ε² + GA γ² + EI κ²) ds,   T = ½ ∫ (ρA (ẋ² + ẏ²) + ρI θ̇²) ds

Lagrange elements of any order, integrated by one Gauss point less than nodes; consistent mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp


@dataclass(frozen=True, slots=True)
class Rod:
    """A beam, straight in the reference state.

    start, end : positions [m]
    EA, GA, EI : rigidities, GA with the shear coefficient [N, N, N m²]
    rhoA, rhoI : mass and rotary inertia per length [kg/m, kg m]
    elements, nodes : elements, and nodes of each
    """

    start: tuple[float, float]
    end: tuple[float, float]
    EA: float
    GA: float
    EI: float
    rhoA: float
    rhoI: float
    elements: int = 8
    nodes: int = 3

    @property
    def length(self) -> float:
        """Length in the reference state [m]."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))


End = tuple[int, int]  # number of a rod; 0 start, 1 end


@dataclass(frozen=True, slots=True)
class Lump:
    """A body at a rod's end: mass [kg], and inertia about that point [kg m²], its centre there."""

    at: End
    mass: float = 0.0
    inertia: float = 0.0


@dataclass(frozen=True, slots=True)
class Beams:
    """Rods with their joints. N unknowns, E elements of k dofs, G Gauss points each.

    rods : as given
    dof : per rod (n, 3) unknowns of its nodes in order
    q0 : (N,) reference state
    edof : (E, k); rod : (E,) the rod of each element
    P : (E, G, 4, k) from an element's unknowns to (x', y', θ, θ'); w : (E, G) weights with det J [m]
    psi0 : (E, 1) direction in the reference state [rad]; D : (E, 1, 3) EA, GA, EI
    Me : (E, k, k) element masses; lumps : (N,) of the bodies, lump_rod : (N,) their rods
    M : (N, N) sparse
    """

    rods: tuple[Rod, ...]
    dof: tuple[np.ndarray, ...]
    q0: np.ndarray
    edof: np.ndarray
    rod: np.ndarray
    P: np.ndarray
    w: np.ndarray
    psi0: np.ndarray
    D: np.ndarray
    Me: np.ndarray
    lumps: np.ndarray
    lump_rod: np.ndarray
    M: sp.csr_array

    def end(self, rod: int, which: int) -> np.ndarray:
        """The three unknowns of a rod's start (0) or end (1)."""
        return np.asarray(self.dof[rod][-1 if which else 0])

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.q0)


def lagrange(points: np.ndarray, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (len(r), m) of the polynomials that are one at one point and zero at the others."""
    V = np.vander(points, increasing=True)
    powers = np.vander(r, len(points), increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = powers[:, :-1] * np.arange(1, len(points))
    inverse = np.linalg.inv(V)
    return powers @ inverse, slopes @ inverse


def element(rod: Rod) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """P (G, 4, k), w (G,) and mass (k, k) of an element of a rod; its unknowns run node by node."""
    m, J = rod.nodes, rod.length / rod.elements / 2
    at = np.linspace(-1.0, 1.0, m)
    r, w = np.polynomial.legendre.leggauss(m - 1)
    N, dN = lagrange(at, r)
    P = np.zeros((m - 1, 4, m, 3))
    P[:, 0, :, 0] = P[:, 1, :, 1] = P[:, 3, :, 2] = dN / J
    P[:, 2, :, 2] = N
    rm, wm = np.polynomial.legendre.leggauss(m)
    Nm = lagrange(at, rm)[0]
    gram = J * (Nm.T * wm) @ Nm
    mass = np.kron(gram, np.diag([rod.rhoA, rod.rhoA, rod.rhoI]))
    return P.reshape(m - 1, 4, 3 * m), J * w, mass


def joined(
    rods: Sequence[Rod], pins: Sequence[Sequence[End]] = (), welds: Sequence[Sequence[End]] = (),
    lumps: Sequence[Lump] = (),
) -> Beams:  # fmt: skip
    """Rods of the same order with ends that share their position (pins), or position and rotation (welds)."""
    counts = [rod.elements * (rod.nodes - 1) + 1 for rod in rods]
    dof = np.split(np.arange(3 * sum(counts)).reshape(-1, 3), np.cumsum(counts)[:-1])
    for groups, shared in ((pins, 2), (welds, 3)):
        for first, *others in groups:
            for rod, which in others:
                dof[rod][-which, :shared] = dof[first[0]][-first[1], :shared]
    used, renumbered = np.unique(np.concatenate(dof), return_inverse=True)
    dof = np.split(renumbered.reshape(-1, 3), np.cumsum(counts)[:-1])
    q0 = np.zeros(len(used))
    parts: dict[str, list[np.ndarray]] = {name: [] for name in ("edof", "rod", "P", "w", "psi0", "D", "Me")}
    for k, (rod, nodes) in enumerate(zip(rods, dof, strict=True)):
        s = np.linspace(0, 1, len(nodes))[:, None]
        q0[nodes[:, :2]] = (1 - s) * np.array(rod.start) + s * np.array(rod.end)
        first = (rod.nodes - 1) * np.arange(rod.elements)[:, None]
        P, w, mass = element(rod)
        e = rod.elements
        parts["edof"].append(nodes[first + np.arange(rod.nodes)].reshape(e, -1))
        parts["rod"].append(np.full(e, k))
        for name, value in (("P", P), ("w", w), ("Me", mass)):
            parts[name].append(np.repeat(value[None], e, axis=0))
        direction = np.arctan2(rod.end[1] - rod.start[1], rod.end[0] - rod.start[0])
        parts["psi0"].append(np.full((e, 1), direction))
        parts["D"].append(np.tile([[rod.EA, rod.GA, rod.EI]], (e, 1, 1)))
    whole = {name: np.concatenate(values) for name, values in parts.items()}
    lumped, lump_rod = np.zeros(len(q0)), np.zeros(len(q0), int)
    for lump in lumps:
        at = dof[lump.at[0]][-lump.at[1]]
        lumped[at] += [lump.mass, lump.mass, lump.inertia]
        lump_rod[at] = lump.at[0]
    M = assembled(whole["Me"], whole["edof"], len(q0)) + sp.diags_array(lumped)
    return Beams(tuple(rods), tuple(dof), q0, **whole, lumps=lumped, lump_rod=lump_rod, M=sp.csr_array(M))


def assembled(blocks: np.ndarray, edof: np.ndarray, size: int) -> sp.csr_array:
    """The sum of element matrices (E, k, k)."""
    k = edof.shape[1]
    rows, columns = np.repeat(edof, k, axis=1).ravel(), np.tile(edof, (1, k)).ravel()
    return sp.csr_array(sp.coo_array((blocks.ravel(), (rows, columns)), shape=(size, size)))


@dataclass(frozen=True, slots=True)
class Strains:
    """Strains and their derivatives at all Gauss points.

    e : (E, G, 3) ε, γ, κ; B : (E, G, 3, 4) their derivatives by (x', y', θ, θ'); c, s : (E, G) cos ψ, sin ψ
    """

    e: np.ndarray
    B: np.ndarray
    c: np.ndarray
    s: np.ndarray


def strains(beams: Beams, q: np.ndarray) -> Strains:
    """Strains in a state q (N,)."""
    p = (beams.P @ q[beams.edof][:, None, :, None])[..., 0]
    psi = beams.psi0 + p[..., 2]
    c, s = np.cos(psi), np.sin(psi)
    stretch, gamma = c * p[..., 0] + s * p[..., 1], -s * p[..., 0] + c * p[..., 1]
    B = np.zeros((*c.shape, 3, 4))
    B[..., 0, 0], B[..., 0, 1], B[..., 0, 2] = c, s, gamma
    B[..., 1, 0], B[..., 1, 1], B[..., 1, 2] = -s, c, -stretch
    B[..., 2, 3] = 1.0
    return Strains(np.stack([stretch - 1, gamma, p[..., 3]], axis=-1), B, c, s)


def second_derivatives(at: Strains, N: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """N ∂²ε + Q ∂²γ by (x', y', θ, θ'), (E, G, 4, 4)."""
    H = np.zeros((*N.shape, 4, 4))
    H[..., 0, 2] = H[..., 2, 0] = -N * at.s - Q * at.c
    H[..., 1, 2] = H[..., 2, 1] = N * at.c - Q * at.s
    H[..., 2, 2] = -N * (1 + at.e[..., 0]) - Q * at.e[..., 1]
    return H


def internal_force(
    beams: Beams, q: np.ndarray, v: np.ndarray | None = None, beta: float = 0.0, rate: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """∂W/∂q with stress resultants D (e + β ė), and its derivative by q when dv = rate · dq.

    Parameters
    ----------
    q, v : (N,) state and its rate; no damping without a rate
    beta : viscosity [s]
    rate : [1/s]

    Returns
    -------
    force (N,) and element tangents (E, k, k)
    """
    at = strains(beams, q)
    BD = at.B * beams.D[..., None]  # (E, G, 3, 4)
    stress = beams.D * at.e
    moved = at.B  # derivative of e + β ė by the point's values
    if v is not None and beta:
        pv = beams.P @ v[beams.edof][:, None, :, None]
        stress = stress + beta * (BD @ pv)[..., 0].reshape(stress.shape)
        moved = (1 + beta * rate) * at.B
        one, zero = np.ones(at.c.shape), np.zeros(at.c.shape)
        moved[..., 0, :] += beta * (second_derivatives(at, one, zero) @ pv)[..., 0]
        moved[..., 1, :] += beta * (second_derivatives(at, zero, one) @ pv)[..., 0]
    stress = stress * beams.w[..., None]
    point = np.swapaxes(BD * beams.w[..., None, None], -1, -2) @ moved
    point += second_derivatives(at, stress[..., 0], stress[..., 1])
    E, G, _, k = beams.P.shape
    P = beams.P.reshape(E, 4 * G, k)
    PT = np.swapaxes(P, 1, 2)
    forces = PT @ (np.swapaxes(at.B, -1, -2) @ stress[..., None]).reshape(E, 4 * G, 1)
    tangent = PT @ (point @ beams.P).reshape(E, 4 * G, k)
    return np.bincount(beams.edof.ravel(), forces.ravel(), beams.size), tangent


def strain_energy(beams: Beams, q: np.ndarray) -> float:
    """W [J]."""
    return float(0.5 * np.sum(beams.w[..., None] * beams.D * strains(beams, q).e ** 2))


def kinetic_energy(beams: Beams, v: np.ndarray) -> float:
    """T [J]."""
    return float(0.5 * v @ (beams.M @ v))


def component(beams: Beams, axis: int) -> np.ndarray:
    """(N,) one where an unknown is x (0), y (1) or θ (2)."""
    out = np.zeros(beams.size)
    out[np.concatenate(beams.dof)[:, axis]] = 1.0
    return out


def weight(beams: Beams, gravity: tuple[float, float]) -> np.ndarray:
    """Nodal forces (N,) of an acceleration (gx, gy) [m/s²]."""
    return np.asarray(beams.M @ (gravity[0] * component(beams, 0) + gravity[1] * component(beams, 1)))


def momenta(beams: Beams, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Linear momentum x, y [N s] and angular momentum about the origin [N m s] of beams without pins, (3,)."""
    turned = np.zeros(beams.size)  # rate of a rigid rotation about the origin
    for dof in beams.dof:
        turned[dof[:, 0]], turned[dof[:, 1]], turned[dof[:, 2]] = -q[dof[:, 1]], q[dof[:, 0]], 1.0
    p = beams.M @ v
    return np.array([component(beams, 0) @ p, component(beams, 1) @ p, turned @ p])


@dataclass(frozen=True, slots=True)
class Station:
    """A place on a rod's axis where strains are read: a cubic through the four nearest Gauss points.

    elements, points : (4,) Gauss points; weights : (4,)
    """

    elements: np.ndarray
    points: np.ndarray
    weights: np.ndarray = field(default_factory=lambda: np.ones(1))

    def strains(self, at: Strains) -> np.ndarray:
        """ε, γ, κ (3,) there."""
        return np.asarray(self.weights @ at.e[self.elements, self.points])


def station(beams: Beams, rod: int, fraction: float, through: int = 4) -> Station:
    """The station at a fraction of a rod's length; `through` Gauss points, as far as the rod has so many."""
    this = beams.rods[rod]
    r = np.polynomial.legendre.leggauss(this.nodes - 1)[0]
    own = np.flatnonzero(beams.rod == rod)
    s = (2 * np.arange(this.elements)[:, None] + 1 + r) / (2 * this.elements)
    nearest = np.sort(np.argsort(np.abs(s.ravel() - fraction), kind="stable")[:through])
    at = (s.ravel()[nearest] - fraction) * this.elements
    weights = lagrange(at, np.zeros(1))[0][0]
    e, g = np.divmod(nearest, len(r))
    return Station(own[e], g, weights)
