"""Calls of libraries in separate processes: their output is suppressed, and crashes and hangs become errors."""

import atexit
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import Any, TypeVar

from kedfem.errors import MeshError
from kedfem.mesh.cad.file import silent
from kedfem.mesh.memory_forecast import memory
from kedfem.processes import LATE, bounded, end_with_parent, threads

LONGEST = 180  # seconds of processor time for a part
READING = 60  # seconds of processor time for a mesh file
TRIES = 3  # processes that try a part which cannot be read in time
IDLE = 180  # seconds after which a process without work is ended
AGAIN = 0.05  # seconds between two attempts to end processes that are no longer needed
MOST_MEMORY = 6e9  # bytes that a process may hold
PATIENCE = 3600  # seconds after which work is given up, even if it takes no processor time
PART = (
    "must be a part that gmsh and OpenCASCADE can work on",
    "mend or simplify it in CAD (fillets that are thinner than an element first), or take another mesh.size",
)
MESH_FILE = ("must be a mesh file that can be read", "it may be damaged: write it again, or in another format")

T = TypeVar("T")


@dataclass(eq=False, slots=True)
class _Worker:
    """A process that does one task after the other; `used` after its first task, `ended` once it was ended."""

    executor: Any
    used: bool = False
    ended: bool = False

    @classmethod
    def waiting(cls) -> "_Worker":
        """A process that waits for work, or a new one."""
        from joblib.externals.loky import ProcessPoolExecutor

        with suppress(IndexError):
            return IDLE_WORKERS.pop()
        return cls(ProcessPoolExecutor(max_workers=1))

    def rest(self) -> None:
        """Wait for more work for IDLE seconds.

        With loky's own `timeout` the next process would start while loky monitors none, and its end would not be seen.
        """
        IDLE_WORKERS.append(self)
        timer = Timer(IDLE, self._left)
        timer.daemon = True
        timer.start()

    def _left(self) -> None:
        with suppress(ValueError):  # it has work again
            IDLE_WORKERS.remove(self)
            self.end()

    def end(self) -> None:
        """End the process at once."""
        self.ended = True
        self.executor.shutdown(kill_workers=True)


IDLE_WORKERS: list[_Worker] = []
atexit.register(IDLE_WORKERS.clear)  # while loky still manages them; later it would print an error
_busy: list[_Worker] = []


def in_own_process(where: str, words: tuple[str, str], seconds: float, work: Callable[..., T], *given: Any) -> T:
    """What a function returns in a process of its own, because libraries crash or hang on some files.

    Nothing that they write reaches the terminal. The process is ended after work that raises, since a damaged file may
    leave a library's memory in any state. OpenCASCADE refuses some files in one process and hangs or crashes at them in
    another: if a process crashes, or a used one hangs, a new one tries once more; if it hangs while reading, two do.

    Parameters
    ----------
    where : the file or key, for messages
    words : what is required, and advice where it fails
    seconds : of processor time that it may take
    work, given : the function and its arguments

    Raises
    ------
    MeshError
        The process crashed, took longer, or took more than MOST_MEMORY; also what the function raises.
    """
    from joblib.externals.loky import TimeoutError as LateError
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    reason = ""
    for tried in range(1, TRIES + 1):
        worker = _Worker.waiting()
        used, worker.used = worker.used, True
        _busy.append(worker)
        try:
            task = worker.executor.submit(limited, str(Path.cwd()), seconds, work, *given)
            found: T = task.result(timeout=PATIENCE)
        except LateError:
            worker.end()
            reason = f"got none within {PATIENCE} s"
            break
        except MemoryError:
            worker.end()
            reason = f"got one for which they need more than {MOST_MEMORY / 1e9:g} GB of memory"
            break
        except TerminatedWorkerError as error:
            late, reading = "SIGXCPU" in str(error), f"({LATE})" in str(error)
            reason = "got one at which they broke down"
            reason = f"got none within {seconds:g} s of processor time" if late else reason
            reason = "got one that they had not read in time" if reading else reason
            unwanted, worker.ended = worker.ended, True
            if unwanted or (not reading and (tried == TRIES - 1 or (late and not used))):
                break
        except BaseException:
            worker.end()
            raise
        else:
            return found
        finally:
            _busy.remove(worker)
            if not worker.ended:
                worker.rest()
    wanted, advice = words
    raise MeshError(f"{where}: {wanted}, {reason}; {advice}")


def limited(folder: str, seconds: float, work: Callable[..., T], *given: Any) -> T:
    """What a function returns in a folder, without output; the process is ended after `seconds` of processor time.

    A MemoryError is raised if it needs more than MOST_MEMORY.
    """
    end_with_parent()
    os.chdir(folder)  # the process may have started in another one
    with bounded(seconds, MOST_MEMORY), silent():
        return work(*given)


def side_by_side(works: Mapping[str, Callable[[], T]]) -> dict[str, T]:
    """What functions that work `in_own_process` return, as many at once as threads and memory allow.

    Raises
    ------
    MeshError
        That of the first function, in their order, that raises one; the others are ended.
    """
    at_once = min(threads(), max(int(memory() / MOST_MEMORY), 1))
    if at_once == 1 or len(works) < 2:
        return {name: work() for name, work in works.items()}
    with ThreadPoolExecutor(at_once) as pool:
        tasks = {name: pool.submit(work) for name, work in works.items()}
        try:
            return {name: task.result() for name, task in tasks.items()}
        except BaseException:
            for task in tasks.values():
                task.cancel()
            while wait(tasks.values(), timeout=AGAIN).not_done:  # one may just have begun
                for worker in (*_busy,):
                    worker.end()
            raise
