"""What is kept between runs: the same results, and new ones when anything changes or an entry is damaged."""

import os
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from typer.testing import CliRunner

from kedfem import store
from kedfem.accuracy import reduction
from kedfem.accuracy.histories import histories
from kedfem.accuracy.prepared import key
from kedfem.accuracy.reduction import prepared
from kedfem.cli import app
from kedfem.dynamics.model import Model
from kedfem.links.recovery import nodal_state, nodal_stress, stress_recovery
from kedfem.scene import Scene, scene_from
from kedfem.store import clear, contents, entries, itself, kept

from .test_dynamics import four_bar


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def scene(**changes: Any) -> Scene:
    raw = four_bar("bar", revolutions=0.1, initial="quasi-static", rho_inf=0.9, **changes)
    for link in raw["links"].values():
        link["reduction"] = "modal"
    raw["links"]["crank"] |= {"model": "rigid", "reduction": "none"}
    raw["links"]["crank"].pop("mesh")
    return scene_from(raw)


def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows whenever links are reduced."""
    calls: list[int] = []
    real = reduction.reduced

    def counted(*arguments: Any) -> Any:
        calls.append(1)
        return real(*arguments)

    monkeypatch.setattr(reduction, "reduced", counted)
    return calls


def test_the_second_run_reduces_nothing_and_finds_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = made(monkeypatch)
    first, again = (prepared(scene()) for _ in range(2))
    assert len(calls) == 1
    a, b = histories(first[0]), histories(again[0])
    for name, (_, values) in a.channels.items():
        assert_array_equal(b.channels[name][1], values)
    assert first[1] is not None
    assert again[1] is not None
    assert first[1].estimate == again[1].estimate
    assert_array_equal(peak_stress(again[0].model), peak_stress(first[0].model))


def peak_stress(model: Model) -> np.ndarray:
    """Nodal stresses of the first link under its first function along x: needs the function space of the full link."""
    link = model.links[0]
    g = np.zeros((link.n, link.d))
    g[-1, 0] = 1.0
    return nodal_stress(stress_recovery(link), nodal_state(link, g))


def test_a_damaged_entry_is_made_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = made(monkeypatch)
    prepared(scene())
    for file in entries(folder):
        file.write_bytes(b"not an entry")
    found, _ = prepared(scene())
    assert len(calls) == 2
    assert [link.name for link in found.model.links] == ["coupler", "rocker"]


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({}, True),
        ({"title": "another"}, True),
        ({"output": {"folder": "elsewhere", "csv": True, "animation": False}}, True),
        ({"gravity": [0, -9.81, 0]}, False),
        ({"analysis": {"revolutions": 0.2, "steps_per_revolution": 120}}, False),
    ],
)
def test_the_key_belongs_to_what_the_result_depends_on(change: dict[str, Any], same: bool) -> None:
    raw = four_bar("bar")
    assert (key(scene_from(raw)) == key(scene_from(raw | change))) == same


def test_the_key_belongs_to_the_contents_of_files(tmp_path: Path) -> None:
    file = tmp_path / "part.toml"
    file.write_text("thickness = 0.01", "utf-8")
    before = contents([file])
    file.write_text("thickness = 0.02", "utf-8")
    assert contents([file]) != before


def test_a_file_that_cannot_be_read_has_a_key_too(tmp_path: Path) -> None:
    assert contents([tmp_path]) == contents([tmp_path / "none"])


def test_nothing_is_kept_where_the_cache_is_off(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", "off")
    prepared(scene())
    assert not folder.exists()


def test_an_entry_that_reads_well_but_is_not_what_was_written_is_made_again(folder: Path) -> None:
    calls: list[int] = []

    def work() -> list[float]:
        calls.append(1)
        return [1.0, 2.0]

    kept("numbers", "any", work, itself, itself)
    (file,) = entries(folder)
    file.write_bytes(file.read_bytes().replace(struct.pack(">d", 2.0), struct.pack(">d", 3.0)))
    assert [kept("numbers", "any", work, itself, itself) for _ in range(2)] == [[1.0, 2.0]] * 2
    assert len(calls) == 2


def test_what_cannot_be_packed_is_made_each_time() -> None:
    calls: list[int] = []

    def work() -> int:
        calls.append(1)
        return 7

    assert [kept("number", key(scene()), work, lambda _: None, lambda x: x) for _ in range(2)] == [7, 7]
    assert len(calls) == 2


def test_a_folder_that_cannot_be_written_does_not_stop_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way", "utf-8")
    monkeypatch.setenv("KEDFEM_CACHE", str(blocked / "cache"))
    found, _ = prepared(scene())
    assert found.model.links


def numbers(calls: list[int], key: str = "any") -> list[float]:
    """What is kept under a key; `calls` grows when it is made."""

    def work() -> list[float]:
        calls.append(1)
        return [1.0, 2.0]

    return kept("numbers", key, work, itself, itself)


@pytest.mark.parametrize("place", ["folder", "kind", "entry"])
def test_what_others_may_write_is_not_read(folder: Path, place: str) -> None:
    calls: list[int] = []
    numbers(calls)
    (entry,) = entries(folder)
    {"folder": folder, "kind": entry.parent, "entry": entry}[place].chmod(0o777)
    numbers(calls)
    assert len(calls) == 2


def test_entries_belong_to_their_user_alone(folder: Path) -> None:
    numbers([])
    (entry,) = entries(folder)
    assert [path.stat().st_mode & 0o077 for path in (folder, entry.parent, entry)] == [0, 0, 0]


@pytest.mark.parametrize("cut", [0, 10, 40])
def test_a_cut_entry_is_made_again(folder: Path, cut: int) -> None:
    calls: list[int] = []
    numbers(calls)
    (entry,) = entries(folder)
    entry.write_bytes(entry.read_bytes()[:cut])
    assert [numbers(calls) for _ in range(2)] == [[1.0, 2.0]] * 2
    assert len(calls) == 2


def test_every_changed_byte_is_noticed(folder: Path) -> None:
    calls: list[int] = []
    numbers(calls)
    (entry,) = entries(folder)
    whole = entry.read_bytes()
    for k in range(len(whole)):
        entry.write_bytes(whole[:k] + bytes([whole[k] ^ 1]) + whole[k + 1 :])
        assert numbers(calls) == [1.0, 2.0]
    assert len(calls) == 1 + len(whole)


def test_old_entries_go_and_those_used_longest_ago_where_space_is_short(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in "abc":
        numbers([], name)
    size = sum(entry.stat().st_size for entry in entries(folder))
    for age, entry in enumerate(sorted(entries(folder))):
        os.utime(entry, (time.time() - 60 * (age + 1),) * 2)
    kept_longest = {entry.name for entry in sorted(entries(folder))[:2]}
    monkeypatch.setattr(store, "MOST", size)
    numbers([], "d")
    left = {entry.name for entry in entries(folder)}
    assert len(left) == 3
    assert kept_longest < left
    for entry in entries(folder):
        os.utime(entry, (time.time() - store.OLDEST - 1,) * 2)
    numbers([], "e")
    assert len(list(entries(folder))) == 1


KILLED = """
import os, signal
from pathlib import Path
from kedfem.store import itself, kept

