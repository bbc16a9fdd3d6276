"""Exact rates of coordinates of constraints, by series in time of the rigid-body motion and the interface.

A series is an array (3, …): a value and its first and second rates. For a coupling surface, A = Σ D_k ⊗ e_k = Q U:
with B = Q₀ᵀ A and Q = Q₀ exp [w t + b t²/2]×, the skew parts of exp(−[…]×) B vanish at each order,

    G w = axial(B'),   G b = axial(B'' − 2 [w]× B' + [w]×² B),   G = tr(U) 1 − U

Derivatives by z are taken by a complex step, exact to rounding.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.forces.rotations import arc
from kedfem.dynamics.system.record import (
    ANGLE,
    ARC,
    DISTANCE,
    FACE,
    GAP,
    LINE,
    ON_LINES,
    PLANAR,
    PLANAR_BEAM,
    POINT,
    RIGID,
    ROTATION,
    TILT,
    TURN,
    Constraint,
    End,
    Line,
    System,
    Term,
)
from kedfem.dynamics.system.starts.offsets import foot, offset
from kedfem.dynamics.system.starts.series import Series, inverse, product, root
from kedfem.motion.newton import cross_matrix, rotation
from kedfem.motion.rigid import RigidMotion
from kedfem.vectors import nearest_rotations

STEP = 1e-150  # of complex steps: its square is nothing


@dataclass(frozen=True, slots=True)
class Places:
    """Orientation and origin of all bodies of the linkage at one time, as series: R (3, M, 3, 3), p (3, M, 3)."""

    R: Float[np.ndarray, "3 M 3 3"]
    p: Float[np.ndarray, "3 M 3"]

    def at_rest(self) -> "Places":
        """The same without rates."""
        return Places(self.R * [[[[1.0]]], [[[0.0]]], [[[0.0]]]], self.p * [[[1.0]], [[0.0]], [[0.0]]])


def places(motion: RigidMotion, k: int = 0) -> Places:
    """The rigid-body motion at time point k."""
    R = motion.R[k]
    return Places(
        np.stack([R, cross_matrix(motion.omega[k]) @ R, motion.R2[k]]), np.stack([motion.p[k], motion.v[k], motion.p2[k]])
    )


def coordinates(system: System, at: Places, z: Float[np.ndarray, "3 k"]) -> Float[np.ndarray, "3 r"]:
    """All coordinates, their rates and the rates of these; of those linear in z what C(t) z is.

    Parameters
    ----------
    z : interface unknowns as series
    """
    out = np.zeros((3, len(system.constraints)))
    bent, small = _Poses(system, at, z), _Poses(system, at, 1j * STEP * z)
    for n, each in enumerate(system.constraints):
        if each.linear:
            out[:, n] = _summed(system, each, small).imag / STEP
        else:
            out[:, n] = _summed(system, each, bent)
    return out


def travels(system: System, at: Places) -> Float[np.ndarray, "3 r"]:
    """All coordinates in the rigid-body motion: of a drive its travel, but for turns."""
    poses = _Poses(system, at, np.zeros((3, system.unknowns)))
    return np.array([_summed(system, each, poses) for each in system.constraints]).reshape(-1, 3).T


def angles(system: System, at: Places, z: Float[np.ndarray, " k"]) -> Float[np.ndarray, " t"]:
    """Angles of all terms of all constraints, without their factors, zero of others; of those linear in z at z = 0."""
    none = np.zeros((3, len(z)))
    rest, bent = _Poses(system, at, none), _Poses(system, at, np.stack([z, 0 * z, 0 * z]))

    def angle(each: Constraint, term: Term) -> float:
        poses = rest if each.linear else bent
        return float(value(system, term, poses(term.i), poses(term.j))[0]) if term.kind == ANGLE else 0.0

    return np.array([angle(each, term) for each in system.constraints for term in each.terms])


def pins(system: System, at: Places, z: Float[np.ndarray, " k"]) -> dict[int, float]:
    """Places of pins on lines as they are, by the numbers of the lines' ends [m]."""
    poses, out = _Poses(system, at, np.stack([z, 0 * z, 0 * z])), dict[int, float]()
    for term in (term for each in system.constraints for term in each.terms if term.kind in ON_LINES):
        found = foot(_point(system, term, poses), system.ends[term.j], at, poses.z)
        out[term.j] = float(found.s[0])
    return out


