"""Steps of a linear system with rigid-body frames, compiled by numba: one solution of the interface a step.

It is separate from `step_kernel`, so that a linear scene need not wait until unused passes are compiled.
"""

from kedfem.compiled import compiled, inner
from kedfem.dynamics.system.algebra_kernel import copied
from kedfem.dynamics.system.ends_kernel import unmoved
from kedfem.dynamics.system.interface_kernel import evaluated, gathered, interface_solved, offset, pushed
from kedfem.dynamics.system.rigid_frame_kernel import (
    constraints_end,
    interface_end,
    ported,
    ports_end,
    rigid_frame_begin,
    rigid_frame_finish,
)


@compiled
def marched_linear(c, bodies, ends, of, driving, state, trial, work, history, solved):  # type: ignore[no-untyped-def]
    """Take T steps in place; as `step_kernel.marched`, all of them."""
    trial.z[:] = 0.0
    for t in range(len(driving.t)):
        copied(state.term_angles, trial.term_angles)
        for i in range(len(bodies.motion)):
            R, F = driving.R[t, bodies.motion[i]], driving.F[t]
            rigid_frame_begin(c, bodies, i, R, F, state, trial, work, solved)
        solved_at_once(c, bodies, ends, of, driving, t, state, trial, work)
        for i in range(len(bodies.motion)):
            rigid_frame_finish(c, bodies, i, driving.F[t], trial, state, history, t, work)
            ports_end(c, bodies, i, trial, state, history, t, work.room)
        constraints_end(c, ends, of, driving, t, state, trial, work, history)
        interface_end(c, driving, t, trial, state, history)
        trial.z[:] = 0.0
    state.passes[0] += len(driving.t)
    state.passes[2] = max(state.passes[2], 1)
    return len(driving.t), -1


@inner
def solved_at_once(c, bodies, ends, of, driving, t, state, trial, work):  # type: ignore[no-untyped-def]
    """Interface unknowns, and displacements and forces of all bodies at their interface points."""
    trial.right[:] = 0.0
    for m in range(len(trial.z)):
        trial.right[m] = c.alpha_f * state.bearing[m]
    gathered(bodies, trial)
    for i in range(len(bodies.motion)):
        offset(bodies, i, work.y, trial, False)
        pushed(bodies, i, trial)
    unmoved(ends, of, driving, t, trial, work)
    evaluated(c, ends, of, driving, t, state, trial, work, True)
    interface_solved(bodies, of, trial, True)
    for i in range(len(bodies.motion)):
        ported(bodies, i, trial)
    copied(trial.dz, trial.z)
