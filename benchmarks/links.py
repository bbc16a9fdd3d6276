"""Cost that grows with the number of links, stage by stage: `python -m benchmarks.links --before ../another-checkout`.

Mechanisms of beams with one element, 100 steps, as a whole run writes them, in four topologies. Every run is a process of
its own, given up after a limit. Sizes, limit and topologies can be chosen; with another checkout each size is measured
there too, in turn.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

STEPS, SIZES = 100, (10, 30, 100, 300)
Z = [0.0, 0.0, 1.0]
Raw = dict[str, Any]


def beam(a: Any, b: Any, **more: Any) -> Raw:
    """A steel bar of 20 mm by 20 mm, one beam element."""
    ends = [[float(x) for x in end] for end in (a, b)]
    shape = {"kind": "bar", "between": ends, "width": 0.02, "thickness": 0.02}
    return {"material": "steel", "model": "beam", "shape": shape, "mesh": {"elements": 1}, **more}


def hinge(one: str, other: str, at: Any) -> Raw:
    """A revolute joint about z."""
    return {"kind": "revolute", "links": [one, other], "at": [float(x) for x in at], "axis": Z}


def scene(links: Raw, joints: Raw, **more: Any) -> Raw:
    """With 100 steps of 0.5 ms from rest; neither pictures nor animation."""
    usual = {
        "analysis": {"end_time": STEPS * 5e-4, "step": 5e-4, "initial": "rest", "frames": "rigid-body"},
        "output": {"animation": None, "plots": False, "picture": False, "csv": False},
    }
    return {"links": links, "joints": joints, **usual, **more}


def turning(joint: str) -> Raw:
    """A drive that begins at rest and turns by 60 degrees."""
    return {"joint": joint, "motion": {"kind": "cycloidal", "angle": "60 deg", "rise": STEPS * 5e-4}}


def one_drive(n: int) -> Raw:
    """A driven four-bar whose rocker drives the next by a coupler, and so on: two links a loop."""
    up, along = np.array([0.05, 0.3, 0.0]), np.array([0.4, 0.0, 0.0])
    links, joints = {"crank": beam(np.zeros(3), up)}, {"A": hinge("ground", "crank", np.zeros(3))}
    before = "crank"
    for k in range((n - 1) // 2):
        foot = (k + 1) * along
        links |= {f"c{k}": beam(k * along + up, foot + up), f"r{k}": beam(foot + up, foot)}
        joints |= {
            f"B{k}": hinge(before, f"c{k}", k * along + up),
            f"C{k}": hinge(f"c{k}", f"r{k}", foot + up),
            f"D{k}": hinge(f"r{k}", "ground", foot),
        }
        before = f"r{k}"
    return scene(links, joints, drive=turning("A"))


def each_driven(n: int) -> Raw:
    """Four-bars side by side, each with a drive of its own: three links each."""
    links: Raw = {}
    joints: Raw = {}
    B, C, D = np.array([0.05, 0.3, 0.0]), np.array([0.45, 0.35, 0.0]), np.array([0.4, 0.0, 0.0])
    count = max(n // 3, 1)
    for k in range(count):
        o = np.array([0.6 * k, 0.0, 0.0])
        links |= {f"a{k}": beam(o, o + B), f"b{k}": beam(o + B, o + C), f"c{k}": beam(o + C, o + D)}
        joints |= {
            f"A{k}": hinge("ground", f"a{k}", o),
            f"B{k}": hinge(f"a{k}", f"b{k}", o + B),
            f"C{k}": hinge(f"b{k}", f"c{k}", o + C),
            f"D{k}": hinge(f"c{k}", "ground", o + D),
        }
    return scene(links, joints, drives={f"A{k}": turning(f"A{k}") for k in range(count)})


def pendulum(n: int) -> Raw:
    """A chain of bars that falls from the horizontal: no drive, co-rotational frames."""
    at = [np.array([0.1 * k, 0.0, 0.0]) for k in range(n + 1)]
    links = {f"l{k}": beam(at[k], at[k + 1]) for k in range(n)}
    joints = {f"J{k}": hinge("ground" if k == 0 else f"l{k - 1}", f"l{k}", at[k]) for k in range(n)}
    raw = scene(links, joints, gravity=[0.0, -9.81, 0.0])
    raw["analysis"]["frames"] = "co-rotational"
    return raw


def truss(n: int) -> Raw:
    """A boom of rods in space on a driven base: three rods to every node, held by crosses and balls, determinate."""
    turn = 2 * np.pi / 3
    node = [np.array([0.2 * np.cos(turn * k), 0.2 * np.sin(turn * k), 0.12 * k]) for k in range(n // 3 + 3)]
    links: Raw = {"base": beam(node[0], node[2])}
    links["base"]["shape"] = {
        "kind": "polyline",
        "points": [x.tolist() for x in node[:3]],
        "width": 0.02,
        "thickness": 0.02,
    }
    joints: Raw = {"A": hinge("ground", "base", node[1])}
    middle = dict.fromkeys(range(3), "base")  # of each node, the link that the others are joined to
    for k in range(3, len(node)):
        for j in (k - 3, k - 2, k - 1):
            name = f"r{j}_{k}"
            links[name] = beam(node[j], node[k])
            d = node[k] - node[j]
            one = np.cross(d, Z)
            other = np.cross(d, one)
            axes = [(x / np.linalg.norm(x)).tolist() for x in (one, other)]
            joints[f"U{j}_{k}"] = {"kind": "universal", "links": [middle[j], name], "at": node[j].tolist(), "axes": axes}
            if k in middle:
                joints[f"S{j}_{k}"] = {"kind": "spherical", "links": [middle[k], name], "at": node[k].tolist()}
            else:
                middle[k] = name
    return scene(links, joints, drive=turning("A"))


TOPOLOGIES: dict[str, Callable[[int], Raw]] = {
    "one drive, loops in a row": one_drive,
    "a drive on each four-bar": each_driven,
    "pendulum, no drive": pendulum,
    "boom of rods in space": truss,
}


def measured(topology: str, n: int) -> Raw:
    """Processor seconds of each stage of a whole run, with the peak of memory; in a process that has run a small one."""
    time.perf_counter = time.process_time  # the package, imported only now, counts its stages by it
    from kedfem import analysis
    from kedfem.scene import scene_from

    def ran(raw: Raw) -> dict[str, float]:
        with TemporaryDirectory() as folder:
            raw["output"]["folder"] = f"{folder}/results"
            since = time.process_time()
            spent = dict(analysis.analyse(scene_from(raw)).seconds)
            return {**spent, "whole": time.process_time() - since}

    make = TOPOLOGIES[topology]
    ran(make(18))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    raw = make(n)
    spent = ran(raw)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {"links": len(raw["links"]), "seconds": spent, "memory": 1024.0 * (after - before), "peak": 1024.0 * after}


def one(topology: str, n: int, limit: float, checkout: Path | None) -> Raw | None:
    """One run in a process of its own, of this checkout or another; None if it did not end in time."""
    here = Path(__file__).resolve()
    environment = {**os.environ, "PYTHONPATH": f"{(checkout or here.parents[1]) / 'src'}"}
    command = [sys.executable, str(here), "--one", topology, str(n)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=limit, env=environment)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        raise SystemExit(f"{topology}, {n} links:\n{done.stderr}")
    found: Raw = json.loads(done.stdout.splitlines()[-1])
    return found


def row(name: str, found: Raw | None, limit: float) -> str:
    """A line of the table: seconds, memory, and the dearest stages."""
    if found is None:
        return f"| {name} | > {limit:.0f} |  |  |  |"
    spent = found["seconds"]
    stages = sorted((k for k in spent if k != "whole" and spent[k] >= 0.03 * spent["whole"]), key=lambda k: -spent[k])
    most = ", ".join(f"{k} {spent[k]:.2f}" for k in stages[:5])
    return f"| {name} | {spent['whole']:.2f} | {found['memory'] / 1e6:.0f} | {found['peak'] / 1e6:.0f} | {most} |"


def main() -> None:
    """The table of docs/performance.md, and slopes between 30 and 300 links."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--one", nargs=2)
    parser.add_argument("--sizes", type=int, nargs="*", default=list(SIZES))
    parser.add_argument("--limit", type=float, default=60.0, help="seconds after which a run is given up")
    parser.add_argument("--before", type=Path, help="another checkout to measure beside this one")
    parser.add_argument("--only", nargs="*", default=list(TOPOLOGIES))
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(measured(asked.one[0], int(asked.one[1]))))
        return
    print(
        "| links | processor time [s] | memory [MB] | peak of the process [MB] | stages [s] |\n|---|---:|---:|---:|---|"
    )
    for name in asked.only:
        found: dict[int, Raw] = {}
        lost = set()
        for n in asked.sizes:
            for label, checkout in (("before", asked.before), ("", None)):
                if (label and checkout is None) or label in lost:
                    continue
                got = one(name, n, asked.limit, checkout)
                print(row(f"{name}, {n}{', ' * bool(label)}{label}", got, asked.limit), flush=True)
                if got is None:
                    lost.add(label)
                elif not label:
                    found[n] = got
        if len(found) > 1:
            least, most = sorted(found)[-2], max(found)
            if 30 in found and most > 30:
                least = 30
            a, b = found[least], found[most]
            ratio = np.log(b["links"] / a["links"])
            time = np.log(b["seconds"]["whole"] / a["seconds"]["whole"]) / ratio
            space = np.log(max(b["memory"], 1.0) / max(a["memory"], 1.0)) / ratio
            print(f"| slope from {least} to {most} | {time:.2f} | {space:.2f} |  |  |", flush=True)


if __name__ == "__main__":
    main()
