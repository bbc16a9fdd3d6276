"""Results: what is written is read, the status is true, and nothing old is lost."""

import csv
import errno
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from kedfem.errors import OutputError, SolveError
from kedfem.results import (
    Channel,
    Peak,
    Results,
    ResultsWriter,
    abandoned_rows,
    add_notes,
    claimed,
    read_results,
    ready_folder,
    replacing,
    write_csv,
)
from kedfem.results.additions import add_account, add_peaks, mark_unreliable
from kedfem.results.layout import read_facts, seal, write_facts
from kedfem.results.recorded import drive_channel
from kedfem.scene import scene_from

EXAMPLES = Path(__file__).parents[2] / "examples"

STRESS = Channel(
    "probes/rocker_mid/stress",
    ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises"),
    "Pa",
    "link",
    "stress at the outer side of the rocker's midpoint",
)
FORCE = Channel("joints/B/force", ("x", "y", "z"), "N", "world", "force on coupler at B")
TORQUE = Channel("drive/torque", ("torque",), "N m", "", "torque of the drive")
CHANNELS = [STRESS, FORCE, TORQUE]
SCENE_TOML = 'title = "Größe"\n' + "# a table of a motion law\n" * 4000  # above the 64 kB of an HDF5 attribute
NOTES = {"solver": "condensed", "factorisations": 3, "alpha": 0.25}


