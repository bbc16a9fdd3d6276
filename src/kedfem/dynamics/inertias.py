"""Links as rigid bodies: their masses, moments of mass and loads in the reference position, and the forces over time.

The inertia of a rigid body depends on ∫ρ dV, ∫ρ X dV and ∫ρ X ⊗ X dV alone, the effect of a load on Σ f and Σ X ⊗ f,
for any kind of link.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.loads import Pattern, Times, patterns, shares
from kedfem.dynamics.model import Model
from kedfem.links.bodies import euler_tensor
from kedfem.links.record import Link, in_space
from kedfem.motion.joint_equations import joint_axis
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import (
    ROTARY,
    Body,
    Flywheel,
    ForceLoad,
    PointMass,
    RigidBody,
    Scene,
    factor_law,
    inertia_tensor,
    mass_place,
    masses_alone,
    moving_grounds,
)
from kedfem.vectors import cross

Vector = Float[np.ndarray, "3"]
Wrenches = tuple[Float[np.ndarray, "T B 3"], Float[np.ndarray, "T B 3"]]


@dataclass(frozen=True, slots=True)
class RigidLoad:
    """One load on one body.

    body : its number
    force : (3,) Σ f at factor one, in the reference position [N]
    moment : (3, 3) Σ X ⊗ f, X from the linkage's centre [N m]
    couple : about z, of planar beams [N m]
    follows, factor, share : as in `Pattern`
    """

    body: int
    force: Vector
    moment: Float[np.ndarray, "3 3"]
    couple: float
    follows: bool
    factor: Callable[[Times, Times], Times]
    share: tuple[Vector, Vector] | None = None


@dataclass(slots=True)
class Inertias:
    """Moments of mass of all bodies (ground first), reference X from the linkage's centre, and the loads.

    mass : (B,) [kg]
    first : (B, 3) ∫ρ X dV [kg m]
    second : (B, 3, 3) ∫ρ X ⊗ X dV [kg m²]
    spin : (B,) inertia of the sections of planar beams about z [kg m²]
    centre, gravity : (3,) of the linkage [m]; [m/s²]
    """

    mass: Float[np.ndarray, " B"]
    first: Float[np.ndarray, "B 3"]
    second: Float[np.ndarray, "B 3 3"]
    spin: Float[np.ndarray, " B"]
    centre: Vector
    gravity: Vector
    loads: list[RigidLoad] = field(default_factory=list)

    def add(self, body: int, mass: float, at: Vector, second: Float[np.ndarray, "3 3"] | float = 0.0) -> None:
        """A mass with the reference position of its centre, and its second moment about that."""
        arm = at - self.centre
        self.mass[body] += mass
        self.first[body] += mass * arm
        self.second[body] += mass * np.outer(arm, arm) + second

    def add_link(self, body: int, link: Link) -> None:
        """A link, or a segment of one."""
        weights, arms = link.m1[:, 0], link.X - np.outer(link.one, self.centre)
        mass = float(link.one @ weights)
        moments = link.mX - np.outer(weights, self.centre)  # ∫ρ N_a X dV
        if link.planar:
            arms, moments = arms * [1, 1, 0], moments * [1, 1, 0]
        self.mass[body] += mass
        self.first[body] += link.one @ moments
        self.second[body] += arms.T @ moments
        self.spin[body] += float(link.one @ link.m1[:, 2]) if link.kind == "beam" else 0.0

    def add_loads(self, body: int, link: Link, loads: Iterable[Pattern]) -> None:
        """Loads on a link or segment."""
        arms = (link.X - np.outer(link.one, self.centre)) * [1, 1, 0 if link.planar else 1]
        for load in loads:
            f = in_space(link, load.forces)
            couple = float(link.one @ load.forces[:, 2]) if link.kind == "beam" else 0.0
            self.loads.append(RigidLoad(body, link.one @ f, arms.T @ f, couple, load.follows, load.factor, load.share))

    def centre_of(self, body: int) -> Vector | None:
        """Centre of mass of a body, in the reference position [m]; None without mass."""
        if not self.mass[body] > 0:
            return None
        return np.asarray(self.centre + self.first[body] / self.mass[body])


def inertias_of_model(scene: Scene, linkage: Linkage, model: Model) -> Inertias:
    """Inertias of an elastic model: links include attached bodies."""
    out = _none(scene, linkage)
    first = int(any(scene.gravity))
    for link, body, loads in zip(model.links, model.bodies, model.loads, strict=True):
        out.add_link(body, link)
        out.add_loads(body, link, loads[first:])
    for prescribed in model.prescribed:
        out.add_link(prescribed.body, prescribed.link)
        out.add_loads(prescribed.body, prescribed.link, prescribed.loads[first:])
    return out


def inertias_of_links(scene: Scene, linkage: Linkage, links: Mapping[str, Link]) -> Inertias:
    """Inertias of links without attached bodies, by name; links without a record have no mass.

    Raises
    ------
    MeshError, SceneError
        If a load does not fit its link.
    """
    out = _none(scene, linkage)
    loads = patterns(scene, dict(links), prescribed=True)
    for name, link in links.items():
        body = linkage.bodies.index(name)
        out.add_link(body, link)
        out.add_loads(body, link, loads[name][int(any(scene.gravity)) :])
    for each in scene.bodies.values():
        _add_body(out, scene, linkage, each)
    _add_forces(out, scene, linkage, [name for name in scene.links if name not in links])
    for name in (*moving_grounds(scene), *masses_alone(scene)):
        out.add(linkage.bodies.index(name), scene.links[name].mass, np.asarray(mass_place(scene, name)))
    return out


def acting(inertias: Inertias, motion: RigidMotion) -> Wrenches:
    """P − M R0'' of all bodies over time as forces and moments, [KED, eqs. (17)(19)], moments about the points drawn at
    the linkage's centre.

    Returns
    -------
    (T, B, 3) each [N, N m], world components, ground first
    """
    R, c = motion.R, inertias.centre
    a = inertias.gravity - motion.p2 - motion.R2 @ c
    S = np.einsum("tbij,bj->tbi", R, inertias.first)
    force = inertias.mass[:, None] * a - np.einsum("tbij,bj->tbi", motion.R2, inertias.first)
    moment = cross(S, a) - _axial((R @ inertias.second) @ np.swapaxes(motion.R2, -1, -2))
    moment[..., 2] -= inertias.spin * motion.alpha[..., 2]
    for load in inertias.loads:
        f, m = load_wrench(load, motion)
        force[:, load.body] += f
        moment[:, load.body] += m
    return force, moment


def load_wrench(load: RigidLoad, motion: RigidMotion) -> tuple[Float[np.ndarray, "T 3"], Float[np.ndarray, "T 3"]]:
    """Force and moment of a load over time, about the point with its reference position at the linkage's centre."""
    R, factor = motion.R[:, load.body], load.factor(motion.t, motion.phi)
    factor = (factor * shares(load.share, motion, load.body))[:, None]
    N = R @ load.moment
    force = np.broadcast_to(load.force, (len(R), 3))
    if load.follows:
        N, force = N @ np.swapaxes(R, 1, 2), R @ load.force
    moment = _axial(N)
    moment[:, 2] += load.couple
    return factor * force, factor * moment


