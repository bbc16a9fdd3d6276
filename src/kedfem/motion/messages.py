"""Why a linkage cannot follow its drive: the joint and the drive angle, in words."""

import numpy as np

from kedfem.motion.linkage import Linkage, scaled
from kedfem.motion.rows import Poses, features, jacobian

NEAR_SINGULAR = 1e-3  # of the largest singular value: what stops the linkage is a dead point
IDLE = 1e-4  # of all reactions: the drive's own where its angle does not matter


def stopped(link: Linkage, poses: Poses, phi: float) -> str:
    """The message for a linkage that cannot go on from poses at a drive angle [rad].

    At a dead point the rows bear a state of self-stress. If the drive takes part in it, the drive works against the
    links and the linkage locks; if not, it can turn on, but the links may take another branch.
    """
    f = features(link.rows, poses, np.array([phi]))
    left, s, _ = np.linalg.svd(scaled(jacobian(link.rows, f, len(link.bodies))[0], link.rows, link.size))
    stress, driven = np.abs(left[:, len(s) - 1]), np.array([name == link.drive for name in link.joints])
    joint = link.joints[int(np.where(driven, 0, stress).argmax())]
    at = f"at drive angle {np.degrees(phi):.2f} deg"
    if s[-1] > NEAR_SINGULAR * s[0]:
        apart = "its redundant joints no longer fit together {} (is an axis askew, or one joint too many?)"
        got = apart.format(at) if link.redundant else f"it cannot be assembled any further {at}"
    elif stress[link.rows.driven].max() > IDLE:
        got = f"it locks (dead point) {at}"
    else:
        got = f"a dead point {at}, where the linkage could go on in two ways"
    return f"joints.{joint}: the linkage must follow its drive joints.{link.drive} over the whole range, got: {got}"
