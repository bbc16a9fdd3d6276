"""Calls of libraries in processes of their own: their output is suppressed, and crashes or hangs become errors."""

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

LONGEST = 180  # seconds of processor time after which a part is given up
READING = 60  # seconds of processor time after which a mesh file is given up
TRIES = 3  # processes that are tried with a part that cannot be read in time
IDLE = 180  # seconds after which a process that has no work is ended
AGAIN = 0.05  # seconds between two tries to end what is not wanted any more
MOST_MEMORY = 6e9  # bytes that the process may hold
PATIENCE = 3600  # seconds after which either is given up though it takes no processor time
PART = (
    "must be a part that gmsh and OpenCASCADE can work on",
    "mend or simplify it in CAD (fillets that are thinner than an element first), or take another mesh.size",
)
MESH_FILE = ("must be a mesh file that can be read", "it may be damaged: write it again, or in another format")

T = TypeVar("T")


@dataclass(eq=False, slots=True)
class _Worker:
    """A process that does one piece of work after the other; `used` once it had some, `ended` at its end."""

    executor: Any
    used: bool = False
    ended: bool = False

    @classmethod
    def waiting(cls) -> "_Worker":
        """One that waits for work, or a new one."""
        from joblib.externals.loky import ProcessPoolExecutor

        with suppress(IndexError):
            return IDLE_WORKERS.pop()
        return cls(ProcessPoolExecutor(max_workers=1))

    def rest(self) -> None:
        """Wait for more work, for IDLE seconds.

        By loky's own `timeout` the next process would begin while loky looks at none, and its end would not be seen.
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
atexit.register(IDLE_WORKERS.clear)  # while loky still reports their end: later, it would write of an error
_busy: list[_Worker] = []


def in_own_process(where: str, words: tuple[str, str], seconds: float, work: Callable[..., T], *given: Any) -> T:
    """What a function returns in a process of its own: libraries break down or hang on some files.

    Nothing that they write reaches the terminal. The process is ended after work that raises: what a damaged file leaves
    in a library's memory is not known. OpenCASCADE refuses some files in one process and hangs or breaks down at them in
    another: where a process breaks down, or a used one hangs, a new one tries once; where one hangs as it reads, two.

    Parameters
    ----------
    words : what is wanted, and what to do where it is not so
    seconds : of processor time that it may take

    Raises
    ------
    MeshError
        The process broke down, took longer or more than MOST_MEMORY; or what the function raises.
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
    """What a function returns, in silence, in a folder; the process is ended after so much processor time.

    A MemoryError says that it would hold more than MOST_MEMORY.
    """
    end_with_parent()
    os.chdir(folder)  # the process may have begun in another
    with bounded(seconds, MOST_MEMORY), silent():
        return work(*given)


def side_by_side(works: Mapping[str, Callable[[], T]]) -> dict[str, T]:
    """What functions return that have their work done `in_own_process`: as many at once as there are threads, and memory.

    Raises
    ------
    MeshError
        What the first of them raises, in their order; those that go on are ended.
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
