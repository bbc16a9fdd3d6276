"""Stress histories for damage at points of a surface: signed von Mises stress, or normal stress on several planes.

H (k, 6, T) : stress of points over a period as `links.recovery.stress_modes` has it: five deviatoric components, whose
    norm is the von Mises stress, and the mean
axes (k, 3, 3) : two tangents and the normal of the surface, as rows
"""

import numpy as np

from kedfem.arrays import Float

STEP = 5.0  # degrees between planes: a quarter of a percent of a normal stress at most, half of one of a shear stress
DIRECTIONS = 12  # of shear on a plane, over half a revolution: 0.9 % at most
FEW = 120  # instants of a period by which the direction of shear is chosen
# of the most sheared plane, and of the normal stress: planes whose shear is more than rounding
SHEARED, SOME = 0.05, 1e-3
NEITHER = 0.05  # share of the mean stress below which tension is not distinguished from compression


def _to_tensor() -> Float[np.ndarray, "6 6"]:
    """xx, yy, zz, xy, yz, zx from the components of H."""
    root = np.sqrt(3.0)
    out = np.zeros((6, 6))
    out[:3, 5] = 1.0
    out[:2, 0] = [1 / root, -1 / root]
    out[:3, 1] = [-1 / 3, -1 / 3, 2 / 3]
    out[3, 2], out[4, 3], out[5, 4] = 1 / root, 1 / root, 1 / root
    return out


TENSOR = _to_tensor()


def dominant(moments: Float[np.ndarray, "k 6 6"], mean: Float[np.ndarray, "k 6"]) -> Float[np.ndarray, "k 6"]:
    """The state to which the stresses of a point are in proportion, as far as they are: a unit vector, tension positive.

    Parameters
    ----------
    moments, mean : of H over time, second and first
    """
    d = np.linalg.eigh(moments)[1][:, :, -1]
    along = (d * mean).sum(axis=1)
    sign = np.where(np.abs(d[:, 5]) > NEITHER, d[:, 5], along)
    return np.asarray(d * np.where(sign < 0, -1.0, 1.0)[:, None])


def disproportion(H: Float[np.ndarray, "k 6 T"], d: Float[np.ndarray, "k 6"]) -> Float[np.ndarray, " k"]:
    """Residual of the stresses without their part along d, its maximum over time relative to the highest stress."""
    size = np.einsum("kqt,kqt->kt", H, H)
    c = np.matmul(d[:, None], H)[:, 0]
    left = np.maximum(size - c**2, 0.0).max(axis=1)
    return np.asarray(np.sqrt(left / np.maximum(size.max(axis=1), 1e-300)))


def signed_von_mises(H: Float[np.ndarray, "k 6 T"], d: Float[np.ndarray, "k 6"]) -> Float[np.ndarray, "k T"]:
    """Von Mises stress with the sign of the part of the stress along d [Pa]."""
    size = np.sqrt(np.einsum("kqt,kqt->kt", H[:, :5], H[:, :5]))
    return np.asarray(np.where(np.matmul(d[:, None], H)[:, 0] < 0, -size, size))


def normal_stresses(H: Float[np.ndarray, "k 6 T"], axes: Float[np.ndarray, "k 3 3"]) -> Float[np.ndarray, "k P T"]:
    """Normal stress on planes at right angles to the surface [Pa]."""
    angle = np.radians(np.arange(0.0, 180.0, STEP))
    n = _normals(axes, angle, np.pi / 2)
    return np.asarray(np.matmul(_rows(n, n), H))


def findley_stresses(
    H: Float[np.ndarray, "k 6 T"], axes: Float[np.ndarray, "k 3 3"], factor: float
) -> Float[np.ndarray, "k P T"]:
    """Findley's parameter as an amplitude of tension [Pa]: shear on planes, raised by the largest normal stress.

    Planes are at right angles to the surface, and inclined as those are that tension across the surface shears most. On
    each the direction with the largest range of shear counts: τ (1 + k σ_max / τ_a) 2 / (√(1 + k²) + k), so that the
    largest cycle has Findley's amplitude, smaller ones their share of it, and alternating tension its own.
    """
    angle = np.radians(np.arange(0.0, 180.0, STEP))
    inclined = np.pi / 2 - 0.5 * np.arctan2(1.0, factor)
    few = np.ascontiguousarray(H[:, :, :: max(1, H.shape[2] // FEW)])
    rows, shear = zip(*(_sheared(few, axes, angle, tilt) for tilt in (np.pi / 2, inclined)), strict=True)
    normal = np.matmul(np.concatenate(rows, axis=1), H).max(axis=2)
    h = np.matmul(np.concatenate(shear, axis=1), H)
    amplitude = (h.max(axis=2) - h.min(axis=2)) / 2
    sheared = amplitude > SHEARED * amplitude.max(axis=1, keepdims=True)
    sheared &= amplitude > SOME * np.abs(normal)
    raised = np.maximum(1 + factor * normal / np.where(sheared, amplitude, 1.0), 0.0)
    h *= (2 / (np.sqrt(1 + factor**2) + factor) * np.where(sheared, raised, 0.0))[:, :, None]
    return np.asarray(h)


def _sheared(
    few: Float[np.ndarray, "k 6 F"], axes: Float[np.ndarray, "k 3 3"], angle: Float[np.ndarray, " P"], tilt: float
) -> tuple[Float[np.ndarray, "k P 6"], Float[np.ndarray, "k P 6"]]:
    """Rows by which normal stress on planes, and shear in the direction of its largest range, follow from H.

    few : H at some instants, by which the direction is chosen
    """
    n = _normals(axes, angle, tilt)
    level = _normals(axes, angle + np.pi / 2, np.pi / 2)
    both = np.stack([_rows(n, level), _rows(n, np.cross(n, level))])
    a, b = np.matmul(both, few)
    turns = np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    along = (np.cos(turn) * a + np.sin(turn) * b for turn in turns)
    spans = np.stack([x.max(axis=2) - x.min(axis=2) for x in along])
    turn = turns[spans.argmax(axis=0)][:, :, None]
    return _rows(n, n), np.cos(turn) * both[0] + np.sin(turn) * both[1]


def _normals(axes: Float[np.ndarray, "k 3 3"], angle: Float[np.ndarray, " P"], tilt: float) -> Float[np.ndarray, "k P 3"]:
    """Unit normals of planes by the angle of their trace in the surface and from the surface's normal."""
    of = np.stack([np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle)], axis=1)
    return np.asarray(np.einsum("pa,kac->kpc", of, axes[:, :2]) + np.cos(tilt) * axes[:, None, 2])


def _rows(m: Float[np.ndarray, "k P 3"], n: Float[np.ndarray, "k P 3"]) -> Float[np.ndarray, "k P 6"]:
    """Rows by which m · σ n follows from the components of H."""
    first, second = m[..., [0, 1, 2, 0, 1, 2]], n[..., [0, 1, 2, 1, 2, 0]]
    other = m[..., [0, 1, 2, 1, 2, 0]] * n[..., [0, 1, 2, 0, 1, 2]]
    products = np.where(np.arange(6) < 3, first * second, first * second + other)
    return np.asarray(products @ TENSOR)
