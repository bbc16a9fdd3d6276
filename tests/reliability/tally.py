"""Tries counted: each is accepted or refused in words, in a stated time, or is a finding."""

import os
import signal
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from kedfem.errors import KedfemError

ENDLESS = 20  # seconds after which a reader is ended


@dataclass
class Tally:
    """What became of all tries, by kind; findings are kind, number and words."""

    counts: Counter[str] = field(default_factory=Counter)
    findings: list[tuple[str, str, str]] = field(default_factory=list)
    slowest: dict[str, float] = field(default_factory=dict)

    def tried(self, kind: str, name: str, work: Callable[[], str], most: float) -> None:
        """One try: accepted or refused, in time, or a finding."""
        began = time.process_time()
        try:
            said = work()
        except KedfemError as error:
            said = "refused" if str(error).strip() and "Traceback" not in str(error) else "without words"
        except Exception as error:  # noqa: BLE001 - that is what is looked for
            said = f"{type(error).__name__}: {error}"[:200] + f" at {traceback.extract_tb(error.__traceback__)[-1]}"
        took = time.process_time() - began
        self.slowest[kind] = max(self.slowest.get(kind, 0.0), took)
        if took > most:
            said = f"took {took:.3g} s, more than {most:g}"
        if said in {"accepted", "refused"}:
            self.counts[f"{kind} {said}"] += 1
        else:
            self.counts[f"{kind} FINDING"] += 1
            self.findings.append((kind, name, said))

    def page(self) -> str:
        """As a table."""
        lines = [f"{name:30} {count:8,d}" for name, count in sorted(self.counts.items())]
        lines += [f"slowest of {kind}: {took:.2f} s of processor time" for kind, took in self.slowest.items()]
        return "\n".join([*lines, *(f"FINDING {kind} {name}: {said}" for kind, name, said in self.findings)])


def apart(work: Callable[[], str]) -> str:
    """What some work says, in a process of its own that an alarm ends: HDF5 may never come back from damaged bytes."""
    ends = {0: "accepted", 1: "refused", 2: "read other numbers, or an exception that is not kedfem's"}
    if not (child := os.fork()):
        signal.alarm(ENDLESS)
        try:
            code = 0 if work() == "accepted" else 2
        except KedfemError:
            code = 1
        except BaseException:  # noqa: BLE001 - that is what is looked for
            code = 2
        os._exit(code)
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        return f"ended by {signal.Signals(os.WTERMSIG(status)).name}"
    return ends[os.WEXITSTATUS(status)]
