"""Tables of `kedfem check`: the model, its motion, and the cost of a run."""

from dataclasses import replace
from pathlib import Path as FilePath
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np
from rich.table import Table

from kedfem.accuracy.plan import Plan
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import Reduction
from kedfem.accuracy.resolution import Resolution, resolution
from kedfem.accuracy.singular import SingularPasses
from kedfem.arrays import Float
from kedfem.dynamics.force_elements import force_elements
from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.joints.constraint_ports import element_joint
from kedfem.dynamics.rigid_elements import links_of
from kedfem.dynamics.stepping.cost import Cost, estimated_cost, tried_cost
from kedfem.dynamics.stepping.start import motion_of
from kedfem.dynamics.system.steps import Steps
from kedfem.errors import KedfemError
from kedfem.links.recovery import StressRecovery, stress_recovery
from kedfem.motion.initial import initial_twists
from kedfem.motion.messages import position_in_words
from kedfem.motion.mobility import mobility
from kedfem.motion.path import Path
from kedfem.motion.released_motions import joints_in_words
from kedfem.output.derived import fields
from kedfem.output.vtu import write_frame
from kedfem.output.words import NOTHING, with_prefix
from kedfem.results.audit import Account
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.forces.force_elements import element_forces
from kedfem.results.recording import recording
from kedfem.scene import Curve, Limit, LineSpring, Scene, Spring, is_constant, time_grid
from kedfem.scene.questions.timing import revolution_steps, without_vibration
from kedfem.stepping import Watched, frame_steps, stepped
from kedfem.tables.layout import facts
from kedfem.tables.model import link_tables, mobility_table
from kedfem.tables.run import plan_tables, reduction_table

PARALLEL = 1e-6  # of the largest rotation: smaller ones about other axes are rounding
STILL = 1e-9  # rad, and of the linkage's size: smaller motions are rounding
NEARLY = 0.01  # deg: rounding of a full revolution


def check_tables(
    ready: Prepared, reduction: Reduction | None, plan: Plan | None,
    tried: tuple[Cost, KedfemError | None] | None = None,
) -> list[Table]:  # fmt: skip
    """The model of a scene: plan for its accuracy, links, error of their reduction, motion, mobility, frequency, cost.

    Parameters
    ----------
    tried : result of `forecast`, if known
    """
    (cost, failed), found = tried or forecast(ready), resolution(ready)
    moving = mobility(ready.scene, ready.linkage, ready.path)
    return [
        *(plan_tables(plan) if plan else []),
        *link_tables(ready.model),
        *([reduction_table(reduction)] if reduction else []),
        _motion(ready),
        mobility_table(ready.scene, ready.linkage, moving, works=failed is None),
        _force_elements(ready),
        *([resolution_table(found, ready.scene)] if found else []),
        _cost(ready, cost),
    ]


def forecast(ready: Prepared) -> tuple[Cost, KedfemError | None]:
    """Cost of a run, from a few of its steps and one frame of the animation.

    If these steps fail, as those of the run would, the cost follows from sizes alone, and the error is returned too.
    """
    scene, model = ready.scene, ready.model
    every = [*model.links, *(prescribed.link for prescribed in model.prescribed)]
    recoveries = [stress_recovery(link) for link in every]
    seen: list[Snapshot] = []

    def run(begun: Scene, solvers: list[Steps]) -> None:
        still = begun.model_copy(update={"output": begun.output.model_copy(update={"animation": None})})
        account = Account(model, element_forces(still, model))
        recorded = recording(still, model, account, ready.path, ready.linkage)
        efforts = CrossChecks(still, ready.linkage, [each.channel for each in recorded], account)
        watched = Watched(recorded, {}, efforts, recoveries, SingularPasses(ready))
        with TemporaryDirectory() as folder:
            arguments = replace(ready, scene=still), solvers, watched, FilePath(folder)
            worst = stepped(*arguments, lambda stage, done, total: None)[0].worst
        seen.extend([worst] if worst else [])

    try:
        cost = tried_cost(scene, model, run)
    except KedfemError as error:
        return estimated_cost(scene, model), error
    frames = len(frame_steps(scene)) if seen else 0
    return replace(
        cost, steps=cost.steps + frames * seconds_of_frame(ready, recoveries, seen[-1])
    ) if frames else cost, None