def rows(first: int, count: int) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Rows whose numbers show their place."""
    step = np.arange(first, first + count, dtype=float)
    values = {c.name: step[:, None] / 3 + np.arange(len(c.columns)) for c in CHANNELS}
    return step * 1e-3, step * 0.1, values


def writer(path: Path) -> ResultsWriter:
    return ResultsWriter(path, CHANNELS, '{"title": "Größe"}', SCENE_TOML, NOTES)


def write(path: Path, *blocks: int) -> None:
    """A whole run in blocks of so many rows."""
    with writer(path) as results:
        for block in blocks:
            results.append(*rows(results.rows, block))


def run(code: str, *arguments: Path) -> "subprocess.CompletedProcess[str]":
    """Python code in a process of its own."""
    return subprocess.run([sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True, check=False)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "results.h5"
    write(path, 5, 700, 1)  # 700 rows: beyond one chunk
    read = read_results(path)
    time, angle, values = rows(0, 706)
    np.testing.assert_array_equal(read.time, time)
    np.testing.assert_array_equal(read.angle, angle)
    assert [channel for channel, _ in read.channels.values()] == CHANNELS
    for name, expected in values.items():
        np.testing.assert_array_equal(read.channels[name][1], expected)
    assert (read.status, read.reason) == ("complete", "")
    assert (read.scene_json, read.scene_toml) == ('{"title": "Größe"}', SCENE_TOML)
    assert dict(read.notes) == NOTES
    assert read.version


def test_what_was_read_cannot_be_changed(tmp_path: Path) -> None:
    write(tmp_path / "results.h5", 2)
    read = read_results(tmp_path / "results.h5")
    with pytest.raises(ValueError, match="read-only"):
        read.channels[FORCE.name][1][0, 0] = 1.0


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("row", [0, 3])
def test_a_value_that_is_not_finite_stops_the_run_with_its_channel(tmp_path: Path, value: float, row: int) -> None:
    path = tmp_path / "results.h5"
    time, angle, values = rows(4, 5)
    values[FORCE.name][row:, 1] = value
    with pytest.raises(SolveError, match=f"joints/B/force: must be finite, got {value:g} at t = {time[row]:g} s"):
        stopped(path, time, angle, values)
    read = read_results(path)
    assert (read.status, len(read.time)) == ("interrupted", 4 + row)
    assert all(np.isfinite(values).all() for _, values in read.channels.values())


def stopped(path: Path, time: np.ndarray, angle: np.ndarray, values: dict[str, np.ndarray]) -> None:
    with writer(path) as results:
        results.append(*rows(0, 4))
        results.append(time, angle, values)


def test_changed_bytes_are_noticed(tmp_path: Path) -> None:
    """Of 300 files with one changed bit each, none is read with other contents."""
    path = tmp_path / "results.h5"
    write(path, 600)
    add_peaks(path, {"rod": Peak(2e6, "rod", (0.1, 0.2, 0.3), 7, 3, 0.01, 0.5, "a corner")})
    add_notes(path, {"error": 0.01, "way": "layers"})
    whole, true = path.read_bytes(), said(read_results(path))
    random = np.random.default_rng(3)
    noticed = 0
    for k in random.integers(len(whole), size=300):
        changed = bytearray(whole)
        changed[k] ^= 1 << random.integers(8)
        path.write_bytes(changed)
        try:
            assert said(read_results(path)) == true, f"byte {k}"
        except OutputError:
            noticed += 1
    assert noticed > 220


@pytest.mark.parametrize("text", ["layers", "Schub", "world", "Größe", "a corner", "motion law"])
def test_changed_texts_are_noticed(tmp_path: Path, text: str) -> None:
    path = tmp_path / "results.h5"
    with writer(path) as results:
        results.append(*rows(0, 2))
        results.note({"way": "layers", "part": "Schub"})
    add_peaks(path, {"rod": Peak(2e6, "rod", (0.1, 0.2, 0.3), 7, 3, 0.01, 0.5, "a corner")})
    old = text.encode()
    assert old in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(old, bytes([old[0] ^ 2]) + old[1:]))
    with pytest.raises(OutputError, match=r"text that is not what was written|corrupt"):
        read_results(path)


def said(results: Results) -> str:
    """All that a file holds."""
    numbers = [results.time, results.angle, *(values for _, values in results.channels.values())]
    values, none = [each.tobytes() for each in numbers], np.zeros(0)
    kinds = [str(channel) for channel, _ in results.channels.values()]
    rest = replace(results, channels={}, time=none, angle=none)
    return f"{rest} {kinds} {values}"


def test_units_stand_inside_the_file(tmp_path: Path) -> None:
    write(tmp_path / "results.h5", 2)
    with h5py.File(tmp_path / "results.h5", "r") as file:
        stress = read_facts(file[STRESS.name])
        assert (stress["unit"], stress["frame"], stress["description"]) == ("Pa", "link", STRESS.description)
        assert tuple(stress["columns"]) == STRESS.columns
        assert [read_facts(file[name])["unit"] for name in ("time", "drive_angle")] == ["s", "rad"]


def test_no_text_that_is_read_has_a_variable_length(tmp_path: Path) -> None:
    """HDF5 may loop for ever over a damaged heap of such texts, which no checksum covers."""
    path = tmp_path / "results.h5"
    write(path, 2)
    add_peaks(path, {"rod": Peak(2e6, "rod", (0.1, 0.2, 0.3), 7, 3, 0.01, 0.5, "a corner")})
    add_notes(path, {"way": "layers", "error": 0.01})
    mark_unreliable(path, "too much energy")
    found: list[str] = []

    def look(name: str, item: h5py.Dataset | h5py.Group) -> None:
        kinds = {key: item.attrs.get_id(key).dtype.kind for key in item.attrs if key != "DIMENSION_LIST"}
        names = item.attrs.get("CLASS") == b"DIMENSION_SCALE" and item.name != "/time"
        kinds |= {"data": item.dtype.kind} if isinstance(item, h5py.Dataset) and not names else {}
        found.extend(kinds.values())
        assert "O" not in kinds.values(), f"{name}: {kinds}"

    with h5py.File(path) as file:
        look("/", file)
        file.visititems(look)
    assert found.count("S") > 15


@pytest.mark.parametrize("wrong", [0, -1])
def test_rows_whose_place_is_lost_are_no_zeros(tmp_path: Path, wrong: int) -> None:
    """HDF5 reads rows that are said to be at the file's beginning, or nowhere, as zeros, with no word."""
    path = tmp_path / "results.h5"
    write(path, 20)
    with h5py.File(path) as file:
        place = file[TORQUE.name].id.get_chunk_info_by_coord((0,)).byte_offset
    whole, address = path.read_bytes(), place.to_bytes(8, "little")
    assert whole.count(address) == 1
    path.write_bytes(whole.replace(address, wrong.to_bytes(8, "little", signed=True)))
    with pytest.raises(OutputError, match="rows of /drive/torque that are not those that were written"):
        read_results(path)


