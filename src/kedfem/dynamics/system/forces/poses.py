"""Displaced positions of bodies and their ends: poses, directions and points of forces."""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system import record
from kedfem.dynamics.system.ends import line_weights
from kedfem.dynamics.system.forces.rotations import rotation_moment, tilt_moment
from kedfem.dynamics.system.record import End, Term
from kedfem.motion.rigid import RigidMotion
from kedfem.vectors import cross, nearest_rotations

Vectors = Float[np.ndarray, "T 3"]


def unit_moment(term: Term, Q_i: Float[np.ndarray, "T 3 3"], Q_j: Float[np.ndarray, "T 3 3"]) -> Vectors:
    """Moment on end i of a unit multiplier on a turn, an angle or a rotation; on j it is the opposite."""
    a, b = Q_i @ term.a, Q_j @ term.b
    if term.kind == record.TURN:
        return cross(a, b)
    if term.kind == record.ROTATION:
        return rotation_moment(Q_i, Q_j, b)
    if term.kind == record.TILT:
        return tilt_moment(a, Q_j @ term.a_j, b)
    a_j, e, e_j = Q_j @ term.a_j, Q_i @ cross(term.b, term.a), Q_j @ cross(term.b, term.a_j)
    along = (a * a_j + e * e_j).sum(axis=1)[:, None]
    across = (a * e_j - e * a_j).sum(axis=1)[:, None]
    moment = cross(a, along * e_j - across * a_j) - cross(e, along * a_j + across * e_j)
    return np.asarray(moment / (along**2 + across**2))


def value(
    term: Term, ends: tuple[End, End], motion: RigidMotion, z: Float[np.ndarray, "T k"] | None
) -> Float[np.ndarray, " T"]:
    """A gap, a distance, or an angle within ±π, over time; without z as the rigid-body motion shows it."""
    (x_i, Q_i), (x_j, Q_j) = (poses(end, motion, z, strained=term.kind == record.ANGLE) for end in ends)
    if term.kind == record.ANGLE:  # that of strained directions differs from the rotation's by the square of the strain
        a, a_j, e, e_j = Q_i @ term.a, Q_j @ term.a_j, Q_i @ cross(term.b, term.a), Q_j @ cross(term.b, term.a_j)
        return np.asarray(np.arctan2((a * e_j - e * a_j).sum(axis=1), (a * a_j + e * e_j).sum(axis=1)))
    gap = x_i + Q_i @ (term.a - ends[0].origin) - x_j - Q_j @ (term.a_j - ends[1].origin)
    return np.asarray(np.linalg.norm(gap, axis=1) if term.kind == record.DISTANCE else (gap * (Q_j @ term.b)).sum(axis=1))


def poses(
    end: End, motion: RigidMotion, z: Float[np.ndarray, "T k"] | None, strained: bool = False
) -> tuple[Vectors, Float[np.ndarray, "T 3 3"]]:
    """Place and orientation of an end over time; without z those that the rigid-body motion shows.

    Parameters
    ----------
    strained : whether a surface's orientation is Σ D_k ⊗ e_k itself, for which no rotation has to be found
    """
    R = motion.R[:, end.body]
    x = motion.p[:, end.body] + R @ end.origin
    if end.form == record.RIGID or z is None:
        return x, R
    d = end.onto.shape[1]
    u = np.einsum("pdc,tc->tpd", end.onto, z[:, end.columns])
    if end.line is not None:
        u = np.einsum("tp,tpd->td", line_weights(end, motion), u)[:, None]
    flat = 2 if end.form == record.PLANAR_BEAM else d
    x[:, :flat] += u[:, 0, :flat]
    if end.form in (record.POINT, record.LINE):
        return x, R
    if end.form == record.PLANAR_BEAM:
        c, s, Q = np.cos(u[:, 0, 2]), np.sin(u[:, 0, 2]), np.zeros_like(R)
        Q[:, 0, 0], Q[:, 0, 1], Q[:, 1, 0], Q[:, 1, 1], Q[:, 2, 2] = c, -s, s, c, 1.0
        return x, Q @ R
    A = _directions(end, R, u).transpose(0, 2, 1) @ end.directions
    return x, A if strained else nearest_rotations(A)


