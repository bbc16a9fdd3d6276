"""Segments of links with co-rotational frames: reduced, chosen, told, stored and drawn."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from rich.console import Console

from kedfem.accuracy.geometric import GeometricError
from kedfem.accuracy.histories import histories, relative_errors, worst
from kedfem.accuracy.plan import SEGMENTS, planned
from kedfem.accuracy.prepared import Prepared, meshed, training_motion
from kedfem.accuracy.reduction import prepared
from kedfem.analysis import analyse
from kedfem.dynamics.model import Model, segments
from kedfem.dynamics.modes.bases import bases
from kedfem.dynamics.modes.reduction import energy_sorted, excited, port_functions, static_parts
from kedfem.dynamics.reduced_model import restored_model, stored_model
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.recovery import stress_recovery
from kedfem.output.frames import link_fields
from kedfem.scene import scene_from
from kedfem.tables import check_tables
from tests.laws.test_condensed_starts import UP, hanging
from tests.moving import snapshots
from tests.runs import quick

from .test_dynamics import four_bar


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", "off")


def bars(elements: int = 6, kind: str = "plane", **link: Any) -> dict[str, Any]:
    """[KED]'s four-bar (Nath and Ghosh 1980) of bars with co-rotational frames, from rest at 600 rpm."""
    raw = four_bar(
        "bar", revolutions=0.15, steps_per_revolution=600, rho_inf=0.95, frames="co-rotational", reduction_tolerance=0.02
    )
    mesh = {"plane": [elements, 1], "solid": [elements, 1, 1], "beam": elements}[kind]
    for each in raw["links"].values():
        each |= {"model": kind, "mesh": {"elements": mesh}, **link}
    return raw


def ready(raw: dict[str, Any]) -> Prepared:
    return prepared(scene_from(raw))[0]


# -- reduced ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["plane", pytest.param("solid", marks=pytest.mark.long)])
def test_reduced_segments_keep_to_their_tolerance(kind: str) -> None:
    raw = bars(kind=kind, segments=3)
    full = histories(meshed(scene_from(raw)))
    for link in raw["links"].values():
        link["reduction"] = "modal"
    small, found = prepared(scene_from(raw))
    assert found is not None
    assert worst(found.estimate) <= found.tolerance == 0.02
    assert all(link.Q is not None and link.fit is not None for link in small.model.links)
    assert small.model.unknowns < 0.8 * meshed(scene_from(raw)).model.unknowns
    errors = relative_errors(histories(small), full)
    assert worst(errors) <= 0.02
    assert worst(errors) > 1e-6  # they are reduced


def test_the_number_of_functions_is_that_of_each_segment() -> None:
    model = ready(bars(segments=3, reduction=9)).model
    assert [link.n for link in model.links] == 9 * [9]


def test_beams_with_frames_that_follow_stay_in_full() -> None:
    raw = bars(2, "beam", reduction="modal")
    small, found = prepared(scene_from(raw))
    assert found is not None
    assert found.estimate == {}
    assert [link.full for link in small.model.links] == 6 * [None]


@pytest.mark.long
@pytest.mark.parametrize(
    ("driven", "segments", "analysis"),
    [
        (False, 1, {"kind": "static"}),
        (False, 2, {"initial": "rest", "end_time": 0.1}),
        (True, 2, {"initial": "quasi-static"}),
    ],
)
def test_reduced_links_move_freely_as_unreduced_ones(driven: bool, segments: int, analysis: dict[str, Any]) -> None:
    """An arm sinks on its spring, and is lifted by it: within the estimate, and as by the monolithic solver."""
    raw = hanging("oblique", segments, driven)
    tip, up = np.array(raw["loads"].pop("push")["at"]), np.array(UP["oblique"])
    raw["springs"]["up"].pop("preload")
    raw["links"]["arm"]["mesh"] = {"elements": [6, 2, 2]}
    probes = {"tip": (tip, "travel"), "middle": (0.5 * tip + 0.015 * up, "stress")}
    raw["output"] = {"probes": {k: {"link": "arm", "at": at.tolist(), "quantity": q} for k, (at, q) in probes.items()}}
    raw["analysis"] |= analysis | {"reduction_tolerance": 0.02}
    if "kind" in analysis:
        raw["analysis"].pop("rho_inf")
    full = histories(meshed(scene_from(raw)))
    raw["links"]["arm"]["reduction"] = "modal"
    small, found = prepared(scene_from(raw))
    assert found is not None
    assert small.model.unknowns < 0.5 * meshed(scene_from(raw)).model.unknowns
    errors = relative_errors(histories(small), full)
    assert worst(errors) <= max(0.02, worst(found.estimate))
    assert errors["probes/tip/travel"] < 2e-3
    if "kind" not in analysis:
        whole = small.scene.model_copy(
            update={"analysis": small.scene.analysis.model_copy(update={"solver": "monolithic"})}
        )
        assert worst(relative_errors(histories(replace(small, scene=whole)), histories(small))) < 1e-4


