"""The common system of all bodies' interface points, with constraints and force laws in it; compiled by numba.

    (Σ Bᵀ R S Rᵀ B) Δz = Σ Bᵀ R (Yᵀ Rᵀ r − S w₀) + known + Cᵀ m,   C Δz + m / κ = target

κ is infinite for a constraint and the tangent of a force law, so that the equation is exact for any stiffness. A part
σ < κ of each is added to the matrix, as in `dynamics.matrices.bordered`. One matrix, stored by its profile, gives both:

    [H + Σ σ cᵀ c, Cᵀ; C, −1/κ] (Δz, −m) = (right, target)

Constraints that repeat others get no force.
"""

from kedfem.compiled import inner
from kedfem.dynamics.matrices.profile_kernel import profile_factored, profile_solved
from kedfem.dynamics.system.algebra_kernel import add_transposed, copied, interface_columns, product
from kedfem.dynamics.system.constraints_kernel import coordinate, law
from kedfem.dynamics.system.ends_kernel import placed
from kedfem.dynamics.system.products_kernel import take_ports

REPEATED = 1e-10  # [-, 1/m] gradient of a constraint that the interface unknowns satisfy by themselves


@inner
def gathered(bodies, trial):  # type: ignore[no-untyped-def]
    """Rᵀ B and (S Rᵀ B)ᵀ of all bodies in their frames, and the matrix of z; Rᵀ B is zero for the most part."""
    H, place = trial.H, bodies.place
    H[:] = 0.0
    for i in range(len(bodies.motion)):
        q, c = bodies.port_at[i + 1] - bodies.port_at[i], bodies.column_at[i + 1] - bodies.column_at[i]
        at, columns = bodies.B_at[i], bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
        RB, SRB = trial.RB[at : at + q * c], trial.SRB[at : at + q * c]
        interface_columns(bodies, i, trial.Rp[i], RB)
        reach, S = bodies.reach[bodies.column_at[i] : bodies.column_at[i + 1]], bodies.S[bodies.S_at[i] :]
        for m in range(c):
            own = SRB[m * q : (m + 1) * q]
            own[:] = 0.0
            for p in range(reach[m, 0], reach[m, 1]):
                x, its = RB[p * c + m], S[p * q : (p + 1) * q]
                for r in range(q):
                    own[r] += x * its[r]
        for m in range(c):
            row, first, last = place[columns[m]], reach[m, 0], reach[m, 1]
            own = H[bodies.row_at[row] : bodies.row_at[row + 1]]
            for o in range(c):
                column = place[columns[o]]
                if column <= row:
                    total, its = 0.0, SRB[o * q : (o + 1) * q]
                    for r in range(first, last):
                        total += RB[r * c + m] * its[r]
                    own[column - bodies.first[row]] += total


@inner
def offset(bodies, i, u, trial, base):  # type: ignore[no-untyped-def]
    """trial.w becomes w₀ = Rᵀ B z − W Rᵀ u of a body; of one with the rigid-body frame without the second part.

    Parameters
    ----------
    u : (N,) in the body's frame
    base : whether it has the second part
    """
    first, last, c = bodies.port_at[i], bodies.port_at[i + 1], bodies.column_at[i + 1] - bodies.column_at[i]
    w = trial.w[first:last]
    known(bodies, i, trial.z, trial.known)
    product(trial.RB, bodies.B_at[i], last - first, c, trial.known, w)
    if base:
        take_ports(bodies, i, u, w)


@inner
def known(bodies, i, z, out):  # type: ignore[no-untyped-def]
    """out becomes the interface unknowns that a body knows."""
    columns = bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
    for m in range(len(columns)):
        out[m] = z[columns[m]]


@inner
def pushed(bodies, i, trial):  # type: ignore[no-untyped-def]
    """Add to the right-hand side what a body exerts on z: Bᵀ R (Yᵀ Rᵀ r − S w₀)."""
    first, last, c = bodies.port_at[i], bodies.port_at[i + 1], bodies.column_at[i + 1] - bodies.column_at[i]
    q, at, pushes, right = last - first, bodies.B_at[i], trial.known, trial.right
    columns = bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
    product(trial.SRB, at, c, q, trial.w[first:last], pushes)
    for m in range(c):
        pushes[m] = -pushes[m]
    add_transposed(trial.RB, at, q, c, trial.reaction[first:last], pushes)
    for m in range(c):
        right[columns[m]] += pushes[m]


@inner
def evaluated(c, ends, of, driving, t, state, trial, work, begins):  # type: ignore[no-untyped-def]
    """Gradients of all constraints and laws at z, and what these ask of Δz; forces without a tangent are known ones.

    Linear ones keep their gradients from when a step begins.
    """
    if of is None:
        return
    r, share = len(of.law), 1 - c.alpha_f
    if not of.linear.all():
        placed(ends, driving.R[t], driving.p[t], trial.z, trial.moving, work.end, work.vectors)
    rigid_motion = (driving.R[t], driving.v[t], driving.omega[t])
    for a in range(r):
        e, rate = 0.0, 0.0
        if begins or not of.linear[a]:
            e, rate = differentiated(ends, of, a, rigid_motion, trial, work)
        columns, row = gradient(of, a, trial)
        if of.linear[a]:
            e = along(row, columns, trial.z)
        elif of.drive[a] >= 0:
            e -= driving.drives[t, of.drive[a]]
        trial.e[a] = e
        if of.linear[a] or of.drive[a] >= 0:
            rate = newmark_rate(c, e, state.e[0, a], state.e[1, a], state.e[2, a])
        else:
            for m in range(len(columns)):
                n = columns[m]
                rate += row[m] * newmark_rate(c, trial.z[n], state.z[0, n], state.z[1, n], state.z[2, n])
        factor = driving.stiffness_factors[t, a]
        held = law(of, a, driving.t[t], factor, e, rate, state.e[0, a], state.multiplier[a], work.law)
        kappa = share * (work.law[1] + c.rate[0] * work.law[2])
        trial.m[a] = 0.0
        if held:
            trial.compliance[a], trial.target[a] = 0.0, -e
            if not acts(row):
                trial.compliance[a] = -1.0
        elif kappa > 0.0:
            trial.compliance[a], trial.target[a] = 1 / kappa, -share * work.law[0] / kappa
        else:
            trial.compliance[a], trial.m[a] = -1.0, -share * work.law[0]
            for m in range(len(columns)):
                trial.right[columns[m]] += trial.m[a] * row[m]


