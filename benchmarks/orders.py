"""Order in time: error against work of higher-order schemes, beside the solver's generalised-α and its levels.

Three studies of five scenes: the source's four-bar with rigid-body frames and with co-rotational ones, and a rod that
slides in a tube that swings, with rigid-body frames. Work is counted in solves, or passes, of one of the solver's own
steps, whose processor time is measured beside it.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.orders_corotational import Corotational
from benchmarks.orders_equation import SEEN, TURNS, Equation, Mechanism, error
from benchmarks.orders_scenes import SCENES, Raw, four_bar, slide
from benchmarks.orders_schemes import ASKED, SCHEMES, Curves, Scheme, extrapolated, needed, write_grid
from benchmarks.orders_stages import marched
from benchmarks.pages import script, table, write_page

MOST, MORE = 16_384, 4  # solves of a march; times as many of generalised-α, which is compiled
LARGE = 4  # times as few of large mechanisms
FINEST = 51_200  # steps of the coarsest level of the truth
LEVELS = 3
QUICK = 8  # times as few
REPEATS = 5
TIMED = {
    "orders": "solve, rigid-body frames",
    "orders_corotational": "pass, co-rotational frames",
    "orders_slides": "solve, slide",
}
RESOLVED = 10.0  # times the truth's own error, from which on errors are shown


@dataclass(frozen=True)
class Found:
    """Work of all schemes in solves or passes a turn, and errors; the truth's own; seconds of a solve or pass.

    coupled : what a pass of two coupled stages takes of a pass; zero with rigid-body frames
    """

    curves: Curves
    uncertainty: float
    second: float
    coupled: float = 0.0


def bench_orders(folder: Path, quick: bool) -> None:
    """Tables of three studies, and their curves."""
    tables: list[list[str]] = []
    costs: list[tuple[str, ...]] = []
    studies = {"orders": rigid_body(four_bar), "orders_corotational": corotational, "orders_slides": rigid_body(slide)}
    for name, study in studies.items():
        found = {scene: study(raw, quick) for scene, raw in list(SCENES.items())[: 1 if quick else None]}
        tables += [_table(found, asked) for asked in ASKED]
        costs.append((f"{TIMED[name]}, µs", *(f"{1e6 * x.second:.1f}" for x in found.values())))
        if any(x.coupled for x in found.values()):
            costs.append(("pass of two coupled stages, of a pass", *(f"{x.coupled:.2f}" for x in found.values())))
        drawn = {scene: {k: ([1e3 * x.second * w for w in work], e) for k, (work, e) in x.curves.items()}
                 for scene, x in found.items()}  # fmt: skip
        write_grid(folder / f"{name}.png", drawn, "processor time a turn [ms]")
    shown = list(SCENES)[: len(costs[0]) - 1]
    write_page(folder, "performance/orders", [table(("processor time of a", *shown), costs), *tables])


def _table(found: Mapping[str, Found], asked: float) -> list[str]:
    names = list(dict.fromkeys(name for each in found.values() for name in each.curves))
    rows = []
    for name in names:
        cells = []
        for each in found.values():
            shown = name in each.curves and asked > RESOLVED * each.uncertainty
            cells.append(needed(*each.curves[name], asked) if shown else "-")
        rows.append((name, *cells))
    return table((f"work per revolution for {100 * asked:g} %", *found), rows)


def doubled(first: int, last: float) -> Iterator[int]:
    """Numbers of steps, each twice the one before."""
    while first <= last:
        yield first
        first *= 2


Study = Callable[[Callable[[Callable[..., Raw]], Raw], bool], Found]


def rigid_body(of: Callable[..., Raw]) -> Study:
    """The study of a mechanism with rigid-body frames: a step, or stage, is a solve; so is a projection at its end."""

    def study(raw: Callable[[Callable[..., Raw]], Raw], quick: bool) -> Found:
        mechanism = Mechanism(raw(of))
        equation, share = Equation(mechanism), QUICK if quick else 1
        finest = FINEST // share
        runs = [equation.unknowns(mechanism.alpha(finest * 2**k).u) for k in range(LEVELS)]
        truth, curves = extrapolated(runs), {}
        slides = bool(equation.directions.shape[1])
        known = {n: equation.unknowns(mechanism.alpha(n).u) for n in doubled(2 * SEEN, MORE * MOST // share)}
        for scheme in SCHEMES:
            work, errors = [], []
            solves = scheme.solves + (slides and scheme.tableau is not None)
            for steps in doubled(2 * SEEN, _most(scheme) / share / solves):
                if scheme.tableau is None:
                    q = extrapolated([known[steps * 2**k] for k in range(scheme.levels)])
                else:
                    with np.errstate(all="ignore"):
                        q = marched(equation, scheme.tableau, steps)
                work.append(steps * solves / TURNS)
                errors.append(error(equation, q, truth))
            curves[scheme.name] = work, errors
        timed = min(mechanism.alpha(MOST // QUICK).seconds for _ in range(REPEATS)) / (MOST // QUICK)
        return Found(curves, error(equation, extrapolated(runs[1:]), truth), timed)

    return study


def corotational(raw: Callable[[Callable[..., Raw]], Raw], quick: bool) -> Found:
    """The study with co-rotational frames: a pass is a solve with the forces that lead to the next."""
    of = Corotational(raw(four_bar))
    share = (QUICK if quick else 1) * (LARGE if of.large else 1)
    truth, uncertainty = of.truth(FINEST // (share * (LARGE if of.large else 1)), LEVELS)
    errors, curves = of.errors(truth), {}
    for scheme in SCHEMES:
        if not _is_marched(scheme):
            continue
        tried = [of.march(scheme, n) for n in doubled(2 * SEEN, _most(scheme) / share / scheme.solves)]
        curves[scheme.name] = [work / TURNS for _, work in tried], [errors(u) for u, _ in tried]
    return Found(curves, errors(uncertainty), of.costs.one, of.costs.coupled)


def _most(scheme: Scheme) -> int:
    return MOST * (MORE if scheme.tableau is None else 1)


def _is_marched(scheme: Scheme) -> bool:
    """Whether stages share one factor: a composition has two, and steps back."""
    return scheme.tableau is None or bool((scheme.tableau[0].diagonal() >= 0).all())


if __name__ == "__main__":
    script(bench_orders)
