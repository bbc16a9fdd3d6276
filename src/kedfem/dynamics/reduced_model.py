"""Models with reduced links, and their form in a file."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import SharedCut
from kedfem.dynamics.loads import Pattern
from kedfem.dynamics.model import Model, link_keys
from kedfem.links.record import Link
from kedfem.links.reduced import can_be_stored, mode_matrix, reduced, restored, stored


def reduced_model(model: Model, functions: Sequence[Float[np.ndarray, "_ s"] | None]) -> Model:
    """The changed copy of a model whose links move in the span of given functions; None leaves a link as it is."""
    links, joints, loads = list(model.links), list(model.joints), list(model.loads)
    cuts, names = model.cuts, link_keys(model)
    for k, Q in enumerate(functions):
        if Q is not None:
            links[k] = link = reduced(model.links[k], Q)
            cuts = tuple(_cut_on(cut, names[k], link) for cut in cuts)
            on, joint = mode_matrix(link), model.joints[k]
            joints[k] = replace(joint, nodes=np.arange(link.n), weights=joint.weights @ on[joint.nodes])
            loads[k] = tuple(_load_on(load, link) for load in model.loads[k])
    return replace(model, links=tuple(links), joints=tuple(joints), loads=tuple(loads), cuts=cuts)


def stored_model(model: Model) -> Model | None:
    """A copy of a model that can be pickled, of links that are small; None if one is not."""
    if not all(can_be_stored(link) for link in model.links):
        return None
    return _with_links(model, stored)


def restored_model(model: Model) -> Model:
    """The model that `stored_model` was given; unreduced links come without their matrices."""
    return _with_links(model, restored)


def _with_links(model: Model, changed: Callable[[Link], Link]) -> Model:
    prescribed = tuple(replace(x, link=changed(x.link)) for x in model.prescribed)
    return replace(model, links=tuple(map(changed, model.links)), prescribed=prescribed)


def _load_on(load: Pattern, link: Link) -> Pattern:
    return replace(load, forces=mode_matrix(link).T @ load.forces)


def _cut_on(cut: SharedCut, key: str, link: Link) -> SharedCut:
    """A cut, its weights on the functions of a link that has become a reduced one."""
    if key not in cut.keys:
        return cut
    one, other = (x @ mode_matrix(link) if key == name else x for name, x in zip(cut.keys, cut.weights, strict=True))
    return replace(cut, weights=(one, other))
