"""The highest stresses of a run and of its links, from their envelopes."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from kedfem.results.records import Peak
from kedfem.results.stresses.envelope import VON_MISES, LinkEnvelope


def peaks(
    found: Sequence[LinkEnvelope], when: Float[np.ndarray, "2 T"],
    near: Sequence[Sequence[str]] | None = None,
) -> dict[str, Peak]:  # fmt: skip
    """The highest von Mises stress of each link that has stress, and away from places where it means little.

    Parameters
    ----------
    found : per link or segment
    when : time and drive at every step
    near : per link or segment what each point is near to, in words; empty where stress is what it seems
    """
    out: dict[str, Peak] = {}
    away: dict[str, Peak] = {}
    for k, each in enumerate(found):
        if not each.stress.shape[1] or np.isnan(each.stress).all():
            continue
        words = None if near is None else near[k]
        peak = _peak(each, when, np.ones(each.stress.shape[1], bool), words)
        out[each.link] = max(out.get(each.link, peak), peak, key=lambda x: x.stress)
        sound = np.array([not word for word in words]) if words is not None else np.ones(1, bool)
        if words is not None and sound.any():
            peak = _peak(each, when, sound, words)
            away[each.link] = max(away.get(each.link, peak), peak, key=lambda x: x.stress)
    return {name: replace(peak, away=away.get(name)) if peak.near else peak for name, peak in out.items()}


def highest(every: Mapping[str, Peak]) -> Peak | None:
    """Of all links; away from doubtful places that of all links, too."""
    if not every:
        return None
    peak = max(every.values(), key=lambda x: x.stress)
    sound = [x for each in every.values() if (x := each.away if each.near else each) is not None]
    return replace(peak, away=max(sound, key=lambda x: x.stress, default=None)) if peak.near else peak


def _peak(
    each: LinkEnvelope, when: Float[np.ndarray, "2 T"], among: np.ndarray, words: Sequence[str] | None
) -> Peak:
    return peak_at(each, when, int(np.where(among, each.stress[VON_MISES], -1.0).argmax()), words)


def peak_at(
    each: LinkEnvelope, when: Float[np.ndarray, "2 T"], node: int, words: Sequence[str] | None
) -> Peak:
    """The highest von Mises stress of one point of a link, and when it is."""
    step = int(each.step[VON_MISES, node])
    link = each.recovery.link
    place = each.recovery.at_points((link.full or link).X)[node]
    time, angle = when[:, step] if step < when.shape[1] else (0.0, 0.0)
    return Peak(
        float(each.stress[VON_MISES, node]), each.link, (float(place[0]), float(place[1]), float(place[2])),
        node, step, float(time), float(angle), words[node] if words is not None else "",
    )  # fmt: skip
