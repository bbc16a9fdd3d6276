"""Animation frames of what joints and drives exert: points with vectors, which ParaView draws as arrows."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.joints.constraint_joints import ordered
from kedfem.motion.joint_equations import joint_axis
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.output.array_names import DRIVE_FORCE, DRIVE_TORQUE, FORCE, MOMENT
from kedfem.output.fields import JointField
from kedfem.results.recorded import drive_prefix
from kedfem.scene import Scene

Rows = Mapping[str, Float[np.ndarray, "T c"]]


def joint_field(scene: Scene, linked: Linkage, motion: RigidMotion, rows: Rows, k: int) -> JointField | None:
    """Joints whose forces are recorded, at one time point; None without any.

    Parameters
    ----------
    rows : of all channels over the times of the motion
    k : number of the time point
    """
    names = [name for name in scene.joints if f"joints/{name}/force" in rows]
    if not names:
        return None
    points = np.zeros((len(names), 3))
    force, moment, push, torque = np.zeros((4, len(names), 3))
    for n, name in enumerate(names):
        joint = scene.joints[name]
        i, j = (linked.bodies.index(link) for link in ordered(joint))
        points[n] = motion.p[k, i] + motion.R[k, i] @ joint.at
        force[n] = rows[f"joints/{name}/force"][k]
        moment[n] = rows.get(f"joints/{name}/moment", np.zeros((k + 1, 3)))[k]
        if name in scene.driven_joints:
            axis, prefix = motion.R[k, j] @ joint_axis(joint), drive_prefix(scene, name)
            for what, out in (("force", push), ("torque", torque)):
                if (found := rows.get(f"{prefix}{what}")) is not None:
                    out[n] = found[k] * axis
    vectors = {FORCE: force, MOMENT: moment}
    slides = {scene.joints[name].kind == "prismatic" for name in scene.driven_joints}
    vectors |= {DRIVE_FORCE: push} if True in slides else {}
    vectors |= {DRIVE_TORQUE: torque} if False in slides else {}
    return JointField(tuple(names), points, vectors)
