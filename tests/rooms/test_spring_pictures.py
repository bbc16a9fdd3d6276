"""Springs and dampers are drawn, from end to end or about their hinge: in frames, the picture, the report and glTF."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.kinematics import kinematics
from kedfem.output.joint_springs import hinge_springs, line_springs
from kedfem.output.picture import write_picture
from kedfem.output.springs import SLENDER, WIDTH, spring_shape, stretched
from kedfem.output.views import hidden, labels
from kedfem.report import write_gltf
from kedfem.report.animated import animated
from kedfem.results import read_results
from kedfem.scene import LineSpring, scene_from
from kedfem.stepping import frame_steps
from tests.frames import frames
from tests.partners import chain
from tests.rooms.test_gltf import reader_of, shown
from tests.rooms.test_output import pixels
from tests.rooms.test_vtkhdf import frame
from tests.rooms.test_vtkhdf import reader_of as hdf_reader
from tests.scenes import arm, bar, constant_speed

TIP, TO = [0.5, 0, 0], [0.3, 0.7, 0.1]


def scene(**spring: Any) -> dict[str, Any]:
    """An arm that turns once, with a spring from its tip to the ground."""
    ends = [{"link": "arm", "at": TIP}, {"link": "ground", "at": TO}]
    pull = {"kind": "spring", "between": ends, "stiffness": 100, "damping": 1, **spring}
    link = bar(0.5, 0.02, 0.02, mesh={"elements": [4, 1, 1]})
    output = {"plots": False, "animation": {"frames_per_revolution": 8, "vtkhdf": True}}
    analysis = {"revolutions": 1, "steps_per_revolution": 72, "accuracy": "quick", "initial": "quasi-static"}
    return arm(link, constant_speed(10.0), springs={"pull": pull}, analysis=analysis, output=output)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return analyse(scene_from(scene(), tmp_path_factory.mktemp("spring"))).folder


def cells_of(grid: Any) -> Any:
    (number,) = (k for k, name in labels(grid, "spring ").items() if name == "pull")
    return grid.extract_cells(grid.cell_data["link"] == number)


def coil_pixels(png: Path) -> int:
    """How many pixels have the colour of springs."""
    red, green, blue = pixels(png).reshape(-1, 3).T.astype(int)
    return int(((green > red + 10) & (green > blue) & (green < 150)).sum())


@pytest.mark.parametrize(
    "law", [{"stiffness": 5.0}, {"damping": 5.0}, {"stiffness": 5.0, "damping": 5.0}], ids=["k", "c", "k and c"]
)
def test_shapes_reach_from_end_to_end_and_are_slender(law: dict[str, float]) -> None:
    """However the line between the ends turns, half round too, and however short it was drawn."""
    for drawn in ([0, 0, 2.0], [0.01, 0.02, 0], [0.0, 0, 0]):
        ends = ({"link": "arm", "at": [0, 0, 0]}, {"link": "ground", "at": drawn})
        free = {} if any(drawn) else {"free_length": 0.0}
        spring = LineSpring.model_validate({"between": ends, **law, **free})
        points, cells = spring_shape(spring, 1.0)
        assert cells.max() == len(points) - 1
        for direction in ([0, 0, 1.5], [0, 0, -0.5], [0.3, 0.6, -0.6]):
            a, b = np.array([0.5, 0, 0]), np.array(direction) * (np.linalg.norm(drawn) or 0.08)
            x = stretched(points, np.array(drawn), np.array([a, a + b])) - a
            along = x @ b / np.linalg.norm(b)
            assert_allclose([along.min(), along.max()], [0, np.linalg.norm(b)], atol=0.35 * WIDTH)
            across = np.linalg.norm(x - np.outer(along, b) / np.linalg.norm(b), axis=1).max()
            length = float(np.linalg.norm(drawn))
            radius = min(WIDTH, SLENDER * length) if length else WIDTH
            assert 0.6 * radius < across < 1.01 * radius


def test_frames_have_them_as_long_as_their_channel(folder: Path) -> None:
    results = read_results(folder / "results.h5")
    length = results.channels["springs/pull/length"][1][:, 0]
    every = frames(folder)
    assert len(every) == 9
    for grid, k in zip(every, range(0, 73, 9), strict=True):
        x = np.asarray(cells_of(grid).points)
        tip = np.asarray(grid.extract_cells(grid.cell_data["link"] == 0).points)
        assert np.linalg.norm(tip - x[np.linalg.norm(x - TO, axis=1).argmax()], axis=1).min() < 0.03
        assert np.linalg.norm(x - TO, axis=1).max() == pytest.approx(length[k], abs=1e-4)
        assert np.linalg.norm(x - TO, axis=1).min() < 0.003  # radius of the wire


def test_the_animation_in_one_file_has_them_too(folder: Path) -> None:
    reader = hdf_reader(folder / "animation.vtkhdf")
    assert reader.GetNumberOfSteps() == 9
    for grid, time in zip(frames(folder), np.linspace(0, 2 * np.pi / 10.0, 9), strict=True):
        spring, other = cells_of(frame(reader, time)), cells_of(grid)
        assert_allclose(spring.points, other.points, atol=2e-3)  # there with the deflection of the tip
        assert_allclose(spring["displacement [m]"], other["displacement [m]"], atol=1e-12)


def test_the_picture_has_them_and_they_hide_no_stress(folder: Path, tmp_path: Path) -> None:
    grid = pyvista.read(folder / "worst.vtu")
    assert labels(grid, "spring ") == {1: "pull"}
    spring = cells_of(grid)
    grid.point_data["von Mises [Pa]"][:] = 0
    k = int(np.linalg.norm(grid.points - spring.points[0], axis=1).argmin())
    grid.point_data["von Mises [Pa]"][k] = 1.0
    assert not hidden(grid, np.array([0.0, 0, 1]))
    write_picture(folder / "worst.vtu", tmp_path / "with.png", "a spring")
    assert coil_pixels(tmp_path / "with.png") > 1000


def test_report_and_gltf_stretch_them(folder: Path, tmp_path: Path) -> None:
    """The report's surface lies on the frame's in each; VTK's reader finds the same lengths in the glTF file."""
    found = animated(folder, 1.0)
    assert found is not None
    spring = next(each for each in found.surfaces if each.spring)
    assert spring.name == "pull"
    for points, grid in zip(list(spring.world())[1:], frames(folder), strict=True):
        own = np.asarray(cells_of(grid).points)
        assert max(np.linalg.norm(own - x, axis=1).min() for x in points) < 1e-6
    write_gltf(folder, tmp_path / "arm.glb")
    reader = reader_of(tmp_path / "arm.glb")
    for t, points in zip(found.times, list(spring.world())[1:], strict=True):
        x = np.asarray(shown(reader, t - found.times[0]).points)[-len(points) :]
        assert_allclose(x, points, atol=1e-3)  # of wires that the stretch along the axis takes along


