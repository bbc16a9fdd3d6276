"""Kills, shared folders and full disks: `python -m tests.reliability.kills --moments 100 --seed 1`.

A run of `kedfem run` in a process of its own is ended at a random moment of each of its phases in turn, by SIGKILL or
SIGTERM; then it goes on, and its rows must be those of a run that nobody disturbed, bit by bit. Needs a system with
these signals.
"""

import argparse
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from shutil import copytree, rmtree
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from kedfem.errors import OutputError
from kedfem.folders import PART
from kedfem.results import Results, read_results
from tests.reliability.phases import PHASES, TOLD, at_work, begun, spans

SCENE = """
[links.crank]
material = "steel"
reduction = "REDUCTION"
shape = { kind = "plate_link", between = [[0, 0], [0.1, 0]], width = 0.02, thickness = 0.01, bore_diameter = 0.01 }
mesh = { size = 0.006 }
[joints.A]
kind = "revolute"
links = ["ground", "crank"]
at = [0, 0]
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "60 rpm" }
[analysis]
revolutions = 1
steps_per_revolution = STEPS
accuracy = "quick"
extrapolation_levels = LEVELS
[output]
plots = false
picture = false
animation = { frames_per_revolution = 60 }
"""
ROOT = Path(__file__).parents[2]
LONGEST = 300.0  # seconds that one run may take
POLL = 2e-4  # seconds between two looks at what a run is at
ORPHANS = 5.0  # seconds after which nothing of a killed run may be there
FOUND, REFUSED, UNRELIABLE, ENDED = 0, 2, 4, 130


@dataclass
class Ground:
    """Where runs are tried: a scene, the rows that it has, and what its whole run takes [s].

    phases : phase → beginnings and lengths [s] of all times that the whole run is in it
    """

    folder: Path
    rows: Results
    takes: float
    phases: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    findings: list[str] = field(default_factory=list)

    def count(self, what: str, wrong: str = "") -> None:
        """One more that went as it must, or did not."""
        self.counts[what] += 1
        if wrong:
            self.findings.append(f"{what}: {wrong}")


def started(folder: Path, *more: str, cache: Path | None = None, **how: Any) -> "subprocess.Popen[str]":
    """`kedfem run` in a process of its own."""
    environment = os.environ | {
        "KEDFEM_CACHE": str(cache) if cache else "off", "OMP_NUM_THREADS": "1", "COLUMNS": "200",
        "KEDFEM_TRIED": str(folder), TOLD: str(folder / "phases"),
        "PYTHONPATH": os.pathsep.join([str(ROOT / "src"), str(ROOT)]),
    }  # fmt: skip
    command = [sys.executable, "-m", "tests.reliability.phases", "run", "scene.toml", *more]
    return subprocess.Popen(
        command, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how
    )


def new_cache(folder: Path) -> Path:
    """A cold cache, but for compiled code, which is the user's."""
    from kedfem.folders import compiled_folder

    rmtree(folder, ignore_errors=True)
    folder.mkdir(mode=0o700)
    if (kernels := compiled_folder()) is not None:
        (folder / kernels.name).symlink_to(kernels)
    return folder


def finished(running: "subprocess.Popen[str]") -> tuple[int, str]:
    """Exit code and all that was said."""
    out, err = running.communicate(timeout=LONGEST)
    return running.returncode, out + err


def ready(folder: Path, steps: int = 6000, levels: int = 1, reduction: str = "none") -> Ground:
    """The scene, and its undisturbed run, twice on a cold cache: the first one compiles."""
    folder.mkdir(parents=True, exist_ok=True)
    text = SCENE.replace("STEPS", str(steps)).replace("LEVELS", str(levels)).replace("REDUCTION", reduction)
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    for _ in range(2):
        (folder / "phases").unlink(missing_ok=True)
        cache, began = new_cache(folder / "cache"), time.monotonic()
        code, said = finished(started(folder, "--states", "0.05", cache=cache))
        if code not in {FOUND, UNRELIABLE}:
            raise RuntimeError(said)
    took, rows = time.monotonic() - began, read_results(folder / "scene-results" / "results.h5")
    return Ground(folder, rows, took, {phase: spans(folder / "phases", phase) for phase in PHASES})


