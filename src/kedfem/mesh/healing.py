"""Short edges and small faces of a solid healed away, where its volume stays."""

from collections.abc import Iterator
from dataclasses import replace
from types import ModuleType

from kedfem.mesh.cad.model import leave_only
from kedfem.mesh.cad.solid_faces import cad_faces
from kedfem.mesh.cad.solids import Solid

_HEALED = (0.03, 0.1, 0.3)  # sizes of edges that are healed away in turn, of the elements' size
_SAME = 1e-3  # of the volume that this may change


def healed(gmsh: ModuleType, where: str, solid: Solid, size: float) -> Iterator[tuple[Solid, str]]:
    """The solid of gmsh's model with edges and faces below growing sizes healed away, and what was done in words.

    Parameters
    ----------
    size : of the elements [m]; what is healed is much smaller

    Yields
    ------
    Solid and words, as long as the volume stays what it was.
    """
    tag = solid.tag
    for share in _HEALED:
        made = gmsh.model.occ.healShapes([(3, tag)], tolerance=share * size)
        gmsh.model.occ.synchronize()
        solids = {tag for dim, tag in made if dim == 3}
        if len(solids) != 1:
            return
        (tag,) = solids
        leave_only(gmsh, tag)
        volume = float(gmsh.model.occ.getMass(3, tag))
        if abs(volume / solid.volume - 1) > _SAME:
            return
        faces = cad_faces(gmsh, where, tag, solid.extent, {})
        words = f"edges and faces below {1e3 * share * size:.2g} mm healed away"
        yield replace(solid, tag=tag, volume=volume, faces=faces), words
