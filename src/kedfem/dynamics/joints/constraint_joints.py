"""Joints enforced by constraint equations whose directions vary in time: C(t) z = 0, where others share port points for
good.

What slides or turns relative to both its links cannot be said of fixed points by constant weights. Such a joint's links
have port points of their own, fixed in them, whose displacements are interface unknowns; rows over them say what the
joint holds. A coupling surface is seen as a rigid piece: the mean displacement u₀ of its surface and its mean rotation θ,
both linear in the port points, so that the point of the coupling surface's frame at X moves by u₀ + θ × (X − X₀).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Bool, Float, Int
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.stations import Stations
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface
from kedfem.motion.constraints import CONSTRAINED, perpendiculars
from kedfem.motion.joint_equations import unit
from kedfem.motion.newton import cross_matrix
from kedfem.scene import GROUND, Joint, Scene, enforced_by_equations, moving_grounds

Ports = Float[np.ndarray, "p 3"]
NO_ROWS = np.zeros((0, 3))


@dataclass(frozen=True, slots=True)
class Side:
    """What a joint has on one of its links; all in the link frame, in the reference position.

    body : number in the linkage
    points : (p, 3) its ports in the reference position, the first at X₀ of the coupling surface [m]
    surface : (p, 6, d) u₀ and θ from the displacements at its ports
    stations : of the link along which a slot's pin slides; its ports are these
    keys, weights : of each port the link, or segment of one, and (n,) weights on it; none once z is known
    slider, axis : name of a rigid slider, which rides on another link and has no ports, and along which it slides
    onto : (p, d, c) displacements at the ports, world components, from the interface unknowns z[columns]
    """

    body: int
    points: Ports
    surface: Float[np.ndarray, "p 6 d"]
    stations: Stations | None = None
    keys: tuple[str, ...] = ()
    weights: Float[np.ndarray, "p n"] | Sequence[Float[np.ndarray, " _"]] = ()
    slider: str = ""
    axis: Float[np.ndarray, "3"] | None = None
    onto: Float[np.ndarray, "p d c"] = field(default_factory=lambda: np.zeros((0, 0, 0)))
    columns: Int[np.ndarray, " c"] = field(default_factory=lambda: np.zeros(0, int))


@dataclass(frozen=True, slots=True)
class ConstraintJoint:
    """A joint enforced by constraint equations: row r is gap_r · (u_i − u_j) + turn_r · (θ_i − θ_j) at the joint's point
    of link i.

    name, at : of the joint, (3,) [m] in the reference position
    bodies : numbers of links i and j in the linkage; directions are fixed in j
    sides : what it has on both, None where a link has no unknowns (the ground, what the drive carries)
    axis : (3,) of the joint, in the reference position
    gap, turn : (r, 3) directions in the reference position [-, m]
    stiffness : (r,) of rows that are springs, infinite of those that hold [N/m, N m]
    cross : of a universal joint the axes in i and in j: the last row turns about the normal of both
    plus : rows of other joints that these are combined with, each with its coefficient: gears
    """

    name: str
    at: Float[np.ndarray, "3"]
    bodies: tuple[int, int]
    sides: tuple[Side | None, Side | None]
    axis: Float[np.ndarray, "3"] = field(default_factory=lambda: np.eye(3)[2])
    gap: Float[np.ndarray, "r 3"] = field(default_factory=lambda: NO_ROWS)
    turn: Float[np.ndarray, "r 3"] = field(default_factory=lambda: NO_ROWS)
    stiffness: Float[np.ndarray, " r"] = field(default_factory=lambda: NO_ROWS[:, 0])
    cross: tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]] | None = None
    plus: "tuple[tuple[float, ConstraintJoint], ...]" = ()

    @property
    def all_sides(self) -> Iterator[Side]:
        """Those that it has, and of joints that it is combined with."""
        for joint in (self, *(other for _, other in self.plus)):
            yield from (side for side in joint.sides if side is not None)


def needs_rows(scene: Scene, name: str) -> bool:
    """Whether a joint is enforced by constraint equations: where shared port points cannot say what it holds."""
    if name in scene.driven_joints and name in moving_grounds(scene).values():
        return False
    return enforced_by_equations(scene, name)


def ordered(joint: Joint) -> tuple[str, str]:
    """The links i and j of a joint enforced by constraint equations: j is the second, or the ground."""
    first, second = joint.links
    return (second, first) if first == GROUND and joint.kind != "slot" else (first, second)


def bore_axis(joint: Joint, link: str) -> Float[np.ndarray, "3"] | None:
    """Direction of the bore or journal that a joint looks for on a link; None where any face may be its surface."""
    if joint.axes is not None:
        return unit(joint.axes[joint.links.index(link)])
    if joint.axis is None or joint.kind in {"prismatic", "planar", "slot"}:
        return None
    return unit(joint.axis)


def held_rows(joint: Joint, driven: bool) -> tuple[Float[np.ndarray, "r 3"], Float[np.ndarray, "r 3"], list[int]]:
    """Directions of what a joint holds, in the reference position: gap and turn of each row, and the axis of its frame
    that this is along or about, −1 of a screw's thread. That of a universal joint's cross is left open."""
    frame, (gaps, turns) = joint_frame(joint), CONSTRAINED[joint.kind]
    gaps += "z" * (driven and joint.kind == "prismatic")
    turns += "z" * (driven and joint.kind == "revolute")
    axes = ["xyz".index(axis) for axis in gaps + turns]
    gap, turn = np.zeros((2, len(axes), 3))
    gap[: len(gaps)], turn[len(gaps) :] = frame[axes[: len(gaps)]], frame[axes[len(gaps) :]]
    if joint.kind in {"universal", "screw"}:
        thread = joint.kind == "screw"
        gap = np.vstack([gap, thread * frame[2]])
        turn = np.vstack([turn, -thread * (joint.lead or 0.0) / (2 * np.pi) * frame[2]])
        axes.append(-1 if thread else 2)
    return gap, turn, axes


def joint_frame(joint: Joint) -> Float[np.ndarray, "3 3"]:
    """Axes x, y, z of a joint as rows, in the reference position: z its axis; those of the world without one."""
    if joint.axis is None:
        return np.eye(3)
    axis = unit(joint.axis)
    return np.stack([*perpendiculars(axis), axis])


def mounted(joint: Joint, axis: int, turning: bool) -> tuple[float, float] | None:
    """Stiffness and damping of a joint's bushing along, or about, an axis of its frame; None where it holds."""
    of = joint.bushing
    stiffness = None if of is None else (of.rotational_stiffness if turning else of.stiffness)
    if of is None or stiffness is None:
        return None
    return stiffness[axis], (of.rotational_damping if turning else of.damping)[axis]