def new_place(ground: Ground, name: str) -> Path:
    """A folder with the scene alone."""
    folder = ground.folder.parent / name
    rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / "scene.toml").write_bytes((ground.folder / "scene.toml").read_bytes())
    return folder


def others(folder: Path) -> list[int]:
    """Processes that a run in a folder has left, its workers too."""
    mark, found = f"KEDFEM_TRIED={folder}".encode(), []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            if (
                mark in (path / "environ").read_bytes().split(b"\0")
                and "Z" not in (path / "stat").read_text().rsplit(")", 1)[1].split()[0]
            ):
                found.append(int(path.name))
        except OSError:
            continue
    return found


def unequal(ground: Ground, folder: Path, whole: bool = True) -> str:
    """What is wrong with the rows that a run left; "" where they are those of the undisturbed one, from the first on."""
    file = folder / "scene-results" / "results.h5"
    if not file.exists():
        return "no results" if whole else ""
    try:
        found = read_results(file)
    except OutputError as error:
        return str(error)
    n = len(found.time)
    if found.status == "running":
        return "a run is said to be under way"
    if whole and (found.status != ground.rows.status or n != len(ground.rows.time)):
        return f"{found.status}, {n} rows"
    same = np.array_equal(found.time, ground.rows.time[:n]) and all(
        np.array_equal(found.channels[name][1], values[:n]) for name, (_, values) in ground.rows.channels.items()
    )
    return "" if same else "other rows"


def torn(folder: Path) -> str:
    """A frame that is listed and not whole."""
    for path in (folder / "scene-results").rglob("*.vtu"):
        if not PART.fullmatch(path.name) and not path.read_bytes().rstrip().endswith(b"</VTKFile>"):
            return f"{path.name} is not whole"
    return ""


def come(ground: Ground, running: "subprocess.Popen[str]", folder: Path, phase: str, rng: random.Random) -> None:
    """Wait for a random moment of one of the times that a run is in a phase; of the whole run, where it is "any"."""
    if phase == "any":
        time.sleep(rng.uniform(0.1, 1.0) * ground.takes)
        return
    which = rng.randrange(len(ground.phases[phase]))
    while begun(folder / "phases", phase) <= which and running.poll() is None:
        time.sleep(POLL)
    time.sleep(rng.random() * ground.phases[phase][which][1])


def killed(ground: Ground, number: signal.Signals, phase: str, name: str, seed: int = 1) -> None:
    """One run, ended in a phase, and gone on with."""
    folder = new_place(ground, name)
    cache = new_cache(folder / "cache")
    running = started(folder, "--states", "0.05", cache=cache, start_new_session=True)
    try:
        come(ground, running, folder, phase, random.Random(f"kill {seed} {name}"))
        ended = running.poll() is None
        if ended:
            running.send_signal(number)
        code, said = finished(running)
    finally:
        if running.poll() is None:
            running.kill()
    what = f"{number.name} {_stage(folder) if ended else 'after the end'}"
    wrong = f"a traceback: {said[said.index('Traceback') :][:900]}" if "Traceback" in said else ""
    if ended and number == signal.SIGTERM and code not in {ENDED, FOUND, UNRELIABLE, -number}:
        wrong = f"exit code {code}: {said[-300:]}"
    end = time.monotonic() + ORPHANS
    while others(folder) and time.monotonic() < end:
        time.sleep(0.1)
    if left := others(folder):
        wrong = f"{len(left)} processes are left"
    ground.count(what, wrong or unequal(ground, folder, whole=False) or torn(folder))
    state = (folder / "scene-results" / "state.kept").exists()
    resumes = ("--resume",) * state
    code, said = finished(started(folder, *resumes, cache=cache))
    after = "gone on with" if state else "run again"
    wrong = "" if code in {FOUND, UNRELIABLE} else f"exit code {code}: {said[-400:]}"
    ground.count(after, wrong or unequal(ground, folder) or torn(folder))
    rmtree(folder, ignore_errors=True)