def test_what_is_read_does_not_lie_in_a_heap(tmp_path: Path) -> None:
    """Dimensions of other readers do; of files with nothing but noise in every heap kedfem reads the same."""
    path = tmp_path / "results.h5"
    write(path, 600)
    add_account(path, ["a warning"], {"steps": 1.5})
    true, content, noise = said(read_results(path)), bytearray(path.read_bytes()), np.random.default_rng(5)
    places = [k for k in range(len(content)) if content[k : k + 4] == b"GCOL"]
    assert places
    for k in places:
        content[k : k + 4096] = noise.bytes(4096)
    path.write_bytes(content)
    assert said(read_results(path)) == true


@pytest.mark.parametrize("words", ["", "Größe ∅ 140°", "long " * 40_000, "broken \udcff byte"])
def test_notes_of_any_text_are_read_as_they_were(tmp_path: Path, words: str) -> None:
    """Empty, of many bytes a letter, beyond the 64 kB of a compact attribute, of bytes that are not UTF-8."""
    path = tmp_path / "results.h5"
    write(path, 2)
    add_notes(path, {"said": words})
    assert read_results(path).notes["said"] == words


def test_notes_can_be_added_at_the_end(tmp_path: Path) -> None:
    with writer(tmp_path / "results.h5") as results:
        results.append(*rows(0, 1))
        results.note({"wall_time": 1.5})
    assert read_results(tmp_path / "results.h5").notes["wall_time"] == 1.5


def test_warnings_and_seconds_are_stored_in_their_order(tmp_path: Path) -> None:
    path, told = tmp_path / "results.h5", [f"warning of number {k}: Größe" for k in range(12)]
    write(path, 2)
    add_account(path, told, {"steps": 1.5, "factor": 0.25})
    found = read_results(path)
    assert (found.warnings, found.seconds) == (tuple(told), {"steps": 1.5, "factor": 0.25})


def test_a_scene_made_in_python_has_no_toml(tmp_path: Path) -> None:
    with ResultsWriter(tmp_path / "results.h5", [TORQUE], "{}", None, {}):
        pass
    read = read_results(tmp_path / "results.h5")
    assert (read.scene_toml, len(read.time), read.status) == (None, 0, "complete")


def test_a_run_under_way_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    with writer(path) as results:
        results.append(*rows(0, 4))
        here = read_results(path)
        code = "import sys; from kedfem.results import read_results as r; print(r(sys.argv[1]).status)"
        elsewhere = run(code, path)
        assert abandoned_rows(path) is None
    assert (here.status, len(here.time)) == ("running", 4)
    assert abandoned_rows(path) is None
    assert elsewhere.stdout.strip() == "running", elsewhere.stderr


@pytest.mark.parametrize(
    ("error", "reason"), [(KeyboardInterrupt(), "KeyboardInterrupt"), (RuntimeError("step 7"), "RuntimeError: step 7")]
)
def test_a_stopped_run_says_so_and_keeps_its_rows(tmp_path: Path, error: BaseException, reason: str) -> None:
    path = tmp_path / "results.h5"

    def stopped() -> None:
        with writer(path) as results:
            results.append(*rows(0, 4))
            raise error

    with pytest.raises(type(error)):
        stopped()
    read = read_results(path)
    assert (read.status, read.reason, len(read.time)) == ("interrupted", reason, 4)


