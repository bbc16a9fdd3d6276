"""Damage by the stresses of runs: shafts and rods worked by hand, periods, what is left out or refused, files."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import Run, analyse
from kedfem.errors import OutputError, SceneError
from kedfem.links.free_surface import free_surface
from kedfem.links.recovery import stress_recovery
from kedfem.report.facts import fatigue_table
from kedfem.results import Fatigue, FatigueSpot, read_results
from kedfem.scene import scene_from
from tests.laws.test_corotational import segments
from tests.scenes import arm, bar, constant_speed, cycloidal

STEEL = {"group": "steel", "tensile_strength": "600 MPa"}
DATA = {"materials": {"steel": STEEL}}
QUIET = {"plots": False, "picture": False, "animation": False}
STRENGTH = 270e6 / (1 + 0.5 * (1 / (1 - 0.22 * np.log10(25) * np.log10(3)) - 1))  # σ_W / K_WK of `STEEL`
M = 0.35 * 0.6 - 0.1
AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "oblique": [0.6, -0.48, 0.64]}
LENGTH, RADIUS, FORCE, AXIAL = 0.4, 0.01, 400.0, 3e4


def shaft(along: Any, kind: str = "static", **fatigue: Any) -> dict[str, Any]:
    """A round shaft that turns about its own axis, held at one end, with a force across and one along at the other."""
    e = np.array(along) / np.linalg.norm(along)
    across = np.cross(e, np.eye(3)[np.abs(e).argmin()])
    across /= np.linalg.norm(across)
    tip = (LENGTH * e).tolist()
    shape = {"kind": "polyline", "points": [[0, 0, 0], tip], "section": {"kind": "round", "diameter": 2 * RADIUS}}
    link = {"material": "steel", "model": "beam", "shape": shape, "mesh": {"elements": 4}, "beam": "spatial"}
    force = (FORCE * across + AXIAL * e).tolist()
    return {
        "links": {"arm": link},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": e.tolist()}},
        "drive": {"joint": "A", "motion": constant_speed("1 rpm")},
        "loads": {"F": {"kind": "force", "link": "arm", "at": tip, "vector": force}},
        "analysis": {"kind": kind, "revolutions": 1, "steps_per_revolution": 24, "accuracy": "quick"},
        "fatigue": DATA | fatigue, "output": QUIET,
    }  # fmt: skip


def run(raw: Mapping[str, Any], folder: Path) -> Run:
    return analyse(scene_from(raw, folder))


def found(done: Run) -> Fatigue:
    assert done.results.fatigue is not None
    return done.results.fatigue


def worst(done: Run, link: str = "arm") -> FatigueSpot:
    return found(done).spots[link][0]


@pytest.mark.parametrize("along", AXES.values(), ids=AXES)
def test_turning_under_a_fixed_force_is_the_guidelines_life_by_hand(along: Any, tmp_path: Path) -> None:
    """Amplitude F L r / I at the root about the mean N / A: its equal with mean 0, damage, life, utilisation."""
    done = run(shaft(along, "quasi-static" if along == AXES["oblique"] else "static"), tmp_path)
    spot = worst(done)
    a = FORCE * LENGTH * RADIUS / (np.pi * RADIUS**4 / 4)
    m = AXIAL / (np.pi * RADIUS**2)
    assert_allclose([spot.amplitude, spot.mean], [a, m], rtol=4e-3)  # between places
    assert_allclose(np.linalg.norm(spot.place), RADIUS, rtol=1e-6)
    damage = ((spot.amplitude + M * spot.mean) / STRENGTH) ** 9 / 1e6  # below the bend: 2 k − 1
    assert a + M * m < STRENGTH
    assert_allclose(spot.damage, damage, rtol=1e-9)
    assert_allclose(found(done).hours(spot), 60 / 3600 / damage, rtol=1e-9)
    assert_allclose(found(done).cycles(spot), 1 / damage, rtol=1e-9)
    assert_allclose(spot.utilisation, 1.5 * (spot.amplitude + M * spot.mean) / STRENGTH, rtol=1e-9)
    assert (spot.criterion, spot.cycles, found(done).unreliable) == ("signed von Mises", 1, "")


def test_without_the_force_along_the_mean_is_none_and_a_required_life_counts(tmp_path: Path) -> None:
    raw = shaft(AXES["x"], required_life="100 h", safety_factor=1.0)
    raw["loads"]["F"]["vector"] = (4 * FORCE * np.array(raw["loads"]["F"]["vector"]) / FORCE * [0, 1, 1]).tolist()
    spot = worst(run(raw, tmp_path))
    assert abs(spot.mean) < 1e-6 * spot.amplitude
    assert_allclose(spot.damage, (spot.amplitude / STRENGTH) ** 5 / 1e6, rtol=1e-9)
    assert_allclose(spot.utilisation, spot.amplitude / STRENGTH / (1e6 / 6000) ** 0.2, rtol=1e-9)


def swung(**analysis: Any) -> dict[str, Any]:
    """A solid arm that turns under gravity, hardly damped."""
    link = bar(0.5, 0.02, 0.02, mesh={"elements": [6, 1, 1]})
    usual = {"revolutions": 2, "steps_per_revolution": 200, "accuracy": "quick"}
    return arm(
        link, constant_speed("300 rpm"), gravity=[0, -9.81], analysis=usual | analysis, fatigue=DATA,
        damping={"ratio": 0.05, "frequencies": [50, 500]},
        output=QUIET | {"csv": True},
    )  # fmt: skip


@pytest.fixture(scope="module")
def settled(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(swung(initial="quasi-static"), tmp_path_factory.mktemp("settled"))


def test_a_run_and_a_steady_motion_come_to_the_same(settled: Run, tmp_path: Path) -> None:
    raw = swung(kind="steady")
    del raw["analysis"]["revolutions"]
    steady = run(raw, tmp_path)
    assert not found(settled).unreliable
    assert found(steady).repeats < 1e-6
    assert_allclose(worst(settled).amplitude, worst(steady).amplitude, rtol=0.02)
    assert_allclose(worst(settled).mean, worst(steady).mean, rtol=0.02)


def test_a_motion_that_has_not_settled_is_unreliable_in_words(tmp_path: Path) -> None:
    done = run(swung(revolutions=2), tmp_path)
    assert found(done).repeats > 0.01
    assert "has not settled" in found(done).unreliable
    assert any("has not settled" in said for said in done.warnings)
    assert "UNRELIABLE" in fatigue_table(found(done)).note
    once = run(swung(initial="quasi-static", revolutions=1), tmp_path / "once")
    assert "one period only" in found(once).unreliable


def test_what_is_near_joints_is_left_out_unless_asked_for(settled: Run, tmp_path: Path) -> None:
    """The field is nan there, and inside; a warning says how many points."""
    grid = meshio.read(settled.folder / "fatigue.vtu")
    damage = grid.point_data["damage in a period"]
    left = found(settled).left_out["arm"]
    assert left > 0
    assert np.isnan(damage).sum() == left
    assert any(f"{left} of arm" in said for said in settled.warnings)
    raw = swung(initial="quasi-static")
    raw["fatigue"] = DATA | {"near_joints": True}
    whole = run(raw, tmp_path)
    assert found(whole).left_out["arm"] == 0
    assert_allclose(np.isnan(meshio.read(whole.folder / "fatigue.vtu").point_data["disproportion"]).sum(), 0)


def test_files_hold_what_was_found(settled: Run) -> None:
    """HDF5 read back, the field's worst point, both tables."""
    assert read_results(settled.folder / "results.h5").fatigue == found(settled)
    grid, spot = meshio.read(settled.folder / "fatigue.vtu"), worst(settled)
    damage = grid.point_data["damage in a period"]
    assert_allclose(np.nanmax(damage), spot.damage, rtol=2 * np.finfo(damage.dtype).eps)
    assert_allclose(grid.points[int(np.nanargmax(damage))], spot.place, atol=1e-9)
    lines = (settled.folder / "fatigue.csv").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 1 + len(found(settled).spots["arm"])
    assert lines[1].split(",")[:2] == ["arm", "1"]
    points = (settled.folder / "fatigue_points.csv").read_text(encoding="utf-8").splitlines()
    assert len(points) == 1 + len(damage)