def _axial(N: Float[np.ndarray, "... 3 3"]) -> Float[np.ndarray, "... 3"]:
    """Σ a × b of N = Σ a ⊗ b."""
    return np.stack([N[..., i, j] - N[..., j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=-1)


def _none(scene: Scene, linkage: Linkage) -> Inertias:
    B, gravity = len(linkage.bodies), np.asarray(scene.gravity)
    return Inertias(np.zeros(B), np.zeros((B, 3)), np.zeros((B, 3, 3)), np.zeros(B), linkage.centre, gravity)


def _add_forces(out: Inertias, scene: Scene, linkage: Linkage, links: Iterable[str]) -> None:
    """Forces at points of links that have no mesh."""
    wanted = set(links)
    for load in scene.loads.values():
        if isinstance(load, ForceLoad) and load.link in wanted:
            f = np.asarray(load.vector)
            arm = np.asarray(load.at) - out.centre
            out.loads.append(
                RigidLoad(
                    linkage.bodies.index(load.link), f, np.outer(arm, f), 0.0, load.frame == "link",
                    factor_law(load.factor),
                )
            )  # fmt: skip


def _add_body(out: Inertias, scene: Scene, linkage: Linkage, body: Body) -> None:
    """A body attached to a link; a flywheel is a thin disc across the axis of the hinge that it sits on."""
    number, at = linkage.bodies.index(body.link), np.asarray(body.at)
    match body:
        case PointMass(mass=mass):
            out.add(number, mass, at)
        case RigidBody(mass=mass, inertia=inertia, centre=centre):
            out.add(number, mass, np.asarray(centre), euler_tensor(inertia_tensor(inertia)))
        case Flywheel(mass=mass, inertia=inertia):
            axis = hinge_axis(scene, body)
            out.add(number, mass, at, inertia / 2 * (np.eye(3) - np.outer(axis, axis)))


def hinge_axis(scene: Scene, body: Flywheel) -> Vector:
    """Axis of the hinge that a flywheel sits on."""
    hinges = [x for x in scene.joints.values() if body.link in x.links and x.kind in ROTARY]
    nearest = min(hinges, key=lambda x: float(np.linalg.norm(np.subtract(x.at, body.at))))
    return joint_axis(nearest)
