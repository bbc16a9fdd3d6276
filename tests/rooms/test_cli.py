"""The command line as a user meets it: tables, messages, exit codes, Ctrl-C, and what --help does not load."""

import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import pytest

import kedfem
from kedfem.analysis import analyse
from kedfem.cli import DEFECT, INTERRUPTED, KINDS, UNRELIABLE, USER_ERROR, main
from kedfem.cli.running import with_plain_defaults
from kedfem.errors import OutputError
from kedfem.mesh.files.read import mesh_from_file
from kedfem.output.animation import AnimationWriter, read_collection
from kedfem.results import Results, read_results
from kedfem.scene import read_scene, scene_from, time_grid

SOURCE = Path(kedfem.__file__).parents[1]
ARM = """
title = "Arm [bold]nose[/nose]"
gravity = [0, -9.81]
[points]
A = [0, 0]
B = [0.6, 0]
[links.arm]
model = "beam"
material = "aluminium"
shape = { kind = "bar", between = ["A", "B"], width = 0.01, thickness = 0.025 }
mesh = { elements = 2 }
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = "A"
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "60 rpm" }
[damping]
ratio = 0.02
frequencies = [5, 200]
[analysis]
revolutions = TURNS
steps_per_revolution = 360
accuracy = "quick"
initial = "quasi-static"
[output]
plots = false
picture = false
animation = { frames_per_revolution = 36 }
[output.probes.middle_and_tip]
link = "arm"
at = "B"
quantity = "displacement"
[output.probes.velocity_of_the_tip_of_the_long_and_slender_arm]
link = "arm"
at = "B"
quantity = "velocity"
"""


class Said(NamedTuple):
    """What a command left: exit code, standard output, standard error."""

    code: int
    out: str
    err: str


Command = Callable[..., Said]


