"""What the commands print where no terminal is: whole tables, lines of progress."""

import re
from io import StringIO

import pytest
from rich.console import Console
from rich.table import Table

from kedfem.accuracy.plan import Plan
from kedfem.cli import screen
from kedfem.scene import scene_from
from kedfem.tables.layout import facts
from kedfem.tables.run import chosen_table
from kedfem.terminal import terminal
from tests.scenes import arm, bar, constant_speed


def test_tables_are_as_wide_as_they_are_in_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    table = Table("a heading of words", "another heading of words")
    table.add_row("x" * 90, "y" * 90)
    for columns, whole in ((None, True), ("80", False)):
        monkeypatch.delenv("COLUMNS", raising=False)
        if columns:
            monkeypatch.setenv("COLUMNS", columns)
        console = terminal()
        console.file = StringIO()
        console.print(table)
        assert ("x" * 90 in console.file.getvalue()) is whole


def test_progress_in_a_pipe_is_lines(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(screen, "QUIET", 0.0)
    with screen.progress() as watch:
        watch("motion", 0, 0)
        for k in range(1000):
            watch("steps", k, 1000)
    told = re.sub(r"after \d+ s", "after a while", capsys.readouterr().err).splitlines()
    assert told == [
        "motion: after a while", "motion: done after a while",
        "steps: 0 of 1,000 after a while", "steps: done after a while",
    ]  # fmt: skip


def test_a_stage_that_goes_on_is_told_again_and_one_that_fails_is_not_done(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(screen, "QUIET", 0.0)
    monkeypatch.setattr(screen, "EVERY", 0.0)

    def fail() -> None:
        with screen.progress() as watch:
            for k in range(3):
                watch("steps", k, 3)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    told = capsys.readouterr().err.splitlines()
    assert [line.split(" after")[0] for line in told] == [f"steps: {k} of 3" for k in range(3)]


def test_short_stages_are_not_told(capsys: pytest.CaptureFixture[str]) -> None:
    with screen.progress() as watch:
        watch("motion", 0, 0)
        watch("steps", 1, 2)
    assert capsys.readouterr().err == ""


def test_facts_are_read_in_a_hundred_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long texts of a table go over several lines, in a pipe too, and none of their words is lost."""
    monkeypatch.delenv("COLUMNS", raising=False)
    note = " ".join(f"word{k}" for k in range(60))
    for rows in ([("note", note)], [("constrained redundantly at joints O, B, C and bore", note), ("note", "short")],
                 [("s", "spring along joint B", note)]):  # fmt: skip
        console = terminal()
        console.file = said = StringIO()
        console.print(facts("Chosen for 1 %", rows))
        assert max(map(len, said.getvalue().splitlines())) <= 103  # at least 44 for the last column
        assert re.findall(r"word\d+", said.getvalue()) == note.split()


@pytest.mark.parametrize(("model", "layers"), [("beam", False), ("plane", False), ("solid", True)])
def test_layers_are_of_solids_alone(model: str, layers: bool) -> None:
    scene = scene_from(arm(bar(model=model), constant_speed(1.0), analysis={"revolutions": 1}))
    console = Console(width=120, file=StringIO())
    console.print(chosen_table(Plan(scene, 0.01, 1.0, (), ())))
    assert ("layers" in console.file.getvalue()) is layers  # type: ignore[attr-defined]
