"""Loads of joints and drives for suppliers of bearings and motors: in link axes, equivalent load, peak, rms.

Equivalent bearing load [ISO 281, and catalogues of the makers]: bearings of constant load P live P^−p revolutions, so one
of varying load lives as with P_m = (∫ P^p |ω| dt / ∫ |ω| dt)^(1/p), ω the speed of shaft against housing.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Bool, Float
from kedfem.motion.joint_equations import coordinate_axis, joint_axis, ordered
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.results.recorded import drive_effort
from kedfem.results.records import Results
from kedfem.scene import Joint, Scene, driven_travel
from kedfem.vectors import cross

BALL, ROLLER = 3.0, 10.0 / 3.0  # exponents of bearing lives, ISO 281: point and line contact
HINGES = ("revolute", "cylindrical", "screw")
REPORTED = 3  # components of a force that is reported whole
Vectors = Float[np.ndarray, "T 3"]
Scalars = Float[np.ndarray, " T"]


@dataclass(frozen=True, slots=True)
class JointLoad:
    """The load of a joint over time.

    joint, kind : its name; elastic or rigid: whose links the force is of
    links : the link that `world` acts on, and the other
    world : (T, 3) force on the first link [N]
    inside : (T, 3) each: force that each link bears, in its own axes, which are the world's in the
        reference position [N]; empty where the motion is not known
    axis : (3,) of a hinge, in the reference position; None of other joints
    rate : (T,) speed of one link against the other [rad/s]; None where the motion is not known
    """

    joint: str
    kind: str
    links: tuple[str, str]
    world: Vectors
    inside: tuple[Vectors, ...] = ()
    axis: Float[np.ndarray, "3"] | None = None
    rate: Scalars | None = None

    @property
    def magnitude(self) -> Scalars:
        """(T,) [N]."""
        return np.asarray(np.linalg.norm(self.world, axis=1))

    @property
    def axial(self) -> Scalars | None:
        """(T,) on the first link along a hinge's axis, with sign [N]; None where axis or motion is not known."""
        return None if self.axis is None or not self.inside else np.asarray(self.inside[0] @ self.axis)

    @property
    def bearing(self) -> Scalars | None:
        """(T,) what a bearing's life depends on [N]: of a hinge the radial load, of a ball all; None of other joints."""
        if self.kind == "spherical":
            return self.magnitude
        if (axial := self.axial) is None or self.axis is None:
            return None
        return np.asarray(np.linalg.norm(self.inside[0] - np.outer(axial, self.axis), axis=1))


@dataclass(frozen=True, slots=True)
class DriveLoad:
    """The effort of a drive.

    name : as of `Scene.all_drives`
    effort : (T,) torque [N m], of a slide force [N], as `unit` says
    rate : (T,) of the joint [rad/s or m/s]; None where the motion is not known
    """

    name: str
    unit: str
    effort: Scalars
    rate: Scalars | None

    @property
    def power(self) -> Scalars | None:
        """(T,) [W], positive where it drives."""
        return None if self.rate is None else self.effort * self.rate


def mean_over(t: Scalars, x: Scalars) -> float:
    """Mean over time by the trapezoidal rule; of one instant its value."""
    if len(t) < 2:
        return float(x.mean()) if len(x) else float("nan")
    return float(np.trapezoid(x, t) / (t[-1] - t[0]))


def rms(t: Scalars, x: Scalars) -> float:
    """Root of the mean square over time."""
    return float(np.sqrt(mean_over(t, x**2)))


def equivalent_load(t: Scalars, P: Scalars, rate: Scalars, p: float) -> float:
    """P_m = (∫ P^p |ω| dt / ∫ |ω| dt)^(1/p) [N]; nan without rotation.

    Parameters
    ----------
    t : (T,) [s]
    P : (T,) load, not negative [N]
    rate : (T,) speed of shaft against housing [rad/s]
    p : 3 for ball bearings, 10/3 for roller bearings

    Examples
    --------
    >>> t = np.linspace(0.0, 1.0, 11)
    >>> round(equivalent_load(t, np.full(11, 50.0), np.full(11, 3.0), 3), 9)
    50.0
    """
    turned = mean_over(t, np.abs(rate))
    largest = float(P.max(initial=0.0))
    if not turned > 0 or not largest > 0:
        return float("nan") if not turned > 0 else 0.0
    return float(largest * (mean_over(t, (P / largest) ** p * np.abs(rate)) / turned) ** (1 / p))


def in_axes(x: Vectors, R: Float[np.ndarray, "T 3 3"]) -> Vectors:
    """World vectors in the axes of a frame R."""
    return np.asarray((x[:, None] @ R)[:, 0])


def joint_loads(scene: Scene, results: Results, moved: tuple[Linkage, RigidMotion] | None) -> list[JointLoad]:
    """Loads of all joints with complete forces in the results: elastic ones if present, else those of rigid links.

    Parameters
    ----------
    moved : the scene's rigid motion at the rows of the results; None where it is not known
    """
    out = []
    for name, joint in scene.joints.items():
        for key in ("force", "rigid_force"):
            channel, force = results.channels.get(f"joints/{name}/{key}", (None, None))
            if channel is None or force is None or len(channel.columns) != REPORTED:
                continue
            load = JointLoad(name, joint.kind, acted_links(name, joint, channel.description), force)
            out.append(load if moved is None else _in_link_axes(load, joint, *moved))
            break
    return out


