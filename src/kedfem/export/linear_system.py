"""The mechanism at a position of its drive as a linear system, x' = A x + B u, y = C x + D u."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from kedfem.accuracy.frequencies import frozen
from kedfem.arrays import Float
from kedfem.dynamics.history import Block, LinkHistory
from kedfem.dynamics.loads import unit_forces
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.frozen import released, require_drive, tangent_warning
from kedfem.dynamics.modes.linear_model import LinearModel, Shapes, linear_model
from kedfem.dynamics.system.record import System
from kedfem.errors import SceneError
from kedfem.export.files import read_record, write_record
from kedfem.motion.assembly import assembled, assembly_warning
from kedfem.motion.linkage import Linkage
from kedfem.motion.rigid import RigidMotion
from kedfem.results.probes import probe_channels
from kedfem.results.recorded import Recorded, drive_prefix
from kedfem.scene import Motor, Scene, driven_travel, time_grid

FORMAT = "kedfem state space 1"
# of a link's size: displacements from whose differences outputs are; exact where these are linear
SMALL = 1e-5
STIFF = (
    "state space: weight and rotation at this position act as a stiffness, lowest frequency {:.4g} Hz, on what a "
    "released drive moves, without the Coriolis forces: leave analysis.stiffening out for a drive that moves freely"
)
NOTHING = 1e-12  # of the largest of its unit: an input so small does nothing

Matrix = Float[np.ndarray, "_ _"]


@dataclass(frozen=True, slots=True)
class StateSpace:
    """A mechanism about a position: x' = A x + B u, y = C x + D u, all small changes against it.

    A, B, C, D : (2m, 2m), (2m, i), (o, 2m), (o, i); x is m modal coordinates [kg^½ m], then their rates
    inputs, input_units : (i,) `loads/NAME`, times the load as the scene has it [1]; `motors/NAME/torque` or `force`, and
        `drive/torque` or `force` of a drive that lets go [N m, N]
    outputs, output_units : (o,) `probes/NAME/QUANTITY/COLUMN`; `angle` and `speed`, or `travel` and `speed`, of motors
        and of a drive that lets go
    frequencies : (m,) natural frequencies, undamped; zero of motions without strain [Hz]
    time, position : of the mechanism [s]; of its drive, angle [rad] or travel [m]
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    frequencies: Float[np.ndarray, " m"]
    time: float
    position: float


@dataclass(frozen=True, slots=True)
class _Element:
    """A motor, or what a drive that lets go leaves: its name in the scene and in the file, N m or N."""

    motor: str
    channel: str
    turns: bool

    @property
    def effort(self) -> tuple[str, str]:
        """Name and unit of what it exerts."""
        return (f"{self.channel}/torque", "N m") if self.turns else (f"{self.channel}/force", "N")

    @property
    def moves(self) -> tuple[tuple[str, str], tuple[str, str]]:
        """Names and units of its coordinate and of its rate."""
        what, unit = ("angle", "rad") if self.turns else ("travel", "m")
        return (f"{self.channel}/{what}", unit), (f"{self.channel}/speed", f"{unit}/s")


def state_space(
    scene: Scene, modes: int = 12, at: float = 0.0, free: bool = False, stage: Callable[[str], None] = lambda name: None
) -> tuple[StateSpace, tuple[str, ...]]:
    """The linear system of a scene's mechanism frozen at a position, and warnings; all links unreduced.

    Parameters
    ----------
    modes : vibrations that are kept, beside motions without strain
    at : time at which the drive is at the position [s]
    free : whether the drives release their joints, and their torques or forces are inputs; else they hold them
    """
    _require(scene, modes, at, free)
    scene, assembly = assembled(scene)
    stage("mesh and matrices")
    made, _, meshes = frozen(scene, modes, at, (lambda scene: _let_go(scene)[0]) if free else None)
    scene, system, motion = made.scene, made.system, made.motion
    loose, elements = _let_go(scene) if free else (scene, ())
    motors = (_Element(x, f"motors/{x}", motor.torque is not None) for x, motor in scene.motors.items())
    elements = (*motors, *elements)
    stage("modes")
    names = {each.name: n for n, each in enumerate(system.constraints)}
    found = linear_model(
        made.solver.frozen(motion), motion, (system.model.damping, system.model.links),
        [_unit(system, name, motion) for name in scene.loads], [names[f"motors.{each.motor}"] for each in elements],
    )  # fmt: skip
    space = _space(loose, made.linkage, system.model, motion, found, elements)
    stiff = (STIFF.format(space.frequencies[0]),) if free and scene.analysis.stiffening and space.frequencies[0] else ()
    said = (*assembly_warning(assembly), *tangent_warning(system, "state space"), *meshes, *stiff)
    return space, (*said, *_idle(space))


def _require(scene: Scene, modes: int, at: float, free: bool) -> None:
    """SceneError where what is asked for cannot be had of a scene."""
    if modes < 1:
        raise SceneError(f"--modes: must be at least 1, got {modes}")
    require_drive(scene, free)
    end = time_grid(scene).end if scene.driven else 0.0
    if not 0 <= at <= end:
        wanted = f"within the analysis, 0 to {end:.6g} s" if scene.driven else "0 without a drive"
        raise SceneError(f"--at: must be {wanted}, got {at:.6g} s")
    if not (free or scene.loads or scene.motors):
        raise SceneError(
            "--state-space: must have an input, got a scene without loads and motors: add one, or let the drive go "
            "by --free"
        )
    if not (free or scene.output.probes or scene.motors):
        got = "got a scene without probes and motors: add [output.probes.NAME]"
        raise SceneError(f"--state-space: must have an output, {got}")


