"""Summary tables of a check and of a run, for the terminal."""

from collections.abc import Sequence

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.plan import Plan
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.reduction import Reduction
from kedfem.accuracy.resolution import Resolution, resolution
from kedfem.accuracy.study import Measured, Study
from kedfem.analysis import Run, frame_steps
from kedfem.dynamics.actions import actions
from kedfem.dynamics.cost import Cost, estimated_cost
from kedfem.dynamics.model import Model, segments
from kedfem.links.record import Link
from kedfem.mesh import HexMesh, QuadMesh, mesh_quality
from kedfem.motion.initial import initial_twists
from kedfem.motion.path import Path
from kedfem.results.audit import Balance
from kedfem.scene import LineSpring, LinkScene, Motor, Scene, Spring, time_grid

NOTHING = 1e-9  # of the largest value of the same unit: rounding errors
ELEMENTS = {
    "hexahedron27": "hex27",
    "hexahedron20": "hex20",
    "hexahedron": "hex8",
    "quad9": "quad9",
    "line3": "beam3",
    "line": "beam2",
    **{f"line{nodes}": f"beam{nodes}" for nodes in (4, 5, 7, 9)},
}
STUDY_COLUMNS = ("fidelity", "mesh", "steps", "red.", "size", "prep.", "step", "whole", "error")  # fmt: skip
UNITS = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def with_prefix(value: float, unit: str) -> str:
    """A number with an SI prefix: 1.23e7, Pa → 12.3 MPa.

    >>> with_prefix(1.234e7, "Pa")
    '12.34 MPa'
    """
    size = abs(value)
    factor, prefix = next(((f, p) for f, p in UNITS if size >= f), (1.0, ""))
    return f"{value / factor:.4g} {prefix}{unit}"


def run_tables(scene: Scene, done: Run) -> list[Table]:
    """Largest values of every channel, the highest stress of the frames, and the seconds spent."""
    before = [] if done.plan is None else plan_tables(done.plan)
    table = Table(title=Text(scene.title or "Largest values"))
    when = "time" if scene.driven is None else "drive angle"
    for column in ("channel", "component", "largest", when):
        left = column in ("channel", "component")
        table.add_column(column, justify="left" if left else "right", overflow="fold", no_wrap=not left)
    channels = done.results.channels.values()
    highest: dict[str, float] = {}
    for channel, values in channels:
        highest[channel.unit] = max(highest.get(channel.unit, 0.0), float(np.abs(values).max()))
    for channel, values in channels:
        k, c = np.unravel_index(np.abs(values).argmax(), values.shape)
        value = float(values[k, c])
        if abs(value) <= NOTHING * highest[channel.unit]:
            table.add_row(channel.name, "", "≈ 0", "")
            continue
        at = moment(scene, float(done.results.time[k]), float(done.results.angle[k]))
        table.add_row(channel.name, channel.columns[c], with_prefix(value, channel.unit), at)
    if done.peak:
        p = done.peak
        at = moment(scene, p.time, p.angle)
        table.add_row(f"links/{p.link}", "von_mises", with_prefix(p.stress, "Pa"), at)
        table.caption = "links: the highest stress of all animation frames"
    balance = [] if done.balance is None else [balance_table(done.balance, done.geometric)]
    spent = Table(title=f"{len(done.results.time) - 1} steps; seconds", show_header=False)
    for stage, seconds in done.seconds.items():
        spent.add_row(stage, f"{seconds:.2f}")
    return [*before, table, *balance, spent]


def balance_table(found: Balance, geometric: float | None) -> Table:
    """What the steps leave over of energy and momentum, and how far the linear equation is off because links bend.

    Parameters
    ----------
    geometric : estimated error of the peak stress; None where frames follow, which do not err so
    """
    table = Table(title="Balance" if geometric is None else "Balance and geometric error", show_header=False)
    for what, share in (
        ("energy, left over by the steps", found.energy),
        ("momentum", found.linear),
        ("angular momentum", found.angular),
    ):
        table.add_row(what, f"{100 * share:.2g} % of the largest exchanged")
    if geometric is not None:
        table.add_row(
            "energy made by nominal frames", f"{100 * found.neglected:.3g} % of the largest exchanged"
        )
        table.add_row("geometric error, estimated", f"{_percent(geometric)} of the peak stress")
    return table


