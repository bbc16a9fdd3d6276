"""How long the command line takes to answer, heavy libraries not needed."""

import subprocess
import sys
from functools import partial
from pathlib import Path

from kedfem.bench.machine import Watch, markdown, seconds, write_page

COMMANDS = {"kedfem --help": ["--help"], "kedfem --version": ["--version"]}


def bench_start(folder: Path, quick: bool, watch: Watch) -> str:
    """Median wall time of short commands, in processes of their own."""
    rows = []
    for name, arguments in COMMANDS.items():
        watch(name, 0, 0)
        code = "from kedfem.cli import main; main()"
        command = [sys.executable, "-c", code, *arguments]
        spent = seconds(partial(subprocess.run, command, capture_output=True, check=True), 3 if quick else 9)
        rows.append((name, f"{spent:.2f}"))
    text = markdown("Start of the command line", "kedfem bench start", ("command", "seconds"), rows)
    write_page(folder, "start", text)
    return text
