"""Natural frequencies have the meshes that their modes need, where these are left open; else their errors are told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.frequencies import Wanted, frequencies, link_of_scene, part_frequencies
from kedfem.scene import scene_from

LENGTH, HEIGHT = 0.5, 0.01
#: roots of tan x = tanh x: a beam hinged at one end and free at the other
ROOTS = np.array([3.926602, 7.068583, 10.210176, 13.351769])
EXACT = ROOTS**2 / (2 * np.pi * LENGTH**2) * np.sqrt(2.1e11 * HEIGHT**2 / 12 / 7850)
SPATIAL = {"x": ([1, 0, 0], [0, 0, 1]), "y": ([0, 1, 0], [1, 0, 0]), "oblique": ([2, -1, 2], [-2, 2, 3])}


def hanging(link: dict[str, Any], along: list[float], axis: list[float] | str, **analysis: Any) -> dict[str, Any]:
    """A steel bar on a hinge."""
    end = (LENGTH * np.array(along) / np.linalg.norm(along)).tolist()
    shape = {"kind": "bar", "between": [[0, 0, 0], end], "width": HEIGHT, "thickness": HEIGHT}
    steel = {"density": 7850, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}
    return {
        "materials": {"steel": steel},
        "links": {"arm": {"material": "steel", "shape": shape, **link}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": axis}},
        "analysis": {"end_time": 0.1, "step": 1e-3, **analysis},
    }


def bending(raw: dict[str, Any], folder: Path, count: int) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    found = frequencies(scene_from(raw, folder), Wanted(modes=count, positions=1), folder / "out")
    return found.values[0], found.errors, found.warnings


@pytest.mark.parametrize("model", ["beam", "plane"])
def test_meshes_that_are_left_open_resolve_all_modes(model: str, tmp_path: Path) -> None:
    got, errors, warnings = bending(hanging({"model": model}, [1, 0, 0], "z"), tmp_path, 4)
    assert_allclose(got, EXACT, rtol=0.015)  # 1 % asked; shear and rotary inertia take up to 0.4 %
    assert errors.max() <= 0.01
    assert not warnings


@pytest.mark.parametrize("axis", SPATIAL)
@pytest.mark.parametrize("model", ["beam", pytest.param("solid", marks=pytest.mark.long)])
def test_so_do_they_in_space(model: str, axis: str, tmp_path: Path) -> None:
    """Bending about the hinge and, of the same square section, across it, where the root is clamped."""
    along, about = SPATIAL[axis]
    link = {"model": model, **({"beam": "spatial"} if model == "beam" else {})}
    got, errors, warnings = bending(hanging(link, along, about), tmp_path, 4)
    clamped = np.array([1.875104, 4.694091]) ** 2 / ROOTS[0] ** 2 * EXACT[0]
    assert_allclose(got, np.sort([*clamped, *EXACT[:2]]), rtol=0.015)
    assert errors.max() <= 0.01
    assert not warnings


@pytest.mark.parametrize("elements", [1, 2, 4])
def test_errors_of_a_stated_mesh_are_told(elements: int, tmp_path: Path) -> None:
    raw = hanging({"model": "beam", "mesh": {"elements": elements}}, [1, 0, 0], "z")
    got, errors, warnings = bending(raw, tmp_path, 3)
    true = got[: len(errors)] / EXACT[: len(errors)] - 1
    resolved = np.flatnonzero((true < 0.3) & (true > 0.01))
    assert len(resolved)
    assert (errors[resolved] > true[resolved] - 0.003).all()
    assert (errors[resolved] < 3 * true[resolved]).all()
    (told,) = warnings
    assert told.startswith("frequencies: meshes must be fine enough for 1 %")
    modes = ", ".join(str(k + 1) for k in np.flatnonzero(errors > 0.01))
    remedy = "leave links.NAME.mesh out, or make it finer, or ask for fewer --modes"
    assert told.endswith(f"(modes {modes}): {remedy}")


def test_plain_defaults_are_kept_and_their_errors_told(tmp_path: Path) -> None:
    raw = hanging({"model": "beam"}, [1, 0, 0], "z", accuracy="quick")
    got, errors, (told,) = bending(raw, tmp_path, 2)
    assert got[1] > 2 * EXACT[1]
    assert errors[1] > 0.5
    assert 'leave analysis.accuracy = "quick" out' in told


def test_a_link_that_a_motion_lets_be_rigid_vibrates(tmp_path: Path) -> None:
    got, *_ = bending(hanging({}, [1, 0, 0], "z"), tmp_path, 2)
    clamped = (1.875104 / ROOTS[0]) ** 2 * EXACT[0]
    assert_allclose(got, [clamped, EXACT[0]], rtol=0.015)


def test_a_single_link_is_resolved_too(tmp_path: Path) -> None:
    found = part_frequencies(
        link_of_scene(scene_from(hanging({"model": "beam"}, [1, 0, 0], "z"), tmp_path), "arm", ["A"]), 4
    )
    assert_allclose(found.values, EXACT, rtol=0.015)
    assert found.errors.max() <= 0.01
    assert not found.warnings


def test_rigid_links_alone_have_no_such_error(tmp_path: Path) -> None:
    raw = hanging({"model": "rigid"}, [1, 0, 0], "z")
    ends = [{"link": "arm", "at": [LENGTH, 0, 0]}, {"link": "ground", "at": [LENGTH, 0.3, 0]}]
    raw["springs"] = {"s": {"kind": "spring", "between": ends, "stiffness": 2000.0}}
    got, errors, warnings = bending(raw, tmp_path, 1)
    mass = 7850 * HEIGHT**2 * LENGTH
    inertia = mass * (LENGTH**2 / 3 + HEIGHT**2 / 12)
    assert_allclose(got, [np.sqrt(2000 * LENGTH**2 / inertia) / (2 * np.pi)], rtol=1e-6)
    assert not len(errors)
    assert not warnings
