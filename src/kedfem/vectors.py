"""Products of vectors, for whole stacks of them."""

import numpy as np

from kedfem.arrays import Float


def cross(a: Float[np.ndarray, "... 3"], b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """a × b, several times as fast as numpy's own on stacks of vectors."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.subtract(a[..., i] * b[..., j], a[..., j] * b[..., i], out=out[..., k])
    return out


def nearest_rotations(A: Float[np.ndarray, "... d d"], planar: bool = False) -> Float[np.ndarray, "... d d"]:
    """Q of the polar decomposition A = Q U, U symmetric, also of matrices of rank two; planar: rotations about z."""
    if planar:
        angle = np.arctan2(A[..., 1, 0] - A[..., 0, 1], A[..., 0, 0] + A[..., 1, 1])
        Q = np.zeros(A.shape) + np.eye(A.shape[-1])
        Q[..., 0, 0], Q[..., 1, 0] = np.cos(angle), np.sin(angle)
        Q[..., 0, 1], Q[..., 1, 1] = -Q[..., 1, 0], Q[..., 0, 0]
        return Q
    left, _, right = np.linalg.svd(A)
    left[..., 2] *= np.sign(np.linalg.det(left @ right))[..., None]
    return np.asarray(left @ right)
