"""How long short commands take, and a whole run of a reduced linkage: from a cold cache and from a warm one."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.pages import ROOT as CHECKOUT
from benchmarks.pages import script, seconds, table, write_page
from kedfem.compiled import ROOT, kernel_folder

COMMANDS = {"kedfem --help": ["--help"], "kedfem --version": ["--version"]}
TURNS = """
import sys
from kedfem.analysis import analyse
from benchmarks.scenes import ten_turns
analyse(ten_turns(sys.argv[1]))
"""


def bench_start(folder: Path, quick: bool) -> None:
    """Median wall times, in processes of their own, which load everything anew."""
    rows = []
    for name, arguments in COMMANDS.items():
        code = "from kedfem.cli import main; main()"
        command = [sys.executable, "-c", code, *arguments]
        spent = seconds(partial(subprocess.run, command, capture_output=True, check=True), 3 if quick else 9)
        rows.append((name, f"{spent:.2f}"))
    rows += _ten_turns(1 if quick else 5)
    write_page(folder, "performance/start", [table(("command", "seconds"), rows)])


def _ten_turns(repeats: int) -> list[tuple[str, str]]:
    """The whole run, first with an empty cache, then with what that left."""
    with TemporaryDirectory() as folder:
        kept = {"KEDFEM_CACHE": f"{folder}/cache", "NUMBA_CACHE_DIR": str(kernel_folder(ROOT))}
        environment = os.environ | kept
        command = [sys.executable, "-c", TURNS, f"{folder}/results"]
        run = partial(subprocess.run, command, capture_output=True, check=True, env=environment, cwd=CHECKOUT)
        cold, warm = seconds(run, 1), seconds(run, repeats)
    return [("ten turns, cold cache", f"{cold:.1f}"), ("ten turns, warm cache", f"{warm:.1f}")]


if __name__ == "__main__":
    script(bench_start)
