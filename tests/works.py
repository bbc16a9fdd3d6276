"""Work for processes of their own, which load no more than this to do it: it hangs, breaks down, or writes."""

import os
import signal
import time
from pathlib import Path
from typing import NoReturn


def busy(seconds: float) -> None:
    """Keeps a processor at work for so long."""
    while time.process_time() < seconds:
        pass


def busy_in(process: int) -> int:
    """The number of the process; never, in that one."""
    while os.getpid() == process:
        pass
    return os.getpid()


def busy_and_counted(file: Path) -> None:
    """One more letter in a file, then never back."""
    with file.open("a") as tries:
        tries.write("x")
    busy(60)


def loud() -> int:
    """Writes where gmsh and OpenCASCADE do: past Python."""
    return os.write(1, b"BFGS update error2") + os.write(2, b"BFGS update error2")


def endless(_: Path) -> NoReturn:
    """Reads a file for ever."""
    while True:
        pass


def killed(_: Path) -> NoReturn:
    """Breaks down at a file."""
    os.kill(os.getpid(), signal.SIGSEGV)
    time.sleep(60)
    raise AssertionError
