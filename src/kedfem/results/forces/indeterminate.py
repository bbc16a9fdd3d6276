"""Forces and moments of joints that are statically indeterminate and have no channel, with the reason."""

from collections.abc import Collection, Iterator

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.model import Model
from kedfem.results.forces.constraint_forces import ConstraintForces
from kedfem.results.forces.port_forces import INDETERMINATE, rows_of_joint
from kedfem.results.recorded import drive_effort
from kedfem.scene import GROUND, Scene


def indeterminate_channels(scene: Scene, model: Model, channels: Collection[str]) -> dict[str, str]:
    """The missing channels of joints and drives of a run, each with the reason."""
    out, rows = {}, ConstraintForces(model)
    for name in scene.joints:
        for what in ("force", "moment"):
            if f"joints/{name}/{what}" not in channels:
                out[f"joints/{name}/{what}"] = _reason(scene, model, rows, name)
    for name, drive in scene.all_drives.items():
        if (key := drive_effort(scene, name)[0]) not in channels:
            out[key] = _reason(scene, model, rows, drive.joint)
    return out


def indeterminate_warning(found: dict[str, str]) -> tuple[str, ...]:
    """A warning for each force; moments are in the notes of the results only."""
    forces = {name: reason for name, reason in found.items() if name.endswith(("force", "torque"))}
    return tuple(f"{name}: not reported, {reason}" for name, reason in forces.items())


def _reason(scene: Scene, model: Model, rows: ConstraintForces, name: str) -> str:
    elastic = {link.name for link in model.links}
    links = [link for link in scene.joints[name].links if link != GROUND]
    if not elastic & set(links):
        return f"it joins rigid links alone ({', '.join(links)}), whose constraints are not solved for"
    others = sorted({*_partners(model, name), *rows.shared(name)} - {name, ""})
    if not others:
        return "the balance of forces does not determine it: other joints constrain the same directions"
    return (
        f"the balance of forces does not determine how it is shared with joint{'s' * (len(others) > 1)} "
        f"{', '.join(others)} (redundant constraints)"
    )


def _partners(model: Model, name: str) -> Iterator[str]:
    """Joints whose port forces may change together with those of a joint, in balance."""

    def largest(x: Attachment, joint: str) -> Float[np.ndarray, " r"]:
        return np.asarray(abs(x.loose[rows_of_joint(x, joint)]).max(axis=0).toarray()).ravel()

    here = [largest(x, name) for x in model.joints if name in x.joints and x.loose.shape[1]]
    if not here:
        return
    columns = np.max(here, axis=0) > INDETERMINATE
    for each in model.joints:
        for other in set(each.joints):
            if columns.any() and largest(each, other)[columns].max() > INDETERMINATE:
                yield other
