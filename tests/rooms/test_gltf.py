"""The glTF file, as VTK's own reader has it: links where frames have them, coloured, gravity downwards."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.analysis import analyse
from kedfem.errors import OutputError
from kedfem.report import write_gltf
from kedfem.report.animated import animated
from kedfem.report.gltf import normals, placed_shape
from kedfem.report.surfaces import Placement, Surface
from kedfem.results import read_results
from kedfem.scene import scene_from
from tests.rooms.test_cli import Command, run_kedfem
from tests.scenes import arm, bar, constant_speed

__all__ = ["run_kedfem"]  # a fixture
DOWN = {"y": [0, -9.81, 0], "z": [0, 0, -9.81], "oblique": [3.0, -4.0, 2.0], "none": [0, 0, 0], "up": [0, 9.81, 0]}


def scene(gravity: list[float], **output: Any) -> dict[str, Any]:
    link = bar(0.5, 0.02, 0.02, mesh={"elements": [4, 1, 1]})
    shown = {"plots": False, "picture": False, "animation": {"frames_per_revolution": 8}, **output}
    analysis = {"revolutions": 1, "steps_per_revolution": 72, "accuracy": "quick", "initial": "quasi-static"}
    return arm(link, constant_speed(10.0), gravity=gravity, analysis=analysis, output=shown)


@pytest.fixture(scope="module", params=DOWN)
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path, Path]:
    """A direction of gravity, the results of a run, and the file."""
    folder = analyse(scene_from(scene(DOWN[request.param]), tmp_path_factory.mktemp("shown"))).folder
    path = folder / "arm.glb"
    found = write_gltf(folder, path)
    assert (found.links, found.frames, found.warnings) == (("arm",), 9, ())
    return request.param, folder, path


ARM = """
drive = { joint = "A", motion = { kind = "constant_speed", speed = 10 } }
analysis = { revolutions = 1, steps_per_revolution = 72, accuracy = "quick", initial = "quasi-static" }
output = { plots = false, picture = false, animation = { frames_per_revolution = 8 } }

[links.arm]
material = "steel"
shape = { kind = "bar", between = [[0, 0], [0.5, 0]], width = 0.02, thickness = 0.02 }
mesh = { elements = [4, 1, 1] }

