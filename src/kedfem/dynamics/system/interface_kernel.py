"""The common system of all bodies' interface points, with constraints and force laws in it; compiled by numba.

    (Σ Bᵀ R S Rᵀ B) Δz = Σ Bᵀ R (Yᵀ Rᵀ r − S w₀) + known + Cᵀ m,   C Δz + m / κ = target

κ is infinite of a constraint; of a force law it is its tangent, so that it is exact however stiff. A part σ < κ of each
is put into the matrix, as in `dynamics.interface`. Constraints that repeat others get no force.
"""

from kedfem.compiled import inlined, inner
from kedfem.dynamics.anderson_kernel import factored, partly_factored
from kedfem.dynamics.system.algebra_kernel import copied, interface_columns
from kedfem.dynamics.system.constraints_kernel import coordinate, law
from kedfem.dynamics.system.ends_kernel import placed

REPEATED = 1e-10  # [-, 1/m] gradient of a constraint that the interface unknowns satisfy by themselves


@inner
def gathered(bodies, trial):  # type: ignore[no-untyped-def]
    """Rᵀ B and S Rᵀ B of all bodies in their frames, and the matrix of z."""
    H, S = trial.H, bodies.S
    H[:] = 0.0
    for i in range(len(bodies.motion)):
        q, c = bodies.port_at[i + 1] - bodies.port_at[i], bodies.column_at[i + 1] - bodies.column_at[i]
        at, columns = bodies.B_at[i], bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
        RB, SRB = trial.RB[at : at + q * c], trial.SRB[at : at + q * c]
        interface_columns(bodies, i, trial.Rp[i], RB)
        SRB[:] = 0.0
        for r in range(q):
            for p in range(q):
                s = S[bodies.S_at[i] + r * q + p]
                for m in range(c):
                    SRB[r * c + m] += s * RB[p * c + m]
        for r in range(q):
            for m in range(c):
                x, row = RB[r * c + m], columns[m]
                if x != 0.0:
                    for o in range(c):
                        H[row, columns[o]] += x * SRB[r * c + o]


@inner
def offset(bodies, i, u, trial, base):  # type: ignore[no-untyped-def]
    """trial.w becomes w₀ = Rᵀ B z − W Rᵀ u of a body; of one with the rigid-body frame without the second part.

    Parameters
    ----------
    u : (N,) in the body's frame
    base : whether it has the second part
    """
    first, last, c = bodies.port_at[i], bodies.port_at[i + 1], bodies.column_at[i + 1] - bodies.column_at[i]
    q, N = last - first, bodies.at[i + 1] - bodies.at[i]
    RB, W, z, w, at = trial.RB, bodies.W, trial.z, trial.w, bodies.B_at[i]
    columns = bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
    for r in range(q):
        x = 0.0
        for m in range(c):
            x += RB[at + r * c + m] * z[columns[m]]
        if base:
            row = W[bodies.Y_at[i] + r * N : bodies.Y_at[i] + (r + 1) * N]
            for y in range(N):
                x -= row[y] * u[y]
        w[first + r] = x


@inner
def pushed(bodies, i, trial):  # type: ignore[no-untyped-def]
    """Add to the right-hand side what a body exerts on z: Bᵀ R (Yᵀ Rᵀ r − S w₀)."""
    first, last, c = bodies.port_at[i], bodies.port_at[i + 1], bodies.column_at[i + 1] - bodies.column_at[i]
    q, at = last - first, bodies.B_at[i]
    RB, SRB, reaction, w, right = trial.RB, trial.SRB, trial.reaction, trial.w, trial.right
    columns = bodies.columns[bodies.column_at[i] : bodies.column_at[i + 1]]
    for m in range(c):
        x = 0.0
        for r in range(q):
            x += RB[at + r * c + m] * reaction[first + r] - SRB[at + r * c + m] * w[first + r]
        right[columns[m]] += x


@inner
def evaluated(c, ends, of, driving, t, state, trial, work):  # type: ignore[no-untyped-def]
    """Gradients of all constraints and laws at z, and what these ask of Δz; forces without a tangent are known ones."""
    r, share = len(of.law), 1 - c.alpha_f
    if r == 0:
        return
    if not of.linear.all():
        placed(ends, driving.R[t], driving.p[t], trial.z, trial.moving, work.end, work.vectors)
    rigid_motion = (driving.R[t], driving.v[t], driving.omega[t])
    for a in range(r):
        trial.C[a] = 0.0
        if of.linear[a]:
            coordinate(
                ends, of, a, rigid_motion, trial.fixed, trial.turned, trial.C[a], work.end, work.vectors
            )
            e, moving = 0.0, 0.0
            for m in range(len(trial.z)):
                e += trial.C[a, m] * trial.z[m]
        else:
            e, moving = coordinate(
                ends, of, a, rigid_motion, trial.moving, trial.turned, trial.C[a], work.end, work.vectors
            )
            if of.drive[a] >= 0:
                e -= driving.drives[t, of.drive[a]]
        trial.e[a] = e
        if of.linear[a] or of.drive[a] >= 0:
            rate = newmark_rate(c, e, state.e[0, a], state.e[1, a], state.e[2, a])
        else:
            rate = moving
            for m in range(len(trial.z)):
                if trial.C[a, m] != 0.0:
                    rate += trial.C[a, m] * newmark_rate(
                        c, trial.z[m], state.z[0, m], state.z[1, m], state.z[2, m]
                    )
        factor = driving.stiffness_factors[t, a]
        held = law(of, a, driving.t[t], factor, e, rate, state.e[0, a], state.multiplier[a], work.law)
        kappa = share * (work.law[1] + c.rate[0] * work.law[2])
        trial.m[a] = 0.0
        if held:
            trial.compliance[a], trial.target[a] = 0.0, -e
            if not acts(trial.C[a]):
                trial.compliance[a] = -1.0
        elif kappa > 0.0:
            trial.compliance[a], trial.target[a] = 1 / kappa, -share * work.law[0] / kappa
        else:
            trial.compliance[a], trial.m[a] = -1.0, -share * work.law[0]
            for m in range(len(trial.z)):
                trial.right[m] += trial.m[a] * trial.C[a, m]


