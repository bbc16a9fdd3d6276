"""From the elastic motion to rows of channels: probes, joint forces, drive torque; block by block."""

from collections.abc import Callable, Sequence

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from kedfem.dynamics.history import Block
from kedfem.dynamics.inertias import inertias_of_model
from kedfem.dynamics.model import Model, on_segment
from kedfem.errors import SceneError
from kedfem.links.recovery import point_rows, von_mises
from kedfem.motion.linkage import linkage
from kedfem.motion.path import Path
from kedfem.results.acting import acting, measured_actions
from kedfem.results.audit import Account, energy_channels
from kedfem.results.joint_forces import XYZ, Forces, drive_channels, gear_channel, joint_channels
from kedfem.results.recorded import Recorded, Rows
from kedfem.results.records import Channel
from kedfem.results.rigid import rigid_forces
from kedfem.results.row_forces import RowForces
from kedfem.scene import ForceLoad, Probe, Scene, TorqueLoad

STRESS = ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises")
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def recording(
    scene: Scene, model: Model, account: Account | None = None, along: Path | None = None
) -> list[Recorded]:
    """All channels that a scene asks for.

    Parameters
    ----------
    account : of energy and momentum, if one is kept already
    along : path of the rigid motion, if joint forces of rigid links are wanted beside those of elastic ones

    Raises
    ------
    SceneError
        If a probe is outside its link.
    """
    probes = [_probe(scene, model, name, probe) for name, probe in scene.output.probes.items()]
    actions = account.actions if account else None
    forces = Forces(RowForces(model), actions or measured_actions(scene, model))
    account = account or Account(model, forces.actions)
    joints = [channel for name in scene.joints for channel in joint_channels(scene, model, name, forces)]
    drive = [
        channel for name in scene.driven_joints for channel in drive_channels(scene, model, name, forces)
    ]
    gears = [gear_channel(model, name, forces) for name in scene.gears]
    energies = [Recorded(*each) for each in energy_channels(account)]
    return [
        *probes,
        *joints,
        *drive,
        *gears,
        *_rigid(scene, model, along),
        *acting(scene, forces.actions),
        *energies,
    ]


def rows(recorded: Sequence[Recorded], block: Block) -> dict[str, Rows]:
    """The rows of every channel."""
    return {each.channel.name: each.rows(block) for each in recorded}


def _rigid(scene: Scene, model: Model, along: Path | None) -> list[Recorded]:
    """What joints and drive would bear were all links rigid."""
    if scene.driven is None:
        return []
    linked = linkage(scene)
    forces = rigid_forces(scene, linked, inertias_of_model(scene, linked, model), along)

    def rows(name: str) -> Callable[[Block], Rows]:
        return lambda block: forces.rows(block.motion, block.step)[name]

    return [Recorded(each.channel, rows(each.channel.name)) for each in forces.every]


def _probe(scene: Scene, model: Model, name: str, probe: Probe) -> Recorded:
    where, drawn = f"output.probes.{name}.at", np.asarray(probe.at)
    kinks = _kinks(scene, probe.link)
    k, at = on_segment(model, probe.link, drawn, lambda link: point_rows(link, where, drawn, kinks))
    link = model.links[k]
    key = f"probes/{name}/{probe.quantity}"
    place = f"of link {probe.link} at ({', '.join(f'{x:.6g}' for x in at.X)}) m as drawn"
    if probe.quantity == "stress":
        dofs, dense = _compact(at.stress)

        def stress(block: Block) -> Rows:
            g = block.links[k].g
            s = g.reshape(len(g), -1)[:, dofs] @ dense.T
            return np.column_stack([s, von_mises(s)])

        return Recorded(Channel(key, STRESS, "Pa", "link", f"stress {place}"), stress)
    beside = float(np.linalg.norm(at.X - probe.at))
    if link.kind == "beam" and beside > 1e-6 * link.size:
        raise SceneError(
            f"output.probes.{name}.at: must lie on the axis of beam '{link.name}' for a {probe.quantity}, "
            f"got {beside:.3g} m beside it"
        )
    nodes = np.flatnonzero(at.value)
    weights = at.value[nodes]
    field = {"displacement": "u", "velocity": "v", "acceleration": "a"}[probe.quantity]
    columns = XYZ[:2] if link.planar else XYZ

    def vector(block: Block) -> Rows:
        history = block.links[k]
        x = np.tensordot(getattr(history, field)[:, nodes], weights, (1, 0))
        if probe.frame == "link":
            R = block.motion.R[:, model.bodies[k], : link.d, : link.d]
            x = (x[:, None] @ R)[:, 0] @ link.axes[: link.d, : link.d]
        return np.asarray(x[:, : len(columns)])

    description = f"{'' if scene.driven is None else 'elastic '}{probe.quantity} {place}"
    return Recorded(Channel(key, columns, UNITS[probe.quantity], probe.frame, description), vector)


def _kinks(scene: Scene, link: str) -> Float[np.ndarray, "_ 3"]:
    """Where single forces act on a link: its joints, bodies and loads at a point [m]."""
    joints = [joint.at for joint in scene.joints.values() if link in joint.links]
    bodies = [body.at for body in scene.bodies.values() if body.link == link]
    single = [x for x in scene.loads.values() if isinstance(x, ForceLoad | TorqueLoad) and x.link == link]
    forces = [load.at for load in single if load.at is not None]
    return np.array([*joints, *bodies, *forces]).reshape(-1, 3)


def _compact(matrix: sp.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """The columns that a matrix uses, and the matrix on them, dense."""
    columns = np.unique(matrix.indices)
    return columns, matrix[:, columns].toarray()
