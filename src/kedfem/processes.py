"""What differs between systems about processes: how they are told to end, and that workers end with their parent."""

import os
import signal
import threading
import time
from functools import cache
from types import FrameType

POLL = 0.5  # seconds between two looks for the parent


def end_as_interrupted() -> None:
    """Let the system's wish that this process end do what Ctrl-C does, unless the process was told to ignore it.

    SIGBREAK is that wish on Windows; SIGHUP is sent when a terminal is closed.
    """

    def interrupt(number: int, frame: FrameType | None) -> None:
        del number, frame
        raise KeyboardInterrupt

    for name in ("SIGTERM", "SIGBREAK", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, interrupt)


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