def test_a_killed_run_is_not_complete_and_keeps_its_rows(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys\nimport numpy as np\nfrom pathlib import Path\n"
        "from kedfem.results import *\n"
        "with ResultsWriter(Path(sys.argv[1]), [Channel('a/b', ('x',), 'N', '', '')], '{}', None, {}) as w:\n"
        "    for k in range(9): w.append(np.array([k]), np.array([k]), {'a/b': np.array([[k]])})\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert run(code, tmp_path / "results.h5").returncode == -signal.SIGKILL
    read = read_results(tmp_path / "results.h5")
    assert read.status == "abandoned"
    assert abandoned_rows(tmp_path / "results.h5") == 9
    np.testing.assert_array_equal(read.channels["a/b"][1][:, 0], np.arange(9))


def test_a_block_that_was_cut_short_leaves_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    time, angle, values = rows(4, 3)
    values[TORQUE.name] = np.full((3, 1), "words")  # refused by HDF5 after the channels before it were written

    def cut_short() -> None:
        with writer(path) as results:
            results.append(*rows(0, 4))
            results.append(time, angle, values)

    with pytest.raises((TypeError, ValueError)):
        cut_short()
    with h5py.File(path, "r") as file:
        assert {len(file[name]) for name in (STRESS.name, FORCE.name, TORQUE.name, "time", "drive_angle")} == {4}


def test_a_run_that_fails_before_its_first_rows_leaves_the_old_results(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write(path, 3)
    before = path.read_bytes()
    with pytest.raises(RuntimeError, match="no start"), writer(path):
        raise RuntimeError("no start")
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["results.h5"]


def test_the_first_rows_replace_the_old_results(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    write(path, 30)
    with writer(path) as results:
        assert len(read_results(path).time) == 30
        results.append(*rows(0, 2))
        assert len(read_results(path).time) == 2
    assert [p.name for p in tmp_path.iterdir()] == ["results.h5"]


def test_wrong_blocks_are_refused(tmp_path: Path) -> None:
    time, angle, values = rows(0, 2)
    with writer(tmp_path / "results.h5") as results:
        with pytest.raises(ValueError, match=r"must be the channels .*drive/torque"):
            results.append(time, angle, {k: v for k, v in values.items() if k != TORQUE.name})
        with pytest.raises(ValueError, match=r"must be the channels .*joints/B/force"):
            results.append(time, angle, values | {FORCE.name: np.zeros((2, 2))})


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="asks for space in another way")
def test_a_full_disk_stops_the_run_and_keeps_its_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "results.h5"

    def full(*_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def filled() -> None:
        with writer(path) as results:
            results.append(*rows(0, 4))
            monkeypatch.setattr(os, "posix_fallocate", full)
            results.append(*rows(4, 4))

    with pytest.raises(OutputError, match=r"results\.h5: must be a file that can be written, got No space left"):
        filled()
    read = read_results(path)
    assert (read.status, len(read.time)) == ("interrupted", 4)


def test_two_runs_cannot_write_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "results.h5"
    code = "import sys; from kedfem.results import *\nwith ResultsWriter(sys.argv[1], [], '{}', None, {}): pass"
    with writer(path) as results:
        results.append(*rows(0, 1))
        second = run(code, path)
    assert "must not be in use, got another run that is writing it" in second.stderr
    assert read_results(path).status == "complete"


@pytest.mark.parametrize("count", [1, 2])
def test_a_writer_that_is_refused_leaves_the_files_of_others(tmp_path: Path, count: int) -> None:
    path = tmp_path / "results.h5"
    code = (
        "import sys; import numpy as np; from kedfem.results import *\n"
        "with ResultsWriter(sys.argv[1], [Channel('a/b', ('x',), 'N', '', '')], '{}', None, {}) as w:\n"
        "    print('open', flush=True); input()\n"
        "    w.append(np.zeros(1), np.zeros(1), {'a/b': np.zeros((1, 1))})\n"
    )
    command, pipe = [sys.executable, "-c", code, str(path)], subprocess.PIPE
    others = [subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) for _ in range(count)]
    with writer(path) as first:
        assert [each.stdout and each.stdout.readline() for each in others] == ["open\n"] * count
        first.append(*rows(0, 4))
        for other in others:
            assert "must not be in use, got another run that is writing it" in other.communicate("go\n")[1]
        first.append(*rows(4, 3))
    read = read_results(path)
    assert (read.status, len(read.time)) == ("complete", 7)
    assert [p.name for p in tmp_path.iterdir()] == ["results.h5"]


@pytest.mark.parametrize("count", [2, 3])
def test_a_folder_belongs_to_one_run_at_a_time(tmp_path: Path, count: int) -> None:
    code = (
        "import os, sys; from pathlib import Path\n"
        "from kedfem.errors import OutputError\nfrom kedfem.results import claimed\n"
        "folder, held = Path(sys.argv[1]), 0\n"
        "while held < 100:\n"
        "    try:\n"
        "        with claimed(folder):\n"
        "            os.close(os.open(folder / 'alone', os.O_CREAT | os.O_EXCL))\n"
        "            (folder / 'alone').unlink(); held += 1\n"
        "    except OutputError as refused: assert 'got another run that is writing there' in str(refused)\n"
    )
    started = [
        subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stderr=subprocess.PIPE, text=True)
        for _ in range(count)
    ]
    errors = [each.communicate()[1] for each in started]
    assert [each.returncode for each in started] == [0] * count, errors
    assert list(tmp_path.iterdir()) == []


def test_three_runs_at_once_leave_one_whole_result(tmp_path: Path) -> None:
    shutil.copy(EXAMPLES / "four_bar_beams" / "scene.toml", tmp_path / "scene.toml")
    code = (
        "import sys, time; from pathlib import Path\nfrom kedfem.analysis import analyse\n"
        "from kedfem.errors import OutputError\nfrom kedfem.scene import read_scene\n"
        "folder = Path(sys.argv[1]); scene = read_scene(folder / 'scene.toml')\n"
        "output = scene.output.model_copy(update={'csv': False, 'plots': False, 'picture': False, 'animation': None})\n"
        "Path(folder / f'ready{sys.argv[2]}').touch()\n"
        "while len(list(folder.glob('ready*'))) < 3: time.sleep(0.001)\n"
        "analysis = scene.analysis.model_copy(update={'turns': 0.1})\n"
        "try: analyse(scene.model_copy(update={'output': output, 'analysis': analysis}))\n"
        "except OutputError as refused: print(refused)\n"
    )
    started = [
        subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path), str(k)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        for k in range(3)
    ]  # fmt: skip
    said, errors = zip(*[each.communicate() for each in started], strict=True)
    assert not any(errors)
    refused = [words for words in said if words]
    assert len(refused) <= 2  # all of them, but on a machine that starts one when another has ended
    assert all("must not be in use, got another run" in words for words in refused)
    assert read_results(tmp_path / "scene-results" / "results.h5").status == "complete"
    left = sorted(p.name for p in (tmp_path / "scene-results").iterdir())
    assert left == ["envelope.vtu", "peaks.csv", "results.h5", "worst.vtu"]


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path: Path) -> None:
    (tmp_path / "results.0123abcd.part.h5").touch()
    (tmp_path / "my.part.h5").touch()
    with claimed(tmp_path):
        assert not (tmp_path / "results.0123abcd.part.h5").exists()
    assert [p.name for p in tmp_path.iterdir()] == ["my.part.h5"]


