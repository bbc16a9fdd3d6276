"""Constraint rows of joints, couplings and drives.

A body's point is at p + R X (X: reference position, R = I there). All are made of three kinds of elementary rows:

* gap:   b_j · (x_i − x_j)    distance of two points of bodies i and j along a direction b fixed in body j
* turn:  a_i · b_j            cosine of the angle between directions of bodies i and j: zero where they are perpendicular
* angle: rotation of body i against body j about an axis b of both, unwrapped beyond a revolution: the arctangent of
         a_i · e_j − e_i · a_j over a_i · a_j + e_i · e_j, e = b × a: the same for all a across b, also for tilted axes

A constraint is that an elementary row, plus further ones with constant coefficients, less the value of a drive is zero.
"""

from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.vectors import cross

GAP, TURN, ANGLE = 0, 1, 2
Vector = Float[np.ndarray, "3"]
CONSTRAINED = {
    "spherical": ("xyz", ""),
    "universal": ("xyz", ""),  # and the rotation about the normal of its cross
    "revolute": ("xyz", "xy"),
    "weld": ("xyz", "xyz"),
    "prismatic": ("xy", "xyz"),
    "cylindrical": ("xy", "xy"),
    "screw": ("xy", "xy"),  # and the rotation that its travel determines
    "planar": ("z", "xy"),
    "slot": ("xy", ""),
}
"""Axes along and about which each kind constrains translations and rotations; z is the joint's axis."""


@dataclass(frozen=True, slots=True)
class ConstraintEquation:
    """One scalar constraint between bodies i and j (0 is the ground), and others that it is combined with.

    kind : GAP, TURN or ANGLE
    a : gap: point of body i [m]; turn, angle: direction in body i [-]; reference components
    b : direction in body j (angle: the axis), reference components
    joint : name, for messages
    a_j : gap: the point of body j [m]; angle: direction of a in body j at angle zero; None: as a, of a closed joint
    plus : further elementary rows, each with its coefficient
    drive : number of the drive whose value the row takes; None: the row is zero
    """

    kind: int
    i: int
    j: int
    a: Vector
    b: Vector
    joint: str
    a_j: Vector | None = None
    plus: "tuple[tuple[float, ConstraintEquation], ...]" = ()
    drive: int | None = None


def perpendiculars(axis: Vector) -> tuple[Vector, Vector]:
    """Two unit vectors e1, e2 with e1 × e2 = axis."""
    aside = np.eye(3)[np.abs(axis).argmin()]
    e1 = cross(axis, aside)
    e1 /= np.linalg.norm(e1)
    return e1, cross(axis, e1)


def joint_rows(
    kind: str, name: str, i: int, j: int, point: Vector, axis: Vector | tuple[Vector, Vector] | None
) -> list[ConstraintEquation]:
    """Rows of a joint between bodies i and j, of a slot with the pin and the line; of a screw without its lead.

    Parameters
    ----------
    point : of the joint, reference position [m]
    axis : unit vector; of a revolute joint its axis, of what slides its direction, of a planar joint its normal; of a
        universal joint two, in body i and in body j
    """
    meet = [ConstraintEquation(GAP, i, j, point, b, name) for b in np.eye(3)]
    aligned = [ConstraintEquation(TURN, i, j, a, b, name) for a, b in combinations(np.eye(3), 2)]
    if isinstance(axis, tuple):
        return [*meet, ConstraintEquation(TURN, i, j, *axis, name)]
    if axis is None:
        return {"spherical": meet, "weld": meet + aligned}[kind]
    across = perpendiculars(axis)
    upright = [ConstraintEquation(TURN, i, j, axis, b, name) for b in across]
    slides = [ConstraintEquation(GAP, i, j, point, b, name) for b in across]
    return {
        "spherical": meet, "weld": meet + aligned, "revolute": meet + upright,
        "planar": [ConstraintEquation(GAP, i, j, point, axis, name), *upright], "slot": slides,
        "cylindrical": slides + upright, "screw": slides + upright, "prismatic": slides + aligned,
    }[kind]  # fmt: skip


def turn_row(name: str, i: int, j: int, axis: Vector) -> ConstraintEquation:
    """Rotation of body i against body j about an axis."""
    return ConstraintEquation(ANGLE, i, j, perpendiculars(axis)[0], axis, name)


def travel_row(name: str, i: int, j: int, point: Vector, axis: Vector) -> ConstraintEquation:
    """Travel of body i's point against body j along an axis."""
    return ConstraintEquation(GAP, i, j, point, axis, name)


def coupled(row: ConstraintEquation, *others: tuple[float, ConstraintEquation]) -> ConstraintEquation:
    """The constraint that a row, plus others with coefficients, is zero."""
    return replace(row, plus=row.plus + others)


