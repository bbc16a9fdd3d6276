"""Processes end when they are told to, and workers with their parent."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

import kedfem
from kedfem.errors import MeshError
from kedfem.mesh import isolated
from kedfem.mesh.isolated import LONGEST, PART, in_own_process, side_by_side
from kedfem.processes import BLAS_THREADS, POLL, UNUSED, at_most

BUSY = """
import os, sys, time
from pathlib import Path
from kedfem.mesh.isolated import LONGEST, PART, in_own_process

def busy(file):
    file.write_text(str(os.getpid()))
    time.sleep(60)

in_own_process("part", PART, LONGEST, busy, Path(sys.argv[1]))
"""

QUICK = """
import sys
from kedfem.processes import UNUSED, import_quickly
import_quickly()
import kedfem.analysis, meshio, numba
print([type(sys.modules[name]).__name__ for name in UNUSED])
from numpy.testing import assert_allclose
assert_allclose(1.0, 1.0)
"""

TOLD = """
import signal, sys, time
from kedfem.processes import end_as_interrupted
number = signal.Signals[sys.argv[1]]
signal.signal(number, signal.SIG_DFL if sys.argv[2] == "usual" else signal.SIG_IGN)
end_as_interrupted()
try:
    print("ready", flush=True)
    time.sleep(2.0)
    print("undisturbed")
except KeyboardInterrupt:
    print("interrupted")
"""


def within(seconds: float, true: Callable[[], bool]) -> bool:
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def alive(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"  # ended, and nobody has asked for its status yet


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at /proc")
def test_a_worker_ends_with_its_killed_parent(tmp_path: Path) -> None:
    file = tmp_path / "worker"
    parent = subprocess.Popen([sys.executable, "-c", BUSY, str(file)])
    try:
        assert within(60.0, lambda: file.exists() and file.read_text() != "")
    finally:
        parent.kill()
        parent.wait()
    worker = int(file.read_text())
    try:
        assert within(10.0, lambda: not alive(worker))
    finally:
        if alive(worker):
            os.kill(worker, signal.SIGKILL)


def reading(file: Path, hangs: int) -> int:
    """Work that hangs as it reads in the first so many processes; the number of the one that came to its end."""
    tried = len(file.read_text()) + 1
    file.write_text(tried * "x")
    with at_most(0.2):
        while tried <= hangs:
            pass
    return tried


def test_a_part_that_hangs_as_it_is_read_is_tried_in_three_processes(tmp_path: Path) -> None:
    file = tmp_path / "tries"
    file.write_text("")
    assert in_own_process("part", PART, LONGEST, reading, file, 2) == 3
    file.write_text("")
    with pytest.raises(MeshError, match=r"^part: must be a part .*, got one that they had not read in time; mend"):
        in_own_process("part", PART, LONGEST, reading, file, 9)
    assert file.read_text() == "xxx"


def test_a_part_that_breaks_down_after_a_rest_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The process that waited has ended by then; that of the next one's end is seen too."""
    monkeypatch.setattr("kedfem.mesh.isolated.IDLE", 0.2)
    monkeypatch.setattr("kedfem.mesh.isolated.PATIENCE", 60)
    file = tmp_path / "tries"
    for hangs, expected in ((0, 1), (1, 2)):
        file.write_text("")
        assert in_own_process("part", PART, LONGEST, reading, file, hangs) == expected
        assert within(30.0, lambda: not isolated.IDLE_WORKERS)
    file.write_text("")
    with pytest.raises(MeshError, match="had not read in time"):
        in_own_process("part", PART, LONGEST, reading, file, 9)


def together(here: Path, other: Path) -> int:
    """Work that ends once that in another process has begun too; the number of its process."""
    here.touch()
    assert within(60.0, other.exists)
    return os.getpid()


def test_two_pieces_of_work_are_done_at_once_in_two_processes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    one, other = tmp_path / "one", tmp_path / "other"
    works = {"a": (one, other), "b": (other, one)}
    found = side_by_side(
        {name: partial(in_own_process, "part", PART, LONGEST, together, *files) for name, files in works.items()}
    )
    assert list(found) == ["a", "b"]
    assert found["a"] != found["b"]
    assert os.getpid() not in found.values()