def corrupt(path: Path) -> None:
    path.write_bytes(bytes(range(256)) * 8)


def truncated(path: Path) -> None:
    write(path, 600)
    path.write_bytes(path.read_bytes()[:9000])


def foreign(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["time"] = [0.0]


def newer(path: Path) -> None:
    write(path, 1)
    with h5py.File(path, "r+") as file:
        file.attrs["format"] = 99


def unknown_status(path: Path) -> None:
    write(path, 1)
    with h5py.File(path, "r+") as file:
        write_facts(file, {"status": "perfect"})
        seal(file)


def gap(path: Path) -> None:
    write(path, 1)
    with h5py.File(path, "r+") as file:
        del file["drive_angle"]


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda path: None, "must be a results file of kedfem, got no such file"),
        (Path.mkdir, "must be a results file of kedfem, got a folder"),
        (corrupt, "must be a results file of kedfem, got a corrupt file"),
        (truncated, "must be a results file of kedfem, got a corrupt file .*truncated"),
        (foreign, "must be a results file of kedfem, got another HDF5 file"),
        (newer, "must be a results file of kedfem with layout 4, got layout 99 .*: run the scene again"),
        (unknown_status, "must be a results file of kedfem, got one with a gap .*status 'perfect'"),
        (gap, "must be a results file of kedfem, got one with a gap .*angle"),
    ],
)
def test_what_is_no_results_file_is_refused(tmp_path: Path, spoil, message: str) -> None:
    path = tmp_path / "results.h5"
    spoil(path)
    with pytest.raises(OutputError, match=r"results\.h5: " + message):
        read_results(path)


@pytest.mark.parametrize("below", ["", "deeper"])
def test_a_file_in_the_way_of_the_folder(tmp_path: Path, below: str) -> None:
    (tmp_path / "taken").write_text("mine")
    folder = tmp_path / "taken" / below
    message = r"^output\.folder: must be a writable folder, got .*taken is a file: move it, or name another folder"
    with pytest.raises(OutputError, match=message):
        ready_folder(folder)
    with pytest.raises(OutputError, match=message):
        write(folder / "results.h5", 1)
    assert (tmp_path / "taken").read_text() == "mine"


@pytest.mark.parametrize("below", ["", "deeper/still"])
def test_a_link_to_nothing_in_the_way_of_the_folder(tmp_path: Path, below: str) -> None:
    """The system says "File exists" of it, of a file that is not there."""
    link = tmp_path / "link"
    try:
        link.symlink_to(tmp_path / "gone")
    except OSError:
        pytest.skip("this system makes no links")
    with pytest.raises(OutputError, match=r"link is a link to nothing: remove it, or make .*gone\)$"):
        ready_folder(link / below)
    assert link.is_symlink()
    (tmp_path / "gone").mkdir()
    assert ready_folder(link / below).is_dir()