@pytest.mark.parametrize("kind", ["solid", "tetrahedra"])
def test_cuts_between_segments_are_no_surface(kind: str) -> None:
    """Nodes and normals of the segments are those of the whole link, but where a cut meets the surface."""
    whole, cut = segments(kind)
    of = free_surface(stress_recovery(whole))
    known = {tuple(x.round(9)): axes[2] for x, axes in zip(whole.X[of.places], of.axes, strict=True)}
    seen = set()
    for part in cut.parts:
        some = free_surface(stress_recovery(part))
        for x, axes in zip(part.X[some.places], some.axes, strict=True):
            place = tuple(x.round(9))
            seen.add(place)
            assert known[place] @ axes[2] > 0.6
            assert_allclose(np.linalg.det(axes), 1.0, rtol=1e-12)
    assert seen == set(known)


def test_a_run_that_goes_on_finds_the_same_damage(settled: Run, tmp_path: Path) -> None:
    from kedfem.dynamics import rigid_body
    from kedfem.dynamics.stepping import solvers

    scene = scene_from(swung(initial="quasi-static"), tmp_path)

    def watch(stage: str, done: int, total: int) -> None:
        if stage == "steps" and total and done >= 0.7 * total:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        for module in (rigid_body, solvers):
            patch.setattr(module, "POINTS", 16)
        patch.setattr("kedfem.resume.SHARE", 0.0)
        with pytest.raises(KeyboardInterrupt):
            analyse(scene, watch, every=0.0)
        assert read_results(scene.results_folder / "results.h5").fatigue is None
        done = analyse(scene, resumes=True)
    for name in ("damage", "amplitude", "mean", "utilisation"):
        assert_allclose(getattr(worst(done), name), getattr(worst(settled), name), rtol=1e-6)


