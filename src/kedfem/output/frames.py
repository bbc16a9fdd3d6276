"""Animation frames from elastic states: where nodes are drawn, and the stresses there."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from kedfem.dynamics.history import LinkMoment, Snapshot
from kedfem.dynamics.model import Model
from kedfem.links.record import Link, in_space
from kedfem.links.recovery import (
    StressRecovery,
    nodal_state,
    nodal_stress,
    principal_stresses,
    turned_stress,
    von_mises,
)
from kedfem.mesh.elements.shape_functions import HEX8
from kedfem.output.fields import LinkField

Place = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3 3"]]
BLOCK = 0.08  # width of the block that stands for a slider without a shape, of the longest link


def _joined(fields: Sequence[LinkField]) -> list[LinkField]:
    """Segments of one link as one field; at a cut both sides keep their own nodes and stresses."""
    out: dict[str, list[LinkField]] = {}
    for field in fields:
        out.setdefault(field.name, []).append(field)
    return [each[0] if len(each) == 1 else _one(each) for each in out.values()]


def _one(parts: Sequence[LinkField]) -> LinkField:
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    cells = np.concatenate([part.cells + n0 for part, n0 in zip(parts, first, strict=False)])
    names = ("points", "displacement", "stress", "von_mises", "principal")
    whole = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return LinkField(parts[0].name, parts[0].cell_type, cells, **whole, section=parts[0].section)


def link_fields(
    model: Model, recoveries: Sequence[StressRecovery], snapshot: Snapshot, deformation_scale: float
) -> list[LinkField]:
    """All links at one time point: R' = R + f, [KED, eqs. (2)(3)], f times the exaggeration.

    Parameters
    ----------
    recoveries : per link, then per prescribed link
    deformation_scale : factor on the elastic displacement where nodes are drawn, not on the displacement itself [-]
    """
    motion, k = snapshot.motion, snapshot.k
    fields = [
        link_field(link, recovery, (motion.p[k, body], motion.R[k, body]), state, deformation_scale)
        for link, body, recovery, state in zip(
            model.links, model.bodies, recoveries[: len(model.links)], snapshot.states, strict=True
        )
    ]
    for prescribed, recovery in zip(model.prescribed, recoveries[len(model.links) :], strict=True):
        X = recovery.at_points((prescribed.link.full or prescribed.link).X)
        points = motion.p[k, prescribed.body] + X @ motion.R[k, prescribed.body].T
        none = np.full((len(X), 6), np.nan)
        name, kind, cells = prescribed.link.name, recovery.cell_type, recovery.cells
        section = _section(prescribed.link)
        fields.append(
            LinkField(name, kind, cells, points, np.zeros_like(X), none, none[:, 0], none[:, :2], section)
        )
    return _joined(fields) + _blocks(model, snapshot, deformation_scale)


def link_field(
    link: Link, recovery: StressRecovery, place: Place, moment: LinkMoment, deformation_scale: float
) -> LinkField:
    """One elastic link where its displacement takes it, which is exaggerated.

    Parameters
    ----------
    place : position and orientation of its rigid-body motion
    """
    shown, (p, R) = link.full or link, place
    displacement = recovery.at_points(in_space(shown, nodal_state(link, moment.u)))
    stress = nodal_stress(recovery, nodal_state(link, moment.g))
    if link.rigid:
        stress = np.full_like(stress, np.nan)
    points = p + recovery.at_points(shown.X) @ R.T + deformation_scale * displacement
    kind, cells = recovery.cell_type, recovery.cells
    von, least_and_most = von_mises(stress), principal_stresses(stress)
    stress = _in_world(shown, moment, stress)
    return LinkField(
        link.name, kind, cells, points, displacement, stress, von, least_and_most, _section(link)
    )


def _in_world(link: Link, moment: LinkMoment, stress: Float[np.ndarray, "p 6"]) -> Float[np.ndarray, "p 6"]:
    """Stresses of a meshed link in the world's axes; nan of a beam."""
    if not link.meshed:
        return np.full_like(stress, np.nan)
    R = np.eye(3)
    R[: link.d, : link.d] = moment.R
    return turned_stress(stress, R @ link.axes)


def _section(link: Link) -> tuple[float, float, bool] | None:
    """Of a planar beam, which is a line."""
    of = (link.full or link).section
    if link.kind != "beam" or of is None:
        return None
    return of.height, of.thickness, of.kind in {"round", "tube"}


def _blocks(model: Model, snapshot: Snapshot, deformation_scale: float) -> list[LinkField]:
    """Sliders without a shape: blocks along their guides, at the joints with the links that carry them."""
    if not model.sliders:
        return []
    motion, k, out = snapshot.motion, snapshot.k, []
    size = BLOCK * max(float(np.ptp(link.X, axis=0).max()) for link in model.links)
    for slider in model.sliders:
        link, body = model.links[slider.carrier], model.bodies[slider.carrier]
        moved = slider.weights @ in_space(link, snapshot.states[slider.carrier].u)
        place = motion.p[k, body] + motion.R[k, body] @ (slider.weights @ link.X) + deformation_scale * moved
        z = slider.axis
        x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
        x /= np.linalg.norm(x)
        frame = np.array([1.5 * z, np.cross(z, x), x])  # longer along the guide
        points = place + size / 2 * HEX8 @ frame
        none = np.full((8, 6), np.nan)
        shift = np.tile(moved, (8, 1))
        cell = np.arange(8)[None]
        out.append(LinkField(slider.name, "hexahedron", cell, points, shift, none, none[:, 0], none[:, :2]))
    return out