def free_rows(kind: str, name: str, i: int, j: int, point: Vector, axis: Vector | None) -> list[ConstraintEquation]:
    """Rows of the motions that a joint releases, which `joint_rows` does not constrain; i is the body that moves.

    Their rates: of a hinge (ω_i − ω_j) · axis, of a slide (v_i − v_j) · axis. Of balls and crosses they are cosines.
    """
    aligned = [ConstraintEquation(TURN, i, j, a, b, name) for a, b in combinations(np.eye(3), 2)]
    if kind in {"spherical", "universal"}:
        return aligned
    if kind == "weld" or axis is None:
        return []
    turn, travel = turn_row(name, i, j, axis), travel_row(name, i, j, point, axis)
    several = {"prismatic": [travel], "cylindrical": [turn, travel], "slot": [*aligned, travel]}
    several["planar"] = [turn, *(travel_row(name, i, j, point, b) for b in perpendiculars(axis))]
    return several.get(kind, [turn])


@dataclass(frozen=True, slots=True)
class Rows:
    """Constraints as arrays over E elementary rows: first those of the m constraints, then what these are combined with.

    kind, i, j : (E,); a, a_j, b : (E, 3)
    plus : (constraint, elementary row, coefficient) of each further term
    drive : (m,) number of the drive whose value a constraint takes; -1: none
    gaps, angles : numbers of elementary rows of these kinds
    driven : numbers of constraints that take a drive's value
    body, vector : (3 E + 4 A,), (3 E + 4 A, 3) vectors fixed in bodies: a, a_j, b; of angles a, b × a, a_j, b × a_j
    """

    kind: np.ndarray
    i: np.ndarray
    j: np.ndarray
    a: np.ndarray
    a_j: np.ndarray
    b: np.ndarray
    plus: tuple[tuple[int, int, float], ...]
    drive: np.ndarray
    gaps: np.ndarray = field(init=False)
    angles: np.ndarray = field(init=False)
    driven: np.ndarray = field(init=False)
    body: np.ndarray = field(init=False)
    vector: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        k = np.flatnonzero(self.kind == ANGLE)
        i, j, a, a_j, b = self.i[k], self.j[k], self.a[k], self.a_j[k], self.b[k]
        body = np.concatenate([self.i, self.j, self.j, i, i, j, j])
        vector = np.concatenate([self.a, self.a_j, self.b, a, cross(b, a), a_j, cross(b, a_j)])
        gaps, driven = np.flatnonzero(self.kind == GAP), np.flatnonzero(self.drive >= 0)
        derived = {"gaps": gaps, "angles": k, "driven": driven, "body": body, "vector": vector}
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    @property
    def count(self) -> int:
        """Number of constraints."""
        return len(self.drive)

    def scale(self, size: float) -> Float[np.ndarray, " E"]:
        """Factors of the rows: one over size for gaps."""
        return np.where(self.kind == GAP, 1 / size, 1.0)

    def part(self, which: Int[np.ndarray, " k"]) -> "tuple[Rows, Int[np.ndarray, ' a']]":
        """Some of the constraints, and numbers of the angles among their elementary rows."""
        renumbered = {int(k): n for n, k in enumerate(which)}
        plus = [(renumbered[k], row, c) for k, row, c in self.plus if k in renumbered]
        every = np.array([*which, *(row for _, row, _ in plus)], int)
        terms = tuple((k, len(which) + n, c) for n, (k, _, c) in enumerate(plus))
        part = Rows(
            self.kind[every], self.i[every], self.j[every], self.a[every], self.a_j[every], self.b[every],
            terms, self.drive[which],
        )  # fmt: skip
        return part, np.searchsorted(self.angles, every[part.angles])


def stacked(rows: list[ConstraintEquation]) -> Rows:
    """Constraints as arrays, for evaluation all at once."""
    terms = [(k, c, each) for k, row in enumerate(rows) for c, each in row.plus]
    every = rows + [each for _, _, each in terms]
    return Rows(
        kind=np.array([r.kind for r in every], int),
        i=np.array([r.i for r in every], int), j=np.array([r.j for r in every], int),
        a=np.array([r.a for r in every]).reshape(-1, 3), b=np.array([r.b for r in every]).reshape(-1, 3),
        a_j=np.array([r.a if r.a_j is None else r.a_j for r in every]).reshape(-1, 3),
        plus=tuple((k, len(rows) + n, c) for n, (k, c, _) in enumerate(terms)),
        drive=np.array([-1 if r.drive is None else r.drive for r in rows], int),
    )  # fmt: skip