def test_rigid_motions_have_them_too(tmp_path: Path) -> None:
    made = kinematics(scene_from(scene(), tmp_path))
    for k, grid in enumerate(frames(made.folder)):
        x = np.asarray(cells_of(grid).points)
        tip = 0.5 * np.array([np.cos(k * np.pi / 4), np.sin(k * np.pi / 4), 0])
        assert np.linalg.norm(x - tip, axis=1).min() < 0.003
        assert np.linalg.norm(x - TO, axis=1).max() == pytest.approx(np.linalg.norm(tip - TO), abs=1e-4)


def test_springs_along_slides_stretch_with_the_travel(tmp_path: Path) -> None:
    """From the joint, which moves, to a point of the ground on that side to which a pressed spring pushes back."""
    slide = {"kind": "prismatic", "links": ["ground", "arm"], "at": [0, 0], "axis": [0, 1, 0]}
    pull = {"kind": "spring", "joint": "A", "stiffness": 100, "preload": -5}
    analysis = {"step": 0.01, "end_time": 0.2, "accuracy": "quick", "initial": "quasi-static"}
    lift = {"kind": "cycloidal", "travel": 0.05, "rise": 0.2}
    raw = scene() | {"joints": {"A": slide}, "springs": {"pull": pull}, "analysis": analysis}
    raw["drive"] = {"joint": "A", "motion": lift}
    elastic = analyse(scene_from(raw, tmp_path)).folder
    results = read_results(elastic / "results.h5")
    steps = frame_steps(scene_from(raw, tmp_path))
    travel = results.channels["springs/pull/travel"][1][steps, 0]
    assert travel[-1] == pytest.approx(0.05, rel=1e-3)
    write_picture(elastic / "worst.vtu", tmp_path / "with.png", "a spring")
    assert coil_pixels(tmp_path / "with.png") > 1000
    for folder in (elastic, kinematics(scene_from(raw, tmp_path / "rigid")).folder):
        every = [np.asarray(cells_of(grid).points) for grid in frames(folder)]
        assert len(every) == len(travel)
        for points, way in zip(every, travel, strict=True):
            fixed, moving = points[:, 1].min(), points[:, 1].max()
            assert moving == pytest.approx(way, abs=1e-3)
            assert fixed == pytest.approx(every[0][:, 1].min(), abs=1e-3)
            assert np.abs(points[:, [0, 2]]).max() < 0.03


