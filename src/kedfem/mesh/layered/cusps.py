"""Cusps of a plan, where curves touch at no angle: no element fits there, so their tips are given to neighbours."""

from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.layered.partition import Curve, Loop, Plan, Region, corner_angles

CUSP = np.radians(6)  # angle below which no good element fits into a corner
_WIDE = 0.15  # width of a cusp where its tip ends, in element sizes
_LOST = 2e-4  # largest volume of all tips, of the solid's
_SLANT = np.tan(np.radians(30))  # slope of the tip's end, which makes the neighbour's corners less sharp
_STEPS = np.linspace(0.0, 0.4, 401)[1:]  # shares of the shorter curve at which a tip may end


@dataclass(frozen=True, slots=True)
class Cusp:
    """A corner of a region without an angle: the region, the loop, and in it the index of the curve that starts there."""

    region: int
    loop: int
    place: int


@dataclass(frozen=True, slots=True)
class _Tip:
    """A tip to cut off: the distances from the cusp at which the curves before and after it are cut; its area."""

    before: float
    after: float
    area: float


def cusps(plan: Plan) -> list[Cusp]:
    """All corners of regions that are cusps."""
    every = ((n, k, loop) for n, region in enumerate(plan.regions) for k, loop in enumerate(region.loops))
    sharp = ((n, k, np.flatnonzero(corner_angles(plan.curves, loop) < CUSP)) for n, k, loop in every)
    return [Cusp(n, k, int(place)) for n, k, places in sharp for place in places]


def without_cusps(plan: Plan, size: float) -> tuple[Plan, float]:
    """The plan whose cusps have given their tips to the neighbour that changes the solid least; the volume changed.

    A boss whose circle touches the sides of a web gains a sliver beside each point of contact. Cusps with too large
    tips stay.

    Parameters
    ----------
    plan : within its context
    size : length of the elements, by the solid's extent [-]

    Returns
    -------
    The plan, and the volume of the tips as a share of the solid's [-].
    """
    lost, left = 0.0, len(cusps(plan))
    share = _LOST / max(left, 1)
    for _ in range(left):
        done = None
        for cusp in cusps(plan):
            done = _filled(plan, cusp, _WIDE * size, share)
            if done is not None:
                break
        if done is None:
            break
        plan, lost = done[0], lost + done[1]
    return without_unused_curves(plan), lost


def without_unused_curves(plan: Plan) -> Plan:
    """The plan without the curves that no region uses."""
    used = sorted({i for region in plan.regions for loop in region.loops for i, _ in loop})
    regions = tuple(
        replace(region, loops=tuple(tuple((used.index(i), way) for i, way in loop) for loop in region.loops))
        for region in plan.regions
    )
    return replace(plan, curves=tuple(plan.curves[i] for i in used), regions=regions)


def _filled(plan: Plan, cusp: Cusp, width: float, share: float) -> tuple[Plan, float] | None:
    """The plan without the tip of one cusp, and the share of the volume that this changes; None if it is too large."""
    thicknesses = np.diff(plan.heights)
    loop = plan.regions[cusp.region].loops[cusp.loop]
    (before, _), (after, _) = loop[cusp.place - 1], loop[cusp.place]
    if before == after:
        return None
    own = plan.regions[cusp.region].material
    costs = []
    for curve in (before, after):
        other = _neighbour(plan, cusp.region, curve)
        beyond = np.zeros_like(own) if other is None else plan.regions[other].material
        costs.append(float(thicknesses @ (own ^ beyond)) * (1.01 if other is None else 1.0))
    to_before = costs[0] <= costs[1]
    most = share * plan.volume / max(min(costs), 1e-12)
    tip = _tip(plan, loop, cusp.place, width, most, to_before)
    if tip is None:
        return None
    return _without_tip(plan, cusp, tip, to_before), tip.area * min(costs) / plan.volume


def _neighbour(plan: Plan, region: int, curve: int) -> int | None:
    """The region on the other side of a curve."""
    others = ((number, x) for number, x in enumerate(plan.regions) if number != region)
    on = (number for number, x in others if any(i == curve for loop in x.loops for i, _ in loop))
    return next(on, None)


