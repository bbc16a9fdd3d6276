"""Speed against error: runs of a scene in many variants, compared with the finest one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from statistics import median
from time import perf_counter

from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import reduced
from kedfem.accuracy.study.variants import (
    FINENESS,
    STEPS,
    Variant,
    coarser,
    exponent,
    first_variants,
    further_variants,
    reference_variant,
    varied,
)  # fmt: skip
from kedfem.dynamics.stepping.cost import estimated_cost
from kedfem.errors import KedfemError, SceneError
from kedfem.motion.assembly import assembled
from kedfem.scene import Scene, time_grid

Watch = Callable[[str, int, int], None]
SHORT = 0.02  # of the time limit: shorter runs are repeated
PREFERRED = 3.0  # factor by which a variant with the scene's own mesh and step may take longer and still comes first
FOR_REFERENCE = 0.75  # of the remaining time: most for the reference and its two coarser neighbours


@dataclass(frozen=True, slots=True)
class Seconds:
    """Medians over several runs [s]: preparation, stepping, both together; and the number of runs."""

    preparation: float
    stepping: float
    whole: float
    runs: int


@dataclass(frozen=True, slots=True)
class MeasuredVariant:
    """A measured variant of a study.

    steps, unknowns : their numbers
    seconds : None if it was not run; then `note` has the reason
    errors : relative error of every judged channel against the reference [-]
    front : whether no other variant is both faster and more accurate
    """

    variant: Variant
    steps: int = 0
    unknowns: int = 0
    seconds: Seconds | None = None
    errors: dict[str, float] = field(default_factory=dict)
    front: bool = False
    note: str = ""

    @property
    def error(self) -> float:
        """Error of the worst channel."""
        return worst(self.errors)

    @property
    def worst_channel(self) -> str:
        """Name of the worst channel."""
        return max(self.errors, key=lambda name: self.errors[name], default="")


@dataclass(frozen=True, slots=True)
class Study:
    """All variants of a scene.

    reference : the variant with which all are compared
    shares : estimated parts of the reference's own error in the worst channel: mesh, step, reduction [-]
    rows : variants in the order in which they were run, then those that were not run
    """

    title: str
    reference: MeasuredVariant
    shares: dict[str, float]
    rows: tuple[MeasuredVariant, ...]

    @property
    def floor(self) -> float:
        """Estimated error of the reference, below which errors are unknown [-]."""
        return sum(self.shares.values())


class _LateError(Exception):
    """The time limit is reached."""


@dataclass
class _Bench:
    """The measurements so far, and the remaining time."""

    scene: Scene
    most: float
    repeats: int
    watch: Watch
    since: float = field(default_factory=lambda: perf_counter())  # noqa: PLW0108
    rows: dict[Variant, MeasuredVariant] = field(default_factory=dict)
    runs: dict[Variant, Histories] = field(default_factory=dict)
    estimates: dict[Variant, float] = field(default_factory=dict)
    unreduced: dict[Variant, float] = field(default_factory=dict)

    @property
    def left(self) -> float:
        return self.most - (perf_counter() - self.since)

    def tick(self) -> None:
        """Raise an error if the time limit is reached."""
        if self.left < 0.0:
            raise _LateError

    def stage(self, name: str) -> None:
        self.tick()

    def run(self, variant: Variant) -> bool:
        """Measure a variant, or note why it fails; whether it ran."""
        if variant not in self.rows:
            self.watch(variant.name, int(self.most - self.left), int(self.most))
            try:
                self.rows[variant] = self._measured(variant)
            except KedfemError as error:
                self.rows[variant] = MeasuredVariant(variant, note=str(error).splitlines()[0])
            except _LateError:
                self.rows[variant] = MeasuredVariant(variant, note="left out: it exceeded the time limit")
        return self.rows[variant].seconds is not None

    def leave_out(self, variant: Variant, expected: float) -> None:
        """Note that a variant would exceed the time limit."""
        known = f": would take about {expected:.0f} s" if expected < float("inf") else ", as was the same kind of model"
        self.rows[variant] = MeasuredVariant(variant, note=f"left out{known}")

    def _measured(self, variant: Variant) -> MeasuredVariant:
        scene = varied(self.scene, variant)
        times: list[tuple[float, float]] = []
        again = True
        while again:
            *spent, unknowns = self._once(scene, variant)
            times.append((spent[0], spent[1]))
            again = len(times) < self.repeats and sum(times[0]) < SHORT * self.most and self.left > 0
        preparation, stepping = zip(*times, strict=True)
        seconds = Seconds(median(preparation), median(stepping), median(map(sum, times)), len(times))
        return MeasuredVariant(variant, time_grid(scene).steps, int(unknowns), seconds)

    def _once(self, scene: Scene, variant: Variant) -> tuple[float, float, int]:
        """Seconds of preparation and of stepping, and the number of unknowns."""
        begun = perf_counter()
        ready = meshed(scene, self.stage)
        if variant.tolerance is not None:
            cost = estimated_cost(scene, ready.model)
            full = replace(variant, model_kind=replace(variant.model_kind, reduced=False), tolerance=None)
            self.unreduced[full] = perf_counter() - begun + cost.factor + cost.steps
            chosen = [name for name, link in scene.links.items() if link.reduced]
            found = reduced(ready, chosen, variant.tolerance, stage=self.stage)
            ready, self.estimates[variant] = found.ready, worst(found.estimate)
        prepared = perf_counter()
        self.runs[variant] = histories(ready, watch=self.tick)
        return prepared - begun, perf_counter() - prepared, ready.model.unknowns

    def expected(self, variant: Variant) -> float:
        """Expected duration of a variant from the most similar one that ran [s]; infinite without one."""
        ran = (row for row in self.rows.values() if row.seconds)
        alike = [row for row in ran if row.variant.model_kind == variant.model_kind]
        if not alike:
            return self.unreduced.get(variant, float("inf"))
        row = max(alike, key=lambda row: (row.variant.fineness <= variant.fineness, row.variant.fineness))
        seconds, before = row.seconds or Seconds(0.0, 0.0, 0.0, 0), row.variant
        more = (variant.fineness / before.fineness) ** exponent(self.scene, variant.model_kind)
        steps = variant.steps / before.steps
        tighter = 1.5 if (variant.tolerance or 1.0) < 0.5 * (before.tolerance or 1.0) else 1.0
        stepping = seconds.stepping * steps * (more**1.2 if variant.tolerance is None else tighter**2)
        return float(seconds.preparation * tighter * more**0.9 * max(1.0, steps) ** 0.4 + stepping)


def studied(
    scene: Scene, most: float = 60.0, repeats: int = 3, quick: bool = False,
    watch: Watch = lambda stage, done, total: None,
) -> Study:  # fmt: skip
    """Run a scene in many variants and compare them with the finest within the time limit.

    Parameters
    ----------
    most : time limit [s]; variants that would exceed it are left out
    repeats : number of runs of short variants, for medians
    quick : whether to take a small reference and few variants
    watch : called with each variant's name, the seconds passed and the time limit

    Raises
    ------
    KedfemError
        No variant can be run; the message has the reason of the first.
    """
    scene, _ = assembled(scene)
    bench = _Bench(scene, most, repeats, watch)
    first = first_variants(scene)
    if not first:
        raise SceneError("links: must hold an elastic link with a shape, got rigid ones only")
    bench.run(first[0])  # not measured: libraries are loaded and loops compiled
    bench.rows.clear()
    for variant in first:
        reduced_one = replace(variant.model_kind, reduced=True)
        if variant.model_kind.reduced or reduced_one not in [each.model_kind for each in first]:
            bench.run(variant)
    reference = _reference(bench, quick)
    further = [*first, *([] if quick else further_variants(scene, reference))]
    for variant in sorted(further, key=lambda v: bench.expected(v) / (PREFERRED if v in first else 1.0)):
        if variant in bench.rows or _unbuildable(bench, variant):
            continue
        if (expected := bench.expected(variant)) > bench.left:
            bench.leave_out(variant, expected)
        else:
            bench.run(variant)
    return _compared(bench, reference)


def _unbuildable(bench: _Bench, variant: Variant) -> bool:
    """Whether the same kind of model failed already, which is reported once."""
    failed = [row for row in bench.rows.values() if not row.seconds and not row.note.startswith("left out")]
    return any(row.variant.model_kind == variant.model_kind for row in failed)


def _reference(bench: _Bench, quick: bool) -> Variant:
    """Run the finest variant within the time limit and its coarser neighbours; if it fails, the next one."""
    finest = [(f, STEPS[-1]) for f in FINENESS[:0:-1]] if not quick else []
    for fineness, steps in (*finest, (1.5, 2), (1.0, STEPS[-1]), (1.0, 2)):
        variant = reference_variant(bench.scene, fineness, steps)
        together = sum(bench.expected(each) for each in (variant, *(v for *_, v in coarser(variant))))
        if together > FOR_REFERENCE * bench.left:
            bench.leave_out(variant, together)
        elif bench.run(variant):
            for *_, each in coarser(variant):
                bench.run(each)
            return variant
    ran = [variant for variant, row in bench.rows.items() if row.seconds]
    if not ran:
        note = next(iter(bench.rows.values())).note
        late = f"most: must leave time for a run, got {bench.most:g} s"
        raise SceneError(late if note.startswith("left out") else note)
    return max(ran, key=lambda v: first_variants(bench.scene).index(v) if v.model_kind.rigid is None else -1)


def _compared(bench: _Bench, reference: Variant) -> Study:
    """The study: errors of all variants that ran, and of the reference itself."""
    finest = bench.runs[reference]
    shares = {}
    for direction, factor, variant in coarser(reference):
        if variant in bench.runs and bench.rows[variant].seconds:
            change = worst(relative_errors(bench.runs[variant], finest))
            shares[direction] = change / (factor**2 - 1)
    if reference in bench.estimates:
        shares["reduction"] = bench.estimates[reference]
    rows = [
        replace(row, errors=relative_errors(bench.runs[variant], finest)) if row.seconds else row
        for variant, row in bench.rows.items()
    ]
    floor = sum(shares.values())
    ran = [row for row in rows if row.seconds]
    on = pareto_front([(row.seconds.whole, max(row.error, floor)) for row in ran if row.seconds])
    ran = [replace(row, front=k in on) for k, row in enumerate(ran)]
    rest = [row for row in rows if not row.seconds]
    found = next(row for row in ran if row.variant == reference)
    return Study(bench.scene.title or "kedfem", found, shares, (*ran, *rest))


def pareto_front(points: Sequence[tuple[float, float]]) -> set[int]:
    """Numbers of the Pareto-optimal points (time, error).

    >>> sorted(pareto_front([(1.0, 0.1), (2.0, 0.2), (3.0, 0.05), (3.0, 0.05)]))
    [0, 2]
    """
    front, least = set[int](), float("inf")
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if points[k][1] < least:
            least = points[k][1]
            front.add(k)
    return front
