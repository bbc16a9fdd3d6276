"""Internal forces and gradients of coordinates in static balance, compiled by numba: those of a step, without rates."""

from kedfem.compiled import compiled
from kedfem.dynamics.beams_kernel import begun, counted
from kedfem.dynamics.system.bodies_kernel import internal_forces, orientation
from kedfem.dynamics.system.corotational_kernel import newmark
from kedfem.dynamics.system.ends_kernel import on_lines, placed
from kedfem.dynamics.system.interface_kernel import differentiated
from kedfem.dynamics.system.record import RIGID_BODY


@compiled
def static_forces(c, bodies, R, amounts, state, trial, work):  # type: ignore[no-untyped-def]
    """trial.f becomes the internal force of bodies with frames of their own at trial.u, trial.Rp their orientation.

    Parameters
    ----------
    c : with Newmark's numbers and damping zero
    R : (M, 3, 3) of the rigid-body motion; amounts : (w,) of follower loads
    state : in the reference position; turns of tangents become those at trial.u, but for what sections shear
    """
    counted(bodies.beams, trial.u, state.direction, state.turn)
    begun(newmark(c), bodies.beams, R, state.strain, state.direction, trial.base, trial.resisted)
    internal_forces(c, bodies, R, amounts, state, trial, work, True)
    for i in range(len(bodies.motion)):
        if bodies.frame[i] > RIGID_BODY:
            orientation(bodies, i, R, trial, trial.Rp[i])


@compiled
def static_gradients(ends, of, rigid_motion, p, stations, z, trial, work):  # type: ignore[no-untyped-def]
    """trial.C becomes the gradients of all coordinates on z: of those that are linear, and do not change, at z = 0.

    trial.e becomes their values there, trial.m their rates in the rigid-body motion.

    Parameters
    ----------
    trial : whose `term_angles` has angles of all terms to within half a turn
    rigid_motion, p : R (M, 3, 3), v and ω (M, 3), and origins (M, 3) of all bodies of the linkage
    stations : weights of ends on lines
    """
    on_lines(ends.knots, ends, stations)
    placed(ends, rigid_motion[0], p, trial.row, trial.fixed, work.end, work.vectors)
    placed(ends, rigid_motion[0], p, z, trial.moving, work.end, work.vectors)
    for a in range(len(of.law)):
        trial.e[a], trial.m[a] = differentiated(ends, of, a, rigid_motion, trial, work)
