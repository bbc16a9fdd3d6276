"""Cross checks of plane links, planar beams and their plane."""

from __future__ import annotations

import math
from collections.abc import Iterator

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Parts, category
from kedfem.scene.questions.planes import (
    FLAT,
    Placed,
    leaving,
    obstacles,
    off_plane,
    on_links,
    spatial_beams,
    spring_ends,
    vector,
    welded,
)
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.shapes import Bar
from kedfem.scene.records.wording import NOUNS


def planar_faults(parts: Parts) -> Iterator[Fault]:
    """What leaves the plane of a scene with plane links."""
    if any(category(link) == "plane" for link in parts.links.values()):
        yield from _leaving_plane(parts.good, f"a scene of {NOUNS['plane']}s")


def _leaving_plane(scene: Scene, here: str) -> Iterator[Fault]:
    """Axes, gravity, loads and points that are not in the plane of plane links."""
    for name, joint in scene.joints.items():
        axis, where = joint.axis, ("joints", name, "axis")
        if axis is None:
            continue
        if joint.kind == "revolute" and max(abs(axis[0]), abs(axis[1])) > FLAT:
            yield Fault(where, f"must be along z in {here}, got {vector(axis)}")
        if joint.kind in {"prismatic", "slot"} and abs(axis[2]) > FLAT:
            yield Fault(where, f"must lie in the xy plane in {here}, got {vector(axis)}")
    yield from leaving(scene, f"in {here}")
    for name, link in scene.links.items():
        shape = link.shape
        if link.category == "plane" and isinstance(shape, Bar) and math.hypot(*shape.upward[:2]) > FLAT:
            yield Fault(
                ("links", name, "shape", "up"), f"must be along z in {here}, got {vector(shape.upward)}"
            )
    yield from off_plane(_beside_plane(scene), f"the other points of {here}")


def _beside_plane(scene: Scene) -> Iterator[Placed]:
    """Joints, plane and rigid links and what is on them; points of other links may be anywhere."""
    others = {name for name, link in scene.links.items() if link.category in {"solid", "beam"}}
    for name, joint in scene.joints.items():
        yield ("joints", name), joint
    for name, link in scene.links.items():
        if name not in others:
            yield ("links", name), link
    ends = [end for name in scene.springs for end in spring_ends(scene, name)]
    yield from ((where, record) for where, record in [*on_links(scene), *ends] if record.link not in others)


def beam_faults(parts: Parts) -> Iterator[Fault]:
    """What leaves the plane of beams that are said to be planar."""
    spatial = spatial_beams(parts.good)
    for link in parts.links.values():
        if category(link) != "beam":
            if link.has("beam"):
                yield link.fault("beam", f"must be given for a beam only, got a {category(link)}")
        elif link.word("beam") == "planar" and link.record is not None:
            yield from obstacles(parts.good, link.name)
            for other in sorted(welded(parts.good, link.name) & spatial):
                wanted = "must not be 'planar' beside the spatial beam welded to it"
                yield link.fault("beam", f"{wanted}, got {other!r}")
