"""What compiled code makes of indices and constants is what Python makes of them."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from kedfem.indexing_kernel import compact


@pytest.fixture
def indices() -> Iterator[None]:
    """As in kedfem's own code."""
    outside = compact.set(True)
    yield
    compact.reset(outside)


@pytest.mark.usefixtures("indices")
@pytest.mark.parametrize("of", [np.arange(7.0), np.arange(14.0)[::2], np.zeros(0), np.arange(6) % 2 == 0])
def test_parts_are_those_of_python(of: np.ndarray) -> None:
    part, tail, head = (
        numba.njit(lambda x, i, j: x[i:j]),
        numba.njit(lambda x, i: x[i:]),
        numba.njit(lambda x, j: x[:j]),
    )
    for i in range(-9, 10):
        assert_array_equal(tail(of, i), of[i:])
        assert_array_equal(head(of, i), of[:i])
        for j in range(-9, 10):
            got = part(of, i, j)
            assert_array_equal(got, of[i:j])
            assert got.nbytes == of[i:j].nbytes


@pytest.mark.usefixtures("indices")
@pytest.mark.parametrize("of", [np.arange(60.0).reshape(3, 4, 5), np.arange(120.0).reshape(3, 4, 10)[:, :, ::2]])
def test_elements_and_parts_in_several_directions_are_those_of_python(of: np.ndarray) -> None:
    every = numba.njit(lambda x, i, j, k: (x[i], x[i, j], x[i, j, k], x[i:, j], x[i, j:, k], x[1:j, :, i:k], x[-1, j]))
    plain = every.py_func
    for i in range(-3, 3):
        for j in range(-4, 4):
            for k in range(-5, 5):
                for got, wanted in zip(every(of, i, j, k), plain(of, i, j, k), strict=True):
                    assert_array_equal(got, wanted)


@pytest.mark.usefixtures("indices")
def test_elements_are_set_where_python_sets_them() -> None:
    def place(x: Any, y: Any, i: Any, j: Any) -> None:
        x[i, j], x[i, -1], y[j], y[0], y[i:j] = 1, 2.5, 3, 4.0, 7.0

    fast = numba.njit(place)
    for i in range(-2, 2):
        for j in range(-3, 3):
            got, wanted = (np.zeros((2, 6))[:, ::2], np.zeros(3)), (np.zeros((2, 3)), np.zeros(3))
            fast(*got, i, j)
            place(*wanted, i, j)
            for one, other in zip(got, wanted, strict=True):
                assert_array_equal(one, other)


PARTS = """
from kedfem.compiled import compiled, inner

@inner
def root(x, times, whether):
    if x < 0:
        raise ValueError("must not be negative")
    return times * x**0.5 if whether else x

@compiled
def one(x):
    return root(x, 1, True) + 1.0

@compiled
def other(x):
    return root(x, 2, True) + root(x, 3, False)
"""
CALLED = """
import sys
sys.path.insert(0, sys.argv[1])
import parts_kernel
called = getattr(parts_kernel, sys.argv[2])
print(called(9.0))
try:
    called(-1.0)
except ValueError as error:
    print(error.args, len(parts_kernel.root.stats.cache_hits))
"""


def test_a_part_that_was_kept_becomes_one_of_another_loop_and_takes_its_constants(tmp_path: Path) -> None:
    """It has no machine code of its own; what it raises comes out of the loop."""
    (tmp_path / "parts_kernel.py").write_text(PARTS)
    environment = os.environ | {"KEDFEM_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)
    said = []
    for name in ("one", "one", "other"):
        command = [sys.executable, "-c", CALLED, str(tmp_path), name]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=True)
        said.append(done.stdout.split("\n")[:2])
    message = "('must not be negative',)"
    assert said == [["4.0", f"{message} 0"], ["4.0", f"{message} 0"], ["15.0", f"{message} 1"]]
    kept = list((tmp_path / "cache").rglob("parts_kernel.root*.nbc"))
    assert len(kept) == 1  # for all constants that it is called with


LATER = """
import numba
numba.version_info = numba.version_info._replace(short=(99, 0))
"""


def test_another_numba_compiles_in_its_own_way(tmp_path: Path) -> None:
    """A later one, whose insides may be others."""
    (tmp_path / "parts_kernel.py").write_text(PARTS)
    environment = os.environ | {"KEDFEM_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, "-c", LATER + CALLED, str(tmp_path), "other"]
    for _ in ("compiled", "kept"):
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=True)
        assert done.stdout.split("\n")[:2] == ["15.0", "('must not be negative',) 0"]


AT_ONCE = """
import sys, time
sys.path.insert(0, sys.argv[1])
from kedfem.compiled import compiling
import parts_kernel
one = parts_kernel.one
begin = one._compiler.compile
def slowly(*given):
    time.sleep(4.0)
    return begin(*given)
one._compiler.compile = slowly
told = []
with compiling(told.append):
    one(9.0)
assert told == [True, False]
print(len(one.stats.cache_misses), len(parts_kernel.root.stats.cache_misses))
"""


def test_of_two_processes_that_need_the_same_loop_one_waits_for_the_other(tmp_path: Path) -> None:
    """Both say that it is compiled."""
    (tmp_path / "parts_kernel.py").write_text(PARTS)
    environment = os.environ | {"KEDFEM_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, "-c", AT_ONCE, str(tmp_path)]
    both = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    assert sorted(each.communicate(timeout=120)[0] for each in both) == ["0 0\n", "1 1\n"]


WAYS = """
@inner
def led(x, rest, pair):
    total, least, last = 0.0, x[0], -1
    for k in range(len(x)):
        if x[k] < 0.0:
            continue
        least, last = min(least, x[k]), k
        step = x[k] if k % 2 else pair[1] * x[k]
        while step > 4.0:
            step -= pair[0]
            if step < 4.5:
                break
        total += step
    if rest is not None:
        for y in rest[1:]:
            total += y
            last = -last
    first, second = pair
    return total, least, last, first // second

@compiled
def both(x):
    one, other = led(x, None, (3, 0.5)), led(x, x[2:], (2, 0.25))
    return one[0], one[1], one[2], one[3], other[0], other[1], other[2], other[3]
"""
ASKED = """
import sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from ways_kernel import both
print(both(np.array(eval(sys.argv[2]))))
"""


def test_parts_do_what_python_does(tmp_path: Path) -> None:
    """Numba's own passes are left out of what compiles them; loops, branches, breaks and None stay what they are."""
    numbers = [2.0, -1.0, 9.5, 7.25, 0.5, 11.0]
    (tmp_path / "ways_kernel.py").write_text("from kedfem.compiled import compiled, inner\n" + WAYS)
    environment = os.environ | {"KEDFEM_CACHE": str(tmp_path / "cache")}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, "-c", ASKED, str(tmp_path), str(numbers)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=True)
    plain: dict[str, Any] = {"inner": lambda f: f, "compiled": lambda f: f}
    exec(WAYS, plain)
    assert done.stdout.strip() == str(plain["both"](numbers))