def refused(raw: Mapping[str, Any], folder: Path, *said: str) -> None:
    with pytest.raises(SceneError) as error:
        run(raw, folder)
    for each in said:
        assert each in str(error.value)
    assert not list(folder.rglob("*.h5"))


def test_what_has_no_period_is_refused_before_the_run(tmp_path: Path) -> None:
    once = arm(bar(), cycloidal(1.0, 0.1), analysis={"end_time": 0.1, "step": 1e-3}, fatigue=DATA)
    refused(once, tmp_path, "fatigue.period: is required [s]", "does not rotate continuously or return")
    refused(swung(revolutions=0.5), tmp_path, "fatigue: needs a whole period, 0.2 s, got an analysis of 0.1 s")
    load = {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, 1]}
    pulse = swung() | {"loads": {"p": load | {"factor": {"at": [0, 1], "value": [0, 1]}}}}
    refused(pulse, tmp_path, "loads.p.factor: must have a period with [fatigue]")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({}, "fatigue.links.arm: must have one of group, endurance_stress, strain_life, got none"),
        ({"group": "steel"}, "fatigue.links.arm.tensile_strength: is required with group"),
        ({"group": "steel", "tensile_strength": 6e7}, "tensile_strength: must be between 3e+08 and 2e+09 [Pa]"),
        ({"group": "wood"}, "fatigue.links.arm.group: must be "),
        ({"endurance_stress": 2e8, "slope": 0, "mean_stress_sensitivity": 0.2}, "arm.slope: must be positive, got 0"),
        ({"endurance_stress": 2e8, "mean_stress_sensitivity": 0.2}, "arm.slope: is required with endurance_stress"),
        ({"endurance_stress": 7e8, "tensile_strength": 6e8, "slope": 5, "mean_stress_sensitivity": 0.2},
         "arm.endurance_stress: must be below the tensile strength, 6e+08 [Pa], got 7e+08"),
        ({"endurance_stress": 2e8, "slope": 5, "slope_beyond": 3, "mean_stress_sensitivity": 0.2},
         "arm.slope_beyond: must be at least the slope above, 5, got 3"),
        ({"endurance_stress": 2e8, "slope": 5, "mean_stress_sensitivity": 1.5},
         "arm.mean_stress_sensitivity: must be at least 0 and below 1, got 1.5"),
    ],
)  # fmt: skip
def test_data_that_make_no_sense_are_refused(data: dict[str, Any], said: str) -> None:
    with pytest.raises(SceneError) as error:
        scene_from(swung() | {"fatigue": {"links": {"arm": data}}})
    assert said in str(error.value)


def test_links_without_stress_or_data_are_refused_or_told(tmp_path: Path) -> None:
    raw = swung() | {"fatigue": {"materials": {"brass": STEEL}}}
    with pytest.raises(SceneError, match="fatigue: must have data of an elastic link or of its material, got data of no"):
        scene_from(raw)
    raw["links"]["arm"]["model"] = "rigid"
    with pytest.raises(SceneError, match=r"got rigid links only"):
        scene_from(raw)
    raw["fatigue"] = {"links": {"arm": STEEL}}
    with pytest.raises(SceneError, match=r"fatigue\.links\.arm: must name an elastic link, got a rigid one"):
        scene_from(raw)


def test_a_missing_extra_is_named_before_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pylife", None)
    with pytest.raises(OutputError, match=r"fatigue: needs pylife, .* pip install 'kedfem\[fatigue\]'"):
        run(swung(), tmp_path)
    assert not list(tmp_path.iterdir())
