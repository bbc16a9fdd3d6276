"""Animation frames from elastic states: where nodes are drawn, and the stresses there."""

from collections.abc import Sequence

import numpy as np

from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.model import Model
from kedfem.links.record import in_space
from kedfem.links.recovery import StressRecovery, nodal_state, nodal_stress, von_mises
from kedfem.output.vtu import LinkField


def link_fields(
    model: Model, recoveries: Sequence[StressRecovery], snapshot: Snapshot, exaggeration: float
) -> list[LinkField]:
    """All links at one time point: R' = R + f, [KED, eqs. (2)(3)], f times the exaggeration.

    Parameters
    ----------
    recoveries : per link, then per carried link
    exaggeration : factor on the elastic displacement where nodes are drawn, not on the displacement itself [-]
    """
    motion, k = snapshot.motion, snapshot.k
    fields = []
    for link, body, recovery, state in zip(
        model.links, model.bodies, recoveries[: len(model.links)], snapshot.states, strict=True
    ):
        shown = link.full or link
        displacement = recovery.at_points(in_space(shown, nodal_state(link, state.u)))
        stress = nodal_stress(recovery, nodal_state(link, state.g))
        if link.rigid:
            stress = np.zeros_like(stress)
        drawn = recovery.at_points(shown.X)
        points = motion.p[k, body] + drawn @ motion.R[k, body].T + exaggeration * displacement
        fields.append(
            LinkField(
                link.name, recovery.cell_type, recovery.cells, points, displacement, stress, von_mises(stress)
            )
        )
    for carried, recovery in zip(model.carried, recoveries[len(model.links) :], strict=True):
        X = recovery.at_points((carried.link.full or carried.link).X)
        points = motion.p[k, carried.body] + X @ motion.R[k, carried.body].T
        none = np.zeros((len(X), 6))
        name, kind, cells = carried.link.name, recovery.cell_type, recovery.cells
        fields.append(LinkField(name, kind, cells, points, np.zeros_like(X), none, none[:, 0]))
    return fields
