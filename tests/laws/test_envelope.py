"""The stress envelope is the maximum over all steps, for links of every kind, whatever the animation shows."""

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.reduction import prepared
from kedfem.analysis import Run, analyse
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.links.recovery import extreme_stresses, nodal_state, nodal_stress, stress_recovery, von_mises
from kedfem.links.singular_stress import influence_radius, re_entrant
from kedfem.output.fields import VON_MISES
from kedfem.results import read_results
from kedfem.results.stresses.envelope import EXACT, Envelope, leading
from kedfem.scene import scene_from
from tests.frames import frames
from tests.scenes import arm, bar, constant_speed, four_bar

KINDS: dict[str, dict[str, Any]] = {
    "beam": {"model": "beam", "mesh": {"elements": 4}},
    "beam5": {"model": "beam", "element": "beam5", "mesh": {"elements": 2}},
    "spatial": {"model": "beam", "beam": "spatial", "mesh": {"elements": 3}},
    "plane": {"model": "plane", "mesh": {"elements": [6, 1]}},
    "solid": {"mesh": {"elements": [6, 1, 1]}},
    "reduced": {"mesh": {"elements": [6, 1, 1]}, "reduction": 12},
}
SHAPE = {"kind": "bar", "width": 0.02, "thickness": 0.02}


def scene(kind: str, frames: str = "rigid-body", **output: Any) -> dict[str, Any]:
    """A four-bar from rest, so that every link vibrates; its crank rigid, carried by the drive."""
    raw = four_bar(
        (0.1, 0.3, 0.25, 0.3), {"material": "steel", "shape": SHAPE, **KINDS[kind]}, constant_speed("300 rpm"),
        damping={"ratio": 0.02, "frequencies": [50, 500]}, output={"plots": False, "picture": False, **output},
        analysis={"revolutions": 0.25, "steps_per_revolution": 400, "initial": "rest", "frames": frames},
    )  # fmt: skip
    if kind in {"solid", "beam"} and frames == "rigid-body":
        shape = raw["links"]["crank"]["shape"]
        raw["links"]["crank"] = {"material": "steel", "shape": shape, "model": "rigid", "mesh": {"elements": [1, 1, 1]}}
    return raw


@pytest.mark.parametrize(
    ("kind", "frames"),
    [*((kind, "rigid-body") for kind in KINDS), ("beam", "co-rotational"), ("spatial", "co-rotational"), ("solid",
    "co-rotational")],
)  # fmt: skip
def test_the_envelope_is_the_maximum_over_all_steps(kind: str, frames: str) -> None:
    """Against stresses of every step by the recovery that frames are drawn with, and eigenvalues by LAPACK."""
    ready, _ = prepared(scene_from(scene(kind, frames)))
    recoveries = [stress_recovery(link) for link in [*ready.model.links, *(x.link for x in ready.model.prescribed)]]
    envelope = Envelope(ready.model, recoveries)
    blocks = list(transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model)))
    for block in blocks:
        envelope.add(block)
    found = envelope.links()
    top = max(each.stress[0].max() for each in found if not np.isnan(each.stress).any())
    every = zip(ready.model.links, recoveries, found, strict=False)
    for k, (link, recovery, each) in enumerate(every):
        g = np.concatenate([block.links[k].g for block in blocks])
        stress = np.stack([nodal_stress(recovery, nodal_state(link, x)) for x in g])  # (T, p, 6)
        brute = np.stack([von_mises(x) for x in stress])
        assert_allclose(each.stress[0], brute.max(axis=0), atol=10 * EXACT * top)
        at_that_step = np.take_along_axis(brute, each.step[:1], axis=0)[0]
        assert_allclose(at_that_step, each.stress[0], atol=10 * EXACT * top)
        xx, yy, zz, xy, yz, zx = np.moveaxis(stress, 2, 0)
        tensors = np.stack([xx, xy, zx, xy, yy, yz, zx, yz, zz], axis=-1).reshape(*xx.shape, 3, 3)
        principal = np.linalg.eigvalsh(tensors)[..., [0, 2]]
        of_frames = np.stack([extreme_stresses(recovery, nodal_state(link, x))[1] for x in g])
        if link.kind == "beam":  # its `stress` is that of the fibre of larger stress alone
            assert (of_frames[..., 0] <= principal[..., 0]).all()
            assert (of_frames[..., 1] >= principal[..., 1]).all()
        else:
            assert_allclose(of_frames, principal, atol=10 * EXACT * top)
        assert_allclose(each.stress[1], of_frames[..., 1].max(axis=0), atol=10 * EXACT * top)
        assert_allclose(each.stress[2], of_frames[..., 0].min(axis=0), atol=10 * EXACT * top)
    assert all(np.isnan(each.stress).all() for each in found[len(ready.model.links) :])
    assert envelope.evaluated <= envelope.examined < 0.95 * len(g) * sum(each.stressed for each in recoveries)


def test_leading_modes_tell_where_there_is_no_extreme() -> None:
    """At most points and times a few modes and a bound of the others do; turned modes make the same stress."""
    rng = np.random.default_rng(7)
    size = 10.0 ** -np.arange(8)
    C, parts = rng.normal(size=(500, 8)) * size, rng.normal(size=(30, 6, 8))
    turned, stresses, head = leading(C, parts)
    assert 2 <= head <= 5
    assert_allclose(stresses @ turned.T, parts @ C.T, atol=1e-13 * np.abs(parts @ C.T).max())
    few, same, _ = leading(C[:3], parts)  # fewer steps than modes
    assert_allclose(same @ few.T, parts @ C[:3].T, atol=1e-13 * np.abs(parts @ C.T).max())
    ready, _ = prepared(scene_from(scene("reduced")))
    recoveries = [stress_recovery(link) for link in ready.model.links]
    envelope = Envelope(ready.model, recoveries)
    for block in transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model)):
        envelope.add(block)
    envelope.flush()
    assert envelope.evaluated < 0.6 * envelope.examined


