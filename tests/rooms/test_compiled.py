"""Compiled loops are kept for one state of all kernels together."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("numba")

from kedfem import compiled
from kedfem.store import entries

ROOT = Path(__file__).parents[2]
EXAMPLES = "rssr", "four_bar_corotational", "motor_four_bar", "spinning_bar"
BEFOREHAND = """
import sys
from kedfem.analysis import analyse
from kedfem.compiled import compiling
from kedfem.dynamics.system.step_kernel import marched
from kedfem.precompile import precompile
from kedfem.scene import read_scene
precompile(lambda *_: None)
told = []
with compiling(told.append):
    for scene in sys.argv[1:]:
        read = read_scene(scene)
        analyse(read.model_copy(update={"analysis": read.analysis.model_copy(update={"accuracy": "quick"})}))
assert not told
assert len(marched.signatures) == 2, marched.signatures  # without constraint equations, and with them
precompile(lambda *given: told.append(given))  # all is there: nothing is run again
assert not told
"""


def test_a_change_in_any_kernel_begins_a_new_folder(tmp_path: Path) -> None:
    """Else a loop would go on with what it compiled of a function in another file, before that was changed."""
    (tmp_path / "room").mkdir()
    files = [tmp_path / "loop_kernel.py", tmp_path / "room" / "sum_kernel.py", tmp_path / "other.py"]
    for file in files:
        file.write_text("x = 1\n")
    first = compiled.kernel_folder(tmp_path)
    files[2].write_text("x = 2\n")
    assert compiled.kernel_folder(tmp_path) == first
    files[1].write_text("x = 2\n")
    assert compiled.kernel_folder(tmp_path) != first


def test_a_change_in_what_a_kernel_imports_begins_a_new_folder(tmp_path: Path) -> None:
    """Constants of other files are frozen in what is compiled; a slide was once computed as a distance."""
    root = tmp_path / "package"
    (root / "room").mkdir(parents=True)
    kernel, constants, other = (root / name for name in ("loop_kernel.py", "room/kinds.py", "room/other.py"))
    kernel.write_text("from package.room.kinds import TURN, SLIDE\n")
    constants.write_text("TURN, SLIDE = 0, 1\n")
    other.write_text("")
    first = compiled.kernel_folder(root)
    other.write_text("x = 1\n")
    assert compiled.kernel_folder(root) == first
    constants.write_text("TURN, SLIDE = 1, 0\n")
    assert compiled.kernel_folder(root) != first


@pytest.mark.parametrize("name", ["dynamics/system/record.py", "compiled.py"])
def test_the_kinds_of_laws_and_the_options_of_the_compiler_are_in_it(tmp_path: Path, name: str) -> None:
    root = tmp_path / compiled.ROOT.name
    for file in (*compiled.ROOT.rglob("*_kernel.py"), compiled.ROOT / name):
        copy = root / file.relative_to(compiled.ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(file.read_bytes())
    first = compiled.kernel_folder(root)
    (root / name).write_text((root / name).read_text() + "MORE = 1\n")
    assert compiled.kernel_folder(root) != first


def test_all_records_that_kernels_are_given_are_in_it() -> None:
    """A class that moved was an AttributeError on every cache that had been made before."""
    files = compiled.ROOT.rglob("*.py")
    records = {
        file for file in files if re.search(r"^class \w+\((NamedTuple|namedtuple)\b", file.read_text(), re.MULTILINE)
    }
    assert records == {compiled.ROOT / name for name in compiled.RECORDS}


def test_a_change_of_these_records_begins_a_new_folder(tmp_path: Path) -> None:
    record = tmp_path / compiled.RECORDS[0]
    record.parent.mkdir(parents=True)
    record.write_text("x = 1\n")
    first = compiled.kernel_folder(tmp_path)
    record.write_text("x = 2\n")
    assert compiled.kernel_folder(tmp_path) != first


@pytest.mark.skipif("NUMBA_CACHE_DIR" in os.environ, reason="the user has chosen a folder")
def test_what_is_compiled_goes_there() -> None:
    from kedfem.dynamics.system.linear_kernel import marched_linear

    assert Path(marched_linear.stats.cache_path).is_relative_to(compiled.kernel_folder(compiled.ROOT))


def test_it_is_kept_for_the_user_even_where_the_cache_is_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("KEDFEM_CACHE", "off")
    assert compiled.kernel_folder(compiled.ROOT).is_relative_to(tmp_path)
    monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path / "named"))
    assert compiled.kernel_folder(compiled.ROOT).is_relative_to(tmp_path / "named" / "kernels")
    (tmp_path / "file").touch()
    monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path / "file"))
    assert compiled.kernel_folder(compiled.ROOT).is_relative_to(compiled.ROOT / "__pycache__")


def test_it_counts_among_what_the_cache_holds(tmp_path: Path) -> None:
    code = tmp_path / "kernels" / "0123" / "room_4567" / "loop_kernel.nbi"
    code.parent.mkdir(parents=True)
    code.touch()
    assert list(entries(tmp_path)) == [code]


def test_the_user_is_told_while_it_compiles() -> None:
    import numba

    inner = numba.njit(lambda x: x + 1)
    told: list[bool] = []
    with compiled.compiling(told.append):
        outer = numba.njit(lambda x: inner(x) + inner(2.0))
        assert outer(1.0) == 5.0
        assert outer(3.0) == 7.0
    assert told == [True, False]


@pytest.mark.long
def test_after_compiling_beforehand_no_scene_compiles_anything(tmp_path: Path) -> None:
    scenes = [shutil.copytree(ROOT / "examples" / each, tmp_path / each) / "scene.toml" for each in EXAMPLES]
    subprocess.run([sys.executable, "-c", BEFOREHAND, *scenes], check=True, timeout=600)


def test_an_installation_whose_kernels_are_newer_or_elsewhere_is_compiled_for_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numba uses nothing that it kept of these; `kedfem compile` once said that all was there, and scenes compiled."""
    from kedfem.compiled import all_compiled

    def marker(folder: str, time: int) -> Path:
        kernel = tmp_path / folder / "loop_kernel.py"
        kernel.parent.mkdir(exist_ok=True)
        kernel.write_text("x = 1\n")
        os.utime(kernel, (time, time))
        monkeypatch.setattr(compiled, "ROOT", kernel.parent)
        return all_compiled()

    assert marker("first", 1) == marker("first", 1)
    assert len({marker("first", 1), marker("first", 2), marker("second", 1)}) == 3


