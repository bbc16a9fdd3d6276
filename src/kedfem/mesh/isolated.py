"""Work of libraries in a process of its own: what they write stays there, where they break down or hang is an error."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from kedfem.errors import MeshError
from kedfem.mesh.cad.file import silent
from kedfem.processes import LATE, bounded, end_with_parent

LONGEST = 180  # seconds of processor time after which a part is given up
READING = 60  # seconds of processor time after which a mesh file is given up
TRIES = 3  # processes that are tried with a part that cannot be read in time
MOST_MEMORY = 6e9  # bytes that the process may hold
PATIENCE = 3600  # seconds after which either is given up though it takes no processor time
PART = (
    "must be a part that gmsh and OpenCASCADE can work on",
    "mend or simplify it in CAD (fillets that are thinner than an element first), or take another mesh.size",
)
MESH_FILE = (
    "must be a mesh file that can be read",
    "it may be damaged: write it again, or in another format",
)

T = TypeVar("T")
_used: set[int] = set()  # the executors whose process has had work before


def apart(where: str, words: tuple[str, str], seconds: float, work: Callable[..., T], *given: Any) -> T:
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
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    reason = ""
    for tried in range(1, TRIES + 1):
        executor = get_reusable_executor(max_workers=1, timeout=LONGEST)
        used = executor.executor_id in _used
        _used.add(executor.executor_id)
        try:
            found: T = executor.submit(limited, str(Path.cwd()), seconds, work, *given).result(
                timeout=PATIENCE
            )
        except LateError:
            executor.shutdown(kill_workers=True)
            reason = f"got none within {PATIENCE} s"
            break
        except MemoryError:
            executor.shutdown(kill_workers=True)
            reason = f"got one for which they need more than {MOST_MEMORY / 1e9:g} GB of memory"
            break
        except TerminatedWorkerError as error:
            late, reading = "SIGXCPU" in str(error), f"({LATE})" in str(error)
            reason = (
                "got one that they had not read in time"
                if reading
                else f"got none within {seconds:g} s of processor time"
                if late
                else "got one at which they broke down"
            )
            if not reading and (tried == TRIES - 1 or (late and not used)):
                break
        except Exception:
            executor.shutdown(kill_workers=True)
            raise
        else:
            return found
    wanted, advice = words
    raise MeshError(f"{where}: {wanted}, {reason}; {advice}")


def limited(folder: str, seconds: float, work: Callable[..., T], *given: Any) -> T:
    """What a function returns, in silence; the process is ended if that takes more processor time than so much.

    Parameters
    ----------
    folder : that paths are relative to; the process may have begun in another

    Raises
    ------
    MemoryError
        It would hold more than MOST_MEMORY.
    """
    end_with_parent()
    os.chdir(folder)
    with bounded(seconds, MOST_MEMORY), silent():
        return work(*given)
