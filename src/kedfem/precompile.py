"""Compiles all that scenes need, before the first of them runs: by a few steps of small ones."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from kedfem.analysis import analyse
from kedfem.scene import read_scene

ARM = """
title = "Compiled beforehand"
[points]
A = [0, 0]
B = [0.6, 0]
[links.arm]
fidelity = "beam"
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
KINDS = {
    "rigid-body frames": DRIVEN + ANALYSIS,
    "stiffening": DRIVEN + ANALYSIS + "stiffening = true\n",
    "co-rotational frames": DRIVEN + ANALYSIS + 'frames = "co-rotational"\n',
    "force elements": FREE + ANALYSIS,
}
"""Each kind of step, on the smallest scene that takes it."""


def precompile(watch: Callable[[str, int, int], None]) -> None:
    """Run a few steps of each kind, so that all that they need is compiled and kept."""
    for done, (kind, rest) in enumerate(KINDS.items()):
        watch(kind, done, len(KINDS))
        with TemporaryDirectory() as folder:
            scene = Path(folder, "scene.toml")
            scene.write_text(ARM + rest, encoding="utf-8")
            analyse(read_scene(scene))
