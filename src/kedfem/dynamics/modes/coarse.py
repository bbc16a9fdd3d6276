"""A coarse model with a few modes for each large link, for preconditioning only."""

import numpy as np

from kedfem.dynamics.matrices.dense import SMALL
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.bases import reduced_at
from kedfem.dynamics.rigid_elements import acting
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene, path_parameter, time_grid

INSTANTS = 16  # of the run, at which the linkage is examined
LEFT_OUT = 1e-4  # of the energy norm of its deflections there


def coarse_model(scene: Scene, linkage: Linkage, along: Path, model: Model) -> Model | None:
    """The model with its large links reduced; None if it has none, or has free motions with its drives fixed."""
    large = {link.name for link in model.links if link.unknowns > SMALL and link.full is None}
    if not large or linkage.mobility:
        return None
    t = time_grid(scene).end * (np.arange(INSTANTS) + 0.5) / INSTANTS
    motion = rigid_motion(linkage, along, t, path_parameter(scene, t))
    return reduced_at(model, motion, large, lambda _, basis: basis.count(LEFT_OUT), acting(scene, linkage, along, model))
