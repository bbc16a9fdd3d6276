"""The fuzzer: `python -m tests.reliability.fuzz --scenes 20000 --texts 5000 --runs 2000 --files 2000 --seed 1`.

Of whatever is put in, one of two things comes out, in a stated time: what was asked for, with numbers that are finite, or
an error of kedfem with words for the user. A finding is a line of `findings.toml`: what, which base, which seed.
"""

import argparse
import os
import random
import signal
import time
import tomllib
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from kedfem.analysis import analyse
from kedfem.errors import KedfemError
from kedfem.results import read_results
from kedfem.scene import read_scene, scene_from, time_grid
from tests.reliability.mutations import damaged, mutated, nudged
from tests.rooms.test_bad_scenes import BEAMS, GOOD
from tests.scenes import EXAMPLES, example

VALIDATION, RUN = 2.0, 60.0  # seconds of processor time that one may take
ENDLESS = 20  # seconds after which a reader is ended
MOST_STEPS = 24  # of a whole short run
QUICK = (
    "four_bar_beams",
    "four_bar_corotational",
    "motor_four_bar",
    "spinning_bar",
    "rssr",
)  # bases of whole runs
Raw = dict[str, Any]


def bases() -> dict[str, Raw]:
    """Scenes that mutations begin with."""
    every = {path.parent.name: example(path.parent.name) for path in sorted(EXAMPLES.glob("*/scene.toml"))}
    return every | {"good": tomllib.loads(GOOD), "beams": tomllib.loads(BEAMS)}


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
            said = (
                f"{type(error).__name__}: {error}"[:200]
                + f" at {traceback.extract_tb(error.__traceback__)[-1]}"
            )
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


def validated(raw: Raw, folder: Path) -> str:
    """A scene is accepted or refused; what is accepted knows its steps and can be written down."""
    scene = scene_from(raw, folder)
    steps = time_grid(scene).steps
    return "accepted" if steps >= 1 and scene.model_dump_json() else f"accepted with {steps} steps"


def mutation(bases: dict[str, Raw], seed: int, number: int) -> tuple[str, Raw]:
    """The scene of a number."""
    rng = random.Random(f"scene {seed} {number}")
    name = rng.choice(sorted(bases))
    return name, mutated(bases[name], rng)


def validate_scenes(tally: Tally, count: int, seed: int) -> None:
    """Scenes by typed mutation."""
    every = bases()
    for number in range(count):
        name, raw = mutation(every, seed, number)
        folder = EXAMPLES / name if (EXAMPLES / name).is_dir() else EXAMPLES
        tally.tried("scene", f"{name} {seed} {number}", lambda r=raw, f=folder: validated(r, f), VALIDATION)  # type: ignore[misc]


def read_texts(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """Text of scene files by bytes."""
    texts = [path.read_bytes() for path in sorted(EXAMPLES.glob("*/scene.toml"))] + [GOOD.encode()]
    path = folder / "scene.toml"

    def read() -> str:
        read_scene(path)
        return "accepted"

    for number in range(count):
        rng = random.Random(f"text {seed} {number}")
        path.write_bytes(damaged(rng.choice(texts), rng))
        tally.tried("text", f"{seed} {number}", read, VALIDATION)


def short(raw: Raw) -> Raw:
    """The scene with few steps, plain defaults and nothing drawn."""
    analysis = raw.get("analysis")
    analysis = dict(analysis) if isinstance(analysis, dict) else {}
    for key in ("revolutions", "steps_per_revolution", "end_time", "step", "accuracy"):
        analysis.pop(key, None)
    analysis |= {"step": 1e-3, "end_time": 1e-3 * MOST_STEPS, "accuracy": "quick", "extrapolation_levels": 1}
    output = {"animation": {"frames_per_revolution": 12}, "plots": False, "picture": False, "csv": False}
    probes = raw.get("output", {}).get("probes") if isinstance(raw.get("output"), dict) else None
    return raw | {"analysis": analysis, "output": output | ({"probes": probes} if probes is not None else {})}


def ran(raw: Raw, folder: Path) -> str:
    """A whole short run: complete or doubtful with finite numbers, or refused."""
    scene = scene_from(raw, folder)
    found = analyse(scene).results
    if found.status not in {"complete", "doubtful"}:
        return f"ended as {found.status}"
    wrong = [name for name, (_, values) in found.channels.items() if not np.isfinite(values).all()]
    stresses = [peak.stress for peak in found.peaks.values()]
    if wrong or not np.isfinite(stresses).all():
        return f"accepted, not finite: {wrong or stresses}"
    return "accepted"


def run_scenes(
    tally: Tally, count: int, seed: int, folder: Path, names: tuple[str, ...] = QUICK, seconds: float = inf
) -> None:
    """Whole short runs of scenes whose numbers are others; no more are begun after so many seconds."""
    began = time.monotonic()
    every = {name: short(example(name)) for name in names}
    for number in range(count):
        if time.monotonic() - began > seconds:
            break
        rng = random.Random(f"run {seed} {number}")
        name = rng.choice(sorted(every))
        raw = nudged(every[name], rng)
        tally.tried("run", f"{name} {seed} {number}", lambda r=raw: ran(r, folder), RUN)  # type: ignore[misc]


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


def read_files(tally: Tally, count: int, seed: int, folder: Path) -> None:
    """Results files and tables of motion by bytes: what is read is what was written, or refused."""
    scene = scene_from(short(example("four_bar_beams")), folder)
    run = analyse(scene)
    good = run.results
    content = (run.folder / "results.h5").read_bytes()
    path, table = folder / "damaged.h5", folder / "motion.csv"
    raw = example("four_bar_beams")
    raw["drive"] = {"joint": raw["drive"]["joint"], "motion": {"kind": "table", "file": table.name}}
    raw["analysis"] = {"end_time": 0.1, "step": 1e-3}
    lines = "t [s], angle [rad]\n" + "\n".join(f"{k / 50}, {(k / 50) ** 2}" for k in range(51))

    def results() -> str:
        found = read_results(path)
        same = all(np.array_equal(found.channels[name][1], x) for name, (_, x) in good.channels.items())
        return "accepted" if same and np.array_equal(found.time, good.time) else "read other numbers"

    for number in range(count):
        rng = random.Random(f"file {seed} {number}")
        if number % 2:
            path.write_bytes(damaged(content, rng))
            tally.tried("results", f"{seed} {number}", lambda: apart(results), VALIDATION)
        else:
            table.write_bytes(damaged(lines.encode(), rng))
            tally.tried("table", f"{seed} {number}", lambda: validated(raw, folder), VALIDATION)


def main() -> None:
    """Try so many of each kind, and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("scenes", "texts", "runs", "files"):
        parser.add_argument(f"--{name}", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=inf, help="after which no more runs are begun")
    given = parser.parse_args()
    tally = Tally()
    np.seterr(all="ignore")
    with TemporaryDirectory() as folder:
        validate_scenes(tally, given.scenes, given.seed)
        read_texts(tally, given.texts, given.seed, Path(folder))
        run_scenes(tally, given.runs, given.seed, Path(folder), seconds=60 * given.minutes)
        if given.files:
            read_files(tally, given.files, given.seed, Path(folder))
    print(tally.page())  # noqa: T201 - a command


if __name__ == "__main__":
    main()