def moment(scene: Scene, time: float, angle: float) -> str:
    """A drive angle [rad] in degrees; without a drive the time [s]."""
    return with_prefix(time, "s") if scene.driven is None else f"{np.degrees(angle):.1f}°"


def check_tables(ready: Prepared, reduction: Reduction | None, plan: Plan | None) -> list[Table]:
    """What would be modelled: the plan for an accuracy, links, what reducing them costs, motion, frequency, cost."""
    first = [] if plan is None else plan_tables(plan)
    second = [] if reduction is None else [reduction_table(reduction)]
    cost = _cost(ready, estimated_cost(ready.scene, ready.model))
    found = resolution(ready)
    third = [] if found is None else [resolution_table(found)]
    return [*first, _links(ready.model), *second, _motion(ready), *_actions(ready), *third, cost]


def plan_tables(plan: Plan) -> list[Table]:
    """Where the error of a run with `analysis.accuracy` comes from, what was chosen, and what was not."""
    budget = Table(title=f"Accuracy asked for: {100 * plan.asked:.3g} %")
    for column in ("part of the error", "expected", "allowed"):
        budget.add_column(column, justify="left" if column.startswith("part") else "right")
    for share in plan.shares:
        budget.add_row(share.what, f"{100 * share.error:.2g} %", f"{100 * share.allowed:.2g} %")
    budget.add_row("together", f"{100 * plan.error:.2g} %", f"{100 * plan.asked:.2g} %")
    chosen = Table(title="Chosen", show_header=False)
    chosen.add_row("step", f"{time_grid(plan.scene).step:.4g} s, {time_grid(plan.scene).steps} steps")
    for name, link in plan.scene.links.items():
        chosen.add_row(name, _chosen(link))
    for note in plan.notes:
        chosen.add_row("note", Text(note))
    return [budget, chosen]


def _chosen(link: LinkScene) -> str:
    """Fidelity and mesh in words."""
    mesh = ", ".join(f"{key} {value}" for key, value in link.mesh if value is not None) if link.shape else ""
    segments = "" if link.segments is None else f", {link.segments} segments"
    return f"{'reduced ' if link.reduced else ''}{link.fidelity}" + (f" ({mesh})" if mesh else "") + segments


def reduction_table(reduction: Reduction) -> Table:
    """Estimated error of reduced links, channel by channel."""
    table = Table(title="Error of the reduction (estimated)")
    table.add_column("channel", overflow="fold")
    table.add_column("of its peak", justify="right")
    for name, error in reduction.estimate.items():
        table.add_row(name, f"{100 * error:.2g} %")
    table.caption = f"asked for: {100 * reduction.tolerance:.2g} %; against the same links in full"
    return table


def resolution_table(found: Resolution) -> Table:
    """First frequency of the linkage against step and drive."""
    table = Table(title="First frequency (drive held, of what the loads excite)", show_header=False)
    low, high = found.first.min(), found.first.max()
    table.add_row(
        "over the last turn", f"{low:.4g} Hz" if high < 1.001 * low else f"{low:.4g} to {high:.4g} Hz"
    )
    table.add_row("steps in a period", f"{found.steps_per_period:.3g} at least")
    for each in found.meetings:
        angle = np.degrees(each.angle) % 360
        table.add_row(f"met by harmonic {each.harmonic}", f"{each.frequency:.4g} Hz, near {angle:.0f}°")
    return table


def _links(model: Model) -> Table:
    table = Table(title="Links")
    for column in ("link", "kind", "elements", "unknowns", "mass", "quality"):
        table.add_column(column, justify="left" if column in ("link", "kind") else "right", overflow="fold")
    for name, parts in segments(model).items():
        elements, unknowns = (
            str(sum(each)) for each in ([len(x.cells) for x in parts], [x.unknowns for x in parts])
        )
        table.add_row(name, _kind(parts), elements, unknowns, _mass(*parts), _quality(*parts))
    for carried in model.carried:
        table.add_row(carried.link.name, "rigid, with the drive", "-", "0", _mass(carried.link), "-")
    for slider in model.sliders:
        table.add_row(
            slider.name,
            "rigid slider",
            "-",
            "1",
            f"{slider.mass:.4g} kg, on {model.links[slider.carrier].name}",
            "-",
        )
    joined = f"{model.unknowns} unknowns in all, {model.coordinates} generalised coordinates once joined"
    table.caption = f"{joined}; mass: with what is attached; quality: worst scaled Jacobian"
    return table


