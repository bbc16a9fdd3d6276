"""How long short commands take, and a whole run of a reduced linkage: from a cold cache and from a warm one."""

import os
import subprocess
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from shutil import copytree
from tempfile import TemporaryDirectory
from textwrap import indent

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
EXAMPLES = ("four_bar_beams", "four_bar_corotational", "four_bar_solids")
COMPILED = (*EXAMPLES, "motor_four_bar", "slider_crank_solids")
ROWS = """
import gc, sys
from kedfem.processes import import_quickly, imported
import_quickly()  # as the command line does
from kedfem.analysis import analyse
from kedfem.scene import read_scene
import kedfem.compiled
imported()
scene = read_scene(sys.argv[1])
nothing = {"animation": None, "plots": False, "picture": False, "csv": False, "parquet": False, "report": False}
analyse(scene.model_copy(update={"output": scene.output.model_copy(update=nothing)}))
gc.freeze()
"""
COMPILING = f"""
import time
from kedfem.compiled import compiling
times = []
with compiling(lambda begins: times.append(-time.process_time() if begins else time.process_time())):
{indent(ROWS, "    ")}
print(sum(times))
"""
WHOLE = "import sys; from kedfem.cli import main; sys.argv = ['kedfem', 'run', sys.argv[1]]; main()"


def bench_start(folder: Path, quick: bool) -> None:
    """Median wall times, in processes of their own, which load everything anew, compiled by Python before."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    rows = []
    for name, arguments in COMMANDS.items():
        code = "from kedfem.cli import main; main()"
        command = [sys.executable, "-c", code, *arguments]
        spent = seconds(partial(subprocess.run, command, capture_output=True, check=True), 3 if quick else 9)
        rows.append((name, f"{spent:.2f}"))
    rows += _ten_turns(1 if quick else 5)
    examples = _examples(EXAMPLES[:1] if quick else EXAMPLES, 1 if quick else 5)
    compiled = _compiled(COMPILED[:1] if quick else COMPILED)
    write_page(folder, "performance/start", [table(("command", "seconds"), rows), examples, compiled])


def _ten_turns(repeats: int) -> list[tuple[str, str]]:
    """The whole run, first with an empty cache, then with what that left."""
    with TemporaryDirectory() as folder:
        kept = {"KEDFEM_CACHE": f"{folder}/cache", "NUMBA_CACHE_DIR": str(kernel_folder(ROOT))}
        environment = os.environ | kept
        command = [sys.executable, "-c", TURNS, f"{folder}/results"]
        run = partial(subprocess.run, command, capture_output=True, check=True, env=environment, cwd=CHECKOUT)
        cold, warm = seconds(run, 1), seconds(run, repeats)
    return [("ten revolutions, cold cache", f"{cold:.1f}"), ("ten revolutions, warm cache", f"{warm:.1f}")]


def _examples(names: Sequence[str], repeats: int) -> list[str]:
    """Examples of users, warm: until the results file is whole, and with frames, plots and picture."""
    rows = []
    for name in names:
        with TemporaryDirectory() as folder:
            copied = copytree(CHECKOUT / "examples" / name, Path(folder) / name)
            spent = []
            for code in (ROWS, WHOLE):
                command = [sys.executable, "-c", code, str(copied / "scene.toml")]
                run = partial(subprocess.run, command, capture_output=True, check=True)
                run()
                spent.append(seconds(run, repeats))
        rows.append((name, f"{spent[0]:.1f}", f"{spent[1] - spent[0]:.1f}", f"{spent[1]:.1f}"))
    header = ("example, warm", "results file [s]", "frames, plots, picture [s]", "whole [s]")
    return table(header, rows)


def _compiled(names: Sequence[str]) -> list[str]:
    """Processor time that a first run compiles for, with an empty cache."""
    rows = []
    for name in names:
        with TemporaryDirectory() as folder:
            copytree(CHECKOUT / "geometry", Path(folder) / "geometry")
            copied = copytree(CHECKOUT / "examples" / name, Path(folder) / "examples" / name)
            environment = os.environ | {"KEDFEM_CACHE": f"{folder}/cache"}
            command = [sys.executable, "-c", COMPILING, str(copied / "scene.toml")]
            said = subprocess.run(command, capture_output=True, check=True, text=True, env=environment)
        rows.append((name, f"{float(said.stdout.split()[-1]):.1f}"))
    return table(("example, first run", "compiling, processor time [s]"), rows)


if __name__ == "__main__":
    script(bench_start)