def waiting(file: Path) -> None:
    file.write_text(str(os.getpid()))
    time.sleep(120.0)


def wrong(file: Path) -> None:
    assert within(60.0, lambda: file.exists() and file.read_text() != "")
    raise MeshError("wrong")


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at /proc")
def test_what_goes_on_beside_a_mistake_is_ended_and_what_has_not_begun_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    begun, never = tmp_path / "begun", tmp_path / "never"
    works = {"first": (wrong, begun), "second": (waiting, begun), "third": (waiting, never)}
    since = time.monotonic()
    with pytest.raises(MeshError, match=r"^wrong$"):
        side_by_side(
            {name: partial(in_own_process, "part", PART, LONGEST, work, file) for name, (work, file) in works.items()}
        )
    assert time.monotonic() - since < 60.0
    assert within(10.0, lambda: not alive(int(begun.read_text())))
    assert in_own_process("part", PART, LONGEST, abs, -4) == 4


def test_a_process_that_is_no_worker_is_not_ended() -> None:
    with at_most(0.0):
        end = time.process_time() + 2 * POLL
        while time.process_time() < end:
            pass


@pytest.mark.parametrize("name", [name for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)])
@pytest.mark.parametrize(("before", "end"), [("usual", "interrupted"), ("ignored", "undisturbed")])
def test_a_wish_to_end_is_ctrl_c_unless_it_was_ignored_before(name: str, before: str, end: str) -> None:
    """`nohup kedfem run` goes on when its terminal is closed."""
    process = subprocess.Popen([sys.executable, "-c", TOLD, name, before], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.Signals[name])
    said, _ = process.communicate(timeout=30)
    assert said.strip() == end


DROPPED = """
import ctypes, os, signal, sys, time, weakref
from kedfem.processes import end_as_interrupted
signal.signal(signal.SIGINT, signal.default_int_handler)  # whatever the one that runs the tests ignores
end_as_interrupted()

def struck(*_):
    os.kill(os.getpid(), signal.Signals[sys.argv[2]])
    for _ in range(100):
        pass  # here it is raised, and nobody hears of it

class Finalized:
    def __del__(self):
        struck()

class Plain:
    pass

def finalizer():
    Finalized()

def weak_reference():
    plain = Plain()
    seen = weakref.ref(plain, struck)
    del plain

def called_back():
    ctypes.CFUNCTYPE(None)(struck)()

try:
    globals()[sys.argv[1]]()
    print("went on")
    time.sleep(30.0)
    print("undisturbed")
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="a process cannot send itself signals there")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("where", ["finalizer", "weak_reference", "called_back"])
def test_an_interruption_that_python_drops_is_raised_again(where: str, name: str) -> None:
    """What is raised in a finalizer or a function that C calls is otherwise printed, forgotten, and the run goes on."""
    done = subprocess.run(
        [sys.executable, "-c", DROPPED, where, name], capture_output=True, text=True, timeout=30, check=False
    )
    assert done.stdout.split() == ["went", "on", "interrupted"]
    assert done.stderr == ""


HELD = """
import ctypes, signal, sys
from kedfem.processes import end_as_interrupted, ended_at_once
signal.signal(signal.SIGINT, signal.default_int_handler)
end_as_interrupted()
held = ctypes.PyDLL(None).sleep  # as a library that lets no other thread of Python run
try:
    with ended_at_once("interrupted at work"):
        print("ready", flush=True)
        held(0 if sys.argv[1] == "after" else 20)
    print("done", flush=True)
    held(1)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_an_interruption_ends_a_library_that_lets_no_signal_through(name: str) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HELD, "within"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    sent = time.monotonic()
    process.send_signal(signal.Signals[name])
    assert process.communicate(timeout=30) == ("", "interrupted at work\n")
    assert time.monotonic() - sent < 2.0
    assert process.returncode == -signal.Signals[name]


@pytest.mark.skipif(os.name != "posix", reason="needs a shell")
def test_after_such_work_an_interruption_is_as_before() -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", HELD, "after"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert [process.stdout.readline() for _ in range(2)] == ["ready\n", "done\n"]
    process.send_signal(signal.SIGTERM)
    assert process.communicate(timeout=30) == ("interrupted\n", "")
    assert process.returncode == 0


