"""The study of speed against error: its front, its files, and the command as a user meets it."""

import csv
import itertools
import re
from dataclasses import replace
from io import StringIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from kedfem.accuracy.study.files import write_study, write_study_plot, written
from kedfem.accuracy.study.measuring import Seconds, Study, pareto_front, studied
from kedfem.accuracy.study.variants import model_kinds
from kedfem.cli import INTERRUPTED, USER_ERROR
from kedfem.scene import read_scene
from kedfem.tables import study_tables
from tests.rooms import test_cli
from tests.rooms.test_cli import Command

run_kedfem = test_cli.run_kedfem

BEAM = """
title = "Whip"
[points]
A = [0, 0]
B = [0.6, 0]
[links.arm]
material = "aluminium"
shape = { kind = "polyline", points = ["A", "B"], width = 0.01, thickness = 0.025 }
model = "beam"
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = "A"
[drive]
joint = "A"
motion = { kind = "cycloidal", angle = "60 deg", rise = 0.2 }
[damping]
ratio = 0.02
frequencies = [5, 200]
[analysis]
end_time = 0.3
step = 0.001
[output.probes.tip]
link = "arm"
at = "B"
quantity = "displacement"
"""


@pytest.fixture
def whip(tmp_path: Path) -> Path:
    """An arm that only beams can model."""
    path = tmp_path / "whip.toml"
    path.write_text(BEAM, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    path = tmp_path_factory.mktemp("study") / "whip.toml"
    path.write_text(BEAM, encoding="utf-8")
    return studied(read_scene(path), most=60.0, repeats=2)


@given(st.lists(st.tuples(st.floats(1e-3, 1e3), st.floats(1e-9, 10.0)), min_size=1, max_size=30))
def test_nothing_on_the_front_is_beaten_and_everything_else_is(points: list[tuple[float, float]]) -> None:
    front = pareto_front(points)

    def beaten(k: int) -> bool:
        t, e = points[k]
        return any((x <= t and y <= e) and (x < t or y < e) for x, y in points)

    assert not any(beaten(k) for k in front)
    met = {points[k] for k in front}
    assert all(beaten(k) or points[k] in met for k in range(len(points)))


def test_the_reference_is_its_own_and_errors_fall_towards_it(study: Study) -> None:
    assert study.reference.error == 0.0
    assert (study.reference.variant.fineness, study.reference.variant.steps) == (3.0, 4)
    row = {(r.variant.fineness, r.variant.steps): r for r in study.rows}
    by_mesh = [row[f, 4].error for f in (1.0, 2.0, 3.0)]
    by_step = [row[3.0, s].error for s in (1, 2, 4)]
    assert all(a > b for errors in (by_mesh, by_step) for a, b in pairwise(errors))
    # second order: a step twice as long than half the reference's adds four times the error, less the reference's own
    assert row[3.0, 1].error / row[3.0, 2].error == pytest.approx(15 / 3, rel=0.35)
    assert study.shares["step"] == pytest.approx(row[3.0, 2].error / 3, rel=1e-12)


def test_times_are_of_the_whole_run(study: Study) -> None:
    for row in study.rows:
        assert row.seconds is not None
        parts = row.seconds.preparation + row.seconds.stepping
        assert row.seconds.runs <= 2
        assert parts == pytest.approx(row.seconds.whole, rel=0.5)
    assert any(row.front for row in study.rows)


def test_the_table_comes_back_from_its_file(study: Study, tmp_path: Path) -> None:
    write_study(study, tmp_path / "accuracy.csv", "a machine, with a comma")
    lines = (tmp_path / "accuracy.csv").read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert [tuple(row.values()) for row in rows] == [written(row) for row in study.rows]
    np.testing.assert_array_equal([float(row["error"]) for row in rows], [row.error for row in study.rows])
    assert (tmp_path / "accuracy.csv").read_text().startswith("# measured on: a machine, with a comma\n")


def test_the_plot_is_a_picture(study: Study, tmp_path: Path) -> None:
    write_study_plot(study, tmp_path / "accuracy.png", "a machine")
    assert (tmp_path / "accuracy.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_writes_table_and_plot_beside_the_scene(run_kedfem: Command, whip: Path) -> None:
    said = run_kedfem("accuracy", whip.name, "--quick", "--repeats", "1")
    assert said.code == 0, said.err
    assert sorted(path.name for path in Path("whip-accuracy").iterdir()) == ["accuracy.csv", "accuracy.png"]
    assert re.search(r"│ reference\W", said.out)
    assert all(len(line) <= 80 for line in said.out.splitlines())
    assert "OMP_NUM_THREADS" in " ".join(said.out.split())


def slowed(seconds: Seconds, by: float) -> Seconds:
    return Seconds(by * seconds.preparation, by * seconds.stepping, by * seconds.whole, seconds.runs)


@pytest.mark.parametrize("slower", [0.01, 1.0, 300.0])
def test_no_figure_of_the_table_is_cut_off_at_80_columns(study: Study, slower: float) -> None:
    """Of runs of any length: the first in a fresh checkout compile for a minute."""
    rows = [replace(row, unknowns=12345, seconds=slowed(row.seconds, slower)) for row in study.rows if row.seconds]
    console = Console(width=80, file=StringIO(), record=True)
    console.print(study_tables(replace(study, rows=rows), "a machine")[0])
    said = console.export_text()
    assert said.count("│ reference") == 1
    assert said.count("12345") == len(rows)
    assert "…" not in said


def test_what_does_not_fit_the_budget_is_named(whip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    looks = itertools.count()
    monkeypatch.setattr("kedfem.accuracy.study.measuring.perf_counter", lambda: float(next(looks)))  # a second a look
    bound = studied(read_scene(whip), most=25.0, repeats=1)
    left = [row.note for row in bound.rows if row.seconds is None]
    assert left
    assert all(note.startswith("left out") for note in left)
    # the last run may go on for a block of steps, and what is left is judged with one look each
    assert next(looks) < 25 + 10 + 2 * len(left)
    assert bound.reference in bound.rows


def test_too_little_time_for_anything_is_said(run_kedfem: Command, whip: Path) -> None:
    said = run_kedfem("accuracy", whip, "--most", "1e-6")
    assert said.code == USER_ERROR
    assert said.err.endswith("error: most: must leave time for a run, got 1e-06 s\n")


@pytest.mark.long
def test_a_model_that_cannot_be_built_is_one_row_that_says_why(whip: Path) -> None:
    text = BEAM.replace("polyline", "bar").replace("points =", "between =").replace("\nmodel", "\n#")
    # a surface load has no place on a beam
    load = '\n[loads.x]\nkind = "surface"\nlink = "arm"\nat = "B"\nvector = ["1 kPa", 0]\n'
    whip.write_text(text + load, encoding="utf-8")
    scene = read_scene(whip)
    assert {each.name for each in model_kinds(scene)} == {
        "beam", "plane", "reduced plane", "solid", "reduced solid",
    }  # fmt: skip
    found = studied(scene, most=20.0, repeats=1, quick=True)
    beams = [row for row in found.rows if row.variant.model_kind.family == "beam"]
    assert len(beams) == 1
    assert "must name a solid or a plane link for a surface load" in beams[0].note
    assert found.reference.variant.model_kind.name == "reduced solid"


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (("--most", "-1"), "error: --most: must be positive [s], got -1\n"),
        (("--most", "nan"), "error: --most: must be positive [s], got nan\n"),
        (("--repeats", "0"), "error: --repeats: must be at least 1, got 0\n"),
    ],
)
def test_options_that_mean_nothing(run_kedfem: Command, whip: Path, option: tuple[str, str], message: str) -> None:
    said = run_kedfem("accuracy", whip, *option)
    assert (said.code, said.err) == (USER_ERROR, message)
    assert run_kedfem("accuracy", whip, "--fast").code == USER_ERROR


def test_a_scene_that_is_not_there(run_kedfem: Command) -> None:
    said = run_kedfem("accuracy", "no.toml")
    assert (said.code, said.err) == (USER_ERROR, "error: no.toml: must be a file, got nothing there\n")


def test_ctrl_c_is_said(run_kedfem: Command, whip: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("kedfem.accuracy.study.measuring.studied", interrupted)
    said = run_kedfem("accuracy", whip)
    assert (said.code, said.err.splitlines()[-1]) == (INTERRUPTED, "interrupted; nothing was written")
    assert not list(Path().glob("*-accuracy/*"))
