"""Differences between operating systems: interruption of processes, workers, limits, owners of files.

Nothing else in kedfem may need Linux; what a system does not know is left out here. Locks are filelock's.
"""

import _thread
import gc
import os
import platform
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import LazyLoader
from math import ceil
from pathlib import Path
from types import CodeType, FrameType
from typing import IO, Any

INTERRUPTIONS = ("SIGTERM", "SIGBREAK", "SIGHUP")
POLL = 0.5  # seconds between two looks for the parent
AGAIN = 0.05  # seconds until an interruption that was dropped is raised again
LATE = 75  # the exit status of a worker that was ended by `at_most`
BLAS_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
UNUSED = ("numpy.f2py", "numpy.testing", "meshio._cli", "yaml")
"""By kedfem: scipy loads all that numpy has, meshio its own commands, numba what reads settings that few have."""
_asked: list[int] = []  # the signals that have interrupted this process


def end_as_interrupted() -> None:
    """Handle the system's request to end this process as Ctrl-C, unless the process ignores that signal.

    SIGBREAK is that wish on Windows; SIGHUP is sent when a terminal is closed. Raised where Python drops what is raised
    (finalizers, functions that a library calls back), an interruption is raised again a little later.
    """
    for name in ("SIGINT", *INTERRUPTIONS):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) in {signal.SIG_DFL, signal.default_int_handler}:
            signal.signal(number, _interrupt)
    before = sys.unraisablehook

    def dropped(what: "sys.UnraisableHookArgs") -> None:
        if _asked and issubclass(what.exc_type, KeyboardInterrupt):
            again = threading.Timer(AGAIN, _interrupt_main, _asked[-1:])
            again.daemon = True
            again.start()
        else:
            before(what)

    sys.unraisablehook = dropped


def interruption_asked() -> bool:
    """Whether `end_as_interrupted` has interrupted this process: what else goes wrong then may come of that."""
    return bool(_asked)


def _interrupt(number: int, frame: FrameType | None) -> None:
    del frame
    _asked.append(number)
    raise KeyboardInterrupt


def _interrupt_main(number: int) -> None:
    """Send the main thread a signal; where a system has none for threads, it is not woken from waiting."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        _thread.interrupt_main(signal.Signals(number))


@contextmanager
def caught_in(call: CodeType, caught: Callable[[BaseException], None]) -> Iterator[None]:
    """Hand on what signals raise while a function is at work that compiled code calls, from its first instruction on.

    Raised there, it would be printed and forgotten; a `try` of the function's own begins too late. Elsewhere, as before.
    """

    def watched(before: Callable[[int, FrameType | None], Any]) -> Callable[[int, FrameType | None], None]:
        def on_signal(number: int, frame: FrameType | None) -> None:
            try:
                before(number, frame)
            except BaseException as error:
                while frame is not None and frame.f_code is not call:
                    frame = frame.f_back
                if frame is None:
                    raise
                caught(error)

        return on_signal

    main = threading.current_thread() is threading.main_thread()  # Python handles signals in the main thread alone
    numbers = [getattr(signal, name) for name in ("SIGINT", *INTERRUPTIONS) if main and hasattr(signal, name)]
    before = {number: each for number in numbers if callable(each := signal.getsignal(number))}
    try:
        for number, each in before.items():
            signal.signal(number, watched(each))
        yield
    finally:
        for number, each in before.items():
            signal.signal(number, each)


@contextmanager
def ended_at_once(words: str) -> Iterator[None]:
    """Let what interrupts this process end it at once, while a library computes for seconds and Python hears of nothing.

    For work that leaves nothing half done. The exit status is the signal's own; a shell beside it, which finds that its
    input has ended, says the words. Undisturbed where interruptions are not `end_as_interrupted`, or there is no shell.
    """
    import subprocess

    main = threading.current_thread() is threading.main_thread()
    numbers = [getattr(signal, name) for name in ("SIGINT", *INTERRUPTIONS) if main and hasattr(signal, name)]
    ours = [number for number in numbers if signal.getsignal(number) is _interrupt]
    if os.name != "posix" or not ours:
        yield
        return
    shown = "\033[?25h" * sys.stderr.isatty()  # progress bars hide the cursor
    say = ["/bin/sh", "-c", 'read done || printf "%s\n" "$0" >&2', shown + words]
    with subprocess.Popen(say, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, start_new_session=True) as beside:
        try:
            for number in ours:
                signal.signal(number, signal.SIG_DFL)
            yield
        finally:
            for number in ours:
                signal.signal(number, _interrupt)
            beside.communicate(b"\n")


def import_quickly() -> None:
    """Let a process of kedfem's own import in less time, until `imported`; called before numpy is loaded.

    Imports drop nothing, but what looks for that takes a tenth of their time. What is `UNUSED` is loaded when it is used.
    """
    gc.set_threshold(400_000)
    sys.meta_path.insert(0, _Unused())


def imported() -> None:
    """What was imported stays, and is not looked through again."""
    gc.freeze()
    gc.set_threshold(10_000)


class _Unused:
    """Finds modules that are loaded when they are used."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: object = None) -> ModuleSpec | None:
        del target
        spec = PathFinder.find_spec(name, path) if name in UNUSED else None
        if spec and spec.loader:
            spec.loader = LazyLoader(spec.loader)
        return spec