def _directions(end: End, R: Float[np.ndarray, "T 3 3"], u: Float[np.ndarray, "T p d"]) -> Float[np.ndarray, "T 3 3"]:
    """Directions of a surface as they are, row k direction k."""
    d = end.onto.shape[1]
    D = np.zeros((len(u), 3, 3))
    for k in range(end.known):
        D[:, k] = R @ end.directions[k]
        D[:, k, :d] += (u[:, k + 1] - u[:, 0]) / end.lengths[k]
    if end.form == record.PLANAR:
        if end.known == 1:
            D[:, 1] = cross(np.array([0.0, 0.0, 1.0]), D[:, 0])
        D[:, 2] = [0, 0, 1]
    if end.form == record.FACE:
        D[:, 2] = cross(D[:, 0], D[:, 1])
        D[:, 2] /= np.linalg.norm(D[:, 2], axis=1)[:, None]
    return D


def point_forces(
    end: End, motion: RigidMotion, z: Float[np.ndarray, "T k"] | None, force: Vectors, moment: Vectors
) -> Float[np.ndarray, "T p d"]:
    """Forces at an end's interface points that do what a force and a moment on it do: q_k of `ends_kernel`."""
    if z is None or end.line is not None:
        return forces_in_place(end, motion, force[:, None], moment[:, None])[:, 0]
    u = np.einsum("pdc,tc->tpd", end.onto, z[:, end.columns])
    return _on_points(end, motion.R[:, end.body], u, force, moment)


def forces_in_place(
    end: End, motion: RigidMotion, force: Float[np.ndarray, "T r 3"], moment: Float[np.ndarray, "T r 3"]
) -> Float[np.ndarray, "T r p d"]:
    """The same of several forces and moments on an end that is where the rigid-body motion has it."""
    (p, d, _), R = end.onto.shape, motion.R[:, end.body]
    if end.line is not None:
        return np.asarray(force[:, :, None, :d] * line_weights(end, motion)[:, None, :, None])
    one, none, units = np.tile(np.eye(3), (6, 1, 1)), np.zeros((6, p, d)), np.eye(6)
    units = _on_points(end, one, none, units[:, :3], units[:, 3:])
    own = np.concatenate([force @ R, moment @ R], axis=2) @ units.reshape(6, -1)
    return np.asarray((own.reshape(len(R), -1, d) @ R[:, :d, :d].transpose(0, 2, 1)).reshape(*force.shape[:2], p, d))


def _on_points(
    end: End, R: Float[np.ndarray, "T 3 3"], u: Float[np.ndarray, "T p d"], force: Vectors, moment: Vectors
) -> Float[np.ndarray, "T p d"]:
    """The same of a surface or point, from the orientation of its body and the displacements of its points."""
    y, d = np.zeros_like(u), u.shape[2]
    flat = 2 if end.form == record.PLANAR_BEAM else d
    y[:, 0, :flat] = force[:, :flat]
    if end.form == record.PLANAR_BEAM:
        y[:, 0, 2] = moment[:, 2]
    if end.form in (record.POINT, record.PLANAR_BEAM):
        return y
    D = _directions(end, R, u)
    A = D.transpose(0, 2, 1) @ end.directions
    Q = nearest_rotations(A)
    U = Q.transpose(0, 2, 1) @ A
    G = np.trace(U, axis1=1, axis2=2)[:, None, None] * np.eye(3) - U
    turn = np.linalg.solve(G, (Q.transpose(0, 2, 1) @ moment[:, :, None]))[:, :, 0]
    q = [(Q @ cross(turn, e)[:, :, None])[:, :, 0] for e in end.directions]
    if end.form == record.PLANAR and end.known == 1:
        q[0] = q[0] + cross(q[1], np.array([0.0, 0.0, 1.0]))
    if end.form == record.FACE:
        size = np.linalg.norm(cross(D[:, 0], D[:, 1]), axis=1)[:, None]
        n = D[:, 2]
        q[0] = q[0] - (q[2] * cross(D[:, 1], n)).sum(axis=1)[:, None] / size * n
        q[1] = q[1] - (q[2] * cross(n, D[:, 0])).sum(axis=1)[:, None] / size * n
    for k in range(end.known):
        y[:, k + 1] += q[k][:, :d] / end.lengths[k]
        y[:, 0] -= q[k][:, :d] / end.lengths[k]
    return y
