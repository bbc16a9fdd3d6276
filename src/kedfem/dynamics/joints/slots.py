"""How far the pins of slots go along their lines, from the linkage's path."""

import numpy as np

from kedfem.dynamics.joints.constraint_joints import ordered
from kedfem.dynamics.joints.constraint_matrices import seen_from
from kedfem.motion.joint_equations import joint_axis
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import Scene

FINER = 8  # looks between two points of the path


def slot_travels(scene: Scene, linkage: Linkage, along: Path | None = None) -> dict[str, tuple[float, float]]:
    """Least and greatest place of each slot's pin along its line, from where it is drawn [m]; that alone without a drive.

    Parameters
    ----------
    along : path over the drive's range, needed with slots and a drive
    """
    slots = {name: joint for name, joint in scene.joints.items() if joint.kind == "slot"}
    if not slots:
        return {}
    if not linkage.drives:
        return dict.fromkeys(slots, (0.0, 0.0))
    if along is None:
        raise ValueError("the path of a linkage with slots must be given, got none")
    angles = np.linspace(along.phi[0], along.phi[-1], FINER * len(along.phi))
    still = np.zeros_like(angles)
    motion = rigid_motion(linkage, along, angles, (angles, still, still))
    out = {}
    for name, joint in slots.items():
        bodies = [linkage.bodies.index(link) for link in ordered(joint)]
        s = seen_from(motion, (bodies[0], bodies[1]), np.asarray(joint.at)) @ joint_axis(joint)
        out[name] = (float(s.min()), float(s.max()))
    return out
