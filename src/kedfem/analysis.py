"""The whole analysis of a scene: from its record to time series, animation, plots and a picture."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from pathlib import Path as FilePath

from kedfem.accuracy.choices import open_step
from kedfem.accuracy.damping import mass_damping_warning
from kedfem.accuracy.error_budget import Budget, attributes, budget_warning, meaningless
from kedfem.accuracy.estimates import budget
from kedfem.accuracy.histories import run_histories, steady_state
from kedfem.accuracy.meshes import stubby_warning
from kedfem.accuracy.plan import Plan, ready_to_step
from kedfem.accuracy.prepared import ALONE, Neighbours, Prepared
from kedfem.accuracy.reduction import Reduction
from kedfem.accuracy.resolution import Resolution, resolution, resolution_warnings, stability_warning
from kedfem.accuracy.rigid_link_compliance import compliance_warning
from kedfem.accuracy.rounding import IDLE, unstressed
from kedfem.accuracy.singular import SingularPasses
from kedfem.accuracy.sizes import Sizes, size_warnings, sizes
from kedfem.accuracy.steady import Steady, growing, steady_warning, unstable
from kedfem.accuracy.step_estimate import StepEstimate
from kedfem.dynamics.loads import coarse_steps
from kedfem.dynamics.stepping.cost import factor_words
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.dynamics.stepping.solvers import eased_warning, unstable_balance, unstable_balance_warning
from kedfem.dynamics.system.period.map import StateArrays
from kedfem.dynamics.system.steps import Steps
from kedfem.links.recovery import stress_recovery
from kedfem.motion.assembly import assembled, assembly_warning
from kedfem.motion.counted_revolutions import require_counted
from kedfem.output.derived import (
    WORST,
    fatigue_warning,
    peak_warning,
    refuse_foreign,
    write_damage,
    write_derived,
    write_mesh_errors,
    write_stresses,
    write_vibration,
    yield_warning,
)
from kedfem.results import Peak, Results, add_notes, claimed, read_results
from kedfem.results.additions import add_account, add_peaks, mark_unreliable
from kedfem.results.audit import Account, balance_warning
from kedfem.results.balance import Balance, balance_notes
from kedfem.results.cross_checks import CrossChecks
from kedfem.results.fatigue.damage import kept_since, stress_period
from kedfem.results.fatigue.strength import require_fatigue
from kedfem.results.forces.force_elements import element_forces
from kedfem.results.forces.indeterminate import indeterminate_channels, indeterminate_warning
from kedfem.results.recording import recording
from kedfem.results.stresses.peaks import highest, peaks
from kedfem.results.stresses.singular_stress import singular_places
from kedfem.results.table import drive_heading, require_parquet
from kedfem.resume import EVERY, Keeper, remove_state
from kedfem.scene import Scene, refuse_few_rows, without_vibration, yield_strengths
from kedfem.stepping import Clock, Marched, Watch, Watched, stepped


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
    _require_packages(scene)
    with claimed(scene.results_folder) as folder:
        refuse_foreign(folder)
        keeper, clock = Keeper.of(scene, folder, resumes, every), Clock(watch)
        begun = _begun(scene, clock, beside, stresses_since)
        marched = clock.timed("steps", lambda: stepped(begun.ready, begun.solvers, begun.watched, folder, watch, keeper))
        judged = _judged(begun, marched, keeper, folder, clock)
        run = _completed(begun, judged, marched, folder, clock)
        remove_state(folder)
        return _reported(run, watch) if scene.output.report else run


def _require_packages(scene: Scene) -> None:
    """OutputError unless the packages are there that the scene's files need."""
    if scene.output.parquet:
        require_parquet()
    if scene.output.report:
        from kedfem.report import require_report

        require_report("output.report")
    if scene.fatigue is not None:
        require_fatigue()


@dataclass(frozen=True, slots=True)
class _Begun:
    """A run before its first step.

    asked : accuracy that the scene asks for, if any
    chosen : whether its step is that of a plan
    period : time after which stresses repeat, where damage is asked for, else 0 [s]
    resolved : how its steps resolve vibration; None of an analysis without any
    notices : what the user should know
    """

    plan: Plan | None
    ready: Prepared
    reduction: Reduction | None
    solvers: list[Steps]
    account: Account
    watched: Watched
    sizes: Sizes
    asked: float | None
    chosen: bool
    period: float
    resolved: Resolution | None
    notices: tuple[str, ...]


def _begun(scene: Scene, clock: Clock, beside: Neighbours, since: float) -> _Begun:
    """Meshes, matrices and choices of a scene, its factors, and what is evaluated at each step."""
    scene, assembly = assembled(scene)
    accuracy, period, chosen = scene.analysis.accuracy, stress_period(scene), open_step(scene)
    plan, ready, reduction = ready_to_step(scene, clock.stage, beside.ends)
    scene, model = ready.scene, ready.model
    refuse_few_rows(scene)
    plain = sizes(scene, model)
    solvers = clock.timed("factor", lambda: _solvers(ready, beside), factor_words(model))
    account = Account(model, element_forces(scene, model), lambda: solvers[0].stiffening)
    recorded = clock.timed("probes", lambda: recording(scene, model, account, ready.path, ready.linkage))
    every = [*model.links, *(each.link for each in model.prescribed)]
    recoveries = clock.timed("recovery", lambda: [stress_recovery(link) for link in every])
    notices = *size_warnings(scene, plain), *assembly_warning(assembly), *stubby_warning(model), *_about_steps(ready)
    resolved = None if without_vibration(scene) else clock.timed("frequencies", lambda: resolution(ready))
    channels = [each.channel for each in recorded]
    indeterminate = indeterminate_channels(scene, model, [each.name for each in channels])
    efforts = CrossChecks(scene, ready.linkage, channels, account)
    passes, kept = SingularPasses(ready), kept_since(scene, period)
    watched = Watched(recorded, indeterminate, efforts, recoveries, passes, since, kept)
    return _Begun(plan, ready, reduction, solvers, account, watched, plain, None if accuracy == "quick" else accuracy,
                  chosen and plan is not None, period, resolved, notices)  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Judged:
    """Results of a run with what their errors are; notices as of `_Begun`, with its own."""

    results: Results
    balance: Balance | None
    budget: Budget
    step: StepEstimate
    steady: Steady | None
    singular: list[list[str]]
    notices: tuple[str, ...]


