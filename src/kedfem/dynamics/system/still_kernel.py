"""Internal forces of bodies that do not move in their frames, compiled by numba: those of a step, without rates."""

from kedfem.compiled import compiled
from kedfem.dynamics.beams_kernel import begun
from kedfem.dynamics.system.bodies_kernel import internal_forces, newmark, orientation
from kedfem.dynamics.system.record import RIGID_BODY
from kedfem.dynamics.system.reference import reference


@compiled
def still_forces(c, bodies, R, amounts, state, trial, work):  # type: ignore[no-untyped-def]
    """trial.f becomes the internal force of bodies with frames of their own at trial.u, trial.Rp their orientation.

    Parameters
    ----------
    c : with Newmark's numbers and damping zero
    R : (M, 3, 3) of the rigid-body motion; amounts : (w,) of loads that turn with bodies
    state : in the reference position
    """
    c, bodies, state, trial, work = (
        reference(c),
        reference(bodies),
        reference(state),
        reference(trial),
        reference(work),
    )
    if len(bodies.beams.segment):
        begun(newmark(c), bodies.beams, R, state.strain, state.direction, trial.base, trial.resisted)
    internal_forces(c, bodies, R, amounts, state, trial, work, True)
    for i in range(len(bodies.motion)):
        if bodies.frame[i] > RIGID_BODY:
            orientation(bodies, i, R, trial.u, trial, trial.Rp[i])