def test_of_two_processes_that_compile_for_different_types_each_keeps_its_own(tmp_path: Path) -> None:
    """Numba names files of code by their number in a list that it reads and writes: two could take the same number."""
    source = tmp_path / "loop_kernel.py"
    source.write_text("from kedfem.compiled import compiled\n\n@compiled\ndef twice(x):\n    return x + x\n")
    code = f"""
import sys, time
sys.path.insert(0, {str(tmp_path)!r})
import loop_kernel
file = loop_kernel.twice._cache._cache_file
index = file._save_index
def slowly(listed):
    time.sleep(1.0)
    index(listed)
file._save_index = slowly
loop_kernel.twice(eval(sys.argv[1]))
"""
    environment = os.environ | {"KEDFEM_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)
    both = [subprocess.Popen([sys.executable, "-c", code, given], env=environment) for given in ("1", "1.5")]
    assert [each.wait(timeout=120) for each in both] == [0, 0]
    assert len(list((tmp_path / "cache").rglob("loop_kernel*.nbc"))) == 2


RESIDUALS = """
import numpy as np
from kedfem.compiled import compiling
from kedfem.results.stresses.envelope_kernel import residuals_of
told, out = [], np.zeros((5, 1, 2))
with compiling(told.append):
    residuals_of(np.array([[0.0], [1.0], [0.0]]), 1, out)
assert out[0, 0, 0] == 1.0
print("compiled" if told else "read")
"""


@pytest.mark.parametrize("end", ["nbi", "nbc"])
def test_a_file_of_compiled_code_with_a_flipped_bit_is_made_again_without_a_word(end: str, tmp_path: Path) -> None:
    environment = {k: x for k, x in os.environ.items() if k != "NUMBA_CACHE_DIR"} | {"KEDFEM_CACHE": str(tmp_path)}

    def ran() -> str:
        command = [sys.executable, "-W", "error", "-c", RESIDUALS]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
        assert not done.stderr
        return done.stdout.strip()

    assert (ran(), ran()) == ("compiled", "read")
    for file in (tmp_path / "kernels").rglob(f"*.{end}"):
        content = bytearray(file.read_bytes())
        content[len(content) // 2] ^= 1
        stat = file.stat()
        file.write_bytes(content)
        os.utime(file, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    assert (ran(), ran()) == ("compiled", "read")
