"""The animation in one file, as VTK's own reader has it."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.errors import OutputError
from kedfem.output.fields import DISPLACEMENT, FORCE, LARGEST, SMALLEST, STRESS, VON_MISES
from kedfem.output.vtkhdf import AnimationFile
from kedfem.scene import scene_from
from kedfem.stepping import refuse_without
from tests.frames import frames
from tests.scenes import arm, bar, constant_speed

OMEGA, LENGTH, SIDE, DENSITY = 100.0, 0.5, 0.02, 7850.0
SCALE = 500.0  # of the other animation: this one is never exaggerated


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A quarter of a revolution of a bar that spins about its end, with the deflection that this asks for."""
    end = np.pi / 2 / OMEGA
    analysis = {"end_time": end, "step": end / 20, "initial": "quasi-static", "accuracy": "quick"}
    animation = {"vtkhdf": True, "frames_per_revolution": 8, "deformation_scale": SCALE}
    output = {"plots": False, "picture": False, "animation": animation}
    link = bar(LENGTH, SIDE, SIDE, mesh={"elements": [8, 1, 1]})
    raw = arm(link, constant_speed(OMEGA), analysis=analysis, output=output)
    return analyse(scene_from(raw, tmp_path_factory.mktemp("spun"))).folder


def reader_of(path: Path) -> Any:
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    return reader


def frame(reader: Any, time: float) -> Any:
    import pyvista

    reader.UpdateTimeStep(time)
    return pyvista.wrap(reader.GetOutput()).copy()


def test_points_move_rigidly_and_stresses_turn_with_the_link(folder: Path) -> None:
    """Drawn along x, σ_xx = ρ ω² (L² − x²)/2; after a quarter turn the bar lies along y, and so does its stress."""
    reader = reader_of(folder / "animation.vtkhdf")
    assert reader.GetNumberOfSteps() == 3  # eight frames a revolution
    first, last = (frame(reader, t) for t in (0.0, np.pi / 2 / OMEGA))
    assert_allclose(last.field_data["drive angle [rad]"], np.pi / 2, rtol=1e-9)
    assert last.field_data["link arm"] == [0]
    assert set(last.celltypes) == {1, 25}  # a joint, 20-node hexahedra
    first, last = (now.extract_cells(now.cell_data["link"] == 0) for now in (first, last))
    x, y, z = first.points.T
    assert_allclose(last.points, np.stack([-y, x, z], axis=1), atol=1e-6 * LENGTH)
    axial = DENSITY * OMEGA**2 * (LENGTH**2 - x**2) / 2
    inner = (x > 0.2 * LENGTH) & (x < 0.9 * LENGTH)
    for now, component in ((first, 0), (last, 1)):
        assert_allclose(now["stress [Pa]"][inner, component], axial[inner], rtol=0.02)
        assert_allclose(now["largest principal stress [Pa]"][inner], axial[inner], rtol=0.02)
        assert np.abs(now["stress [Pa]"][inner, 1 - component]).max() < 0.02 * axial.max()
    # u(L) = ρ ω² L³/(3 E), outwards: what Warp By Vector adds, whatever the other animation exaggerates
    tip = np.isclose(x, LENGTH)
    stretch = DENSITY * OMEGA**2 * LENGTH**3 / (3 * 210e9)
    assert_allclose(last["displacement [m]"][tip, 1].mean(), stretch, rtol=0.02)


def test_both_animations_show_the_same(folder: Path) -> None:
    reader = reader_of(folder / "animation.vtkhdf")
    shown = frames(folder)
    for k, time in enumerate(np.linspace(0.0, np.pi / 2 / OMEGA, 3)):
        one, other = frame(reader, time), shown[k]
        links, n = one.extract_cells(one.cell_data["link"] == 0), other.n_points
        assert links.n_points == n
        x = one.points[:n] + SCALE * one[DISPLACEMENT][:n]
        assert_allclose(x, other.points, atol=1e-6 * LENGTH)
        for name in (VON_MISES, STRESS, LARGEST, SMALLEST):
            size = np.abs(other[name]).max()
            assert_allclose(one[name][:n], other[name], atol=1e-6 * size)
        (joint,) = one.points[n:]
        assert_allclose(joint, 0.0, atol=1e-9)
        assert one[FORCE][n:].shape == (1, 3)
        assert not one[FORCE][:n].any()


def test_the_mesh_is_stored_once(folder: Path) -> None:
    with h5py.File(folder / "animation.vtkhdf") as file:
        root = file["VTKHDF"]
        assert len(root["Connectivity"]) == 20 * 8 + 1
        assert len(root["Points"]) == 3 * root["NumberOfPoints"][0]


def test_a_file_with_fewer_frames_than_the_state_is_not_gone_on_with(folder: Path, tmp_path: Path) -> None:
    one = AnimationFile(folder / "animation.vtkhdf", "drive angle [rad]")
    for written, fine in ((0, True), (3, True), (4, False)):
        one.written = written
        assert (one.missing is None) == fine
    with pytest.raises(OutputError, match=r"animation\.vtkhdf: must be there, with its frames, to resume"):
        refuse_without(one)
    broken = AnimationFile(tmp_path / "animation.vtkhdf", "drive angle [rad]")
    broken.path.write_bytes(b"not HDF5")
    broken.written = 1
    assert broken.missing == broken.path
