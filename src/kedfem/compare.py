"""Comparison of several runs, from their results files: differences of their scenes and of their results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import OutputError
from kedfem.output.plots.comparison import write_comparison
from kedfem.results import Results, read_results, results_file
from kedfem.results.differences import Difference, Over, common_abscissa, common_channels, differences, differing_keys


@dataclass(frozen=True, slots=True)
class Comparison:
    """The outcome of `compare`.

    folder : where the pictures and the table are
    names : of the runs, the first one is what the others are compared with
    over, unit, range : what curves are over, its unit, from where to where
    keys : of the scenes that are not the same in all runs, with their values
    found : channel by channel
    peaks : link → (runs,) highest von Mises stress [Pa], nan where a run has none
    warnings : what is not compared, and why
    """

    folder: FilePath
    names: tuple[str, ...]
    over: Over
    unit: str
    range: tuple[float, float]
    keys: Mapping[str, tuple[Any, ...]]
    found: tuple[Difference, ...]
    peaks: Mapping[str, Float[np.ndarray, " runs"]]
    warnings: tuple[str, ...]


def compare(
    files: Sequence[FilePath], over: Over | None = None, folder: FilePath | None = None, pictures: bool = True
) -> Comparison:
    """Compare runs with the first of them, and draw their curves over each other.

    Parameters
    ----------
    files : `results.h5` of each, or the folders that have them
    over : time or the drive's position; by itself the drive's where the runs have other speeds
    folder : where all goes; `compare` beside the first results if not given
    pictures : whether anything is written

    Raises
    ------
    KedfemError
        With a message for the user.
    """
    if len(files) < 2:
        raise OutputError(f"kedfem compare: must have two results or more, got {len(files)}")
    paths = [results_file(each) for each in files]
    runs = [read_results(path) for path in paths]
    for path, run in zip(paths, runs, strict=True):
        if not len(run.time):
            raise OutputError(f"{path}: must have rows, got none: the run was {run.status}")
    names = _names(paths)
    try:
        over, along = common_abscissa(runs, over)
    except ValueError as error:
        raise OutputError(f"kedfem compare: must have {error}, got none; take --over time or other runs") from error
    found = differences(runs, over, along)
    if not found:
        raise OutputError("kedfem compare: must have channels that all runs record, got none: give them the same probes")
    target = FilePath(folder) if folder else paths[0].parent / "compare"
    if pictures:
        write_comparison(found, names, over, along, runs[0].drive, target)
    links = dict.fromkeys(link for run in runs for link in run.peaks)
    peaks = {link: np.array([run.peaks[link].stress if link in run.peaks else np.nan for run in runs]) for link in links}
    ends = float(along[0]), float(along[-1])
    reported = (*_missing(names, runs), *_partial(names, runs), *_thinned(names, runs))
    unit = "s" if over == "time" else runs[0].drive.unit
    return Comparison(target, names, over, unit, ends, differing_keys(runs), tuple(found), peaks, reported)


def _names(paths: Sequence[FilePath]) -> tuple[str, ...]:
    """The shortest end of each path that distinguishes it from the others, without results.h5."""
    places = [path.resolve().parent if path.name == "results.h5" else path.resolve() for path in paths]
    for length in range(1, max(len(place.parts) for place in places) + 1):
        names = tuple("/".join(place.parts[-length:]) for place in places)
        if len(set(names)) == len(set(places)):
            break
    return tuple(name if names.index(name) == k else f"{name} ({k + 1})" for k, name in enumerate(names))


def _missing(names: Sequence[str], runs: Sequence[Results]) -> tuple[str, ...]:
    """Channels that some runs lack."""
    common = set(common_channels(runs))
    out = []
    for name, run in zip(names, runs, strict=True):
        if own := [each for each in run.channels if each not in common]:
            few = ", ".join(own[:5]) + (f" and {len(own) - 5} more" if len(own) > 5 else "")
            out.append(f"{name}: {few}: not recorded, or otherwise, in another run, and not compared")
    return tuple(out)


def _thinned(names: Sequence[str], runs: Sequence[Results]) -> tuple[str, ...]:
    """Runs that did not write all rows."""
    seen = "alone (output.every): curves are compared there, and differences between them are not reported"
    every = zip(names, runs, strict=True)
    return tuple(f"{name}: has rows of one step in {run.every} {seen}" for name, run in every if run.every > 1)


def _partial(names: Sequence[str], runs: Sequence[Results]) -> tuple[str, ...]:
    """Runs that are not whole."""
    return tuple(
        f"{name}: the run is {run.status} after {len(run.time)} rows" + (f" ({run.reason})" if run.reason else "")
        for name, run in zip(names, runs, strict=True)
        if run.status != "complete"
    )