@inner
def newmark_rate(c, x, x0, x1, x2):  # type: ignore[no-untyped-def]
    """Rate at the end of a step of what has moved from x0 to x."""
    return c.rate[0] * (x - x0) - c.rate[1] * x1 - c.rate[2] * x2


@inlined
def acts(row):  # type: ignore[no-untyped-def]
    """Whether a constraint says something that the interface unknowns do not satisfy by themselves."""
    most = 0.0
    for x in row:
        most = max(most, abs(x))
    return most > REPEATED


@inner
def forward(L, first, x):  # type: ignore[no-untyped-def]
    """x becomes L⁻¹ x."""
    for i in range(len(x)):
        for j in range(first[i], i):
            x[i] -= L[i, j] * x[j]
        x[i] /= L[i, i]


@inner
def backward(L, first, x):  # type: ignore[no-untyped-def]
    """x becomes L⁻ᵀ x."""
    for i in range(len(x) - 1, -1, -1):
        x[i] /= L[i, i]
        for j in range(first[i], i):
            x[j] -= L[i, j] * x[i]


@inlined
def stiffened(bodies, trial):  # type: ignore[no-untyped-def]
    """trial.H_rows becomes the factor of H with a part of each constraint and law; compliances are of what is left."""
    k, r = len(trial.z), len(trial.m)
    for m in range(k):
        copied(trial.H[m], trial.H_rows[m])
    trace = 0.0
    for m in range(k):
        trace += trial.H[m, m]
    for a in range(r):
        trial.beside[a] = 0.0
        if trial.compliance[a] < 0.0:
            continue
        size = 0.0
        for m in range(k):
            size += trial.C[a, m] ** 2
        usual = trace / k / size if size > 0.0 else 0.0
        sigma = usual / (1.0 + 2.0 * usual * trial.compliance[a])
        left = 1.0 - sigma * trial.compliance[a]
        trial.beside[a] = sigma
        trial.compliance[a], trial.target[a] = trial.compliance[a] / left, trial.target[a] / left
        for m in range(k):
            if trial.C[a, m] != 0.0:
                x = sigma * trial.C[a, m]
                for o in range(m + 1):
                    trial.H_rows[m, o] += x * trial.C[a, o]
    factored(trial.H_rows, bodies.first)


@inlined
def compliances(trial):  # type: ignore[no-untyped-def]
    """trial.G becomes the factor of C H⁻¹ Cᵀ + compliance; constraints that depend on others have pivot zero."""
    G, CH = trial.G, trial.CH
    r, k = CH.shape
    for a in range(r):
        trial.pivots[a] = 0.0
        if trial.compliance[a] < 0.0:
            continue
        trial.pivots[a] = 1.0
        for b in range(a + 1):
            x = 0.0
            for m in range(k):
                x += CH[a, m] * CH[b, m]
            G[a, b] = x
        G[a, a] += trial.compliance[a]
    partly_factored(G, trial.pivots)


@inner
def interface_solved(bodies, trial, begins):  # type: ignore[no-untyped-def]
    """trial.dz and trial.m from the right-hand side; without constraints the step's matrix is factored once."""
    first, r = bodies.first, len(trial.m)
    copied(trial.right, trial.dz)
    if r > 0 or begins:
        stiffened(bodies, trial)
    L = trial.H_rows
    forward(L, first, trial.dz)
    for a in range(r):
        copied(trial.C[a], trial.CH[a])
        if trial.compliance[a] >= 0.0:
            forward(L, first, trial.CH[a])
    backward(L, first, trial.dz)
    if r == 0:
        return
    compliances(trial)
    G, left, pivots = trial.G, trial.left, trial.pivots
    for _ in range(2):  # the second closes joints to rounding
        for a in range(r):
            left[a] = 0.0
            if pivots[a] != 0.0:
                left[a] = trial.target[a] - trial.compliance[a] * trial.m[a]
                for m in range(len(trial.z)):
                    left[a] -= trial.C[a, m] * trial.dz[m]
                for b in range(a):
                    left[a] -= G[a, b] * left[b]
                left[a] /= G[a, a]
        for a in range(r - 1, -1, -1):
            if pivots[a] != 0.0:
                for b in range(a + 1, r):
                    if pivots[b] != 0.0:
                        left[a] -= G[b, a] * left[b]
                left[a] /= G[a, a]
                trial.m[a] += left[a]
        trial.part[:] = 0.0
        for a in range(r):
            if left[a] != 0.0:
                for m in range(len(trial.z)):
                    trial.part[m] += left[a] * trial.CH[a, m]
        backward(L, first, trial.part)
        for m in range(len(trial.z)):
            trial.dz[m] += trial.part[m]
    for a in range(r):
        if pivots[a] != 0.0:
            for m in range(len(trial.z)):
                trial.m[a] -= trial.beside[a] * trial.C[a, m] * trial.dz[m]
