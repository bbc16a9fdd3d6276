"""Which regions of a plan are mapped: four sides, rings and discs, and the numbers that their sides need."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from kedfem.mesh.layered.partition import Loop, Plan, Region, corner_angles, loop_samples, signed_area

_CORNER = np.radians(150)  # an angle up to which a vertex is a corner of a four-sided region
_DEAR = (1.6, 3.5)  # of regions with one loop and with two, the numbers on a side are not raised by more
_UNEVEN = 4.0  # longest by shortest way across a ring


@dataclass(frozen=True, slots=True)
class Mapping:
    """How a region is mapped.

    kind : block: four sides; ring: between two loops; disc: inside a smooth loop
    corners : of a block where its sides begin: places in the outer loop
    """

    kind: Literal["block", "ring", "disc"]
    corners: tuple[int, ...] = ()


def mappings(plan: Plan, counts: list[int]) -> tuple[Mapping | None, ...]:
    """Of each region how it is mapped, or None; raises the numbers of the curves so that opposite sides agree."""
    found = [_mapping(plan, region) for region in plan.regions]
    while True:
        raised, dear = _raised(plan, found, counts)
        if dear is None:
            counts[:] = raised
            return tuple(found)
        found[dear] = None


def _raised(plan: Plan, found: list[Mapping | None], counts: list[int]) -> tuple[list[int], int | None]:
    """Numbers that agree on opposite sides; or the region that asks for too many."""
    raised, number = list(counts), None
    for _ in range(200):
        uneven = _uneven_sides(plan, found, raised)
        if uneven is None:
            return raised, None
        number, side, wanted = uneven
        dear = _DEAR[len(plan.regions[number].loops) - 1]
        _raise(plan, raised, side, wanted)
        before, after = (sum(one[i] for i in side) for one in (counts, raised))
        if after > max(before + 2, dear * before):
            break
    return raised, number


def _mapping(plan: Plan, region: Region) -> Mapping | None:
    """How a region might be mapped by its form alone."""
    if len(region.loops) == 2:
        return Mapping("ring") if _is_even_ring(plan, region) else None
    if len(region.loops) > 2:
        return None
    angles = corner_angles(plan.curves, region.loops[0])
    corners = np.sort(np.argsort(angles)[:4])
    others = np.delete(angles, corners)
    if len(corners) == 4 and angles[corners].max() < _CORNER and (others > _CORNER).all():
        return Mapping("block", tuple(int(corner) for corner in corners))
    if (angles > _CORNER).all() and _is_round(plan, region):
        return Mapping("disc")
    return None


def _is_even_ring(plan: Plan, region: Region) -> bool:
    """Whether a region between two loops is nearly as wide everywhere."""
    outer, inner = (loop_samples(plan.curves, loop) for loop in region.loops)
    across = np.linalg.norm(outer[:, None] - inner, axis=2)
    ways = np.concatenate([across.min(axis=1), across.min(axis=0)])
    lengths = [sum(plan.curves[i].length for i, _ in loop) for loop in region.loops]
    return bool(ways.max() < _UNEVEN * ways.min() and lengths[0] < 4 * lengths[1])


def _is_round(plan: Plan, region: Region) -> bool:
    """Whether a loop goes around an area nearly as large as a circle of its length does."""
    samples = loop_samples(plan.curves, region.loops[0])
    length = sum(plan.curves[i].length for i, _ in region.loops[0])
    return signed_area(samples) > 0.7 * length**2 / (4 * np.pi)


def _sides_of(plan: Plan, mapping: Mapping, loops: tuple[Loop, ...]) -> list[tuple[list[int], list[int]]]:
    """The pairs of sides, as curves, that must have equal numbers."""
    if mapping.kind == "disc":
        return []
    curves = [[i for i, _ in loop] for loop in loops]
    if mapping.kind == "ring":
        return _facing_curves(plan, loops) or [(curves[0], curves[1])]
    first, *others = mapping.corners
    bounds = [first, *others, first + len(curves[0])]
    around = curves[0] + curves[0]
    sides = [around[start:end] for start, end in pairwise(bounds)]
    return [(sides[0], sides[2]), (sides[1], sides[3])]


def _facing_curves(plan: Plan, loops: tuple[Loop, ...]) -> list[tuple[list[int], list[int]]]:
    """The curves of two loops in pairs, if they are as many and none is free."""
    outer, inner = loops[0], loops[1][::-1]
    if len(outer) != len(inner) or len(outer) < 2:
        return []
    middles = [np.array([plan.curves[i].samples.mean(axis=0) for i, _ in loop]) for loop in (outer, inner)]
    turns = [((middles[0] - np.roll(middles[1], -k, axis=0)) ** 2).sum() for k in range(len(inner))]
    turned = np.roll([i for i, _ in inner], -int(np.argmin(turns)))
    return [([i], [int(j)]) for (i, _), j in zip(outer, turned, strict=True)]


def _uneven_sides(
    plan: Plan, found: list[Mapping | None], counts: list[int]
) -> tuple[int, list[int], int] | None:
    """A region with opposite sides that do not agree: its number, the side with less, and what that must have."""
    for number, (mapping, region) in enumerate(zip(found, plan.regions, strict=True)):
        for pair in _sides_of(plan, mapping, region.loops) if mapping else []:
            sums = [sum(counts[i] for i in side) for side in pair]
            if sums[0] != sums[1]:
                return number, pair[int(sums[1] < sums[0])], max(sums)
    return None


def _raise(plan: Plan, counts: list[int], side: list[int], wanted: int) -> None:
    """Raises the numbers on a side two by two, each time where the elements are longest."""
    while sum(counts[i] for i in side) < wanted:
        longest = max(side, key=lambda i: plan.curves[i].length / counts[i])
        counts[longest] += 2