def test_functions_go_by_what_their_loss_costs() -> None:
    """As many functions sorted by their own energy leave out far more of the deflections' energy."""
    full = ready(bars(segments=3, kind="solid"))
    parts, motion = static_parts(full.model), training_motion(full)
    found = bases(full.model, motion, parts)
    for k in (1, 4, 7):  # between two cuts
        link = full.model.links[k]
        seen = excited(full.model, parts, motion)[k]
        old = energy_sorted(link, port_functions(link, full.model.joints[k], parts[k]), seen)
        assert found[k] is not None
        few = left_out(link, found[k].first(12), seen)
        assert few < 0.02
        assert few < 0.2 * left_out(link, old.first(12), seen)
        # the weights show what is left out, but for answers to port forces and to turns that count besides
        assert few <= 1.5 * np.sqrt((found[k].weights[12 - found[k].needed.shape[1] :] ** 2).sum())


def left_out(link: Link, Q: np.ndarray, deflections: list[np.ndarray]) -> float:
    """What functions leave out of deflections, of their strain-energy norm."""
    T = np.kron(Q / np.abs(Q).max(axis=0), np.eye(link.d))
    X = np.stack([x.ravel() for x in deflections], axis=1)
    KT = np.asarray(link.K0 @ T)
    rest = X - T @ (np.linalg.pinv(T.T @ KT, rcond=1e-12, hermitian=True) @ (KT.T @ X))
    return float(np.sqrt(np.vdot(rest, link.K0 @ rest) / np.vdot(X, link.K0 @ X)))


# -- their number -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("elements", "count"), [(8, 6), (6, 6), (4, 4), (1, 1)])
def test_six_segments_or_as_many_as_the_mesh_has(elements: int, count: int) -> None:
    model = ready(bars(elements)).model
    assert {name: len(parts) for name, parts in segments(model).items()} == {
        "crank": count, "coupler": count, "rocker": count,
    }  # fmt: skip


def test_more_segments_than_layers_are_refused_where_they_are_asked_for() -> None:
    with pytest.raises(MeshError, match=r"links\.crank\.segments: must be at most 4 for this mesh.*got 5"):
        ready(bars(4, segments=5))


@pytest.mark.long
def test_an_accuracy_chooses_segments_that_its_share_allows() -> None:
    raw = bars(24)
    raw["analysis"] = {"revolutions": 0.1, "frames": "co-rotational", "accuracy": 0.03}
    plan = planned(scene_from(raw))
    share = next(each for each in plan.shares if each.what == "segments")
    chosen = {link.segments for link in plan.scene.links.values()}
    assert len(chosen) == 1
    assert 0.0 < share.error <= share.allowed == pytest.approx(SEGMENTS * 0.03)
    count = chosen.pop()
    assert count is not None
    assert 3 < count < 24
    # the same scene with as many segments as elements differs by no more
    finer = bars(24, segments=24)
    coarse = bars(24, segments=count)
    for each in (coarse, finer):
        each["analysis"] = {"revolutions": 0.1, "step": 0.1 / 10 / 60, "frames": "co-rotational"}
    errors = relative_errors(*(histories(meshed(scene_from(each))) for each in (coarse, finer)))
    assert worst(errors) <= 1.2 * share.error


def stubby(folder: Path, **link: Any) -> dict[str, Any]:
    """A plate little longer than it is wide that a drive turns, with a force across it at its end."""
    shape = {"kind": "bar", "between": [[0, 0], [0.1, 0]], "width": 0.08, "thickness": 0.01}
    soft = {"youngs_modulus": 2e8, "poisson_ratio": 0.3, "density": 2000}
    probe = {"link": "arm", "at": [0.05, 0], "quantity": "displacement"}
    return {
        "materials": {"soft": soft},
        "links": {"arm": {"material": "soft", "model": "plane", "frames": "co-rotational", "shape": shape, **link}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "300 rpm"}},
        "loads": {"P": {"kind": "force", "link": "arm", "at": [0.1, 0], "vector": [0, 400], "frame": "link"}},
        "analysis": {"kind": "quasi-static", "steps_per_revolution": 4, "accuracy": 0.02},
        "output": {"folder": str(folder), "plots": False, "picture": False, "animation": False, "probes": {"P": probe}},
    }  # fmt: skip


