"""Compiled loops are kept for one state of all kernels together."""

import os
from pathlib import Path

import pytest

pytest.importorskip("numba")

from kedfem import compiled


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


def test_the_kinds_of_actions_and_the_options_of_the_compiler_are_in_it() -> None:
    from kedfem.compiled import ROOT, _imported

    files = _imported(ROOT / "dynamics" / "actions_kernel.py", ROOT)
    assert {ROOT / "dynamics" / "action.py", ROOT / "compiled.py"} <= files


@pytest.mark.skipif("NUMBA_CACHE_DIR" in os.environ, reason="the user has chosen a folder")
def test_what_is_compiled_goes_there() -> None:
    from kedfem.dynamics.kernel import times

    assert Path(times.stats.cache_path).is_relative_to(compiled.kernel_folder(compiled.ROOT))
