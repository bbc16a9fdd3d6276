"""Points of links where stress is singular or depends on the joint: corners, point forces, joint surfaces."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.places import on_part, part_surface
from kedfem.dynamics.model import Model, link_keys
from kedfem.errors import KedfemError
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.recovery import StressRecovery
from kedfem.links.singular_stress import affected_nodes, re_entrant
from kedfem.scene import ForceLoad, Scene

CORNER = "a sharp re-entrant corner"
GROWS = "stress there depends on the mesh and grows when it is refined"
CONTACT = "the contact itself is not modelled"
CUT = "a cut between two segments where the link is no prism"
AFFINE = "the cut transmits only an affine displacement; links.NAME.segments = 1 or another number shows how much that is"
AWAY = "corners, point forces, surfaces of joints and cuts"


def singular_places(scene: Scene, model: Model, recoveries: Sequence[StressRecovery]) -> list[list[str]]:
    """Per link or segment, then per prescribed rigid link, what each point is near to; mostly empty."""
    full: dict[str, Link] = {str(k): link.full or link for k, link in enumerate(model.links)}
    words = [np.full(recovery.points, "", object) for recovery in recoveries]
    meshed = {link.name for link in full.values() if link.meshed and not link.rigid}
    for stiff in (False, True):
        for name, joint in scene.joints.items():
            for of in meshed.intersection(joint.links):
                if joint.stiff(of) != stiff:
                    continue
                try:
                    key, surface = part_surface(scene, name, full, of)
                except KedfemError:  # the line of a slot
                    continue
                on = np.abs(surface.fit[0]) > 0
                link = full[key]
                what = f"the {'rigid coupling' if stiff else 'surface'} of joint {name}"
                words[int(key)][affected_nodes(link, link.X[on]) if stiff else on] = what
    for name, load in scene.loads.items():
        if isinstance(load, ForceLoad) and load.link in meshed:
            at = np.asarray(load.at)
            where = f"loads.{name}.at"
            key, place = on_part(full, load.link, at, partial(_place, where, at))
            words[int(key)][affected_nodes(full[key], place[None])] = f"the point force loads.{name}"
    for k, link in full.items():
        if link.meshed and not link.rigid:
            words[int(k)][affected_nodes(link, link.X[re_entrant(link)])] = CORNER
    names = link_keys(model)
    for cut in model.cuts:
        for key, facets in zip(cut.keys, cut.uneven, strict=False):
            link = full[str(number := names.index(key))]
            words[number][affected_nodes(link, link.X[link.basis.mesh.facets[:, facets].ravel()])] = CUT
    return [list(each) for each in words]


def _place(where: str, at: Float[np.ndarray, "3"], link: Link) -> Float[np.ndarray, "3"]:
    return point_rows(link, where, at).X


def reason(near: str) -> str:
    """Why stress near such a place is unreliable, in words."""
    if near == CUT:
        return AFFINE
    return CONTACT if near.startswith("the surface") else GROWS
