"""The solver of a scene: which one marches its steps, and how many time points it keeps together."""

from collections.abc import Sequence

from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_body import POINTS, drive_range
from kedfem.dynamics.rigid_elements import rigid_elements_of
from kedfem.dynamics.segment import CONVERGED, FREE
from kedfem.dynamics.stepping.monolithic import MonolithicSteps
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stiffening import Stiffening, stiffening
from kedfem.dynamics.system.corotational import CorotationalSteps
from kedfem.dynamics.system.steps import SystemSteps, rigid_frame_system
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import Scene, corotational, time_grid

BLOCK_BYTES = 64_000_000

ByLink = MonolithicSteps | SystemSteps
Steps = ByLink | CorotationalSteps


def steps_of(scene: Scene, model: Model) -> Steps:
    """The solver that the scene asks for, its matrices factored.

    Raises
    ------
    SolveError
        If an effective matrix is not positive definite.
    MeshError
        If a force element finds no coupling surface on its link that shows how it turns.
    """
    scheme = generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf)
    if corotational(scene):
        return CorotationalSteps(scene, model, scheme, FREE if scene.driven is None else CONVERGED)
    monolithic = scene.analysis.solver == "monolithic"
    stresses = _stresses(scene, model) if scene.analysis.stiffening else None
    elements = scene.springs or scene.motors or scene.limits
    if elements or scene.analysis.initial_deflection or dampers_count(model) or not monolithic:
        return SystemSteps(scene, rigid_frame_system(scene, model, stresses), model, scheme, monolithic)
    return MonolithicSteps(model.links, model.joints, scheme, model.damping, stresses)


def _stresses(scene: Scene, model: Model) -> Stiffening:
    if not (scene.springs or scene.motors):
        return stiffening(model)
    return stiffening(model, rigid_elements_of(scene, model, path(linkage(scene), *drive_range(scene))))


def dampers_count(model: Model) -> bool:
    """Whether quasi-static starts feel dampers of bushings, which starts in nodal rows do not."""
    return any(row.damping.any() for row in model.rows)


def eased_warning(solvers: Sequence[Steps]) -> tuple[str, ...]:
    """A warning where iterations of steps were taken as converged at an eased tolerance."""
    eased = sum(each.eased for each in solvers if isinstance(each, CorotationalSteps))
    if not eased:
        return ()
    return (
        f"the iterations of {eased} steps with co-rotational frames converged to a hundred times the tolerance only "
        "(stiff springs or hubs): take a smaller step to see whether results change",
    )


def block_length(model: Model) -> int:
    """Time points whose states are kept together: as many as take BLOCK_BYTES, at most POINTS."""
    return max(1, min(POINTS, BLOCK_BYTES // (9 * 8 * model.unknowns)))
