"""How much memory a process holds, and has held."""

import os
from pathlib import Path


def most_memory() -> float:
    """The most that this process has held so far [bytes]; nan where the system does not report it."""
    try:
        import resource
    except ImportError:
        return float("nan")
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def memory_held() -> float:
    """What this process holds now [bytes]; where the system does not report it, the most that it has held so far."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return most_memory()
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