def ran(folder: Path, kind: str, animation: Any) -> Run:
    return analyse(scene_from(scene(kind, folder=str(folder), animation=animation)))


def test_no_animation_changes_the_highest_stress(tmp_path: Path) -> None:
    """Frames at every step, at a few and none: one peak, the maximum over the frames of all steps."""
    every, few, none = (
        ran(tmp_path / str(k), "solid", x)
        for k, x in enumerate(({"frames_per_revolution": 400}, {"frames_per_revolution": 6}, False))
    )
    assert every.peaks == few.peaks == none.peaks
    assert every.peak == few.peak == none.peak
    shown = frames(tmp_path / "0")
    assert len(shown) == 101
    highest = np.max([frame.point_data[VON_MISES] for frame in shown], axis=0)
    envelope = meshio.read(tmp_path / "2" / "envelope.vtu")
    found = envelope.point_data["highest von Mises stress [Pa]"]
    elastic = ~np.isnan(found)
    assert_allclose(found[elastic], highest[elastic], atol=10 * EXACT * np.nanmax(highest))
    assert none.peak is not None
    assert_allclose(none.peak.stress, np.nanmax(highest), rtol=10 * EXACT)
    assert set(none.peaks) == {"coupler", "rocker"}  # the crank is rigid
    worst = meshio.read(few.worst)
    assert_allclose(np.nanmax(worst.point_data[VON_MISES]), none.peak.stress, rtol=10 * EXACT)
    assert read_results(tmp_path / "2" / "results.h5").peaks == none.peaks


def angled(outline: list[Any], mesh: dict[str, Any]) -> dict[str, Any]:
    """An L of steel that bends at its inner corner (0.06, 0.02)."""
    shape = {"kind": "extrusion", "outline": outline, "holes": [{"at": [0, 0], "diameter": 0.012}], "thickness": 0.01}
    link = {"material": "steel", "shape": shape, "mesh": mesh}
    force = {"kind": "surface", "link": "arm", "at": [0.07, 0.12, 0.0], "vector": [1e6, 0, 0], "frame": "link"}
    return arm(
        link, constant_speed(1e-3), loads={"P": force},
        analysis={"end_time": 1e-3, "step": 5e-4, "initial": "quasi-static"},
    )  # fmt: skip


SHARP: list[Any] = [[-0.02, -0.02], [0.08, -0.02], [0.08, 0.12], [0.06, 0.12], [0.06, 0.02], [-0.02, 0.02]]
ROUND: list[Any] = [*SHARP[:4], [0.06, 0.035], {"via": [0.0556066, 0.0243934], "to": [0.045, 0.02]}, SHARP[5]]


@pytest.mark.parametrize("model", ["solid", "plane"])
def test_a_re_entrant_corner_is_found_and_a_round_one_is_not(model: str) -> None:
    for outline, corners in ((SHARP, 1), (ROUND, 0)):
        raw = angled(outline, {"size": 0.01})
        raw["links"]["arm"]["model"] = model
        link = prepared(scene_from(raw))[0].model.links[0]
        nodes = link.X[re_entrant(link)]
        assert bool(len(nodes)) == bool(corners)
        assert_allclose(nodes[:, :2], np.tile([0.06, 0.02], (len(nodes), 1)), atol=1e-9)
        # volume over surface of a plate, less than half its thickness by the edges
        assert 0.0025 < influence_radius(link) < 0.005


def test_a_peak_at_a_corner_says_so_and_what_is_highest_away_from_it(tmp_path: Path) -> None:
    """Refined, the corner's stress grows; away from it, at a distance that no mesh changes, it stays."""
    found = []
    for k, size in enumerate((0.01, 0.004)):
        raw = angled(SHARP, {"size": size})
        raw["output"] = {"folder": str(tmp_path / str(k)), "plots": False, "picture": False, "animation": False}
        found.append(analyse(scene_from(raw)))
    peaks = [run.peak for run in found]
    for run, peak in zip(found, peaks, strict=True):
        assert peak is not None
        assert peak.near == "a sharp re-entrant corner"
        assert peak.away is not None
        assert np.linalg.norm(np.subtract(peak.away.place, peak.place)) > 0.0025
        (said,) = [warning for warning in run.warnings if "highest stress" in warning]
        assert "grows when it is refined; away from corners" in said
        assert "MPa in link arm at (0.0" in said
        assert np.linalg.norm(np.subtract(peak.place[:2], (0.06, 0.02))) < 0.006
    assert peaks[1].stress > 1.15 * peaks[0].stress  # type: ignore[union-attr]
    assert_allclose(peaks[1].away.stress, peaks[0].away.stress, rtol=0.15)  # type: ignore[union-attr]


def test_a_point_force_is_no_place_to_read_a_stress(tmp_path: Path) -> None:
    force = {"kind": "force", "link": "arm", "at": [0.25, 0.01, 0.01], "vector": [0, -4e3, 0], "frame": "link"}
    raw = arm(
        bar(mesh={"elements": [12, 2, 2]}), constant_speed(1e-3), loads={"P": force},
        analysis={"end_time": 1e-3, "step": 5e-4, "initial": "quasi-static"},
        output={"folder": str(tmp_path), "plots": False, "picture": False, "animation": False},
    )  # fmt: skip
    peak = analyse(scene_from(raw)).peak
    assert peak is not None
    assert peak.near in {"the point force loads.P", "the surface of joint A"}
    assert peak.away is not None
    assert peak.away.stress < peak.stress
