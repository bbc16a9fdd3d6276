"""Meshes of bent bars, pipes and ring segments: one section, meshed and swept along a path of lines and arcs."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.mesh.cad.face_samples import OFF, FaceSamples, Frame, common_axes, face_samples
from kedfem.mesh.cad.solids import CadFace, OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh, in_layers, without_unused_nodes
from kedfem.mesh.layered.division import plan_size
from kedfem.mesh.layered.partition import Plan
from kedfem.mesh.layered.plan_mesh import plan_mesh
from kedfem.mesh.layered.sections import check_volume, plan_axes, plan_of_sections, reporting, section
from kedfem.mesh.layered.size_trials import sized
from kedfem.mesh.session import boundary, gmsh_copy

_SAMPLES = np.linspace(0, 1, 9)  # along each edge
_ENDS = 12  # plane faces that are tried as the first end
_TURN = np.radians(18)  # angle of an arc per element where no size is asked for, as for solids of revolution
_LONG = 2.5  # length of an element along the path over its size in the section, where no size is asked for


@dataclass(frozen=True, slots=True)
class Leg:
    """A line or an arc of a path.

    start : frame of the section: its centre, two directions in it, and that along the path
    arm : (3,) vector from the axis of an arc to its start [m]; 0 for a line
    travel : length of a line [m] or angle of an arc [rad]
    """

    start: Frame
    arm: Float[np.ndarray, "3"]
    travel: float = 0.0

    @property
    def radius(self) -> float:
        """Radius of an arc [m]; 0 for a line."""
        return float(np.linalg.norm(self.arm))

    @property
    def length(self) -> float:
        """Length of the path of the section's centre [m]."""
        return self.travel * (self.radius or 1.0)

    def at(self, share: float) -> Frame:
        """The frame at a share of the leg."""
        done, (x, y, ahead) = share * self.travel, self.start.axes
        if self.radius == 0:
            return Frame(self.start.origin + done * ahead, self.start.axes)
        out = self.arm / self.radius
        plane = np.stack([out, ahead])
        turned = np.array([[np.cos(done), np.sin(done)], [-np.sin(done), np.cos(done)]]) @ plane
        R = np.eye(3) + (turned - plane).T @ plane  # turns the directions out and ahead
        return Frame(self.start.origin - self.arm + R @ self.arm, np.stack([R @ x, R @ y, R @ ahead]))

    def passed(self, x: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """The travel at which the section passes points."""
        off, ahead = x - self.start.origin, self.start.axes[2]
        if self.radius == 0:
            return np.asarray(off @ ahead)
        angle = np.arctan2((off + self.arm) @ ahead, (off + self.arm) @ self.arm / self.radius) % (2 * np.pi)
        return np.asarray(np.where(angle > 2 * np.pi - 10 * OFF, 0.0, angle))


def path_mesh(gmsh: ModuleType, solid: Solid, sizing: Sizing) -> SolidMesh:
    """hex27 mesh of a solid that one section sweeps from end to end, a `Method`: bent bars and pipes, ring segments.

    The section is meshed as the plan of a layer is. Along the path elements have the same length, or without a size
    asked for two and a half times that length and 20 to a revolution.

    Raises
    ------
    OtherMethodError
        The solid has no such path, or only one of lines, or its elements are bad.
    """
    legs = path(gmsh, solid)
    if not any(leg.radius for leg in legs):
        raise OtherMethodError(f"{solid.name}: a path of lines alone is one of layers")

    def mesh_of(share: float) -> SolidMesh:
        with _section_plan(gmsh, solid, legs) as plan:
            size = share * plan_size(plan, sizing)
            flat = plan_mesh(solid.name, plan, size, sizing)
        counts = [_count(leg, size * solid.extent, sizing) for leg in legs]
        frames = [legs[0].start, *(leg.at(k / (2 * n)) for leg, n in zip(legs, counts, strict=True)
                                   for k in range(1, 2 * n + 1))]  # fmt: skip
        layers = sum(counts)
        mesh = in_layers(flat.points, np.arange(2 * layers + 1.0), flat.cells)
        placed = [frame.origin + solid.extent * flat.points @ frame.axes[:2] for frame in frames]
        points = np.concatenate(placed)
        words = f"{flat.kind} swept along {_in_words(legs)} in {layers} elements"
        return without_unused_nodes(SolidMesh(points, mesh.cells, method=words))

    return sized(solid, sizing, mesh_of)


def _in_words(legs: tuple[Leg, ...]) -> str:
    """The number of lines and arcs, in words."""
    arcs = sum(leg.radius > 0 for leg in legs)
    counts = {"arc": arcs, "line": len(legs) - arcs}
    return " and ".join(f"{n} {kind}{'s' * (n > 1)}" for kind, n in counts.items() if n)


def _count(leg: Leg, size: float, sizing: Sizing) -> int:
    """Number of elements along a leg."""
    asked = sizing.size is not None
    longest, turn = (size, sizing.angle) if asked else (_LONG * size, min(_TURN, sizing.angle))
    bent = int(np.ceil(leg.travel / turn * (leg.radius > 0)))
    return max(1, sizing.layers, round(leg.length / longest), bent)


@contextmanager
def _section_plan(gmsh: ModuleType, solid: Solid, legs: tuple[Leg, ...]) -> Iterator[Plan]:
    """The plan of the section half way along the first leg, as thick as the path is long."""
    frame = legs[0].at(0.5)
    with gmsh_copy(gmsh, 1 / solid.extent) as copy:
        with reporting(solid, "it must have a section across its path"):
            faces = _section(copy, solid, frame)
            length = sum(leg.length for leg in legs) / solid.extent
            plan = plan_of_sections(copy, [faces], frame.axes, solid.extent, np.array([0.0, length]))
        check_volume(solid, plan)
        yield replace(plan, origin=frame.origin)


def _section(gmsh: ModuleType, solid: Solid, frame: Frame) -> list[tuple[int, int]]:
    """The face, around the origin of a frame, in which its plane cuts the solid; it is moved to the origin."""
    occ = gmsh.model.occ
    [(_, tag)] = gmsh.model.getEntities(3)
    origin = frame.origin / solid.extent
    corners = np.array([(-1.5, -1.5, 0), (1.5, -1.5, 0), (1.5, 1.5, 0), (-1.5, 1.5, 0)]) @ frame.axes
    faces = section(gmsh, int(tag), origin + corners)
    occ.translate(faces, *(-origin))

    def away(face: tuple[int, int]) -> float:
        return float(np.linalg.norm(occ.getCenterOfMass(2, face[1])))

    nearest = min(faces, key=away)
    return [nearest]


def path(gmsh: ModuleType, solid: Solid) -> tuple[Leg, ...]:
    """The path along which a plane end, moved rigidly, sweeps the whole solid; OtherMethodError if there is none.

    The faces that meet the end must all run along a line perpendicular to it, or turn about an axis in its plane, up to
    another such plane, from which the next faces continue until the other end.
    """
    every = face_samples(gmsh, solid)
    planes = sorted((face for face in solid.faces if face.kind == "plane"), key=lambda face: face.area)
    for end in planes[:_ENDS]:
        if legs := _walked(gmsh, solid, every, end):
            return legs
    raise OtherMethodError(f"{solid.name}: no plane end sweeps it along lines and arcs to another end")


def _walked(gmsh: ModuleType, solid: Solid, every: dict[int, FaceSamples], end: CadFace) -> tuple[Leg, ...]:
    """The legs that start at one end, if they pass all faces up to another end; else none."""
    legs: tuple[Leg, ...] = ()
    frame, left = Frame(end.centre, plan_axes(-end.direction)), set(every) - {end.tag}
    walls = _behind(gmsh, boundary(gmsh, 2, end.tag), left)
    while walls:
        leg, far = _leg(gmsh, solid, [every[tag] for tag in sorted(walls)], frame)
        if leg is None:
            return ()
        legs, left, frame = (*legs, leg), left - walls, leg.at(1.0)
        walls = _behind(gmsh, far, left)
        if len(walls) == 1 and _is_across(solid, every[min(walls)], frame):
            return legs if left == walls else ()
    return ()


def _behind(gmsh: ModuleType, edges: set[int], left: set[int]) -> set[int]:
    """The faces at edges that have not been passed."""
    return {int(face) for edge in edges for face in gmsh.model.getAdjacencies(1, edge)[0]} & left


def _is_across(solid: Solid, sample: FaceSamples, frame: Frame) -> bool:
    """Whether a face is plane and perpendicular to the path at a frame."""
    off = abs((sample.places - (frame.origin - solid.middle) / solid.extent) @ frame.axes[2]).max()
    return sample.face.kind == "plane" and bool(max(off, abs(sample.normals @ frame.axes[:2].T).max()) < OFF)


def _leg(gmsh: ModuleType, solid: Solid, walls: list[FaceSamples], frame: Frame) -> tuple[Leg | None, set[int]]:
    """The leg along walls that starts at a frame, and the edges where it ends; None if there is none."""
    for leg in _motions(solid, walls, frame):
        slack = OFF * solid.extent / (leg.radius or 1.0)
        edges = (edge for wall in walls for edge in boundary(gmsh, 2, wall.face.tag))
        passed = {edge: leg.passed(_places(gmsh, edge)) for edge in edges}
        travel = float(max(each.max() for each in passed.values()))
        ends = {edge for edge, each in passed.items() if each.min() > travel - slack}
        through = {edge for edge, each in passed.items() if each.min() < slack and each.max() > travel - slack}
        first = {edge for edge, each in passed.items() if each.max() < slack}
        if ends and len(ends | through | first) == len(passed):
            return replace(leg, travel=travel), ends
    return None, set()


def _motions(solid: Solid, walls: list[FaceSamples], frame: Frame) -> Iterator[Leg]:
    """The line or the arcs along which all walls are swept from a frame's plane."""
    ahead, own = frame.axes[2], (frame.origin - solid.middle) / solid.extent
    if all(wall.runs_along(ahead) for wall in walls):
        yield Leg(frame, np.zeros(3))
        return
    for point, axis in common_axes(solid, walls):
        arm = own - point - ((own - point) @ axis) * axis
        if max(abs(axis @ ahead), abs(arm @ ahead)) < OFF and all(wall.revolves_about((point, axis)) for wall in walls):
            yield Leg(frame, solid.extent * arm)


def _places(gmsh: ModuleType, edge: int) -> Float[np.ndarray, "n 3"]:
    """Points along an edge [m]."""
    low, high = (bound[0] for bound in gmsh.model.getParametrizationBounds(1, edge))
    return np.reshape(gmsh.model.getValue(1, edge, low + _SAMPLES * (high - low)), (-1, 3))
