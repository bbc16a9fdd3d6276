"""Edges of unstable bands that `kedfem sweep --edges` finds: closed forms, reduced and full links, growth in marching."""

import csv
from pathlib import Path
from typing import Any

import pytest
from scipy.optimize import brentq

from kedfem.errors import SceneError
from kedfem.sweep import Asked, Base, Swept, axes_of, sweep
from tests.laws.test_steady import clamped, spun
from tests.laws.test_varying_springs import hill, multiplier
from tests.rooms.test_sweep import Inline

Raw = dict[str, Any]
WIDTH = 3e-2


def swept(raw: Raw, folder: Path, *over: str, edges: float | None = WIDTH) -> Swept:
    asked = Asked(quick=True, edges=edges)
    raw = {**raw, "analysis": {**raw["analysis"], "kind": "steady"}}
    return sweep(Base(raw, folder, "scene"), axes_of(over, raw), asked, folder / "out", executor=Inline())


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
    assert table[0] == ["parameters.c", "drive.motion.speed", "half width", "unstable"]
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
                Base(scene, tmp_path, "s"),
                axes,
                Asked(quick=True, edges=width),
                tmp_path / "o",
                executor=Inline(),
            )
        return str(found.value)

    assert "--edges: must be a relative width from 1e-09 to below 1, such as 0.001, got 2" in said(
        2.0, kind="steady"
    )
    assert "must be combined with analysis.kind = 'steady' and its stability" in said(revolutions=1)
    assert said(kind="steady", stability=False).endswith("got stability = false")
    words = axes_of(["analysis.initial=rest,quasi-static"], raw)
    assert "must be combined with numbers of the first key, analysis.initial" in said(
        kind="steady", axes=words
    )