@inner
def differentiated(ends, of, a, rigid_motion, trial, work):  # type: ignore[no-untyped-def]
    """Coordinate a and its rate in the rigid-body motion, as `coordinate`; its gradient is put into trial.C."""
    place = trial.fixed if of.linear[a] else trial.moving
    found = coordinate(ends, of, a, rigid_motion, place, trial.term_angles, trial.row, work.end, work.vectors)
    columns, row = gradient(of, a, trial)
    for m in range(len(columns)):
        row[m] = trial.row[columns[m]]
        trial.row[columns[m]] = 0.0
    return found


@inner
def gradient(of, a, trial):  # type: ignore[no-untyped-def]
    """The interface unknowns that a constraint couples, and its gradient on them; not to be called where references
    are counted."""
    first, last = of.column_at[a], of.column_at[a + 1]
    return of.columns[first:last], trial.C[first:last]


@inner
def along(row, columns, z):  # type: ignore[no-untyped-def]
    """A gradient times z."""
    total = 0.0
    for m in range(len(columns)):
        total += row[m] * z[columns[m]]
    return total


@inner
def newmark_rate(c, x, x0, x1, x2):  # type: ignore[no-untyped-def]
    """Rate at the end of a step of what has moved from x0 to x."""
    return c.rate[0] * (x - x0) - c.rate[1] * x1 - c.rate[2] * x2


@inner
def acts(row):  # type: ignore[no-untyped-def]
    """Whether a constraint says something that the interface unknowns do not satisfy by themselves."""
    most = 0.0
    for x in row:
        most = max(most, abs(x))
    return most > REPEATED


@inner
def bordered(bodies, of, trial):  # type: ignore[no-untyped-def]
    """trial.K becomes H with a part `beside` of each constraint and law, and with what is left of them."""
    K, place, first, at = trial.K, bodies.place, bodies.first, bodies.row_at
    copied(trial.H, K)
    trace = 0.0
    for m in range(len(place)):
        trace += trial.H[at[place[m] + 1] - 1]
    for a in range(len(trial.m)):
        trial.beside[a] = 0.0
        if trial.compliance[a] < 0.0:
            continue
        columns, row = gradient(of, a, trial)
        size = 0.0
        for m in range(len(row)):
            size += row[m] ** 2
        usual = trace / len(place) / size if size > 0.0 else 0.0
        sigma = usual / (1.0 + 2.0 * usual * trial.compliance[a])
        trial.beside[a] = sigma
        own = of.place[a]
        for m in range(len(row)):
            i, x = place[columns[m]], sigma * row[m]
            K[at[own] + i - first[own]] = row[m]
            for o in range(m + 1):
                K[at[i] + place[columns[o]] - first[i]] += x * row[o]
        K[at[own + 1] - 1] = -trial.compliance[a] / (1.0 - sigma * trial.compliance[a])


@inner
def interface_solved(bodies, of, trial, begins):  # type: ignore[no-untyped-def]
    """trial.dz and trial.m from the right-hand side; where all constraints are linear by one factor for a step."""
    k, r, x, inverse = len(trial.dz), len(trial.m), trial.x, trial.inverse
    if of is None:
        if begins:
            copied(trial.H, trial.K)
            profile_factored(trial.K, bodies.first, bodies.row_at, bodies.multiplier, inverse)
        for m in range(k):
            x[bodies.place[m]] = trial.right[m]
        profile_solved(trial.K, bodies.first, bodies.row_at, inverse, x)
        for m in range(k):
            trial.dz[m] = x[bodies.place[m]]
        return
    if begins or not of.linear.all():
        bordered(bodies, of, trial)
        profile_factored(trial.K, bodies.first, bodies.row_at, bodies.multiplier, inverse)
    trial.dz[:] = 0.0
    for again in range(2):  # the second closes joints to rounding
        for m in range(k):
            x[bodies.place[m]] = trial.right[m] if again == 0 else 0.0
        for a in range(r):
            columns, row = gradient(of, a, trial)
            left = (trial.target[a] - trial.compliance[a] * trial.m[a]) / (1.0 - trial.beside[a] * trial.compliance[a])
            x[of.place[a]] = left - along(row, columns, trial.dz)
        profile_solved(trial.K, bodies.first, bodies.row_at, inverse, x)
        for m in range(k):
            trial.dz[m] += x[bodies.place[m]]
        for a in range(r):
            trial.m[a] -= x[of.place[a]]
    for a in range(r):
        if inverse[of.place[a]] != 0.0:
            columns, row = gradient(of, a, trial)
            trial.m[a] -= trial.beside[a] * along(row, columns, trial.dz)