@cache
def end_with_parent() -> None:
    """End this process soon after its parent, however that ended; called again, it does nothing.

    Where a system keeps the parent's number after its end (Windows) nothing is noticed.
    """
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(POLL)
        os._exit(1)

    threading.Thread(target=watch, name="end with parent", daemon=True).start()


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """End a worker, with status LATE, where what it does within takes more processor time; no other process.

    A thread watches it: libraries that are called let others run. A limit within that of `bounded`, on every system.
    """
    if not end_with_parent.cache_info().currsize:
        yield
        return
    done, end = threading.Event(), time.process_time() + seconds

    def watch() -> None:
        while not done.wait(POLL):
            if time.process_time() > end:
                os._exit(LATE)

    threading.Thread(target=watch, name="at most", daemon=True).start()
    try:
        yield
    finally:
        done.set()


@contextmanager
def bounded(seconds: float, memory: float) -> Iterator[None]:
    """A limit of this process's further processor time [s] and of its memory [bytes], where the system knows such limits.

    Past the first the system ends the process; past the second there is a MemoryError. No core is dumped.
    """
    try:
        import resource
    except ImportError:
        yield
        return
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
    resource.setrlimit(resource.RLIMIT_CPU, (ceil(time.process_time() + seconds), hard))
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    bound = int(memory) if most == resource.RLIM_INFINITY else min(int(memory), most)
    resource.setrlimit(resource.RLIMIT_DATA, (bound, most))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        resource.setrlimit(resource.RLIMIT_CPU, (hard, hard))


def one_blas_thread() -> None:
    """Give BLAS one thread where the user does not say how many; called before numpy is loaded.

    On kedfem's sizes two are no faster, and beside another busy process they wait for each other most of the time.
    """
    if not any(name in os.environ for name in BLAS_THREADS):
        os.environ["OPENBLAS_NUM_THREADS"] = "1"


def threads() -> int:
    """How many threads may work at once: as many as OMP_NUM_THREADS says, else one a processor."""
    given = os.environ.get("OMP_NUM_THREADS", "")
    return int(given) if given.isdecimal() and int(given) > 0 else os.cpu_count() or 1


def reserve(file: IO[bytes], size: int) -> None:
    """Take so many bytes of the disk for a file; written where the system cannot reserve them.

    Raises
    ------
    OSError
        There are not so many.
    """
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, size)
    else:
        file.write(bytes(size))
        file.flush()


def private(path: Path) -> bool:
    """Whether only this user can write a file or folder; always, where the system does not know such owners.

    Raises
    ------
    OSError
        There is none.
    """
    if not hasattr(os, "getuid"):
        return True
    status = path.stat()
    return status.st_uid == os.getuid() and not status.st_mode & 0o022


def machine() -> str:
    """The machine and the threads allowed, in words."""
    from kedfem import __version__

    name = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text().splitlines()
        name = next((line.split(":", 1)[1].strip() for line in lines if "model name" in line), name)
    threads = os.environ.get("OMP_NUM_THREADS", "not set")
    software = f"Python {platform.python_version()}, kedfem {__version__}"
    return f"{name}, {os.cpu_count()} cores, OMP_NUM_THREADS {threads}, {software}"
