"""Interface points of a joint on a link: their positions about the joint, and the refusal where there can be none."""

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, determines_gradient, is_flat
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.joint_equations import joint_axis
from kedfem.scene import Joint, Scene


def port_points(
    scene: Scene, name: str, joint: Joint, surfaces: dict[str, CouplingSurface], links: dict[str, Link]
) -> Float[np.ndarray, "p 3"]:
    """Points of a joint that its links share: 1 spherical, 2 revolute; in a plane 1 for both.

    Where turning is held too, points off these in all directions that the coupling surfaces know: were a bore held along
    one direction only, its eye would be soft or stiff as that happens to lie.

    Raises
    ------
    MeshError
        If a flat coupling surface cannot hold a point outside its plane.
    """
    at = np.asarray(joint.at)
    if any(links[link].kind == "beam" for link in surfaces) or joint.kind == "spherical":
        return at[None, :]
    if links[next(iter(surfaces))].planar:
        return _plane_points(scene, name, joint, surfaces)
    surface = next(iter(surfaces.values()))
    driven = name in scene.driven_joints
    if joint.kind == "revolute":
        axis = joint_axis(joint)
        half = np.mean([np.sqrt(3) * _spread_along(s, axis) for s in surfaces.values()]) / 2
        centre = at + np.mean([(s.origin - at) @ axis for s in surfaces.values()]) * axis
        across = _widest_across(surface, axis)
        directions = [axis, across] if driven else [axis]
        points = [centre + half * axis, centre - half * axis]
        points += _points_off(centre, surfaces, [across, np.cross(axis, across)]) if driven else []
    else:
        surface = next((s for s in surfaces.values() if is_flat(s)), surface)
        e1, e2 = surface.directions[:2]
        directions = [e1, e2]
        points = [surface.origin + surface.spread[0] * e1 * c + surface.spread[1] * e2 * s
                  for c, s in ((1, 0), (-0.5, 0.9), (-0.5, -0.9))]  # fmt: skip
        points += _points_off(surface.origin, surfaces, [surface.directions[2]])
    for link, s in surfaces.items():
        if not all(determines_gradient(s, d) for d in directions):
            raise MeshError(f"joints.{name}: {_unheld(links[link], joint.kind)}")
    return np.array(points)


def _unheld(link: Link, kind: str) -> str:
    """Advice for a coupling surface that does not determine a joint's points."""
    if link.kind == "spatial_beam":
        return (
            f"must sit at an end or a corner of beam '{link.name}', or need its section only, got a joint that "
            "needs the direction of its axis too: give the beam a point there"
        )
    if kind == "weld":
        return (
            f"must weld faces that lie in one plane, or sit on a bore of link '{link.name}', "
            "got a flat face at an angle to the other link's: cut the two so that they meet in a plane"
        )
    return (
        f"must sit on a bore of link '{link.name}', or on a flat face that contains its axis, "
        "got a flat face across the axis, which determines no second point of it: give the link a bore there, or "
        'weld the face to a link of model = "rigid" that has the joint'
    )


def _plane_points(
    scene: Scene, name: str, joint: Joint, surfaces: dict[str, CouplingSurface]
) -> Float[np.ndarray, "p 3"]:
    """The joint's point and, where turning is held, others: along a slide, else along the narrowest coupling surface, and
    across."""
    at = np.asarray(joint.at)
    if joint.kind == "revolute" and name not in scene.driven_joints:
        return at[None, :]
    narrow = min(surfaces.values(), key=lambda surface: float(surface.spread[1]))
    along = joint_axis(joint) if joint.kind == "prismatic" else narrow.directions[0]
    for link, surface in surfaces.items():
        if not determines_gradient(surface, along):
            raise MeshError(
                f"joints.{name}: must sit on a bore of link '{link}', or on an edge along its direction "
                f"({along[0]:.3g}, {along[1]:.3g}, 0), got an edge across that: give the link a bore there"
            )
    return np.array([at, *_points_off(at, surfaces, [along, np.cross([0.0, 0.0, 1.0], along)])])


def _points_off(
    centre: Float[np.ndarray, "3"], surfaces: dict[str, CouplingSurface], directions: list[Float[np.ndarray, "3"]]
) -> list[Float[np.ndarray, "3"]]:
    """A point off the centre in each direction that all coupling surfaces know, as far as the first coupling surface is
    wide there."""
    known = [d for d in directions if all(determines_gradient(surface, d) for surface in surfaces.values())]
    first = next(iter(surfaces.values()))
    return [centre + 2 * _spread_along(first, d) * d for d in known]


def _spread_along(surface: CouplingSurface, axis: Float[np.ndarray, "3"]) -> float:
    return float(np.linalg.norm((surface.directions @ axis) * surface.spread))


def _widest_across(surface: CouplingSurface, axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    candidates = [np.asarray(d - (d @ axis) * axis) for d in surface.directions]
    widest = max(candidates, key=lambda d: _spread_along(surface, d))
    return widest / np.linalg.norm(widest) if np.linalg.norm(widest) > 1e-9 else perpendiculars(axis)[0]