def _in_link_axes(load: JointLoad, joint: Joint, linked: Linkage, motion: RigidMotion) -> JointLoad:
    """A load with its components in the axes of both links, and the speed of one against the other."""
    one, other = (linked.bodies.index(link) for link in load.links)
    force = load.world
    inside = in_axes(force, motion.R[:, one]), in_axes(-force, motion.R[:, other])
    rate = np.linalg.norm(motion.omega[:, one] - motion.omega[:, other], axis=1)
    axis = joint_axis(joint) if joint.kind in HINGES else None
    return replace(load, inside=inside, axis=axis, rate=rate)


def acted_links(name: str, joint: Joint, description: str) -> tuple[str, str]:
    """The link that a joint's force acts on, and the link that exerts it, from the description of its channel.

    Raises
    ------
    ValueError
        The description names neither.
    """
    one, other = joint.links
    for on, by in ((one, other), (other, one)):
        words = f"force of joint {re.escape(name)} on link {re.escape(on)} from {re.escape(by)}"
        if re.match(rf"{words}([ ;]|\Z)", description):
            return on, by
    raise ValueError(f"joint {name}: must name the link on which the force acts, got {description!r}")


def drive_loads(scene: Scene, results: Results, moved: tuple[Linkage, RigidMotion] | None) -> list[DriveLoad]:
    """Loads of all drives with efforts in the results: elastic ones if present, else those of rigid links."""
    out = []
    for name in scene.all_drives:
        keys = [drive_effort(scene, name, rigid)[0] for rigid in ("", "rigid_")]
        found = next((results.channels[key] for key in keys if key in results.channels), None)
        if found is not None:
            rate = drive_rate(scene, name, *moved) if moved else None
            out.append(DriveLoad(name, found[0].unit, found[1][:, 0], rate))
    return out


def drive_rate(scene: Scene, name: str, linked: Linkage, motion: RigidMotion) -> Scalars:
    """(T,) rate of the angle [rad/s] or travel [m/s] that one of `Scene.all_drives` prescribes."""
    drive = scene.all_drives[name]
    joint = scene.joints[drive.joint]
    one, other = (linked.bodies.index(link) for link in ordered(joint, drive.about))
    axis = motion.R[:, other] @ coordinate_axis(joint, drive.about, drive.along)
    if not driven_travel(scene, name):
        return np.asarray(((motion.omega[:, one] - motion.omega[:, other]) * axis).sum(axis=1))
    at = np.asarray(joint.at)
    there = motion.position(one, at) - motion.p[:, other]
    v = motion.velocity(one, at) - motion.v[:, other] - cross(motion.omega[:, other], there)
    return np.asarray((v * axis).sum(axis=1))


def last_revolutions(results: Results, turns: float | None) -> Bool[np.ndarray, " T"]:
    """The rows of the last revolutions of the drive; all if their number is not given."""
    if turns is None:
        return np.ones(len(results.time), bool)
    gone = np.abs(results.angle - results.angle[-1])
    later = np.cumsum((gone > 2 * np.pi * turns * (1 + 1e-9))[::-1])[::-1] == 0
    return np.asarray(later)


def polar_axes(axis: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Unit vectors e1, e2 of a polar diagram about an axis, e1 × e2 = axis: e1 nearest to x, or to y about x itself."""
    start = np.eye(3)[1 if abs(axis[0]) > 1 - 1e-6 else 0]
    e1 = start - (start @ axis) * axis
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(axis, e1)


def summary(load: JointLoad, results: Results, rows: Bool[np.ndarray, " T"]) -> Mapping[str, float]:
    """Peak with its time and drive, mean and rms of the magnitude, largest axial and radial load, equivalent loads."""
    t, size = results.time[rows], load.magnitude[rows]
    k, none = int(size.argmax()), float("nan")
    bearing, axial = load.bearing, load.axial
    out = {
        "peak [N]": float(size[k]), "time of peak [s]": float(t[k]), **_drive_at("peak", results, rows, k),
        "mean [N]": mean_over(t, size), "rms [N]": rms(t, size),
        "largest bearing load [N]": none if bearing is None else float(bearing[rows].max()),
        "largest axial [N]": none if axial is None else float(np.abs(axial[rows]).max()),
    }  # fmt: skip
    for name, p in (("ball", BALL), ("roller", ROLLER)):
        known = bearing is not None and load.rate is not None
        P = equivalent_load(t, bearing[rows], load.rate[rows], p) if known else none  # type: ignore[index]
        out[f"equivalent, {name} bearing [N]"] = P
    return out


def _drive_at(what: str, results: Results, rows: Bool[np.ndarray, " T"], k: int) -> dict[str, float]:
    """The drive's position at a row; nothing where there are several, of which results have that of the first."""
    if any(name.startswith("drive/") and name.count("/") > 1 for name in results.channels):
        return {}
    return {f"drive at {what} [{results.drive.unit}]": float(results.angle[rows][k])}


def drive_summary(load: DriveLoad, results: Results, rows: Bool[np.ndarray, " T"]) -> Mapping[str, float]:
    """Largest effort with its time and drive, rms, mean; largest, mean and rms power."""
    t, effort = results.time[rows], load.effort[rows]
    k, none = int(np.abs(effort).argmax()), float("nan")
    power = None if load.power is None else load.power[rows]
    return {
        f"largest [{load.unit}]": float(effort[k]), "time of largest [s]": float(t[k]),
        **_drive_at("largest", results, rows, k),
        f"mean [{load.unit}]": mean_over(t, effort), f"rms [{load.unit}]": rms(t, effort),
        "largest power [W]": none if power is None else float(power[np.abs(power).argmax()]),
        "mean power [W]": none if power is None else mean_over(t, power),
        "rms power [W]": none if power is None else rms(t, power),
    }  # fmt: skip
