"""The elastic model of a scene: meshed links, with loads and bodies, connected by the joints."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.inertias import hinge_axis
from kedfem.dynamics.joints.attachments import SharedCut
from kedfem.dynamics.joints.constraint_joints import needs_constraints
from kedfem.dynamics.joints.constraint_ports import LinkageLayout, slot_travels
from kedfem.dynamics.joints.coupling import joined
from kedfem.dynamics.joints.places import on_part
from kedfem.dynamics.joints.rigid_couplings import with_rigid_couplings
from kedfem.dynamics.loads import patterns
from kedfem.dynamics.model import Model, PrescribedBody
from kedfem.dynamics.rigid_links import made_rigid
from kedfem.dynamics.shapeless import mass_alone, moving_ground
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.errors import Fault, MeshError, SceneError
from kedfem.links.bodies import euler_tensor, flywheel_tensor, with_body, with_point_mass
from kedfem.links.build import bare_links, link_segments
from kedfem.links.point_rows import point_rows, require_on_axis
from kedfem.links.record import Link
from kedfem.links.reduced import rigid
from kedfem.links.segments import Segments
from kedfem.links.surfaces.coupling_surfaces import (
    CouplingSurface,
    determines_gradient,
    is_flat,
    joint_surface,
    rigid_link_surface,
)
from kedfem.motion.joint_equations import unit
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.scene import (
    GROUND,
    Body,
    Flywheel,
    Joint,
    PointMass,
    RigidBody,
    Scene,
    inertia_tensor,
    masses_alone,
    moving_grounds,
    rayleigh,
)

PARALLEL = 1e-9  # sine of the angle between axes


def elastic_model(
    scene: Scene, linkage: Linkage, known: Mapping[str, Link] | None = None, along: Path | None = None,
    elements: bool = False,
) -> Model:  # fmt: skip
    """The elastic model of a scene: links meshed, assembled and joined; rigid links become stiff or prescribed.

    Parameters
    ----------
    known : `bare_links` of the scene that are made already
    along : the linkage's path over the drive's range, needed with slots
    elements : whether springs, motors and rigid links get interface points, as a system has them

    Raises
    ------
    MeshError
        If a link cannot be meshed, or a joint or body finds no coupling surface on its link.
    SceneError
        If a load or body does not fit its link.
    """
    cut = {name: link_segments(scene, name, link) for name, link in bare_links(scene, known).items()}
    links = {key: part for name, link in cut.items() for key, part in zip(keys(name, link), link.parts, strict=True)}
    links = with_rigid_couplings(scene, links)
    ground, alone = moving_grounds(scene), {name: mass_alone(scene, name, links) for name in masses_alone(scene)}
    links |= {name: moving_ground(scene, name) for name in ground} | {name: x.link for name, x in alone.items()}
    for key, body in scene.bodies.items():
        on, carrier = with_scene_body(scene, f"bodies.{key}", body, links)
        links[on] = carrier
    prescribed = tuple(
        PrescribedBody(x if (x := links.pop(name)).rigid else rigid(x), linkage.bodies.index(name), drive_joint, ())
        for name in [*cut, *ground] if (drive_joint := drive_joint_of(scene, name)) is not None
    )  # fmt: skip
    if not links:
        wanted = "must have a link whose motion no drive prescribes, got rigid ones only"
        raise SceneError([Fault(("links",), wanted)])
    prescribed = tuple(
        replace(x, loads=patterns(scene, {x.link.name: x.link}, prescribed=True)[x.link.name]) for x in prescribed
    )
    links, limits = made_rigid(scene, links, linkage, along, thicken=elements)
    links |= {name: each.concentrated(links[name]) for name, each in alone.items()}
    cuts = [shared for name, link in cut.items() for shared in _shared(name, link)]
    layout = LinkageLayout({name: k for k, name in enumerate(linkage.bodies)}, slot_travels(scene, linkage, along))
    held = joined(scene, links, cuts, layout, elements, bars=elements)
    loads = patterns(scene, links)
    return Model(
        links=tuple(links.values()), bodies=tuple(linkage.bodies.index(x.name) for x in links.values()),
        joints=tuple(held.attachments[key] for key in links), loads=tuple(loads[key] for key in links),
        damping=Rayleigh(*rayleigh(scene.damping)), prescribed=prescribed,
        rows=held.rows, cuts=tuple(cuts), step_limits=tuple(map(limits.get, links)) if limits else (),
    )  # fmt: skip


def keys(name: str, link: Segments) -> list[str]:
    """A key for each segment of a link; of a whole link its name."""
    return [name] if len(link.parts) == 1 else [f"{name}/{k + 1}" for k in range(len(link.parts))]


def _shared(name: str, link: Segments) -> list[SharedCut]:
    key = keys(name, link)
    return [
        SharedCut((key[a], key[b]), cut.points, cut.weights, () if cut.prismatic else cut.facets)
        for cut in link.cuts
        for a, b in [cut.segments]
    ]


def drive_joint_of(scene: Scene, name: str) -> str | None:
    """The driven joint between the ground and a rigid link, or of a moving part of the ground."""
    if scene.links[name].model != "rigid":
        return None
    if name in (ground := moving_grounds(scene)):
        return ground[name]
    driven = (x for x in scene.driven_joints if name in scene.joints[x].links and not needs_constraints(scene, x))
    return next(driven, None)


def with_scene_body(scene: Scene, where: str, body: Body, links: Mapping[str, Link]) -> tuple[str, Link]:
    """The key of the link or segment that a body is attached to, and the link with the body."""
    at = np.asarray(body.at)
    near = 1e-6 * max(link.size for link in links.values() if link.name == body.link)
    here = [j for j in scene.joints.values() if body.link in j.links and np.linalg.norm(np.subtract(j.at, at)) <= near]
    axis = next((unit(j.axis) for j in here if j.axis and j.kind != "prismatic"), None)
    faces = next((j.face_names(body.link) for j in here if body.link in j.faces), ())
    if scene.links[body.link].model == "rigid" and links[body.link].meshed:
        return body.link, _carrying(scene, links[body.link], rigid_link_surface(links[body.link], at), where, body)
    try:
        key, surface = on_part(links, body.link, at, lambda link: joint_surface(link, f"{where}.at", at, axis, faces))
    except MeshError:
        if not isinstance(body, PointMass):
            raise
        key, point = on_part(links, body.link, at, lambda link: point_rows(link, f"{where}.at", at))
        require_on_axis(links[key], f"{where}.at", at, point.X, "planar beam")
        return key, with_point_mass(links[key], point.value, body.mass)
    return key, _carrying(scene, links[key], surface, where, body)


def _tilts(scene: Scene, link: str, axis: Float[np.ndarray, "3"]) -> bool:
    """Whether a link may rotate about other axes than one, which neither its hinge on the ground nor all joints fix."""

    def parallel(joint: Joint) -> bool:
        if joint.axis is None or joint.kind == "slot":
            return False
        return bool(np.linalg.norm(np.cross(unit(joint.axis), axis)) < PARALLEL)

    turning = [joint for joint in scene.joints.values() if joint.kind not in {"weld", "prismatic"}]
    fixed = (parallel(x) for x in turning if x.kind == "revolute" and set(x.links) == {link, GROUND})
    return not any(fixed) and not all(map(parallel, turning))


def _carrying(scene: Scene, link: Link, surface: CouplingSurface, where: str, body: Body) -> Link:
    at = np.asarray(body.at)
    match body:
        case Flywheel(mass=mass, inertia=inertia):
            spin = hinge_axis(scene, body)
            if not link.planar and not determines_gradient(surface, spin):
                raise MeshError(f"{where}.at: a flywheel must sit on {_wide_surface(link)}")
            if is_flat(surface) and not link.planar and _tilts(scene, body.link, spin):
                wanted, got = _whole_surface(link)
                raise MeshError(
                    f"{where}.at: a flywheel whose axis may tilt must sit on {wanted}, got {got} of '{link.name}'"
                )
            return with_body(link, surface, mass, at, flywheel_tensor(surface, spin, inertia))
        case PointMass(mass=mass):
            return with_body(link, surface, mass, at, np.zeros((3, 3)))
        case RigidBody(mass=mass, inertia=inertia, centre=centre):
            if is_flat(surface):
                wanted, got = _whole_surface(link)
                raise MeshError(
                    f"{where}.at: a rigid body with full inertia must sit on {wanted}, got {got} of '{link.name}'"
                )
            return with_body(link, surface, mass, np.asarray(centre), euler_tensor(inertia_tensor(inertia)))


def _whole_surface(link: Link) -> tuple[str, str]:
    """A coupling surface that shows how a link's displacement changes in all directions, and one that does not."""
    return ("an end or a corner", "another node") if link.kind == "spatial_beam" else ("a bore", "a flat face")


def _wide_surface(link: Link) -> str:
    if link.kind == "spatial_beam":
        return "an end or a corner of the beam, or have its axis across the beam"
    return "a bore, or on a flat face that contains its axis"
