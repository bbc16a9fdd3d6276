"""Rigid links given by mass, centre and inertia, turned into a rigid body on a line through their joints."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import combinations, count, pairwise
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from kedfem.arrays import Float
from kedfem.scene.records.base import plain
from kedfem.scene.records.loads import RigidBody, inertia_faults, inertia_tensor, moments_of_inertia
from kedfem.scene.records.materials import LINE
from kedfem.scene.records.points import XYZ, Apart, Axis, JointPoint

LIGHT = 1e-4  # share of the line in the mass; its modes are as stiff as they are heavy (with 1e-9 forces err by 10 %)
SLENDER = 0.05  # width of the line, in extents
SOUND = 5e3  # m/s, speed of waves in the line with the mass of the link, as in steel, which determines its stiffness
NOTHING = 1e-9  # distance, in extents, within which points are the same

Tables = dict[str, Any]
_JOINT_POINT: TypeAdapter[XYZ] = TypeAdapter(JointPoint)
_AXIS: TypeAdapter[XYZ] = TypeAdapter(Axis)


def with_rigid_bodies(raw: Mapping[str, Any]) -> Tables:
    """A raw scene whose rigid links with `inertia` have a shape, a material and a rigid body instead.

    It is called within `known_points`. A link with a fault is unchanged, and its record reports the fault.
    """
    links, out = raw.get("links"), dict(raw)
    for name, link in links.items() if isinstance(links, Mapping) else ():
        if not isinstance(link, Mapping) or link.get("model") != "rigid" or "inertia" not in link:
            continue
        if link.keys() & {"shape", "material"}:
            continue
        try:
            body = RigidBody.model_validate({
                "link": name, "at": link["centre"], **{key: link[key] for key in ("mass", "centre", "inertia")},
            })  # fmt: skip
        except (KeyError, ValidationError):
            continue
        if all(map(math.isfinite, body.centre)):  # otherwise the point that it names has a fault
            _carry(out, str(name), body)
    return out


def _carry(out: Tables, name: str, body: RigidBody) -> None:
    """Give a link of a raw scene the line through its points, and the body on the line."""
    if not all(isinstance(out.get(section, {}), Mapping) for section in ("bodies", "materials", "links")):
        return
    held, slots = [body.centre, *_held(out, name)], [*_slots(out, name)]
    radius = math.sqrt(max(sum(body.inertia[:3]) / (2 * body.mass), 0.0)) or 1.0
    reach = max(math.dist(P, Q) for P in held for Q in held) or radius
    along = [_beyond(P, axis, reach) for P, axis in slots]  # a second point of each slot's line
    points = [*_different([*held, *along])]
    if len(points) == 1:
        points.append((points[0][0] + radius, *points[0][1:]))
    width = SLENDER * max(math.dist(P, Q) for P, Q in combinations(points, 2))
    volume = width**2 * sum(math.dist(P, Q) for P, Q in pairwise(points))
    bodies, materials = dict(out.get("bodies", {})), dict(out.get("materials", {}))
    material = _unused(f"{LINE}{name}"[:40], materials)
    stiffness = {"youngs_modulus": body.mass / volume * SOUND**2, "poisson_ratio": 0.3}
    materials[material] = {"density": LIGHT * body.mass / volume, **stiffness}
    bodies[_unused(name, bodies)] = plain(_beside_line(body, np.array(points), width))
    link = {key: x for key, x in out["links"][name].items() if key not in {"mass", "centre", "inertia"}}
    shape = {"kind": "polyline", "points": [list(P) for P in points], "width": width, "thickness": width}
    links = {**out["links"], name: {**link, "material": material, "shape": shape}}
    out |= {"bodies": bodies, "materials": materials, "links": links}


def _beside_line(body: RigidBody, points: Float[np.ndarray, "p 3"], width: float) -> RigidBody:
    """The body that, together with the line, has the mass, centre and inertia of a given body.

    If the remainder of the inertia is impossible for a body, as for a disc across the line, the body has the line's share
    less of the whole inertia.
    """
    a, e = points[:-1], np.diff(points, axis=0)
    length = np.linalg.norm(e, axis=1)
    m = LIGHT * body.mass * length / length.sum()
    centre, middles = np.array(body.centre), a + e / 2
    along = np.einsum("si,sj->sij", e, e) / length[:, None, None] ** 2
    own = ((length**2 + width**2) / 12)[:, None, None] * (np.eye(3) - along) + width**2 / 6 * along
    line = np.einsum("s,sij->ij", m, own + [_steiner(x - centre) for x in middles])
    rest = body.mass - m.sum()
    shift = (m @ (centre - middles)) / rest
    J = inertia_tensor(body.inertia) - line - rest * _steiner(shift)
    inertia = moments_of_inertia(J)
    if inertia_faults(inertia):
        inertia = moments_of_inertia((1 - LIGHT) * inertia_tensor(body.inertia))
    own_centre = (centre + shift).tolist()
    return RigidBody(link=body.link, at=body.centre, mass=rest, centre=own_centre, inertia=inertia)


def _steiner(d: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """Inertia tensor of a unit mass at a vector d (Steiner)."""
    return np.asarray(d @ d * np.eye(3) - np.outer(d, d))


def _held(raw: Mapping[str, Any], name: str) -> Iterator[XYZ]:
    """Points of joints and springs on a link, as far as they are valid."""
    joints = [x.get("at") for x in _tables(raw.get("joints")) if name in _list(x.get("links"))]
    ends = [x for spring in _tables(raw.get("springs")) for x in _list(spring.get("between"))]
    springs = [x.get("at") for x in ends if isinstance(x, Mapping) and x.get("link") == name]
    for at in (*joints, *springs):
        if point := _point(at, name):
            yield point


def _slots(raw: Mapping[str, Any], name: str) -> Iterator[tuple[XYZ, XYZ]]:
    """Point and direction of the slots of a link, as far as they are valid."""
    for joint in _tables(raw.get("joints")):
        if joint.get("kind") != "slot" or _list(joint.get("links"))[1:] != [name]:
            continue
        try:
            axis = _AXIS.validate_python(joint.get("axis"))
        except ValidationError:
            continue
        if (point := _point(joint.get("at"), name)) and all(map(math.isfinite, axis)):
            yield point, axis


def _point(at: Any, name: str) -> XYZ | None:
    """A joint's point on a link; None if it has a fault."""
    try:
        found = _JOINT_POINT.validate_python(at)
    except ValidationError:
        return None
    point = found.points.get(name, found) if isinstance(found, Apart) else found
    return point if all(map(math.isfinite, point)) else None


def _beyond(point: XYZ, axis: XYZ, reach: float) -> XYZ:
    x, y, z = (p + reach * e for p, e in zip(point, axis, strict=True))
    return (x, y, z)


def _list(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else []


def _tables(section: Any) -> list[Mapping[str, Any]]:
    each = section.values() if isinstance(section, Mapping) else ()
    return [x for x in each if isinstance(x, Mapping)]


def _different(points: list[XYZ]) -> list[XYZ]:
    """Different points; the first comes last, so that the line runs from joint to joint and ends at the centre."""
    size = max((math.dist(P, Q) for P, Q in combinations(points, 2)), default=0.0)
    out: list[XYZ] = []
    for P in (*points[1:], points[0]):
        if all(math.dist(P, Q) > NOTHING * size for Q in out):
            out.append(P)
    return out


def _unused(name: str, taken: Mapping[str, Any]) -> str:
    return next(each for k in count(1) if (each := name if k == 1 else f"{name} {k}") not in taken)
