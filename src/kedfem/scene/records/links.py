"""Links and joints of the scene."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, StrictInt, model_validator

from kedfem.errors import Fault, SceneError
from kedfem.scene.records.base import MaterialName, Record, refuse
from kedfem.scene.records.loads import Moments, inertia_faults
from kedfem.scene.records.points import Point
from kedfem.scene.records.shapes import Bar, Cad, Polyline, Shape
from kedfem.scene.records.units import Mass, PositiveLength, Quantity, fault
from kedfem.scene.records.wording import one_of, shown

GROUND = "ground"
ELEMENTS: dict[str, Any] = {"solid": "hex20", "plane": "quad9", "beam": "beam3"}
Element = Literal["hex27", "hex20", "hex8", "tet10", "quad9", "beam3", "beam2", "beam4", "beam5", "beam7", "beam9"]
Count = Annotated[StrictInt, Field(ge=1)]
Frames = Literal["rigid-body", "co-rotational"]


def counts(value: object) -> object:
    """One, two or three numbers of elements."""
    if value is None:
        return None
    several = value if isinstance(value, (list, tuple)) else [value]
    whole = all(isinstance(number, int) and not isinstance(number, bool) and number > 0 for number in several)
    if not whole or len(several) not in {1, 2, 3}:
        raise fault(f"must be one, two or three whole numbers of at least 1, got {value!r}")
    return several[0] if len(several) == 1 else tuple(several)


class Meshing(Record):
    """Mesh of a link: element sizes or numbers, and element type."""

    elements: Annotated[int | tuple[int, int] | tuple[int, int, int] | None, BeforeValidator(counts)] = None
    """bar: numbers along and across, of a solid also through the thickness; beam: number per segment
    (1 if not given; of a bar that is the line of a slot so many that it has four nodes at least); joints and bodies
    between its corners begin segments of their own"""
    size: PositiveLength | None = None
    """other shapes: edge length of the elements, instead of `elements_across`"""
    elements_across: Count | None = None
    """other shapes: number across the smallest width; 2 if neither this nor `size` is given"""
    layers: Count = 1
    """other shapes, solid: number through the thickness; of a part from CAD the least through each of its layers"""
    unknowns: Annotated[StrictInt, Field(ge=100)] | None = None
    """other shapes: about so many unknowns, instead of `size` or `elements_across`"""
    defeature_size: PositiveLength | None = None
    """a part from CAD: rounds of less radius, chamfers of shorter sides and grooves are left out where it can be swept
    then, concave ones too; if not given, convex ones below 1.5 % of its size; none where a joint, load or probe sits"""
    fillet_angle: Annotated[float, Quantity("rad", least=math.radians(2), most=math.radians(45))] | None = None
    """a part from CAD, extrusion or part: largest angle of an element along a fillet, or a bore without a joint; if not
    given 22.5° of extrusions and parts, 45° of CAD that is swept, 30° of tetrahedra; where `analysis.accuracy` finds the
    mesh open 15° to 45°"""
    kind: Literal["hexahedra"] | None = None
    """a part from CAD: hexahedra where nothing can be swept too, four in each tetrahedron; tetrahedra if not given"""


def checked_reduction(value: object) -> object:
    """Whether a link is reduced, or to how many modes."""
    if value in {"none", "modal"} or (isinstance(value, int) and not isinstance(value, bool) and value >= 1):
        return value
    raise fault(f"must be 'none', 'modal' or a number of modes, got {shown(value)}")


class LinkScene(Record):
    """A link: its material, shape, model and mesh."""

    model: Literal["solid", "plane", "beam", "rigid", "auto"] | None = None
    """hexahedra or tetrahedra, quadrilaterals in plane stress, beams, a rigid body; `auto`: the cheapest of these for
    `analysis.accuracy`, and the default if that and no `reduction` is given, else a solid, of a polyline a beam"""
    reduction: Annotated[Literal["none", "modal"] | Count, BeforeValidator(checked_reduction)] = "none"
    """whether an elastic link moves in the span of a few modes only: `modal`: as many as `analysis.reduction_tolerance`
    asks for, or their number; with co-rotational frames those of each segment, and beams stay unreduced"""
    material: MaterialName | None = None
    """a name: built in or in `materials`; not for a rigid slider"""
    shape: Shape | None = None
    """its shape; not for a rigid link given by mass, centre and inertia, a rigid slider or a moving part of the ground"""
    mass: Mass = 0.0
    """mass of a rigid link without a shape: of one with `centre` and `inertia`, of a slider, whose rotation a prismatic
    joint constrains and whose mass is at its first other joint, or of a part of the ground, which drives alone move"""
    centre: Point | None = None
    """of a rigid link given by mass, centre and inertia instead of a shape: its centre in the reference position"""
    inertia: Moments | None = None
    """of the same: tensor about its centre in the reference position, along x, y, z of the scene: Ixx, Iyy, Izz, Ixy,
    Iyz, Izx, with Ixy = −∫xy dm and so on; three values: Ixx, Iyy, Izz where x, y, z are principal axes"""
    mesh: Meshing = Meshing()
    """how it is meshed"""
    element: Element | None = None
    """hex20 (or hex27, hex8, tet10) for a solid, hex27 (or these) for one from CAD, quad9 for a plane link, beam3 (or
    beam2, 4, 5, 7, 9: nodes per element) for a beam"""
    min_quality: Annotated[float, Quantity("1", least=0.0, most=1.0)] | None = None
    """least scaled Jacobian of the elements of a solid or plane link; if not given 0.1, of tetrahedra 0: det J > 0 all
    over"""
    shear_coefficient: Annotated[float, Quantity("1", above=0.0, most=1.0)] | None = None
    """part of the section that carries the shear force; if not given: 5/6, Cowper's of circles, boxes and webs"""
    beam: Literal["planar", "spatial"] | None = None
    """what moves of a beam: (u, v, ψ) in a plane z = constant, or all in space; if not given, planar where it can be"""
    frames: Frames | None = None
    """frames of this link, if other than those of the analysis"""
    segments: Count | None = None
    """number of segments, each with a frame of its own, of a solid or plane link with co-rotational frames: 6 if not
    given, fewer where its mesh has fewer layers or it is stubby; chosen where `analysis.accuracy` is given; those of a
    beam are its elements"""

    @model_validator(mode="after")
    def _defaults(self) -> Self:
        refuse(self._body_faults())
        self.fill(model=self.model or self.family)
        element = self.element or self._usual_element()
        return self.fill(element=element, mesh=self.mesh.model_copy(update=self._mesh_defaults()))

    def _body_faults(self) -> list[Fault]:
        """Faults of a link given by mass, centre and inertia, or by its mass alone."""
        if self.model is None and not (self.shape or self.material) and (self.mass or self.centre or self.inertia):
            return [Fault(("model",), "must be 'rigid' for a link given by its mass, without a shape, got nothing")]
        if self.centre is None and self.inertia is None:
            return []
        if self.model != "rigid":
            keys = [key for key in ("centre", "inertia") if getattr(self, key) is not None]
            wanted = f"must be given for a rigid link only, got model {self.model or self.family!r}"
            return [Fault((key,), wanted) for key in keys]
        present = [key for key in ("shape", "material") if getattr(self, key) is not None]
        if present:
            together = " and ".join(present)
            return [Fault((present[0],), f"cannot be combined with centre and inertia, got {together}")]
        wanted = "is required for a rigid link given by mass, centre and inertia"
        every = {"mass": "[kg], got 0", "centre": "[m], got nothing", "inertia": "[kg*m^2], got nothing"}
        lacking = [Fault((key,), f"{wanted} {got}") for key, got in every.items() if not getattr(self, key)]
        return [*lacking, *(inertia_faults(self.inertia) if self.inertia is not None else ())]

    def _usual_element(self) -> str | None:
        """Default element type of a part from CAD, which may be curved: the one whose geometry has the highest order."""
        if isinstance(self.shape, Cad) and self.family == "solid":
            return "hex27"
        return ELEMENTS[self.family] if self.shape is not None else None

    @property
    def family(self) -> Literal["solid", "plane", "beam"]:
        """Family of elements of the link; by default beams for a polyline, else hexahedra."""
        if self.model in {"rigid", "auto", None}:
            return "beam" if isinstance(self.shape, Polyline) else "solid"
        return self.model  # type: ignore[return-value]

    @property
    def reduced(self) -> bool:
        """Whether the link is reduced to a few modes."""
        return self.reduction != "none"

    @property
    def modes(self) -> int | None:
        """Number of these modes; None for as many as a tolerance requires."""
        return self.reduction if isinstance(self.reduction, int) else None

    @property
    def category(self) -> Literal["solid", "plane", "beam", "rigid"]:
        """Category of the link: rigid, or the family of its elements."""
        return "rigid" if self.model == "rigid" else self.family

    @property
    def rigid_line(self) -> bool:
        """Whether the link is a rigid polyline, which consists of beams."""
        return self.model == "rigid" and isinstance(self.shape, Polyline)

    def _mesh_defaults(self) -> dict[str, Any]:
        if self.shape is None:
            return {}
        if self.family == "beam":
            return {"elements": self.mesh.elements or 1}
        if isinstance(self.shape, Bar):
            along = math.dist(*self.shape.between) / (1.5 * self.shape.width)
            along = min(max(math.ceil(along), 4), 40) if math.isfinite(along) else 4
            usual = (along, 2) if self.family == "plane" else (along, 2, 1)
            if self.model == "rigid":
                usual = (1, 1, 1)
            return {"elements": self.mesh.elements or usual}
        fewest = 1 if self.model == "rigid" else 2
        given = self.mesh.size is not None or self.mesh.unknowns is not None
        across = self.mesh.elements_across or (None if given else fewest)
        return {"elements_across": across}


def require_elastic(links: Mapping[str, LinkScene], name: str) -> None:
    """An elastic link of a scene, named by --link."""
    if name not in links:
        raise SceneError(f"--link: {one_of(list(links), name)}")
    if links[name].model == "rigid":
        raise SceneError("--link: must be an elastic link, got a rigid one")
