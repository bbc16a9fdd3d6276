"""The solver of a scene: which one takes its steps, and how many time points form a block."""

from collections.abc import Sequence

from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import POINTS, drive_range
from kedfem.dynamics.rigid_elements import rigid_elements
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stiffening import Stiffening, stiffening
from kedfem.dynamics.system.steps import Steps, scene_system
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import Scene, corotational, time_grid

BLOCK_BYTES = 64_000_000
CONVERGED = 1e-7  # change of a iteration, of the largest that a step has made
FREE = 1e-9  # the same for free motions as a whole, in which residuals of steps add up


def steps_of(scene: Scene, model: Model) -> Steps:
    """The solver that the scene asks for, its matrices factored.

    Raises
    ------
    SolveError
        If an effective matrix is not positive definite.
    MeshError
        If a force element finds no coupling surface on its link that determines its rotation.
    """
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    tolerance = (FREE if scene.driven is None else CONVERGED) if corotational(scene) else None
    monolithic = scene.analysis.solver == "monolithic"
    return Steps(scene, scene_system(scene, model, stresses_of(scene, model)), model, scheme, tolerance, monolithic)


def stresses_of(scene: Scene, model: Model) -> Stiffening | None:
    """Stress modes of a model's links, if the scene asks for geometric stiffening."""
    if not scene.analysis.stiffening:
        return None
    if not (scene.springs or scene.motors):
        return stiffening(model)
    rigid = linkage(scene)
    return stiffening(model, rigid_elements(scene, rigid, path(rigid, *drive_range(scene)), model))


def eased_warning(solvers: Sequence[Steps]) -> tuple[str, ...]:
    """Warnings where iterations of steps were taken as converged at an eased tolerance, or steps were divided."""
    eased, try_smaller = sum(each.eased for each in solvers), "take a smaller step to see whether results change"
    out = []
    if eased:
        out.append(
            f"the iterations of {eased} steps converged to a hundred times the tolerance only (stiff springs, or ends "
            f"and corners of beams in space): {try_smaller}"
        )
    if any(each.ready.halves for each in solvers):
        message = (
            "the iterations of some steps did not converge, so that these steps were divided, which excites vibration"
        )
        out.append(f"{message}: {try_smaller}")
    return tuple(out)


def unstable_balance(solvers: Sequence[Steps]) -> str:
    """Why the balance in some positions is unstable; empty if it is stable in those that were examined."""
    found = [each for solver in solvers for each in solver.unstable]
    if not found:
        return ""
    more = f" and {len(found) - 1} more of the positions examined" * (len(found) > 1)
    return (
        f"the balance of forces is unstable at {found[0]}{more}: any disturbance moves the link away, as a column "
        "beyond its buckling load or a mast that stands on its tip"
    )


def unstable_balance_warning(solvers: Sequence[Steps]) -> tuple[str, ...]:
    """A warning about that."""
    why = unstable_balance(solvers)
    return (f"{why}; take smaller loads, stiffer links or springs, or kind = 'transient' with damping",) if why else ()


def block_length(model: Model) -> int:
    """Time points whose states are kept together: as many as take BLOCK_BYTES, at most POINTS."""
    return max(1, min(POINTS, BLOCK_BYTES // (9 * 8 * model.unknowns)))
