"""The budget of a run: what each source costs, against finer runs; what is not claimed; what is warned of."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.indicator import judged
from numpy.testing import assert_allclose

from kedfem.accuracy import estimates
from kedfem.accuracy.error_budget import Budget, Share, budget_warning, by_kind, meaningless
from kedfem.accuracy.estimates import budget, error_monitor, step_errors
from kedfem.accuracy.histories import Histories, counted, histories, relative_errors
from kedfem.accuracy.mesh_estimate import mesh_errors
from kedfem.accuracy.positions import fewer_positions, missed
from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.accuracy.step_estimate import single_errors
from kedfem.accuracy.variants import with_steps
from kedfem.analysis import analyse
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.links.build import bare_link
from kedfem.links.indicator import indicator
from kedfem.links.singular_stress import re_entrant
from kedfem.results import Channel, read_results
from kedfem.scene import scene_from, time_grid
from tests.moving import bar

from ..laws.test_envelope import ROUND, SHARP, angled
from .test_audit import example


def estimated(raw: dict[str, Any]) -> tuple[Budget, Prepared]:
    ready = meshed(scene_from(raw))
    seen = error_monitor(ready)
    solver = steps_of(ready.scene, ready.model)
    for block in transient(ready.scene, ready.linkage, ready.path, ready.model, solver):
        seen.add(block)
    return budget(ready, seen, None), ready


def plate(outline: list[list[float]], model: str, size: float) -> Any:
    raw: dict[str, Any] = example("four_bar_solids", 60)
    raw["links"]["crank"]["shape"] = {"kind": "extrusion", "outline": outline, "thickness": 0.02}
    raw["links"]["crank"] |= {"model": model, "mesh": {"size": size}}
    return bare_link(scene_from(raw), "crank")


BLOCK = [[0.0, -0.05], [0.2, -0.05], [0.2, 0.05], [0.0, 0.05]]
ANGLE = [[0.0, -0.02], [0.3, -0.02], [0.3, 0.02], [0.1, 0.02], [0.1, 0.1], [0.0, 0.1]]


@pytest.mark.parametrize("model", ["plane", "solid"])
def test_the_indicator_is_the_error_of_the_mesh_in_the_energy_norm(model: str) -> None:
    """A bent field whose stress is known, interpolated: effectivity of Zienkiewicz and Zhu near 1, order 2."""
    found = []
    for size in (0.05, 0.025):
        link = plate(BLOCK, model, size)
        x, y = link.X[:, 0], link.X[:, 1]
        g = np.zeros((link.n, link.d))
        g[:, 0], g[:, 1] = -9 * y * np.cos(9 * x), np.sin(9 * x)
        fine = plate(BLOCK, model, 0.0125)
        energies = []
        for each in (link, fine):
            x, y = each.X[:, 0], each.X[:, 1]
            u = np.zeros((each.n, each.d))
            u[:, 0], u[:, 1] = -9 * y * np.cos(9 * x), np.sin(9 * x)
            energies.append(u.ravel() @ (each.K0 @ u.ravel()))
        true = np.sqrt(abs(energies[0] / energies[1] - 1))  # Pythagoras: interpolated energy is in excess
        found.append((indicator(link, g).eta, true))
    (coarse, _), (finer, true) = found
    assert 3.0 < coarse / finer < 5.0
    assert 0.3 < finer / true < 3.0


@pytest.mark.parametrize("model", ["plane", "solid"])
def test_an_edge_that_points_inwards_is_found_and_nothing_else(model: str) -> None:
    link = plate(ANGLE, model, 0.02)
    nodes = re_entrant(link)
    assert nodes.any()
    assert np.linalg.norm(link.X[nodes, :2] - [0.1, 0.02], axis=1).max() < 1e-9
    assert not re_entrant(plate(BLOCK, model, 0.05)).any()


def test_at_such_an_edge_nothing_is_claimed() -> None:
    found, _ = estimated(angled(SHARP, {"size": 0.01}))
    assert "stress of arm at an edge that points inwards without a fillet" in found.limits[0]
    assert estimated(angled(ROUND, {"size": 0.01}))[0].limits == ()


def test_plates_with_fillets_have_an_estimate_of_their_stress() -> None:
    found, _ = estimated(example("four_bar_solids", 120))
    assert found.limits == ()
    assert set(found.links) == {"crank", "coupler", "rocker"}
    assert all(0.001 < eta < 0.1 for eta in found.links.values())


def test_a_newcomers_four_bar_says_how_wrong_it_is() -> None:
    """One beam3 a link, 720 steps: 36 % of the deflection, 19 % of the stress are wrong at 60 rpm; told within 2."""
    raw = example("four_bar_beams", 720, revolutions=1.0)
    raw["drive"]["motion"]["speed"] = "60 rpm"
    found, ready = estimated(raw)
    fine: Any = example("four_bar_beams", 2880, {"element": "beam5", "mesh": {"elements": 3}}, revolutions=1.0)
    fine["drive"]["motion"]["speed"] = "60 rpm"
    true = by_kind(relative_errors(histories(ready), histories(meshed(scene_from(fine)))))
    assert true["displacement"] > 0.1
    mesh = found.of("mesh")
    assert mesh is not None
    for kind in ("displacement", "stress"):
        assert 0.5 < mesh.errors[kind] / true[kind] < 2.0
    (said,) = budget_warning(found)
    assert said.startswith("estimated error: displacement ")
    assert "most of it from the mesh: take finer elements" in said


@pytest.mark.parametrize("steps", [180, 720])
def test_the_steps_error_is_that_of_the_step(steps: int) -> None:
    ready = meshed(scene_from(example("four_bar_beams", steps, revolutions=1.0)))
    base = histories(ready)
    fine = histories(replace(ready, scene=with_steps(ready.scene, 16 * time_grid(ready.scene).steps)))
    true, told = relative_errors(base, fine), step_errors(ready, base)[0]
    assert_allclose([told[name] for name in true], list(true.values()), rtol=0.5 if steps == 180 else 0.35)


def latched(step: float, stop: dict[str, float]) -> Prepared:
    """A panel that a spring unfolds slowly, until a stop holds it."""
    section = {"kind": "rectangle", "width": 0.02, "thickness": 0.3}
    shape = {"kind": "polyline", "points": [[0, 0, 0], [0, 0.8, 0]], "section": section}
    hinge = {"kind": "revolute", "links": ["panel", "ground"], "at": [0, 0, 0]}
    spring = {"kind": "torsion", "joint": "A", "stiffness": 0.7, "damping": 2.0, "free_angle": -2.6}
    raw = {
        "links": {"panel": {"model": "beam", "material": "aluminium", "shape": shape, "mesh": {"elements": 4}}},
        "joints": {"A": hinge}, "springs": {"deploy": spring}, "damping": {"beta": 1e-2},
        "limits": {"latch": {"kind": "angle", "joint": "A", "lower": -1.0, **stop}},
        "analysis": {"end_time": 3.0, "step": step, "initial": "quasi-static", "accuracy": "quick"},
        "output": {"probes": {"root": {"link": "panel", "at": [0, 0, 0], "quantity": "stress"}}},
    }  # fmt: skip
    return meshed(scene_from(raw))


@pytest.mark.parametrize(
    ("stop", "most"), [({"stiffness": 100.0, "damping": 30.0}, 5.0), ({"stiffness": 1e4}, 1.3)], ids=["damped", "stiff"]
)
def test_the_steps_error_knows_stops_that_are_met_between_their_times(stop: dict[str, float], most: float) -> None:
    """Of 0.5 to 1.4 and 2.7 to 5.2 % of the stress, jolts that steps twice as long pass over count in full; a damper's
    push that was turned as drawn made such jolts itself, of 140 to 250 %."""
    fine = histories(latched(2e-4, stop))
    for step in (5e-3, 6e-3, 7e-3):
        ready = latched(step, stop)
        base = histories(ready)
        true, told = relative_errors(base, fine), step_errors(ready, base)[0]
        assert 0.002 < true["probes/root/stress"] < 0.06
        assert 0.8 < told["probes/root/stress"] / true["probes/root/stress"] < most


def test_what_jumps_with_a_load_is_no_jolt() -> None:
    """Exact in both marches; with limits, which might be what jumps, half of it is told."""
    t = np.linspace(0.0, 1.0, 41)
    channel = Channel("joints/A/force", ("x",), "N", "", "")

    def recorded(every: int) -> Histories:
        return Histories(t[::every], {channel.name: (channel, np.where(t > 0.5, 1.0, 0.0)[::every, None])})

    alike = recorded(1), recorded(2)
    assert single_errors(*alike, stops=False)[0] == {channel.name: 0.0}
    assert single_errors(*alike, stops=True)[0] == {channel.name: 0.5}


def test_stiffer_by_its_mesh_is_softened_by_its_indicator() -> None:
    """Quadrilaterals of a four-bar, four along a link: the softened run shows what elements a quarter as long change."""
    links = {"model": "plane", "mesh": {"elements": [4, 1]}}
    raw = example("four_bar_beams", 360, links, revolutions=0.5)
    raw["drive"]["motion"]["speed"] = "60 rpm"
    found, ready = estimated(raw)
    raw["links"] = {name: {**link, "mesh": {"elements": [16, 2]}} for name, link in raw["links"].items()}
    true = by_kind(relative_errors(histories(ready), histories(meshed(scene_from(raw)))))
    mesh = found.of("mesh")
    assert mesh is not None
    for kind in ("displacement", "stress"):
        assert 1 / 3 < mesh.errors[kind] / true[kind] < 3.0


def test_what_is_too_large_for_a_run_beside_it_has_plain_estimates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(estimates, "LARGE", 10)
    found, _ = estimated(example("four_bar_beams", 60, {"model": "plane"}))
    assert {share.source for share in found.shares} == {"mesh", "step", "frames"}
    assert found.together["stress"] > found.together["displacement"] > 0.0


def lost(mesh: float = 1.93, step: float = 1.02) -> Budget:
    """Of a lift that fell through its floor: marches with other elements and other steps differ from it altogether."""
    parts = {"mesh": mesh, "step": step}
    return Budget(tuple(Share(source, {"joint forces": x, "drive": 0.3 * x}) for source, x in parts.items()))


def test_beyond_all_scale_no_part_is_blamed() -> None:
    (said,) = budget_warning(lost(), 0.01)
    assert "mesh over 100 % and step over 100 %" in said
    assert "most of it" not in said
    assert "take finer elements" not in said
    assert "most of it from the mesh" in budget_warning(lost(step=0.01), 0.01)[0]
    assert "most of it from the step" in budget_warning(lost(mesh=0.4, step=0.5), 0.01)[0]


def test_a_run_with_errors_over_its_results_is_unreliable_in_its_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("kedfem.analysis.budget", lambda *given: lost())
    raw = example("four_bar_beams", 60, revolutions=0.1)
    run = analyse(scene_from(raw, tmp_path))
    stored = read_results(run.folder / "results.h5")
    assert stored.status == run.results.status == "unreliable"
    assert stored.reason == "estimated error of joint forces over 100 %"
    assert meaningless(lost(mesh=0.6, step=0.39), None, 0.0) == ""
    assert meaningless(lost(mesh=0.02, step=2.0), None, 0.0) == ""  # a phase
    assert meaningless(lost(mesh=0.02, step=3.1), None, 0.0) != ""


def pressed(**analysis: Any) -> Any:
    """A crank that lifts a weight which comes at 36° to 38° of its turn: between two of the positions, 5° apart."""
    return {
        "links": {"crank": bar("beam", (0, 0), (0.1, 0), 1)},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 0.1}},
        "loads": {"weight": {
            "kind": "force", "link": "crank", "at": [0.1, 0], "vector": [0, -1000.0],
            "factor": {"over": "angle", "at": ["36 deg", "38 deg"], "value": [0, 1]},
        }},
        "analysis": {"kind": "quasi-static", "revolutions": 0.25, **analysis},
        "output": {"probes": {"tip": {"link": "crank", "at": [0.1, 0], "quantity": "displacement"}}},
    }  # fmt: skip


def test_what_is_missed_between_positions_is_part_of_the_error() -> None:
    """The torque F r cos φ is highest where all the weight has come, at 38°; the position after that is at 40°."""
    least = np.cos(np.radians(38)) / np.cos(np.radians(40)) - 1  # 2.9 %
    found = estimated(pressed())[0].error_of("positions")
    assert found is not None
    assert least < found < 2 * least
    assert estimated(pressed(steps_per_revolution=72))[0].of("positions") is None  # asked for as they are


@pytest.mark.long
def test_meshes_are_compared_in_as_few_positions_as_show_the_largest_values() -> None:
    """Every third of 73 positions of a four-bar shows the error of its elements; a load within 2° takes all."""
    raw = example("four_bar_beams", 72, {"mesh": {"elements": 1}}, revolutions=1.0, kind="quasi-static")
    del raw["analysis"]["initial"]
    ready = meshed(scene_from(raw))
    base = histories(ready)
    scene, some = fewer_positions(ready.scene, base)
    assert_allclose(some.time, np.linspace(0.0, base.time[-1], 25), rtol=1e-12)
    assert time_grid(scene).steps == 24
    few, every = (by_kind(mesh_errors(*each, {})) for each in ((replace(ready, scene=scene), some), (ready, base)))
    assert min(every.values()) > 1e-4
    assert_allclose([few[kind] for kind in every], list(every.values()), rtol=0.25)
    channel = Channel("joints/A/force", ("x",), "N", "", "")
    brief = replace(base, channels={channel.name: (channel, np.eye(73)[50][:, None])})
    assert fewer_positions(ready.scene, brief) == (ready.scene, brief)


def test_a_smooth_curve_between_positions_is_missed_by_an_eighth_of_its_second_difference() -> None:
    """Of sin φ at most 1 − cos(h/2), where its crest lies in the middle between two positions."""
    h = np.radians(5)
    crest = np.sin(np.pi / 2 + h * (np.arange(20) - 9.5))
    assert_allclose(missed(crest), 1 - np.cos(h / 2), rtol=2e-2)  # rows up to 12.5° off the crest
    assert missed(np.array([0.0] * 3 + [1.0] * 4)) == 0.0


def test_a_step_that_the_accuracy_chose_is_not_told_to_be_left_out() -> None:
    found = Budget((Share("step", {"drive": 0.1}),))
    (stated,), (left_open,) = (budget_warning(found, 0.01, chosen) for chosen in (False, True))
    assert "leave it out so that analysis.accuracy chooses it" in stated
    assert "leave it out" not in left_open
    assert "analysis.accuracy chose it" in left_open
    assert found.error_of("step") == 0.1
    assert found.error_of("mesh") is None


def test_kinds_sums_and_warnings_of_a_budget() -> None:
    shares = Share("mesh", {"stress": 0.03}), Share("step", {"stress": 0.01, "drive": 0.002})
    found = Budget(shares)
    assert found.together == {"stress": pytest.approx(0.04), "drive": 0.002}
    assert found.limiting is shares[0]
    assert budget_warning(found) == ()
    assert "stress 4 %" in budget_warning(found, asked=0.01)[0]
    assert "drive" not in budget_warning(found, asked=0.01)[0]
    worse = Budget((Share("frames", {"drive": 0.2}, remedy="stiffer links"),))
    assert budget_warning(worse) == ("estimated error: drive 20 %; most of it from the frames: stiffer links",)
    empty = Histories(np.zeros(1), {})
    assert relative_errors(empty, empty) == {}


@pytest.mark.long
@pytest.mark.parametrize("name", ["plate_with_chamfered_bores", "pipe_tee"])
def test_the_indicator_is_between_half_and_twice_the_error_of_parts(name: str, tmp_path: Path) -> None:
    """Swept hexahedra and tetrahedra; the other parts are in docs/performance/indicator.md."""
    found = judged(name, tmp_path)
    assert 0.02 < found.true < 0.12
    assert 0.5 < found.effectivity < 2.0


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_long_run_of_a_small_model_is_judged_as_a_whole(monkeypatch: pytest.MonkeyPatch, frames: str) -> None:
    """A press is idle for most of its turn: its beginning shows nothing of the stroke."""
    ready = meshed(scene_from(example("four_bar_beams", 60, revolutions=200.0, frames=frames)))
    steps = time_grid(ready.scene).steps
    assert steps > estimates.SPAN
    assert time_grid(estimates.beginning(ready.scene, ready.model)).steps == steps
    monkeypatch.setattr(estimates, "CHEAP", 7000.0 * ready.model.unknowns)
    assert time_grid(estimates.beginning(ready.scene, ready.model)).steps == 7000


def test_a_force_that_is_rounding_beside_moments_is_not_judged() -> None:
    """A cantilever under an end moment: what holds it exerts no force, and 1e-9 of M / L by rounding."""
    shape = {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.05, "thickness": 0.05}
    found = histories(
        meshed(
            scene_from(
                {
                    "links": {"arm": {"model": "beam", "material": "steel", "mesh": {"elements": 4}, "shape": shape}},
                    "joints": {"W": {"kind": "weld", "links": ["ground", "arm"], "at": [0, 0]}},
                    "loads": {"M": {"kind": "torque", "link": "arm", "at": [1, 0], "vector": [0, 0, 1e5]}},
                    "analysis": {"kind": "static", "accuracy": "quick"},
                    "output": {"probes": {"tip": {"link": "arm", "at": [1, 0], "quantity": "travel"}}},
                }
            )
        )
    )
    assert set(counted(found)) == {"probes/tip/travel"}