def test_an_accuracy_cuts_no_stubby_link_into_softer_slices(tmp_path: Path) -> None:
    """Ever thinner slices let go of ever more: trials of more segments would never settle."""
    found = []
    for given, folder in (({}, "open"), ({"segments": 1}, "one")):
        run = analyse(scene_from(stubby(tmp_path / folder, **given)))
        assert run.results.notes["segments of arm"] == 1
        found.append(np.abs(run.results.channels["probes/P/displacement"][1]).max())
    assert found[0] == pytest.approx(found[1], rel=1e-9)


def test_slices_shorter_than_their_link_is_wide_are_told(tmp_path: Path) -> None:
    run = analyse(scene_from(stubby(tmp_path / "12", segments=12, mesh={"elements": [12, 8]})))
    assert any("links arm (12 segments: at most 1)" in warning for warning in run.warnings)


# -- told, stored, drawn ------------------------------------------------------------------------------------


def test_a_link_is_one_row_with_its_number_of_segments(capsys: pytest.CaptureFixture[str]) -> None:
    found = ready(bars(segments=3, reduction=9))
    table = check_tables(found, None, None)[0]
    assert table.row_count == 3
    Console(width=200).print(table)
    shown = capsys.readouterr().out
    assert shown.count("quad9, 3 co-rotational segments, 9 modes each") == 3
    mass = 2796 * 0.0254**2 * 0.9144
    assert f"{mass:.4g} kg" in shown  # of the coupler as a whole


def test_a_run_tells_segments_and_draws_links(tmp_path: Path) -> None:
    raw = bars(4)
    raw["output"] = {"folder": str(tmp_path / "out"), "plots": False, "picture": False,
                     "animation": {"frames_per_revolution": 10}}  # fmt: skip
    raw["analysis"] |= {"revolutions": 0.1}
    done = analyse(scene_from(quick(raw)))
    assert done.results.notes["segments of coupler"] == 4
    assert done.budget is not None
    assert done.budget.of("frames") is None
    assert done.results.notes["error together, joint forces"] == done.budget.together["joint forces"]
    text = (tmp_path / "out" / "animation.pvd").read_text(encoding="utf-8")
    assert text.count('name="coupler" file="animation/coupler_0001.vtu"') == 1


def test_segments_are_drawn_as_one_link_that_holds_together() -> None:
    found = ready(bars(4))
    model = found.model
    recoveries = [stress_recovery(link) for link in model.links]
    *_, last = snapshots(found.scene, found.linkage, found.path, model, steps_of(found.scene, model))
    fields = link_fields(model, recoveries, last, 1.0)
    assert [field.name for field in fields] == ["crank", "coupler", "rocker"]
    for field in fields:
        assert len(field.cells) == 4
        assert sorted(set(field.cells.ravel())) == list(range(len(field.points)))
        gaps = np.linalg.norm(field.points[:, None] - field.points, axis=2)
        own = np.repeat(np.arange(4), len(field.points) // 4)
        for a in range(3):
            # the fit of a cut leaves its nodes apart by what they warp: far less than they move, 2 % of the length
            nearest = np.sort(gaps[np.ix_(own == a, own == a + 1)].min(axis=1))[:3]
            assert nearest.max() < 2e-3 * 0.0254


def test_reduced_segments_are_the_same_from_a_file() -> None:
    model = ready(bars(segments=2, reduction=9)).model
    packed = stored_model(model)
    assert packed is not None
    again = restored_model(packed)
    assert isinstance(again, Model)
    for a, b in zip(model.links, again.links, strict=True):
        assert a.fit is not None
        assert b.fit is not None
        assert_array_equal(b.fit, a.fit)
        assert_array_equal(b.K0, a.K0)


def test_only_links_with_rigid_body_frames_have_a_geometric_error() -> None:
    raw = bars(3, segments=3)
    raw["links"]["rocker"] |= {"frames": "rigid-body"}
    raw["links"]["rocker"].pop("segments")
    found = ready(raw)
    error, alone = GeometricError(found.model), 0.0
    for block in transient(found.scene, found.linkage, found.path, found.model, steps_of(found.scene, found.model)):
        error.add(block)
        alone = max(alone, float(block.links[-1].strain.max()))
    assert found.model.links[-1].name == "rocker"
    assert error.estimate > 0.0
    assert_allclose(error.strain, alone, rtol=1e-12)


def test_a_mechanism_that_follows_everywhere_has_none() -> None:
    found = ready(bars(3, segments=3))
    error = GeometricError(found.model)
    for block in transient(found.scene, found.linkage, found.path, found.model, steps_of(found.scene, found.model)):
        error.add(block)
    assert (error.axial, error.strain, error.estimate) == (0.0, 0.0, 0.0)
