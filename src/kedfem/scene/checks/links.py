"""Cross checks of the keys of links, their meshes, frames and segments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations as pairs

from kedfem.errors import Fault
from kedfem.scene.checks.combinations import frames_of, slider
from kedfem.scene.checks.parts import Entry, Parts, category, link_names
from kedfem.scene.questions.modelling import moving_grounds
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.wording import NOUNS, either, shown

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


def link_faults(parts: Parts) -> Iterator[Fault]:
    """Keys of links that do not suit the model."""
    for link in parts.links.values():
        if link.name == GROUND:
            yield Fault(link.where, "must have another name, got that of the frame")
        if category(link) == "rigid":
            yield from rigid_faults(link, parts)
            yield from meshing_faults(link)
        elif category(link) in SHAPES:
            yield from elastic_faults(link, parts.sketch)
            yield from meshing_faults(link)


def rigid_faults(link: Entry, parts: Parts) -> Iterator[Fault]:
    """Missing or unsuitable keys of a rigid link."""
    on = [joint for joint in parts.joints.values() if link.name in link_names(joint)]
    riding = [joint for joint in on if joint.word("kind") == "prismatic"]
    slides = riding or link.record is None or link.name in moving_grounds(parts.good)
    if link.has("inertia") or link.has("centre"):  # given by mass, centre and inertia, which its record checks
        return
    if link.has("shape"):
        if not link.has("material"):
            yield link.fault("material", "is required for a rigid link with a shape, got nothing")
        if link.record is not None and link.record.mass:
            got = f"got {link.record.mass:.6g} for a link with a shape"
            yield link.fault("mass", f"must be given for a rigid slider only [kg], {got}")
    else:
        if not slides and not parts.sketch:
            wanted = (
                "is required for a rigid link that is neither a slider (on a prismatic joint) nor a "
                "moving part of the ground (held by a driven joint alone); or give its mass, centre and inertia"
            )
            yield link.fault("shape", f"{wanted}, got nothing")
        if parts.sketch and not riding and link.record is not None and link.record.mass:
            got = f"got {link.record.mass:.6g} without a prismatic joint"
            yield link.fault("mass", f"must be that of what slides [kg], {got}")
        for key in ("material", "element"):
            if link.has(key):
                got = link.word(key) or "one"
                yield link.fault(key, f"must not be given for a rigid link without a shape, got {got!r}")
    if link.has("reduction") and link.raw["reduction"] != "none":
        reduced = shown(link.raw["reduction"])
        yield link.fault("reduction", f"must be left out for a rigid link, got {reduced}")


def elastic_faults(link: Entry, sketch: bool) -> Iterator[Fault]:
    """Missing or unsuitable keys of an elastic link."""
    kind, shape, element = category(link), link.word("shape", "kind"), link.word("element")
    noun, by_numbers = NOUNS[kind], any(map(link.has, ("mass", "centre", "inertia")))
    if by_numbers and not any(map(link.has, ("model", "shape", "material"))):  # a rigid link, which its record requires
        return
    for key in () if sketch else ("shape", "material"):
        if not link.has(key):
            yield link.fault(key, f"is required for a {noun}, got nothing")
    every_shape = {name for names in SHAPES.values() for name in names}
    if shape in every_shape and shape not in SHAPES[kind]:
        yield link.fault("shape", f"must be {either(SHAPES[kind])} for a {noun}, got {shape!r}", "kind")
    every_element = {name for names in ELEMENTS.values() for name in names}
    if element in every_element and element not in ELEMENTS[kind]:
        yield link.fault("element", f"must be {either(ELEMENTS[kind])} for a {noun}, got {element!r}")
    if link.record is not None and link.record.mass:
        got = f"got {link.record.mass:.6g} for a {noun}"
        yield link.fault("mass", f"must be given for a rigid link only (model = 'rigid') [kg], {got}")


def meshing_faults(link: Entry) -> Iterator[Fault]:
    """Keys of `mesh` that do not suit the shape."""
    shape, mesh = link.word("shape", "kind"), link.raw.get("mesh")
    if not isinstance(mesh, Mapping):
        return
    part = {"cad"}, "a part from CAD"
    arcs = {"cad", "extrusion", "part"}, "a part from CAD, an extrusion or a part"
    sized = {*arcs[0], "plate_link"}, "a part from CAD, an extrusion, a part or a plate link"
    owners = {"unknowns": sized, "defeature_size": part, "kind": part, "fillet_angle": arcs}
    for key, (shapes, only) in owners.items():
        if link.has("mesh", key) and shape not in shapes:
            yield link.fault("mesh", f"must be given for {only} only, got one for a {shape}", key)
    counted = "beam" if category(link) == "beam" else "bar" if shape == "bar" else None
    if category(link) == "plane" and link.has("mesh", "layers"):
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
        for key, other in pairs(("unknowns", "size", "elements_across"), 2):
            if link.has("mesh", key) and link.has("mesh", other):
                yield link.fault("mesh", f"cannot be combined with {other}, got both", key)


def count_faults(link: Entry, counted: str) -> Iterator[Fault]:
    """A wrong count of numbers of elements."""
    elements = link.record.mesh.elements if link.record is not None else None
    if counted == "beam" and isinstance(elements, tuple):
        wanted = "must be one number, per segment, for a beam"
        yield link.fault("mesh", f"{wanted}, got {list(elements)}", "elements")
    if counted == "bar" and elements is not None:
        count, wanted = 3, "must be three numbers for a solid bar: along, across, thickness"
        if category(link) == "plane":
            count, wanted = 2, "must be two numbers for a bar as a plane link: along, across"
        if isinstance(elements, int) or len(elements) != count:
            got = elements if isinstance(elements, int) else list(elements)
            yield link.fault("mesh", f"{wanted}, got {got}", "elements")


def frame_faults(parts: Parts) -> Iterator[Fault]:
    """Frames and segments that do not suit a link."""
    for link in parts.links.values():
        if slider(link):
            for key in ("frames", "segments"):
                if link.has(key):
                    got = shown(link.raw[key])
                    yield link.fault(key, f"must be left out for a rigid link without a shape, got {got}")
        else:
            yield from segment_faults(parts, link)


def segment_faults(parts: Parts, link: Entry) -> Iterator[Fault]:
    """Segments of a link that cannot have them."""
    if not link.has("segments"):
        return
    got = f"got {shown(link.raw['segments'])}"
    if category(link) == "rigid":
        yield link.fault("segments", f"must be left out for a rigid link (it is one segment), {got}")
    elif category(link) == "beam":
        yield link.fault("segments", f"must be left out for a beam: its elements are its segments, {got}")
    elif frames_of(parts, link) == "rigid-body":
        wanted = "must be combined with co-rotational frames"
        yield link.fault("segments", f"{wanted}, {got} with rigid-body ones")
