"""How long short commands take, and a whole run of a reduced linkage: from a cold cache and from a warm one."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from kedfem.bench.machine import Watch, markdown, seconds, write_page
from kedfem.compiled import ROOT, kernel_folder

COMMANDS = {"kedfem --help": ["--help"], "kedfem --version": ["--version"]}
TURNS = """
import sys
from kedfem.analysis import analyse
from kedfem.bench.scenes import ten_turns
analyse(ten_turns(sys.argv[1]))
"""


def bench_start(folder: Path, quick: bool, watch: Watch) -> str:
    """Median wall times, in processes of their own, which load everything anew."""
    rows = []
    for name, arguments in COMMANDS.items():
        watch(name, 0, 0)
        code = "from kedfem.cli import main; main()"
        command = [sys.executable, "-c", code, *arguments]
        spent = seconds(partial(subprocess.run, command, capture_output=True, check=True), 3 if quick else 9)
        rows.append((name, f"{spent:.2f}"))
    watch("ten turns", 0, 0)
    rows += _ten_turns(1 if quick else 5)
    note = (
        "Ten turns: the four-bar of plates, three links of hexahedra reduced to 1 %, 10,000 steps, probes and joint "
        "forces written at every step; mesh, reduction with its estimate, and the start of Python included. Cold: "
        "nothing kept from earlier runs but compiled code; warm: the reduced links."
    )
    text = markdown("Start of the command line", "kedfem bench start", ("command", "seconds"), rows, note)
    write_page(folder, "start", text)
    return text


def _ten_turns(repeats: int) -> list[tuple[str, str]]:
    """The whole run, first with an empty cache, then with what that left."""
    with TemporaryDirectory() as folder:
        kept = {"KEDFEM_CACHE": f"{folder}/cache", "NUMBA_CACHE_DIR": str(kernel_folder(ROOT))}
        environment = os.environ | kept
        command = [sys.executable, "-c", TURNS, f"{folder}/results"]
        run = partial(subprocess.run, command, capture_output=True, check=True, env=environment)
        cold, warm = seconds(run, 1), seconds(run, repeats)
    return [("ten turns, cold cache", f"{cold:.1f}"), ("ten turns, warm cache", f"{warm:.1f}")]
