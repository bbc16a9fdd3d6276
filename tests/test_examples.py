"""Every example: a valid scene, and a script that ends with an assertion on its physics."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from reference.results import entries

import kedfem
from kedfem.results import read_results
from kedfem.scene import read_scene, time_grid

ROOT = Path(__file__).parents[1]
SOURCE = Path(kedfem.__file__).parents[1]
EXAMPLES = sorted(path.parent.name for path in (ROOT / "examples").glob("*/run.py"))


GENERATED = ("*-results", "*-kinematics", "*-accuracy", "*-mesh", "*-sweep", "*-frequencies")


def test_nothing_generated_is_committed() -> None:
    """What .gitignore names, results of runs above all, is not in the repository."""
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a clone")
    git = ["git", "-c", "safe.directory=*", "-C", str(ROOT)]  # whoever owns the clone
    command = [*git, "ls-files", "--cached", "--ignored", "--exclude-standard"]
    kept = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert not kept


def test_all_four_are_there_each_with_its_scene() -> None:
    assert {"four_bar_beams", "four_bar_solids", "slider_crank_solids", "spinning_bar"} <= set(EXAMPLES)
    assert sorted(path.parent.name for path in (ROOT / "examples").glob("*/scene.toml")) == EXAMPLES


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_scene_of_an_example_is_valid_and_says_how_to_run_it(name: str) -> None:
    path = ROOT / "examples" / name / "scene.toml"
    scene = read_scene(path)
    assert time_grid(scene).steps > 0
    assert scene.title
    assert f"kedfem run examples/{name}/scene.toml" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_script_of_an_example_asserts_something(name: str) -> None:
    code = ast.parse((ROOT / "examples" / name / "run.py").read_text(encoding="utf-8"))
    assert any(isinstance(node, ast.Assert) for node in ast.walk(code))


@pytest.mark.long
@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs_and_its_assertions_hold(name: str, tmp_path: Path) -> None:
    for folder in (f"examples/{name}", "geometry"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns(*GENERATED))
    command = [sys.executable, "-W", "error", f"examples/{name}/run.py"]
    environment = os.environ | {"PYTHONPATH": str(SOURCE), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    assert not done.stderr
    for file in tmp_path.rglob("results.h5"):
        channels = read_results(file).channels
        assert [each for each, (channel, _) in channels.items() if not entries(channel)] == []
