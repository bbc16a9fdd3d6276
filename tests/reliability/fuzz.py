"""The fuzzer: `python -m tests.reliability.fuzz --scenes 20000 --texts 5000 --runs 2000 --files 2000 --seed 1`.

Of whatever is put in, one of two things comes out, in a stated time: what was asked for, with numbers that are finite, or
an error of kedfem with words for the user. A finding is a line of `findings.toml`: what, which base, which seed.
"""

import argparse
import random
import time
import tomllib
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene, scene_from, time_grid
from tests.reliability.files import damaged_files
from tests.reliability.mutations import Raw, damaged, mutated, nudged, short
from tests.reliability.tally import Tally
from tests.rooms.test_bad_scenes import BEAMS, GOOD
from tests.scenes import EXAMPLES, example

VALIDATION, RUN = 2.0, 60.0  # seconds of processor time that one may take
QUICK = ("four_bar_beams", "four_bar_corotational", "motor_four_bar", "spinning_bar", "rssr")  # bases of whole runs


def bases() -> dict[str, Raw]:
    """Scenes that mutations begin with."""
    every = {path.parent.name: example(path.parent.name) for path in sorted(EXAMPLES.glob("*/scene.toml"))}
    return every | {"good": tomllib.loads(GOOD), "beams": tomllib.loads(BEAMS)}


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


def ran(raw: Raw, folder: Path) -> str:
    """A whole short run: complete or unreliable with finite numbers, or refused."""
    scene = scene_from(raw, folder)
    found = analyse(scene).results
    if found.status not in {"complete", "unreliable"}:
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
            damaged_files(tally, given.files, given.seed, Path(folder))
    print(tally.page())  # noqa: T201 - a command


if __name__ == "__main__":
    main()
