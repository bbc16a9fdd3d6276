"""Time histories of trial runs in memory, and the relative errors between them."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.accuracy.error_budget import kind_of_name
from kedfem.accuracy.prepared import Prepared
from kedfem.arrays import Float
from kedfem.dynamics.history import Block, Snapshot
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.levels import level_steps, leveled
from kedfem.dynamics.system.period.map import StateArrays, state_arrays
from kedfem.dynamics.system.period.search import Periodic, Search
from kedfem.dynamics.system.steps import Steps
from kedfem.results import Channel, Results
from kedfem.results.differences import FAINT, MOMENT, comparable, scales
from kedfem.results.on_demand import selection
from kedfem.results.recording import recording, rows

ROUGHLY = 1e-6  # relative residual of a period that a steady motion for comparison may have
NOTHING = 1e-6  # of the largest value of the same kind: a channel below it is only rounding


@dataclass(frozen=True, slots=True)
class Histories:
    """Channels over time.

    time : (T,) [s]
    channels : channel and values (T, c), by name
    kept : states at the requested steps
    size : extent of the linkage [m]
    begun : the state at the beginning of a steady motion; None for other analyses, or if unknown
    divided : whether a step was taken in parts, as its iterations did not converge
    """

    time: Float[np.ndarray, " T"]
    channels: Mapping[str, tuple[Channel, Float[np.ndarray, "T c"]]]
    kept: tuple[Snapshot, ...] = ()
    size: float = 0.0
    begun: StateArrays | None = None
    divided: bool = False


def histories(
    ready: Prepared, keep: Collection[int] = (), watch: Callable[[], None] = lambda: None,
    look: Callable[[Block], None] = lambda block: None,
    follow: Callable[[Block, dict[str, Float[np.ndarray, "T c"]]], None] = lambda block, values: None,
    near: StateArrays | None = None,
) -> Histories:  # fmt: skip
    """Run a prepared scene and keep its channels.

    Parameters
    ----------
    keep : numbers of the steps whose states are kept
    watch : called after every block; an exception that it raises ends the run
    look : called with every block
    follow : called with every block and its values by channel
    near : an estimate of the state at the beginning of a steady motion
    """
    every = recording(ready.scene, ready.model, linked=ready.linkage)
    recorded = [x for x in every if kept(x.channel.name)]
    times, taken, states = [], [], []
    solvers = level_steps(ready.scene, ready.model)
    for solver in solvers:
        solver.search = Search(near, ROUGHLY)
    for block in leveled(ready.scene, ready.linkage, ready.path, ready.model, solvers):
        times.append(block.motion.t)
        taken.append(rows(recorded, block))
        watch()
        look(block)
        follow(block, taken[-1])
        states += [block.at(k) for k in range(len(block)) if block.step + k in keep]
    channels = {
        each.channel.name: (each.channel, np.concatenate([found[each.channel.name] for found in taken]))
        for each in recorded
    }
    divided = any(each.ready.halves for each in solvers)
    return Histories(np.concatenate(times), channels, tuple(states), extent(ready.model), steady_state(solvers), divided)


def steady_state(solvers: Sequence[Steps]) -> StateArrays | None:
    """The state at the beginning of a steady motion in the finest steps; None for other motions."""
    found = getattr(solvers[-1], "steady", None)
    return state_arrays(found.state) if isinstance(found, Periodic) else None


def extent(model: Model) -> float:
    """Size of a linkage in the reference position [m]."""
    nodes = np.concatenate([(link.full or link).nodes for link in model.links])
    return float(np.ptp(nodes, axis=0).max())


def is_judged(name: str) -> bool:
    """Whether a required accuracy applies to a channel: probes, joint forces, the drive's torque."""
    return kind_of_name(name) is not None


def kept(name: str) -> bool:
    """Whether a channel is judged, or shows beside which moments a judged force is none."""
    return is_judged(name) or (name.startswith("joints/") and name.endswith("/moment"))


def relative_errors(found: Histories, reference: Histories, zeros: set[str] | None = None) -> dict[str, float]:
    """Largest difference over time in every judged channel, relative to what `scales` gives.

    If the two runs have different steps, the reference is interpolated by a cubic spline.

    Parameters
    ----------
    zeros : set to which the names of channels that are zero beside others are added
    """
    end = min(found.time[-1], reference.time[-1]) * (1 + 1e-12)
    here = found.time <= end
    errors, sizes = {}, judged(reference)
    for name in sizes:
        channel, wanted = reference.channels[name]
        if name in found.channels:
            values = _columns(found.channels[name], channel)[here]
            there = _at(found.time[here], reference.time, wanted)
            errors[name] = float(np.linalg.norm(values - there, axis=1).max())
    scale = scales(errors, sizes, zeros)
    return {name: error / scale[name] for name, error in errors.items()}


def counted(reference: Histories) -> dict[str, float]:
    """Largest value of each judged channel; negligible channels are left out."""
    return {name: size for name, (_, size) in judged(reference).items()}


def judged(reference: Histories) -> dict[str, tuple[str, float]]:
    """What each judged channel is comparable with, and its largest value; negligible channels are left out."""
    most: dict[str, float] = {}
    sizes = {}
    for name, (channel, values) in reference.channels.items():
        of, size = comparable(channel), float(np.linalg.norm(values, axis=1).max())
        most[of] = max(most.get(of, 0.0), size)
        if is_judged(name):
            sizes[name] = of, size
    least = {of: NOTHING * value for of, value in most.items()}
    moment = max(most.get("N m", 0.0), most.get(MOMENT, 0.0))
    least["N m"] = max(NOTHING * moment, FAINT * reference.size * most.get("N", 0.0))
    if reference.size:  # for balanced rotors, and for what moments alone bend
        least["N"] = max(least.get("N", 0.0), NOTHING * moment / reference.size)
    return {name: (of, size) for name, (of, size) in sizes.items() if size > least[of]}


def worst(errors: Mapping[str, float]) -> float:
    """The largest relative error; 0 without any channel."""
    return max(errors.values(), default=0.0)


def _columns(found: tuple[Channel, Float[np.ndarray, "T c"]], like: Channel) -> Float[np.ndarray, "T d"]:
    """The columns of another channel; missing ones, such as the third of a planar link, are zero."""
    channel, values = found
    known = dict(zip(channel.columns, values.T, strict=True))
    return np.stack([known.get(c, np.zeros(len(values))) for c in like.columns], axis=1)


def _at(
    time: Float[np.ndarray, " t"], given: Float[np.ndarray, " T"], values: Float[np.ndarray, "T c"]
) -> Float[np.ndarray, "t c"]:
    if len(time) == len(given) and np.allclose(time, given, rtol=0, atol=1e-9 * given[-1]):
        return values
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(given, values)(np.minimum(time, given[-1])))


def run_histories(results: Results, solvers: Sequence[Steps]) -> Histories:
    """The judged channels of a run; none if it did not record all time points."""
    if results.every > 1:
        return Histories(results.time[:0], {}, begun=steady_state(solvers))
    return Histories(
        results.time, selection(results.channels, filter(kept, results.channels)), begun=steady_state(solvers)
    )
