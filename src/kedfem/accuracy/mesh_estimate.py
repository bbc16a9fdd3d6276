"""The error of meshes: the change by twice as many elements, or the indicator of their stresses."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from kedfem.accuracy.error_budget import Share, by_kind
from kedfem.accuracy.histories import Histories, histories, relative_errors
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import first_reduced
from kedfem.accuracy.variants import refined, with_links
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.model import Model
from kedfem.links.indicator import Indicator
from kedfem.links.record import Link
from kedfem.scene import Scene

COMPANION_MODES = 1e-3  # tolerance of a companion's modes, sufficient for differences of runs
REST = 1.1  # error over the change by twice as many elements (order 4 and more in beams)
SOFT = 2.0  # error of the compliance over η²: few elements and neighbours hide half of it (measured, 3 to 8)
LOCAL = 0.05  # error of the stress at a point over η, in addition to that of the compliance


def mesh_errors(
    small: Prepared, base: Histories, eta: Mapping[str, float], zeros: set[str] | None = None
) -> dict[str, float]:
    """Error of all meshes in each channel: beams with twice the elements, other links softer by 2 η².

    Parameters
    ----------
    zeros : set to which the names of channels that are zero beside others are added
    """
    model, every = small.model, small.scene.links.items()
    beams = {name: refined(link, 2.0) for name, link in every if link.category == "beam" and link.shape is not None}
    if beams:
        scene = with_links(small.scene, beams)
        links = {link.name: link.full or link for link in model.links}
        if any(link.meshed for link in links.values()):
            return _separate(small, base, scene, eta, zeros)
        model = elastic_model(scene, small.linkage, along=small.path)
        other = histories(replace(small, scene=scene, model=model))
        return {name: REST * error for name, error in relative_errors(base, other, zeros).items()}
    other = histories(replace(small, model=softened(model, eta)), near=base.begun)
    return relative_errors(base, other, zeros)


def _separate(
    small: Prepared, base: Histories, finer: Scene, eta: Mapping[str, float], zeros: set[str] | None
) -> dict[str, float]:
    """Error in each channel of a scene with beams and meshed links: the sum of their separate errors."""
    softer = histories(replace(small, model=softened(small.model, eta)), near=base.begun)
    soft = relative_errors(base, softer, zeros)
    if any(link.meshed and link.fit is not None for link in small.model.links):
        return soft
    model = elastic_model(finer, small.linkage, along=small.path)
    whole = first_reduced(replace(small, scene=finer, model=model), COMPANION_MODES)
    other = relative_errors(base, histories(whole), zeros)
    return {name: soft[name] + REST * other.get(name, 0.0) for name in soft}


def softened(model: Model, eta: Mapping[str, float]) -> Model:
    """The model with meshed links softened by the error of their meshes: K0 (1 − 2 η²)."""
    factors = (max(1 - SOFT * eta.get(link.name, 0.0) ** 2, 0.2) for link in model.links)
    return replace(model, links=tuple(map(_softer, model.links, factors)))


def _softer(link: Link, factor: float) -> Link:
    if factor == 1.0 or link.rigid:
        return link
    return replace(link, K0=link.K0 * factor, frames=tuple(replace(x, K0=x.K0 * factor) for x in link.frames))


def link_errors(model: Model, found: Mapping[int, Indicator]) -> dict[str, float]:
    """η of each link, over all of its segments [-]."""
    sums: dict[str, np.ndarray] = {}
    for k, each in found.items():
        name = model.links[k].name
        sums[name] = sums.get(name, np.zeros(2)) + np.array([each.error, each.error + each.energy])
    return {name: float(np.sqrt(error / whole)) if whole else 0.0 for name, (error, whole) in sums.items()}


def plain_mesh_share(eta: Mapping[str, float], kinds: tuple[str, ...]) -> Share | None:
    """The mesh's share of the error of a model without a companion: by η² for motion, and by η for stress."""
    if not eta:
        return None
    worst = max(eta.values())
    errors = {kind: SOFT * worst**2 + (LOCAL * worst if kind == "stress" else 0.0) for kind in kinds}
    return Share("mesh", errors)


def mesh_share(small: Prepared, base: Histories, eta: Mapping[str, float], zeros: set[str] | None = None) -> Share:
    """The error of the elements of beams, and of solid and plane links, as a share of the budget; as `mesh_errors`."""
    errors = by_kind(mesh_errors(small, base, eta, zeros))
    if eta and "stress" in errors:
        errors["stress"] += LOCAL * max(eta.values())
    return Share("mesh", errors)
