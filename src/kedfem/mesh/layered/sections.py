"""The plan of a solid made of layers: sections of its slabs, cut and combined by OpenCASCADE through gmsh."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import KedfemError
from kedfem.mesh.cad.solids import OtherMethodError, Solid
from kedfem.mesh.layered.partition import Curve, Loop, Plan, Region, loop_samples, signed_area
from kedfem.mesh.session import gmsh_copy

_SAMPLES = 33  # along each curve
_SAME = 1e-6  # difference, in extents, within which heights are the same
_LOST = 5e-5  # most difference of volumes: sections of free forms are approximate


@dataclass(frozen=True, slots=True)
class _Piece:
    """A curve of gmsh's model in one direction: its tag, end vertices and samples, and the tangents at its ends."""

    tag: int
    ends: tuple[int, int]
    parameters: Float[np.ndarray, " m"]
    lengths: Float[np.ndarray, " m"]
    samples: Float[np.ndarray, "m 2"]
    curvatures: Float[np.ndarray, " m"]
    tangents: Float[np.ndarray, "2 2"]

    def reversed(self) -> "_Piece":
        """The curve in the opposite direction."""
        return _Piece(
            self.tag, self.ends[::-1], self.parameters[::-1], self.lengths[-1] - self.lengths[::-1],
            self.samples[::-1], self.curvatures[::-1], -self.tangents[::-1],
        )  # fmt: skip


@contextmanager
def plan_of_slabs(gmsh: ModuleType, solid: Solid, direction: Float[np.ndarray, "3"]) -> Iterator[Plan]:
    """The plan of a solid along a direction; its curves give points only within the context.

    Raises
    ------
    OtherMethodError
        OpenCASCADE cannot cut the sections, or they do not fill the solid's volume.
    """
    axes, extent = plan_axes(direction), solid.extent
    heights = _slab_heights(gmsh, solid, axes[2])
    with gmsh_copy(gmsh, 1 / extent) as other:
        with reporting(solid, f"its layers must have sections across {axes[2].round(6).tolist()}"):
            [(_, tag)] = other.model.getEntities(3)
            middles = (heights[1:] + heights[:-1]) / 2
            faces = [_slab_section(other, int(tag), axes, height) for height in middles]
            plan = plan_of_sections(other, faces, axes, extent, heights)
        check_volume(solid, plan)
        yield plan