def seconds_of_frame(ready: Prepared, recoveries: list[StressRecovery], now: Snapshot) -> float:
    """Seconds that a frame of the animation takes."""
    with TemporaryDirectory() as folder:
        for k in range(2):  # the first time prepares
            since = perf_counter()
            drawn = fields(ready.scene, ready.model, recoveries, now)
            write_frame(FilePath(folder) / f"{k}.vtu", now.t, drawn)
    return perf_counter() - since


def resolution_table(found: Resolution, scene: Scene) -> Table:
    """First frequency of the linkage, with steps in its period and resonances with the drive."""
    span = "over the last revolution" if revolution_steps(scene) else "over the analysis"
    low, high = found.first.min(), found.first.max()
    return facts("First frequency (drive fixed, of what the loads excite)", [
        (span, f"{low:.4g} Hz" if high < 1.001 * low else f"{low:.4g} to {high:.4g} Hz"),
        *([] if without_vibration(scene) else [("steps in a period", f"{found.steps_per_period:.3g} at least")]),
        *((f"met by harmonic {each.harmonic}", f"{each.frequency:.4g} Hz, near {np.degrees(each.angle) % 360:.0f}°")
          for each in found.resonances),
    ])  # fmt: skip


def _motion(ready: Prepared) -> Table:
    along: Path = ready.path
    names = tuple(ready.scene.driven_joints)
    drive = f"{joints_in_words(names)}, {_over(ready)}" if names else "none: the mechanism moves by itself"
    table = facts("Rigid motion", [("drive", drive), *_initial_speeds(ready)])
    for k, name in enumerate(ready.linkage.bodies[1:] if names else (), start=1):
        words = motion_in_words(along.R[:, k], along.p[:, k], ready.linkage.size)
        table.add_row(f"link {name}", words)
    if names and ready.linkage.mobility:
        table.caption = "by the drives alone: free motions are held in the reference position here"
    return table


def motion_in_words(R: Float[np.ndarray, "T 3 3"], p: Float[np.ndarray, "T 3"], size: float) -> str:
    """Range of a link's rotation, or of its translation if it does not rotate, in words.

    Parameters
    ----------
    R, p : its poses; p is the displacement of a link that does not rotate [m]
    size : of the linkage [m]
    """
    if np.abs(R - np.eye(3)).max() > STILL:
        return rotation_in_words(R)
    slid = float(np.linalg.norm(p, axis=1).max())
    if slid <= STILL * size:
        return "does not move"
    return f"slides up to {with_prefix(slid, 'm')} from the reference position"


