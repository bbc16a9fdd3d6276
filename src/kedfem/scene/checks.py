"""Cross checks: names that must exist, keys that must suit each other. Each check yields fault lines.

They look at what was given, not only at good records, so that a fault in one key hides no fault in another.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from pydantic_core import PydanticCustomError

from kedfem.scene.analysis import ELASTIC
from kedfem.scene.drives import SLIDING, TURNING
from kedfem.scene.faults import either, line, place
from kedfem.scene.files import sketched
from kedfem.scene.links import DIRECTED, GROUND, SQUARE
from kedfem.scene.moving_joints import moving_grounds_of
from kedfem.scene.parts import Entry, Parts, fidelity, link_names
from kedfem.scene.wording import shown, unknown_name

if TYPE_CHECKING:
    pass

SHAPES = {
    "solid": ["bar", "plate_link", "extrusion", "part", "mesh", "cad"],
    "plane": ["bar", "plate_link", "extrusion", "part"],
    "beam": ["bar", "polyline"],
}
ELEMENTS = {
    "solid": ["hex27", "hex20", "hex8", "tet10"],
    "plane": ["quad9"],
    "beam": ["beam3", "beam2", "beam4", "beam5", "beam7", "beam9"],
}
NOUNS = {"solid": "solid", "plane": "plane link", "beam": "beam"}


def reference_faults(parts: Parts) -> Iterator[str]:
    """Names of materials, links and joints that do not exist."""
    for link in parts.links.values():
        material = link.word("material")
        if material is not None and material not in parts.materials:
            yield link.fault("material", unknown_name("a material", material, parts.materials))
    for joint in parts.joints.values() if parts.links else ():
        for i, name in enumerate(link_names(joint)):
            if name not in parts.links and name != GROUND:
                yield joint.fault("links", unknown_name("a link", name, [*parts.links, GROUND]), i)
    for user in [*parts.loads.values(), *parts.bodies.values(), *parts.probes.values()]:
        link_name = user.word("link")
        if link_name is not None and parts.links and link_name not in parts.links:
            yield user.fault("link", unknown_name("a link", link_name, parts.links))
    for drive in parts.all_drives:
        joint_name = drive.word("joint")
        if joint_name is not None and parts.joints and joint_name not in parts.joints:
            yield drive.fault("joint", unknown_name("a joint", joint_name, parts.joints))


def link_faults(parts: Parts) -> Iterator[str]:
    """Links whose keys do not suit their fidelity."""
    for link in parts.links.values():
        if link.name == GROUND:
            yield line(link.where, "must have another name, got that of the frame")
        if fidelity(link) == "rigid":
            yield from rigid_faults(link, parts)
            yield from meshing_faults(link)
        elif fidelity(link) in SHAPES:
            yield from elastic_faults(link)
            yield from meshing_faults(link)


def rigid_faults(link: Entry, parts: Parts) -> Iterator[str]:
    """A rigid link without a shape that is not a slider, or keys of an elastic one."""
    on = [joint for joint in parts.joints.values() if link.name in link_names(joint)]
    slides, rides = any(map(is_slide, on)), any(joint.word("kind") == "prismatic" for joint in on)
    slides = slides or link.name in moving_grounds_of(parts)
    if link.has("inertia") or link.has(
        "centre"
    ):  # a rigid body by numbers, with a fault that its record tells
        return
    if link.has("shape"):
        if not link.has("material"):
            yield link.fault("material", "is required for a rigid link with a shape, got nothing")
        if link.record is not None and link.record.mass:
            got = f"got {link.record.mass:.6g} for a link with a shape"
            yield link.fault("mass", f"must be given for a rigid slider only [kg], {got}")
    else:
        if not slides and not sketched.get():
            wanted = (
                "is required for a rigid link that is neither a slider (a prismatic joint to the ground) nor a "
                "moving part of the ground (held by a driven joint alone); or give its mass, centre and inertia"
            )
            yield link.fault("shape", f"{wanted}, got nothing")
        if sketched.get() and not rides and link.record is not None and link.record.mass:
            got = f"got {link.record.mass:.6g} without a prismatic joint"
            yield link.fault("mass", f"must be that of what slides [kg], {got}")
        for key in ("material", "element"):
            if link.has(key):
                got = link.word(key) or "one"
                yield link.fault(key, f"must not be given for a rigid link without a shape, got {got!r}")
    for key in ("reduced", "modes"):
        if link.has(key) and link.raw[key] is not False:
            yield link.fault(key, f"must be left out for a rigid link, got {shown(link.raw[key])}")


def is_slide(joint: Entry) -> bool:
    """Whether a joint is a slider's."""
    return joint.word("kind") == "prismatic" and GROUND in link_names(joint)


