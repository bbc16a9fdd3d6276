"""Records of shapes of links in the reference position of the scene."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import PurePath
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, StrictBool, model_validator

from kedfem.errors import Fault
from kedfem.scene.records.base import FileName, Record, refuse
from kedfem.scene.records.outlines import Profile
from kedfem.scene.records.points import XYZ, Axis, Point
from kedfem.scene.records.sections import RectangleSection, SectionShape
from kedfem.scene.records.units import Length, PositiveLength, Quantity, fault


def different(points: tuple[XYZ, ...]) -> tuple[XYZ, ...]:
    """Check that all points differ."""
    for P, Q in combinations(points, 2):
        if math.dist(P, Q) == 0.0:
            raise fault(f"must be different points, got ({P[0]:.6g}, {P[1]:.6g}, {P[2]:.6g}) twice")
    return points


def different_but_closed(points: tuple[XYZ, ...]) -> tuple[XYZ, ...]:
    """Check that all points differ; the last may equal the first after at least three different ones."""
    different(points[:-1] if is_closed(points) else points)
    return points


def is_closed(points: Sequence[XYZ]) -> bool:
    """Whether a line through at least three points comes back to the first."""
    return len(points) > 3 and math.dist(points[0], points[-1]) == 0.0


def level(points: tuple[XYZ, XYZ]) -> tuple[XYZ, XYZ]:
    """Check that two points are in one z plane."""
    P, Q = points
    if abs(P[2] - Q[2]) > 1e-9 * math.dist(P, Q):
        raise fault(f"must be two points of the same z [m], got {P[2]:.6g} and {Q[2]:.6g}")
    return points


UPRIGHT = 1 - 1e-6  # least cosine between a line and `up` that count as one direction
STEEP = 0.9  # least cosine between a line and z with which the default of `up` is x

TwoPoints = Annotated[tuple[Point, Point], AfterValidator(different)]


def along_up(pairs: list[tuple[XYZ, XYZ]], up: XYZ | None) -> list[Fault]:
    """Faults of segments along `up`, which leave the direction of the section undefined."""
    for i, (P, Q) in enumerate(pairs if up is not None else ()):
        length = math.dist(P, Q)
        along = sum((q - p) * u for p, q, u in zip(P, Q, up or (), strict=True)) / length
        if abs(along) > UPRIGHT:
            return [Fault(("up",), f"must not be along the line, got that of points[{i}] to points[{i + 1}]")]
    return []


MESH_ENDINGS = (
    ".msh", ".unv", ".bdf", ".nas", ".med", ".mesh", ".inp", ".vtu", ".vtk", ".xdmf", ".xmf", ".e", ".exo",
)  # fmt: skip


class Bar(Record):
    """A straight bar of rectangular section that ends at two points; solid or beam."""

    kind: Literal["bar"] = "bar"
    between: TwoPoints
    """the two ends, in any direction"""
    width: PositiveLength
    """across the line, in the xy plane unless `up` says otherwise"""
    thickness: PositiveLength
    """across line and width: along z for a bar in an xy plane, else as near to `up` as can be"""
    up: Axis | None = None
    """`"x"`, `"y"`, `"z"`, a vector or `{ from = point, to = point }`: the thickness is as near to it as can be; z if not
    given, x for a bar that is steeper than 64°; required of such a bar in a pattern that rotates"""

    @model_validator(mode="after")
    def _not_along_up(self) -> Self:
        refuse(along_up([self.between], self.up))
        return self

    @property
    def upward(self) -> XYZ:
        """The given `up`, or its default."""
        P, Q = self.between
        steep = abs(Q[2] - P[2]) >= STEEP * math.dist(P, Q)
        return self.up or ((1.0, 0.0, 0.0) if steep else (0.0, 0.0, 1.0))


class PlateLink(Record):
    """A plate with an eye and a bore at each of two points, joined by a straight waist; solid."""

    kind: Literal["plate_link"] = "plate_link"
    between: Annotated[TwoPoints, AfterValidator(level)]
    """the centres of the two bores"""
    width: PositiveLength
    """width of the waist, in the xy plane"""
    thickness: PositiveLength
    """along z"""
    eye_diameter: PositiveLength = math.nan
    """outer diameter of the eyes, at least the width; the width if not given"""
    bore_diameter: PositiveLength
    """diameter of the bores, smaller than the eyes"""
    offset: Length = 0.0
    """distance of the middle plane from the points, along z"""

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        eye = self.width if math.isnan(self.eye_diameter) else self.eye_diameter
        length = math.dist(*self.between)
        faults: list[Fault] = []
        if eye < self.width:
            wanted = f"must be at least the width {self.width:.6g} [m]"
            faults.append(Fault(("eye_diameter",), f"{wanted}, got {eye:.6g}"))
        if self.bore_diameter >= eye:
            message = f"must be smaller than the eye {eye:.6g} [m], got {self.bore_diameter:.6g}"
            faults.append(Fault(("bore_diameter",), message))
        elif self.bore_diameter >= length:
            message = f"must be smaller than their distance {length:.6g} [m], got {self.bore_diameter:.6g}"
            faults.append(Fault(("bore_diameter",), message))
        refuse(faults)
        return self.fill(eye_diameter=eye)


class Extrusion(Profile):
    """A plate of arbitrary outline with round holes; solid."""

    kind: Literal["extrusion"] = "extrusion"
    offset: Length = 0.0
    """distance of the middle plane from the outline, along z"""


class Part(Record):
    """A plate from a file of its own (see *The file of a part*), placed between two points; solid."""

    kind: Literal["part"] = "part"
    file: FileName
    """the file of the part, .toml, relative to the scene file; where it is given `kind` may be left out"""
    between: Annotated[TwoPoints, AfterValidator(level)]
    """where the part's `origin` and `x_point` go; they must be as far apart as these"""