MASKED = """
import builtins, os, signal, sys
from pathlib import Path
real = builtins.__import__

def masked(name, globals=None, locals=None, fromlist=(), level=0):
    asks = str((globals or {}).get("__name__", ""))
    if asks.startswith("kedfem") and name.split(".")[0] in {"resource", "fcntl", "pwd", "grp", "termios", "syslog"}:
        raise ImportError(f"{name} is not on this system")
    return real(name, globals, locals, fromlist, level)

builtins.__import__ = masked
for module, name in ((os, "getuid"), (os, "posix_fallocate"), (os, "O_NOFOLLOW"), (signal, "SIGHUP"), (os, "mkfifo")):
    if hasattr(module, name):
        delattr(module, name)
from kedfem.cli import main
main()
"""


@pytest.mark.long
def test_nothing_needs_what_other_systems_lack(tmp_path: Path) -> None:
    """The names that only Linux, or no Windows, has are taken away: a scene with a meshed link is run, drawn and kept."""
    text = """
[links.arm]
material = "steel"
model = "solid"
shape = { kind = "plate_link", between = [[0, 0], [0.1, 0]], width = 0.02, thickness = 0.01, bore_diameter = 0.01 }
mesh = { size = 0.01 }
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = [0, 0]
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "60 rpm" }
[analysis]
revolutions = 0.1
steps_per_revolution = 100
accuracy = "quick"
initial = "quasi-static"
"""
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    environment = os.environ | {"KEDFEM_CACHE": str(tmp_path / "cache"), "OMP_NUM_THREADS": "1"}
    (tmp_path / "cache").mkdir(mode=0o700)
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", MASKED, "run", "scene.toml"], cwd=tmp_path, env=environment,
            capture_output=True, text=True, timeout=300, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        assert "Traceback" not in done.stderr
    assert (tmp_path / "scene-results" / "results.h5").exists()
    assert (tmp_path / "scene-results" / "worst.png").exists()


def test_the_packages_imports_name_no_system() -> None:
    """Modules that some systems lack are imported in `processes` alone, where their absence is provided for."""
    package = Path(kedfem.__file__).parent
    absent = re.compile(r"^\s*(?:import|from) (?:resource|fcntl|pwd|grp|termios|syslog)\b", re.MULTILINE)
    named = {path.name for path in package.rglob("*.py") if absent.search(path.read_text(encoding="utf-8"))}
    assert named == {"processes.py"}


def test_drawing_scripts_end_with_their_parent() -> None:
    """What they call is tried above; that they call it is read."""
    package = Path(kedfem.__file__).parent
    for name in ("rendering", "mesh_rendering"):
        text = (package / "output" / f"{name}.py").read_text(encoding="utf-8")
        assert 'if __name__ == "__main__":\n    end_with_parent()\n' in text


@pytest.mark.parametrize(
    ("given", "threads"), [({}, "1"), ({"OMP_NUM_THREADS": "3"}, None), ({"OPENBLAS_NUM_THREADS": "2"}, "2")]
)
def test_the_command_line_gives_blas_one_thread_before_it_is_loaded(given: dict[str, str], threads: str | None) -> None:
    told = (
        "import atexit, os, sys; import kedfem.cli; before = 'numpy' in sys.modules\n"
        "atexit.register(lambda: print(before, os.environ.get('OPENBLAS_NUM_THREADS')))\n"
        "sys.argv = ['kedfem', '--help']; kedfem.cli.main()"
    )
    free = {name: value for name, value in os.environ.items() if name not in BLAS_THREADS}
    done = subprocess.run([sys.executable, "-c", told], env=free | given, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == f"False {threads}"


def test_what_nothing_uses_is_loaded_when_it_is_used() -> None:
    """scipy loads all that numpy has."""
    said = subprocess.run([sys.executable, "-c", QUICK], capture_output=True, text=True, check=True, timeout=60)
    assert said.stdout.strip() == str(["_LazyModule"] * len(UNUSED))
