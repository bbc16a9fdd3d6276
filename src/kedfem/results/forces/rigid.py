"""Channels of rigid inverse dynamics: forces of joints and drives with all links rigid."""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.inertias import Inertias, acting
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.rigid_elements import RigidElements, rigid_elements
from kedfem.motion.joint_equations import ordered
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path, path
from kedfem.motion.reactions import Reactions, effort, reactions
from kedfem.motion.released_motions import components
from kedfem.motion.rigid import RigidMotion
from kedfem.results.channels import XYZ, Channel
from kedfem.results.recorded import Rows, effort_channel
from kedfem.scene import GROUND, ConstantSpeed, Joint, Scene, revolution_steps
from kedfem.vectors import cross

Responses = Float[np.ndarray, "T c k"]
OPEN = 1e-9  # of squares: a smaller share of a joint's force is rounding
ALONG = 1e-6  # sine of an angle between axes that are the same
FEW = 4  # poses of a linkage of many bodies at which the determinate forces of its joints are found
KEPT = 4000  # time points of a revolution whose responses are kept, some kilobytes each


@dataclass(frozen=True, slots=True)
class RigidChannel:
    """A channel of the force of a joint or drive.

    which : 0 force, 1 moment, 2 + k effort of drive k
    body, at : the body that it acts on, and the point that moments are about, in the reference position [m]
    project : (c, 3) from world components to columns of a force or moment, without statically indeterminate parts
    """

    channel: Channel
    joint: str
    which: int
    body: int
    at: Float[np.ndarray, "3"]
    project: Float[np.ndarray, "c 3"]


@dataclass(slots=True)
class RigidForces:
    """Rigid inverse dynamics of a scene, computed once for each motion.

    force_elements : motors and springs, if any, which are loads of given motion
    turn : time steps after which all poses return; 0 if they do not
    """

    scene: Scene
    linkage: Linkage
    inertias: Inertias
    every: tuple[RigidChannel, ...]
    force_elements: RigidElements | None
    turn: int = 0
    _motion: RigidMotion | None = None
    _rows: dict[str, Rows] = field(default_factory=dict)
    _kept: list[Responses] = field(default_factory=list)

    def rows(self, motion: RigidMotion, step: int | None = None) -> dict[str, Rows]:
        """The rows of all channels.

        Parameters
        ----------
        step : number of the first time step, where the motion is a part of the scene's own; in order
        """
        if self.every and motion is not self._motion:
            force, moment = acting(self.inertias, motion)
            centre = motion.p + motion.R @ self.inertias.centre
            for body, f, m in self.force_elements.wrenches(motion) if self.force_elements else ():
                force[:, body] += f
                moment[:, body] += m - cross(centre[:, body], f)
            wrench = np.concatenate([force, moment], axis=2)[:, 1:]
            self._rows = self._joint_forces(motion, step, wrench)
            self._motion = motion
        return self._rows

    def _joint_forces(self, motion: RigidMotion, step: int | None, wrench: Float[np.ndarray, "T b 6"]) -> dict[str, Rows]:
        """All channels where forces and moments act on the bodies; where poses return, by responses that are kept."""
        names = [each.channel.name for each in self.every]
        if not self.turn or step is None or step < 1:
            return dict(zip(names, self._by_multipliers(motion, wrench), strict=True))
        values = (self._responses(motion, step) @ wrench.reshape(len(motion.t), -1, 1))[..., 0]
        ends = np.cumsum([len(each.channel.columns) for each in self.every])[:-1]
        return dict(zip(names, np.split(values, ends, axis=1), strict=True))

    def _by_multipliers(self, motion: RigidMotion, wrench: Float[np.ndarray, "T b 6"]) -> Iterator[Rows]:
        found = reactions(self.linkage, motion)
        multipliers = found.multipliers(wrench)
        for each in self.every:
            if each.which < 2:
                exerted = found.joint_wrench(each.joint, each.body, each.at, multipliers)
                yield exerted[each.which] @ each.project.T
            else:
                yield (multipliers @ effort(self.linkage, each.which - 2))[:, None]

    def _responses(self, motion: RigidMotion, step: int) -> Responses:
        """All channels from forces and moments on bodies; those of the first revolution are used for all later ones."""
        known = sum(map(len, self._kept))
        if known < self.turn and step == known + 1:
            self._kept.append(self._made(motion))
            return self._kept[-1]
        if known < self.turn or step <= known:
            return self._made(motion)
        if len(self._kept) > 1:
            self._kept = [np.concatenate(self._kept)]
        return self._kept[0][(step - 1 + np.arange(len(motion.t))) % self.turn]

    def _made(self, motion: RigidMotion) -> Responses:
        found = reactions(self.linkage, motion)
        return found.responses(np.concatenate([self.channel_of(found, each) for each in self.every], axis=2))

    def channel_of(self, found: Reactions, each: RigidChannel) -> Float[np.ndarray, "T m c"]:
        """A channel from scaled λ."""
        if each.which < 2:
            return np.asarray(found.on(each.joint, each.body, each.at)[each.which] @ each.project.T)
        of_rows = effort(self.linkage, each.which - 2)
        return np.broadcast_to(of_rows[:, None], (len(found.motion.t), len(of_rows), 1))


