"""The whole analysis of a scene: from its record to time series, animation, plots and a picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path as FilePath

from kedfem.accuracy.choices import open_step
from kedfem.accuracy.error_budget import Budget, attributes, budget_warning, kind_of_name, meaningless
from kedfem.accuracy.estimates import PeakStrainStates, budget
from kedfem.accuracy.histories import Histories, steady_state
from kedfem.accuracy.mass_damping import mass_damping_warning
from kedfem.accuracy.meshes import stubby_warning
from kedfem.accuracy.plan import Plan, ready_to_step
from kedfem.accuracy.prepared import ALONE, Neighbours, Prepared
from kedfem.accuracy.reduction import Reduction
from kedfem.accuracy.resolution import resolution, resolution_warnings, stability_warning
from kedfem.accuracy.rigid_link_compliance import compliance_warning
from kedfem.accuracy.rounding import IDLE, unstressed
from kedfem.accuracy.singular import SingularPasses
from kedfem.accuracy.sizes import Sizes, size_warnings, sizes
from kedfem.accuracy.steady import Steady, steady_of, steady_warning, unstable
from kedfem.accuracy.step_estimate import StepEstimate
from kedfem.dynamics.loads import coarse_steps
from kedfem.dynamics.stepping.cost import factor_words
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.dynamics.stepping.solvers import eased_warning, unstable_balance, unstable_balance_warning
from kedfem.dynamics.stepping.start import period_map
from kedfem.dynamics.system.period.map import StateArrays
from kedfem.dynamics.system.steps import Steps
from kedfem.dynamics.vibration import Vibration, vibration
from kedfem.links.recovery import stress_recovery
from kedfem.motion.assembly import assembled, assembly_warning
from kedfem.motion.counted_revolutions import require_counted
from kedfem.output.derived import (
    MESH,
    WORST,
    fatigue_warning,
    fields,
    peak_warning,
    refuse_foreign,
    write_derived,
    write_vibration,
)
from kedfem.output.stress_files import Extremes, write_envelope, write_fatigue, write_top
from kedfem.output.vtu import write_cells, write_frame
from kedfem.results import Channel, Fatigue, Peak, Results, add_notes, claimed, read_results
from kedfem.results.additions import add_account, add_fatigue, add_peaks, mark_unreliable
from kedfem.results.audit import Account, balance_warning
from kedfem.results.balance import Balance, balance_notes
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.fatigue.damage import fatigue_of, kept_since, stress_period
from kedfem.results.fatigue.strength import require_fatigue
from kedfem.results.forces.force_elements import element_forces
from kedfem.results.forces.indeterminate import indeterminate_channels, indeterminate_warning
from kedfem.results.on_demand import ChannelSelection
from kedfem.results.recording import recording
from kedfem.results.stresses.envelope import Envelope
from kedfem.results.stresses.peaks import highest, hot_spots, peaks
from kedfem.results.stresses.singular_stress import singular_places
from kedfem.results.table import drive_heading, require_parquet
from kedfem.resume import EVERY, Keeper, remove_state
from kedfem.scene import Scene, refuse_few_rows, without_vibration
from kedfem.stepping import Clock, Watch, Watched, stepped


@dataclass(frozen=True, slots=True)
class Run:
    """The outcome of a run: results, files, highest stress, seconds per stage, warnings for the user, choices made.

    peaks, peak : highest stress over all steps, of each link that has stress, and of all
    worst : the frame of that instant, a VTU file
    balance : of energy, as far as it was kept account of
    budget : estimated errors of mesh, step, reduction and frames, by kind of channel
    sizes : plain sizes of the scene, for a look at its units
    step : what is known of its step's error
    steady : what is known of a steady motion
    begun : the state with which that begins
    """

    folder: FilePath
    results: Results
    peak: Peak | None
    worst: FilePath
    seconds: dict[str, float]
    warnings: tuple[str, ...] = ()
    reduction: Reduction | None = None
    plan: Plan | None = None
    balance: Balance | None = None
    budget: Budget | None = None
    sizes: Sizes | None = None
    step: StepEstimate | None = None
    steady: Steady | None = None
    begun: StateArrays | None = None

    @property
    def peaks(self) -> Mapping[str, Peak]:
        """The highest stress of each link."""
        return self.results.peaks


def analyse(
    scene: Scene,
    watch: Watch = lambda stage, done, total: None,
    resumes: bool = False,
    every: float = EVERY,
    stresses_since: float = -inf,
    beside: Neighbours = ALONE,
) -> Run:
    """Run a scene and write its results.

    Parameters
    ----------
    scene : validated scene
    watch : called with each stage of the run and its progress
    resumes : whether to go on from the last state that an earlier run of the same scene stored
    every : seconds between stored states
    stresses_since : time [s] before which stresses do not count as highest
    beside : what it takes over from runs of scenes that differ little

    Raises
    ------
    KedfemError
        With a message for the user; rows and frames up to there are kept and marked as interrupted.
    """
    if scene.output.parquet:
        require_parquet("output.parquet")
    if scene.output.report:
        from kedfem.report import require_report

        require_report("output.report")
    if scene.fatigue is not None:
        require_fatigue("fatigue")
    with claimed(scene.results_folder) as folder:
        refuse_foreign(folder)
        keeper = Keeper.of(scene, folder, resumes, every)
        run = _analysed(scene, folder, watch, keeper, stresses_since, beside)
        remove_state(folder)
        return _reported(run, watch) if scene.output.report else run


def _reported(run: Run, watch: Watch) -> Run:
    """The run with its page for a browser."""
    from kedfem.report import write_report

    clock = Clock(watch, run.seconds)
    missing = clock.timed("report", lambda: write_report(run.folder)).warnings
    return replace(run, warnings=(*run.warnings, *(f"report: {text}" for text in missing)))


def _analysed(
    scene: Scene, folder: FilePath, watch: Watch, keeper: Keeper, since: float, beside: Neighbours = ALONE
) -> Run:
    """The stages of a run, in a folder of its own; each adds what the user should know to the notices."""
    clock = Clock(watch)
    scene, assembly = assembled(scene)
    period = stress_period(scene)
    asked, chosen = None if scene.analysis.accuracy == "quick" else scene.analysis.accuracy, open_step(scene)
    plan, ready, reduction = ready_to_step(scene, clock.stage, beside.ends)
    scene = ready.scene
    refuse_few_rows(scene)
    plain = sizes(scene, ready.model)
    notices = [*size_warnings(scene, plain), *assembly_warning(assembly), *stubby_warning(ready.model)]
    solvers = clock.timed("factor", lambda: _solvers(ready, beside), factor_words(ready.model))
    account = Account(ready.model, element_forces(scene, ready.model), lambda: solvers[0].stiffening)
    recorded = clock.timed("probes", lambda: recording(scene, ready.model, account, ready.path, ready.linkage))
    every = [*ready.model.links, *(each.link for each in ready.model.prescribed)]
    recoveries = clock.timed("recovery", lambda: [stress_recovery(link) for link in every])
    notices += _about_steps(ready)
    moving = None if without_vibration(scene) else clock.timed("frequencies", lambda: resolution(ready))
    channels = [each.channel for each in recorded]
    indeterminate = indeterminate_channels(scene, ready.model, [each.name for each in channels])
    efforts = CrossChecks(scene, ready.linkage, channels, account)
    watched = Watched(
        recorded, indeterminate, efforts, recoveries, SingularPasses(ready), since, kept_since(scene, period)
    )
    envelope, seen, step = clock.timed("steps", lambda: stepped(ready, solvers, watched, folder, watch, keeper))
    balance = None if without_vibration(scene) else account.balance
    unbalanced = balance_warning(balance) if balance else ()
    notices += [
        *unbalanced,
        *(mass_damping_warning(ready, balance.mass_damping) if balance else ()),
        *efforts.warnings(),
        *indeterminate_warning(indeterminate),
        *watched.passes.warnings(),
        *eased_warning(solvers),
        *unstable_balance_warning(solvers),
        *compliance_warning(seen.compliance, asked),
        *keeper.warnings(),
    ]
    singular = singular_places(scene, ready.model, recoveries)
    add_peaks(folder / "results.h5", peaks(envelope.links(), singular))
    results = read_results(folder / "results.h5")
    errors = step.errors if step.levels > 1 else None
    idle = unstressed(ready.model, peak := highest(results.peaks))
    found = clock.timed(
        "estimates", lambda: Budget(()) if idle else budget(ready, seen, reduction, _in_memory(results, solvers), errors)
    )
    step = replace(step, errors=found.step or step.errors)
    steady, grows = _growing(ready, solvers)
    notices += [
        *resolution_warnings(moving, found.error_of("step")),
        *([IDLE] if idle else budget_warning(found, asked, chosen and plan is not None)),
        *(write_vibration(scene, ready.model, recoveries, grows, folder) if grows else ()),
        *steady_warning(steady),
    ]
    notes = {
        **attributes(found), **step.notes,
        **(balance_notes(balance) if balance else {}), **(steady.notes if steady else {}),
    }  # fmt: skip
    add_notes(folder / "results.h5", notes)
    results = replace(results, notes={**results.notes, **notes})
    why = meaningless(found, balance, efforts.unworked)
    if why := unstable(steady) or unstable_balance(solvers) or why:
        mark_unreliable(folder / "results.h5", why)
        results = replace(results, status="unreliable", reason=why)
    if period:
        damaged = clock.timed("fatigue", lambda: _damaged(ready, folder, envelope, singular, period))
        results = replace(results, fatigue=damaged)
    notices += [*peak_warning(peak, since), *fatigue_warning(results.fatigue)]
    _stress_files(ready, folder, results.drive, envelope, singular)
    notices += clock.timed("pictures", lambda: write_derived(scene, results, peak, folder))
    _mesh_field(seen.strained, folder / MESH)
    add_account(folder / "results.h5", notices, clock.seconds)
    results = replace(results, warnings=tuple(notices), seconds=dict(clock.seconds))
    return Run(folder, results, peak, folder / WORST, clock.seconds, tuple(notices), reduction, plan,
               balance, found, plain, step, steady, steady_state(solvers))  # fmt: skip


def _solvers(ready: Prepared, beside: Neighbours) -> list[Steps]:
    """Those of all levels in time; the search for a steady motion starts from that of a neighbour."""
    solvers = level_steps(ready.scene, ready.model)
    for each in solvers:
        each.search = replace(each.search, near=beside.near)
    return solvers


def _growing(ready: Prepared, solvers: Sequence[Steps]) -> tuple[Steady | None, Vibration | None]:
    """What is known of a steady motion, and of one that is unstable the vibration that grows."""
    steady, solver = steady_of(ready.scene, solvers), solvers[-1]
    if steady is None or not steady.unstable or solver.steady is None:
        return steady, None
    over = period_map(ready.scene, ready.linkage, ready.path, ready.model, solver, solver.steady.state)
    found = vibration(over, solver, solver.steady)
    steady = steady.reported(found.frequency, found.words, solver.ready.c.h)
    return steady, found if steady.unstable else None


def _about_steps(ready: Prepared) -> list[str]:
    """Warnings of steps that are too long for what turns and for what loads do; refused if turns cannot be counted."""
    require_counted(ready.scene, ready.linkage, ready.path)
    if without_vibration(ready.scene):
        return []
    return [*stability_warning(ready.scene), *coarse_steps(ready.scene)]


def _stress_files(
    ready: Prepared, folder: FilePath, drive: Channel, envelope: Envelope, singular: list[list[str]]
) -> None:
    """The envelope of stresses, the top ten of each link, and the frame of the highest of all."""
    scene, named = ready.scene, drive_heading(drive)
    extremes = Extremes(envelope.links(), singular, named)
    write_envelope(folder, extremes, scene.output.csv)
    write_top(folder, hot_spots(extremes.found, singular), named)
    if (worst := envelope.worst) is not None:
        write_frame(folder / WORST, worst.t, fields(scene, ready.model, envelope.recoveries, worst))


def _damaged(ready: Prepared, folder: FilePath, envelope: Envelope, singular: list[list[str]], period: float) -> Fatigue:
    """Damage over the last period, in its files and in that of the results."""
    found, fields = fatigue_of(ready.scene, ready.model, envelope, singular, period)
    write_fatigue(folder, found, fields, ready.scene.output.csv)
    add_fatigue(folder / "results.h5", found)
    return found


def _mesh_field(strained: PeakStrainStates, file: FilePath) -> None:
    """The mesh's indicator in each element of solid and plane links, for ParaView."""
    parts = [
        ((link.full or link), each.elements)
        for link, each in ((strained.model.links[k], each) for k, each in strained.indicators.items())
    ]
    if parts:
        cells = [(link.X, (link.cell_type, link.cells)) for link, _ in parts]
        write_cells(file, cells, "mesh_error", [values for _, values in parts])


def _in_memory(results: Results, solvers: Sequence[Steps]) -> Histories:
    """The channels of a run as its errors are judged; none where not all time points are rows."""
    if results.every > 1:
        return Histories(results.time[:0], {}, begun=steady_state(solvers))
    names = tuple(name for name in results.channels if kind_of_name(name) is not None)
    return Histories(results.time, ChannelSelection(results.channels, names), begun=steady_state(solvers))
