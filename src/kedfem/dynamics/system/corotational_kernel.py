"""Bodies with one co-rotational frame in a step, compiled by numba: internal force, and state at the end.

Without such bodies K may be None; this module is then not compiled.
"""

from kedfem.compiled import inner
from kedfem.dynamics.frames_kernel import balanced, strained
from kedfem.dynamics.metric_kernel import metric_force
from kedfem.dynamics.system.algebra_kernel import copied, rotated, state_of
from kedfem.dynamics.system.products_kernel import stiffness_times


@inner
def newmark(c):  # type: ignore[no-untyped-def]
    """Newmark's numbers as `frames_kernel` and `beams_kernel` take them."""
    n0, n1, n2 = c.acceleration
    return n0, n1, n2, c.late, c.early, c.beta


@inner
def corotational_force(K, c, bodies, i, R, state, trial, work, first_pass):  # type: ignore[no-untyped-def]
    """Add the internal force of a body with one frame, and keep what that sees; without any K may be None."""
    if K is None:
        return
    first, last, d, n = bodies.at[i], bodies.at[i + 1], bodies.components[i], bodies.functions[i]
    N, body = last - first, R[bodies.motion[i]]
    moved, f = trial.u[first:last].reshape(d, n), trial.f[first:last].reshape(d, n)
    shapes = (
        bodies.X[first:last].reshape(d, n), bodies.one[first:last].reshape(d, n), bodies.fit[first:last].reshape(d, n),
    )  # fmt: skip
    seen, frame = (
        (state_of(state.seen, first, last), state_of(trial.seen, first, last)),
        (trial.Q[i], trial.angle[i : i + 1]),
    )
    rooms = (
        work.y[:N].reshape(d, n), work.rotated[:N].reshape(d, n), work.strained[:N], work.A, work.U, work.change,
    )  # fmt: skip
    element = number_of(bodies.elements, i)
    if element >= 0:
        metric_force(newmark(c), element, bodies.elements, shapes, body, moved, seen, frame, f, rooms, work.element)
        return
    strained(newmark(c), bodies.kind[i], shapes, body, moved, seen, frame, rooms)
    stiffness_times(bodies, i, work.strained, work.rotated)
    if bodies.rigid[i]:
        copied(work.rotated[:N], trial.response[first:last])
        if first_pass:
            copied(work.rotated[:N], trial.foreseen[first:last])
        copied(trial.foreseen[first:last], work.rotated[:N])
        unforeseen(bodies, i, trial, work)
        for x in range(N):
            trial.f[first + x] += work.room[x]
    balanced(bodies.kind[i], shapes[2], body, seen[1][0], frame[0], f, rooms)


@inner
def number_of(elements, i):  # type: ignore[no-untyped-def]
    """The number of body i among elements of beams in space, −1 if it is none."""
    if elements is None:
        return -1
    return elements.number[i]


@inner
def unforeseen(bodies, i, trial, work):  # type: ignore[no-untyped-def]
    """work.room becomes what a rigid body resists more than foreseen, world components by the frame of its factor.

    The factor takes just that back, however stiff the body is. In its new frame, K of an error of the second order in
    the pass's rotation would push along other directions than the factor resists, and passes would diverge.
    """
    first, last = bodies.at[i], bodies.at[i + 1]
    N = last - first
    for x in range(N):
        work.strained[x] = trial.response[first + x] - trial.foreseen[first + x]
    rotated(trial.Rp[i], bodies.components[i], work.strained[:N], work.room[:N])


@inner
def foresee(K, c, bodies, i, change, trial, work):  # type: ignore[no-untyped-def]
    """What a rigid body will resist once displaced by what a pass asks for (N,), in the frame of its factor."""
    if K is None:
        return
    first, last = bodies.at[i], bodies.at[i + 1]
    N = last - first
    stiffness_times(bodies, i, change[:N], work.rotated[:N])
    late = 1 + c.beta * c.late * c.acceleration[0]
    for x in range(N):
        trial.foreseen[first + x] = trial.response[first + x] + late * work.rotated[x]


@inner
def corotational_end(K, bodies, i, trial, state, history, t, work):  # type: ignore[no-untyped-def]
    """What the frame of a body sees of it becomes the state, with its energy."""
    if K is None:
        return
    first, last = bodies.at[i], bodies.at[i + 1]
    g = trial.seen[0, first:last]
    for m in range(3):
        copied(trial.seen[m, first:last], state.seen[m, first:last])
    copied(g, history.g[t, first:last])
    stiffness_times(bodies, i, g, work.y)
    energy = 0.0
    for x in range(last - first):
        energy += 0.5 * g[x] * work.y[x]
    history.energy[t, i] = energy