def rigid_forces(scene: Scene, linkage: Linkage, inertias: Inertias, along: Path | None = None) -> RigidForces:
    """The determinate channels of a driven scene: drives, and with a path all joints; none of a scene with free motions,
    which the rigid linkage locks by constraints that the scene does not have.
    """
    every: list[RigidChannel] = []
    if not linkage.mobility:
        if along is not None:
            found = reactions(linkage, _on_grid(linkage, along))
            every += [x for name in scene.joints for x in _joint(scene, linkage, found, name)]
        every += [_drive(scene, linkage, k) for k in range(len(linkage.drives))]
    elements = None
    if scene.springs or scene.motors or scene.limits:
        elements = rigid_elements(scene, linkage, along or path(linkage, *drive_range(scene)))
    turn = return_steps(scene, along) if linkage.blocks is None else 0  # responses of many bodies would fill the memory
    return RigidForces(scene, linkage, inertias, tuple(every), elements, turn)


def return_steps(scene: Scene, along: Path | None) -> int:
    """Time steps of one or a few revolutions after which all poses return; 0 if they do not, or for too many."""
    if along is None or not along.periodic or not isinstance(scene.motion, ConstantSpeed):
        return 0
    turn = (revolution_steps(scene) or 0.0) * along.period / (2 * np.pi)
    return round(turn) if abs(turn - round(turn)) < 1e-9 * turn and turn <= KEPT else 0


def reported_link(scene: Scene, joint: Joint) -> str:
    """The link on which a joint's force is reported: the first that is not the ground."""
    return next(name for name in joint.links if name != GROUND)


def _drive(scene: Scene, linkage: Linkage, k: int) -> RigidChannel:
    name, drive = list(scene.all_drives.items())[k]
    joint = scene.joints[drive.joint]
    link = ordered(joint, drive.about)[0]
    channel = effort_channel(scene, name, "rigid_")
    return RigidChannel(channel, drive.joint, 2 + k, linkage.bodies.index(link), np.asarray(joint.at), np.zeros((1, 3)))


def _joint(scene: Scene, linkage: Linkage, found: Reactions, name: str) -> list[RigidChannel]:
    joint = scene.joints[name]
    link = reported_link(scene, joint)
    other = next(each for each in joint.links if each != link)
    body, at = linkage.bodies.index(link), np.asarray(joint.at)
    label = f"of joint {name} on link {link} from {other} with all links rigid"
    about = f"moment {label}, about the joint's point of the rigid-body motion"
    sums = [found.open_directions(each) for each in found.on(name, body, at)]
    squares = (linkage.size**2, 1.0)  # forces count by the moments that they may make
    shares = [[x * square for x in each] for each, square in zip(sums, squares, strict=True)]
    largest = max(*(float(np.trace(whole)) for _, whole in shares), np.finfo(float).tiny)
    out = []
    for which, (what, text, unit) in enumerate((("force", f"force {label}", "N"), ("moment", about, "N m"))):
        columns, project, left = determined(*(x / largest for x in shares[which]))
        if columns:
            channel = Channel(f"joints/{name}/rigid_{what}", columns, unit, "world", text + left)
            out.append(RigidChannel(channel, name, which, body, at, project))
    return out


def determined(
    open_part: Float[np.ndarray, "3 3"], whole: Float[np.ndarray, "3 3"]
) -> tuple[tuple[str, ...], Float[np.ndarray, "c 3"], str]:
    """Statically determinate columns of a joint's force, the matrix from world components to them, and in words what is
    left out.

    Parameters
    ----------
    open_part, whole : Σ D Dᵀ and Σ A Aᵀ of `Reactions.open_directions`, relative to the whole force of the joint
    """
    size, axes = np.linalg.eigh(open_part)
    lost = axes[:, size > OPEN]
    P = np.eye(3) - lost @ lost.T
    if np.trace(P @ whole @ P) < OPEN or lost.shape[1] == 3:
        return (), np.zeros((0, 3)), ""
    if not lost.shape[1]:
        return XYZ, np.eye(3), ""
    kept = np.flatnonzero(np.linalg.norm(lost, axis=1) < ALONG)
    if len(kept) == 3 - lost.shape[1]:  # the indeterminate directions are axes of the world
        return tuple(XYZ[k] for k in kept), np.eye(3)[kept], ""
    which = ", ".join(components(n, 6) for n in lost.T)
    return XYZ, P, f"; without the part along {which}, which is statically indeterminate"


def _on_grid(linkage: Linkage, along: Path) -> RigidMotion:
    """The linkage at the drive angles of its path, of many bodies at a few of them, at rest."""
    few = FEW if linkage.blocks is not None else len(along.phi)
    which = np.unique(np.linspace(0, len(along.phi) - 1, few).round().astype(int))
    R, c, T = along.R[which], linkage.centre, len(which)
    p = along.p[which] + c - R @ c
    zero, still = np.zeros_like(p), np.zeros_like(R)
    t, none = np.zeros(T), np.zeros((T, 0))
    return RigidMotion(t, along.phi[which], R, p, zero, zero, zero, still, zero, none)
