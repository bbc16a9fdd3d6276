"""Beginning and end of a step for a body with a rigid-body frame and for the interface, compiled by numba."""

from kedfem.compiled import inner
from kedfem.dynamics.system.algebra_kernel import copied, frame_copied, product, rotated_ports
from kedfem.dynamics.system.bodies_kernel import newmark_advanced, right_hand_side, rigid_frame_end
from kedfem.dynamics.system.constraints_kernel import coordinate
from kedfem.dynamics.system.ends_kernel import placed
from kedfem.dynamics.system.interface_kernel import along, gradient, known, newmark_rate
from kedfem.dynamics.system.products_kernel import add_at_ports, displaced, sparse_held


@inner
def rigid_frame_begin(c, bodies, i, R, F, state, trial, work, solved):  # type: ignore[no-untyped-def]
    """The right-hand side of a body, and what it exerts at its interface points while these are held."""
    first, last, of_ports = bodies.at[i], bodies.at[i + 1], bodies.port_at[i]
    frame_copied(R, trial.Rp[i])
    right_hand_side(c, bodies, i, trial.Rp[i], F, state, trial.r, work.room)
    if not bodies.dense[i]:
        sparse_held(bodies.arrays, bodies, i, trial, solved)
        return
    q = bodies.port_at[i + 1] - of_ports
    reaction = trial.reaction[of_ports : of_ports + q]
    product(bodies.Y, bodies.Y_at[i], q, last - first, trial.r[first:last], reaction)


@inner
def rigid_frame_finish(c, bodies, i, F, trial, state, history, t, work):  # type: ignore[no-untyped-def]
    """The displacement of a body, g = G r + Y w and δ = T g, [KED, eq. (5)], and its end of the step."""
    first, last, of_ports = bodies.at[i], bodies.at[i + 1], bodies.port_at[i]
    N = last - first
    displaced(bodies, i, trial, work.y)
    copied(trial.r[first:last], work.rotated[:N])
    add_at_ports(bodies, i, trial.force[of_ports : bodies.port_at[i + 1]], work.rotated)
    rigid_frame_end(c, bodies, i, F, trial, state, history, t, work)


@inner
def ports_end(c, bodies, i, trial, state, history, t, room):  # type: ignore[no-untyped-def]
    """Forces on a body at its interface points at the end of the step, world components."""
    of_ports, q = bodies.port_at[i], bodies.port_at[i + 1] - bodies.port_at[i]
    rotated_ports(bodies, i, trial.Rp[i], trial.force[of_ports : of_ports + q], room)
    for r in range(q):
        x = (room[r] - c.alpha_f * state.port_force[of_ports + r]) / (1 - c.alpha_f)
        state.port_force[of_ports + r] = history.port_force[t, of_ports + r] = x


@inner
def ported(bodies, i, trial):  # type: ignore[no-untyped-def]
    """trial.w and trial.force become displacements and forces at a body's interface points, in its frame."""
    first, last, c = bodies.port_at[i], bodies.port_at[i + 1], bodies.column_at[i + 1] - bodies.column_at[i]
    q, w, force, reaction = last - first, trial.w[first:last], trial.force[first:last], trial.reaction[first:last]
    known(bodies, i, trial.dz, trial.known)
    product(trial.RB, bodies.B_at[i], q, c, trial.known, force)
    for r in range(q):
        w[r] += force[r]
    product(bodies.S, bodies.S_at[i], q, q, w, force)
    for r in range(q):
        force[r] -= reaction[r]


@inner
def constraints_end(c, ends, of, driving, t, state, trial, work, history):  # type: ignore[no-untyped-def]
    """Coordinates with their rates, forces along them, and their sum on z, at the end of the step."""
    if of is None:
        return
    share = 1 - c.alpha_f
    n0, n1, n2 = c.acceleration
    if not of.linear.all():
        placed(ends, driving.R[t], driving.p[t], trial.z, trial.moving, work.end, work.vectors)
    state.bearing[:] = 0.0
    for a in range(len(of.law)):
        columns, row = gradient(of, a, trial)
        e, rate = 0.0, 0.0
        if of.linear[a]:
            e = along(row, columns, trial.z)
        else:
            rigid_motion = (driving.R[t], driving.v[t], driving.omega[t])
            e, rate = coordinate(
                ends, of, a, rigid_motion, trial.moving, trial.term_angles, trial.row, work.end, work.vectors
            )
            if of.drive[a] >= 0:
                e -= driving.drives[t, of.drive[a]]
        second = n0 * (e - state.e[0, a]) - n1 * state.e[1, a] - n2 * state.e[2, a]
        state.e[1, a] += c.late * second + c.early * state.e[2, a]
        state.e[0, a], state.e[2, a] = e, second
        history.rate[t, a] = state.e[1, a]
        if not of.linear[a] and of.drive[a] < 0:
            history.rate[t, a] = rate
            for n in columns:
                z0, z1, z2 = state.z[0, n], state.z[1, n], state.z[2, n]
                history.rate[t, a] += trial.row[n] * newmark_rate(c, trial.z[n], z0, z1, z2)
        state.multiplier[a] = trial.m[a] / share
        for m in range(len(columns)):
            state.bearing[columns[m]] += state.multiplier[a] * row[m]
            trial.row[columns[m]] = 0.0
        history.e[t, a], history.multiplier[t, a] = e, state.multiplier[a]
    copied(trial.term_angles, state.term_angles)


@inner
def interface_end(c, driving, t, trial, state, history):  # type: ignore[no-untyped-def]
    """Interface unknowns with their rates, and the time, at the end of the step."""
    newmark_advanced(c, trial.z, (state.z[0], state.z[1], state.z[2]))
    copied(trial.z, history.z[t])
    state.time[0] = driving.t[t]
