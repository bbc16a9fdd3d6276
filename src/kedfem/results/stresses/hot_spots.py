"""The highest stresses of each link at places apart, from the envelope."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from kedfem.links.recovery import StressRecovery
from kedfem.results.records import Peak
from kedfem.results.stresses.envelope import VON_MISES, LinkEnvelope
from kedfem.results.stresses.peaks import peak_at

APART = 0.02  # of the link's size: nearer points belong to the same place, as neighbours in a fine mesh do
MOST = 10


def hot_spots(
    found: Sequence[LinkEnvelope], when: Float[np.ndarray, "2 T"], near: Sequence[Sequence[str]],
    most: int = MOST,
) -> dict[str, list[Peak]]:  # fmt: skip
    """The highest von Mises stresses of each link that has stress, falling, each at some distance from those before.

    Parameters
    ----------
    found : per link or segment
    when : time and drive at every step
    near : per link or segment what each point is near to, in words; empty where stress is what it seems
    most : how many of each link

    Returns
    -------
    Link → its peaks; the first is the link's highest.
    """
    names = dict.fromkeys(each.link for each in found if not np.isnan(each.stress).all())
    return {
        name: _of([(e, w) for e, w in zip(found, near, strict=True) if e.link == name], when, most)
        for name in names
    }


def _of(
    parts: list[tuple[LinkEnvelope, Sequence[str]]], when: Float[np.ndarray, "2 T"], most: int
) -> list[Peak]:
    """Of one link, in segments or not."""
    points = np.concatenate([drawn_points(each.recovery) for each, _ in parts])
    stress = np.concatenate([each.stress[VON_MISES] for each, _ in parts])
    ends = np.cumsum([each.stress.shape[1] for each, _ in parts])
    out: list[Peak] = []
    for k in places_apart(points, stress, most):
        part = int(np.searchsorted(ends, k, side="right"))
        each, words = parts[part]
        node = k - int(ends[part]) + each.stress.shape[1]
        out.append(peak_at(each, when, node, words))
    return out


def places_apart(points: Float[np.ndarray, "p 3"], values: Float[np.ndarray, " p"], most: int) -> list[int]:
    """Numbers of the points with the highest values, falling, at some distance from those before; nan do not count."""
    left, found = np.isfinite(values), list[int]()
    apart = APART * float(np.linalg.norm(np.ptp(points, axis=0)))
    while left.any() and len(found) < most:
        k = int(np.where(left, values, -1.0).argmax())
        found.append(k)
        left &= np.linalg.norm(points - points[k], axis=1) > apart
    return found


def drawn_points(recovery: StressRecovery) -> Float[np.ndarray, "p 3"]:
    """Where the points of a link are, in the reference position [m]."""
    return np.asarray(recovery.at_points((recovery.link.full or recovery.link).X))
