"""Messages for linkages that cannot follow their drive, with the joint and the position of the drive."""

import numpy as np

from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import Target
from kedfem.motion.values import Poses, features, jacobian

NEAR_SINGULAR = 1e-3  # of the largest singular value: below, the linkage is at a dead point
IDLE = 1e-4  # of all reactions: below, the drive does not take part in a self-stress


def locking_message(link: Linkage, poses: Poses, tau: float, aim: Target) -> str:
    """The message for a linkage that cannot continue from poses at a place τ of its path.

    At a dead point the rows have a state of self-stress. If a drive takes part in it, the linkage locks; if not, it can
    continue, but the links may take another branch.
    """
    f = features(link.rows, poses, aim.near)
    left, s, _ = np.linalg.svd(jacobian(link.rows, f, len(link.bodies), link.size)[0])
    stress, driven = np.abs(left[:, len(s) - 1]), link.rows.drive >= 0
    own = np.array([name in link.drives.joints for name in link.joints])
    joint = link.joints[int(np.where(own, 0, stress).argmax())]
    at = f"at {position_in_words(link, tau)}"
    if s[-1] > NEAR_SINGULAR * s[0]:
        apart = "its redundant joints no longer fit together {} (is an axis askew, or one joint too many?)"
        got = apart.format(at) if link.redundant else f"it cannot be assembled any further {at}"
    elif stress[driven].max() > IDLE:
        got = f"it locks (dead point) {at}"
    else:
        got = f"a dead point {at}, where the linkage could go on in two ways"
    drives = ", ".join(f"joints.{name}" for name in dict.fromkeys(link.drives.joints))
    whose = joint if joint.startswith("gears.") else f"joints.{joint}"
    noun = "drive" if len(link.drives) == 1 else "drives"
    return f"{whose}: the linkage must follow its {noun} {drives} over the whole range, got: {got}"


def position_in_words(link: Linkage, tau: float, form: str = ".2f") -> str:
    """The position of a linkage on its path in words: the angle or travel of its drive; with several drives the time."""
    if len(link.drives) != 1:
        return f"t = {tau:.6g} s"
    if link.drives.turning[0]:
        return f"drive angle {np.degrees(tau):{form}} deg"
    return f"drive travel {1e3 * tau:.6g} mm"