def _stage(folder: Path) -> str:
    """What a run was at as it ended, the innermost of its phases."""
    return next((phase for phase in PHASES if at_work(folder / "phases", phase)), "between phases")


def together(ground: Ground, count: int, shared: str) -> None:
    """Several runs at once in one folder, or each in its own on one cold cache."""
    cache = new_cache(ground.folder.parent / "shared-cache")
    if shared == "folder":
        folders = [new_place(ground, "together")] * count
    else:
        folders = [new_place(ground, f"together{k}") for k in range(count)]
    running = [started(folder, cache=cache) for folder in folders]
    ends = [finished(each) for each in running]
    good = [code in {FOUND, UNRELIABLE} for code, _ in ends]
    refused = [code == REFUSED and "another run" in said for code, said in ends]
    every = all(a or b for a, b in zip(good, refused, strict=True)) if shared == "folder" else all(good)
    wrong = "" if every and any(good) else " | ".join(f"{code}: {said[-200:]}" for code, said in ends)
    for folder in set(folders):
        wrong = wrong or unequal(ground, folder) or torn(folder)
        rmtree(folder, ignore_errors=True)
    ground.count(f"{count} at once on one {shared}", wrong)


def short_of(ground: Ground, what: str, limit: int = 0) -> None:
    """A run without the room, the right, or the folder that it needs: a sentence; what was there is kept."""
    folder = new_place(ground, "short")
    copytree(ground.folder / "scene-results", folder / "scene-results")
    results, how = folder / "scene-results", {}
    if what == "quota":
        how = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))}
    running = started(folder, **how)
    if what == "folder removed":
        _wait(
            lambda: time.monotonic() - began > 0.7 * ground.takes or running.poll() is not None, began := time.monotonic()
        )
        rmtree(results, ignore_errors=True)
    code, said = finished(running)
    wrong = ""
    if "Traceback" in said or "internal error" in said or code not in {FOUND, REFUSED, UNRELIABLE}:
        wrong = f"exit code {code}: {said[-400:]}"
    if what != "folder removed":
        wrong = wrong or unequal(ground, folder, whole=False)
    elif code == REFUSED and "must be" not in said:
        wrong = f"no sentence: {said[-300:]}"
    ground.count(what, wrong)
    rmtree(folder, ignore_errors=True)


def _wait(condition: Callable[[], bool], since: float) -> None:
    while not condition() and time.monotonic() - since < LONGEST:
        time.sleep(0.05)


def main() -> None:
    """Try so many moments, and the rest once."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--levels", type=int, default=1)
    given = parser.parse_args()
    with TemporaryDirectory() as folder:
        ground = ready(Path(folder) / "solid" / "whole", levels=given.levels)
        reduced = ready(Path(folder) / "reduced" / "whole", levels=given.levels, reduction="modal")
        reduced.counts, reduced.findings = ground.counts, ground.findings
        for k in range(given.moments):
            phase = ("any", *PHASES)[k // 2 % (1 + len(PHASES))]
            of = reduced if phase == "writing the cache" else ground  # of solids nothing is kept
            killed(of, signal.SIGKILL if k % 2 else signal.SIGTERM, phase, f"k{k}", given.seed)
        for count in (2, 5):
            for shared in ("folder", "cache"):
                together(ground, count, shared)
        for limit in (10_000, 100_000, 1_000_000, 2_000_000, 4_000_000):
            short_of(ground, "quota", limit)
        short_of(ground, "folder removed")
        print(f"a whole run takes {ground.takes:.2f} s, {len(ground.rows.time)} rows")  # noqa: T201 - a command
    for what, count in sorted(ground.counts.items()):
        print(f"{what:40} {count:5d}")  # noqa: T201
    for finding in ground.findings:
        print(f"FINDING {finding}")  # noqa: T201


if __name__ == "__main__":
    main()
