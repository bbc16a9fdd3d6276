"""Compiles all that scenes need, before the first of them runs: by a few steps of small ones."""

import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

ARM = """
title = "Compiled beforehand"
[points]
A = [0, 0]
B = [0.6, 0]
[links.arm]
model = "beam"
material = "aluminium"
shape = { kind = "bar", between = ["A", "B"], width = 0.01, thickness = 0.02 }
mesh = { elements = 2 }
element = "beam3"
[joints.A]
kind = "revolute"
links = ["ground", "arm"]
at = "A"
[output.probes.tip]
link = "arm"
at = "B"
quantity = "position"
"""
DRIVEN = """
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = 1.0 }
"""
FREE = """
[motors.at_A]
joint = "A"
torque = 0.1
"""
ANALYSIS = """
[analysis]
end_time = 3e-3
step = 1e-3
accuracy = "quick"
"""
BUSHING = """
[joints.A.bushing]
stiffness = 1e6
"""
KINDS = {
    "rigid-body frames": DRIVEN + ANALYSIS,
    "rigid-body frames and bushings": BUSHING + DRIVEN + ANALYSIS,
    "stiffening": DRIVEN + ANALYSIS + "stiffening = true\n",
    "co-rotational frames": DRIVEN + ANALYSIS + 'frames = "co-rotational"\n',
    "force elements": FREE + ANALYSIS,
}
"""Each kind of step, on the smallest scene that takes it, without constraint equations and with them."""
LINEAR = ("rigid-body frames", "rigid-body frames and bushings")
"""Those that take the loop of linear steps; it is compiled beside the other, which the rest take."""


def precompile(watch: Callable[[str, int, int], None]) -> None:
    """Run a few steps of each kind, in two processes: all that they need is compiled and kept, once."""
    from kedfem.compiled import all_compiled

    done = all_compiled()
    if done.exists():
        return
    others = [kind for kind in KINDS if kind not in LINEAR]
    command = [sys.executable, "-c", f"from kedfem.precompile import few_steps; few_steps(*{others})"]
    beside = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        watch(LINEAR[0], 0, len(KINDS))
        few_steps(*LINEAR)
        _count_cycles()
        watch(others[0], len(LINEAR), len(KINDS))
        failed = beside.wait()
    finally:
        beside.kill()
        beside.wait()
    if not failed:
        with suppress(OSError):
            done.touch()


def few_steps(*kinds: str) -> None:
    """Steps of some kinds, in a folder that does not stay, by loops that all scenes may take."""
    from kedfem.analysis import analyse
    from kedfem.compiled import for_all_scenes
    from kedfem.scene import read_scene

    with TemporaryDirectory() as folder, for_all_scenes():
        for number, kind in enumerate(kinds):
            scene = Path(folder, f"{number}.toml")
            scene.write_text(ARM + KINDS[kind], encoding="utf-8")
            analyse(read_scene(scene))


def _count_cycles() -> None:
    """The loop of fatigue, which no steps take."""
    import numpy as np

    from kedfem.results.fatigue.counting_kernel import counted

    counted(np.zeros((1, 4)), 0.0, np.array([-1.0, 0.0, 1.0]), np.array([9.0, 0.0, -5.0]), 0.0, np.zeros((1, 4)))