def stiffnesses(scene: Scene, name: str, gap: Float[np.ndarray, "r 3"], axes: list[int]) -> Float[np.ndarray, " r"]:
    """Stiffness of a joint's rows: of its bushing, its drive's shaft; infinite where they hold."""
    joint, drive, out = scene.joints[name], scene.driven_joints.get(name), np.full(len(axes), np.inf)
    for r, (axis, turning) in enumerate(zip(axes, (not row.any() for row in gap), strict=True)):
        if drive is not None and axis == 2 and turning == (joint.kind != "prismatic"):
            # what the drive prescribes is none of the bushing's
            out[r] = np.inf if drive.shaft_stiffness is None else drive.shaft_stiffness
        elif axis >= 0 and (found := mounted(joint, axis, turning)) is not None:
            out[r] = found[0]
    return out


def in_plane(gap: Float[np.ndarray, "r 3"], turn: Float[np.ndarray, "r 3"]) -> Bool[np.ndarray, " r"]:
    """Which rows say something of links that move in a plane z = constant."""
    return np.asarray((np.abs(gap[:, :2]).max(axis=1) > 1e-9) | (np.abs(turn[:, 2]) > 1e-9))


def surface_ports(surface: CouplingSurface, link: Link, where: str) -> tuple[Ports, Float[np.ndarray, "p 6 d"]]:
    """Port points of a coupling surface: its middle, and one off it in each direction that it knows; u₀ and θ from them.

    With ∂_k u the rate of change along direction e_k,

        θ = ½ Σ e_k × ∂_k u                                                  a coupling surface that knows all three,
        θ = e_1 (n · ∂_2 u) − e_2 (n · ∂_1 u) + ½ n (e_2 · ∂_1 u − e_1 · ∂_2 u)    a flat one with normal n,

    each the turn of the coupling surface where it moves rigidly.

    Raises
    ------
    MeshError
        If the coupling surface is a point or a line that does not know its turn.
    """
    d = link.d
    if link.kind == "beam":
        one = np.zeros((1, 6, 3))
        one[0, [0, 1, 5], [0, 1, 2]] = 1.0
        return surface.origin[None], one
    known = [k for k in range(link.d) if surface.spread[k] > 0]
    turning = _turning(link, [surface.directions[k] for k in known])
    if turning is None:
        raise MeshError(
            f"{where}: must sit on a bore or a face of link '{link.name}', got a coupling surface that knows no turn"
        )
    points = [surface.origin]
    out = np.zeros((1 + len(known), 6, d))
    out[0, :d] = np.eye(d)
    for p, k in enumerate(known, start=1):
        length = 2 * surface.spread[k]
        points.append(surface.origin + length * surface.directions[k])
        theta = turning[p - 1][:, :d] / length
        out[p, 3:] += theta
        out[0, 3:] -= theta
    return np.array(points), out


def _turning(link: Link, directions: list[np.ndarray]) -> list[Float[np.ndarray, "3 3"]] | None:
    """θ = Σ turning_k ∂_k u."""
    if link.d == 2:
        z = np.array([0.0, 0.0, 1.0])
        share = 1.0 if len(directions) == 1 else 0.5
        return [share * np.outer(z, np.cross(z, e)) for e in directions] or None
    if len(directions) == 3:
        return [0.5 * cross_matrix(e) for e in directions]
    if len(directions) < 2:
        return None
    e1, e2 = directions
    n = np.cross(e1, e2)
    return [-np.outer(e2, n) + 0.5 * np.outer(n, e2), np.outer(e1, n) - 0.5 * np.outer(n, e1)]


def station_ports(found: Stations, link: Link) -> tuple[Ports, Float[np.ndarray, "p 6 d"]]:
    """Port points of a line on which a pin slides; u₀ at each."""
    out = np.zeros((len(found.s), 6, link.d))
    k = np.arange(2 if link.planar else 3)
    out[:, k, k] = 1.0
    return found.points, out
