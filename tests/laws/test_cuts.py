"""Cuts between segments: stress goes through them as through the whole link, whatever their facets are."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from numpy.testing import assert_allclose

from kedfem.accuracy.plan import plan_for
from kedfem.analysis import Run, analyse
from kedfem.links.surfaces.coupling_surfaces import is_flat, joint_surface
from kedfem.scene import scene_from
from tests.laws.test_limits import AXES
from tests.laws.test_positions import across
from tests.rooms.cad_files import written
from tests.verification.concentrations import bored_bar, meshed, shaft

LENGTH, PULL = 0.1, 1e6
VON_MISES = "highest von Mises stress [Pa]"


def pulled(file: Path, along: np.ndarray, segments: int, at: np.ndarray, **link: Any) -> tuple[Run, Any]:
    """A part whose end is welded to the ground and whose other end is pulled by 1 MPa: the run, its highest stresses."""
    end = at + LENGTH * along
    part = {"material": "steel", "segments": segments, "shape": {"kind": "cad", "file": str(file)}, **link}
    run = analyse(scene_from({
        "links": {"bar": part},
        "joints": {"W": {"kind": "weld", "links": ["ground", "bar"], "at": at.tolist()}},
        "loads": {"pull": {"kind": "surface", "link": "bar", "at": end.tolist(), "vector": (PULL * along).tolist()}},
        "analysis": {"kind": "static", "accuracy": "quick"},
        "output": {"folder": str(file.with_suffix("")) + f"-{segments}", "plots": False, "picture": False},
    }))  # fmt: skip
    return run, pyvista.read(run.folder / "envelope.vtu")


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("element", ["tet10", "hex20"])
def test_a_uniform_tension_stays_uniform_through_cuts_of_any_facets(axis: str, element: str, tmp_path: Path) -> None:
    """Cuts through tetrahedra zigzag: what they bear is spread by the area of their facets across the link."""
    n = AXES[axis]
    other = across(n)
    R = np.column_stack([n, other, np.cross(n, other)])

    def prism(occ: Any) -> None:
        occ.affineTransform([(3, occ.addBox(0, -10, -6, 100, 20, 12))], [*np.column_stack([R, np.zeros(3)]).ravel()])

    written(tmp_path, "prism", prism, ("step",))
    _, got = pulled(tmp_path / "prism.step", n, 3, np.zeros(3), element=element, mesh={"size": "8 mm"})
    away = got.points @ n > 0.55 * LENGTH  # from the weld, which keeps the face's width
    assert_allclose(got[VON_MISES][away], PULL, rtol=1e-4)


@pytest.mark.parametrize("draw", [bored_bar, pytest.param(shaft, marks=pytest.mark.long)])
def test_a_peak_beside_a_cut_is_that_of_the_whole_link(draw: Any, tmp_path: Path) -> None:
    """Two segments, whose cut goes where the part is a prism; the weld holds the part's end and not a cut."""
    written(tmp_path, "part", draw, ("step",))
    at = np.array([0, 0, 0.002 if draw is bored_bar else 0.0])
    found = []
    for segments in (1, 2):
        run, got = pulled(tmp_path / "part.step", np.array([1.0, 0, 0]), segments, at)
        middle = np.abs(got.points[:, 0] - 0.05) < 0.03
        found.append(got[VON_MISES][middle].max())
        force = run.results.channels["joints/W/force"][1][0]
        moment = run.results.channels["joints/W/moment"][1][0]
        assert np.abs(moment).max() < 1e-6 * np.abs(force).max()
        assert not any("a cut" in warning for warning in run.warnings)
    assert_allclose(found[1], found[0], rtol=0.05)


@pytest.mark.parametrize("angle", [45, 30, 22.5, 15, 10, 7.5])
def test_a_weld_at_a_shafts_end_sits_there_however_fine_its_fillet_is(angle: float) -> None:
    """A ring of a fillet is at one distance from a point on the axis, too, but no ball about it."""
    link = meshed(shaft, None, fillet_angle=float(np.radians(angle)))
    for end in (0.0, 0.1):
        surface = joint_surface(link, "joints.W", np.array([end, 0, 0]), None)
        assert_allclose(surface.origin, [end, 0, 0], atol=1e-12)
        assert is_flat(surface)


@pytest.mark.parametrize(("accuracy", "angle"), [("quick", None), (0.2, 45.0), (0.05, 22.5), (0.02, 15.0)])
def test_an_accuracy_divides_fillets_of_parts_with_or_without_a_drive(
    accuracy: Any, angle: float | None, tmp_path: Path
) -> None:
    written(tmp_path, "part", bored_bar, ("step",))
    part = {"material": "steel", "model": "solid", "shape": {"kind": "cad", "file": "part.step"}}
    raw = {
        "links": {"bar": part},
        "joints": {"W": {"kind": "weld", "links": ["ground", "bar"], "at": [0, 0, 0.002]}},
        "analysis": {"kind": "static", "accuracy": accuracy},
    }
    plan = plan_for(scene_from(raw, tmp_path))
    if angle is None:
        assert plan is None
    else:
        assert plan is not None
        assert plan.scene.links["bar"].mesh.fillet_angle == pytest.approx(np.radians(angle))
    stated = {**raw, "links": {"bar": part | {"mesh": {"elements_across": 2}}}}
    assert plan_for(scene_from(stated, tmp_path)) is None


def test_a_peak_at_a_cut_through_a_bore_is_said_to_be_one(tmp_path: Path) -> None:
    """Of six segments some are cut where a bore is near: the stress there is not that of the bar."""
    written(tmp_path, "part", bored_bar, ("step",))
    run, _ = pulled(tmp_path / "part.step", np.array([1.0, 0, 0]), 6, np.array([0, 0, 0.002]))
    (said,) = [warning for warning in run.warnings if "highest stress" in warning]
    assert "at a cut between two segments where the link is no prism" in said
    assert "segments = 1" in said