class Polyline(Record):
    """A line through points, with straight segments or smooth, of one section; beam."""

    kind: Literal["polyline"] = "polyline"
    points: Annotated[tuple[Point, ...], AfterValidator(different_but_closed)] = Field(min_length=2)
    """its corners, at least two; with the first once more at the end it is a closed frame"""
    smooth: StrictBool = False
    """whether it is a smooth curve (a cubic spline) through the points, else straight with rigid corners"""
    width: PositiveLength | None = None
    """of a rectangular section, across the line, in the xy plane"""
    thickness: PositiveLength | None = None
    """of a rectangular section, across line and width: along z if the line is in an xy plane"""
    section: SectionShape | None = None
    """another section, instead of width and thickness"""
    up: Axis | None = None
    """`"x"`, `"y"`, `"z"`, a vector or `{ from = point, to = point }`: the thickness is as near to it as can be (on a
    smooth curve: at its first point); z if not given, x for a segment that is steeper than 64°; required of such a
    line in a pattern that rotates, whatever its section"""

    @model_validator(mode="after")
    def _one_section(self) -> Self:
        given = [key for key in ("width", "thickness") if getattr(self, key) is not None]
        faults: list[Fault] = []
        if self.section is not None and given:
            faults.append(Fault(("section",), f"cannot be combined with {' and '.join(given)}, got both"))
        elif self.section is None:
            other = "a section instead of width and thickness"
            lacking = [key for key in ("width", "thickness") if key not in given]
            faults += [Fault((key,), f"is required [m], or {other}, got nothing") for key in lacking]
        if self.smooth and is_closed(self.points):
            wanted = "must be left out of a line that ends where it begins"
            faults.append(Fault(("smooth",), f"{wanted}, whose corners are straight, got true"))
        pairs = list(pairwise(self.points))[: 1 if self.smooth else None]
        refuse([*faults, *along_up(pairs, self.up)])
        return self

    @property
    def of_section(self) -> SectionShape:
        """The section, which is a rectangle if width and thickness are given."""
        if self.section is not None:
            return self.section
        return RectangleSection(width=self.width or math.nan, thickness=self.thickness or math.nan)


class _FromFile(Record):
    """Base class of shapes from files of other programs."""

    kind: str
    file: FileName
    origin: Point = (0.0, 0.0, 0.0)
    """where the file's origin goes; if neither this nor `towards` nor `z` is given, its coordinates are the scene's"""
    towards: Point | None = None
    """a point that the file's x axis goes to point at, from `origin`; along global x if not given"""
    z: Axis | None = None
    """`"x"`, `"y"`, `"z"` or a vector: where the file's z axis goes, as near as its x axis allows; z if not given"""


class MeshFile(_FromFile):
    """A mesh of hexahedra or tetrahedra of order 1 or 2, or of several kinds, in a file of another program; solid."""

    kind: Literal["mesh"] = "mesh"
    file: FileName
    """the mesh file, relative to the scene file: .msh, .unv, .bdf, .nas, .med, .mesh, .inp, .vtu, .vtk, .xdmf, .xmf,
    .e or .exo; where it is given `kind` may be left out"""
    scale: Annotated[float, Quantity("1", above=0.0)] = 1.0
    """metres per unit of the file: 0.001 for a file in millimetres"""


class Cad(_FromFile):
    """A part from CAD (STEP, IGES or BREP), of hexahedra or tetrahedra."""

    kind: Literal["cad"] = "cad"
    file: FileName
    """the file, relative to the scene file; its ending says what it is: .step, .stp, .iges, .igs, .brep; where it is
    given `kind` may be left out"""
    solid: str | None = None
    """which solid of an assembly; if not given the one with the link's name; of a file with one solid that one"""
    scale: Annotated[float, Quantity("1", above=0.0)] | None = None
    """metres per unit of the file; if not given the file's own unit, of BREP files, which have none, 0.001"""


def with_kind(shape: Any) -> Any:
    """Add to a raw shape from a file the kind that the file's ending tells; return any other input unchanged."""
    if not isinstance(shape, Mapping) or "kind" in shape or not isinstance(shape.get("file"), str):
        return shape
    ending = PurePath(shape["file"]).suffix.lower()
    return {"kind": "part" if ending == ".toml" else "mesh" if ending in MESH_ENDINGS else "cad", **shape}


AnyShape = Bar | PlateLink | Extrusion | Part | Polyline | MeshFile | Cad
Shape = Annotated[Annotated[AnyShape, Field(discriminator="kind")], BeforeValidator(with_kind)]


class PartGeometry(Profile):
    """Geometry of a part in a separate TOML file, in coordinates of the part."""

    origin: Point
    """the point that goes to the first of the link's points"""
    x_point: Point
    """the point that goes to the second"""

    @model_validator(mode="after")
    def _has_a_direction(self) -> Self:
        same = math.dist(self.origin, self.x_point) == 0.0
        refuse([Fault(("x_point",), "must differ from the origin, got the same point")] if same else [])
        return self
