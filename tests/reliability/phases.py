"""`kedfem run` that shows what it is at, to be ended there: `python -m tests.reliability.phases run scene.toml`.

Each beginning and end of a phase is a line of the file that KEDFEM_PHASES names: the phase, + or -, and the time.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

TOLD = "KEDFEM_PHASES"
PHASES = (  # inner ones first
    "writing rows", "writing frames", "writing states", "writing the cache", "meshing", "factoring", "stepping",
)  # fmt: skip


@contextmanager
def told(phase: str) -> Iterator[None]:
    """A phase, from its beginning to its end; one that an interruption leaves has no end."""
    _say(phase, "+")
    yield
    _say(phase, "-")


def _say(phase: str, what: str) -> None:
    file = os.open(os.environ[TOLD], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(file, f"{phase}\t{what}\t{time.monotonic()}\n".encode())
    os.close(file)


def spans(file: Path, phase: str) -> list[tuple[float, float]]:
    """Beginnings and lengths [s] of a phase, of those that have ended."""
    begins: list[float] = []
    out: list[tuple[float, float]] = []
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        name, what, when = line.split("\t")
        if name == phase and what == "+":
            begins.append(float(when))
        elif name == phase:
            out.append((begins[-1], float(when) - begins[-1]))
    return out


def begun(file: Path, phase: str) -> int:
    """How often a phase has begun."""
    return file.read_bytes().count(f"{phase}\t+".encode()) if file.exists() else 0


def at_work(file: Path, phase: str) -> bool:
    """Whether a phase has begun once more than it has ended."""
    said = file.read_bytes() if file.exists() else b""
    return said.count(f"{phase}\t+".encode()) > said.count(f"{phase}\t-".encode())


def _named(phase: str, work: Callable[..., Any]) -> Callable[..., Any]:
    def watched(*args: Any, **more: Any) -> Any:
        with told(phase):
            return work(*args, **more)

    return watched


def watch_all() -> None:
    """Put the names of phases around what kedfem does in them."""
    import kedfem.accuracy.reduction
    import kedfem.analysis
    import kedfem.store
    from kedfem.output.animation import AnimationWriter
    from kedfem.results import ResultsWriter
    from kedfem.resume import Keeper

    of: Any = (
        (kedfem.accuracy.reduction, "meshed", "meshing"),
        (kedfem.analysis, "level_steps", "factoring"),
        (kedfem.analysis, "stepped", "stepping"),
        (ResultsWriter, "append", "writing rows"),
        (AnimationWriter, "add", "writing frames"),
        (Keeper, "keep", "writing states"),
    )
    for where, name, phase in of:
        setattr(where, name, _named(phase, getattr(where, name)))
    before = kedfem.store.whole

    @contextmanager
    def whole(*args: Any) -> Iterator[Path]:
        with told("writing the cache"), before(*args) as part:
            yield part

    kedfem.store.whole = whole


def main() -> None:
    """The command kedfem, watched."""
    from kedfem.cli import main as kedfem

    watch_all()
    kedfem()


if __name__ == "__main__":
    main()
