"""Edges of unstable bands that `kedfem sweep --edges` finds: closed forms, reduced and full links, growth in marching."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.analysis import Run, analyse
from kedfem.errors import SceneError
from kedfem.motion.period import over_one_period
from kedfem.scene import scene_from
from kedfem.sweep import BaseScene, SweepOptions, SweepResult, axes_of, sweep
from kedfem.sweep.edges import edges, unstable_bands
from kedfem.sweep.points import GROWTH, Row
from tests.laws.test_steady import as_steady, clamped, planar, spun, states
from tests.laws.test_varying_springs import hill, multiplier
from tests.rooms.test_sweep import Inline
from tests.scenes import constant_speed

Raw = dict[str, Any]
WIDTH = 3e-2


def swept(raw: Raw, folder: Path, *over: str, edges: float | None = WIDTH) -> SweepResult:
    asked = SweepOptions(quick=True, edges=edges)
    raw = {**raw, "analysis": {**raw["analysis"], "kind": "steady"}}
    return sweep(BaseScene(raw, folder, "scene"), axes_of(over, raw), asked, folder / "out", executor=Inline())


@pytest.mark.long
def test_a_shaft_that_is_not_round_is_unstable_from_its_first_frequency_on(tmp_path: Path) -> None:
    """Without damping, K = R(Ωt) diag(ω₁², ω₂²) R(Ωt)ᵀ; up to its second frequency."""
    raw = spun("oblique", 100.0, (0.012, 0.01))
    raw["analysis"] = {"steps_per_revolution": 180}
    omega, _, _ = clamped(raw, "oblique")
    over = "drive.motion.speed=" + ",".join(f"{x * omega[0]:.15g}" for x in (0.93, 1.1))
    done = swept(raw, tmp_path, over)
    (edge,) = done.edges
    assert edge.unstable_above
    assert edge.width <= WIDTH
    assert edge.below < omega[0] < edge.above
    assert len(done.rows) == 2 + 3  # 17 % halved three times


@pytest.mark.long
def test_the_map_of_a_spring_that_stiffens_and_softens_over_speed_and_damping(tmp_path: Path) -> None:
    """Mathieu's first unstable band, about twice the natural frequency, by his equation; damping closes it."""
    raw = hill("Mathieu", "z", 0.01, steps_per_revolution=90, extrapolation_levels=1)
    c = raw["springs"]["k"]["damping"]
    raw["parameters"] = {"c": c}
    raw["springs"]["k"]["damping"] = "=c"
    over = "drive.motion.speed=64,80,96", f"c={c:.15g},{20 * c:.15g}"
    done = swept(raw, tmp_path, *over, edges=2e-2)
    assert [each.others for each in done.edges] == [(pytest.approx(c),)] * 2  # the other has no band: 4 ζ > ε

    def growth(speed: float) -> float:
        return multiplier("Mathieu", 0.01, speed) - 1

    exact = [brentq(growth, 64, 80), brentq(growth, 80, 96)]
    for each, edge in zip(done.edges, exact, strict=True):
        assert each.width <= 2e-2
        assert each.below < edge < each.above
    assert (tmp_path / "out" / "sweep.png").stat().st_size > 1e4
    with (tmp_path / "out" / "edges.csv").open() as file:
        table = list(csv.reader(file))
    assert table[0] == ["parameters.c", "drive.motion.speed [rad/s]", "half width [rad/s]", "unstable"]
    assert [row[3] for row in table[1:]] == ["above", "below"]
    assert [float(row[1]) for row in table[1:]] == pytest.approx([each.at for each in done.edges], rel=1e-8)
    again = swept(raw, tmp_path, *over, edges=2e-2)
    assert again.before == len(again.rows) == len(done.rows)  # nothing is run twice
    assert again.edges == done.edges