def _judged(begun: _Begun, marched: Marched, keeper: Keeper, folder: FilePath, clock: Clock) -> _Judged:
    """Highest stresses, balance of energy and estimated errors, also in the file of results."""
    ready, solvers, watched = begun.ready, begun.solvers, begun.watched
    scene, file, (envelope, seen, step) = ready.scene, folder / "results.h5", marched
    balance = None if without_vibration(scene) else begun.account.balance
    notices = (
        *begun.notices,
        *(balance_warning(balance) if balance else ()),
        *(mass_damping_warning(ready, balance.mass_damping) if balance else ()),
        *watched.efforts.warnings(),
        *indeterminate_warning(watched.indeterminate),
        *watched.passes.warnings(),
        *eased_warning(solvers),
        *unstable_balance_warning(solvers),
        *compliance_warning(seen.compliance, begun.asked),
        *keeper.warnings(),
    )
    singular = singular_places(scene, ready.model, watched.recoveries)
    add_peaks(file, peaks(envelope.links(), singular, yield_strengths(scene)))
    results = read_results(file)
    errors = step.errors if step.levels > 1 else None
    idle = unstressed(ready.model, highest(results.peaks))
    found = clock.timed(
        "estimates",
        lambda: Budget(()) if idle else budget(ready, seen, begun.reduction, run_histories(results, solvers), errors),
    )
    step = replace(step, errors=found.step or step.errors)
    steady, grows = growing(ready, solvers)
    notices += (
        *resolution_warnings(begun.resolved, found.error_of("step")),
        *([IDLE] if idle else budget_warning(found, begun.asked, begun.chosen)),
        *(write_vibration(scene, ready.model, watched.recoveries, grows, folder) if grows else ()),
        *steady_warning(steady),
    )
    notes = {
        **attributes(found), **step.notes,
        **(balance_notes(balance) if balance else {}), **(steady.notes if steady else {}),
    }  # fmt: skip
    add_notes(file, notes)
    results = replace(results, notes={**results.notes, **notes})
    if why := unstable(steady) or unstable_balance(solvers) or meaningless(found, balance, watched.efforts.unworked):
        mark_unreliable(file, why)
        results = replace(results, status="unreliable", reason=why)
    return _Judged(results, balance, found, step, steady, singular, notices)


def _completed(begun: _Begun, judged: _Judged, marched: Marched, folder: FilePath, clock: Clock) -> Run:
    """The run with all files that follow from its steps."""
    ready, results, (envelope, seen, _) = begun.ready, judged.results, marched
    peak = highest(results.peaks)
    if begun.period:
        damaged = partial(write_damage, ready.scene, ready.model, envelope, judged.singular, begun.period, folder)
        results = replace(results, fatigue=clock.timed("fatigue", damaged))
    notices = (
        *judged.notices, *peak_warning(peak, begun.watched.stresses_since), *yield_warning(results.peaks),
        *fatigue_warning(results.fatigue),
    )  # fmt: skip
    write_stresses(ready.scene, ready.model, envelope, judged.singular, drive_heading(results.drive), folder)
    notices += tuple(clock.timed("pictures", lambda: write_derived(ready.scene, results, peak, folder)))
    write_mesh_errors(seen.strained.model, seen.strained.indicators, folder)
    add_account(folder / "results.h5", notices, clock.seconds)
    results = replace(results, warnings=notices, seconds=dict(clock.seconds))
    return Run(folder, results, peak, folder / WORST, clock.seconds, notices, begun.reduction, begun.plan, judged.balance,
               judged.budget, begun.sizes, judged.step, judged.steady, steady_state(begun.solvers))  # fmt: skip


def _reported(run: Run, watch: Watch) -> Run:
    """The run with its page for a browser."""
    from kedfem.report import write_report

    clock = Clock(watch, run.seconds)
    missing = clock.timed("report", lambda: write_report(run.folder)).warnings
    return replace(run, warnings=(*run.warnings, *(f"report: {text}" for text in missing)))


def _solvers(ready: Prepared, beside: Neighbours) -> list[Steps]:
    """Those of all levels in time; the search for a steady motion starts from that of a neighbour."""
    solvers = level_steps(ready.scene, ready.model)
    for each in solvers:
        each.search = replace(each.search, near=beside.near)
    return solvers


def _about_steps(ready: Prepared) -> list[str]:
    """Warnings of steps that are too long for what turns and for what loads do; refused if turns cannot be counted."""
    require_counted(ready.scene, ready.linkage, ready.path)
    if without_vibration(ready.scene):
        return []
    return [*stability_warning(ready.scene), *coarse_steps(ready.scene)]