def moved_by(system: System, terms: Sequence[Term]) -> set[int]:
    """Interface unknowns that move the ends of terms."""
    ends = (system.ends[n] for n in {n for term in terms for n in (term.i, term.j)})
    return {int(c) for end in ends for c in end.columns}


def coordinate(system: System, each: Constraint, at: Places, z: Float[np.ndarray, "3 k"]) -> Series:
    """A coordinate as a series (3,), though it be linear in z."""
    return _summed(system, each, _Poses(system, at, z))


@dataclass
class _Poses:
    """Poses of ends, each found once."""

    system: System
    at: Places
    z: Series

    def __post_init__(self) -> None:
        self._found: dict[int, tuple[Series, Series]] = {}

    def __call__(self, n: int) -> tuple[Series, Series]:
        if n not in self._found:
            self._found[n] = pose(self.system.ends[n], self.at, self.z)
        return self._found[n]


def _summed(system: System, each: Constraint, poses: _Poses) -> Series:
    found = (term.factor * _of_term(system, term, poses) for term in each.terms)
    return np.asarray(sum(found))


def _of_term(system: System, term: Term, poses: _Poses) -> Series:
    if term.kind not in ON_LINES:
        return value(system, term, poses(term.i), poses(term.j))
    end = system.ends[term.j]
    found = foot(_point(system, term, poses), end, poses.at, poses.z)
    return found.s if term.kind == ARC else offset(term, found, end, poses.at)


def _point(system: System, term: Term, poses: _Poses) -> Series:
    """The point of end i that a term is about, as a series."""
    x, Q = poses(term.i)
    return np.asarray(x + Q @ (term.a - system.ends[term.i].origin))


def pose(end: End, at: Places, z: Series) -> tuple[Series, Series]:
    """Place x (3, 3) and orientation Q (3, 3, 3) of an end, as series."""
    R, x = at.R[:, end.body], at.p[:, end.body] + at.R[:, end.body] @ end.origin
    if end.form == RIGID:
        return x, R
    u = np.einsum("pdc,tc->tpd", end.onto, z[:, end.columns])
    if end.line is not None:
        u = _at_pin(end, end.line, at, u)
    flat = 2 if end.form == PLANAR_BEAM else end.onto.shape[1]
    x = x + 0 * u[0, 0, 0]
    x[:, :flat] += u[:, 0, :flat]
    if end.form in (POINT, LINE):
        return x, R
    if end.form == PLANAR_BEAM:
        return x, product(np.matmul, _about_z(u[:, 0, 2]), R)
    A = np.einsum("tka,kb->tab", _directions(end, R, u), end.directions)
    return x, _rotation(A)


def _at_pin(end: End, line: Line, at: Places, u: Series) -> Series:
    """Displacement (3, 1, d) where a pin is on a line, from those of its stations; rigid-body motion shows where that
    is."""
    apart = at.p[:, line.pin] + at.R[:, line.pin] @ line.at - at.p[:, end.body]
    s = product(np.dot, apart, at.R[:, end.body] @ line.axis)
    N, first, second = (line.stations.at(s[:1] - line.at @ line.axis, k)[0] for k in range(3))
    weights = np.stack([N, first * s[1], second * s[1] ** 2 + first * s[2]])
    return product(np.dot, weights, u)[:, None]


def _about_z(psi: Series) -> Series:
    """Turns by ψ about z."""
    w = psi[1] * cross_matrix(np.array([0, 0, 1.0]))
    c, s, zero = np.cos(psi[0]), np.sin(psi[0]), 0 * psi[0]
    Q = np.array([[c, -s, zero], [s, c, zero], [zero, zero, 1 + zero]])
    return np.stack([Q, Q @ w, Q @ (w @ w + psi[2] * cross_matrix(np.array([0, 0, 1.0])))])


def _directions(end: End, R: Series, u: Series) -> Series:
    """D (3, 3, 3) of a surface, row k direction k as it is now: known ones from its points, the others completed."""
    d = end.onto.shape[1]
    D = np.zeros((3, 3, 3), np.result_type(R, u))
    for k in range(end.known):
        D[:, k] = R @ end.directions[k]
        D[:, k, :d] += (u[:, k + 1] - u[:, 0]) / end.lengths[k]
    if end.form == PLANAR:
        if end.known == 1:
            D[:, 1, 0], D[:, 1, 1] = -D[:, 0, 1], D[:, 0, 0]
        D[0, 2, 2] = 1.0
    if end.form == FACE:
        n = product(np.cross, D[:, 0], D[:, 1])
        size = root(product(np.dot, n, n))
        D[:, 2] = product(np.multiply, n, inverse(size))
    return D