def _kind(parts: Sequence[Link]) -> str:
    """Its elements, and what was made of them."""
    first, functions = parts[0], [link.n for link in parts]
    kind = "rigid" if first.rigid else ELEMENTS[first.cell_type]
    if first.fit is not None and not first.rigid:
        kind += f", {len(parts)} segments that follow" if len(parts) > 1 else ", 1 segment that follows"
    elif first.fit is not None:
        kind += ", following"
    if first.full and not first.rigid:
        low, high = min(functions), max(functions)
        kind += f", {low} functions" if low == high else f", {low} to {high} functions"
        kind += " each" if len(parts) > 1 else ""
    return kind


def _mass(*parts: Link) -> str:
    return f"{sum(float(link.one @ link.m1[:, 0]) for link in parts):.4g} kg"


def _quality(*parts: Link) -> str:
    """The worst scaled Jacobian of a meshed link."""
    full = [link.full or link for link in parts]
    if not full[0].meshed:
        return "-"
    meshes = [
        QuadMesh(link.X, link.cells, link.thickness) if link.kind == "plane" else HexMesh(link.X, link.cells)
        for link in full
    ]
    return f"{min(mesh_quality(mesh).least for mesh in meshes):.2f}"


def _motion(ready: Prepared) -> Table:
    along: Path = ready.path
    table = Table(title="Rigid motion", show_header=False)
    weakness, angle = along.weakest
    low, high = np.degrees(along.phi[[0, -1]])
    over = "repeats every turn" if along.periodic else f"{low:.4g}° to {high:.4g}°"
    driven = ready.scene.driven is not None
    table.add_row(
        "drive", f"joint {ready.scene.driven}, {over}" if driven else "none: the mechanism moves by itself"
    )
    if ready.linkage.mobility or not driven:
        table.add_row("free motions", str(ready.linkage.mobility))
    if driven:
        table.add_row(
            "closest to a dead point",
            f"at {np.degrees(angle):.4g}° (smallest singular value {weakness:.2g} of the largest)",
        )
    if ready.linkage.redundant:
        table.add_row("redundant joint equations", "at joints " + ", ".join(ready.linkage.redundant))
    for where, speed in _initial_speeds(ready):
        table.add_row(where, speed)
    if not driven:
        return table
    for k, name in enumerate(ready.linkage.bodies[1:], start=1):
        turned = np.degrees(
            np.arccos(np.clip((np.trace(along.R[:, k], axis1=1, axis2=2) - 1) / 2, -1, 1))
        ).max()
        table.add_row(f"link {name}", f"turns up to {turned:.4g}° from the drawn position")
    return table


def _actions(ready: Prepared) -> list[Table]:
    """Motors and springs: where they act and by which law."""
    actions(ready.scene, ready.model)  # refused where they do not fit
    table = Table(title="Motors and springs", show_header=False)
    for name, motor in ready.scene.motors.items():
        table.add_row(name, f"motor on joint {motor.joint}", _motor_law(motor))
    for name, spring in ready.scene.springs.items():
        table.add_row(name, *_spring_law(spring))
    return [table] if table.row_count else []


def _motor_law(motor: Motor) -> str:
    """A motor's curve in words."""
    unit, value = "N m" if motor.torque else "N", motor.curve.value
    low, high = (with_prefix(x, unit) for x in (min(value), max(value)))
    return low if len(value) == 1 else f"{low} to {high} over {motor.curve.over}"