@pytest.mark.parametrize("code", [errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EACCES])
def test_a_folder_that_takes_no_files(tmp_path: Path, code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is read-only, or full, a quota used up, a right missing: said before anything is computed."""

    def refused(**_: Any) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)
    with pytest.raises(OutputError, match=rf"^output\.folder: .*{tmp_path.name} \({os.strerror(code)}\)$"):
        write(tmp_path / "results.h5", 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(OutputError, match=r"^output\.folder: must be a writable folder, got .*Permission denied"):
        ready_folder(tmp_path)


def test_a_folder_in_the_way_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "results.h5").mkdir()
    message = r"results\.h5: must be a file that can be written, got a folder of that name"
    with pytest.raises(OutputError, match=message):
        write(tmp_path / "results.h5", 1)


def test_a_file_is_replaced_only_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("old")

    def broken() -> None:
        with replacing(path) as part:
            part.write_text("ne")
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(OutputError, match=r"table\.csv: must be a file that can be written, got No space"):
        broken()
    assert [p.read_text() for p in tmp_path.iterdir()] == ["old"]
    with replacing(path) as part:
        part.write_text("new")
    assert [p.read_text() for p in tmp_path.iterdir()] == ["new"]


def test_a_table_reads_back_equal_to_nine_digits(tmp_path: Path) -> None:
    write(tmp_path / "results.h5", 7)
    read = read_results(tmp_path / "results.h5")
    write_csv(read, tmp_path / "results.csv")
    with (tmp_path / "results.csv").open(newline="", encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    assert header[:3] == ["time [s]", "drive angle [rad]", "probes/rocker_mid/stress xx [Pa]"]
    assert header[-2:] == ["joints/B/force z [N]", "drive/torque torque [N m]"]
    blocks = [read.time[:, None], read.angle[:, None], *(values for _, values in read.channels.values())]
    np.testing.assert_allclose(np.array(lines, float), np.hstack(blocks), rtol=5e-9)  # half of the ninth
    assert max(len(x.partition("e")[0].strip("-0.").replace(".", "")) for line in lines for x in line) == 9


def test_a_table_of_part_of_a_run_says_so(tmp_path: Path) -> None:
    write(tmp_path / "results.h5", 7)
    part: Results = replace(read_results(tmp_path / "results.h5"), status="interrupted")
    write_csv(part, tmp_path / "results.csv")
    text = (tmp_path / "results.csv").read_text(encoding="utf-8")
    assert text.startswith("# not a whole run: interrupted after 7 steps\ntime [s],")


def test_a_drive_that_slides_is_told_in_metres(tmp_path: Path) -> None:
    """In the file, in what is read, in the table's header; several drives are named."""
    shape = {"kind": "bar", "between": [[0, 0], [0.2, 0]], "width": 0.02, "thickness": 0.02}
    raw = {
        "links": {"ram": {"material": "steel", "shape": shape, "mesh": {"elements": [4, 1, 1]}}},
        "joints": {"S": {"kind": "prismatic", "links": ["ground", "ram"], "at": [0, 0], "axis": "x"}},
        "drive": {"joint": "S", "motion": {"kind": "cycloidal", "travel": 0.1, "rise": 0.05}},
        "analysis": {"end_time": 0.05, "step": 0.005},
    }
    drive = drive_channel(scene_from(raw))
    with ResultsWriter(tmp_path / "results.h5", [], "{}", None, {}, drive) as file:
        file.append(np.array([0.0, 0.05]), np.array([0.0, 0.1]), {})
    with h5py.File(tmp_path / "results.h5") as file:
        assert read_facts(file["drive_travel"])["unit"] == "m"
        assert "angle" not in " ".join(file)
    found = read_results(tmp_path / "results.h5")
    assert (found.drive.name, found.drive.unit) == ("drive_travel", "m")
    assert_array_equal(found.angle, [0.0, 0.1])
    write_csv(found, tmp_path / "results.csv")
    assert (tmp_path / "results.csv").read_text().splitlines()[0] == "time [s],drive travel [m]"
