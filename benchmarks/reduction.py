"""Reduced links: which modes, how good the estimate of their error is, what a step and their preparation cost."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks import loop
from benchmarks.bases import interface_bases
from benchmarks.pages import script, table, write_loglog, write_page
from benchmarks.varied import varied_scenes
from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.reduction import reduced
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.reduction import static_parts
from kedfem.dynamics.reduced_model import reduced_model
from kedfem.links.recovery import nodal_state, nodal_stress, stress_recovery, von_mises
from kedfem.scene import scene_from

COUNTS = (12, 16, 20, 25, 30, 40, 55)
MOMENTS = 24
LOOP_COUNTS = (12, 16, 20, 30, 40, 54)
TOLERANCES = (1e-2, 1e-3)
WAYS = ("kedfem", "fixed interface", "free interface")
ERRORS = ("stress at the probe", "whole stress field", "joint forces")


def bench_reduction(folder: Path, quick: bool) -> None:
    """Four measurements; tables and plots go to the folder."""
    ways = _ways(folder, COUNTS[2:4] if quick else COUNTS)
    scenes = dict(list(varied_scenes().items())[15 : 16 if quick else None]) if quick else varied_scenes()
    estimates = _estimates(scenes, TOLERANCES[:1] if quick else TOLERANCES)
    steps = _loop(folder, LOOP_COUNTS[:2] if quick else LOOP_COUNTS)
    tables = [ways, *estimates, *steps, *([] if quick else [_preparation()])]
    write_page(folder, "performance/reduction", tables)


@dataclass(frozen=True, slots=True)
class _Run:
    """Channels of a run, and nodal stresses of all links at some moments."""

    channels: Histories
    stresses: list[np.ndarray]


def _run(ready: Prepared, moments: Sequence[int]) -> _Run:
    recoveries = [stress_recovery(link) for link in ready.model.links]
    found = histories(ready, set(moments))
    stresses = [
        nodal_stress(recovery, nodal_state(link, state.g))
        for snapshot in found.kept
        for link, recovery, state in zip(ready.model.links, recoveries, snapshot.states, strict=True)
    ]
    return _Run(found, stresses)


def _errors(run: _Run, truth: _Run) -> tuple[float, float, float]:
    """Of the probe's stress, of all nodal stresses (largest component, of the highest von Mises stress), of forces."""
    channels = relative_errors(run.channels, truth.channels)
    peak = max(float(von_mises(stress).max()) for stress in truth.stresses)
    field = max(float(np.abs(a - b).max()) for a, b in zip(run.stresses, truth.stresses, strict=True))
    forces = worst({name: error for name, error in channels.items() if name.startswith("joints/")})
    return channels["probes/stress/stress"], field / peak, forces


def _ways(folder: Path, counts: Sequence[int]) -> list[str]:
    """Errors of three ways to choose modes, against their number."""
    full, _ = loop.four_bar_with(counts[0])
    moments = [30 * k for k in range(1, MOMENTS + 1)]
    truth = _run(full, moments)
    parts = static_parts(full.model)
    textbook = {way: interface_bases(full.model, parts, way == WAYS[1]) for way in WAYS[1:]}
    errors: dict[str, list[tuple[float, float, float]]] = {way: [] for way in WAYS}
    for count in counts:
        errors[WAYS[0]].append(_errors(_run(loop.with_modes(full, count), moments), truth))
        for way, bases in textbook.items():
            model: Model = reduced_model(full.model, [basis.first(count) for basis in bases])
            errors[way].append(_errors(_run(replace(full, model=model), moments), truth))
    for k, name in enumerate(("reduction", "reduction_field")):
        curves = {way: (counts, [each[k] for each in found]) for way, found in errors.items()}
        write_loglog(folder, name, curves, ("modes per link", f"relative error, {ERRORS[k]}"))
    header = ("modes per link", *(f"{what}: {way}" for what in ERRORS for way in WAYS))
    rows = [
        (str(count), *(f"{100 * errors[way][row][k]:.2g} %" for k in range(3) for way in WAYS))
        for row, count in enumerate(counts)
    ]
    return table(header, rows)


def _estimates(scenes: dict[str, dict[str, object]], tolerances: Sequence[float]) -> tuple[list[str], list[str]]:
    """The estimated error against the true one, scene by scene."""
    rows, ratios = [], []
    for name, raw in scenes.items():
        full = meshed(scene_from(raw))
        truth = histories(full)
        row = [name]
        for tolerance in tolerances:
            found = reduced(full, [link.name for link in full.model.links], tolerance)
            true = relative_errors(histories(found.ready), truth)
            each = [found.estimate[channel] / error for channel, error in true.items() if error > 0.0]
            ratio = worst(found.estimate) / worst(true)
            ratios.append(ratio)
            row += [f"{max(link.n for link in found.ready.model.links)}", f"{100 * worst(true):.2g} %",
                    f"{ratio:.2f}", f"{min(each):.2f} to {max(each):.2f}"]  # fmt: skip
        rows.append(row)
    header = ["scene"]
    for tolerance in tolerances:
        header += [f"{100 * tolerance:g} % asked for: modes, at most", "true error", "estimate / true", "single channels"]
    low, high = min(ratios), max(ratios)
    lowest = rows[ratios.index(low) // len(tolerances)][0]
    within = np.mean([1 / 3 <= ratio <= 3 for ratio in ratios])
    summary = (f"{low:.2f}", f"{high:.2f}", f"{100 * within:.0f} % of {len(ratios)}",
               str(sum(ratio < 1 / 3 for ratio in ratios)), lowest)  # fmt: skip
    over = ("estimate / true, least", "most", "within a factor of 3", "below a third", "least of")
    return table(header, rows), table(over, [summary])


def _loop(folder: Path, counts: Sequence[int]) -> tuple[list[str], list[str]]:
    """A step of the loop against the number of functions."""
    full, _ = loop.four_bar_with(counts[0])
    rows, fast, limits, made = [], [], [], []
    speed = loop.machine_speed()
    for count in counts:
        small = loop.with_modes(full, count)
        memory, arithmetic = loop.least_time(small, *speed)
        made.append(max(link.n for link in small.model.links))
        fast.append(loop.loop_time(small))
        limits.append(max(memory, arithmetic))
        rows.append((str(made[-1]), f"{1e6 * fast[-1]:.1f}", f"{1e6 * memory:.1f}", f"{1e6 * arithmetic:.1f}",
                     f"{fast[-1] / limits[-1]:.1f}", f"{loop.recorded_rate(small):,.0f}"))  # fmt: skip
    curves = {"step": (made, fast), "limit": (made, limits)}
    write_loglog(folder, "reduction_loop", curves, ("modes per link", "seconds per step"))
    header = ("modes per link", "a step [µs]", "matrices from memory [µs]",
              "flops at BLAS speed [µs]", "step / limit", "steps a second, recorded")  # fmt: skip
    machine = table(("memory [GB/s]", "products [Gflop/s]"), [(f"{speed[0] / 1e9:.1f}", f"{speed[1] / 1e9:.1f}")])
    return table(header, rows), machine


def _preparation() -> list[str]:
    unknowns, factor, spent = loop.preparation()
    header = ("unknowns", "factor [s]", "reduce, estimate included [s]", "ratio")
    return table(header, [(f"{unknowns:,}", f"{factor:.2f}", f"{spent:.2f}", f"{spent / factor:.1f}")])


if __name__ == "__main__":
    script(bench_reduction)