def test_edges_are_refused_where_nothing_tells_of_stability(tmp_path: Path) -> None:
    raw = spun("x", 100.0, (0.012, 0.01))
    axes = axes_of(["drive.speed=10,20"], raw)

    def said(width: float = 1e-3, axes: Any = axes, **analysis: Any) -> str:
        scene = {**raw, "analysis": {**raw["analysis"], **analysis}}
        with pytest.raises(SceneError) as found:
            sweep(
                BaseScene(scene, tmp_path, "s"),
                axes,
                SweepOptions(quick=True, edges=width),
                tmp_path / "o",
                executor=Inline(),
            )
        return str(found.value)

    assert "--edges: must be a relative width from 1e-09 to below 1, such as 0.001, got 2" in said(2.0, kind="steady")
    assert "must be combined with analysis.kind = 'steady' and its stability" in said(revolutions=1)
    assert said(kind="steady", stability=False).endswith("got stability = false")
    words = axes_of(["analysis.initial=rest,quasi-static"], raw)
    assert "must be combined with numbers of the first key, analysis.initial" in said(kind="steady", axes=words)


def test_an_edge_is_not_looked_for_where_points_between_tell_nothing() -> None:
    """Stable, unknown, unstable: halving that interval again and again would never end."""

    axes = axes_of(["drive.speed=10,20,30,40"], spun("x", 100.0, (0.012, 0.01)))
    found = edges(axes, dict(enumerate(grown(0.9, None, 1.2, 0.8))))
    assert [(x.below, x.above, x.unknown) for x in found] == [(10, 30, 1), (30, 40, 0)]


def grown(*growths: float | None) -> list[Row]:
    """Points of a sweep that report growth, or nothing."""
    told = [{} if x is None else {GROWTH: ("1", (x, np.nan, np.nan, np.nan))} for x in growths]
    return [Row("complete", "", 0.0, extremes=extremes) for extremes in told]


@pytest.mark.parametrize(
    ("growths", "bands"),
    [
        ((0.9, 1.2, 1.3, 0.8), [(15, 35)]),
        ((1.2, 0.9, 0.9, 1.3), [(10, 15), (35, 40)]),
        ((1.2, 0.9, 1.1, 0.8), [(10, 15), (25, 35)]),
        ((1.2, 1.1, 1.1, 1.3), [(10, 40)]),
        ((0.9, 0.9, 0.8, 0.9), []),
        ((1.2, None, 1.1, 1.3), [(10, 40)]),
        ((None, None, None, None), []),
    ],
)
def test_bands_are_between_edges_or_throughout(
    growths: tuple[float | None, ...], bands: list[tuple[float, float]]
) -> None:
    axes, rows = axes_of(["drive.speed=10,20,30,40"], spun("x", 100.0, (0.012, 0.01))), grown(*growths)
    numbers = axes[0].numbers
    assert numbers is not None
    found = list(edges(axes, dict(enumerate(rows))))
    assert unstable_bands(numbers, rows, [2, 0, 3, 1], found) == bands


def test_growth_of_what_steps_do_not_resolve_is_not_told(tmp_path: Path) -> None:
    """At four degrees a step and β = 2e-5 the crank's 38 kHz grow by 1.9 in a turn, by the method; half a step shows."""
    raw = at_speed(plane_slider_crank(True), 2600)
    raw["damping"] = {"beta": 2e-5}

    def found(steps: int) -> Run:
        analysis = {**raw["analysis"], "kind": "steady", "accuracy": "quick", "steps_per_revolution": steps}
        output = {"folder": str(tmp_path), "plots": False, "picture": False, "animation": False}
        return analyse(scene_from({**raw, "analysis": analysis, "output": output}))

    long = found(90)
    assert long.steady is not None
    assert long.steady.growth is None
    assert long.steady.levels[0] > 1.5
    assert any("cannot be determined with steps as long as these: a vibration at about" in x for x in long.warnings)
    assert not (tmp_path / "growing.pvd").exists()
    short = found(180)
    assert short.steady is not None
    assert short.steady.growth is not None
    assert short.steady.growth < 0.9


def plane_four_bar(reduced: bool) -> Raw:
    """Thin planes, 6 mm in their plane."""
    link = {"mesh": {"elements": [8, 1]}, "shape": {"kind": "bar", "width": 0.006, "thickness": 0.02}}
    more = {"reduction": "modal"} if reduced else {}
    raw = planar("plane", link={**link, **more}, damping={"beta": 1e-5})
    return {**raw, "analysis": {"steps_per_revolution": 360, "rho_inf": 0.95}}


