"""A plan's mesh swept through the slabs of a solid."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.elements.hexahedra import SolidMesh, stacked, without_spare_nodes
from kedfem.mesh.layered.partition import Plan
from kedfem.mesh.layered.plan_mesh import PlanMesh


def swept(flat: PlanMesh, plan: Plan, layers: Int[np.ndarray, " slabs"]) -> SolidMesh:
    """hex27 mesh: each cell of the plan through the slabs in which its region has material.

    A node's number is made of its place in the plan and of its level, so slabs share the nodes between them.

    Parameters
    ----------
    flat : quadrilaterals that share their nodes across regions
    plan : where the slabs are, and the way back into the solid's place
    layers : (slabs,) elements through each slab
    """
    points, quads = flat.points, flat.cells
    heights = _levels(plan.heights, layers)
    slab = np.repeat(np.arange(len(layers)), layers)
    material = np.stack([region.material for region in plan.regions])[flat.regions]
    cell, layer = np.nonzero(material[:, slab])
    mesh = stacked(points, heights, quads[cell], layer)
    return without_spare_nodes(replace(mesh, points=plan.extent * (mesh.points @ plan.axes)))


def _levels(bounds: Float[np.ndarray, " h"], layers: Int[np.ndarray, " s"]) -> Float[np.ndarray, " v"]:
    """Heights of all nodes: two to a layer, those at the bounds once."""
    parts = [
        np.linspace(low, high, 2 * count + 1)[1:]
        for low, high, count in zip(bounds[:-1], bounds[1:], layers, strict=True)
    ]
    return np.concatenate([bounds[:1], *parts])