def _let_go(scene: Scene) -> tuple[Scene, tuple[_Element, ...]]:
    """A scene whose drives have become motors that exert nothing."""
    elements, motors = [], dict(scene.motors)
    for name, drive in scene.all_drives.items():
        turns = not driven_travel(scene, name)
        channel = drive_prefix(scene, name).removesuffix("/")
        element = _Element(f"drive of {name}", channel, turns)
        given = {"joint": drive.joint, "about": drive.about, "along": drive.along, "torque" if turns else "force": 0.0}
        motors[element.motor] = Motor.model_validate({key: x for key, x in given.items() if x is not None})
        elements.append(element)
    return released(scene).model_copy(update={"motors": motors}), tuple(elements)


def _unit(system: System, name: str, motion: RigidMotion) -> list[Float[np.ndarray, "n d"]]:
    """Nodal forces of a load at factor one on all links."""
    model = system.model
    every = zip(model.links, model.loads, model.bodies, strict=True)
    return [unit_forces(link, loads, name, motion, body)[0] for link, loads, body in every]


def _space(
    scene: Scene, linkage: Linkage, model: Model, motion: RigidMotion, found: LinearModel, elements: Sequence[_Element]
) -> StateSpace:
    """The matrices from modes: y = U δ + V δ' + W δ'' of probes, coordinates and rates of force elements."""
    channels = probe_channels(scene, model, linkage)
    read = _Reader(model, motion, channels)
    f, m = found.force, len(found.omega)
    none = np.zeros_like(found.turned)
    U = np.vstack([read("u", found.shapes), found.turned, none])
    V = np.vstack([read("v", found.shapes), none, found.turned])
    W = np.vstack([read("a", found.shapes), none, none])
    rest = np.vstack([read("u", found.answer), found.answered, np.zeros_like(found.answered)])
    square = found.omega**2
    A = np.block([[np.zeros((m, m)), np.eye(m)], [-np.diag(square), -found.damping]])
    moves = [each.moves for each in elements]
    outputs = [(f"{x.channel.name}/{c}", x.channel.unit) for x in channels for c in _columns(x)]
    outputs += [*(x for x, _ in moves), *(x for _, x in moves)]
    inputs = [*((f"loads/{name}", "1") for name in scene.loads), *(each.effort for each in elements)]
    return StateSpace(
        A, np.vstack([np.zeros_like(f), f]), np.hstack([U - W * square, V - W @ found.damping]), W @ f + rest,
        tuple(x for x, _ in inputs), tuple(x for _, x in inputs), tuple(x for x, _ in outputs),
        tuple(x for _, x in outputs), found.omega / (2 * np.pi), float(motion.t[0]), float(motion.phi[0]),
    )  # fmt: skip


def _columns(recorded: Recorded) -> list[str]:
    """Columns of a channel that are linear in small displacements."""
    return [c for c in recorded.channel.columns if c != "von_mises"]


@dataclass(frozen=True, slots=True)
class _Reader:
    """What probes say of small displacements, rates or accelerations about a position that does not move."""

    model: Model
    motion: RigidMotion
    channels: Sequence[Recorded]

    def __call__(self, field: str, shapes: Shapes) -> Matrix:
        """(o, c) of c columns of a field of all links, each (c, n, d)."""
        count = len(shapes[0])
        largest = np.max([np.abs(u).max(axis=(1, 2), initial=0.0) for u in shapes], axis=0)
        size = SMALL * min(link.size for link in self.model.links)
        by = size / np.where(largest > 0, largest, 1.0)
        ahead, back = (self._values(field, [x[:, None, None] * u for u in shapes], count) for x in (by, -by))
        return np.asarray((ahead - back) / (2 * by))

    def _values(self, field: str, moved: Sequence[Float[np.ndarray, "c n d"]], count: int) -> Matrix:
        motion = self.motion.at(np.zeros(count, int))
        links = [
            _history(motion.R[:, body, : link.d, : link.d], field, u)
            for link, body, u in zip(self.model.links, self.model.bodies, moved, strict=True)
        ]
        block = Block(0, motion, links)
        rows = [x.rows(block).reshape(count, -1)[:, : len(_columns(x))] for x in self.channels]
        return np.hstack([np.zeros((count, 0)), *rows]).T


def _history(R: Float[np.ndarray, "c d d"], field: str, x: Float[np.ndarray, "c n d"]) -> LinkHistory:
    """A link with one of u, v, a and nothing else."""
    none = np.zeros_like(x)
    own = LinkHistory(none, none, none, none, R, none, np.zeros((len(x), 0)), np.zeros(len(x)))
    return replace(own, **({"u": x, "g": x @ R} if field == "u" else {field: x}))


def _idle(space: StateSpace) -> tuple[str, ...]:
    """Warnings of inputs that do nothing, as loads on a link that the drive prescribes."""
    size, units = np.abs(space.B).max(axis=0, initial=0.0), np.array(space.input_units)
    least = np.array([NOTHING * size[units == unit].max() for unit in units])
    return tuple(
        f"state space: input {space.inputs[n]} has no effect: the drive or the ground fixes what it acts on"
        for n in np.flatnonzero(size <= least)
    )


def write_state_space(space: StateSpace, path: Path) -> None:
    """Write the matrices with names and units as `.npz` of NumPy or `.mat` of MATLAB, version 5.

    An OutputError says that the file has another ending, or cannot be written.
    """
    write_record(space, path, FORMAT)


def read_state_space(path: Path) -> StateSpace:
    """The linear system of a file that :func:`write_state_space` wrote; OutputError if it is not such a file."""
    return read_record(path, StateSpace, FORMAT, "a state space")
