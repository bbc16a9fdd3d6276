"""A basis of modes for every link or segment of a model, from its static deflections at some instants of the motion."""

from collections.abc import Callable, Collection, Sequence

from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.reduction import Basis, energy_sorted, excited, port_functions, static_parts
from kedfem.dynamics.modes.segment_modes import segment_basis
from kedfem.dynamics.reduced_model import reduced_model
from kedfem.dynamics.rigid_elements import Acting, nothing
from kedfem.dynamics.stepping.state import NodalOf
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion


def reduced_at(
    model: Model, motion: RigidMotion, only: Collection[str], count: Callable[[Link, Basis], int],
    acting: Acting = nothing,
) -> Model:  # fmt: skip
    """The model with some links reduced in the first modes that its loads excite at the times of a motion.

    Parameters
    ----------
    only : names of these links
    count : of modes that a link takes of its basis
    acting : as of `excited`
    """
    found = bases(model, motion, static_parts(model), only, acting)
    every = zip(model.links, found, strict=True)
    return reduced_model(model, [None if x is None else x.first(count(link, x)) for link, x in every])


def bases(
    model: Model, motion: RigidMotion, parts: Sequence[Substructure],
    only: Collection[str] | None = None, acting: Acting = nothing,
) -> list[Basis | None]:  # fmt: skip
    """A basis for every link of a model, from instants spread over the analysis; None for links that need none.

    Segments with co-rotational frames are among them: what they do is examined in rigid-body frames, all segments
    coupled.

    Parameters
    ----------
    parts : `static_parts` of the model
    only : names of the links that need one; all if not given
    acting : as of `excited`
    """
    deflections = excited(model, parts, motion, acting)
    return [
        _basis(model, k, part, found) if only is None or model.links[k].name in only else None
        for k, (part, found) in enumerate(zip(parts, deflections, strict=True))
    ]


def _basis(model: Model, k: int, part: Substructure, deflections: Sequence[NodalOf]) -> Basis:
    link, joint = model.links[k], model.joints[k]
    if link.fit is not None:
        return segment_basis(link, joint, part, deflections)
    return energy_sorted(link, port_functions(link, joint, part), deflections)
