"""The state for ParaView: arrays that it names are in the files, and ParaView opens it where there is one."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.output.animation import read_collection
from kedfem.results import read_results
from kedfem.scene import scene_from
from tests.frames import merged
from tests.moving import driven_slide, two_drives
from tests.scenes import arm, bar, constant_speed


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bar that is turned about its end, under gravity."""
    link = bar(0.5, 0.02, 0.02, mesh={"elements": [4, 1, 1]})
    output = {"plots": False, "picture": False, "animation": {"frames_per_revolution": 8}}
    analysis = {"revolutions": 1, "steps_per_revolution": 72, "accuracy": "quick", "initial": "quasi-static"}
    raw = arm(link, constant_speed(10.0), gravity=[0, -9.81, 0], analysis=analysis, output=output)
    return analyse(scene_from(raw, tmp_path_factory.mktemp("shown"))).folder


def test_joints_are_points_with_what_they_exert(folder: Path) -> None:
    """Forces and torque of the frame's row, at the hinge; the drive's position is the row's."""
    results = read_results(folder / "results.h5")
    _, force = results.channels["joints/A/force"]
    _, torque = results.channels["drive/torque"]
    frames = read_collection(folder / "animation.pvd")
    assert len(frames) == 9
    for time, files in frames:
        k = int(np.abs(results.time - time).argmin())
        joints = merged([path for path in files if path.name.startswith("joints")])
        assert joints.field_data["joint A"] == [0]
        assert_allclose(joints.field_data["drive angle [rad]"], results.angle[k], atol=1e-9)
        assert_allclose(joints.points, 0.0, atol=1e-9)
        assert_allclose(joints.point_data["force [N]"], force[k : k + 1], rtol=1e-6)
        assert_allclose(joints.point_data["drive torque [N m]"], [[0, 0, torque[k, 0]]], rtol=1e-6)
    assert np.abs(force).max() > 10.0


def test_drives_are_arrows_at_their_joints(tmp_path: Path) -> None:
    for raw, array, joints in (
        (two_drives(), "drive torque [N m]", ["A", "B"]),
        (driven_slide(), "drive force [N]", ["A"]),
    ):
        output = {"plots": False, "picture": False, "folder": str(tmp_path / array[:9]), "animation": {"frames": 3}}
        del output["animation"]
        done = analyse(scene_from({**raw, "output": output, "analysis": {**raw["analysis"], "accuracy": "quick"}}))
        _, files = read_collection(done.folder / "animation.pvd")[1]
        points = merged([path for path in files if path.name.startswith("joints")])
        sizes = np.linalg.norm(points.point_data[array], axis=1)
        assert len(sizes) == len(joints)
        assert (sizes > 0).all()


def test_the_state_names_what_is_there(folder: Path) -> None:
    text = (folder / "paraview.py").read_text(encoding="utf-8")
    compile(text, "paraview.py", "exec")
    results = read_results(folder / "results.h5")
    _, files = read_collection(folder / "animation.pvd")[0]
    arrays = {name for path in files for name in merged([path]).point_data}
    assert {"von Mises [Pa]", "force [N]", "drive torque [N m]"} <= arrays
    named = {x for x in re.findall(r'"POINTS", "([^"]+)"', text) if "highest" not in x and "displacement" not in x}
    assert named <= arrays
    peak = max(each.stress for each in results.peaks.values())
    assert f"RescaleTransferFunction(0.0, {peak}" in text
    longest = max(np.linalg.norm(results.channels["joints/A/force"][1], axis=1))
    assert f"size / {longest}" in text


@pytest.mark.skipif(not (shutil.which("pvpython") and shutil.which("xvfb-run")), reason="needs ParaView and xvfb")
def test_paraview_opens_the_state(folder: Path, tmp_path: Path) -> None:
    """Each link a block with its name; a picture at the last time, with colours."""
    from PIL import Image

    shown = tmp_path / "show.py"
    shown.write_text(
        f"""path = {str(folder / "paraview.py")!r}
g = {{"__file__": path}}
exec(compile(open(path).read(), path, "exec"), g)
from paraview.simple import *
from paraview import servermanager
blocks = servermanager.Fetch(g["animation"])
print([blocks.GetMetaData(k).Get(blocks.NAME()) for k in range(blocks.GetNumberOfBlocks())])
GetAnimationScene().GoToLast()
SaveScreenshot({str(tmp_path / "a.png")!r}, g["view"], ImageResolution=[800, 600])
""",
        encoding="utf-8",
    )
    screen = ["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24 +extension GLX"]
    for _ in range(3):  # a window that a busy machine's X server does not give ends ParaView at once
        done = subprocess.run([*screen, "pvpython", str(shown)], capture_output=True, text=True, timeout=200, check=False)
        if "CreateAWindow" not in done.stderr:
            break
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    assert "['arm', 'joints']" in done.stdout
    with Image.open(tmp_path / "a.png") as image:
        colours = np.asarray(image.convert("RGB"), int)
    assert (np.ptp(colours, axis=2) > 60).mean() > 0.002
