"""Rigid links without a shape: parts of the ground that drives alone move, and masses alone that slide on guides."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_joints import needs_constraints
from kedfem.links.bodies import with_body
from kedfem.links.plane import plane_link
from kedfem.links.record import Link
from kedfem.links.reduced import rigid
from kedfem.links.segments import corotational
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.coupling_surfaces import rigid_link_surface
from kedfem.motion.joint_equations import joint_axis
from kedfem.motion.linkage import scene_size
from kedfem.scene import (
    GROUND,
    Bar,
    LinkScene,
    Material,
    Meshing,
    Scene,
    link_frames,
    mass_place,
    masses_alone,
    plane_scene,
)

EDGE = 0.02  # of the block that is drawn for one, of the scene's size
WIDTH = 0.8  # of the block that is drawn for a slider, relative to that of the links that it is joined to
STOUT = 0.25  # of that link's length: most that its width is taken for
POINT = 1e-4  # of the block's second moments of mass: what a mass alone keeps of them, so that its mass is definite
SOFT = 1e-6  # of a rigid link's stiffness: what one that is not strained keeps, so that rounding of it is nothing
NOTHING = 1e-9  # of the others' mass: that of a slider without any
LONG = 1.5  # length of the block along the guide, relative to its width
SOUND = 5e3  # m/s: how fast waves are in the block where no link is elastic, as in steel


def moving_ground(scene: Scene, name: str) -> Link:
    """The record of a moving part of the ground: a block at its driven joint, of its own mass there and no other."""
    at = np.asarray(mass_place(scene, name), float)
    link = rigid(_block(name, at, EDGE * scene_size(scene) * np.eye(3)[0], 1.0))
    none = np.zeros((link.n, link.n))
    massless = replace(
        link, mass=(none,) * link.d, m1=np.zeros_like(link.m1), mX=np.zeros_like(link.mX), volume=np.zeros(link.n)
    )
    mass = scene.links[name].mass
    return with_body(massless, rigid_link_surface(massless, at), mass, at, np.zeros((3, 3))) if mass else massless


@dataclass(frozen=True, slots=True)
class MassAlone:
    """A mass alone that slides on a guide.

    link : a block with its mass spread over it, as which it is made stiff
    at : (3,) where the mass is [m]
    less, spread : what the block has too much of: mass [kg], (3, 3) Euler tensor about its middle [kg m²]
    held : whether its guide leaves it nothing but its travel: it is not strained
    """

    link: Link
    at: Float[np.ndarray, "3"]
    less: float
    spread: Float[np.ndarray, "3 3"]
    held: bool

    def concentrated(self, link: Link) -> Link:
        """The rigid record made of the block, and of the bodies on it, with the mass at its place."""
        out = with_body(link, rigid_link_surface(link, self.at), -self.less, self.at, -self.spread)
        return replace(out, K0=SOFT * out.K0) if self.held else out


def mass_alone(scene: Scene, name: str, others: Mapping[str, Link]) -> MassAlone:
    """The record of a rigid slider without a shape.

    Parameters
    ----------
    others : links that have a shape
    """
    on, mass = masses_alone(scene)[name], scene.links[name].mass
    guide = scene.joints[on]
    at = np.asarray(mass_place(scene, name), float)
    beside = {each for joint in scene.joints.values() if name in joint.links for each in joint.links}
    width = min((WIDTH * width_across(x) for x in others.values() if x.name in beside), default=EDGE * scene_size(scene))
    axis, total = joint_axis(guide), mass or float(np.mean([x.one @ x.m1[:, 0] for x in others.values()]))
    link = _block(name, at, axis * width, total, plane_scene(scene))
    if link_frames(scene, name) == "co-rotational" and GROUND not in guide.links:
        link = corotational(link)
    box = width**2 / 12 * (np.eye(3) + (LONG**2 - 1) * np.outer(axis, axis))
    less, spread = total - (mass or NOTHING * total), (1 - POINT) * total * box
    return MassAlone(link, at, less, spread, held=not needs_constraints(scene, on))


def _block(name: str, at: Float[np.ndarray, "3"], wide: Float[np.ndarray, "3"], mass: float, plane: bool = False) -> Link:
    """A block of a mass, longer than wide along a direction, whose length is its width [m, kg]."""
    from kedfem.mesh import link_mesh, plane_mesh

    width, half = float(np.linalg.norm(wide)), LONG / 2 * wide
    density = mass / (LONG * width**3)
    material = Material(density=density, youngs_modulus=density * SOUND**2, poisson_ratio=0.0)
    ends = tuple((at - half).tolist()), tuple((at + half).tolist())
    shape = Bar(between=ends, width=width, thickness=width)
    if plane:
        drawn = LinkScene(model="plane", material="any", shape=shape, mesh=Meshing(elements=(1, 1)))
        link = plane_link(name, plane_mesh(name, drawn, Path()), material, np.eye(3))
    else:
        drawn = LinkScene(model="rigid", material="any", shape=shape)
        link = solid_link(name, link_mesh(name, drawn, Path()), material, np.eye(3))
    return replace(link, anywhere=True)


def width_across(link: Link) -> float:
    """Width of a link across its length: that of its section, else of the whole link [m]."""
    whole = link.full or link
    if whole.section is not None:
        return max(whole.section.height, whole.section.thickness)
    principal = np.linalg.svd(whole.X - whole.X.mean(axis=0), full_matrices=False)[2]
    extents = np.sort(np.ptp(whole.X @ principal.T, axis=0))
    return float(min(extents[1], STOUT * extents[2]))
