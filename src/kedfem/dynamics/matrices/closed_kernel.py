"""Static forces at the interface points of a linkage with closed joints, at many times; compiled by numba."""

from kedfem.compiled import compiled
from kedfem.dynamics.system.algebra_kernel import copied, frame_copied
from kedfem.dynamics.system.interface_kernel import gathered, interface_solved, pushed
from kedfem.dynamics.system.rigid_frame_kernel import ported


@compiled
def closed_over(bodies, of, trial, R, C, compliance, v, out):  # type: ignore[no-untyped-def]
    """Forces at interface points (T, q) from what these do where they are free, v (T, q); not finite where links are.

    Parameters
    ----------
    R : (T, bodies, 3, 3), link to world
    C, compliance : (T, n) gradients of constraints and springs, (r,) 1/κ
    """
    for t in range(len(v)):
        for i in range(len(bodies.motion)):
            frame_copied(R[t, i], trial.Rp[i])
        gathered(bodies, trial)
        for q in range(len(trial.w)):
            trial.w[q], trial.reaction[q] = -v[t, q], 0.0
        trial.right[:], trial.target[:], trial.m[:] = 0.0, 0.0, 0.0
        for i in range(len(bodies.motion)):
            pushed(bodies, i, trial)
        copied(C[t], trial.C)
        copied(compliance, trial.compliance)
        interface_solved(bodies, of, trial, True)
        for i in range(len(bodies.motion)):
            ported(bodies, i, trial)
        copied(trial.force, out[t])