def _rotation(A: Series) -> Series:
    """Q of A = Q U: the value by singular values and Newton, then order by order."""
    Q = nearest_rotations(A[0].real[None])[0]
    for _ in range(2):
        Q = Q @ rotation(_small_rotation(Q.T @ A[0].real))
    if np.iscomplexobj(A):  # one step more is exact to first order
        Q = Q @ (np.eye(3) + cross_matrix(_small_rotation(Q.T @ A[0])))
    B = Q.T @ A
    w = _small_rotation(B[0], B[1])
    W = cross_matrix(w)
    b = _small_rotation(B[0], B[2] - 2 * W @ B[1] + W @ W @ B[0])
    return np.stack([Q, Q @ W, Q @ (W @ W + cross_matrix(b))])


def _small_rotation(U: np.ndarray, B: np.ndarray | None = None) -> np.ndarray:
    """θ of G θ = axial(B), B = U if not given."""
    B = U if B is None else B
    axial = np.array([B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1]])
    G = -(U + U.T) / 2
    G[[0, 1, 2], [0, 1, 2]] += U[0, 0] + U[1, 1] + U[2, 2]
    return np.asarray(np.linalg.solve(G, axial))


def value(system: System, term: Term, one: tuple[Series, Series], other: tuple[Series, Series]) -> Series:
    """A term of two ends' poses, as a series (3,)."""
    (x_i, Q_i), (x_j, Q_j) = one, other
    if term.kind in (GAP, DISTANCE):
        gap = x_i + Q_i @ (term.a - system.ends[term.i].origin) - x_j - Q_j @ (term.a_j - system.ends[term.j].origin)
        return product(np.dot, gap, Q_j @ term.b) if term.kind == GAP else root(product(np.dot, gap, gap))
    if term.kind == TURN:
        return product(np.dot, Q_i @ term.a, Q_j @ term.b)
    if term.kind == ROTATION:
        return _rotation_along(Q_i, Q_j, Q_j @ term.b)
    if term.kind == TILT:
        a, n = Q_i @ term.a, Q_j @ term.a_j
        along = product(np.dot, product(np.cross, n, a), Q_j @ term.b)
        return product(np.multiply, _arc(product(np.dot, a, n)), along)
    if term.kind != ANGLE:
        raise ValueError(f"term: must be one of those of `record.Term`, got {term.kind}")
    a, a_j = Q_i @ term.a, Q_j @ term.a_j
    e, e_j = Q_i @ np.cross(term.b, term.a), Q_j @ np.cross(term.b, term.a_j)
    along = product(np.dot, a, a_j) + product(np.dot, e, e_j)
    return _angle(along, product(np.dot, a, e_j) - product(np.dot, e, a_j))


def _rotation_along(Q_i: Series, Q_j: Series, b: Series) -> Series:
    """Component along b of the rotation vector: by the quaternion's scalar part, and twice its vector part times that."""
    cosine = root(product(lambda x, y: np.sum(x * y), Q_i, Q_j) + np.eye(3)[0]) / 2
    twice = product(lambda x, y: np.cross(x, y, axis=0).sum(axis=1), Q_j, Q_i)
    share = product(np.multiply, _arc(cosine), inverse(2 * cosine))
    return product(np.multiply, share, product(np.dot, twice, b))


def _arc(c: Series) -> Series:
    """arccos(c) / √(1 − c²) of a series (3,)."""
    f, first, second = arc(c[0])
    return np.array([f, first * c[1], second * c[1] ** 2 + first * c[2]])


def _angle(c: Series, s: Series) -> Series:
    """arg(c + i s): its rates are those of the logarithm, c and s each their own kind of number."""
    size = c[0] ** 2 + s[0] ** 2
    turned = np.arctan2(s[0].real, c[0].real)
    if np.iscomplexobj(c):
        turned = turned + 1j * ((c[0] * s[0].imag - s[0] * c[0].imag) / size).real
    p1, q1 = (c[0] * c[1] + s[0] * s[1]) / size, (c[0] * s[1] - s[0] * c[1]) / size
    q2 = (c[0] * s[2] - s[0] * c[2]) / size
    return np.array([turned, q1, q2 - 2 * p1 * q1])