def _tip(plan: Plan, loop: Loop, place: int, width: float, most: float, to_before: bool) -> _Tip | None:
    """The tip, which ends at a width of at most `width` and has an area of at most `most`; None if it has none."""
    (i, came), (j, goes) = loop[place - 1], loop[place]
    before, after = plan.curves[i], plan.curves[j]
    along = _STEPS * min(before.length, after.length)
    p = before.places(before.length - along if came else along)
    q = after.places(along if goes else after.length - along)
    widths = np.linalg.norm(p - q, axis=1)
    areas = np.cumsum(widths) * along[0]
    fit = np.flatnonzero((widths <= width) & (areas <= most))
    if len(fit) == 0 or widths[fit[-1]] < 1e-6:
        return None
    end = int(fit[-1])
    ahead = along[end] + _SLANT * widths[end]  # on the curve that keeps the tip
    return _Tip(along[end] if to_before else ahead, ahead if to_before else along[end], float(areas[end]))


def _without_tip(plan: Plan, cusp: Cusp, tip: _Tip, to_before: bool) -> Plan:
    """The plan with two curves cut and joined by a line, the tip in the region beyond one of them."""
    loop = plan.regions[cusp.region].loops[cusp.loop]
    (i, came), (j, goes) = loop[cusp.place - 1], loop[cusp.place]
    vertex = 1 + max(end for curve in plan.curves for end in curve.ends)
    far_i, tip_i = _cut(plan.curves[i], tip.before, came, vertex)
    far_j, tip_j = _cut(plan.curves[j], tip.after, not goes, vertex + 1)
    count = len(plan.curves)
    start = far_i.places(far_i.lengths[[-1 if came else 0]])[0]
    line = _line(start, far_j.places(far_j.lengths[[0 if goes else -1]])[0], vertex)
    curves = list(plan.curves)
    curves[i], curves[j] = far_i, far_j
    curves += [tip_i, tip_j, line]  # count, count + 1, count + 2
    joint = (count + 2, False)
    if to_before:
        beyond_i: Loop = ((count + 1, goes), joint, (i, not came))
        beyond_j: Loop = ((j, not goes), (count + 1, not goes))
    else:
        beyond_i = ((count, not came), (i, not came))
        beyond_j = ((j, not goes), joint, (count, came))
    new = {(i, came): ((i, came), (count + 2, True)), (i, not came): beyond_i, (j, not goes): beyond_j}
    gains = _neighbour(plan, cusp.region, i if to_before else j)
    regions = []
    for number, region in enumerate(plan.regions):
        change = tip.area * ((number == gains) - (number == cusp.region))
        loops = tuple(tuple(step for part in one for step in new.get(part, (part,))) for one in region.loops)
        regions.append(Region(loops, region.material, region.area + change))
    return replace(plan, curves=tuple(curves), regions=tuple(regions))


def _cut(curve: Curve, distance: float, at_end: bool, vertex: int) -> tuple[Curve, Curve]:
    """The parts of a curve beyond and within a distance from its end or its start."""
    at = curve.length - distance if at_end else distance
    lower = _part(curve, 0.0, at, (curve.ends[0], vertex))
    upper = _part(curve, at, curve.length, (vertex, curve.ends[1]))
    return (lower, upper) if at_end else (upper, lower)


def _part(curve: Curve, low: float, high: float, ends: tuple[int, int]) -> Curve:
    """The part of a curve between two arc lengths."""
    lengths = np.linspace(0.0, high - low, len(curve.lengths))
    curvatures = np.interp(low + lengths, curve.lengths, curve.curvatures)

    def places(wanted: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s 2"]:
        return curve.places(low + wanted)

    return Curve(ends, False, lengths, places(lengths), curvatures, places)


def _line(start: Float[np.ndarray, "2"], end: Float[np.ndarray, "2"], vertex: int) -> Curve:
    """The straight curve between the points at which two curves are cut."""
    lengths = np.linspace(0.0, float(np.linalg.norm(end - start)), 9)

    def places(wanted: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s 2"]:
        return np.asarray(start + wanted[:, None] / lengths[-1] * (end - start))

    return Curve((vertex, vertex + 1), False, lengths, places(lengths), 0 * lengths, places)
