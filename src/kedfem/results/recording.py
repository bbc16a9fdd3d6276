"""Rows of channels from the elastic motion, block by block: probes, joint forces, drive torque."""

from collections.abc import Sequence
from functools import partial

from kedfem.dynamics.history import Block
from kedfem.dynamics.inertias import inertias_of_model
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.solvers import stresses_of
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.path import Path
from kedfem.results.audit import Account, energy_channels
from kedfem.results.forces.constraint_forces import ConstraintForces
from kedfem.results.forces.drive_forces import drive_channels, gear_channel
from kedfem.results.forces.force_elements import element_channels, element_forces
from kedfem.results.forces.joint_forces import joint_channels
from kedfem.results.forces.port_forces import Forces
from kedfem.results.forces.rigid import rigid_forces
from kedfem.results.probes import probe_channels
from kedfem.results.recorded import Recorded, Rows
from kedfem.scene import Scene, without_vibration

STRAIN = "energy/strain"


def recording(
    scene: Scene, model: Model, account: Account | None = None, along: Path | None = None,
    linked: Linkage | None = None,
) -> list[Recorded]:  # fmt: skip
    """All channels that a scene asks for.

    Parameters
    ----------
    account : the energy account, if there is one
    along : path of the rigid motion, if joint forces of rigid links are wanted beside those of elastic ones
    linked : the scene's linkage, if available

    Raises
    ------
    SceneError
        If a probe is outside its link.
    """
    probes = probe_channels(scene, model, linked)
    force_elements = account.force_elements if account else None
    forces = Forces(ConstraintForces(model), force_elements or element_forces(scene, model))
    account = account or Account(model, forces.force_elements, lambda: stresses_of(scene, model))
    joints = [channel for name in scene.joints for channel in joint_channels(scene, model, name, forces)]
    driven = scene.all_drives
    drive = [channel for name in driven for channel in drive_channels(scene, model, name, forces)]
    gears = [gear_channel(model, name) for name in scene.gears]
    energies = [Recorded(*each) for each in energy_channels(account)]
    if without_vibration(scene):  # sums over time steps say nothing of positions found each by itself
        energies = [each for each in energies if each.channel.name == STRAIN]
    return [
        *probes, *joints, *drive, *gears, *_rigid(scene, model, along, linked),
        *element_channels(scene, forces.force_elements), *energies,
    ]  # fmt: skip


def rows(recorded: Sequence[Recorded], block: Block) -> dict[str, Rows]:
    """The rows of every channel."""
    return {each.channel.name: each.rows(block) for each in recorded}


def _rigid(scene: Scene, model: Model, along: Path | None, linked: Linkage | None) -> list[Recorded]:
    """Forces of joints and drive if all links were rigid."""
    if scene.driven is None:
        return []
    linked = linked or linkage(scene)
    forces = rigid_forces(scene, linked, inertias_of_model(scene, linked, model), along)

    def rows(name: str, block: Block) -> Rows:
        return forces.rows(block.motion, block.step)[name]

    return [Recorded(each.channel, partial(rows, each.channel.name)) for each in forces.every]
