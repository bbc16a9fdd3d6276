"""The highest stresses of a run and of its links, from their envelopes: the highest, and others at distant places."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.links.recovery import StressRecovery
from kedfem.results.records import Peak
from kedfem.results.stresses.envelope import VON_MISES, LinkEnvelope

APART = 0.02  # of the link's size: nearer points belong to the same place, as neighbours in a fine mesh do
MOST = 10  # places of each link


def peaks(
    found: Sequence[LinkEnvelope], near: Sequence[Sequence[str]], strengths: Mapping[str, float]
) -> dict[str, Peak]:
    """The highest von Mises stress of each link that has stress, and the highest away from singular places.

    Parameters
    ----------
    found : per link or segment
    near : per link or segment the singular place near each point, in words; empty where there is none
    strengths : link → yield strength of its material [Pa], where known
    """
    out, away = dict[str, Peak](), dict[str, Peak]()
    for each, words in zip(found, near, strict=True):
        stress = each.stress[VON_MISES]
        if np.isnan(each.stress).all():
            continue
        for of, among in ((out, np.ones(len(stress), bool)), (away, np.array([not word for word in words]))):
            if among.any():
                peak = peak_at(each, int(np.where(among, stress, -1.0).argmax()), words)
                peak = replace(peak, strength=strengths.get(each.link, np.inf))
                of[each.link] = max(of.get(each.link, peak), peak, key=lambda x: x.stress)
    return {name: replace(peak, away=away.get(name)) if peak.near else peak for name, peak in out.items()}


def highest(every: Mapping[str, Peak]) -> Peak | None:
    """The highest stresses of all links, with that of all links away from singular places."""
    if not every:
        return None
    peak = max(every.values(), key=lambda x: x.stress)
    sound = [x for each in every.values() if (x := each.sound) is not None]
    return replace(peak, away=max(sound, key=lambda x: x.stress, default=None)) if peak.near else peak


def peak_at(each: LinkEnvelope, node: int, words: Sequence[str]) -> Peak:
    """The highest von Mises stress of one point of a link, and when it is."""
    step = int(each.step[VON_MISES, node])
    place = reference_points(each.recovery)[node]
    time, angle = each.when[:, VON_MISES, node]
    return Peak(
        float(each.stress[VON_MISES, node]), each.link, (float(place[0]), float(place[1]), float(place[2])),
        node, step, float(time), float(angle), words[node],
    )  # fmt: skip


def hot_spots(found: Sequence[LinkEnvelope], near: Sequence[Sequence[str]]) -> dict[str, list[Peak]]:
    """The highest von Mises stresses of each link with stress, in falling order, at a distance from each other.

    Parameters
    ----------
    found, near : as in :func:`peaks`
    """
    names = dict.fromkeys(each.link for each in found if not np.isnan(each.stress).all())
    return {name: _of([(e, w) for e, w in zip(found, near, strict=True) if e.link == name]) for name in names}


def _of(parts: list[tuple[LinkEnvelope, Sequence[str]]]) -> list[Peak]:
    """Highest stresses of one link, of all its segments together."""
    points = np.concatenate([reference_points(each.recovery) for each, _ in parts])
    stress = np.concatenate([each.stress[VON_MISES] for each, _ in parts])
    sizes = [each.stress.shape[1] for each, _ in parts]
    found = (part_and_number(sizes, k) for k in separated_points(points, stress, MOST))
    return [peak_at(parts[part][0], node, parts[part][1]) for part, node in found]


def part_and_number(sizes: Sequence[int], k: int) -> tuple[int, int]:
    """In which of several parts, one after the other, number k of all is, and its number there."""
    ends = np.cumsum(sizes)
    part = int(np.searchsorted(ends, k, side="right"))
    return part, k - int(ends[part]) + sizes[part]


def separated_points(points: Float[np.ndarray, "p 3"], values: Float[np.ndarray, " p"], most: int) -> list[int]:
    """Numbers of the points with the highest values, falling, at some distance from those before; nan do not count."""
    left, found = np.isfinite(values), list[int]()
    apart = APART * float(np.linalg.norm(np.ptp(points, axis=0)))
    while left.any() and len(found) < most:
        k = int(np.where(left, values, -1.0).argmax())
        found.append(k)
        left &= np.linalg.norm(points - points[k], axis=1) > apart
    return found


def reference_points(recovery: StressRecovery) -> Float[np.ndarray, "p 3"]:
    """Where the points of a link are, in the reference position [m]."""
    return np.asarray(recovery.at_points((recovery.link.full or recovery.link).X))
