"""How much memory a process holds, and has held."""

import os
from contextlib import suppress
from pathlib import Path


def most_memory() -> float:
    """The most that this process has held so far, or since `forget_most` [bytes]; nan where that is not known."""
    with suppress(OSError, StopIteration, ValueError):
        # `ru_maxrss` begins with what the parent held
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024.0 * int(next(line.split()[1] for line in lines if line.startswith("VmHWM:")))
    try:
        import resource
    except ImportError:
        return float("nan")
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def forget_most() -> None:
    """Count `most_memory` from now on, where the system can."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def memory_held() -> float:
    """What this process holds now [bytes]; where the system does not report it, the most that it has held so far."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return most_memory()
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
