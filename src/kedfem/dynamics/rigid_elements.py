"""Forces of motors, springs and limits were all links rigid, at any times of the motion.

Their coordinates depend on the times before in one thing only: rotations of hinges are counted on beyond ±π. How often a
hinge has turned is known along the path of the linkage, so that any part of the motion can be asked for by itself.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.force_element import POINT, TURN, End, ForceElement, coordinate, effort, placed, unit_forces, wrench
from kedfem.dynamics.force_elements import force_elements
from kedfem.dynamics.model import Model
from kedfem.links.record import Link
from kedfem.motion.path import Path, place_on
from kedfem.motion.rigid import RigidMotion, resting
from kedfem.scene import Scene

Forces = Float[np.ndarray, "T A 2 2 3"]


@dataclass(frozen=True, slots=True)
class RigidElements:
    """Force elements whose ends move as the rigid-body motion has them.

    along : path of that motion
    turned : (G, A) rotations of hinges at its grid points, counted on from the reference position [rad]; zero of others
    """

    every: Sequence[ForceElement]
    along: Path
    turned: Float[np.ndarray, "G A"]

    def over(self, motion: RigidMotion) -> tuple[Forces, Forces]:
        """Vectors of all ends at the times of a motion, and the forces on them.

        Parameters
        ----------
        motion : between successive times no hinge turns by π
        """
        x, forces = np.zeros((2, len(motion.t), len(self.every), 2, 2, 3))
        for i, (element, before) in enumerate(zip(self.every, self._turned(motion), strict=True)):
            x[:, i], v = placed(element, motion)
            unit = unit_forces(element, x[:, i])
            rate = (unit * v).sum(axis=(1, 2, 3))
            Q = effort(element.law, motion, coordinate(element, x[:, i], float(before)), rate)
            forces[:, i] = Q[:, None, None, None] * unit
        return x, forces

    def wrenches(self, motion: RigidMotion) -> Iterator[tuple[End, Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]]:
        """Force and moment about the world's origin (T, 3) of every end."""
        x, forces = self.over(motion)
        for i, e, end in self.ends():
            yield end, *wrench(end, x[:, i, e], forces[:, i, e])

    def ends(self, k: int | None = None) -> Iterator[tuple[int, int, End]]:
        """Numbers of element and end, and the end: all, or those on a link of the model."""
        for i, element in enumerate(self.every):
            for e, end in enumerate(element.ends):
                if k is None or end.k == k:
                    yield i, e, end

    def _turned(self, motion: RigidMotion) -> Float[np.ndarray, " A"]:
        """Rotations near the first of these times."""
        tau = (motion.t if motion.drives.shape[1] > 1 else motion.phi)[:1]
        k, s, periods = place_on(self.along, tau)
        near = np.minimum(k + (s > 0.5), len(self.turned) - 1)
        return np.asarray((self.turned[near] + periods * (self.turned[-1] - self.turned[0]))[0])


def on_rigid_motion(every: Sequence[ForceElement], along: Path) -> RigidElements:
    """Force elements on the rigid-body motion along a path."""
    start = int(np.abs(along.phi).argmin())
    turned = np.zeros((len(along.phi), len(every)))
    for order in (np.arange(start, len(along.phi)), np.arange(start, -1, -1)):
        here = replace(resting(along.R.shape[1], np.zeros(len(order))), R=along.R[order])
        for i, element in enumerate(every):
            if element.kind == TURN:
                turned[order, i] = coordinate(element, placed(element, here)[0])
    return RigidElements(every, along, turned)


def rigid_elements_of(scene: Scene, model: Model, along: Path) -> RigidElements | None:
    """The motors and springs of a scene on a model's links, without their deflection; None if there are none.

    Not its limits: how hard stops are met depends on what gives, and where stiff ones are it is nothing like this.

    Raises
    ------
    MeshError, SceneError
        If a point or joint is not on its link.
    """
    every = force_elements(scene.model_copy(update={"limits": {}}), model)
    return on_rigid_motion(every, along) if every else None


def with_elements(
    k: int, F: Float[np.ndarray, "T n d"], elements: RigidElements, forces: Forces
) -> Float[np.ndarray, "T n d"]:
    """Loads on a link of a model with those of force elements, world components.

    Parameters
    ----------
    k : its number
    forces : on all ends
    """
    for i, e, end in elements.ends(k):
        F = F + _nodal(end, F.shape[2], forces[:, i, e])
    return F


def unit_loads_on(k: int, link: Link, elements: RigidElements) -> list[Float[np.ndarray, "n d"]]:
    """Nodal forces, link frame, that the forces of elements on a link are combinations of at all times.

    Torques have the same directions on a link at all times, forces at points may have any.
    """
    out, space = [], 2 if link.planar else 3
    still = resting(1 + max((end.body for _, _, end in elements.ends()), default=0), np.zeros(1))
    for i, e, end in elements.ends(k):
        if end.form == POINT:
            units = np.zeros((space, 2, 3))
            units[np.arange(space), 0, np.arange(space)] = 1.0
        else:
            units = unit_forces(elements.every[i], placed(elements.every[i], still)[0])[:, e]
        out += list(_nodal(end, link.d, units))
    return out


def _nodal(end: End, d: int, f: Float[np.ndarray, "T 2 3"]) -> Float[np.ndarray, "T n d"]:
    """What forces on an end's vectors are at the nodes of its link."""
    on_rows = (f * end.mask)[:, : len(end.weights), :d]
    return np.asarray(end.weights.T @ on_rows)