def elastic_faults(link: Entry) -> Iterator[str]:
    """Missing or unsuitable keys of an elastic link."""
    kind, shape, element = fidelity(link), link.word("shape", "kind"), link.word("element")
    noun = NOUNS[kind]
    for key in () if sketched.get() else ("shape", "material"):
        if not link.has(key):
            yield link.fault(key, f"is required for a {noun}, got nothing")
    every_shape = {name for names in SHAPES.values() for name in names}
    if shape in every_shape and shape not in SHAPES[kind]:
        yield link.fault("shape", f"must be {either(SHAPES[kind])} for a {noun}, got {shape!r}", "kind")
    every_element = {name for names in ELEMENTS.values() for name in names}
    if element in every_element and element not in ELEMENTS[kind]:
        yield link.fault("element", f"must be {either(ELEMENTS[kind])} for a {noun}, got {element!r}")
    if link.has("modes") and not (link.raw.get("reduced") is True or link.word("fidelity") == "reduced"):
        yield link.fault("modes", f"must be combined with reduced = true, got {shown(link.raw['modes'])}")
    if link.record is not None and link.record.mass:
        yield link.fault(
            "mass", f"must be given for a rigid link only [kg], got {link.record.mass:.6g} for a {noun}"
        )


def meshing_faults(link: Entry) -> Iterator[str]:
    """Keys of `mesh` that do not suit the shape."""
    shape, mesh = link.word("shape", "kind"), link.raw.get("mesh")
    if not isinstance(mesh, Mapping):
        return
    part = {"cad"}, "a part from CAD"
    arcs = {"cad", "extrusion", "part"}, "a part from CAD, an extrusion or a part"
    sized = {*arcs[0], "plate_link"}, "a part from CAD, an extrusion, a part or a plate link"
    for key, (shapes, only) in {
        "unknowns": sized, "defeature_size": part, "kind": part, "fillet_angle": arcs
    }.items():  # fmt: skip
        if link.has("mesh", key) and shape not in shapes:
            yield link.fault("mesh", f"must be given for {only} only, got one for a {shape}", key)
    counted = "beam" if fidelity(link) == "beam" else "bar" if shape == "bar" else None
    if fidelity(link) == "plane" and link.has("mesh", "layers"):
        wanted = "must be left out for a plane link (it has one element through its thickness)"
        yield link.fault("mesh", f"{wanted}, got {shown(mesh['layers'])}", "layers")
    if counted is not None:
        for key in ("size", "elements_across"):
            if link.has("mesh", key):
                got = f"got {shown(mesh[key])}"
                yield link.fault("mesh", f"must be left out for a {counted} (it has elements), {got}", key)
        yield from count_faults(link, counted)
    elif shape in SHAPES["solid"]:
        if link.has("mesh", "elements"):
            got = f"got {shown(mesh['elements'])}"
            wanted = f"must be left out for a {shape} (it has size or elements_across)"
            yield link.fault("mesh", f"{wanted}, {got}", "elements")
        for key, other in (
            ("size", "elements_across"),
            ("unknowns", "size"),
            ("unknowns", "elements_across"),
        ):
            if link.has("mesh", key) and link.has("mesh", other):
                yield link.fault("mesh", f"cannot be combined with {other}, got both", key)


