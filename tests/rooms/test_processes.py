"""Processes end when they are told to, and workers with their parent."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

BUSY = """
import os, sys, time
from pathlib import Path
from kedfem.mesh.apart import LONGEST, PART, apart

def busy(file):
    file.write_text(str(os.getpid()))
    time.sleep(60)

apart("part", PART, LONGEST, busy, Path(sys.argv[1]))
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
