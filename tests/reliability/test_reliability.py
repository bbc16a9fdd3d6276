"""A part of what the commands of this folder try, and every finding of theirs again."""

import random
import signal
import tomllib
from pathlib import Path

import numpy as np
import pytest
from benchmarks.memory import memory_held, most_memory

from kedfem.errors import KedfemError
from kedfem.scene import scene_from
from tests.reliability import endurance, fuzz, kills, phases
from tests.reliability.mutations import damaged, mutated, nudged, places, short
from tests.rooms.test_bad_scenes import GOOD
from tests.scenes import example

FOUND = (Path(__file__).parent / "findings.toml").read_text(encoding="utf-8")
FINDINGS = tomllib.loads(FOUND).get("finding", [])


def test_a_seed_gives_the_same_changes_again() -> None:
    raw = tomllib.loads(GOOD)
    one, other = (repr(mutated(raw, random.Random(7))) for _ in range(2))
    assert one == other != repr(raw)
    assert damaged(b"x" * 99, random.Random(3)) == damaged(b"x" * 99, random.Random(3))


def test_changes_reach_every_key() -> None:
    """Of a thousand changed scenes each top key of the scene is gone or another in some."""
    raw = tomllib.loads(GOOD)
    changed = set()
    for k in range(1000):
        other = mutated(raw, random.Random(k))
        changed |= {key for key in raw if repr(other.get(key)) != repr(raw[key])}
    assert changed == set(raw)
    assert len(places(raw)) > 100


def test_the_tally_finds_what_it_looks_for() -> None:
    """Exceptions that are not kedfem's, words that are none, and other ends."""
    tally = fuzz.Tally()

    def wrong() -> str:
        raise ZeroDivisionError("division")

    def silent() -> str:
        raise KedfemError("")

    def refused() -> str:
        raise KedfemError("links: must be")

    for work in (wrong, silent, refused, lambda: "accepted", lambda: "accepted, not finite"):
        tally.tried("kind", "name", work, 60.0)
    assert dict(tally.counts) == {"kind FINDING": 3, "kind refused": 1, "kind accepted": 1}
    assert "ZeroDivisionError" in tally.page()


def test_scenes_changed_at_random_are_accepted_or_refused_in_words(tmp_path: Path) -> None:
    tally = fuzz.Tally()
    fuzz.validate_scenes(tally, 60, seed=2)
    fuzz.read_texts(tally, 60, 2, tmp_path)
    assert not tally.findings, tally.page()


@pytest.mark.parametrize("finding", FINDINGS, ids=lambda x: x["was"][:40])
def test_what_was_found_once_is_not_found_again(finding: dict[str, str], tmp_path: Path) -> None:
    """A line is a scene's text with what came of it before it was mended; a run where that was in a run."""
    raw, tally = tomllib.loads(finding["scene"]), fuzz.Tally()
    work = fuzz.ran if finding["kind"] == "run" else fuzz.validated
    tally.tried(finding["kind"], finding["was"], lambda: work(raw, tmp_path), fuzz.RUN)
    assert not tally.findings, tally.page()


@pytest.mark.long
def test_many_scenes_and_files(tmp_path: Path) -> None:
    """A fortieth of the validations and files that the command tries; of its runs, which take seconds each, some."""
    tally = fuzz.Tally()
    with np.errstate(all="ignore"):
        fuzz.validate_scenes(tally, 250, seed=3)
        fuzz.damaged_files(tally, 50, 3, tmp_path)
        fuzz.run_scenes(tally, 4, 3, tmp_path, ("spinning_bar", "four_bar_beams"))
    assert not tally.findings, tally.page()


@pytest.mark.long
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_killed_runs_go_on_to_equal_rows(tmp_path: Path) -> None:
    ground = kills.ready(tmp_path / "whole", steps=1500)
    for number, phase in ((signal.SIGKILL, "writing frames"), (signal.SIGTERM, "factoring")):
        kills.killed(ground, number, phase, number.name)
    kills.together(ground, 2, "folder")
    kills.short_of(ground, "quota", 100_000)
    assert not ground.findings, ground.findings
    assert sum(ground.counts.values()) == 6


def test_phases_are_told_with_their_lengths(tmp_path: Path) -> None:
    """Two frames, and a third that never ended."""
    file = tmp_path / "phases"
    file.write_text("".join(f"writing frames\t{x}\t{t}\n" for x, t in zip("+-+-+", (1, 3, 5, 6, 9), strict=True)))
    assert phases.spans(file, "writing frames") == [(1.0, 2.0), (5.0, 1.0)]
    assert phases.begun(file, "writing frames") == 3
    assert phases.at_work(file, "writing frames")
    assert not phases.at_work(file, "meshing")


def test_growth_is_told_from_what_swings() -> None:
    """2 J a turn and 0.25 J of alternating sign, after a start that is left out."""
    turns = [1e3] * 4 + [2.0 * k + 0.25 * (-1) ** k for k in range(400)]
    slope, off = endurance.growth(turns, settled=4)
    assert abs(slope - 2.0) < 1e-4
    assert 0.25 < off < 0.26


@pytest.mark.long
def test_many_steps_leave_joints_closed_and_the_motion_what_it_was() -> None:
    """A hundredth of the command's steps; energy unaccounted for falls as the square of the step."""
    seen, account = endurance.endured(100_000, marks=(0.2, 1.0))
    assert 0.0 < seen.gap < 1e-9 * endurance.SIZE
    assert 0.0 < seen.drift < 1e-9 * endurance.SIZE
    slope, off = endurance.growth(seen.turns)
    assert off < 1e-6 * abs(slope)
    finer = endurance.endured(100 * 2 * endurance.A_TURN, 2 * endurance.A_TURN, ())[0]
    assert 3.8 < slope / endurance.growth(finer.turns)[0] < 4.1
    assert account.balance.energy < 5e-3
    before, after = seen.held
    assert after - before < 5e6


def test_nudged_scenes_are_other_scenes() -> None:
    raw = short(example("four_bar_beams"))
    seen = {repr(nudged(raw, random.Random(k))) for k in range(20)}
    assert len(seen) > 15
    assert scene_from(raw)
    assert 0 < memory_held() < 1.1 * most_memory()  # the system's two counts differ by some pages