def plane_slider_crank(reduced: bool) -> Raw:
    """A rod of 3 mm in its plane, which a block of 0.3 kg presses and pulls."""
    shape = {"kind": "bar", "between": [[0.05, 0], [0.25, 0]], "width": 0.003, "thickness": 0.015}
    rod = {"model": "plane", "material": "steel", "shape": shape, "mesh": {"elements": [8, 1]}}
    crank = {"kind": "bar", "between": [[0, 0], [0.05, 0]], "width": 0.02, "thickness": 0.02}
    pin = {"kind": "revolute"}
    return {
        "links": {
            "crank": {"model": "beam", "material": "steel", "shape": crank, "mesh": {"elements": 1}},
            "rod": {**rod, **({"reduction": "modal"} if reduced else {})},
            "slider": {"model": "rigid", "mass": 0.3},
        },
        "joints": {
            "A": {**pin, "links": ["ground", "crank"], "at": [0, 0]},
            "B": {**pin, "links": ["crank", "rod"], "at": [0.05, 0]},
            "C": {**pin, "links": ["rod", "slider"], "at": [0.25, 0]},
            "guide": {"kind": "prismatic", "links": ["slider", "ground"], "at": [0.25, 0], "axis": "x"},
        },
        "drive": {"joint": "A", "motion": constant_speed("3000 rpm")}, "damping": {"beta": 5e-6},
        "analysis": {"steps_per_revolution": 90, "rho_inf": 0.95, "stiffening": True},
    }  # fmt: skip


def at_speed(raw: Raw, rpm: float) -> Raw:
    return {**raw, "drive": {"joint": "A", "motion": constant_speed(f"{rpm:.12g} rpm")}}


def log_growth(raw: Raw, rpm: float) -> float:
    """In a turn, by multipliers."""
    scene = over_one_period(scene_from(as_steady(at_speed(raw, rpm), reduction_tolerance=1e-2)))
    of = states(prepared(scene)[0])[1]
    assert of is not None
    assert of.growth is not None
    return float(np.log(of.growth))


def marched_growth(raw: Raw, rpm: float, turns: int) -> float:
    """The logarithm of what a turn multiplies the vibration of the start by, over the last half of a march from rest."""
    raw = at_speed(raw, rpm)
    given = {**raw["analysis"], "accuracy": "quick", "revolutions": turns}
    found, _ = states(meshed(scene_from({**raw, "analysis": given})))
    turned = found[1:].reshape(turns, -1, found.shape[1])
    changes = np.linalg.norm(np.diff(turned, axis=0).reshape(turns - 1, -1), axis=1)
    half = len(changes) // 2
    return float(np.polyfit(np.arange(half), np.log(changes[-half:]), 1)[0])


@pytest.mark.long
@pytest.mark.parametrize(
    ("linkage", "between", "turns"), [(plane_four_bar, (6200, 6400), 160), (plane_slider_crank, (3300, 3600), 40)]
)
def test_an_edge_is_the_same_by_reduced_links_full_ones_and_growth_in_a_march(
    linkage: Callable[[bool], Raw], between: tuple[float, float], turns: int
) -> None:
    """Stable below, unstable above; the march's edge is within 0.5 % where it decays a quarter below and grows above."""
    reduced, full = linkage(True), linkage(False)

    def edge(raw: Raw) -> float:
        return float(brentq(lambda rpm: log_growth(raw, rpm), *between, rtol=5e-4))

    found = edge(full)
    assert_allclose(edge(reduced), found, rtol=5e-3)
    assert marched_growth(full, 0.9975 * found, turns) < 0.0 < marched_growth(full, 1.0025 * found, turns)
    if "stiffening" in full["analysis"]:  # which alone makes it unstable
        plain = {**full, "analysis": {**full["analysis"], "stiffening": False}}
        assert log_growth(plain, 1.05 * found) < -0.02