def plan_axes(direction: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Axes x, y, z as rows of a right-handed frame with z along the direction; global axes where possible."""
    z = direction / np.linalg.norm(direction)
    first = np.roll(np.eye(3), 2 - int(np.argmax(abs(z))), axis=0)[0]
    x = first - (first @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z])


def _slab_heights(gmsh: ModuleType, solid: Solid, direction: Float[np.ndarray, "3"]) -> Float[np.ndarray, " h"]:
    """Heights of the caps along the direction, divided by the solid's extent."""
    heights = []
    for face in solid.faces:
        low, high = gmsh.model.getParametrizationBounds(2, face.tag)
        corners = np.array([low, high, (low + high) / 2]).ravel()
        normals = np.asarray(gmsh.model.getNormal(face.tag, corners)).reshape(3, 3)
        if abs(normals @ direction).min() > 0.5:
            places = np.asarray(gmsh.model.getValue(2, face.tag, corners)).reshape(3, 3)
            heights.append(places[2] @ direction / solid.extent)
    ordered = np.sort(heights)
    return np.asarray(ordered[np.append(True, np.diff(ordered) > _SAME)])


def _slab_section(gmsh: ModuleType, solid: int, axes: Float[np.ndarray, "3 3"], height: float) -> list[tuple[int, int]]:
    """The faces in which a plane cuts the solid, moved along its normal to height 0."""
    occ = gmsh.model.occ
    low, high = np.reshape(occ.getBoundingBox(3, solid), (2, 3))
    centre = (low + high) / 2 @ axes[:2].T
    corners = [np.array([*(centre + sign), height]) @ axes for sign in ([-1, -1], [1, -1], [1, 1], [-1, 1])]
    cut = section(gmsh, solid, np.array(corners))
    occ.translate(cut, *(-height * axes[2]))
    return cut


@contextmanager
def reporting(solid: Solid, must: str) -> Iterator[None]:
    """Turn a failure of OpenCASCADE into an OtherMethodError that says what is required."""
    try:
        yield
    except KedfemError:
        raise
    except Exception as error:  # gmsh raises nothing more special
        raise OtherMethodError(f"{solid.name}: {must}, got none from OpenCASCADE: {error}") from error


def section(gmsh: ModuleType, solid: int, corners: Float[np.ndarray, "4 3"]) -> list[tuple[int, int]]:
    """The faces in which a plane rectangle cuts the solid."""
    occ = gmsh.model.occ
    points = [occ.addPoint(*corner) for corner in corners]
    lines = [occ.addLine(points[i - 1], points[i]) for i in range(4)]
    sheet = occ.addPlaneSurface([occ.addCurveLoop(lines)])
    cut, _ = occ.intersect([(3, solid)], [(2, sheet)], removeObject=False)
    return [(dim, tag) for dim, tag in cut if dim == 2]


def plan_of_sections(
    gmsh: ModuleType,
    sections: list[list[tuple[int, int]]],
    axes: Float[np.ndarray, "3 3"],
    extent: float,
    heights: Float[np.ndarray, " h"],
) -> Plan:
    """The partition of the plane that all sections make together.

    Parameters
    ----------
    sections : the faces of each slab's section, in gmsh's model
    axes, extent, heights : as of `Plan`
    """
    faces = [face for section in sections for face in section]
    pieces = gmsh.model.occ.fragment(faces, [])[1] if len(faces) > 1 else [[face] for face in faces]
    gmsh.model.occ.synchronize()
    material: dict[int, set[int]] = {}
    slabs = [slab for slab, section in enumerate(sections) for _ in section]
    for slab, piece in zip(slabs, pieces, strict=True):
        for _, tag in piece:
            material.setdefault(int(tag), set()).add(slab)
    tags = sorted(material)
    edges = {tag: [list(map(int, loop)) for loop in gmsh.model.occ.getCurveLoops(tag)[1]] for tag in tags}
    used = sorted({abs(curve) for loops in edges.values() for loop in loops for curve in loop})
    chains = _chains({tag: _piece(gmsh, tag, axes) for tag in used})
    met = Counter(end for chain in chains for end in (chain[0].ends[0], chain[-1].ends[1]))
    curves = tuple(_curve(gmsh, chain, axes, met) for chain in chains)
    number = {piece.tag: i for i, chain in enumerate(chains) for piece in chain}
    regions = []
    for tag in tags:
        sets = [sorted({number[abs(curve)] for curve in loop}) for loop in edges[tag]]
        loops = [loop for numbers in sets for loop in _loops(curves, numbers)]
        mask = np.isin(np.arange(len(sections)), list(material[tag]))
        regions.append(Region(_oriented(curves, loops), mask, float(gmsh.model.occ.getMass(2, tag))))
    return Plan(axes, extent, heights, curves, tuple(regions))


def _piece(gmsh: ModuleType, tag: int, axes: Float[np.ndarray, "3 3"]) -> _Piece:
    """A curve of gmsh's model, sampled."""
    low, high = (float(bound[0]) for bound in gmsh.model.getParametrizationBounds(1, tag))
    parameters = np.linspace(low, high, _SAMPLES)
    samples = _places(gmsh, tag, parameters, axes)
    slopes = np.asarray(gmsh.model.getDerivative(1, tag, parameters)).reshape(-1, 3) @ axes[:2].T
    speeds = np.linalg.norm(slopes, axis=1)
    middle = (parameters[1:] + parameters[:-1]) / 2
    between = np.asarray(gmsh.model.getDerivative(1, tag, middle)).reshape(-1, 3)
    steps = (speeds[1:] + 4 * np.linalg.norm(between, axis=1) + speeds[:-1]) * np.diff(parameters) / 6
    ends = [int(end) for _, end in gmsh.model.getBoundary([(1, tag)], oriented=False, combined=False)]
    if len(ends) == 2 and _is_reversed(gmsh, ends, samples, axes):
        ends.reverse()
    curvatures = abs(np.asarray(gmsh.model.getCurvature(1, tag, parameters)))
    return _Piece(
        tag, (ends[0], ends[-1]), parameters, np.concatenate([[0.0], np.cumsum(steps)]), samples,
        np.where(np.isfinite(curvatures), curvatures, 0.0), (slopes / speeds[:, None])[[0, -1]],
    )  # fmt: skip


def _is_reversed(
    gmsh: ModuleType, ends: list[int], samples: Float[np.ndarray, "m 2"], axes: Float[np.ndarray, "3 3"]
) -> bool:
    """Whether a curve's first parameter is at the second of its ends."""
    first, last = (np.asarray(gmsh.model.getValue(0, end, [])) @ axes[:2].T for end in ends)
    return bool(np.linalg.norm(samples[0] - first) > np.linalg.norm(samples[0] - last))


def _places(
    gmsh: ModuleType, tag: int, parameters: Float[np.ndarray, " s"], axes: Float[np.ndarray, "3 3"]
) -> Float[np.ndarray, "s 2"]:
    """Points of a curve in the plan."""
    return np.asarray(np.reshape(gmsh.model.getValue(1, tag, parameters), (-1, 3)) @ axes[:2].T)


def _chains(pieces: dict[int, _Piece]) -> list[list[_Piece]]:
    """Pieces joined to smooth curves, where exactly two meet with equal tangents and curvatures."""
    at: dict[int, list[int]] = {}
    for tag, piece in pieces.items():
        for end in piece.ends:
            at.setdefault(end, []).append(tag)
    left, chains = dict(pieces), []
    while left:
        chain = [left.pop(next(iter(left)))]
        for _ in (0, 1):  # forward from its end, then, reversed, from its start
            while (follower := _follower(chain, at, left)) is not None:
                chain.append(follower)
                del left[follower.tag]
            chain = [piece.reversed() for piece in reversed(chain)]
        chains.append(chain)
    return chains


def _follower(chain: list[_Piece], at: dict[int, list[int]], left: dict[int, _Piece]) -> _Piece | None:
    """The piece that continues a chain smoothly, if there is one."""
    last, end = chain[-1], chain[-1].ends[1]
    others = [tag for tag in at[end] if tag in left]
    if len(at[end]) != 2 or len(others) != 1:
        return None
    piece = left[others[0]]
    piece = piece if piece.ends[0] == end else piece.reversed()
    tangent = last.tangents[1] @ piece.tangents[0] > 1 - 1e-8
    same_bend = abs(last.curvatures[-1] - piece.curvatures[0]) < 1e-4 * (1 + last.curvatures[-1])
    return piece if tangent and same_bend else None


def _curve(gmsh: ModuleType, chain: list[_Piece], axes: Float[np.ndarray, "3 3"], met: Counter[int]) -> Curve:
    """The curve that a chain of pieces makes; `met` counts the ends of curves at each vertex."""
    starts = np.concatenate([[0.0], np.cumsum([piece.lengths[-1] for piece in chain])])

    def places(lengths: Float[np.ndarray, " s"]) -> Float[np.ndarray, "s 2"]:
        which = np.clip(np.searchsorted(starts, lengths, side="right") - 1, 0, len(chain) - 1)
        points = np.empty((len(lengths), 2))
        for i in np.unique(which):
            piece = chain[i]
            order = np.argsort(piece.parameters)
            wanted = lengths[which == i] - starts[i]
            parameters = np.interp(wanted, piece.lengths, piece.parameters)
            parameters = np.clip(parameters, *piece.parameters[order][[0, -1]])
            points[which == i] = _places(gmsh, piece.tag, parameters, axes)
        return points

    ends = chain[0].ends[0], chain[-1].ends[1]
    samples = np.concatenate([chain[0].samples[:1], *(piece.samples[1:] for piece in chain)])
    begun = zip(starts[:-1], chain, strict=True)
    lengths = np.concatenate([[0.0], *(start + piece.lengths[1:] for start, piece in begun)])
    curvatures = np.concatenate([chain[0].curvatures[:1], *(piece.curvatures[1:] for piece in chain)])
    return Curve(ends, ends[0] == ends[1] and met[ends[0]] == 2, lengths, samples, curvatures, places)


def _loops(curves: tuple[Curve, ...], numbers: list[int]) -> list[Loop]:
    """Closed loops of curves, each in one of its directions."""
    left, loops = set(numbers), []
    while left:
        first = min(left)
        left.remove(first)
        loop, end = [(first, True)], curves[first].ends[1]
        while end != curves[first].ends[0]:
            after = next(i for i in sorted(left) if end in curves[i].ends)
            left.remove(after)
            forward = curves[after].ends[0] == end
            loop.append((after, forward))
            end = curves[after].ends[1 if forward else 0]
        loops.append(tuple(loop))
    return loops


def _oriented(curves: tuple[Curve, ...], loops: list[Loop]) -> tuple[Loop, ...]:
    """The loops with the region on the left, the outer one, which has the largest area, first."""
    areas = [signed_area(loop_samples(curves, loop)) for loop in loops]
    order = sorted(range(len(loops)), key=lambda i: -abs(areas[i]))
    return tuple(
        loops[i] if (areas[i] > 0) == (i == order[0]) else tuple((c, not way) for c, way in loops[i][::-1]) for i in order
    )


def check_volume(solid: Solid, plan: Plan) -> None:
    """Refuse sections that do not fill the solid's volume."""
    share = plan.volume * plan.extent**3 / solid.volume
    if abs(share - 1) > _LOST:
        raise OtherMethodError(f"{solid.name}: swept sections must fill its volume, got {share:.6g} of it")
