"""Scenes from others: whatever they hold, words come out, soon, and no commands to the terminal."""

import io
import json
import os
import re
from pathlib import Path
from typing import Any

import pytest
from rich.table import Table
from rich.text import Text

from kedfem.errors import SceneError
from kedfem.scene import read_scene, scene_from
from kedfem.terminal import terminal

from .test_bad_scenes import BEAMS, GOOD, changed

CSV = {"drive/motion": {"kind": "curve", "file": "motion.csv"}, "analysis": {"end_time": 1, "step": 0.1}}


def refusal(change: dict[str, Any], base: str = GOOD, folder: Path | str = ".") -> list[str]:
    with pytest.raises(SceneError) as refused:
        scene_from(changed(base, change), folder)
    return [str(fault) for fault in refused.value.faults]


HOSTILE = [
    ({"damping/frequencies": [50, 1e300]}, "damping.frequencies[1]: must be at most 1e+30 in size [Hz]"),
    ({"analysis": {"end_time": 1e300, "step": 1}}, "analysis.end_time: must be at most 1e+30 in size [s]"),
    ({"analysis": {"end_time": 1e-298, "step": 1e-300}}, "analysis.step: must be at least 1e-30 [s]"),
    ({"analysis": {"end_time": 1e20, "step": 1e-20}}, "analysis: must end within 1e+09 steps, got 1e+40"),
    ({"analysis": {"revolutions": 1e9, "steps_per_revolution": 720}}, "analysis: must end within 1e+09 "
    "steps, got 7.2e+11"),
    ({"links/crank/shape/width": 1e-300}, "links.crank.shape.width: must be at least 1e-30 [m]"),
    ({"links/crank/shape/width": "1 m**(9**9**9)"}, "links.crank.shape.width: must be a length [m]"),
    ({"bodies/wheel/inertia": 1e100}, "bodies.wheel.inertia: must be at most 1e+30 in size [kg*m^2]"),
    ({"points/B": {"from": "A", "distance": 1e200, "angle": 0}}, "points.B.distance: must be at most 1e+30"),
    ({"points/B/distance": 10**30 * 9}, "points.B.distance: must be at most 1e+30 in size [m]"),
    ({"output/folder": "a\0b"}, "output.folder: must be a path without control characters, got '\\x00'"),
    ({"output/folder": "b" * 300}, "output.folder: must be a path of names of at most 255 bytes, got one of 300"),
    ({"drive/motion": {"kind": "curve", "file": "a\0b"}}, "drive.motion.file: "),
    ({"title": "\x1b]0;x"}, "title: must be a line without control characters"),
    ({f"loads/{'p' * 300}": {"kind": "force", "link": "rocker", "at": "M"}}, "must be a name of at most 100"),
    ({"links/\x1b[31mx": {"material": "steel"}}, "must be a name of letters"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "words"), HOSTILE, ids=lambda x: x[:60] if isinstance(x, str) else "")
def test_what_is_no_machines_is_refused_in_words(change: dict[str, Any], words: str) -> None:
    assert any(words in fault for fault in refusal(change)), refusal(change)


def test_deep_tables_and_long_chains_of_points_are_refused_in_words(tmp_path: Path) -> None:
    file = tmp_path / "scene.toml"
    for text in ("x = " + "[" * 100_000, "x = " + "{a = " * 5000, "a." * 100_000 + "b = 1", "[" + "a." * 5000 + "b]"):
        file.write_text(text)
        with pytest.raises(SceneError, match="must be nested less than 100 deep"):
            read_scene(file)
    points = {f"p{k}": {"from": f"p{k + 1}", "distance": 1, "angle": 0} for k in range(5000)} | {"p5000": [0, 0]}
    assert "hundreds deep" in refusal({"points": points})[0]
    nested: Any = "A"
    for _ in range(3000):
        nested = {"between": [nested, "D"]}
    raw = changed(GOOD, {})
    raw["loads"]["push"]["at"] = nested
    with pytest.raises(SceneError, match="hundreds deep"):
        scene_from(raw)
    chained = {f"q{k}": {"from": f"q{k + 1}", "distance": 1e-3, "angle": 0} for k in range(40)} | {"q40": [0, 0]}
    raw = changed(BEAMS, {"points": chained})
    assert scene_from(raw).points["q0"][0] == pytest.approx(0.04)  # a chain as long as a user's is no fault


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes")
def test_files_are_regular_and_not_too_large(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "motion.csv")
    assert re.search(r"drive\.motion\.file: .*must be a regular file", refusal(CSV, folder=tmp_path)[0])
    (tmp_path / "motion.csv").unlink()
    with (tmp_path / "motion.csv").open("wb") as file:
        file.truncate(60_000_000)
    assert re.search(r"must be at most 50 MB, got 60 MB", refusal(CSV, folder=tmp_path)[0])


@pytest.mark.parametrize("name", ["../motion.csv", "/etc/passwd", "linked/motion.csv", "a\0b"])
@pytest.mark.parametrize(
    "place", ["drive.motion.file", "links.crank.shape.file", "loads.push.factor.file", "output.folder"]
)
def test_scenes_from_others_stay_in_their_folder(tmp_path: Path, name: str, place: str) -> None:
    """Nothing is read before: the files need not even be there."""
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "linked").symlink_to(tmp_path)
    table, _, key = place.rpartition(".")
    scene = inner / "scene.toml"
    scene.write_text(f"[{table}]\n{key} = {json.dumps(name)}\n", encoding="utf-8")
    with pytest.raises(SceneError, match=rf"^{place}: must be within the scene's folder \(--within\), got ") as refused:
        read_scene(scene, within=True)
    assert len(refused.value.faults) == 1
    scene.write_text(f'[{table}]\n{key} = "deeper/motion.csv"\n', encoding="utf-8")
    with pytest.raises(SceneError) as other:
        read_scene(scene, within=True)
    assert "--within" not in str(other.value)


def test_the_terminal_gets_no_commands_from_names() -> None:
    console, said = terminal(), io.StringIO()
    console.file = said
    table = Table(title=Text("a\x1b]0;x\x07b"))
    table.add_row("\x1b[31mred", Text("\u202etxet"))
    console.print(table)
    console.print("error: \x1b[2Jlinks.x\x9b31m", style="red", markup=False, soft_wrap=True)
    text = said.getvalue()
    assert "\x1b" not in text
    assert "\x07" not in text
    assert "\u202e" not in text
    assert "\x9b" not in text
    assert "links.x" in text
    assert "red" in text