def half(path, content):
    with path.open("wb") as file:
        file.write(content[: len(content) // 2])
    os.kill(os.getpid(), signal.SIGKILL)

Path.write_bytes = half
kept("number", "key", lambda: 17, itself, itself)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
@pytest.mark.parametrize("before", [False, True])
def test_a_run_that_is_killed_while_it_writes_an_entry_leaves_none_or_the_one_before(folder: Path, before: bool) -> None:
    if before:
        assert kept("number", "key", lambda: 17, itself, itself) == 17
        (entry,) = entries(folder)
        entry.write_bytes(b"damaged")
    done = subprocess.run([sys.executable, "-c", KILLED], timeout=120, check=False)
    assert done.returncode == -signal.SIGKILL
    assert len(list(entries(folder))) == 1 + before  # what the killed run left
    assert kept("number", "key", lambda: 18, itself, itself) == 18
    assert kept("number", "key", lambda: 19, itself, itself) == 18
    assert clear(folder) == 2
    assert not [path for path in folder.rglob("*") if path.is_file()]


def test_clearing_removes_entries_and_nothing_else(folder: Path) -> None:
    numbers([])
    (folder / "numbers" / "letter.txt").write_text("mine", "utf-8")
    assert clear(folder) == 1
    assert [path.name for path in folder.rglob("*") if path.is_file()] == ["letter.txt"]


def test_the_command_tells_what_is_kept_and_clears_it(folder: Path) -> None:
    numbers([])
    said = CliRunner().invoke(app, ["cache"]).output
    assert "1 entry" in said
    assert str(folder) in said
    assert "1 entry removed" in CliRunner().invoke(app, ["cache", "--clear"]).output
    assert not list(entries(folder))
    folder.chmod(0o777)
    refused = CliRunner().invoke(app, ["cache"])
    assert "nobody else can write" in str(refused.exception)