@pytest.fixture
def run_kedfem(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Command:
    """kedfem in this process, in a folder of its own, on a terminal of 80 columns; it never shows a traceback.

    It has no lines of progress, which depend on how fast the machine is."""
    monkeypatch.setattr("kedfem.cli.screen.QUIET", math.inf)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.delenv("KEDFEM_DEBUG", raising=False)

    def command(*arguments: str | Path) -> Said:
        monkeypatch.setattr(sys, "argv", ["kedfem", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        said = Said(int(end.value.code or 0), *capsys.readouterr())
        assert "Traceback" not in said.out + said.err
        return said

    return command


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A small scene."""
    path = tmp_path / "arm.toml"
    path.write_text(ARM.replace("TURNS", "1"), encoding="utf-8")
    return path


def process(code: str, *arguments: str | Path, folder: Path) -> "subprocess.Popen[str]":
    """Python in a process of its own that Ctrl-C reaches, whatever the one that runs the tests ignores."""
    program = f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n{code}"
    environment = os.environ | {"PYTHONPATH": str(SOURCE), "COLUMNS": "80", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", program, *map(str, arguments)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=folder, env=environment, stdout=pipe, stderr=pipe, text=True)


MAIN = "from kedfem.cli import main; main()"


def test_help_names_every_command_and_each_explains_itself(run_kedfem: Command) -> None:
    said = run_kedfem("--help")
    assert said.code == 0
    for name in ("run", "check", "kinematics", "frequencies", "mesh", "accuracy", "new", "cache"):
        assert re.search(rf"^ +{name} +[A-Z]\w+ .*\.$", said.out, re.MULTILINE), f"{name} is cut off or missing"
        assert run_kedfem(name, "--help").code == 0


def test_version(run_kedfem: Command) -> None:
    assert run_kedfem("--version").out == f"kedfem {kedfem.__version__}\n"


@pytest.mark.parametrize(
    "arguments", [(), ("runn",), ("run",), ("run", "a", "b"), ("bench", "nothing"), ("check", "--fast")]
)
def test_a_command_that_cannot_be_understood_is_the_users_error(run_kedfem: Command, arguments: tuple[str, ...]) -> None:
    assert run_kedfem(*arguments).code == USER_ERROR


def test_help_loads_no_heavy_library(tmp_path: Path) -> None:
    heavy = [
        "cvxopt",
        "gmsh",
        "h5py",
        "matplotlib",
        "meshio",
        "numpy",
        "pint",
        "pyvista",
        "scipy",
        "skfem",
        "vtk",
        "vtkmodules",
    ]
    code = (
        f"import sys, atexit\natexit.register(lambda: print('loaded', [m for m in {heavy} if m in sys.modules]))\n" + MAIN
    )
    out, err = process(code, "--help", folder=tmp_path).communicate(timeout=60)
    assert "loaded []" in out, err


def test_importing_the_analysis_leaves_libraries_alone_that_few_runs_need(tmp_path: Path) -> None:
    few = [
        "gmsh",
        "jaxtyping",
        "kedfem.mesh.link",
        "kedfem.report",
        "matplotlib",
        "meshio",
        "pint",
        "pyvista",
        "scipy.interpolate",
        "scipy.optimize",
        "scipy.spatial",
        "vtkmodules",
    ]
    code = f"import sys, kedfem.analysis; print('loaded', [m for m in {few} if m in sys.modules])"
    out, err = process(code, folder=tmp_path).communicate(timeout=60)
    assert "loaded []" in out, err


def test_run_says_the_largest_values_in_80_columns_and_where_everything_is(run_kedfem: Command, arm: Path) -> None:
    said = run_kedfem("run", arm)
    assert said.code == 0
    assert all(
        len(line) <= 80
        for line in said.out.splitlines()
        if "/arm-results/" not in line and not line.startswith("sizes: ")
    )
    for name in ("probes/middle_and_tip/displacement", "joints/A/force", "drive/torque", "arm"):
        assert f" {name} " in said.out
    long = "probes/velocity_of_the_tip_of_the_long_and_slender_arm/velocity"
    assert long in "".join(re.findall(r"^│ (\S+) +│", said.out, re.MULTILINE))  # folded, not cut
    assert "Arm [bold]nose[/nose]" in said.out  # a title is text, not markup
    named = re.findall(r"^(\S*arm-results/\S+)  ", said.out, re.MULTILINE)
    assert {Path(name).name for name in named} == {
        "results.h5",
        "animation.pvd",
        "paraview.py",
        "envelope.vtu",
        "peaks.csv",
    }
    results = read_results(arm.with_name("arm-results") / "results.h5")
    assert (results.status, len(results.time)) == ("complete", 361)


def test_quick_takes_plain_defaults_and_says_how_exact_they_are(run_kedfem: Command, arm: Path) -> None:
    arm.write_text(arm.read_text(encoding="utf-8").replace('accuracy = "quick"\n', ""), encoding="utf-8")
    said = run_kedfem("run", arm, "--quick")
    assert said.code == 0
    assert "Chosen for" not in said.out
    for words in ("Estimated error, of each channel's largest value", "mesh", "step", "frames", "together"):
        assert words in said.out
    assert "Chosen for 1 %" in run_kedfem("run", arm).out


def test_the_largest_value_of_the_table_is_that_of_the_file(run_kedfem: Command, arm: Path) -> None:
    said = run_kedfem("run", arm)
    _, tip = read_results(Path("arm-results/results.h5")).channels["probes/middle_and_tip/displacement"]
    largest = abs(tip).max()
    number, prefix = re.findall(r"and_tip/displacement +│ [xy] +│ +(-?[\d.]+) ([mµ]?)m ", said.out)[0]
    # four digits are shown
    assert abs(float(number)) * {"": 1, "m": 1e-3, "µ": 1e-6}[prefix] == pytest.approx(largest, rel=1e-3)


def test_the_installed_command_is_the_same_main(arm: Path) -> None:
    done = process(MAIN, "run", arm.name, folder=arm.parent)
    out, err = done.communicate(timeout=120)
    assert done.returncode == 0, err
    assert "arm-results/results.h5  time series" in out
    assert "Traceback" not in err


def test_check_shows_what_would_be_modelled_and_writes_nothing(run_kedfem: Command, arm: Path) -> None:
    said = run_kedfem("check", arm)
    assert said.code == 0
    # 2 beams of 3 nodes: 5 nodes with 3 unknowns; 0.6 m of 10 × 25 mm aluminium of 2700 kg/m³ (room for the alloy)
    row = re.findall(r"│ arm +│ beam3 +│ +(\d+) │ +(\d+) │ +([\d.]+) kg │", said.out)[0]
    assert row[:2] == ("2", "15")
    assert float(row[2]) == pytest.approx(0.6 * 0.01 * 0.025 * 2700, rel=0.05)
    assert "360 of" in said.out
    assert [p.name for p in arm.parent.iterdir()] == [arm.name]


HANGING = """
gravity = [0, -9.81]
[links.rod]
model = "beam"
material = "steel"
%s
shape = { kind = "bar", between = [[0, 0], [1, 0]], width = 0.02, thickness = 0.02 }
[joints.A]
kind = "revolute"
links = ["rod", "ground"]
at = [0, 0]
[analysis]
kind = "static"
"""


@pytest.mark.parametrize("mesh", ["", "mesh = { elements = 2 }"], ids=["open mesh", "given mesh"])
def test_check_fails_where_no_position_balances(run_kedfem: Command, tmp_path: Path, mesh: str) -> None:
    """Nothing holds the rod: with what a run says and its exit code, and no word of a mesh that would be too coarse."""
    scene = tmp_path / "hanging.toml"
    scene.write_text(HANGING % mesh)
    said = run_kedfem("check", scene)
    assert said.code == USER_ERROR
    assert "got no balance at t = 0 s" in " ".join(said.err.split())
    assert "mesh limits it" not in said.out
    assert "finer" not in said.out + said.err


GEOMETRY = Path(__file__).parents[2] / "geometry"


def test_mesh_shows_a_part_and_writes_its_mesh_and_picture(run_kedfem: Command, tmp_path: Path) -> None:
    said = run_kedfem("mesh", GEOMETRY / "crank.step", "--folder", tmp_path / "out")
    assert said.code == 0, said.err
    assert "quadrilaterals swept along z" in said.out
    assert re.search(r"│ +1 │ face 17 │ bore +│ +24 │ +\(0, 0, -27\) │ z +│ it +│", said.out)
    assert max(len(line) for line in said.out.splitlines() if "/" not in line) <= 80
    assert (tmp_path / "out" / "mesh.png").stat().st_size > 20_000
    again = mesh_from_file("again", tmp_path / "out" / "mesh.vtu", 1.0)
    assert f" {len(again.cells)} hex27 " in said.out


def test_mesh_tells_what_is_wrong_by_the_names_of_its_options(run_kedfem: Command, tmp_path: Path) -> None:
    said = run_kedfem("mesh", GEOMETRY / "engine.step", "--solid", "rodd", "--folder", tmp_path)
    assert said.code == USER_ERROR
    assert "--solid: must name a solid of" in said.err
    assert "did you mean 'rod'?" in said.err
    said = run_kedfem("mesh", GEOMETRY / "crank.step", "--size=-3", "--across", "0", "--folder", tmp_path)
    assert said.code == USER_ERROR
    assert "mesh.size: must be a length [m], got '-3': no unit" in said.err
    assert "mesh.elements_across: must be at least 1, got 0" in said.err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", KINDS)
def test_new_writes_a_commented_scene_that_can_be_checked(run_kedfem: Command, kind: str) -> None:
    said = run_kedfem("new", kind)
    assert said.code == 0
    assert f"kedfem check {kind}.toml" in said.out
    template = files("kedfem") / "templates" / f"{kind.replace('-', '_')}.toml"
    assert Path(f"{kind}.toml").read_text(encoding="utf-8") == template.read_text(encoding="utf-8")
    assert run_kedfem("check", f"{kind}.toml", "--quick").code == 0


def test_new_refuses_a_kind_that_it_does_not_know(run_kedfem: Command) -> None:
    said = run_kedfem("new", "tripod")
    assert said.code == USER_ERROR
    assert said.err == f"error: KIND: must be one of {', '.join(KINDS)}, got 'tripod'\n"
    assert not list(Path().iterdir())


def test_new_leaves_a_file_that_exists(run_kedfem: Command) -> None:
    Path("mine.toml").write_text("precious")
    said = run_kedfem("new", "single-arm", "mine.toml")
    assert (said.code, said.err) == (USER_ERROR, "error: mine.toml: must be a new file, got one that exists already\n")
    assert Path("mine.toml").read_text() == "precious"


def test_new_needs_a_folder_that_is_there(run_kedfem: Command) -> None:
    said = run_kedfem("new", "single-arm", "nowhere/mine.toml")
    assert said.code == USER_ERROR
    assert said.err.startswith("error: nowhere/mine.toml: must be a file that can be written, got ")


@pytest.mark.parametrize("command", ["run", "check"])
def test_a_scene_that_is_not_there(run_kedfem: Command, command: str) -> None:
    said = run_kedfem(command, "no.toml")
    assert (said.code, said.err) == (USER_ERROR, "error: no.toml: must be a file, got nothing there\n")


@pytest.mark.parametrize("command", ["run", "check"])
def test_broken_toml_is_named_with_its_line(run_kedfem: Command, command: str) -> None:
    Path("broken.toml").write_text('[points]\nA = [0, 0]\ntitle = "no end\n')
    said = run_kedfem(command, "broken.toml")
    assert said.code == USER_ERROR
    assert said.err.startswith("error: broken.toml, line 3: must be valid TOML, got: ")


def test_all_faults_come_at_once_and_nothing_is_written(run_kedfem: Command, arm: Path) -> None:
    text = (
        arm.read_text(encoding="utf-8").replace("width = 0.01", "width = -0.01").replace("revolutions =", "revolution =")
    )
    arm.write_text(text, encoding="utf-8")
    said = run_kedfem("run", arm)
    assert said.code == USER_ERROR
    assert "links.arm.shape.width: must be positive [m], got -0.01" in said.err
    assert "analysis.revolution: unknown key, did you mean 'revolutions'?" in said.err
    assert [p.name for p in arm.parent.iterdir()] == [arm.name]


def test_a_file_in_the_way_of_the_output_folder(run_kedfem: Command, arm: Path) -> None:
    arm.with_name("arm-results").write_text("precious")
    said = run_kedfem("run", "arm.toml")
    assert said.code == USER_ERROR
    assert "error: output.folder: must be a writable folder, got arm-results (" in said.err
    assert arm.with_name("arm-results").read_text() == "precious"


def test_a_defect_of_kedfem_is_called_one(run_kedfem: Command, arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise RuntimeError("[/broken] inside")

    monkeypatch.setattr("kedfem.analysis.analyse", failing)
    said = run_kedfem("run", arm)
    assert said.code == DEFECT
    assert "internal error: RuntimeError: [/broken] inside" in said.err
    assert "This is a defect of kedfem" in said.err


def test_too_little_memory_is_said(run_kedfem: Command, arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("kedfem.analysis.analyse", failing)
    said = run_kedfem("run", arm)
    assert said.code == USER_ERROR
    assert "must fit in memory" in said.err


def test_ctrl_c_before_the_first_step_leaves_an_earlier_run_alone(
    run_kedfem: Command, arm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run_kedfem("run", arm)
    file = arm.with_name("arm-results") / "results.h5"
    before = file.read_bytes()

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kedfem.analysis.ready_to_step", interrupted)
    said = run_kedfem("run", arm)
    nothing = "interrupted; nothing was computed yet, as the first step had not begun, and nothing was written"
    assert (said.code, said.err.splitlines()[-1]) == (INTERRUPTED, nothing)
    assert file.read_bytes() == before


def test_every_command_says_that_it_was_interrupted(
    run_kedfem: Command, arm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kedfem.accuracy.plan.ready_to_step", interrupted)
    said = run_kedfem("check", arm)
    assert (said.code, said.err.splitlines()[-1:]) == (INTERRUPTED, ["interrupted"])


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupted_run_leaves_what_was_computed(arm: Path, number: signal.Signals) -> None:
    arm.write_text(ARM.replace("TURNS", "10000"), encoding="utf-8")
    folder = arm.with_name("arm-results")
    before = signal.signal(number, signal.SIG_DFL)  # it may be ignored here, as under nohup, and so it would be there
    try:
        running = process(MAIN, "run", arm.name, folder=arm.parent)
    finally:
        signal.signal(number, before)
    try:
        wait_for(lambda: (folder / "animation" / "arm_0050.vtu").exists() and (folder / "results.h5").exists(), running)
        running.send_signal(number)
        out, err = running.communicate(timeout=60)
    finally:
        running.kill()
    assert running.returncode == INTERRUPTED
    said = "interrupted; what was computed is readable in arm-results/results.h5 (status: interrupted)"
    assert err.splitlines()[-1] == said
    assert "Traceback" not in out + err
    results = read_results(folder / "results.h5")
    assert results.status == "interrupted"
    assert len(results.time) > 256
    expect_whole_animation(folder, results)


def test_frames_and_rows_of_two_runs_never_stand_side_by_side(arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever moment a run is killed at, once its first rows are in place."""
    folder = analyse(read_scene(arm)).folder
    real, seen, begun = AnimationWriter.add, [], time.time_ns()
    time.sleep(0.05)

    def added(writer: AnimationWriter, *given: Any) -> list[Path]:
        rows = (folder / "results.h5").stat().st_mtime_ns >= begun
        frames = [
            path.stat().st_mtime_ns >= begun for path in [*folder.glob("animation.pvd"), *folder.glob("animation/*")]
        ]
        seen.append((rows, all(frames)))
        return real(writer, *given)

    monkeypatch.setattr(AnimationWriter, "add", added)
    arm.write_text(arm.read_text("utf-8").replace("frames_per_revolution = 36", "frames_per_revolution = 1"), "utf-8")
    analyse(read_scene(arm))
    assert set(seen) == {(True, True)}


def test_a_frame_that_fails_while_steps_go_on_ends_the_run_and_rows_are_kept(
    arm: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, threads = AnimationWriter.add, set()

    def added(writer: AnimationWriter, *given: Any) -> list[Path]:
        threads.add(threading.current_thread())
        if writer.count == 5:
            raise OutputError("the sixth frame")
        return real(writer, *given)

    monkeypatch.setattr(AnimationWriter, "add", added)
    with pytest.raises(OutputError, match="the sixth frame"):
        analyse(read_scene(arm))
    assert threading.main_thread() not in threads
    assert not any(thread.is_alive() for thread in threads)
    folder = arm.with_name("arm-results")
    results = read_results(folder / "results.h5")
    assert results.status == "interrupted"
    assert len(results.time) >= 50  # five frames, and the step of the sixth
    assert len(read_collection(folder / "animation.pvd")) == 5


def test_a_run_that_means_nothing_is_not_called_complete(run_kedfem: Command, arm: Path) -> None:
    """A sudden start, and eight steps a revolution that do not resolve what it excites."""
    text = arm.read_text("utf-8").replace("= 360", "= 8").replace('initial = "quasi-static"', "")
    arm.write_text(text.replace("60 rpm", "600 rpm"), encoding="utf-8")
    said = run_kedfem("run", arm)
    assert said.code == UNRELIABLE
    last = said.err.partition("unreliable: ")[2].replace("\n", " ")
    assert "of energy unaccounted for" in last
    results = read_results(arm.with_name("arm-results") / "results.h5")
    assert (results.status, len(results.time)) == ("unreliable", 9)
    assert results.reason in last


def test_an_arm_that_rings_from_a_sudden_start_is_warned_of_and_no_more(run_kedfem: Command, arm: Path) -> None:
    """Energy exchanged, and torque, are next to nothing beside the kinetic energy and the force in its joint."""
    text = arm.read_text("utf-8").replace('initial = "quasi-static"', "").replace("gravity = [0, -9.81]", "")
    arm.write_text(text, encoding="utf-8")
    said = run_kedfem("run", arm)
    assert said.code == 0
    assert "estimated error" in said.err
    assert read_results(arm.with_name("arm-results") / "results.h5").status == "complete"


def test_a_killed_run_is_named_by_the_next_one(run_kedfem: Command, arm: Path) -> None:
    arm.write_text(ARM.replace("TURNS", "10000"), encoding="utf-8")
    file = arm.with_name("arm-results") / "results.h5"
    running = process(MAIN, "run", arm.name, folder=arm.parent)
    try:
        wait_for(file.exists, running)
    finally:
        running.kill()
        running.communicate()
    left = read_results(file)
    assert left.status == "abandoned"
    arm.write_text(ARM.replace("TURNS", "0.1"), encoding="utf-8")
    said = run_kedfem("run", arm)
    assert f"an earlier run was killed after {len(left.time)} rows" in said.err
    assert read_results(file).status == "complete"


def test_tables_and_plots_of_an_earlier_run_do_not_stay_beside_the_new_results(run_kedfem: Command, arm: Path) -> None:
    text = arm.read_text(encoding="utf-8")
    arm.write_text(text.replace("plots = false", "plots = true\ncsv = true"), encoding="utf-8")
    folder = arm.with_name(f"{arm.stem}-results")
    assert run_kedfem("run", arm).code == 0
    assert (folder / "results.csv").exists()
    assert list((folder / "plots").glob("*.png"))
    arm.write_text(text.replace("animation = { frames_per_revolution = 36 }", "animation = false"), encoding="utf-8")
    assert run_kedfem("run", arm).code == 0
    assert sorted(path.name for path in folder.rglob("*") if path.is_file()) == [
        "envelope.vtu",
        "peaks.csv",
        "results.h5",
        "worst.vtu",
    ]


@pytest.mark.parametrize("name", ["results.csv", "worst.png", "animation.pvd", "envelope.vtu", "peaks.csv", "results.h5"])
def test_files_that_are_not_kedfems_are_left_alone(run_kedfem: Command, arm: Path, name: str) -> None:
    """A scene may name any folder for its results: what others keep there under such names stays."""
    arm.write_text(arm.read_text("utf-8").replace("[output]", '[output]\nfolder = "mine"'), encoding="utf-8")
    file = arm.with_name("mine") / name
    file.parent.mkdir()
    if name == "results.h5":
        with h5py.File(file, "w") as foreign:
            foreign["precious"] = [1.0]
    else:
        file.write_text("precious", encoding="utf-8")
    before = file.read_bytes()
    said = run_kedfem("run", arm)
    assert said.code == USER_ERROR
    assert f"must be a folder of kedfem's results or one without {name}" in said.err
    assert file.read_bytes() == before


def wait_for(condition: Callable[[], bool], running: "subprocess.Popen[str]") -> None:
    """Until something is so, while a process runs."""
    end = time.monotonic() + 60
    while not condition():
        assert running.poll() is None, running.communicate()
        assert time.monotonic() < end
        time.sleep(0.05)


def expect_whole_animation(folder: Path, results: Results) -> None:
    """Every frame that is listed is there, none half-written, none beyond the rows; one may not be listed yet."""
    listed = re.findall(r'timestep="([^"]*)".*file="([^"]*)"', (folder / "animation.pvd").read_text())
    there = {str(path.relative_to(folder)) for path in folder.glob("animation/*.vtu")}
    assert {name for _, name in listed} <= there
    assert len(there) - len(listed) <= len({name for _, name in listed if name.endswith("_0000.vtu")})
    assert all((folder / name).read_bytes().rstrip().endswith(b"</VTKFile>") for name in there)
    assert float(listed[-1][0]) <= results.time[-1] + 1e-9
    assert not [path.name for path in folder.rglob("*") if ".part" in path.name]


@pytest.mark.parametrize("kind", KINDS)
def test_a_scene_of_a_quick_run_can_be_read_again(kind: str, run_kedfem: Command, tmp_path: Path) -> None:
    """What takes results up, such as `kedfem loads`, reads their scene: with several drives its step was not in it."""
    assert run_kedfem("new", kind).code == 0
    quick = with_plain_defaults(read_scene(tmp_path / f"{kind}.toml"))
    again = scene_from(json.loads(quick.model_dump_json()), tmp_path)
    assert time_grid(again) == time_grid(quick)


def test_a_page_of_a_scene_runs_it_once_and_is_of_its_text(run_kedfem: Command, arm: Path) -> None:
    """Without results the scene is run; with those of an earlier text it is not, nor are they shown as its own."""
    said = run_kedfem("report", arm)
    assert (said.code, Path("arm-results/report.html").exists()) == (0, True)
    before = Path("arm-results/results.h5").stat().st_mtime_ns
    assert run_kedfem("report", arm, "--file", "page.html").code == 0
    assert Path("page.html").stat().st_size > 1e6
    assert Path("arm-results/results.h5").stat().st_mtime_ns == before
    arm.write_text(arm.read_text() + "\n# changed\n")
    said = run_kedfem("report", arm)
    assert said.code == USER_ERROR
    assert "must be of arm.toml as it is now, got those of an earlier text" in said.err.replace("\n", " ")
    assert run_kedfem("report", "arm-results").code == 0


def test_a_page_is_opened(run_kedfem: Command, arm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("typer.launch", lambda url: opened.append(url) or len(opened) - 1)
    assert "could be opened" not in run_kedfem("view", arm).err
    assert opened == [Path("arm-results/report.html").resolve().as_uri()]
    assert "no browser could be opened here" in run_kedfem("view", arm).err.replace("\n", " ")
