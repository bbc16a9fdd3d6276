"""Every example of revision 4d7b129 beside today's: processor time stage by stage, and results at equal discretisation.

The revision is checked out in a temporary folder; each run is a process of its own, with caches for each version. What
was measured is kept in build/before, so that a benchmark that was stopped goes on from there; remove it to measure anew.
"""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.pages import ROOT, script, table, write_page
from kedfem.accuracy.prepared import meshed
from kedfem.output.vtu import write_vtu
from kedfem.scene import scene_from
from kedfem.scene.records.wording import KEYS, VALUES

Raw = dict[str, Any]
REVISION = "4d7b129"
KEPT = ROOT / "build" / "before"
RENAMED = {"four_bar_following": "four_bar_corotational"}
EXAMPLES = (
    "four_bar_beams", "five_bar_robot", "quick_return", "bennett", "rssr", "universal_joint_shaft", "motor_four_bar",
    "four_bar_following", "spinning_bar", "four_bar_solids", "four_bar_accuracy", "slider_crank_solids", "connecting_rod",
)  # fmt: skip
STAGES = {  # of the page, and what the two versions call them
    "scene": ("scene",),
    "motion": ("motion",),
    "mesh": ("mesh and matrices", "masses"),
    "plan": ("plan",),
    "modes": ("functions", "modes", "error of the reduction"),
    "steps": ("factor", "probes", "recovery", "start", "steps"),
    "checks": ("frequencies", "estimates", "fatigue"),
    "pictures": ("pictures", "report"),
}
GROUPS = {  # of channels
    "deflections": r"probes/.*/displacement",
    "stresses": r"probes/.*/stress",
    "joint forces": r"joints/\w+/(force|moment)",
    "drive, motor": r"(drive|motors)/(\w+/)?torque",
    "rigid links": r"(joints|drive)/.*rigid_.*",
    "energies": r"energy/.*",
}
UNTIMED = "four_bar_accuracy"  # 4d7b129 keeps the output of the scene that a plan was made for with the plan
QUIET = {"animation": False, "plots": False, "picture": False, "csv": False}
WISH = 1e-9  # of a channel's peak
ROUNDING = 1e-8  # of the largest force: a channel of less has nothing but rounding, as of what leaves the plane
MESHED = {"slider_crank_solids": (2, 1.0), "connecting_rod": (1, 0.25)}  # one mesh: elements across; revolutions
QUASI_STATIC = ("four_bar_beams", "spinning_bar", "four_bar_solids", "four_bar_accuracy")  # once more with that start
REASONS = {
    **dict.fromkeys(("bennett", "rssr", "universal_joint_shaft"), "rounding: two solvers of a version differ as much"),
    **dict.fromkeys(("four_bar_solids", "four_bar_accuracy"), "rounding: other kernels of BLAS change as much"),
    **{f"{name}, quasi-static": "start: first velocities were difference quotients over two steps, now derivatives"
       for name in QUASI_STATIC},
    "spinning_bar, quasi-static": "start: 4d7b129 gave up the iteration of the deflection too early",
    "motor_four_bar": "first step: what motors and springs do is distributed by a step's matrix now",
    "four_bar_following": "iterations of both end at a change of 1e-7",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Version:
    """A checkout and its name in tables."""

    name: str
    root: Path

    def scene(self, example: str) -> Raw:
        """The keys of an example's scene file."""
        return tomllib.loads((self.root / "examples" / example / "scene.toml").read_text(encoding="utf-8"))

    def timed(self, example: str) -> Raw:
        """A run of its own scene file, after another of it, which leaves plan, meshes and compiled code.

        Both with pictures: a plan that 4d7b129 kept has the output of the scene that it was made for.
        """
        raw = self.scene(example)
        known = (KEPT / f"own-{example}-{self.name}.json").exists()
        if not known and "failed" in (first := self.run("warm", example, raw)):
            return first
        return self.run("own", example, raw)

    def run(self, kind: str, example: str, raw: Raw) -> Raw:
        """What a run of a scene in an example's folder leaves; `failed` where it does not run."""
        out = KEPT / f"{kind}-{example}-{self.name}.json"
        if not out.exists():
            caches = KEPT / f"caches-{self.name}"
            where = {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(self.root / "src"), "KEDFEM_CACHE": str(caches)}
            if self.name == REVISION:  # which keeps compiled code elsewhere
                where["NUMBA_CACHE_DIR"] = str(caches / "numba")
            with TemporaryDirectory() as folder:
                raw = raw | {"output": raw.get("output", {}) | {"folder": f"{folder}/results"}}
                given = {"raw": raw, "folder": str(self.root / "examples" / example), "out": str(out)}
                (file := Path(folder, "given.json")).write_text(json.dumps(given))
                command = [sys.executable, str(ROOT / "benchmarks" / "before_run.py"), str(file)]
                done = subprocess.run(command, env=os.environ | where, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                out.write_text(json.dumps({"failed": (done.stderr.strip().splitlines() or ["stopped"])[-1]}))
        found: Raw = json.loads(out.read_text())
        return found


@contextmanager
def checkouts() -> Iterator[tuple[Version, Version]]:
    """The revision, in a folder that goes again, and this one."""
    KEPT.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as folder:
        git = ["git", "-C", str(ROOT), "worktree"]
        subprocess.run([*git, "add", "--quiet", "--detach", f"{folder}/kedfem", REVISION], check=True)
        try:
            yield Version(REVISION, Path(folder, "kedfem")), Version("today", ROOT)
        finally:
            subprocess.run([*git, "remove", "--force", f"{folder}/kedfem"], check=True)


def bench_before(folder: Path, quick: bool) -> None:
    """Times of all examples, each of its own scene, and differences of results; tables to the page."""
    times, differences = [], []
    with checkouts() as (old, new):
        for example in EXAMPLES[:1] if quick else EXAMPLES:
            differences.append(_difference(old, new, example, "rest"))
            if example in QUASI_STATIC:
                differences.append(_difference(old, new, example, "quasi-static"))
            if example != UNTIMED:
                times.append(_times(example, old.timed(example), new.timed(RENAMED.get(example, example))))
    header = ("example, seconds 4d7b129 / today", "unknowns", "steps", *STAGES, "whole")
    results = ("example, largest difference", "unknowns", "steps", *GROUPS, "reason above 1e-9")
    write_page(folder, "performance/before", [table(header, times), table(results, differences)])


def _times(example: str, old: Raw, new: Raw) -> Sequence[str]:
    """Processor seconds of both versions, stage by stage."""
    failed = [run["failed"] for run in (old, new) if "failed" in run]
    if failed:
        return example, *["-"] * (len(STAGES) + 2), failed[0]

    def both(one: str, other: str) -> str:
        return one if one == other else f"{one} / {other}"

    unknowns = both(*(f"{int(run['notes']['unknowns']):,}" for run in (old, new)))
    steps = both(*(f"{run['steps']:,}" for run in (old, new)))
    spent = [by_stage(run["stages"]) for run in (old, new)]
    stages = [both(*(f"{each[name]:.1f}" for each in spent)) for name in STAGES]
    return example, unknowns, steps, *stages, both(*(f"{sum(each.values()):.1f}" for each in spent))


def by_stage(seconds: Mapping[str, float]) -> dict[str, float]:
    """Seconds of the page's stages; those of a plan have a name for each trial."""
    found = dict.fromkeys(STAGES, 0.0)
    of = {name: stage for stage, names in STAGES.items() for name in names}
    for name, spent in seconds.items():
        found[of[name.split(":")[0]]] += spent
    return found


def _difference(old: Version, new: Version, example: str, start: str) -> Sequence[str]:
    """Largest difference of each group of channels, of a channel's peak, with the reason if it is above the wish."""
    name = example if start == "rest" else f"{example}, {start}"
    scene = _fixed(old, example, start)
    here = {**scene, "analysis": {**scene["analysis"], "accuracy": "quick"}}
    if not any(key in scene for key in ("drive", "drives")):  # where displacements are those of travel now
        here["output"] = renamed(scene["output"], {}, {"displacement": "travel"})
    words = {value: key for key, value in VALUES.items() if value != "rigid"}  # links were so called too
    there = renamed(scene, {value: key for key, value in KEYS.items() if key != "step"}, words)
    runs = old.run(f"same-{start}", example, there), new.run(f"same-{start}", example, here)
    failed = [run["failed"] for run in runs if "failed" in run]
    if failed:
        return name, *["-"] * (len(GROUPS) + 2), failed[0]
    sizes = {(f"{int(run['notes']['unknowns']):,}", f"{run['steps']:,}") for run in runs}
    if len(sizes) > 1:
        return name, *["-"] * (len(GROUPS) + 2), f"discretisations differ: {sizes}"
    a, b = (channels(KEPT / f"same-{start}-{example}-{each.name}.npz") for each in (old, new))
    found = {group: _largest(pattern, a, b) for group, pattern in GROUPS.items()}
    reason = REASONS.get(name, "not explained") if max(x or 0.0 for x in found.values()) > WISH else ""
    return name, *sizes.pop(), *("-" if x is None else f"{x:.0e}" for x in found.values()), reason


def _fixed(old: Version, example: str, start: str) -> Raw:
    """A scene of the revision in today's words, with models, meshes and steps that leave nothing to choose."""
    scene: Raw = renamed(old.scene(example), KEYS | {"step": "step"}, VALUES)
    scene["analysis"] = {key: value for key, value in scene["analysis"].items() if key != "accuracy"}
    scene["analysis"]["initial"] = start
    scene["output"] = {**scene.get("output", {}), **QUIET}
    if example == "four_bar_accuracy":
        scene["analysis"]["steps_per_revolution"] = 360
    for link in scene["links"].values():
        if link.get("model") in {None, "reduced"}:
            link["model"] = "solid"
    if not any(key in scene for key in ("drive", "drives")):
        for probe in scene["output"]["probes"].values():
            if probe["quantity"] == "displacement":
                probe["frame"] = "world"
    if example in MESHED:
        across, revolutions = MESHED[example]
        scene["analysis"] |= {"revolutions": revolutions, "steps_per_revolution": 360}
        _mesh_once(scene, old.root / "examples" / example, across)
    return scene


def _mesh_once(scene: Raw, folder: Path, across: int) -> None:
    """Put today's mesh of 20-node hexahedra, in a file that both read, in the place of each link's shape."""
    for link in scene["links"].values():
        link |= {"element": "hex20", "mesh": {"elements_across": across}}
    made = meshed(scene_from({**scene, "analysis": {**scene["analysis"], "accuracy": "quick"}}, folder))
    for link in made.model.links:
        file = KEPT / f"{folder.name}-{link.name}.vtu"
        write_vtu(file, link.X, [(link.cell_type, link.cells)])
        scene["links"][link.name] |= {"shape": {"kind": "mesh", "file": str(file)}}
        scene["links"][link.name].pop("mesh")
    for joint in scene["joints"].values():
        joint.pop("faces", None)


def renamed(value: Any, keys: Mapping[str, str], words: Mapping[str, str]) -> Any:
    """A copy of a scene's tables with other names of keys and words."""
    if isinstance(value, dict):
        return {keys.get(key, key): renamed(each, keys, words) for key, each in value.items()}
    if isinstance(value, list):
        return [renamed(each, keys, words) for each in value]
    return words.get(value, value) if isinstance(value, str) else value


def channels(file: Path) -> dict[str, np.ndarray]:
    """Channels of a run, those of travel by the name that they had; without those that are rounding beside the forces."""
    with np.load(file) as kept:
        found = {name.replace("/travel", "/displacement"): kept[name] for name in kept.files}
    efforts = {name: np.abs(x).max() for name, x in found.items() if re.fullmatch(r".*(force|moment|torque)", name)}
    least = ROUNDING * max(efforts.values())
    return {name: x for name, x in found.items() if efforts.get(name, np.inf) > least}


def _largest(pattern: str, a: Mapping[str, np.ndarray], b: Mapping[str, np.ndarray]) -> float | None:
    """The largest difference of the channels of a group, each of its own peak, energies of the largest of them."""
    names = [name for name in a if name in b and re.fullmatch(pattern, name)]
    peaks = {name: float(np.abs(a[name]).max()) for name in names}
    if pattern == GROUPS["energies"]:
        peaks = dict.fromkeys(peaks, max(peaks.values(), default=1.0))
    return max((float(np.abs(a[name] - b[name]).max()) / peaks[name] for name in names if peaks[name]), default=None)


if __name__ == "__main__":
    script(bench_before)