def test_springs_about_hinges_turn_with_their_link(tmp_path: Path) -> None:
    """They wind about the axis, and are seen on both sides of the link."""
    pull = {"kind": "torsion", "joint": "A", "stiffness": 3.0}
    raw = scene() | {"springs": {"pull": pull}}
    elastic = analyse(scene_from(raw, tmp_path)).folder
    write_picture(elastic / "worst.vtu", tmp_path / "with.png", "a spring")
    assert coil_pixels(tmp_path / "with.png") > 500
    for folder in (elastic, kinematics(scene_from(raw, tmp_path / "rigid")).folder):
        every = [np.asarray(cells_of(grid).points) for grid in frames(folder)]
        first = every[0]
        assert np.linalg.norm(first[:, :2], axis=1).max() < 0.01
        assert first[:, 2].max() > 0.01  # half the link's thickness
        assert first[:, 2].min() < -0.01
        angles = np.arctan2(first[:, 1], first[:, 0])
        assert len(np.unique(np.floor(angles / (np.pi / 4)) % 8)) == 8  # all round
        assert len(every) == 9
        for k, points in enumerate(every):
            c, s = np.cos(k * np.pi / 4), np.sin(k * np.pi / 4)
            assert_allclose(points, first @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), atol=1e-4)


@pytest.mark.parametrize("about", [0, 1])
def test_a_spring_about_the_axis_of_a_link_of_a_cross_winds_about_it(about: int) -> None:
    """It is flatter along its axis than across, and rotates with the link whose angle it is over."""
    raw = chain("universal", ("beam", "beam"))
    J = raw["joints"]["J"]
    raw["springs"] = {"s": {"kind": "torsion", "joint": "J", "about": J["links"][about], "stiffness": 1.0}}
    (drawn,) = hinge_springs(scene_from(raw), {}, 1.0).values()
    assert drawn.link == J["links"][1 - about]
    points = drawn.shape[0] - drawn.shape[0].mean(axis=0)
    axis = np.asarray(J["axes"][about]) / np.linalg.norm(J["axes"][about])
    across = np.linalg.norm(np.cross(points, axis), axis=1)
    assert np.abs(points @ axis).max() < 0.6 * across.max()


def test_a_spring_along_a_direction_in_the_plane_of_a_joint_lies_along_it() -> None:
    raw = chain("planar", ("beam", "beam"))
    along = np.cross(raw["joints"]["J"]["axis"], [0.3, -0.5, 0.7])
    raw["springs"] = {"s": {"kind": "spring", "joint": "J", "along": along.tolist(), "stiffness": 1.0}}
    (drawn,) = line_springs(scene_from(raw), {}, 1.0).values()
    one, other = (np.asarray(end.at) for end in drawn.ends)
    assert np.linalg.norm(other - one) > 0.01
    assert_allclose(np.cross(other - one, along), 0.0, atol=1e-12)
