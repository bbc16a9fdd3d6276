"""A plan's mesh swept through the slabs of a solid."""

import numpy as np
from jaxtyping import Float, Int

from kedfem.mesh.hexahedra import HEX27, QUAD9, HexMesh, without_spare_nodes
from kedfem.mesh.layered.partition import Plan
from kedfem.mesh.layered.plan_mesh import PlanMesh


def swept(flat: PlanMesh, plan: Plan, layers: Int[np.ndarray, " slabs"]) -> HexMesh:
    """hex27 mesh: each cell of the plan through the slabs in which its region has material.

    A node's number is made of its place in the plan and of its level, so slabs share the nodes between them.

    Parameters
    ----------
    flat : PlanMesh
        Quadrilaterals that share their nodes across regions.
    plan : Plan
        Where the slabs are, and the way back into the solid's place.
    layers : (slabs,)
        Elements through each slab.
    """
    points, quads = flat.points, flat.cells
    heights = _levels(plan.heights, layers)
    slab = np.repeat(np.arange(len(layers)), layers)
    material = np.stack([region.material for region in plan.regions])[flat.regions]
    cell, layer = np.nonzero(material[:, slab])
    below = [int(np.flatnonzero((node[:2] == QUAD9).all(axis=1))[0]) for node in HEX27]
    cells = quads[cell][:, below] + len(points) * (2 * layer[:, None] + 1 + HEX27[:, 2])
    nodes = np.column_stack([np.tile(points, (len(heights), 1)), np.repeat(heights, len(points))])
    return without_spare_nodes(HexMesh(plan.extent * (nodes @ plan.axes), cells))


def _levels(bounds: Float[np.ndarray, " h"], layers: Int[np.ndarray, " s"]) -> Float[np.ndarray, " v"]:
    """Heights of all nodes: two to a layer, those at the bounds once."""
    parts = [
        np.linspace(low, high, 2 * count + 1)[1:]
        for low, high, count in zip(bounds[:-1], bounds[1:], layers, strict=True)
    ]
    return np.concatenate([bounds[:1], *parts])
