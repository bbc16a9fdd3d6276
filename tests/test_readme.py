"""What the README says is so: its scene is valid, its Python runs, its commands and files exist."""

import re
import stat
import tomllib
from dataclasses import fields
from itertools import product
from pathlib import Path

import pytest

from kedfem.accuracy.plan import planned
from kedfem.analysis import Run
from kedfem.mesh.session import SYSTEM_PACKAGES
from kedfem.results import Peak, Results
from kedfem.scene import read_scene, scene_from
from tests.slow import STUDIES, listed

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md")),
]


def blocks(kind: str) -> list[str]:
    """The fenced blocks of one language."""
    return re.findall(rf"^```{kind}\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)


def commands() -> list[str]:
    """The indented blocks: what a user types."""
    return re.findall(r"^    (\S.*)$", README, re.MULTILINE)


def test_the_scene_and_the_python_of_the_readme_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scene, accurate = blocks("toml")
    (code,) = blocks("python")
    (name,) = re.findall(r'read_scene\("(.*)"\)', code)
    monkeypatch.chdir(tmp_path)
    Path(name).write_text(scene, encoding="utf-8")
    exec(compile(code, "README.md", "exec"), {})
    said = capsys.readouterr().out
    assert "('x', 'y', 'z') m" in said
    assert re.search(r"highest stress \d+\.\d MPa in arm at t = 0\.\d+ s", said)
    assert {p.name for p in Path("arm-results").iterdir()} >= {"results.h5", "animation.pvd", "plots", "worst.png"}
    whole = scene.replace(scene[scene.index("[analysis]") : scene.index("[output.probes")], accurate)
    assert planned(scene_from(tomllib.loads(whole))).error < 0.02


def test_the_page_on_python_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE))
    monkeypatch.chdir(tmp_path)
    known: dict[str, object] = {}
    exec(compile(code, "docs/python.md", "exec"), known)
    said = capsys.readouterr().out
    assert re.search(r"\d+\.\d MPa in arm at \(.*\) m, t = 0\.\d+ s, drive ", said)
    assert "complete drive_angle rad" in said
    assert "steps" in known["stages"]  # type: ignore[operator]
    for record, cells in ((Run, r"^\| `Run`.*?\n\n"), (Results, r"^\| `Results`.*?\n\n"), (Peak, r"^`Peak`: .*")):
        (text,) = re.findall(cells, page, re.DOTALL | re.MULTILINE)
        assert all(f"`{field.name}`" in text for field in fields(record))


def test_every_command_of_the_readme_is_there() -> None:
    run, test, install = commands()
    assert run == "scripts/kedfem run examples/four_bar_solids/scene.toml"
    assert test == "scripts/test"
    assert install.startswith("apt-get install ")
    for script in ("scripts/setup", "scripts/kedfem", "scripts/test", ".ci/run"):
        assert (ROOT / script).stat().st_mode & stat.S_IXUSR, f"{script} is not executable"
    assert read_scene(ROOT / run.split()[-1]).results_folder == ROOT / "examples/four_bar_solids/scene-results"
    assert "`examples/four_bar_solids/scene-results/`" in README


def test_the_system_packages_are_those_of_the_message_and_of_ci() -> None:
    listed = set(commands()[-1].removeprefix("apt-get install ").split())
    assert listed == {*SYSTEM_PACKAGES.values(), "python3-venv", "libegl1", "libgl1-mesa-dri"}
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    (names,) = re.findall(r"for package in (.*?); do", script, re.DOTALL)
    assert set(names.replace("\\\n", " ").split()) | {"python3-venv"} == listed | {"calculix-ccx"}
    assert "`calculix-ccx`" in README  # what tests alone need


def test_ci_begins_with_the_readmes_tests_and_runs_every_example() -> None:
    script = (ROOT / ".ci/run").read_text(encoding="utf-8")
    steps = [line for line in script.splitlines() if line.startswith(("scripts/", ".venv/"))]
    assert steps[0].split()[0] == commands()[1]
    assert not any("test_examples" in name for name in listed(STUDIES))
    chosen = ["not long", *re.findall(r'scripts/test -m "([^"]+)"', script)]
    for long, slow, kernels in product([True, False], repeat=3):
        marks = {"long": long or slow, "slow": slow, "kernels": kernels, "study": False}
        assert any(eval(each, marks) for each in chosen), marks


def test_python_of_pyproject_is_python_of_readme_and_setup() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["requires-python"] == ">=3.11"
    assert "Python 3.11 or newer" in README
    assert "sys.version_info < (3, 11)" in (ROOT / "scripts/setup").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_to_files(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text)
    missing = [target for target in targets if not (ROOT / page).parent.joinpath(target).exists()]
    assert not missing