def count_faults(link: Entry, counted: str) -> Iterator[str]:
    """Numbers of elements that are not as many as needed."""
    elements = link.record.mesh.elements if link.record is not None else None
    if counted == "beam" and isinstance(elements, tuple):
        wanted = "must be one number, per segment, for a beam"
        yield link.fault("mesh", f"{wanted}, got {list(elements)}", "elements")
    if counted == "bar" and elements is not None:
        count, wanted = 3, "must be three numbers for a solid bar: along, across, thickness"
        if fidelity(link) == "plane":
            count, wanted = 2, "must be two numbers for a bar as a plane link: along, across"
        if isinstance(elements, int) or len(elements) != count:
            got = elements if isinstance(elements, int) else list(elements)
            yield link.fault("mesh", f"{wanted}, got {got}", "elements")


def joint_faults(parts: Parts) -> Iterator[str]:
    """Joints that join nothing, and links that nothing joins."""
    for joint in parts.joints.values():
        names = link_names(joint)
        if names == [GROUND, GROUND]:
            yield joint.fault("links", "must hold a link, got the ground twice")
        elif len(names) == 2 and names[0] == names[1]:
            yield joint.fault("links", f"must be two different links, got {names[0]!r} twice")
        yield from seat_faults(joint, parts)
        yield from direction_faults(joint)
    pairs = (
        [link_names(joint) for joint in parts.joints.values()] if parts.driven else []
    )  # else links may fly
    reached = connected(GROUND, pairs)
    for link in parts.links.values() if pairs else ():
        if not any(link.name in pair for pair in pairs):
            yield line(link.where, "must be held by a joint, got none")
        elif link.name not in reached:
            yield line(link.where, "must be connected with the ground through joints, got no way there")


def direction_faults(joint: Entry) -> Iterator[str]:
    """Joints without the directions or the lead that they need, or with those of other kinds."""
    kind = joint.word("kind")
    if kind in DIRECTED and not joint.has("axis"):
        yield joint.fault("axis", f"is required for a {kind} joint: 'x', 'y', 'z' or a vector, got nothing")
    for key, owner, wanted in (
        (
            "axes",
            "universal",
            "is required for a universal joint: two axes, of the first link and of the second",
        ),
        ("lead", "screw", "is required for a screw [m], travel in one revolution"),
    ):
        if kind == owner and not joint.has(key):
            yield joint.fault(key, f"{wanted}, got nothing")
        if kind != owner and joint.has(key):
            yield joint.fault(key, f"must be given for a {owner} joint only, got one for a {kind} joint")
    if kind == "universal" and joint.has("axis"):
        yield joint.fault("axis", "must be left out for a universal joint (it has axes), got one")
    axes = joint.record.axes if joint.record is not None else None
    if axes is not None and abs(cosine := sum(a * b for a, b in zip(*axes, strict=True))) > SQUARE:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, cosine))))
        yield joint.fault("axes", f"must be at right angles to each other, got {angle:.6g} deg")
    if joint.record is not None and joint.record.lead == 0.0:
        yield joint.fault("lead", "must not be zero [m] (a screw without lead is a revolute joint), got 0")


def seat_faults(joint: Entry, parts: Parts) -> Iterator[str]:
    """Ports and faces of links that the joint does not join, and faces of links that have none."""
    names = link_names(joint)
    for key in ("coupling", "faces"):
        given = joint.raw.get(key)
        for name in given if isinstance(given, Mapping) else ():
            link = parts.links.get(name)
            if name not in names or name == GROUND:
                own = [each for each in names if each != GROUND]
                yield joint.fault(key, unknown_name("a link of the joint", str(name), own))
            elif key == "faces" and link is not None and fidelity(link) not in {"solid", "rigid"}:
                noun = NOUNS.get(fidelity(link), fidelity(link))
                yield joint.fault(key, f"must name faces of a solid, got {name!r}, which is a {noun}", name)


def connected(start: str, pairs: list[list[str]]) -> set[str]:
    """The names that pairs connect with a first one."""
    reached = {start}
    while more := {name for pair in pairs if reached & set(pair) for name in pair} - reached:
        reached |= more
    return reached


def drive_faults(parts: Parts) -> Iterator[str]:
    """Drives on joints that cannot be driven, or twice, or with a law for another kind of joint."""
    if parts.drive.where and parts.drives:
        yield line(("drives",), "cannot be combined with drive, got both")
    met: dict[str, Entry] = {}
    for drive in parts.all_drives:
        joint = parts.joints.get(drive.word("joint") or "")
        if joint is None:
            continue
        if joint.name in met:
            other = place(met[joint.name].where)
            yield drive.fault("joint", f"must name a joint of its own, got {joint.name!r} as in {other}")
        met[joint.name] = drive
        kind = joint.word("kind")
        if kind in {"revolute", "prismatic"}:
            yield from law_faults(drive, str(kind))