[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = [0, 0]
"""


def reader_of(path: Path) -> Any:
    from vtkmodules.vtkIOGeometry import vtkGLTFReader

    reader = vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.SetFrameRate(1000)
    reader.UpdateInformation()
    reader.EnableAnimation(0)
    reader.UpdateInformation()
    return reader


def shown(reader: Any, time: float) -> Any:
    """All points at a time, moved by their nodes."""
    import pyvista

    reader.UpdateTimeStep(time)
    return pyvista.wrap(reader.GetOutput()).copy().combine()


def test_links_are_where_frames_have_them_and_gravity_points_down(written: tuple[str, Path, Path]) -> None:
    """Positions at frames, turned so that −y is along gravity; distances are kept, so no scale and no mirror."""
    down, folder, path = written
    found = animated(folder, 1.0)
    assert found is not None
    (surface,) = found.surfaces
    X = surface.points[0]
    places = [placed.p + X @ placed.R.T for placed in surface.placements]
    reader = reader_of(path)
    assert reader.GetAnimationDuration(0) == pytest.approx(found.times[-1] - found.times[0], rel=1e-6)
    rows = [np.asarray(shown(reader, t - found.times[0]).points) for t in found.times]
    # the turn of the whole file, from one frame, holds for all
    a, b = places[2] - places[2].mean(axis=0), rows[2] - rows[2].mean(axis=0)
    U, _, Vt = np.linalg.svd(a.T @ b)
    Q = (U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt).T
    for x, row in zip(places, rows, strict=True):
        assert_allclose(row, x @ Q.T, atol=2e-6)
    gravity = np.array(DOWN[down])
    if gravity.any():
        assert_allclose(Q @ gravity / np.linalg.norm(gravity), [0, -1, 0], atol=1e-5)
    else:
        assert_allclose(Q, np.eye(3), atol=1e-5)


def test_colours_are_of_the_highest_stress(written: tuple[str, Path, Path]) -> None:
    """Red where the stress is highest, blue where it is a tenth; in linear light."""
    _, folder, path = written
    found = animated(folder, 1.0)
    assert found is not None
    stress = found.surfaces[0].stress[0]
    colours = np.asarray(shown(reader_of(path), 0.0).point_data["COLOR_0"])[:, :3]
    highest = read_results(folder / "results.h5").peaks["arm"].stress
    top, low = int(np.argmax(stress)), int(np.argmin(np.abs(stress - 0.1 * highest)))
    assert stress[top] > 0.9 * highest
    assert colours[top, 0] > 3 * colours[top, 2]
    assert colours[low, 2] > colours[low, 0]
    assert ((colours >= 0) & (colours <= 1)).all()


def test_normals_of_a_tetrahedron_point_outwards() -> None:
    X = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    found = normals(X, triangles)
    assert_allclose(np.linalg.norm(found, axis=1), 1.0)
    assert (np.einsum("nk,nk->n", found, X - X.mean(axis=0)) > 0).all()


def test_the_command_and_what_it_refuses(run_kedfem: Command, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(ARM, encoding="utf-8")
    said = run_kedfem("export", path, "--gltf", tmp_path / "a.glb")
    assert said.code == 2
    assert "--gltf: must have the results of a run, got none in" in " ".join(said.err.split())
    assert run_kedfem("run", path).code == 0
    said = run_kedfem("export", path, "--gltf", tmp_path / "a.glb")
    assert said.code == 0, said.err
    assert "arm over 9 frames" in said.out
    assert (tmp_path / "a.glb").read_bytes()[:4] == b"glTF"
    said = run_kedfem("export", path, "--gltf", tmp_path / "a.obj")
    assert "must end in .glb, got '.obj'" in " ".join(said.err.split())
    with pytest.raises(OutputError, match="must be a"):
        write_gltf(tmp_path / "nothing", tmp_path / "b.glb")
    assert not (tmp_path / "b.glb").exists()


def test_a_run_without_frames_is_shown_as_drawn(tmp_path: Path) -> None:
    folder = analyse(scene_from(scene([0, -9.81, 0], animation=False), tmp_path)).folder
    found = write_gltf(folder, tmp_path / "a.glb")
    assert found.frames == 0
    assert found.links == ("arm",)


@pytest.mark.parametrize("length", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("axis", [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.4, -0.7, 0.5]])
def test_a_spring_stretches_along_its_line_however_short_it_is(axis: list[float], length: float) -> None:
    """Coils of 0.1 m diameter at 1, 0.8 and 1.5 times their length, turned and shifted in frames."""
    e = np.array(axis) / np.linalg.norm(axis)
    across = np.linalg.svd(e[None])[2][1:]
    turn, along = np.linspace(0, 12 * np.pi, 400), np.linspace(0, length, 400)
    ring = 0.05 * (np.outer(np.cos(turn), across[0]) + np.outer(np.sin(turn), across[1]))
    every = [ring + np.outer(part * along, e) for part in (1.0, 1.0, 0.8, 1.5)]
    R = Rotation.from_rotvec([[0, 0, 0], [0.3, 0.2, -1.0], [2.0, 0, 0.4]]).as_matrix()
    p = np.array([[0, 0, 0], [1.0, 2.0, 3.0], [-1.0, 0, 0.5]])
    placed = [Placement(*each) for each in zip(p, R, strict=True)]
    spring = Surface("s", np.zeros((0, 3), int), every, [], placed, spring=True)
    moves = placed_shape(spring)
    for k in range(3):
        found = moves.p[k] + (moves.scale[k] * moves.own) @ moves.R[k].T
        assert_allclose(found, p[k] + every[k + 1] @ R[k].T, atol=1e-9)