def rotation_in_words(R: Float[np.ndarray, "T 3 3"]) -> str:
    """Range of a link's rotation on its path, in words; about a single axis the angle is unwrapped."""
    from scipy.spatial.transform import Rotation

    start = Rotation.from_matrix(R[0]).as_rotvec()
    steps = Rotation.from_matrix(R[1:] @ R[:-1].transpose(0, 2, 1)).as_rotvec()
    sizes, axes = np.linalg.svd(np.vstack([start, steps]), full_matrices=False)[1:]
    if sizes[1] > PARALLEL * sizes[0]:
        cosine = (np.trace(R, axis1=1, axis2=2) - 1) / 2
        turned = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).max())
    else:
        angles = np.degrees(np.cumsum(np.vstack([start, steps]) @ axes[0]))
        if (whole := (np.ptp(angles) + NEARLY) // 360) >= 1:
            return "rotates a full revolution" if whole == 1 else f"rotates {whole:.0f} full revolutions"
        turned = float(np.abs(angles).max())
    return f"rotates up to {turned:.4g}° from the reference position"


def _over(ready: Prepared) -> str:
    """The range of the drives in words."""
    link, along = ready.linkage, ready.path
    if not along.periodic:
        return " to ".join(position_in_words(link, float(tau), ".4g") for tau in along.phi[[0, -1]])
    revolutions = along.period / (2 * np.pi)
    if len(link.drives) > 1:
        return f"repeats every {with_prefix(along.period, 's')}"
    return "repeats every revolution" if round(revolutions) == 1 else f"repeats every {revolutions:.4g} revolutions"


def _force_elements(ready: Prepared) -> Table:
    """Motors, springs and limits: their joints and laws."""
    scene, parts = ready.scene, links_of(ready.model, ready.linkage.bodies)
    for name, element in force_elements(scene):  # refused where they do not fit
        element_joint(scene, name, element, *parts)
    return facts("Motors, springs and limits" if scene.limits else "Motors and springs", [
        *((name, f"motor on joint {each.joint}", _curve_words(each.curve, "N m" if each.torque else "N"))
          for name, each in scene.motors.items()),
        *((name, *_spring_law(each)) for name, each in scene.springs.items()),
        *((name, f"limit of the {each.kind} of joint {each.joint}", _limit_law(each))
          for name, each in scene.limits.items()),
    ])  # fmt: skip


def _limit_law(limit: Limit) -> str:
    """Positions of stops, and their constants."""
    unit, force, rate = ("rad", "N m/rad", "N m s/rad") if limit.kind == "angle" else ("m", "N/m", "N s/m")
    ends = " and ".join(with_prefix(x, unit) for x in (limit.lower, limit.upper) if x is not None)
    constants = zip((limit.stiffness, limit.damping), (force, rate), strict=True)
    return f"at {ends}: " + ", ".join(with_prefix(value, each) for value, each in constants if value)


def _curve_words(curve: Curve, unit: str) -> str:
    low, high = (with_prefix(x, unit) for x in (min(curve.value), max(curve.value)))
    return low if len(curve.value) == 1 else f"{low} to {high} over {curve.over}"


def _spring_law(spring: Spring) -> tuple[str, str]:
    """Joint or ends of a spring, and its constants."""
    if isinstance(spring, LineSpring):
        ends = " and ".join(end.link for end in spring.between or ())
        on = f"spring between {ends}" if ends else f"spring along joint {spring.joint}"
        units = "N/m", "N s/m"
    else:
        on, units = f"spring about joint {spring.joint}", ("N m/rad", "N m s/rad")
    factor = spring.stiffness_factor
    stiffness = spring.stiffness * (factor.value[0] if is_constant(factor) else 1.0)
    constants = zip((stiffness, spring.damping), units, strict=True)
    given = [with_prefix(value, unit) for value, unit in constants if value]
    if not is_constant(factor):
        given[0] += f" times {min(factor.value):.4g} to {max(factor.value):.4g} over {factor.over}"
    if spring.curve is not None:
        given.append(_curve_words(spring.curve, units[0].partition("/")[0]))
    return on, ", ".join(given)


def _initial_speeds(ready: Prepared) -> list[tuple[str, str]]:
    """Initial speed of each link, in words, if the scene requests initial speeds."""
    analysis = ready.scene.analysis
    if not (analysis.initial_speeds or analysis.initial_motions):
        return []
    scene, linkage, along = ready.scene, ready.linkage, ready.path
    begins, added = motion_of(scene, linkage, along)(np.zeros(1)), initial_twists(scene, linkage, along)
    v, omega = (np.linalg.norm(x + y[0], axis=1) for x, y in zip(added, (begins.v, begins.omega), strict=True))
    turns = omega > NOTHING * omega.max()
    every = zip(v, omega, turns, strict=True)
    speeds = [f"{w:.4g} rad/s" if turning else f"{s:.4g} m/s" for s, w, turning in every]
    return [(f"link {x} starts with", y) for x, y in zip(ready.linkage.bodies[1:], speeds[1:], strict=True)]


def _cost(ready: Prepared, cost: Cost) -> Table:
    grid, frames = time_grid(ready.scene), len(frame_steps(ready.scene))
    how = f"{cost.tried} steps tried" if cost.tried else "from the sizes alone"
    return facts("Cost (estimated)", [
        ("steps", f"{grid.steps} of {grid.step:.4g} s"),
        ("solver", ready.scene.analysis.solver),
        ("time", f"factor {cost.factor:.2g} s, steps {cost.steps:.2g} s; {how}"),
        ("memory", with_prefix(cost.memory, "B")),
        ("animation frames", f"{frames}, about {with_prefix(cost.frame_bytes, 'B')} each"),
    ])  # fmt: skip
