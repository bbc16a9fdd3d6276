"""Moving parts of the ground: rigid links without a shape that only drives move, as massless links of the model."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from kedfem.links.bodies import with_body
from kedfem.links.record import Link
from kedfem.links.reduced import rigid
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.coupling_surfaces import rigid_link_surface
from kedfem.motion.linkage import scene_size
from kedfem.scene import Bar, LinkScene, Material, Scene

EDGE = 0.02  # of the cube that is drawn for one, of the scene's size; nothing is computed from it
ANY = Material(density=1.0, youngs_modulus=1.0, poisson_ratio=0.0)


def moving_ground(scene: Scene, name: str, drive_joint: str) -> Link:
    """The record of a moving part of the ground: a cube at its driven joint, with no mass but its own.

    Parameters
    ----------
    drive_joint : the driven joint
    """
    from kedfem.mesh import link_mesh

    at = np.asarray(scene.joints[drive_joint].at, float)
    edge = EDGE * scene_size(scene)
    x, y, z = at.tolist()
    ends = ((x - edge / 2, y, z), (x + edge / 2, y, z))
    cube = LinkScene(model="rigid", material="any", shape=Bar(between=ends, width=edge, thickness=edge))
    link = rigid(solid_link(name, link_mesh(name, cube, Path()), ANY, np.eye(3)))
    none = np.zeros((link.n, link.n))
    massless = replace(
        link, mass=(none,) * 3, m1=np.zeros_like(link.m1), mX=np.zeros_like(link.mX), volume=np.zeros(link.n)
    )
    mass = scene.links[name].mass
    return with_body(massless, rigid_link_surface(massless, at), mass, at, np.zeros((3, 3))) if mass else massless
