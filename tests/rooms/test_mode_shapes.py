"""Mode shapes as they are written: closed form of a free beam, a cycle of frames, what an earlier command left."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import SceneError
from kedfem.frequencies import Wanted, frequencies, link_of_scene, part_frequencies
from kedfem.output.fields import DISPLACEMENT, VON_MISES
from kedfem.output.shapes import AMPLITUDE, FRAMES
from kedfem.scene import scene_from
from tests.frames import frames
from tests.scenes import example

ROOT = 4.730040744862704  # cosh x cos x = 1: the first root of a free-free beam
SIGMA = 0.9825022145762380


def beams(elements: int = 8) -> dict[str, Any]:
    raw = example("four_bar_beams")
    for link in raw["links"].values():
        link["mesh"] = {"elements": elements}
    return raw


def free_beam(x: np.ndarray) -> np.ndarray:
    """First mode of a free-free Euler–Bernoulli beam of length 1, at its ends 1."""
    z = ROOT * x
    return np.asarray((np.cosh(z) + np.cos(z) - SIGMA * (np.sinh(z) + np.sin(z))) / 2)


def free_curvature(x: np.ndarray) -> np.ndarray:
    z = ROOT * x
    return np.asarray(ROOT**2 * (np.cosh(z) - np.cos(z) - SIGMA * (np.sinh(z) - np.sin(z))) / 2)


def test_the_shape_of_a_free_beam_and_its_stress(tmp_path: Path) -> None:
    """w and E h/2 w'' for an amplitude of 1 mm; a slender beam, so that shear is little: 0.5 %."""

    scene = scene_from(beams(), tmp_path)
    found = part_frequencies(link_of_scene(scene, "coupler"), 2, tmp_path / "here", shapes=1)
    cycle = frames(tmp_path / "here", "shape_1")
    first = cycle[0]
    length, h, E = 0.9144, 0.0254, 7.031e10
    moved = first.point_data[DISPLACEMENT]
    rest = np.asarray(cycle[FRAMES // 4].points)
    x = np.linalg.norm(rest - rest[0], axis=1) / length
    size = np.linalg.norm(moved, axis=1)
    assert_allclose(size.max(), AMPLITUDE, rtol=1e-6)
    assert_allclose(size, AMPLITUDE * np.abs(free_beam(x)), atol=5e-3 * AMPLITUDE)
    bending = E * h / 2 * AMPLITUDE / length**2 * np.abs(free_curvature(x))
    middle = np.abs(x - 0.5).argmin()
    assert_allclose(first.point_data[VON_MISES][middle], bending[middle], rtol=0.02)
    half = cycle[FRAMES // 2]
    assert_allclose(half.point_data[DISPLACEMENT], -moved, atol=1e-9 * AMPLITUDE)
    listed = (tmp_path / "here" / "shape_1.pvd").read_text()
    assert f'timestep="{(FRAMES - 1) / FRAMES / found.values[0]:.6g}'[:16] in listed
    assert not (tmp_path / "here" / "shape_2.pvd").exists()


@pytest.mark.long
def test_shapes_of_a_linkage_are_those_of_its_softest_position_and_replace_earlier_ones(tmp_path: Path) -> None:
    from PIL import Image

    scene = scene_from(beams(2), tmp_path)
    done = frequencies(scene, Wanted(modes=3, positions=4, shapes=2), tmp_path / "here")
    assert {path.name for path in (tmp_path / "here").glob("*.pvd")} == {"shape_1.pvd", "shape_2.pvd"}
    again = frequencies(scene, Wanted(modes=3, positions=4, shapes=1), tmp_path / "here")
    assert_allclose(again.values, done.values)
    assert {path.name for path in (tmp_path / "here").glob("shape_*.p*")} == {"shape_1.pvd", "shape_1.png"}
    assert len(frames(tmp_path / "here", "shape_1")) == FRAMES
    with Image.open(tmp_path / "here" / "shape_1.png") as image:
        assert min(image.size) >= 700
    # joints hold links together in the shape too: no gap between crank and coupler
    frame = frames(tmp_path / "here", "shape_1")[0]
    points, moved = np.asarray(frame.points), frame.point_data[DISPLACEMENT]
    near = np.linalg.norm(moved[:, None] - moved[None], axis=2) < 1e-9 * AMPLITUDE
    touching = (np.linalg.norm(points[:, None] - points[None], axis=2) < 1e-9) & ~np.eye(len(points), dtype=bool)
    assert touching.any()
    assert near[touching].all()


def test_more_shapes_than_frequencies_are_refused(tmp_path: Path) -> None:
    scene = scene_from(beams(1), tmp_path)
    with pytest.raises(SceneError, match=r"--shapes: must be between 0 and --modes \(2\), got 3"):
        frequencies(scene, Wanted(modes=2, shapes=3), tmp_path / "here")
    with pytest.raises(SceneError, match=r"--shapes: must be between 0 and --modes \(2\), got -1"):
        part_frequencies(link_of_scene(scene, "coupler"), 2, tmp_path / "here", shapes=-1)
    assert not (tmp_path / "here").exists()
