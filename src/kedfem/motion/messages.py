"""Why a linkage cannot follow its drive: the joint and the drive angle, in words."""

import numpy as np

from kedfem.motion.linkage import Linkage, scaled
from kedfem.motion.rows import Poses, features, jacobian

NEAR_SINGULAR = 1e-3  # of the largest singular value: what stops the linkage is a dead point


def stopped(link: Linkage, poses: Poses, phi: float) -> str:
    """The message for a linkage that cannot go on from poses at a drive angle [rad]."""
    tension, weakness = _reaction(link, poses, phi)
    at = f"at drive angle {np.degrees(phi):.2f} deg"
    if weakness < NEAR_SINGULAR:
        return _message(link, tension, f"it locks (dead point) {at}")
    if link.redundant:
        return _message(
            link, tension, f"its redundant joints no longer fit together {at} (is an axis askew?)"
        )
    return _message(link, tension, f"it cannot be assembled any further {at}")


def undecided(link: Linkage, poses: Poses, phi: float) -> str:
    """The message for a linkage that passes a position in which its motion is not determined."""
    tension, _ = _reaction(link, poses, phi)
    where = f"drive angle {np.degrees(phi):.2f} deg"
    return _message(link, tension, f"a dead point at {where}, where the linkage could go on in two ways")


def _message(link: Linkage, tension: np.ndarray, got: str) -> str:
    joint = link.joints[int(tension.argmax())]
    return f"joints.{joint}: the linkage must follow its drive joints.{link.drive} over the whole range, got: {got}"


def _reaction(link: Linkage, poses: Poses, phi: float) -> tuple[np.ndarray, float]:
    """How much each row resists the motion that is lost, and the smallest singular value relative to the largest."""
    f = features(link.rows, poses, np.array([phi]))
    left, s, _ = np.linalg.svd(scaled(jacobian(link.rows, f, len(link.bodies))[0], link.rows, link.size))
    tension = np.abs(left[:, len(s) - 1]) * np.array([name != link.drive for name in link.joints])
    return tension, float(s[-1] / s[0])