def _spring_law(spring: Spring) -> tuple[str, str]:
    """Where a spring is, and its constants."""
    if isinstance(spring, LineSpring):
        on, units = f"spring between {' and '.join(end.link for end in spring.between)}", ("N/m", "N s/m")
    else:
        on, units = f"spring about joint {spring.joint}", ("N m/rad", "N m s/rad")
    constants = zip((spring.stiffness, spring.damping), units, strict=True)
    return on, ", ".join(with_prefix(value, unit) for value, unit in constants if value)


def _initial_speeds(ready: Prepared) -> list[tuple[str, str]]:
    """How fast each link starts, in words, where the scene asks for speeds."""
    analysis = ready.scene.analysis
    if not (analysis.initial_speeds or analysis.initial_motions):
        return []
    v, omega = (np.linalg.norm(x, axis=1) for x in initial_twists(ready.scene, ready.linkage))
    speeds = [
        f"{w:.4g} rad/s" if w > NOTHING * omega.max() else f"{s:.4g} m/s"
        for s, w in zip(v, omega, strict=True)
    ]
    return [(f"link {x} starts with", y) for x, y in zip(ready.linkage.bodies[1:], speeds[1:], strict=True)]


def _cost(ready: Prepared, cost: Cost) -> Table:
    grid = time_grid(ready.scene)
    table = Table(title="Cost (estimated)", show_header=False)
    table.add_row("steps", f"{grid.steps} of {grid.step:.4g} s")
    table.add_row("solver", ready.scene.analysis.solver)
    table.add_row("time (condensed)", f"factor {cost.factor:.2g} s, steps {cost.steps:.2g} s")
    table.add_row("memory", with_prefix(cost.memory, "B"))
    table.add_row(
        "animation frames",
        f"{len(frame_steps(ready.scene))}, about {with_prefix(cost.frame_bytes, 'B')} each",
    )
    return table


def study_tables(study: Study, machine: str) -> list[Table]:
    """Variants by time with their errors, and what the reference's own error is made of."""
    table = Table(title=Text(f"Speed against error: {study.title}"))
    for column in STUDY_COLUMNS:
        left = column == "fidelity"
        table.add_column(
            column,
            justify="left" if left else "right",
            overflow="fold",
            no_wrap=not left,
            min_width=11 if left else None,
        )
    ran = [row for row in study.rows if row.seconds]
    for row in sorted(ran, key=lambda row: row.seconds.whole if row.seconds else 0.0):
        table.add_row(*_study_row(row, study), style="bold" if row.front else None)
    shares = ", ".join(f"{name} {_percent(share)}" for name, share in study.shares.items())
    unknown = "" if "mesh" in study.shares else "; its mesh could not be compared with a coarser one"
    table.caption = Text(
        f"bold: no other is both faster and nearer. mesh, steps: times as fine as the scene's. Errors are against "
        f"{study.reference.variant.name}, whose own is about {_percent(study.floor)} ({shares or 'not known'}{unknown}): "
        f"≤ is below that. red.: error that the reduction may cause; size: unknowns; preparation, steps, whole run: "
        f"seconds, medians; worst channels: see the CSV. {machine}"
    )
    return [table, _not_run(study)] if len(ran) < len(study.rows) else [table]


def _study_row(row: Measured, study: Study) -> tuple[str, ...]:
    if row.seconds is None:
        raise ValueError(f"{row.variant.name} was not run")
    v, s = row.variant, row.seconds
    model = (
        v.fidelity.name,
        f"{v.fineness:g}",
        f"{v.steps}",
        f"{v.tolerance:.0e}".replace("e-0", "e-") if v.tolerance else "-",
    )
    times = (f"{s.preparation:.2g}", f"{s.stepping:.2g}", f"{s.whole:.2g}")
    below = row.error <= study.floor
    found = f"≤ {_percent(study.floor)}" if below else _percent(row.error)
    return (*model, str(row.unknowns), *times, "reference" if v == study.reference.variant else found)


def _not_run(study: Study) -> Table:
    """Variants that were not run, by reason."""
    table = Table(title="Not run", show_header=False)
    for row in study.rows:
        if row.seconds is None:
            table.add_row(row.variant.name, Text(row.note))
    return table


def _percent(x: float) -> str:
    return f"{100 * x:.2g} %"
