"""Damage at the surfaces of links by the stresses of the last period of a periodic motion.

The stress of a link over the period is a product of a few modes' stresses and their coordinates, which the envelope
stores; it is computed for a few points at a time (`surface`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from kedfem.dynamics.model import Model
from kedfem.errors import SceneError
from kedfem.motion.period import repeats_after
from kedfem.results.fatigue.strength import Strength, strength_of, verdict
from kedfem.results.fatigue.surface import CRITERIA, FINDLEY, LinkFatigue, Period, SurfaceHistory
from kedfem.results.records import Fatigue, FatigueSpot
from kedfem.results.stresses.envelope import Envelope
from kedfem.results.stresses.peaks import part_and_number, reference_points, separated_points
from kedfem.scene import Fatigue as FatigueSettings
from kedfem.scene import Scene, percentage, revolution_steps, time_grid, without_vibration

MOST = 5  # hot spots of a link
REPEATS = 0.01  # of a link's highest stress: by how much two periods may differ


def kept_since(scene: Scene, period: float) -> float:
    """Time [s] from which on histories are kept, for two periods and a step; infinite without fatigue."""
    if scene.fatigue is None:
        return np.inf
    grid = time_grid(scene)
    return grid.end - 2 * period - 2 * grid.step


def fatigue_of(
    scene: Scene, model: Model, envelope: Envelope, near: Sequence[Sequence[str]], length: float
) -> tuple[Fatigue, list[LinkFatigue]]:
    """Damage at all points of surfaces, and at hot spots by the FKM guideline.

    Parameters
    ----------
    envelope : that kept the histories of two periods
    near : per link or segment the singular place near each point, in words
    length : of a period [s]
    """
    asked = scene.fatigue
    if asked is None:
        raise TypeError("fatigue: is not asked for")
    times = envelope.times
    some = 1e-3 * float(times[-1] - times[-2])
    period = Period(length, float(times[-1]), bool(times[-1] - 2 * length > times[0] - some))
    strengths = link_strengths(scene, asked)
    surfaces = {
        k: SurfaceHistory(envelope.recoveries[k], envelope.kept(k), near[k], strengths[link.name], asked, period)
        for k, link in enumerate(model.links)
        if link.name in strengths and not link.rigid
    }
    fields = {k: surface.field() for k, surface in surfaces.items()}
    nothing = [LinkFatigue(x, *np.full((6, x.points), np.nan)) for x in envelope.recoveries]
    of = {name: {k: x for k, x in surfaces.items() if x.name == name} for name in strengths}
    spots = {name: _spots(each, fields, asked, period) for name, each in of.items()}
    repeats = max((surface.repeats for surface in surfaces.values()), default=0.0)
    turn = revolution_steps(scene)
    elastic = dict.fromkeys(link.name for link in model.links if not link.rigid)
    return Fatigue(
        length, length / (turn * time_grid(scene).step) if turn else 0.0,
        repeats, _why_unreliable(scene, period, repeats), spots, {name: each.words for name, each in strengths.items()},
        {name: sum(x.left_out for x in each.values()) for name, each in of.items()},
        tuple(name for name in elastic if name not in strengths),
    ), [fields.get(k, nothing[k]) for k in range(len(nothing))]  # fmt: skip


def link_strengths(scene: Scene, asked: FatigueSettings) -> dict[str, Strength]:
    """Strength of all links with data, their own or of their material."""
    out = {}
    for name, link in scene.links.items():
        data = asked.links.get(name) or asked.materials.get(link.material or "")
        if data is not None and link.material is not None and link.model != "rigid":
            out[name] = strength_of(data, scene.materials[link.material].youngs_modulus)
    return out


def _why_unreliable(scene: Scene, period: Period, repeats: float) -> str:
    """Why the numbers are unreliable, in words."""
    if repeats > REPEATS:
        what = "the period before" if period.before else "its beginning"
        return (
            f"stresses of the last period differ from those of {what} by {percentage(repeats)} of the highest, more than "
            f"{100 * REPEATS:g} %: the motion has not settled; run more revolutions, or take analysis.kind = 'steady'"
        )
    if not (period.before or scene.analysis.kind == "steady" or without_vibration(scene)):
        return (
            "the run has one period only, which does not show whether it repeats itself; run two of them or more, or "
            "take analysis.kind = 'steady'"
        )
    return ""


def _spots(
    surfaces: Mapping[int, SurfaceHistory], fields: Mapping[int, LinkFatigue], asked: FatigueSettings, period: Period
) -> tuple[FatigueSpot, ...]:
    """The places of a link with the highest damage, evaluated by pyLife."""
    if not surfaces:
        return ()
    every = [fields[k] for k in surfaces]
    points = np.concatenate([reference_points(each.recovery) for each in every])
    damage = np.concatenate([each.damage for each in every])
    ranked = damage if np.nanmax(damage, initial=0.0) > 0 else np.concatenate([x.utilisation for x in every])
    found = (part_and_number([len(each.damage) for each in every], k) for k in separated_points(points, ranked, MOST))
    return tuple(_spot(list(surfaces.values())[part], node, asked, period) for part, node in found)


def _spot(surface: SurfaceHistory, point: int, asked: FatigueSettings, period: Period) -> FatigueSpot:
    place = surface.place_of(point)
    judged = surface.judged([place])
    h = judged.h[0]
    gradient = 0.0 if surface.strength.data.group is None else surface.gradient(place, int(np.abs(h).argmax()))
    periods = np.inf if asked.required_life is None else asked.required_life / period.length
    strength = surface.strength.without_mean() if judged.criterion[0] == FINDLEY else surface.strength
    found = verdict(h, strength, gradient, asked.safety_factor, periods)
    x, y, z = map(float, reference_points(surface.recovery)[point])
    return FatigueSpot(
        surface.name, (x, y, z), point, CRITERIA[judged.criterion[0]], found.damage, found.utilisation,
        float(judged.found[0, 2]), float(judged.found[0, 3]), float(judged.disproportion[0]), found.support,
        found.cycles, surface.near[point],
    )  # fmt: skip


def stress_period(scene: Scene) -> float:
    """The time after which stresses repeat, where damage is asked for, else 0 [s].

    Raises
    ------
    SceneError
        The motion does not repeat itself, or the analysis is shorter.
    """
    if scene.fatigue is None:
        return 0.0
    end = time_grid(scene).end
    if scene.analysis.kind == "steady":
        return end
    period = scene.fatigue.period or repeats_after(scene)
    if end < period * (1 - 1e-9):
        raise SceneError(f"fatigue: needs a whole period, {period:.6g} s, got an analysis of {end:.6g} s")
    return period
