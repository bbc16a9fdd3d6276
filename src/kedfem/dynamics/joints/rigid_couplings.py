"""Stiffness that the rigid couplings of joints add to their links, before the links are reduced or divided."""

from collections.abc import Mapping

from kedfem.dynamics.joints.places import part_surface
from kedfem.links.record import Link
from kedfem.links.surfaces.rigid_coupling import with_rigid_coupling
from kedfem.scene import Scene


def with_rigid_couplings(scene: Scene, links: Mapping[str, Link]) -> dict[str, Link]:
    """Links, or their segments, whose coupling surfaces of joints with rigid couplings keep their shape.

    A coupling surface of several joints is made stiff once; beams and rigid links need nothing.

    Raises
    ------
    MeshError
        If such a joint finds no coupling surface on one of its links.
    """
    out, done = dict(links), set()
    meshed = {link.name for link in links.values() if link.meshed}
    for name, joint in scene.joints.items():
        for link in joint.links[:1] if joint.kind == "slot" else joint.links:  # a slot's line is no coupling surface
            if link not in meshed or not joint.stiff(link) or scene.links[link].model == "rigid":
                continue
            key, surface = part_surface(scene, name, out, link)
            which = (key, surface.facets.tobytes() if surface.facets is not None else b"")
            if which not in done:
                out[key] = with_rigid_coupling(out[key], surface)
                done.add(which)
    return out