def law_faults(drive: Entry, kind: str) -> Iterator[str]:
    """A law of motion that is one of angles on a slide, or of travel on a hinge."""
    motion = drive.raw.get("motion")
    if not isinstance(motion, Mapping):
        return
    wanted, other = ("travel", "angle") if kind == "prismatic" else ("angle", "travel")
    if motion.get(other) is not None:
        article = "an" if other == "angle" else "a"
        yield drive.fault(
            "motion", f"must be given as {wanted} of a {kind} joint, got {article} {other}", other
        )
    if (speed := motion.get("speed")) is not None:
        try:
            (SLIDING if kind == "prismatic" else TURNING).number(speed)
        except PydanticCustomError as reason:
            yield drive.fault("motion", reason.message(), "speed")


def gear_faults(parts: Parts) -> Iterator[str]:
    """Gears on joints that do not exist."""
    for gear in parts.gears.values():
        names = gear.raw.get("joints")
        if not isinstance(names, (list, tuple)) or len(names) != 2:
            continue
        if names[0] == names[1]:
            yield gear.fault("joints", f"must be two different joints, got {names[0]!r} twice")
        for i, name in enumerate(names):
            if parts.joints and not (isinstance(name, str) and name in parts.joints):
                yield gear.fault("joints", unknown_name("a joint", str(name), parts.joints), i)


def load_faults(parts: Parts) -> Iterator[str]:
    """Loads, bodies and probes that do not suit their link."""
    for load in parts.loads.values():
        link = parts.links.get(load.word("link") or "")
        kind = load.word("kind")
        if link is None:
            continue
        if kind == "torque" and load.word("joint") is not None and parts.joints:
            yield from torque_joint_faults(load, parts)
    for probe in parts.probes.values():
        link, quantity = parts.links.get(probe.word("link") or ""), probe.word("quantity")
        if link is not None and fidelity(link) == "rigid" and quantity in {"stress", "deflection"}:
            got = f"got {link.name!r}, which is rigid"
            yield probe.fault("link", f"must name an elastic link for a {quantity}, {got}")
        if quantity in ELASTIC and not parts.driven:
            wanted = "position, travel or deflection" if quantity == "displacement" else f"total_{quantity}"
            why = "without a drive (there is no rigid motion to compare with)"
            yield probe.fault("quantity", f"must be {wanted} {why}, got {quantity!r}")
    for body in parts.bodies.values():
        yield from flywheel_faults(body, parts)


def torque_joint_faults(load: Entry, parts: Parts) -> Iterator[str]:
    """A torque at a joint that is not one of its link."""
    here = [joint.name for joint in parts.joints.values() if load.word("link") in link_names(joint)]
    if load.word("joint") not in here:
        yield load.fault("joint", unknown_name("a joint of the link", str(load.word("joint")), here))


def flywheel_faults(body: Entry, parts: Parts) -> Iterator[str]:
    """A flywheel away from the hinges of its link."""
    link_name = body.word("link")
    if body.record is None or body.word("kind") != "flywheel" or link_name not in parts.links:
        return
    hinges = [
        joint
        for joint in parts.joints.values()
        if link_name in link_names(joint) and joint.word("kind") != "prismatic"
    ]
    if any(joint.record is None for joint in hinges):
        return
    turning = [
        joint.record.on(link_name)
        for joint in hinges
        if joint.record.kind in {"revolute", "cylindrical", "screw"}
    ]
    apart = [
        math.dist(joint.record.on(link_name), body.record.at)
        for joint in parts.joints.values()
        if joint.record
    ]
    near = 1e-9 + 1e-7 * max(apart, default=0.0)
    if not any(not math.dist(at, body.record.at) > near for at in turning):
        at = ", ".join(f"{part:.6g}" for part in body.record.at)
        yield body.fault("at", f"must be the point of a revolute joint of links.{link_name} [m], got ({at})")
